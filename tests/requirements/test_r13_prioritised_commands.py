"""R13: a declarative policy decides whose command acts."""

from __future__ import annotations

import pytest

from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.conftest import MakeProject
from tests.project import CANDIDATE, run_cases

pytestmark = pytest.mark.requirements


def test_safety_channel_takes_over_by_priority(cut_ins: tuple[list[TestCase], Trace]) -> None:
    _, trace = cut_ins
    safety = trace.layout.channels.index("safety")
    for run in range(trace.runs):
        assert trace["authority"][run, int(trace.length[run]) - 2] == safety


def test_stuck_switch_keeps_the_default(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited(CANDIDATE) as candidate:
        candidate["switch"]["policy"] = "stuck"
    plan = project.plan()
    case = next(
        case
        for case in plan.cases
        if case.fault_entry == "nominal_silent" and case.architecture.architecture == "camera_radar"
    )
    trace = run_cases(plan, [case])
    nominal = trace.layout.channels.index("nominal")
    rows = int(trace.length[0]) - 1
    assert set(trace["authority"][0, 1:rows].tolist()) <= {nominal, -1}
