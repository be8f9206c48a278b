"""R17: worlds and scenarios are written by hand, inherited from and overridden."""

from typing import Any

import pytest

from adeye.signals import PLACE_CURVATURE, PLACE_LANE
from tests.conftest import MakeProject
from tests.project import odd_of, run_cases, use

pytestmark = pytest.mark.requirements

ODD = odd_of(
    "lead_braking",
    "braking_on_a_bend",
    use("braking_on_a_bend")
    | {"as": "braking_on_a_wet_bend", "parameters": {"rain": "7.5 mm/h", "scenario.ego.lane": 0}},
)
BEND: dict[str, Any] = {
    "extends": "lead_braking",
    "scenario": "braking_on_a_bend",
    "title": "Braking of the lead vehicle on a bend",
    "world": {"road": {"kind": "curve", "radius": "900 m", "lanes": 2}},
}


@pytest.mark.slow
def test_scenario_inherits_and_overrides_by_file_and_by_odd(make_project: MakeProject) -> None:
    project = make_project(ODD)
    project.write("scenarios_db/motorway/braking_on_a_bend.yaml", BEND)
    plan = project.plan()
    straight, bend, wet = plan.cases
    assert straight.scenario.world.road.kind == "straight"
    assert (bend.scenario.world.road.kind, bend.scenario.world.road.lanes) == ("curve", 2)
    # What is not overridden is inherited.
    assert bend.scenario.storyboard == straight.scenario.storyboard
    assert wet.parameters["rain"] > bend.parameters["rain"] == 0.0
    traces = [run_cases(plan, [case]) for case in plan.cases]
    # A bend begins after a straight lead-in.
    curvature = [trace["ego_place"][0, 100, PLACE_CURVATURE] for trace in traces]
    assert curvature == pytest.approx([0.0, 1.0 / 900.0, 1.0 / 900.0], rel=0.02)
    lanes = [int(trace["ego_place"][0, 0, PLACE_LANE]) for trace in traces]
    assert lanes == [1, 1, 0]
    # On the bend the ego stays in its lane, so its heading turns.
    heading = traces[1]["ego"][0, : traces[1].length[0], 2]
    assert heading.max() - heading.min() > 0.05
    assert len({trace.digests()[0] for trace in traces}) == 3
