"""Faults inside the built-in channels: what they do, and that they do nothing elsewhere."""

from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.errors import SpecError
from adeye.ports import HookedChannel
from adeye.signals import Bools, ControlCommand, Floats
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.guard import GuardedChannel
from adeye.simulate.channels.hooks import HOOKS, SAFETY_HOOKS, Hooks
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.safety import PlannedSafetyChannel, SafetyChannel
from adeye.simulate.channels.trajectory.channel import TrajectoryChannel
from adeye.spec.channels import NominalParameters, SafetyParameters, TrajectoryParameters
from adeye.testing import ScriptedChannel, World, channel_context, drive
from tests.project import ROOT
from tests.simulate.channels.perceived import LINKS, SENSORS, shown

STEP, LANE = 0.05, 5.25
ONSET, END, TICKS = 8, 16, 30
FIRST = np.array([True, False])
BOTH: list[tuple[Any, Any]] = [
    (NominalChannel, NominalParameters()),
    (TrajectoryChannel, TrajectoryParameters()),
]
KINDS = pytest.mark.parametrize(("kind", "parameters"), BOTH, ids=["nominal", "trajectory"])
STOPS: list[tuple[Any, Any]] = [
    (SafetyChannel, SafetyParameters()),
    (PlannedSafetyChannel, SafetyParameters(stop="planned")),
]
SAFE = pytest.mark.parametrize(("kind", "parameters"), STOPS, ids=["in_lane", "planned"])
ALL = pytest.mark.parametrize(
    ("kind", "parameters"), BOTH + STOPS, ids=["nominal", "trajectory", "in_lane", "planned"]
)


def play(
    kind: Any, parameters: Any, hook: str = "", size: float = 1.0, gap: float = 120.0
) -> list[ControlCommand]:
    """Drive two runs at 20 m/s towards something that stands; the fault is in the first one."""
    channel, given = kind(), []
    channel.reset(channel_context(parameters, links=LINKS, sensors=SENSORS, runs=2))
    for tick in range(TICKS):
        if hook and tick in {ONSET, END}:
            channel.inject(hook, FIRST & (tick == ONSET), np.full(2, size))
        ego = [[20.0 * STEP * tick, LANE + 0.1, 0.0, 20.0]] * 2
        given.append(channel.act(shown(ego, [gap, LANE, 0.0, 0.0, 0.0], STEP * tick)))
    return given


def bits(command: ControlCommand, run: int = 0) -> bytes:
    names = ("acceleration", "steering_angle", "status", "tracks", "monitors", "plan")
    arrays = [getattr(command, name) for name in names]
    return b"|".join(item[run].tobytes() for item in arrays if item is not None)


@ALL
@pytest.mark.parametrize("hook", HOOKS)
def test_fault_acts_from_its_onset_in_its_run_only(kind: Any, parameters: Any, hook: str) -> None:
    plain, faulty = play(kind, parameters), play(kind, parameters, hook, 0.5)
    assert [bits(item, 1) for item in faulty] == [bits(item, 1) for item in plain]
    differ = [tick for tick in range(TICKS) if bits(faulty[tick]) != bits(plain[tick])]
    assert differ[0] == ONSET


@ALL
def test_map_shifted_by_nothing_changes_no_bit(kind: Any, parameters: Any) -> None:
    plain, faulty = play(kind, parameters), play(kind, parameters, "map_shifted", 0.0)
    assert list(map(bits, faulty)) == list(map(bits, plain))


@pytest.mark.parametrize("hook", ["map_shifted", "planner_frozen"])
def test_nominal_channel_is_what_it_would_be_after_the_end(hook: str) -> None:
    # Far enough that no emergency is remembered.
    plain, faulty = play(*BOTH[0], gap=900.0), play(*BOTH[0], hook, 0.5, gap=900.0)
    assert list(map(bits, faulty[END:])) == list(map(bits, plain[END:]))


@KINDS
def test_lost_tracks_come_back_after_the_samples_that_confirm(kind: Any, parameters: Any) -> None:
    tracks = [item.tracks for item in play(kind, parameters, "tracks_lost")]
    told = [rows is not None and bool(np.isfinite(rows[0]).any()) for rows in tracks]
    back = END + parameters.confirm_hits - 1
    assert told[ONSET - 1]
    assert told[ONSET:] == [False] * (back - ONSET) + [True] * (TICKS - back)


@KINDS
def test_frozen_planner_repeats_its_command_with_fresh_stamps(kind: Any, parameters: Any) -> None:
    faulty = play(kind, parameters, "planner_frozen")
    last = faulty[ONSET - 1]
    for tick in range(ONSET, END):
        item = faulty[tick]
        assert item.acceleration[0] == last.acceleration[0]
        assert item.steering_angle[0] == last.steering_angle[0]
        assert item.status[0] == signals.OK
        assert item.stamp[0] == pytest.approx(tick * STEP)
        if last.plan is not None:
            assert item.plan is not None
            assert np.array_equal(item.plan[0], last.plan[0], equal_nan=True)


def told(items: list[ControlCommand], run: int = 0) -> list[tuple[int, list[list[bool]]]]:
    """Return the status and the monitors of each tick."""
    return [
        (int(item.status[run]), item.monitors[run].tolist())
        for item in items
        if item.monitors is not None
    ]


@SAFE
def test_frozen_monitors_confirm_nothing_new_until_the_end(kind: Any, parameters: Any) -> None:
    # Something stands so near that the monitors fire from the first tracks on.
    plain = play(kind, parameters, gap=60.0)
    first = next(tick for tick, (status, _) in enumerate(told(plain)) if status != signals.OK)
    assert ONSET <= first < END
    faulty = play(kind, parameters, "monitors_frozen", gap=60.0)
    expected, got = told(plain), told(faulty)
    assert got[:ONSET] == expected[:ONSET]
    assert got[ONSET:END] == [expected[ONSET - 1]] * (END - ONSET)
    confirmed = [status for status, _ in got[END:]]
    assert confirmed[-1] == signals.REQUESTS_AUTHORITY
    assert [bits(item, 1) for item in faulty] == [bits(item, 1) for item in plain]


@SAFE
def test_frozen_monitors_change_no_bit_where_nothing_would(kind: Any, parameters: Any) -> None:
    plain = play(kind, parameters, gap=900.0)
    faulty = play(kind, parameters, "monitors_frozen", gap=900.0)
    assert list(map(bits, faulty)) == list(map(bits, plain))


@SAFE
def test_monitors_and_requests_go_on_while_a_planner_is_frozen(kind: Any, parameters: Any) -> None:
    plain = play(kind, parameters, gap=60.0)
    faulty = play(kind, parameters, "planner_frozen", gap=60.0)
    assert told(faulty) == told(plain)
    last = faulty[ONSET - 1].acceleration[0]
    frozen = [item.acceleration[0] for item in faulty[ONSET:END]]
    assert frozen == [last] * (END - ONSET)
    assert plain[END - 1].acceleration[0] < last - 1.0
    assert bits(faulty[END]) == bits(plain[END])


def test_frozen_planner_says_ok_whatever_it_has_found() -> None:
    def said(acceleration: float, status: int) -> ControlCommand:
        one = np.array([acceleration, acceleration])
        return ControlCommand("n", one, 0.1 * one, np.zeros(2), np.full(2, status))

    for status in (signals.DEGRADED, signals.FAULT, signals.REQUESTS_AUTHORITY):
        hooks = Hooks()
        hooks.answer(said(1.0, status))
        hooks.inject("planner_frozen", FIRST, np.ones(2))
        found = hooks.answer(said(-2.0, status))
        assert found.acceleration.tolist() == [1.0, -2.0]
        assert found.status.tolist() == [signals.OK, status]


def test_ego_drives_beside_its_lane_by_what_the_map_is_shifted() -> None:
    channel = NominalChannel()
    channel.reset(channel_context(NominalParameters(), links=LINKS, sensors=SENSORS))
    channel.inject("map_shifted", np.array([True]), np.array([0.6]))
    done = drive({"n": channel}, {"n": LINKS}, World(speed=25.0), horizon=20.0)
    assert done.ego[-1, 1] == pytest.approx(LANE + 0.6, abs=0.02)


class Hooked(ScriptedChannel):
    """A channel from outside that offers one hook and fails when it is used."""

    hooks: tuple[str, ...] = ("planner_frozen",)

    def inject(self, hook: str, active: Bools, size: Floats) -> None:  # noqa: ARG002 - the protocol
        raise RuntimeError(hook)


def test_hook_that_raises_makes_the_channel_silent_and_one_not_offered_is_refused() -> None:
    guarded = GuardedChannel(Hooked((1.0,)))
    assert isinstance(guarded, HookedChannel)
    assert guarded.hooks == ("planner_frozen",)
    guarded.reset(channel_context(None, links=(), sensors={}, runs=2))
    with pytest.raises(SpecError, match="has no hook map_shifted"):
        guarded.inject("map_shifted", FIRST, np.ones(2))
    guarded.act(shown(np.zeros((2, 7)), links=(), protect=True))
    guarded.inject("planner_frozen", FIRST, np.ones(2))
    command = guarded.act(shown(np.zeros((2, 7)), time=0.05, links=(), protect=True))
    assert command.status.tolist() == [signals.SILENT, signals.SILENT]
    event = guarded.events[0]
    assert event is not None
    assert event.outcome == "channel_error"


@pytest.mark.parametrize(("kind", "hooks"), [("nominal", HOOKS), ("safety", SAFETY_HOOKS)])
def test_factory_tells_the_hooks_of_a_channel(kind: str, hooks: tuple[str, ...]) -> None:
    made = make_channel(kind, ROOT)
    assert isinstance(made, GuardedChannel)
    assert made.hooks == hooks
