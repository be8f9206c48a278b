"""A guard around a channel on the batch: what fails or answers nonsense is silent from then on."""

from __future__ import annotations

import functools
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye import signals
from adeye.errors import SpecError
from adeye.kernel.jit import compiled
from adeye.signals import STATUS_LABELS, Bools, ControlCommand, Floats, Ints, Observation
from adeye.simulate.channels.links import no_command
from adeye.supervision import folder_and_name, is_asked, own_frame, said
from adeye.trace import ChannelEvent

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from adeye.ports import ChannelContext, ControlChannel

# --- Which runs a channel has failed in, since when and how; a failed channel stays silent --------

ERROR: Final = "channel_error"
INVALID_OUTPUT: Final = "channel_invalid_output"
KILLED: Final = "channel_killed"
TIMEOUT: Final = "channel_timeout"
MAX_DETAIL: Final = 500
"""Longest detail that is kept [characters]."""
_LONGEST_NAME: Final = 100


class Failures:
    """The first failure of one channel in each run of a batch.

    Attributes:
        channel: Id of the channel.
        events: (B) first failure in each run, or None.
        silent: (B,) whether it has failed.
    """

    def __init__(self, channel: str, runs: int) -> None:
        self.channel = channel
        self.events: list[ChannelEvent | None] = [None] * runs
        self.silent: Bools = np.zeros(runs, dtype=np.bool_)

    def add(
        self,
        runs: Bools | int,
        outcome: str,
        time: float,
        detail: str,
        *,
        is_machine_dependent: bool = False,
    ) -> None:
        """Record a failure in the runs (B,) that have none yet.

        Args:
            runs: (B,) where it happened, or the number of the run.
            outcome: ``channel_error``, ``channel_invalid_output``, ``channel_killed`` or
                ``channel_timeout``.
            time: [s].
            detail: What was wrong.
            is_machine_dependent: Whether it may be the machine's speed or load that it shows.
        """
        where: Bools = np.arange(self.silent.shape[0]) == runs if isinstance(runs, int) else runs
        event = ChannelEvent(outcome, self.channel, time, detail[:MAX_DETAIL], is_machine_dependent)
        for run in np.flatnonzero(where & ~self.silent):
            self.events[run] = event
        self.silent |= where

    def hold(self, command: ControlCommand, previous: ControlCommand) -> ControlCommand:
        """Return the command with the failed runs silent: no new values, stamp frozen.

        Args:
            command: Newest command; its values in failed runs are not used.
            previous: The command before it.
        """
        return silenced(command, previous, self.silent)


def silenced(command: ControlCommand, previous: ControlCommand, runs: Bools) -> ControlCommand:
    """Return a command that is silent in some runs: no new values, stamp frozen.

    Args:
        command: The command; it is returned itself if no run is to be silent.
        previous: The last command before; its values stand in the silent runs.
        runs: (B,) runs to silence.
    """
    if not runs.any():
        return command
    quiet = command.copy()
    quiet.acceleration[runs] = previous.acceleration[runs]
    quiet.steering_angle[runs] = previous.steering_angle[runs]
    quiet.stamp[runs] = previous.stamp[runs]
    quiet.status[runs] = signals.SILENT
    if quiet.monitors is not None:
        quiet.monitors[runs] = False
    for extra in (quiet.plan, quiet.tracks, quiet.candidates, quiet.candidate_costs):
        if extra is not None:
            extra[runs] = np.nan
    if quiet.chosen is not None:
        quiet.chosen[runs] = -1
    return quiet


def describe(error: BaseException) -> str:
    """Say what an exception is and where it was raised, without folders.

    Paths are left out because the text is stored with results that must not depend on a machine.
    """
    frame = own_frame(error)
    place = "" if frame is None else f" ({folder_and_name(frame)[1]}:{frame.lineno})"
    kind = type(error).__name__[:_LONGEST_NAME]
    # A text that no encoding takes, or that ends early in the database, is shown escaped.
    text = said(error)[:MAX_DETAIL].encode("utf-8", "backslashreplace").decode()
    # However much it says, the place is told.
    text = text.replace("\0", "\\0")[: MAX_DETAIL - len(kind) - len(place) - 2]
    return f"{kind}: {text}{place}"


# --- A guard around a channel on the batch: what fails or answers nonsense is silent from then on -

TRACKS: Final = 8
"""Tracks that a command carries; more are cut, fewer filled up with NaN."""


class GuardedChannel:
    """Wraps a channel so that its failure never ends a run.

    An exception or an answer of the wrong form makes the channel silent in all runs that have not
    ended: the state of the channel is unknown then. A value that is no finite number makes it
    silent in that run only. A run in which the channel says ``fault`` or ``silent`` itself may hold
    any number; the last finite ones are kept in their place. The stamp of a command is the time of
    its observation, whatever the channel writes there; where it is silent the stamp stands still.
    """

    def __init__(self, channel: ControlChannel, *, trusted: bool = False) -> None:
        """Wrap a channel.

        Args:
            channel: The channel.
            trusted: Whether an exception is ours to report, not the channel's failure: built-in
                channels, whose defect must not pass as a mastered failure.
        """
        self._channel = channel
        self._trusted = trusted
        self.monitor_ids: tuple[str, ...] = tuple(channel.monitor_ids)
        self._failures = Failures("", 0)
        self._previous = no_command("", 0)
        self._dead = False
        self._time = 0.0
        self._running: Bools = np.zeros(0, dtype=np.bool_)

    @property
    def hooks(self) -> tuple[str, ...]:
        """Faults inside it that the channel offers a hook for, see ``ports.HookedChannel``."""
        return tuple(getattr(self._channel, "hooks", ()))

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Tell the channel where a fault inside it is present.

        Raises:
            SpecError: It does not offer the hook.
        """
        if hook not in self.hooks:
            raise SpecError(
                f"channel {self._failures.channel} has no hook {hook}",
                remedy=f"It has {', '.join(self.hooks) or 'none'}.",
            )
        if not self._dead:
            told = functools.partial(self._channel.inject, hook, active.copy())  # type: ignore[attr-defined]
            # As after an exception elsewhere, its state is unknown in every run that goes on.
            self._call(told, size.copy(), self._time, self._running)

    @property
    def events(self) -> list[ChannelEvent | None]:
        """First failure of the channel in each run, or None."""
        own = self._failures.events
        inner = getattr(self._channel, "events", None)
        return own if inner is None else [a or b for a, b in zip(inner, own, strict=True)]

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch; a channel that fails here is silent from the start."""
        self._failures = Failures(context.channel_id, context.runs)
        self._previous = no_command(context.channel_id, context.runs)
        self._dead = False
        self._time = 0.0
        self._running = np.ones(context.runs, dtype=np.bool_)
        self._call(self._channel.reset, context, 0.0, self._running)

    def act(self, observation: Observation) -> ControlCommand:
        """Answer with a command that is finite and well formed in every run."""
        # Whoever is shown an observation may alter it; when and where it counts is noted before.
        running = observation.running if self._trusted else observation.running.copy()
        self._running, self._time = running, observation.time
        answer: Any = None
        if not self._dead:
            answer = self._call(self._asked, observation, self._time, running)
        command = self._previous if self._dead else self._checked(answer)
        self._previous = self._failures.hold(command, self._previous)
        return self._previous

    def _call(self, method: Any, argument: Any, time: float, runs: Bools) -> Any:
        if self._trusted:
            return method(argument)
        try:
            # How strict numpy is about overflow is not for a channel to decide for the others.
            with np.errstate():
                return method(argument)
        except BaseException as error:
            if is_asked(error):
                raise
            self._failures.add(runs, ERROR, time, describe(error))
            self._dead = True
            return None

    def _asked(self, observation: Observation) -> Any:
        """Give the answer of the channel, or what is wrong with it."""
        answer: Any = self._channel.act(observation)
        # What a built-in channel answers is its own and well formed.
        if self._trusted:
            return answer
        if not isinstance(answer, ControlCommand):
            return f"act() returned {type(answer).__name__}, not ControlCommand"
        # Each part is read once, as it may have code of its own; what is checked has none.
        told = {item.name: _plain(getattr(answer, item.name)) for item in fields(ControlCommand)}
        command = ControlCommand(**told)
        return self._form(command) or self._copied(command)

    def _checked(self, command: ControlCommand | str) -> ControlCommand:
        if isinstance(command, str):
            self._failures.add(self._running, INVALID_OUTPUT, self._time, command)
            self._dead = True
            return self._previous
        previous, wrongs = self._previous, np.zeros(len(command.status), dtype=np.int8)
        found = _settle(
            self._running.copy(),
            self._time,
            command.acceleration,
            command.steering_angle,
            command.stamp,
            command.status,
            previous.acceleration,
            previous.steering_angle,
            previous.stamp,
            wrongs,
        )
        for kind, detail in _WRONG.items() if found else ():
            bad = (wrongs & kind) != 0
            self._failures.add(bad, INVALID_OUTPUT, self._time, detail)
        return command

    def _form(self, answer: ControlCommand) -> str:
        """Say what is wrong with the form of an answer; empty if nothing is."""
        runs = self._failures.silent.shape[0]
        wanted: Mapping[str, tuple[int | None, ...]] = {
            "acceleration": (runs,),
            "steering_angle": (runs,),
            "stamp": (runs,),
            "status": (runs,),
            "plan": (runs, None, 4),
            "monitors": (runs, len(self.monitor_ids), 2),
            "tracks": (runs, None, len(signals.TRACK_COLUMNS)),
            "candidates": (runs, None, None, 2),
            "candidate_costs": (runs, None),
            "chosen": (runs,),
        }
        for name, shape in wanted.items():
            wrong = _misfit(name, getattr(answer, name), shape)
            if wrong:
                return wrong
        if answer.candidates is not None:
            count = answer.candidates.shape[1]
            costs = answer.candidate_costs
            if costs is None or answer.chosen is None or costs.shape[1] != count:
                return "candidates come without one cost each and the one that is chosen"
        if answer.monitors is None and self.monitor_ids:
            return "monitors is None, but the channel has monitor_ids"
        return ""

    def _copied(self, answer: ControlCommand) -> ControlCommand:
        monitors = answer.monitors
        return ControlCommand(
            self._failures.channel,
            np.asarray(answer.acceleration, dtype=np.float64),
            np.asarray(answer.steering_angle, dtype=np.float64),
            np.asarray(answer.stamp, dtype=np.float64),
            np.asarray(answer.status, dtype=np.int64),
            None if answer.plan is None else np.asarray(answer.plan, dtype=np.float64),
            None if monitors is None else np.asarray(monitors, dtype=np.bool_),
            None if answer.tracks is None else _padded(answer.tracks),
            _numbers(answer.candidates),
            _numbers(answer.candidate_costs),
            None if answer.chosen is None else np.asarray(answer.chosen, dtype=np.int64),
        )


_NOT_FINITE: Final = 1
_NO_STATUS: Final = 2
_WRONG: Final = {
    _NOT_FINITE: "acceleration or steering angle is no finite number",
    _NO_STATUS: f"status is none of 0 to {len(STATUS_LABELS) - 1}",
}
_STATES: Final = len(STATUS_LABELS)


@compiled
def _settle(  # noqa: PLR0913, PLR0917 - a kernel
    running: Bools,
    time: float,
    acceleration: Floats,
    steering_angle: Floats,
    stamp: Floats,
    status: Ints,
    previous_acceleration: Floats,
    previous_steering_angle: Floats,
    previous_stamp: Floats,
    wrongs: NDArray[np.int8],
) -> int:
    """Keep the last values where new ones are no use, and set the stamps.

    Args:
        running: (B,).
        time: Of the observation [s].
        acceleration: (B,) in and out.
        steering_angle: (B,) in and out.
        stamp: (B,) out.
        status: (B,) in and out.
        previous_acceleration: (B,).
        previous_steering_angle: (B,).
        previous_stamp: (B,).
        wrongs: (B,) what is wrong in a run that has not ended, out.

    Returns:
        In how many runs something is wrong.
    """
    found = 0
    for run in range(running.shape[0]):
        is_finite = np.isfinite(acceleration[run]) and np.isfinite(steering_angle[run])
        is_known = 0 <= status[run] < _STATES
        wrongs[run] = 0
        if running[run]:
            if not is_finite and status[run] != signals.FAULT and status[run] != signals.SILENT:
                wrongs[run] |= _NOT_FINITE
            if not is_known:
                wrongs[run] |= _NO_STATUS
            if wrongs[run]:
                found += 1
        if not is_finite or not is_known:
            # An ended run is frozen and masked, so its values only have to stay finite.
            acceleration[run] = previous_acceleration[run]
            steering_angle[run] = previous_steering_angle[run]
        if not is_known:
            status[run] = signals.SILENT
        is_answer = running[run] and status[run] != signals.SILENT
        stamp[run] = time if is_answer else previous_stamp[run]
    return found


_OPTIONAL: Final = frozenset(
    {"plan", "monitors", "tracks", "candidates", "candidate_costs", "chosen"}
)
_WHOLE: Final = frozenset({"status", "chosen"})
"""Fields that hold whole numbers."""


def _plain(values: Any) -> Any:
    """Copy an array into one without code of its own, or say what is wrong with it."""
    if isinstance(values, np.ma.MaskedArray) and (hidden := np.ma.getmaskarray(values).sum()):
        # Below a mask lies anything; what the channel does not tell is no command.
        return f"an array with {hidden} masked samples"
    return np.array(values) if isinstance(values, np.ndarray) else values


def _misfit(name: str, values: Any, shape: tuple[int | None, ...]) -> str:
    if values is None and name in _OPTIONAL:
        return ""
    if isinstance(values, str):
        return f"{name} is {values[:MAX_DETAIL]}, not numbers"
    if not isinstance(values, np.ndarray):
        return f"{name} is {type(values).__name__}, not an array"
    numeric = values.dtype.kind in "fiub"
    is_whole = name not in _WHOLE or values.dtype.kind in "iu"
    fits = len(values.shape) == len(shape) and all(
        size is None or size == have for size, have in zip(shape, values.shape, strict=True)
    )
    if numeric and fits and is_whole:
        return ""
    text = ", ".join("K" if size is None else str(size) for size in shape)
    return f"{name} is {values.dtype} of shape {values.shape}, not numbers of shape ({text})"


def _numbers(values: NDArray[Any] | None) -> Floats | None:
    return None if values is None else np.asarray(values, dtype=np.float64)


def _padded(tracks: NDArray[Any]) -> Floats:
    padded = np.full((tracks.shape[0], TRACKS, tracks.shape[2]), np.nan)
    count = min(TRACKS, tracks.shape[1])
    padded[:, :count] = tracks[:, :count]
    return padded
