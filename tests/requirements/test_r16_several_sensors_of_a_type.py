"""R16: a second sensor of a type is a second name, with noise of its own."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.trace import Trace
from tests.conftest import MakeProject
from tests.project import CANDIDATE, Project, run_cases

pytestmark = pytest.mark.requirements


def test_second_radar_is_a_second_name_and_changes_no_other_noise(
    make_project: MakeProject,
) -> None:
    project = make_project()
    alone = _trace(project)
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["second_radar"] = dict(candidate["sensors"]["front_radar"])
    both = _trace(project)
    old, kept, new = (
        alone.layout.sensors.index("front_radar"),
        both.layout.sensors.index("front_radar"),
        both.layout.sensors.index("second_radar"),
    )
    rows = int(alone.length[0]) - 1
    before = alone["detections"][0, :rows, old]
    np.testing.assert_array_equal(before, both["detections"][0, :rows, kept])
    assert (both["detections"][0, :rows, new] != before).any()


def _trace(project: Project) -> Trace:
    plan = project.plan()
    case = next(
        case
        for case in plan.cases
        if case.architecture.architecture == "camera_radar" and case.fault_entry == "none"
    )
    return run_cases(plan, [case])
