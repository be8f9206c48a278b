"""R20: faults begin and end during a run, by time or condition, on sensors and channels."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.signals import SILENT
from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.conftest import MakeProject
from tests.project import run_cases

pytestmark = pytest.mark.requirements


def test_silenced_channel_is_silent_from_its_condition_on(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    nominal = trace.layout.channels.index("nominal")
    for run in range(trace.runs):
        rows = int(trace.length[run]) - 1
        silent = trace["status"][run, 1:rows, nominal] == SILENT
        np.testing.assert_array_equal(silent, trace.time[1:rows] >= 3.0 - 1e-9)


def test_dropped_out_sensor_comes_back_after_the_duration(make_project: MakeProject) -> None:
    plan = make_project().plan()
    case = next(case for case in plan.cases if case.fault_entry == "front_camera_out")
    trace = run_cases(plan, [case])
    camera = trace.layout.sensors.index("front_camera")
    rows = int(trace.length[0]) - 1
    dead = ~trace["sensor_alive"][0, :rows, camera]
    time = trace.time[:rows]
    np.testing.assert_array_equal(dead, (time >= 2.0 - 1e-9) & (time < 5.0 - 1e-9))
    np.testing.assert_array_equal(dead, trace["fault_active"][0, :rows, 0])


def test_fault_that_never_begins_leaves_every_bit(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        odd["faults"][0]["onset"] = {"at": "1000 s"}
    plan = project.plan()
    first = [case for case in plan.cases if case.scenario_id == "cut_in"]
    twin = next(case for case in first if case.fault_entry == "none")
    late = next(
        case
        for case in first
        if case.fault_entry == "front_camera_out" and case.situation_digest == twin.situation_digest
    )
    one, other = run_cases(plan, [twin]), run_cases(plan, [late])
    for name, column in one.columns.items():
        if not name.startswith("fault"):
            np.testing.assert_array_equal(column, other.columns[name], err_msg=name)
