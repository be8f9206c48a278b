"""R16: a second sensor of a type is a second name; no code."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np
import pytest

from adeye.campaign.plan import signal_table
from tests.project import CANDIDATE, MINI, run_cases

if TYPE_CHECKING:
    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements


def test_second_radar_is_an_instance_of_its_own(make_project: MakeProject) -> None:
    project = make_project(
        {
            **MINI,
            "scenarios": [{"use": "cut_in", "faults": ["none"]}],
            "faults": [],
            "architectures": ["architectures/camera_radar.yaml"],
        }
    )
    alone = project.plan()
    before = run_cases(alone, [alone.cases[0]])
    with project.edited(CANDIDATE) as candidate:
        second = copy.deepcopy(candidate["sensors"]["front_radar"])
        second["mount"]["y"] = "0.5 m"
        candidate["sensors"]["right_radar"] = second
    plan = project.plan()
    trace = run_cases(plan, [plan.cases[0]])
    names = trace.layout.sensors
    assert {"front_radar", "right_radar"} <= set(names)
    one, other = names.index("front_radar"), names.index("right_radar")
    seen = np.asarray(trace["detected"][0, :, :, 0], dtype=np.bool_)
    both = seen[:, one] & seen[:, other]
    assert both.sum() > 20
    places = trace["detections"][0, :, :, 0]
    assert not np.any(np.all(places[both, one] == places[both, other], axis=-1))
    # The first one measures what it measured alone.
    then = before.layout.sensors.index("front_radar")
    assert np.array_equal(before["detections"][0, :, then], places[:, one, np.newaxis])
    names_of_signals = {row.name for row in signal_table(plan)}
    assert "sensor.right_radar.detects.cutter" in names_of_signals
