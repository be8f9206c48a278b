"""What a fault does to the command that a channel gives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.faults.rows import Queue, nothing_yet, take_rows
from adeye.kernel.elementary import cos
from adeye.signals import DEGRADED, FAULT, OK, SILENT

if TYPE_CHECKING:
    from adeye.faults.ports import InjectorContext, Moment
    from adeye.signals import Bools, ControlCommand, Floats

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


class Stuck:
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


class _Disturbed:
    """Acceleration and steering angle of a channel are changed, and nothing else."""

    def __init__(self, context: InjectorContext) -> None:
        names = ("acceleration", "steering_angle")
        self._sizes = {name: context.column(name) for name in names}

    def apply(self, command: ControlCommand, moment: Moment) -> ControlCommand:
        """Return the command with the fault in the active runs (B,)."""
        active = moment.active
        if not active.any():
            return command
        changed = command.copy()
        for name, size in self._sizes.items():
            values: Floats = getattr(changed, name)
            values[active] = self._changed(values, size, moment)[active]
        return changed

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

    def apply(self, command: ControlCommand, moment: Moment) -> ControlCommand:
        """Return the command with the fault in the active runs (B,)."""
        changed = super().apply(command, moment)
        if changed is not command:
            _claim_health(changed, moment.active, moment.time)
        return changed

    def _changed(self, _values: Floats, size: Floats, _moment: Moment) -> Floats:
        return size


class NotANumber:
    """Acceleration and steering angle are no numbers."""

    def __init__(self, _context: InjectorContext) -> None:
        pass

    def apply(self, command: ControlCommand, moment: Moment) -> ControlCommand:
        """Return the command with the fault in the active runs (B,)."""
        active = moment.active
        if not active.any():
            return command
        changed = command.copy()
        changed.acceleration[active] = np.nan
        changed.steering_angle[active] = np.nan
        return changed


class HeartbeatLies:
    """What is degraded, in fault or silent says ok, with the stamp of this tick.

    A request for authority is no fault and stays one.
    """

    def __init__(self, _context: InjectorContext) -> None:
        pass

    def apply(self, command: ControlCommand, moment: Moment) -> ControlCommand:
        """Return the command with the fault in the active runs (B,)."""
        active = moment.active
        if not active.any():
            return command
        changed = command.copy()
        ill = active & np.isin(command.status, (DEGRADED, FAULT, SILENT))
        _claim_health(changed, ill, moment.time)
        return changed


def _claim_health(command: ControlCommand, runs: Bools, time: float) -> None:
    command.status[runs] = OK
    command.stamp[runs] = time
