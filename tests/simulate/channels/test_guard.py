"""What a channel does wrong is contained in its run and told by its outcome."""

from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest

from adeye.ports import ChannelContext
from adeye.signals import FAULT, OK, SILENT, ControlCommand, Observation
from adeye.simulate.channels import guard as subject
from adeye.testing import channel_context
from adeye.trace import ChannelEvent

RUNS = 3
MASK = [False, True, False]


class Answering:
    """Gives the answer of a function of the tick."""

    monitor_ids: tuple[str, ...] = ()

    def __init__(self, answer: Callable[[int], Any]) -> None:
        self.answer = answer
        self.tick = -1

    def reset(self, _context: ChannelContext) -> None:
        self.tick = -1

    def act(self, _observation: Observation) -> Any:
        self.tick += 1
        return self.answer(self.tick)


def good(**changes: Any) -> ControlCommand:
    fields: dict[str, Any] = {
        "acceleration": np.full(RUNS, 1.0),
        "steering_angle": np.full(RUNS, 0.1),
        "stamp": np.full(RUNS, 99.0),
        "status": np.full(RUNS, OK, dtype=np.int64),
    }
    return ControlCommand("whatever", **(fields | changes))


def repeat(answer: Any) -> Callable[[int], Any]:
    return lambda _tick: answer


def guarded(answer: Callable[[int], Any], *, trusted: bool = False) -> subject.GuardedChannel:
    channel = subject.GuardedChannel(Answering(answer), trusted=trusted)
    channel.reset(channel_context(None, links=(), sensors={}, runs=RUNS))
    return channel


def act(channel: subject.GuardedChannel, tick: int, running: Any = None) -> ControlCommand:
    alive = np.ones(RUNS, dtype=np.bool_) if running is None else np.array(running)
    return channel.act(Observation(0.1 * tick, {}, {}, None, alive))


def failure(channel: subject.GuardedChannel | subject.Failures, run: int = 0) -> ChannelEvent:
    """Return the failure of a run, which there is."""
    event = channel.events[run]
    assert event is not None
    return event


def outcomes(channel: subject.GuardedChannel) -> list[str | None]:
    return [None if event is None else event.outcome for event in channel.events]


def test_good_command_passes_with_the_id_and_the_time_of_the_observation() -> None:
    command = act(guarded(lambda _: good()), 2)
    assert command.channel == "tested"
    assert command.acceleration.tolist() == [1.0] * RUNS
    assert command.stamp.tolist() == [0.2] * RUNS


def test_nan_silences_its_own_run_only_and_for_good() -> None:
    channel = guarded(
        lambda tick: good(acceleration=np.array([1.0, np.nan if tick == 1 else 2.0, 3.0]))
    )
    act(channel, 0)
    for tick in (1, 2):
        command = act(channel, tick)
        assert command.status.tolist() == [OK, SILENT, OK]
        assert command.acceleration.tolist() == [1.0, 2.0, 3.0]
        assert command.stamp[1] == 0.0
    assert outcomes(channel) == [None, "channel_invalid_output", None]
    assert failure(channel, 1).time == pytest.approx(0.1)


def test_exception_silences_all_runs_that_have_not_ended() -> None:
    def answer(tick: int) -> ControlCommand:
        if tick == 1:
            raise RuntimeError("planner lost")
        return good()

    channel = guarded(answer)
    act(channel, 0)
    for tick in (1, 2):
        assert act(channel, tick, [True, True, False]).status.tolist() == [SILENT, SILENT, OK]
    assert outcomes(channel) == ["channel_error", "channel_error", None]
    assert "planner lost" in failure(channel).detail


class Lying(np.ndarray[Any, Any]):
    """Says that it is of another form than it is."""

    @property  # type: ignore[misc]  # what it is for
    def shape(self) -> Any:
        return (RUNS,)


class Raising(ControlCommand):
    def __getattribute__(self, name: str) -> Any:
        raise ValueError(name)


def test_part_of_an_answer_that_raises_is_the_failure_of_the_channel() -> None:
    channel = guarded(repeat(Raising(*[cast("Any", 0)] * 5)))
    assert act(channel, 0).status.tolist() == [SILENT] * RUNS
    assert outcomes(channel) == ["channel_error"] * RUNS


WRONG = [
    (good(acceleration=np.zeros(RUNS + 1).view(Lying)), "(4,)"),
    (None, "NoneType"),
    (good(acceleration=np.zeros(RUNS + 1)), "acceleration"),
    (good(acceleration=[0.0] * RUNS), "list"),
    (good(steering_angle=np.array(["a"] * RUNS)), "steering_angle"),
    (good(status=np.zeros(RUNS)), "status"),
    (good(monitors=np.zeros((RUNS, 1, 2))), "monitors"),
    (good(tracks=np.zeros((RUNS, 2, 5))), "tracks"),
    (good(candidates=np.zeros((RUNS, 2, 5))), "candidates"),
    (good(candidates=np.zeros((RUNS, 4, 5, 2))), "one cost each"),
    (good(chosen=np.zeros(RUNS)), "chosen"),
    (good(acceleration=np.ma.masked_array(np.zeros(RUNS), mask=MASK)), "1 masked"),
]


def test_answer_of_the_wrong_form_silences_all_runs() -> None:
    for answer, detail in WRONG:
        channel = guarded(repeat(answer))
        assert act(channel, 0).status.tolist() == [SILENT] * RUNS, detail
        assert failure(channel).outcome == "channel_invalid_output", detail
        assert detail in failure(channel).detail


def test_unknown_status_silences_its_run() -> None:
    channel = guarded(lambda _: good(status=np.array([OK, 9, OK])))
    assert act(channel, 0).status.tolist() == [OK, SILENT, OK]


def test_channel_in_fault_may_hold_any_number() -> None:
    channel = guarded(
        lambda _: good(status=np.array([OK, FAULT, OK]), acceleration=np.array([1.0, np.inf, 3.0]))
    )
    command = act(channel, 0)
    assert command.status.tolist() == [OK, FAULT, OK]
    assert command.acceleration.tolist() == [1.0, 0.0, 3.0]
    assert channel.events == [None] * RUNS


def test_own_silence_freezes_the_stamp_and_is_no_failure() -> None:
    channel = guarded(lambda tick: good(status=np.full(RUNS, SILENT if tick else OK)))
    act(channel, 0)
    assert act(channel, 1).stamp.tolist() == [0.0] * RUNS
    assert channel.events == [None] * RUNS


def test_failure_of_an_ended_run_is_not_recorded() -> None:
    channel = guarded(lambda _: good(acceleration=np.array([1.0, np.nan, 1.0])))
    command = act(channel, 0, [True, False, True])
    assert channel.events == [None] * RUNS
    assert np.isfinite(command.acceleration).all()


def test_fan_of_a_plugin_is_kept() -> None:
    costs, chosen = np.ones((RUNS, 4)), np.zeros(RUNS, dtype=np.int32)
    fan = {"candidates": np.ones((RUNS, 4, 5, 2)), "candidate_costs": costs, "chosen": chosen}
    kept: Any = act(guarded(repeat(good(**fan))), 0)
    assert kept.candidates.shape == (RUNS, 4, 5, 2)
    assert kept.chosen.dtype == np.int64


def test_fewer_tracks_are_filled_up_and_more_are_cut() -> None:
    for count in (2, 11):
        answer = good(tracks=np.zeros((RUNS, count, 6)))
        tracks = act(guarded(repeat(answer)), 0).tracks
        assert tracks is not None
        assert tracks.shape == (RUNS, 8, 6)
        assert np.isfinite(tracks[0, :, 0]).sum() == min(count, 8)


def test_channel_that_fails_at_reset_is_silent_from_the_start() -> None:
    class Failing(Answering):
        def reset(self, _context: ChannelContext) -> None:
            raise OSError("no model")

    channel = subject.GuardedChannel(Failing(lambda _: good()))
    channel.reset(channel_context(None, links=(), sensors={}, runs=RUNS))
    assert act(channel, 0).status.tolist() == [SILENT] * RUNS


def test_exception_of_a_trusted_channel_is_not_mastered() -> None:
    def answer(_tick: int) -> Any:
        raise RuntimeError("our own defect")

    with pytest.raises(RuntimeError, match="our own"):
        act(guarded(answer, trusted=True), 0)


def test_channel_that_alters_its_observation_does_not_hide_its_failure() -> None:
    class Hiding(Answering):
        def act(self, observation: Observation) -> Any:
            observation.running.flags.writeable = True
            observation.running[:] = False
            object.__setattr__(observation, "time", -7.0)
            return super().act(observation)

    channel = subject.GuardedChannel(Hiding(repeat(good(acceleration=np.full(RUNS, np.nan)))))
    channel.reset(channel_context(None, links=(), sensors={}, runs=RUNS))
    command = act(channel, 3)
    assert command.status.tolist() == [SILENT] * RUNS
    assert [event and event.time for event in channel.events] == [pytest.approx(0.3)] * RUNS


def command(acceleration: float, stamp: float) -> ControlCommand:
    return good(
        acceleration=np.full(RUNS, acceleration),
        stamp=np.full(RUNS, stamp),
        monitors=np.ones((RUNS, 1, 2), dtype=np.bool_),
        tracks=np.zeros((RUNS, 8, 6)),
        candidates=np.zeros((RUNS, 5, 3, 2)),
        candidate_costs=np.zeros((RUNS, 5)),
        chosen=np.zeros(RUNS, dtype=np.int64),
    )


def test_first_failure_of_a_run_is_kept_and_says_whether_it_may_be_the_machines() -> None:
    failures = subject.Failures("a", 2)
    failures.add(np.array([True, False]), subject.ERROR, 1.0, "one", is_machine_dependent=True)
    failures.add(np.array([True, True]), subject.ERROR, 2.0, "x" * 10_000)
    one, two = (failure(failures, run) for run in range(2))
    assert (one.detail, one.is_machine_dependent) == ("one", True)
    # A long detail is cut.
    assert (len(two.detail), two.is_machine_dependent) == (subject.MAX_DETAIL, False)
    assert failures.silent.all()


def test_nobody_silent_is_the_very_same_command() -> None:
    given = command(1.0, 1.0)
    assert subject.silenced(given, command(0.0, 0.0), np.zeros(RUNS, dtype=np.bool_)) is given


def test_silent_run_keeps_values_and_stamp_of_before_and_the_other_runs_their_own() -> None:
    given = command(1.0, 1.0)
    quiet: Any = subject.silenced(given, command(-2.0, 0.5), np.array([True, False, False]))
    assert quiet.acceleration.tolist() == [-2.0, 1.0, 1.0]
    assert quiet.stamp.tolist() == [0.5, 1.0, 1.0]
    assert quiet.status.tolist() == [SILENT, OK, OK]
    assert quiet.monitors[:, 0, 0].tolist() == [False, True, True]
    assert np.isnan(quiet.tracks[0]).all()
    assert np.isnan(quiet.candidates).any(axis=(1, 2, 3)).tolist() == [True, False, False]
    assert quiet.chosen.tolist() == [-1, 0, 0]
    assert given.acceleration.tolist() == [1.0] * RUNS


def test_description_names_the_line_but_no_folder_however_much_an_exception_says() -> None:
    for words in ("too fast", "x" * 10_000):
        with pytest.raises(ValueError, match=words[:8]) as caught:
            raise ValueError(words)
        text = subject.describe(caught.value)
        assert "(test_guard.py:" in text
        assert "/" not in text
        assert len(text) <= subject.MAX_DETAIL
        assert text.startswith("ValueError: too fast (test_guard.py:") or words[0] == "x"
    # What is raised in a library is told at the line that called it.
    with pytest.raises(np.linalg.LinAlgError) as beyond:
        np.linalg.inv(np.zeros((2, 2)))
    assert "(test_guard.py:" in subject.describe(beyond.value)
