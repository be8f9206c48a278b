"""Faults of the switch: what it is told, and what they do in the closed loop."""

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.signals import REASON_LABELS, SwitchFaults
from adeye.simulate.faults import FaultPlan
from adeye.testing.sensors import injector, moment, scene_of
from adeye.trace import Trace
from tests.motorway import fault
from tests.project import MINI, Project, run_cases
from tests.simulate.faults.test_plan import CAMERA_OUT, CONTEXT, STEP, case

FIRST = np.array([True, False, False])
NONE = np.zeros(3, dtype=np.bool_)
STUCK = fault("switch_stuck", "switch", "stuck", "0.2 s", duration="0.15 s")
LATE: dict[str, Any] = {**STUCK, "id": "switch_late", "model": "late", "delay": "0.1 s"}


@pytest.mark.parametrize(("model", "given"), [("stuck", {}), ("late", {"delay": "0.1 s"})])
def test_inactive_fault_is_the_very_same_object(model: str, given: dict[str, str]) -> None:
    sound = SwitchFaults.none(3)
    made = injector(model, "switch", parameters=[given] * 3)
    assert made.apply(sound, moment(NONE)) is sound
    made.apply(sound, moment(~NONE))
    assert not sound.stuck.any()
    assert not sound.delay.any()
    assert made.apply(sound, moment(NONE)) is sound


def test_switch_is_stuck_in_the_runs_with_the_fault() -> None:
    made = injector("stuck", "switch")
    found = made.apply(SwitchFaults(~FIRST, np.zeros(3)), moment(FIRST))
    assert found.stuck.all()
    assert made.apply(SwitchFaults.none(3), moment(FIRST)).stuck.tolist() == FIRST.tolist()


def test_delays_vary_between_runs_and_add_up() -> None:
    made = injector("late", "switch", parameters=[{"delay": f"{k} s"} for k in (1, 2, 3)])
    before = SwitchFaults(NONE, np.full(3, 0.5))
    assert made.apply(before, moment(~NONE)).delay.tolist() == [1.5, 2.5, 3.5]
    assert made.apply(before, moment(FIRST)).delay.tolist() == [1.5, 0.5, 0.5]


def test_plan_tells_the_switch_from_the_onset_to_the_end_of_its_faults() -> None:
    plan = FaultPlan([case(STUCK, LATE)] * 3, CONTEXT)
    stuck, late, sound = [], [], plan.on_switch(np.zeros((3, 2), dtype=np.bool_), SCENE)
    for tick in range(10):
        scene = scene_of(CONTEXT, tick)
        told = plan.on_switch(plan.update(scene), scene)
        stuck.append(told.stuck.all())
        late.append(float(told.delay.max()))
        assert told is sound or tick in {4, 5, 6}
    assert stuck == [False] * 4 + [True] * 3 + [False] * 3
    assert late == [0.0] * 4 + [0.1] * 3 + [0.0] * 3


def test_fault_of_something_else_leaves_the_switch_sound() -> None:
    plan = FaultPlan([case(CAMERA_OUT)] * 3, CONTEXT)
    active = np.ones((3, 1), dtype=np.bool_)
    told = plan.on_switch(active, SCENE)
    assert not told.stuck.any()
    assert not told.delay.any()


FAULTS = [
    *MINI["faults"],
    fault("stuck_till_then", "switch", "stuck", "0.5 s", duration="2 s"),
    fault("stuck_early", "switch", "stuck", "1 s"),
    fault("stuck_for_a_while", "switch", "stuck", "1 s", duration="4 s"),
    fault("late", "switch", "late", "0 s", delay="0.4 s"),
    fault("late_by_nothing", "switch", "late", "0 s", delay="0 s"),
]
OTHERS = [item["id"] for item in FAULTS[len(MINI["faults"]) :]]


@pytest.fixture(scope="module")
def traces(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Trace]:
    """One cut-in with a silent nominal channel, alone and with each fault of the switch."""
    use = {"use": "cut_in", "faults": ["nominal_silent", *[["nominal_silent", f] for f in OTHERS]]}
    odd = {
        **MINI,
        "scenarios": [use],
        "faults": FAULTS,
        "architectures": ["architectures/camera_radar.yaml"],
    }
    plan = Project(tmp_path_factory.mktemp("switch") / "project", odd).plan()
    return {
        case.fault_entry.removeprefix("nominal_silent+"): run_cases(plan, [case])
        for case in plan.cases
    }


def measured(trace: Trace, column: str) -> tuple[float, str]:
    """Measure from the onset of the nominal channel's fault, the first of the entry."""
    alone = trace["fault_active"].copy()
    alone[..., 1:] = False
    columns = {**trace.columns, "fault_active": alone}
    one = type(trace)(
        trace.layout, trace.time, trace.length, trace.horizon_row, trace.complete, columns,
        trace.channel_events, trace.case_digests,
    )  # fmt: skip
    found = METRICS[column].compute(one)
    return float(found.value[0]), found.status[0]


def differing(one: Trace, other: Trace) -> set[str]:
    """Name the columns of two traces that differ in any bit."""
    return {
        name for name in one.columns if one.columns[name].tobytes() != other.columns[name].tobytes()
    }


@pytest.mark.parametrize("name", ["late_by_nothing", "stuck_till_then"])
def test_fault_without_effect_changes_only_its_own_flag(
    traces: dict[str, Trace], name: str
) -> None:
    assert differing(traces[name], traces["nominal_silent"]) == {"fault_active"}


def test_stuck_switch_never_leaves_the_holder(traces: dict[str, Trace]) -> None:
    trace, sound = traces["stuck_early"], traces["nominal_silent"]
    nominal = trace.layout.channels.index("nominal")
    onset = round(1.0 / STEP)
    moved = onset + int(np.flatnonzero(sound["authority"][0, onset:] != nominal)[0])
    assert moved > onset
    rows = slice(moved, int(trace.length[0]) - 1)
    assert set(trace["authority"][0, rows].tolist()) == {nominal}
    assert {REASON_LABELS[int(code)] for code in trace["reason"][0, rows]} == {"stuck"}
    for column in ("ego", "command", "authority", "reason"):
        before = trace[column][0, :moved], sound[column][0, :moved]
        assert before[0].tobytes() == before[1].tobytes()
    assert measured(trace, "takeover_time_s")[1] == "incomplete"
    assert measured(sound, "takeover_time_s")[1] == "value"


def test_switch_that_comes_loose_hands_over_at_that_tick(traces: dict[str, Trace]) -> None:
    # The channel falls silent at 3 s; the switch is free again at 5 s.
    time, status = measured(traces["stuck_for_a_while"], "takeover_time_s")
    assert status == "value"
    assert time == pytest.approx(2.0)


def test_late_switch_delays_the_takeover_by_exactly_that(traces: dict[str, Trace]) -> None:
    sound, late = (
        measured(traces[name], "takeover_time_s")[0] for name in ("nominal_silent", "late")
    )
    assert late == pytest.approx(sound + 0.4)


def test_what_the_switch_loses_is_in_the_time_to_the_safe_state(traces: dict[str, Trace]) -> None:
    sound, status = measured(traces["nominal_silent"], "fault_to_safe_state_s")
    late, late_status = measured(traces["late"], "fault_to_safe_state_s")
    assert (status, late_status) == ("value", "value")
    # Until the takeover the ego goes on without braking, so the stop itself is not shorter.
    assert late >= sound + 0.4 - 1e-9
    assert measured(traces["stuck_early"], "fault_to_safe_state_s")[1] == "incomplete"


SCENE = scene_of(CONTEXT, 0)
