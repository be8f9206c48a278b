"""Maps of where FSRs fail: over the axes that matter, each failing FSR with one, small enough."""

import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adeye.campaign.plan import CampaignPlan
from adeye.judge.verdict import FAIL, PASS, Verdict
from adeye.report.model.report import Report
from adeye.report.where.maps import MOST_MAPS, map_failures
from adeye.report.where.records import FailureMap, FailureMaps
from adeye.report.where.tell import tell_where
from adeye.store.read.bulk import Labels
from adeye.sweep.case import TestCase
from tests.project import Executed, Project
from tests.report.where.planting import SAFE, compared_of

GATE = "camera_radar"


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> CampaignPlan:
    return Project(tmp_path_factory.mktemp("maps") / "project", SAFE).plan()


def mapped(plan: CampaignPlan, fails: Callable[[TestCase], bool]) -> FailureMap:
    codes = [FAIL if fails(case) else PASS for case in plan.cases]
    found = map_failures(
        [("FSR-1", GATE)],
        compared_of(plan, {"FSR-1": codes}),
        plan.record().odd.content,
        lambda text: f"{text} --db my.db",
    )
    assert isinstance(found, FailureMaps)
    (only,) = found.maps
    return only


def test_map_is_over_the_axes_that_hold_the_failures_apart(plan: CampaignPlan) -> None:
    def fails(case: TestCase) -> bool:
        return float(case.point["gap"]) < 30.0 and float(case.point["ego_speed"]) * 3.6 > 99.0

    found = mapped(plan, fails)
    assert set(found.by) == {"gap", "ego_speed"}
    assert found.separation is not None
    assert len(found.levels) == len(found.down) * len(found.across) == 15
    for down in found.down:
        for across in found.across:
            level = found.level(down, across)
            assert level is not None
            at = dict(zip(found.by, (down, across), strict=True))
            is_failing = at["gap"] in {"20 m", "24 m", "28 m"} and at["ego_speed"] != "80 km/h"
            # Three ranges, with and without the fault.
            assert (level.tally.failed, level.tally.passed) == ((6, 0) if is_failing else (0, 6))
    assert found.command == (
        f"adeye where FSR-1 --by {','.join(found.by)} --architecture {GATE} --db my.db"
    )


def test_map_over_one_axis_is_one_row(plan: CampaignPlan) -> None:
    found = mapped(plan, lambda case: float(case.point["gap"]) < 22.0)
    assert (found.by, found.down) == (("gap",), ())
    assert found.across == ("20 m", "24 m", "28 m", "32 m", "40 m")
    assert [level.tally.failed for level in found.levels] == [18, 0, 0, 0, 0]


def test_where_no_axis_matters_there_is_no_table(plan: CampaignPlan) -> None:
    found = mapped(plan, lambda _: True)
    assert (found.by, found.levels, found.separation) == ((), (), None)
    assert found.tally.failed == len(plan.cases)


def test_nothing_that_fails_has_no_map(plan: CampaignPlan) -> None:
    compared = compared_of(plan, {"FSR-1": [PASS] * len(plan.cases)})
    assert map_failures([("FSR-1", GATE)], compared, plan.record().odd.content, str) is None


def many(scenarios: int, faults: int, fsrs: int) -> tuple[Any, dict[str, Any]]:
    """Make a campaign of scenarios with many faults, of which the later ones fail more FSRs."""
    rows = [(place, fault) for place in range(scenarios) for fault in range(faults)]
    codes = np.array([[FAIL if fault >= 2 else PASS] * fsrs for _, fault in rows])
    compared = SimpleNamespace(
        fsrs=tuple(f"FSR-{number}" for number in range(fsrs)),
        verdict=codes,
        scenario=Labels.of([f"s{place}" for place, _ in rows]),
        architecture=Labels.of(["a"] * len(rows)),
        fault_entry=Labels.of([f"f{fault:02}" for _, fault in rows]),
        place=Labels.of([json.dumps({})] * len(rows)),
        replicate=np.zeros(len(rows), dtype=np.int64),
        margin=np.full(codes.shape, np.nan),
        robustness=np.full(codes.shape, np.nan),
        measured=np.full_like(codes, -1),
        units=(),
        result=tuple(f"r{place}-{fault}" for place, fault in rows),
    )
    return compared, {"scenarios": {f"s{place}": {"parameters": {}} for place in range(scenarios)}}


def test_each_fsr_has_a_map_before_any_has_a_second_and_the_rest_is_counted() -> None:
    compared, odd = many(scenarios=5, faults=4, fsrs=4)
    failing = [(name, "a") for name in compared.fsrs]
    found = map_failures(failing, compared, odd, str)
    assert found is not None
    assert [item.fsr for item in found.maps] == [name for name in compared.fsrs for _ in range(3)]
    assert (len(found.maps), found.left_out) == (MOST_MAPS, 5 * 4 - MOST_MAPS)


def test_axis_without_an_order_keeps_the_values_with_most_failures_and_says_how_many_it_left() -> (
    None
):
    compared, odd = many(scenarios=1, faults=20, fsrs=1)
    found = map_failures([("FSR-0", "a")], compared, odd, str)
    assert found is not None
    (only,) = found.maps
    assert (only.by, only.left_out) == (("fault",), (8,))
    assert only.across == tuple(f"f{fault:02}" for fault in range(2, 14))
    assert [level.at[0] for level in only.levels] == list(only.across)


def test_maps_of_a_report_say_what_where_says(mini: Executed, plain: Report) -> None:
    assert plain.failing is not None
    failing = {
        (cell.fsr, cell.architecture)
        for cell in plain.cells
        if cell.scenario is None and cell.verdict is Verdict.FAIL
    }
    assert {(item.fsr, item.architecture) for item in plain.failing.maps} == failing
    with mini.opened() as (repository, campaign):
        for item in plain.failing.maps:
            found = tell_where(
                repository,
                campaign,
                item.fsr,
                by=item.by,
                architectures=[item.architecture],
            )
            (site,) = [
                site
                for site in found.sites
                if (site.scenario, site.faults) == (item.scenario, item.faults)
            ]
            assert (item.tally, item.margin, item.unit) == (site.tally, site.margin, site.unit)
            assert item.levels == site.table
