"""R21: faults stand in the file of the sweep, and are swept like everything else."""

from collections import Counter

import pytest

from adeye.campaign.studies.fault_timing import campaign_injections
from tests.conftest import MakeProject
from tests.motorway import fault
from tests.project import CANDIDATE, MINI, odd_of, use

pytestmark = pytest.mark.requirements


@pytest.mark.slow
def test_fault_entries_and_fault_parameters_are_axes_of_the_sweep(
    make_project: MakeProject,
) -> None:
    axes = {
        "gap": ["30 m", "50 m"],
        "faults.front_camera_out.duration": ["0.5 s", "3 s"],
        "faults.front_camera_out.onset.at": ["1 s", "2 s"],
    }
    entries = ["front_camera_out", ["front_camera_out", "nominal_silent"]]
    uses = use("cut_in", axes, faults=entries)
    project = make_project(odd_of(uses, faults=MINI["faults"]))
    plan = project.plan()
    # The fault-free twin is always there, once per situation: its fault has nothing to vary.
    by_entry = Counter(case.fault_entry for case in plan.cases)
    entry_names = ("front_camera_out", "front_camera_out+nominal_silent")
    assert by_entry == {"none": 2} | dict.fromkeys(entry_names, 8)
    assert {
        (fault.duration, fault.onset.at)
        for case in plan.cases
        for fault in case.faults
        if fault.id == "front_camera_out"
    } == {(0.5, 1.0), (0.5, 2.0), (3.0, 1.0), (3.0, 2.0)}
    assert len({case.digest for case in plan.cases}) == len(plan.cases)
    assert len({case.situation_digest for case in plan.cases}) == 2
    assert project.run().executed == 18
    lasting = "faults.front_camera_out.duration"
    ran = {(row["fault_entry"], row["point"].get(lasting)) for row in project.rows()}
    faulty = {(entry, length) for entry in entry_names for length in (0.5, 3.0)}
    assert ran == {("none", None)} | faulty


@pytest.mark.slow
def test_faults_of_the_switch_and_what_masters_them_are_axes_of_the_same_sweep(
    make_project: MakeProject,
) -> None:
    """Faults, handover time and the monitors' parameters in one file; the times follow."""
    axes = {
        "faults.late.delay": ["0.1 s", "0.3 s"],
        "architecture.switch.handover": ["0 s", "0.2 s"],
        "architecture.channels.safety.parameters.confirm": ["0.1 s", "0.2 s"],
    }
    faults = [MINI["faults"][1], fault("late", "switch", "late", delay="0.1 s")]
    uses = use("lead_braking", axes, faults=[["nominal_silent", "late"]])
    project = make_project(odd_of(uses, faults=faults))
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
