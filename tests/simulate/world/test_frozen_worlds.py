"""The worlds that scenarios are compiled to, pinned: roads, starts, sizes, scripts, light."""

from typing import Any

import pytest

from adeye.campaign.plan import make_plan
from adeye.errors import AdeyeError
from adeye.simulate.world.compile import compile_world
from tests.frozen import assert_frozen, described, masked
from tests.project import ROOT

ODDS = ("fault_campaign", "motorway_chauffeur", "rural_two_way", "sensor_study", "ramp_routes")


@pytest.mark.parametrize("name", ODDS)
def test_worlds_of_an_odd_are_frozen(name: str) -> None:
    """Of the first and the last situation of each scenario."""
    plan = make_plan(ROOT / "odd" / f"{name}.yaml")
    lines, groups = [], dict[str, list[Any]]()
    for case in plan.cases:
        groups.setdefault(case.scenario_id, []).append(case)
    for use, cases in groups.items():
        ends = [cases[0], cases[-1]]
        try:
            world = compile_world(ends)
        except AdeyeError as error:
            lines.append(f"{use}: {error}")
            continue
        lines += described(world, use)
    assert_frozen(f"worlds_{name}.txt", masked("\n".join(lines), ROOT))
