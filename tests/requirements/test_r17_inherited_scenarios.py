"""R17: a scenario is made by hand and adapted by inheritance and overrides, without a copy."""

from __future__ import annotations

import pytest

from tests.conftest import MakeProject
from tests.project import run_cases

pytestmark = pytest.mark.requirements

ON_A_BEND = """
extends: cut_in
scenario: cut_in_on_a_bend
title: Cut-in on a bend
world: {road: {kind: curve, radius: 2000 m}}
actors: {cutter: {kind: van}}
"""


def test_scenario_extends_another_and_overrides_parts(make_project: MakeProject) -> None:
    project = make_project()
    path = project.folder / "scenarios_db" / "motorway" / "cut_in_on_a_bend.yaml"
    path.write_text(ON_A_BEND, "utf-8")
    with project.edited_odd() as odd:
        odd["scenarios"] = [
            {"use": "cut_in", "faults": ["none"]},
            {"use": "cut_in_on_a_bend", "faults": ["none"]},
            {
                "use": "cut_in",
                "as": "narrow",
                "faults": ["none"],
                "parameters": {"scenario.world.road.lane_width": "3 m"},
            },
        ]
    plan = project.plan()
    cases = {
        case.scenario_id: case
        for case in plan.cases
        if case.architecture.architecture == "camera_radar"
    }
    straight = run_cases(plan, [cases["cut_in"]])
    bend = run_cases(plan, [cases["cut_in_on_a_bend"]])
    assert abs(straight["ego"][0, -1, 2]) < 0.01
    assert bend["ego"][0, -1, 2] > 0.1
    assert cases["cut_in_on_a_bend"].scenario.actors["cutter"].kind == "van"
    narrow = run_cases(plan, [cases["narrow"]])
    assert narrow.layout.context.road.lane_width[0] == 3.0
