"""What a fault does to the acting command on its way to drive, brake, steering and tyres.

The acceleration that is asked for is driven where it is positive and braked where it is negative;
each actuator has its own part, and what they do adds up.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.faults.rows import Queue

if TYPE_CHECKING:
    from adeye.faults.ports import InjectorContext, Moment
    from adeye.signals import Bools, Floats


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


class Loss:
    """A share of what is asked for is missing."""

    def __init__(self, context: InjectorContext) -> None:
        self._share = context.column("share")

    def apply(self, part: Floats, moment: Moment) -> Floats:
        """Return what the actuator does (B,), with the fault in the active runs."""
        if not moment.active.any():
            return part
        return np.where(moment.active, part * (1.0 - self._share), part)


class Fade:
    """The missing share grows evenly with the time since the first onset."""

    def __init__(self, context: InjectorContext) -> None:
        self._share = context.column("share")
        self._over = context.column("over")

    def apply(self, part: Floats, moment: Moment) -> Floats:
        """Return what the actuator does (B,), with the fault in the active runs."""
        active = moment.active
        if not active.any():
            return part
        # The age of a fault that has not begun is no number.
        age = np.where(active, moment.age, 0.0)
        missing = self._share * np.clip(age / self._over, 0.0, 1.0)
        return np.where(active, part * (1.0 - missing), part)


class Offset:
    """The wheels are steered beside what is asked for."""

    def __init__(self, context: InjectorContext) -> None:
        self._angle = context.column("steering_angle")

    def apply(self, part: Floats, moment: Moment) -> Floats:
        """Return what the actuator does (B,), with the fault in the active runs."""
        if not moment.active.any():
            return part
        return np.where(moment.active, part + self._angle, part)


class RateLimit:
    """The actuator follows no quicker than a rate, from what it did at the tick before."""

    def __init__(self, context: InjectorContext) -> None:
        self._most = context.column("rate") * context.step
        self._last = np.zeros(len(context.specs))

    def apply(self, part: Floats, moment: Moment) -> Floats:
        """Return what the actuator does (B,), with the fault in the active runs."""
        active = moment.active
        limited = part
        if active.any():
            reached = np.clip(part, self._last - self._most, self._last + self._most)
            limited = np.where(active, reached, part)
        self._last = limited.copy()
        return limited


class Delay:
    """The actuator does later what it is asked for.

    From the onset on it does what it did last until the first thing asked since then comes through.
    """

    def __init__(self, context: InjectorContext) -> None:
        self._queue: Queue[Floats] = Queue(context.ticks("by"))

    def apply(self, part: Floats, moment: Moment) -> Floats:
        """Return what the actuator does (B,), with the fault in the active runs."""
        return self._queue.apply(part, moment.active)[0]


class Stuck:
    """The actuator does what it did last before the onset; at first that is nothing."""

    def __init__(self, context: InjectorContext) -> None:
        self._last = np.zeros(len(context.specs))

    def apply(self, part: Floats, moment: Moment) -> Floats:
        """Return what the actuator does (B,), with the fault in the active runs."""
        active = moment.active
        stuck = np.where(active, self._last, part) if active.any() else part
        self._last = stuck.copy()
        return stuck


class Friction:
    """The tyres grip otherwise than the road has it."""

    def __init__(self, context: InjectorContext) -> None:
        self._value = context.column("value")
        self._factor = context.column("factor")

    def apply(self, friction: Floats, moment: Moment) -> Floats:
        """Return the friction coefficients (B,), with the fault in the active runs.

        Args:
            friction: (B,) returned itself if no run is active.
            moment: Tells where the fault is present.
        """
        active: Bools = moment.active
        if not active.any():
            return friction
        has_value = np.isfinite(self._value)
        changed = np.where(has_value, self._value, friction * self._factor)
        return np.where(active, changed, friction)
