"""What a fault does to the command that a channel gives.

Nobody else's view changes. What a link carries comes in messages: a sensor's is a sample that is
delivered, or that it does not deliver; channels and the switch send one at each tick.

The acceleration that is asked for is driven where it is positive and braked where it is negative;
each actuator has its own part, and what they do adds up.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any, Generic, cast

import numpy as np

from adeye.kernel.elementary import cos
from adeye.kernel.random import uniform
from adeye.signals import DEGRADED, FAULT, OK, SILENT, Authority, Measurement
from adeye.simulate.faults.injector import Past, Queue, Rows, copied, nothing_yet, take_rows

if TYPE_CHECKING:
    from adeye.signals import Bools, ControlCommand, Floats
    from adeye.simulate.faults.injector import InjectorContext, Moment

# --- What a fault does to the command that a channel gives ----------------------------------------

TURN = 6.283185307179586
"""A full turn [rad]."""


class Slow:
    """Commands arrive later, with the stamps that they have.

    From the onset on the last command stands until the first one since then has arrived; after the
    end the newest command counts at once.
    """

    def __init__(self, context: InjectorContext) -> None:
        self._queue: Queue[ControlCommand] = Queue(context.ticks("by"))

    def apply(self, command: ControlCommand, moment: Moment) -> ControlCommand:
        """Return the command with the fault in the active runs (B,)."""
        return self._queue.apply(command, moment.active)[0]


class StuckCommand:
    """The last command before the onset is given again and again, with fresh stamps.

    Where there was none, that is no acceleration and the wheels straight, status silent.
    """

    def __init__(self, _context: InjectorContext) -> None:
        self._held: ControlCommand | None = None

    def apply(self, command: ControlCommand, moment: Moment) -> ControlCommand:
        """Return the command with the fault in the active runs (B,)."""
        active = moment.active
        if self._held is None:
            self._held = nothing_yet(command)
        if not active.any():
            self._held = command.copy()
            return command
        stuck = command.copy()
        take_rows(stuck, self._held, active)
        stuck.stamp[active] = command.stamp[active]
        # In runs without the fault this is their own newest command.
        self._held = stuck
        return stuck


class _Altered:
    """A command is altered in the active runs; without any it is returned itself."""

    def __init__(self, _context: InjectorContext) -> None: ...

    def apply(self, command: ControlCommand, moment: Moment) -> ControlCommand:
        """Return the command with the fault in the active runs (B,)."""
        if not moment.active.any():
            return command
        altered = command.copy()
        self._alter(altered, moment)
        return altered

    def _alter(self, command: ControlCommand, moment: Moment) -> None:
        raise NotImplementedError


class _Disturbed(_Altered):
    """Acceleration and steering angle of a channel are changed, and nothing else."""

    def __init__(self, context: InjectorContext) -> None:
        names = ("acceleration", "steering_angle")
        self._sizes = {name: context.column(name) for name in names}

    def _alter(self, command: ControlCommand, moment: Moment) -> None:
        for name, size in self._sizes.items():
            values: Floats = getattr(command, name)
            values[moment.active] = self._changed(values, size, moment)[moment.active]

    def _changed(self, values: Floats, size: Floats, moment: Moment) -> Floats:
        raise NotImplementedError


class Bias(_Disturbed):
    """Something is added."""

    def _changed(self, values: Floats, size: Floats, _moment: Moment) -> Floats:
        return values + size


class Scale(_Disturbed):
    """The command is multiplied."""

    def _changed(self, values: Floats, size: Floats, _moment: Moment) -> Floats:
        return values * size


class Oscillating(_Disturbed):
    """A cosine is added that begins with its whole amplitude at the onset."""

    def __init__(self, context: InjectorContext) -> None:
        super().__init__(context)
        self._frequency = context.column("frequency")

    def _changed(self, values: Floats, size: Floats, moment: Moment) -> Floats:
        wave = np.zeros(values.shape)
        for run in np.flatnonzero(moment.active):
            turns = self._frequency[run] * moment.age[run]
            # What is beyond a turn is dropped first, exactly, so that no time is too late.
            wave[run] = cos(TURN * (turns - np.floor(turns)))
        return values + size * wave


class PlausibleButWrong(_Disturbed):
    """A constant command that looks healthy: status ok, stamp of this tick."""

    def _alter(self, command: ControlCommand, moment: Moment) -> None:
        super()._alter(command, moment)
        _claim_health(command, moment.active, moment.time)

    def _changed(self, _values: Floats, size: Floats, _moment: Moment) -> Floats:
        return size


class NotANumber(_Altered):
    """Acceleration and steering angle are no numbers."""

    def _alter(self, command: ControlCommand, moment: Moment) -> None:
        command.acceleration[moment.active] = np.nan
        command.steering_angle[moment.active] = np.nan


class HeartbeatLies(_Altered):
    """What is degraded, in fault or silent says ok, with the stamp of this tick.

    A request for authority is no fault and stays one.
    """

    def _alter(self, command: ControlCommand, moment: Moment) -> None:
        ill = moment.active & np.isin(command.status, (DEGRADED, FAULT, SILENT))
        _claim_health(command, ill, moment.time)


def _claim_health(command: ControlCommand, runs: Bools, time: float) -> None:
    command.status[runs] = OK
    command.stamp[runs] = time


# --- What a fault does to what one channel is shown of a sensor, of another channel or of the
# switch.


class LinkDelay(Generic[Rows]):
    """What a link shows comes later, in order.

    From the onset on, what was shown last stands until the first message since then has come
    through; after the end the newest one is shown at once.
    """

    def __init__(self, context: InjectorContext) -> None:
        self._queue: Queue[Rows] = Queue(context.ticks("by"))

    def apply(self, thing: Rows, moment: Moment) -> Rows:
        """Return what the channel is shown, with the fault in the active runs (B,)."""
        late, stands = self._queue.apply(thing, moment.active)
        if late is not thing:
            _not_fresh(late, stands)
        return late


class _Lossy(Generic[Rows]):
    """Some messages are not what they should be, each by its own draw.

    Where the newest message has not come through, what was shown last stands.
    """

    def __init__(self, context: InjectorContext) -> None:
        self._seeds = context.scene.stream_seeds
        self._owner = context.owner
        runs = len(context.specs)
        self._probability = context.column("probability")
        self._number = np.zeros(runs, dtype=np.int64)
        self._behind = np.zeros(runs, dtype=np.bool_)
        self._shown: Any = None

    def _drawn(self, messages: Bools, active: Bools) -> Bools:
        """Tell which messages are hit; every message of the run counts, so that none shifts."""
        hit = np.zeros(messages.shape, dtype=np.bool_)
        for run in np.flatnonzero(messages & active):
            draw = uniform(self._seeds[run], self._owner, int(self._number[run]), 0)
            hit[run] = draw < self._probability[run]
        self._number += messages
        return hit

    def _last(self, thing: Rows) -> Rows:
        if self._shown is None:
            self._shown = nothing_yet(thing)
        last: Rows = self._shown
        return last

    def _show(self, thing: Rows) -> Rows:
        """Remember what is shown; the stages before may use their arrays again."""
        self._shown = copied(thing)
        return thing


class Drop(_Lossy[Rows]):
    """Messages are lost, alone or in bursts."""

    def __init__(self, context: InjectorContext) -> None:
        super().__init__(context)
        self._burst = context.column("burst").astype(np.int64)
        self._left = np.zeros(self._burst.shape, dtype=np.int64)

    def apply(self, thing: Rows, moment: Moment) -> Rows:
        """Return what the channel is shown, with the fault in the active runs (B,)."""
        active, messages, last = moment.active, _messages(thing), self._last(thing)
        begins = self._drawn(messages, active) & (self._left == 0)
        self._left = np.where(begins, self._burst, self._left) * active
        lost = messages & (self._left > 0)
        self._left -= lost
        self._behind = active & np.where(messages, lost, self._behind)
        if not active.any():
            return self._show(thing)
        seen = copied(thing)
        take_rows(seen, last, self._behind)
        _not_fresh(seen, self._behind)
        return self._show(seen)


class Duplicate(_Lossy[Rows]):
    """The message before comes again in place of a new one, with the stamp of the new one."""

    def apply(self, thing: Rows, moment: Moment) -> Rows:
        """Return what the channel is shown, with the fault in the active runs (B,)."""
        active, messages, last = moment.active, _messages(thing), self._last(thing)
        again = self._drawn(messages, active)
        self._behind = active & np.where(messages, again, self._behind)
        if not active.any():
            return self._show(thing)
        seen = copied(thing)
        take_rows(seen, last, self._behind)
        for name, runs in (("stamp", again), ("fresh", self._behind)):
            # The switch's state has neither.
            if hasattr(seen, name):
                getattr(seen, name)[runs] = getattr(thing, name)[runs]
        return self._show(seen)


class Reorder(_Lossy[Rows]):
    """Messages are held up, and shown when they arrive, although newer ones have been.

    What is still held up when the fault ends is lost.
    """

    def __init__(self, context: InjectorContext) -> None:
        super().__init__(context)
        self._lags = context.ticks("by")
        longest = int(self._lags.max(initial=0))
        self._past: Past[Rows] = Past(longest)
        self._held: deque[Bools] = deque(maxlen=longest + 1)

    def apply(self, thing: Rows, moment: Moment) -> Rows:
        """Return what the channel is shown, with the fault in the active runs (B,)."""
        active, messages, last = moment.active, _messages(thing), self._last(thing)
        held = self._drawn(messages, active)
        self._past.add(thing)
        self._held.appendleft(held)
        for earlier in self._held:
            earlier[~active] = False
        arrives = np.zeros(active.shape, dtype=np.bool_)
        for run in np.flatnonzero(active):
            lag = self._lags[run]
            arrives[run] = lag < len(self._held) and self._held[lag][run]
        if not active.any():
            self._behind[:] = False
            return self._show(thing)
        stands = active & ~arrives & np.where(messages, held, self._behind)
        self._behind = active & (stands | arrives)
        seen = copied(thing)
        take_rows(seen, last, stands)
        _not_fresh(seen, stands)
        self._past.write(seen, self._lags, arrives)
        return self._show(seen)


def _messages(thing: object) -> Bools:
    """Tell in which runs (B,) something is sent at this tick."""
    if isinstance(thing, Measurement):
        return thing.fresh | ~thing.alive
    rows = thing.channel if isinstance(thing, Authority) else cast("ControlCommand", thing).stamp
    return np.ones(rows.shape, dtype=np.bool_)


def _not_fresh(thing: object, runs: Bools) -> None:
    if isinstance(thing, Measurement):
        thing.fresh[runs] = False


# --- What a fault does to the acting command on its way to drive, brake, steering and tyres -------


def part_of(actuator: str, command: Floats) -> Floats:
    """Return what an actuator is asked for (B,): drive >= 0, brake <= 0 [m/s²], steering [rad].

    Args:
        actuator: ``drive``, ``brake`` or ``steering``.
        command: (B, 2) acceleration [m/s²] and steering angle [rad].
    """
    if actuator == "steering":
        return command[:, 1].copy()
    acceleration = command[:, 0]
    limit = np.maximum if actuator == "drive" else np.minimum
    return np.asarray(limit(acceleration, 0.0))


class _Otherwise:
    """Something else is done in the active runs than what is asked for, or than there is."""

    def apply(self, part: Floats, moment: Moment) -> Floats:
        """Return what is done (B,), with the fault in the active runs; itself without any."""
        active = moment.active
        return np.where(active, self._faulty(part, moment), part) if active.any() else part

    def _faulty(self, part: Floats, moment: Moment) -> Floats:
        raise NotImplementedError


class Loss(_Otherwise):
    """A share of what is asked for is missing."""

    def __init__(self, context: InjectorContext) -> None:
        self._share = context.column("share")

    def _faulty(self, part: Floats, _moment: Moment) -> Floats:
        return part * (1.0 - self._share)


class Fade(_Otherwise):
    """The missing share grows evenly with the time since the first onset."""

    def __init__(self, context: InjectorContext) -> None:
        self._share = context.column("share")
        self._over = context.column("over")

    def _faulty(self, part: Floats, moment: Moment) -> Floats:
        # The age of a fault that has not begun is no number.
        age = np.where(moment.active, moment.age, 0.0)
        return part * (1.0 - self._share * np.clip(age / self._over, 0.0, 1.0))


class Offset(_Otherwise):
    """The wheels are steered beside what is asked for."""

    def __init__(self, context: InjectorContext) -> None:
        self._angle = context.column("steering_angle")

    def _faulty(self, part: Floats, _moment: Moment) -> Floats:
        return part + self._angle


class ActuatorDelay:
    """The actuator does later what it is asked for.

    From the onset on it does what it did last until the first thing asked since then comes through.
    """

    def __init__(self, context: InjectorContext) -> None:
        self._queue: Queue[Floats] = Queue(context.ticks("by"))

    def apply(self, part: Floats, moment: Moment) -> Floats:
        """Return what the actuator does (B,), with the fault in the active runs."""
        return self._queue.apply(part, moment.active)[0]


class StuckActuator(_Otherwise):
    """The actuator does what it did last before the onset; at first that is nothing."""

    def __init__(self, context: InjectorContext) -> None:
        self._last = np.zeros(len(context.specs))

    def apply(self, part: Floats, moment: Moment) -> Floats:
        """Return what the actuator does (B,), with the fault in the active runs."""
        done = super().apply(part, moment)
        self._last = done.copy()
        return done

    def _faulty(self, _part: Floats, _moment: Moment) -> Floats:
        return self._last


class RateLimit(StuckActuator):
    """The actuator follows no quicker than a rate, from what it did at the tick before."""

    def __init__(self, context: InjectorContext) -> None:
        super().__init__(context)
        self._most = context.column("rate") * context.step

    def _faulty(self, part: Floats, _moment: Moment) -> Floats:
        return np.clip(part, self._last - self._most, self._last + self._most)


class Friction(_Otherwise):
    """The tyres grip otherwise than the road has it."""

    def __init__(self, context: InjectorContext) -> None:
        self._value = context.column("value")
        self._factor = context.column("factor")

    def _faulty(self, friction: Floats, _moment: Moment) -> Floats:
        return np.where(np.isfinite(self._value), self._value, friction * self._factor)
