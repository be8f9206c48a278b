"""R21: faults stand in the file of the sweep, and their parameters are swept with the rest."""

from __future__ import annotations

import pytest

from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements


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
