"""R21: faults stand in the file of the sweep, and are swept like everything else."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from adeye.campaign.studies.fault_timing import campaign_injections
from tests.project import CANDIDATE, MINI

if TYPE_CHECKING:
    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements


@pytest.mark.slow
def test_fault_entries_and_fault_parameters_are_axes_of_the_sweep(
    make_project: MakeProject,
) -> None:
    sweep = {
        "parameters": {
            "gap": ["30 m", "50 m"],
            "faults.front_camera_out.duration": ["0.5 s", "3 s"],
            "faults.front_camera_out.onset.at": ["1 s", "2 s"],
        }
    }
    faults = ["front_camera_out"]
    project = make_project(
        {
            **MINI,
            "scenarios": [{"use": "cut_in", "faults": faults, "sweep": sweep}],
            "architectures": ["architectures/camera_radar.yaml"],
        }
    )
    plan = project.plan()
    by_entry: dict[str, int] = {}
    for case in plan.cases:
        by_entry[case.fault_entry] = by_entry.get(case.fault_entry, 0) + 1
    # The fault-free twin is always there, once per situation: its fault has nothing to vary.
    assert by_entry == {"none": 2, "front_camera_out": 2 * 2 * 2}
    faulty = [case for case in plan.cases if case.faults]
    assert {(case.faults[0].duration, case.faults[0].onset.at) for case in faulty} == {
        (0.5, 1.0),
        (0.5, 2.0),
        (3.0, 1.0),
        (3.0, 2.0),
    }
    situations = {case.situation_digest for case in plan.cases}
    assert len(situations) == 2
    assert project.run().executed == 10
    events = {
        (row["fault_entry"], row["point"].get("faults.front_camera_out.duration"))
        for row in project.rows()
    }
    assert events == {("none", None), ("front_camera_out", 0.5), ("front_camera_out", 3.0)}


def test_onset_and_duration_are_axes_of_the_same_sweep(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        odd["scenarios"] = [
            {
                "use": "cut_in",
                "faults": ["front_camera_out", ["front_camera_out", "nominal_silent"]],
                "sweep": {
                    "parameters": {
                        "gap": ["30 m", "50 m"],
                        "faults.front_camera_out.onset.at": ["1 s", "2 s"],
                        "faults.front_camera_out.duration": ["1 s", "3 s"],
                    }
                },
            }
        ]
    plan = project.plan()
    factors = {factor.architecture: factor for factor in plan.expansion.factors}
    assert factors["camera_radar"].test_cases == 2 + 8 + 8
    faulty = [case for case in plan.cases if case.fault_entry != "none"]
    assert {
        (fault.onset.at, fault.duration)
        for case in faulty
        for fault in case.faults
        if fault.id == "front_camera_out"
    } == {(1.0, 1.0), (1.0, 3.0), (2.0, 1.0), (2.0, 3.0)}
    assert len({case.digest for case in plan.cases}) == len(plan.cases)


@pytest.mark.slow
def test_faults_of_the_switch_and_what_masters_them_are_axes_of_the_same_sweep(
    make_project: MakeProject,
) -> None:
    """Faults, handover time and the monitors' parameters in one file; the times follow."""
    late = {
        "id": "late",
        "target": "switch",
        "model": "late",
        "delay": "0.1 s",
        "onset": {"at": "0 s"},
    }
    sweep = {
        "parameters": {
            "faults.late.delay": ["0.1 s", "0.3 s"],
            "architecture.switch.handover": ["0 s", "0.2 s"],
            "architecture.channels.safety.parameters.confirm": ["0.1 s", "0.2 s"],
        }
    }
    project = make_project(
        {
            **MINI,
            "scenarios": [
                {"use": "lead_braking", "faults": [["nominal_silent", "late"]], "sweep": sweep}
            ],
            "faults": [MINI["faults"][1], late],
            "architectures": ["architectures/camera_radar.yaml"],
        }
    )
    with project.edited(CANDIDATE) as candidate:
        # So that the monitor and not the switch finds the silence.
        candidate["switch"]["staleness"] = "5 s"
    project.run()
    points = {row["run"]: row["point"] for row in project.rows()}
    found = campaign_injections(project.db).injections
    assert len(found) == 8
    for item in found:
        point = points[item.run]
        assert item.times.switch_s is not None
        assert item.times.detect_s is not None
        # The silence is the second fault; the switch is late from the start.
        confirm = point["architecture.channels.safety.parameters.confirm"]
        assert item.times.detect_s == pytest.approx(3.0 + 0.15 + confirm)
        delay = point["faults.late.delay"] + point["architecture.switch.handover"]
        assert item.times.switch_s - item.times.detect_s == pytest.approx(delay)
