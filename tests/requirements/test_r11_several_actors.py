"""R11: scripted and reactive vehicles and a pedestrian share one scenario."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import MakeProject
from tests.project import run_cases

pytestmark = pytest.mark.requirements


def test_scripted_reactive_and_walking_actors_together(make_project: MakeProject) -> None:
    project = make_project()
    scenario = project.read("scenarios_db/motorway/cut_in.yaml")
    scenario["scenario"] = "busy"
    scenario["actors"]["follower"] = {
        "kind": "car",
        "start": {"lane": 2, "s": "40 m", "speed": "ego_speed"},
        "reactive": {"desired_speed": "ego_speed + 10 km/h"},
    }
    scenario["actors"]["walker"] = {
        "kind": "pedestrian",
        "start": {"offset": "-2 m", "s": "600 m", "heading": "90 deg", "speed": "0 m/s"},
    }
    scenario["actors"]["rider"] = {
        "kind": "cyclist",
        "start": {"offset": "-1.5 m", "s": "300 m", "speed": "5 m/s"},
    }
    scenario["storyboard"]["walk"] = {
        "actor": "walker",
        "when": "time >= 1 s",
        "cross": {"to": "-0.5 m", "speed": "1.2 m/s"},
    }
    project.write("scenarios_db/motorway/busy.yaml", scenario)
    with project.edited_odd() as odd:
        odd["scenarios"] = [{"use": "busy", "as": "cut_in", "faults": ["none"]}]
    plan = project.plan()
    trace = run_cases(plan, [plan.cases[0]])
    names = trace.layout.context.object_ids
    rows = int(trace.length[0])
    speeds = {name: trace["objects"][0, :rows, k, 3] for k, name in enumerate(names)}
    assert speeds["follower"][-1] > speeds["follower"][0]
    assert speeds["walker"].max() == pytest.approx(1.2)
    assert np.allclose(speeds["rider"], 5.0)
    assert np.isfinite(trace["begun"][0, rows - 1]).any()
