"""R19: which sensor feeds which channel is a table that can be changed and whose parts are swept."""

from __future__ import annotations

import pytest

from adeye.spec.architecture import Radar
from adeye.sweep.case import TestCase
from tests.conftest import MakeProject
from tests.project import CANDIDATE, run_cases

pytestmark = pytest.mark.requirements


def test_unlinked_sensor_no_longer_reaches_the_channel(make_project: MakeProject) -> None:
    project = make_project()
    plan = project.plan()
    case = next(case for case in plan.cases if _is_candidate(case))
    linked = run_cases(plan, [case])
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"]["links"].remove("front_radar")
    plan = project.plan()
    case = next(case for case in plan.cases if _is_candidate(case))
    unlinked = run_cases(plan, [case])
    radar = linked.layout.sensors.index("front_radar")
    first = int(linked.length[0]) // 50
    assert (linked["detected"][0, :first, radar] == unlinked["detected"][0, :first, radar]).all(), (
        "the sensor itself is as it was"
    )
    nominal = linked.layout.channels.index("nominal")
    assert (linked["acceleration"][0, :, nominal] != unlinked["acceleration"][0, :, nominal]).any()


def test_parameters_of_a_linked_sensor_are_swept(make_project: MakeProject) -> None:
    project = make_project()
    axis = "architecture.sensors.front_radar.mount.yaw"
    with project.edited_odd() as odd:
        odd["scenarios"] = [
            {
                "use": "cut_in",
                "faults": ["none"],
                "sweep": {"parameters": {axis: ["0 deg", "5 deg"]}},
            }
        ]
    radars = [
        case.architecture.sensors["front_radar"]
        for case in project.plan().cases
        if _is_candidate(case)
    ]
    yaws = {round(radar.mount.yaw, 3) for radar in radars if isinstance(radar, Radar)}
    assert yaws == {0.0, 0.087}


def _is_candidate(case: TestCase) -> bool:
    return case.architecture.architecture == "camera_radar"
