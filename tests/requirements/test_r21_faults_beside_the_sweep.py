"""R21: faults stand in the file of the sweep, and are swept like everything else."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.project import MINI

if TYPE_CHECKING:
    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements


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
