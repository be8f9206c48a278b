"""R11: vehicles, a pedestrian and a cyclist, scripted and reactive, in one scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.signals import OBJECT_CLASSES, OBJECT_SPEED, OBJECT_Y
from tests.project import MINI, run_cases

if TYPE_CHECKING:
    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements

STREET: dict[str, Any] = {
    "scenario": "street",
    "title": "A street with company",
    "provenance": {"source": "made for a test"},
    "parameters": {"ego_speed": {"default": "30 km/h"}},
    "world": {
        "road": {
            "kind": "straight",
            "road_type": "urban",
            "length": "600 m",
            "lanes": 2,
            "lane_width": "3.5 m",
            "shoulder": "1 m",
            "speed_limit": "50 km/h",
        },
        "objects": {
            "van_at_the_kerb": {
                "kind": "parked_car",
                "s": "90 m",
                "offset": "-1.5 m",
                "length": "5 m",
                "width": "2 m",
                "height": "2 m",
            }
        },
    },
    "environment": {"rain": "0 mm/h", "fog_visibility": "5 km", "friction": 0.8},
    "ego": {"lane": 0, "s": "20 m", "speed": "ego_speed"},
    "actors": {
        "leader": {
            "kind": "truck",
            "start": {"lane": 1, "s": "120 m", "speed": "20 km/h"},
        },
        "follower": {
            "kind": "car",
            "start": {"lane": 1, "s": "70 m", "speed": "45 km/h"},
            "reactive": {"desired_speed": "50 km/h"},
        },
        "cyclist": {"kind": "cyclist", "start": {"lane": 0, "s": "200 m", "speed": "15 km/h"}},
        "walker": {
            "kind": "pedestrian",
            "start": {"offset": "9 m", "s": "300 m", "heading": "-90 deg", "speed": "0 m/s"},
        },
    },
    "storyboard": {
        "step_out": {
            "actor": "walker",
            "when": "time >= 1 s",
            "cross": {"to": "-1.5 m", "speed": "1.5 m/s"},
        },
        "truck_stops": {"actor": "leader", "when": "time >= 2 s", "stop": {"rate": "2 m/s^2"}},
    },
    "realised": ["step_out"],
    "horizon": "6 s",
    "tail": "13 s",
}


def test_every_kind_of_participant_moves_in_its_own_way(make_project: MakeProject) -> None:
    odd = {
        **MINI,
        "scenarios": [{"use": "street", "faults": ["none"]}],
        "faults": [],
        "architectures": ["architectures/camera_radar.yaml"],
    }
    project = make_project(odd)
    project.write("scenarios_db/urban/street.yaml", STREET)
    plan = project.plan()
    trace = run_cases(plan, [plan.cases[0]])
    context = trace.layout.context
    kinds = {
        name: OBJECT_CLASSES[kind]
        for name, kind in zip(context.object_ids, context.object_classes, strict=True)
    }
    assert kinds == {
        "leader": "truck",
        "follower": "car",
        "cyclist": "cyclist",
        "walker": "pedestrian",
        "van_at_the_kerb": "parked_car",
    }
    rows = int(trace.length[0])
    at = {name: trace["objects"][0, :rows, context.object_ids.index(name)] for name in kinds}
    # Scripted: the truck stops, the pedestrian crosses, the cyclist rides on.
    assert at["leader"][-1, OBJECT_SPEED] == 0.0
    assert at["walker"][0, OBJECT_Y] - at["walker"][-1, OBJECT_Y] > 5.0
    assert at["cyclist"][-1, OBJECT_SPEED] == pytest.approx(15.0 / 3.6)
    # Reactive: nobody told the car to brake, but there is a truck ahead of it.
    assert at["follower"][:, OBJECT_SPEED].min() < 1.0
    assert np.all(at["leader"][:, 0] - at["follower"][:, 0] > 5.0)
    assert np.ptp(at["van_at_the_kerb"][:, 0]) == 0.0
