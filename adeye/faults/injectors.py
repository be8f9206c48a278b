"""What a fault does to a sensor or a channel; the identity, bit for bit, where it is not active."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.channels.failures import silenced

if TYPE_CHECKING:
    from adeye.faults.ports import InjectorContext, Moment
    from adeye.signals import ControlCommand, Measurement


class DropOut:
    """A sensor delivers nothing new; after the fault its next delivery counts again.

    While active ``alive`` and ``fresh`` are false, there are no detections, and stamp and ego
    estimate stand as they were before.
    """

    def __init__(self, _context: InjectorContext) -> None:
        self._last: Measurement | None = None

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with the fault in the active runs (B,).

        Args:
            measurement: The newest measurement; returned itself if no run is active.
            moment: Tells where the fault is present.
        """
        active = moment.active
        if not active.any():
            self._last = measurement
            return measurement
        faulty = measurement.copy()
        faulty.fresh[active] = False
        faulty.alive[active] = False
        faulty.mask[active] = False
        faulty.detections[active] = 0.0
        faulty.source[active] = -1
        if self._last is None:
            self._last = _nothing(measurement)
        faulty.stamp[active] = self._last.stamp[active]
        if faulty.estimate is not None and self._last.estimate is not None:
            faulty.estimate[active] = self._last.estimate[active]
        if faulty.points is not None:
            faulty.points[active] = 0.0
        if faulty.hits is not None:
            faulty.hits[active] = -1
        if faulty.values is not None:
            faulty.values[active] = np.nan
        # In runs without the fault this is their own newest sample, in the others the old one.
        self._last = faulty
        return faulty


class Silence:
    """A channel says nothing: no new command, stamp frozen, status silent."""

    def __init__(self, _context: InjectorContext) -> None:
        self._last: ControlCommand | None = None

    def apply(self, command: ControlCommand, moment: Moment) -> ControlCommand:
        """Return the command with the fault in the active runs (B,).

        Args:
            command: The newest command; returned itself if no run is active.
            moment: Tells where the fault is present.
        """
        active = moment.active
        if not active.any():
            self._last = command
            return command
        if self._last is None:
            self._last = command.copy()
            self._last.acceleration[:] = 0.0
            self._last.steering_angle[:] = 0.0
            self._last.stamp[:] = -1.0
        self._last = silenced(command, self._last, active)
        return self._last


def _nothing(measurement: Measurement) -> Measurement:
    """What a sensor delivers before its first sample."""
    nothing = measurement.copy()
    nothing.stamp[:] = -1.0
    if nothing.estimate is not None:
        nothing.estimate[:] = 0.0
    return nothing
