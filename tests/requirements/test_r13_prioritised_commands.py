"""R13: a declarative switch decides whose command acts."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest

from adeye.campaign.events import events_of
from adeye.errors import InputError
from adeye.signals import EGO_SPEED, REASON_LABELS
from tests.project import CANDIDATE, run_cases
from tests.requirements.loop import driven, scripted

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.trace import Trace
    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements

FIRST = round(1.0 / 0.05)


def authority(trace: Trace) -> list[str]:
    """Name of the acting channel by row, from the second tick on."""
    rows = trace["authority"][0, 1 : trace.length[0] - 1]
    return [trace.layout.channels[int(index)] for index in rows]


@pytest.mark.slow
def test_request_of_the_channel_with_priority_takes_over(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -4.0, "requests_from": 1.0},
        "quick": {"acceleration": 0.5},
    }
    switch = {"priority": ["careful", "quick"], "default": "quick", "latch": True}
    trace = driven(scripted(tmp_path, channels, **switch))
    acting = authority(trace)
    assert set(acting[: FIRST - 2]) == {"quick"}
    assert set(acting[FIRST + 2 :]) == {"careful"}
    assert "request" in {REASON_LABELS[int(code)] for code in np.unique(trace["reason"][0])}
    assert trace["ego"][0, -1, EGO_SPEED] == 0.0


@pytest.mark.slow
def test_the_other_order_of_priority_gives_the_other_answer(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -4.0, "requests_from": 1.0},
        "quick": {"acceleration": 0.5, "requests_from": 0.0},
    }
    for order, winner in ((["careful", "quick"], "careful"), (["quick", "careful"], "quick")):
        switch = {"priority": order, "default": "quick", "latch": False}
        trace = driven(scripted(tmp_path / winner, channels, **switch))
        assert set(authority(trace)[FIRST + 2 :]) == {winner}


def test_channel_that_falls_silent_loses_authority(tmp_path: Path) -> None:
    channels = {"quick": {"acceleration": 0.5, "fails_from": 1.0}, "spare": {"acceleration": -2.0}}
    switch = {"priority": ["quick", "spare"], "default": "quick", "staleness": "0.2 s"}
    acting = authority(driven(scripted(tmp_path, channels, **switch)))
    lost = acting.index("spare")
    assert set(acting[:lost]) == {"quick"}
    assert set(acting[lost:]) == {"spare"}
    assert FIRST - 2 <= lost <= FIRST + round(0.2 / 0.05) + 1


@pytest.mark.slow
def test_request_must_stand_as_long_as_the_debounce(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -4.0, "requests_from": 1.0},
        "quick": {"acceleration": 0.5},
    }
    switch = {"priority": ["careful", "quick"], "default": "quick"}
    taken = [
        authority(driven(scripted(tmp_path / name, channels, **switch, debounce=debounce))).index(
            "careful"
        )
        for name, debounce in (("at_once", "0 s"), ("later", "0.3 s"))
    ]
    assert taken[1] - taken[0] == pytest.approx(0.3 / 0.05, abs=1)


@pytest.mark.slow
def test_hysteresis_returns_to_the_default_after_its_time(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -1.0, "requests_from": 1.0, "requests_until": 1.5},
        "quick": {"acceleration": 0.5},
    }
    switch = {"priority": ["careful", "quick"], "default": "quick"}
    held = authority(driven(scripted(tmp_path / "latched", channels, **switch)))
    returned = authority(
        driven(
            scripted(
                tmp_path / "hysteresis",
                channels,
                **{**switch, "policy": "hysteresis", "return_after": "1 s"},
            )
        )
    )
    first = held.index("careful")
    assert set(held[first:]) == {"careful"}
    asked = round(0.5 / 0.05)
    assert returned[first:].index("quick") == asked + round(1.0 / 0.05)
    assert set(returned[first + asked + round(1.0 / 0.05) :]) == {"quick"}


def test_majority_outvotes_the_default_that_is_wrong(tmp_path: Path) -> None:
    channels = {
        "alpha": {"acceleration": 3.0},
        "beta": {"acceleration": -1.0},
        "gamma": {"acceleration": -1.2},
    }
    switch = {
        "policy": "voting",
        "voters": ["alpha", "beta", "gamma"],
        "acceleration_tolerance": "0.5 m/s^2",
        "steering_tolerance": "1 deg",
    }
    trace = driven(scripted(tmp_path, channels, **switch))
    assert set(authority(trace)) == {"beta"}
    assert set(trace["command"][0, 1 : trace.length[0] - 1, 0].tolist()) == {-1.0}


@pytest.mark.slow
def test_latency_of_the_handover_is_in_the_time_to_the_takeover(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -4.0, "requests_from": 1.0},
        "quick": {"acceleration": 0.5},
    }
    switch = {"priority": ["careful", "quick"], "default": "quick"}
    taken, kept = {}, {}
    for latency in (0, 3):
        folder = tmp_path / str(latency)
        trace = driven(scripted(folder, channels, **switch, handover=f"{latency * 50} ms"))
        taken[latency] = authority(trace).index("careful")
        kept[latency] = [row.text for row in events_of(trace, 0) if row.kind == "switch"]
    assert taken[3] - taken[0] == 3
    assert [text for text in kept[3] if "careful" in text] == [
        "authority to careful from quick (request)"
    ]
    assert "handover from quick begins" in kept[3]
    assert "handover from quick begins" not in kept[0]


@pytest.mark.slow
def test_late_switch_delays_each_handover_by_its_ticks(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -4.0, "requests_from": 1.0},
        "quick": {"acceleration": 0.5},
    }
    switch = {"priority": ["careful", "quick"], "default": "quick", "handover": "0.1 s"}
    taken = {}
    for late in (0, 4):
        project = scripted(tmp_path / str(late), channels, **switch)
        with project.edited_odd() as odd:
            odd["scenarios"][0]["faults"] = ["late"]
            odd["faults"] = [
                {
                    "id": "late",
                    "target": "switch",
                    "model": "late",
                    "delay": f"{50 * late} ms",
                    "onset": {"at": "0 s"},
                }
            ]
        plan = project.plan()
        case = next(case for case in plan.cases if case.faults)
        taken[late] = authority(run_cases(plan, [case])).index("careful")
    assert taken[0] == FIRST - 1 + 2
    assert taken[4] == taken[0] + 4


@pytest.mark.slow
def test_bumpless_handover_limits_the_jerk_of_the_command(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -4.0, "requests_from": 1.0},
        "quick": {"acceleration": 0.5},
    }
    switch = {"priority": ["careful", "quick"], "default": "quick"}
    limits = {"jerk": "10 m/s^3", "steering_rate": "20 deg/s"}
    trace = driven(scripted(tmp_path, channels, **switch, bumpless=limits))
    acting = trace["command"][0, 1 : trace.length[0] - 1, 0]
    assert np.abs(np.diff(acting)).max() == pytest.approx(10.0 * 0.05)
    assert acting[-1] == -4.0


def test_key_of_another_policy_is_an_error_with_its_line(tmp_path: Path) -> None:
    channels = {"quick": {"acceleration": 0.5}, "spare": {"acceleration": -2.0}}
    project = scripted(tmp_path, channels, return_after="1 s")
    with pytest.raises(InputError) as caught:
        project.plan()
    assert re.search(r"camera_radar\.yaml:\d+:\d+: .*return_after is no key of", str(caught.value))


def test_handover_that_is_no_whole_number_of_ticks_is_an_error_with_its_line(
    tmp_path: Path,
) -> None:
    channels = {"quick": {"acceleration": 0.5}, "spare": {"acceleration": -2.0}}
    with pytest.raises(InputError) as caught:
        scripted(tmp_path, channels, handover="0.07 s").plan()
    assert re.search(r"camera_radar\.yaml:\d+:\d+: .*handover: 0.07 s is no", str(caught.value))


@pytest.mark.slow
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
