"""R13: a declarative switch decides whose command acts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adeye.errors import InputError
from adeye.signals import EGO_SPEED, REASON_LABELS
from adeye.trace import Trace
from tests.conftest import MakeProject
from tests.events import events_of
from tests.motorway import fault
from tests.project import CANDIDATE, Executed, run_cases
from tests.requirements.loop import driven, scripted

pytestmark = pytest.mark.requirements

FIRST = round(1.0 / 0.05)
CHANNELS = {
    "careful": {"acceleration": -4.0, "requests_from": 1.0},
    "quick": {"acceleration": 0.5},
}
SWITCH = {"priority": ["careful", "quick"], "default": "quick"}
TWO = {"quick": {"acceleration": 0.5}, "spare": {"acceleration": -2.0}}


def authority(trace: Trace) -> list[str]:
    """Name of the acting channel by row, from the second tick on."""
    rows = trace["authority"][0, 1 : trace.length[0] - 1]
    return [trace.layout.channels[int(index)] for index in rows]


@pytest.mark.slow
def test_request_of_the_channel_with_priority_takes_over(tmp_path: Path) -> None:
    trace = driven(scripted(tmp_path, CHANNELS, **SWITCH, latch=True))
    acting = authority(trace)
    assert set(acting[: FIRST - 2]) == {"quick"}
    assert set(acting[FIRST + 2 :]) == {"careful"}
    assert "request" in {REASON_LABELS[int(code)] for code in np.unique(trace["reason"][0])}
    assert trace["ego"][0, -1, EGO_SPEED] == 0.0


@pytest.mark.slow
def test_the_other_order_of_priority_gives_the_other_answer(tmp_path: Path) -> None:
    channels = {**CHANNELS, "quick": {"acceleration": 0.5, "requests_from": 0.0}}
    for order in (["careful", "quick"], ["quick", "careful"]):
        switch = {"priority": order, "default": "quick", "latch": False}
        trace = driven(scripted(tmp_path / order[0], channels, **switch))
        assert set(authority(trace)[FIRST + 2 :]) == {order[0]}


def test_channel_that_falls_silent_loses_authority(tmp_path: Path) -> None:
    channels = {**TWO, "quick": {"acceleration": 0.5, "fails_from": 1.0}}
    acting = authority(driven(scripted(tmp_path, channels, staleness="0.2 s")))
    lost = acting.index("spare")
    assert set(acting[:lost]) == {"quick"}
    assert set(acting[lost:]) == {"spare"}
    assert FIRST - 2 <= lost <= FIRST + round(0.2 / 0.05) + 1


@pytest.mark.slow
def test_request_must_stand_as_long_as_the_debounce(tmp_path: Path) -> None:
    at_once, later = (
        driven(scripted(tmp_path / name, CHANNELS, **SWITCH, debounce=f"{name} s"))
        for name in ("0", "0.3")
    )
    waited = authority(later).index("careful") - authority(at_once).index("careful")
    assert waited == pytest.approx(0.3 / 0.05, abs=1)


@pytest.mark.slow
def test_hysteresis_returns_to_the_default_after_its_time(tmp_path: Path) -> None:
    passing = {"acceleration": -1.0, "requests_from": 1.0, "requests_until": 1.5}
    channels = {**CHANNELS, "careful": passing}
    held = authority(driven(scripted(tmp_path / "latched", channels, **SWITCH)))
    switch = {**SWITCH, "policy": "hysteresis", "return_after": "1 s"}
    returned = authority(driven(scripted(tmp_path / "hysteresis", channels, **switch)))
    first = held.index("careful")
    assert set(held[first:]) == {"careful"}
    asked = round(0.5 / 0.05)
    assert returned[first:].index("quick") == asked + round(1.0 / 0.05)
    assert set(returned[first + asked + round(1.0 / 0.05) :]) == {"quick"}


def test_majority_outvotes_the_default_that_is_wrong(tmp_path: Path) -> None:
    votes = {"alpha": 3.0, "beta": -1.0, "gamma": -1.2}
    tolerances = {"acceleration_tolerance": "0.5 m/s^2", "steering_tolerance": "1 deg"}
    channels = {name: {"acceleration": vote} for name, vote in votes.items()}
    switch = {"policy": "voting", "voters": list(votes), **tolerances}
    trace = driven(scripted(tmp_path, channels, **switch))
    assert set(authority(trace)) == {"beta"}
    assert set(trace["command"][0, 1 : trace.length[0] - 1, 0].tolist()) == {-1.0}


@pytest.mark.slow
def test_latency_of_the_handover_is_in_the_time_to_the_takeover(tmp_path: Path) -> None:
    taken, kept = {}, {}
    for latency in (0, 3):
        folder = tmp_path / str(latency)
        trace = driven(scripted(folder, CHANNELS, **SWITCH, handover=f"{latency * 50} ms"))
        taken[latency] = authority(trace).index("careful")
        kept[latency] = [row.text for row in events_of(trace, 0) if row.kind == "switch"]
    assert taken[3] - taken[0] == 3
    careful = [text for text in kept[3] if "careful" in text]
    assert careful == ["authority to careful from quick (request)"]
    assert "handover from quick begins" in kept[3]
    assert "handover from quick begins" not in kept[0]


@pytest.mark.slow
def test_late_switch_delays_each_handover_by_its_ticks(tmp_path: Path) -> None:
    taken = {}
    for late in (0, 4):
        project = scripted(tmp_path / str(late), CHANNELS, **SWITCH, handover="0.1 s")
        with project.edited_odd() as odd:
            odd["scenarios"][0]["faults"] = ["late"]
            odd["faults"] = [fault("late", "switch", "late", delay=f"{50 * late} ms")]
        plan = project.plan()
        case = next(case for case in plan.cases if case.faults)
        taken[late] = authority(run_cases(plan, [case])).index("careful")
    assert taken[0] == FIRST - 1 + 2
    assert taken[4] == taken[0] + 4


@pytest.mark.slow
def test_bumpless_handover_limits_the_jerk_of_the_command(tmp_path: Path) -> None:
    limits = {"jerk": "10 m/s^3", "steering_rate": "20 deg/s"}
    trace = driven(scripted(tmp_path, CHANNELS, **SWITCH, bumpless=limits))
    acting = trace["command"][0, 1 : trace.length[0] - 1, 0]
    assert np.abs(np.diff(acting)).max() == pytest.approx(10.0 * 0.05)
    assert acting[-1] == -4.0


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("return_after", "1 s", "return_after is no key of"),
        ("handover", "0.07 s", "handover: 0.07 s is no"),
    ],
)
def test_key_of_another_policy_and_part_of_a_tick_are_errors_with_their_line(
    tmp_path: Path, key: str, value: str, message: str
) -> None:
    with pytest.raises(InputError, match=rf"camera_radar\.yaml:\d+:\d+: .*{message}"):
        scripted(tmp_path, TWO, **{key: value}).plan()


@pytest.mark.slow
def test_stuck_switch_keeps_the_default(mini: Executed, make_project: MakeProject) -> None:
    project = make_project()
    with project.edited(CANDIDATE) as candidate:
        candidate["switch"]["policy"] = "stuck"
    stuck = replace(mini, plan=project.plan())
    trace = run_cases(stuck.plan, [stuck.case("camera_radar", "nominal_silent")])
    nominal = trace.layout.channels.index("nominal")
    rows = int(trace.length[0]) - 1
    assert set(trace["authority"][0, 1:rows].tolist()) <= {nominal, -1}
