"""Lateral paths along a road and speed profiles along them, in closed form.

A path gives the lateral place over the way along the road, so it can be driven at any speed, also
to standstill. A profile gives way and speed over time. Every profile can be driven on every path.
Path: Werling, Ziegler, Kammel, Thrun (2010), "Optimal trajectory generation for dynamic street
scenarios in a Frenet frame", section IV, with the way as argument, as there for low speeds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from adeye.kernel.jit import compiled, inlined

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

# Columns of a path.
(
    PATH_TARGET,  # lateral place at its end [m]
    PATH_LENGTH,  # along the road [m]; behind it the path stays at its target
    PATH_START,  # s of its start [m]
    PATH_EXISTS,
    PATH_IS_FLAT,  # whether it is at its target all along
    PATH_LANE,  # centre of the lane that the target is in [m], NaN on the shoulder
    PATH_COST,  # of its target at any speed
    PATH_0,  # coefficients over the share of the length that is driven [m]
    PATH_1,
    PATH_2,
    PATH_3,
    PATH_4,
    PATH_5,
) = range(13)
PATH_ROW: Final = 13

# Columns of a sample of a profile.
(
    PROFILE_S,  # from now [m]
    PROFILE_SPEED,  # [m/s]
    PROFILE_ACCELERATION,  # [m/s²]
) = range(3)
PROFILE_ROW: Final = 3

PEAK: Final = 10.0 / math.sqrt(3.0)
"""Largest second derivative of the quintic from rest to rest, over a length and a height of 1."""

_LEAST_LENGTH: Final = 1.0
"""Length below which a path is taken to be at its end [m]."""

_SAME: Final = 1e-3
"""Lateral places nearer than this are one [m]."""


@compiled
def fill_profile(
    speed: float,
    acceleration: float,
    wanted: float,
    jerk: float,
    interval: float,
    wait: float,
    profile: Floats,
) -> None:
    """Drive from the present acceleration to a wanted one with constant jerk, then hold it.

    Args:
        speed: Now, >= 0 [m/s].
        acceleration: Now [m/s²].
        wanted: [m/s²].
        jerk: A magnitude, > 0 [m/s³].
        interval: Between two samples [s]; the first is one interval ahead.
        wait: By how much the samples are later than the start of the drive [s]; those that would be
            before the start go back in time.
        profile: (N, PROFILE_ROW) out; the ego stays where it comes to a standstill.
    """
    if speed <= 0.0:
        # A brake that holds has nothing to give way to.
        acceleration = max(0.0, acceleration)
    slope = jerk if wanted > acceleration else -jerk
    ramp = abs(wanted - acceleration) / jerk
    stop_time, stop_s = _standstill(speed, acceleration, wanted, slope, ramp)
    for sample in range(profile.shape[0]):
        time = (sample + 1) * interval - wait
        if time >= stop_time:
            profile[sample, PROFILE_S] = stop_s
            profile[sample, PROFILE_SPEED] = profile[sample, PROFILE_ACCELERATION] = 0.0
            continue
        s, rate = _along(speed, acceleration, wanted, slope, ramp, time)
        profile[sample, PROFILE_S], profile[sample, PROFILE_SPEED] = s, max(0.0, rate)
        profile[sample, PROFILE_ACCELERATION] = (
            wanted if time >= ramp else acceleration + slope * time
        )


@inlined
def _along(
    speed: float, acceleration: float, wanted: float, slope: float, ramp: float, time: float
) -> tuple[float, float]:
    """Return way [m] and speed [m/s] after a time, as if it could go backwards."""
    part = min(time, ramp)
    s = (speed + (0.5 * acceleration + slope * part / 6.0) * part) * part
    rate = speed + (acceleration + 0.5 * slope * part) * part
    rest = time - part
    return s + (rate + 0.5 * wanted * rest) * rest, rate + wanted * rest


@inlined
def _standstill(
    speed: float, acceleration: float, wanted: float, slope: float, ramp: float
) -> tuple[float, float]:
    """Return when and where the ego comes to a standstill; infinity if it does not."""
    _, later = _along(speed, acceleration, wanted, slope, ramp, ramp)
    time = math.inf
    # On the ramp: only where the acceleration falls, and at once if it stands and cannot start.
    if slope < 0.0 and later <= 0.0:
        root = acceleration * acceleration - 2.0 * slope * speed
        time = (acceleration + math.sqrt(root)) / -slope
    elif slope > 0.0 and acceleration < 0.0:
        root = acceleration * acceleration - 2.0 * slope * speed
        if root >= 0.0:
            early = (-acceleration - math.sqrt(root)) / slope
            time = early if early <= ramp else math.inf
    if time == math.inf and wanted < 0.0:
        time = ramp + later / -wanted
    if time == math.inf or (speed <= 0.0 < wanted):
        return math.inf, math.inf
    return time, _along(speed, acceleration, wanted, slope, ramp, time)[0]


@inlined
def lay_path(
    path: Floats,
    start: float,
    d: float,
    slope: float,
    bend: float,
    target: float,
    length: float,
) -> None:
    """Lay the path of fifth order from a lateral state to rest at a target.

    Args:
        path: (PATH_ROW,) out, but for what tells whether it exists, its lane and cost.
        start: s of its start [m].
        d: Lateral place there [m].
        slope: Its change along the road.
        bend: The change of that [1/m].
        target: Lateral place at its end [m].
        length: [m].
    """
    path[PATH_TARGET], path[PATH_LENGTH], path[PATH_START] = target, length, start
    height = target - d
    is_there = abs(height) < _SAME and abs(slope) < 1e-4 and abs(bend) < 1e-5
    path[PATH_IS_FLAT] = 1.0 if is_there or length < _LEAST_LENGTH else 0.0
    one = slope * length
    two = 0.5 * bend * length * length
    path[PATH_0], path[PATH_1], path[PATH_2] = d, one, two
    path[PATH_3] = 10.0 * height - 6.0 * one - 3.0 * two
    path[PATH_4] = -15.0 * height + 8.0 * one + 3.0 * two
    path[PATH_5] = 6.0 * height - 3.0 * one - two


@inlined
def at_path(path: Floats, way: float) -> tuple[float, float, float]:
    """Return lateral place [m], its slope and its bend [1/m] on a path.

    Args:
        path: (PATH_ROW,).
        way: From its start [m].
    """
    if path[PATH_IS_FLAT] > 0.0 or way >= path[PATH_LENGTH]:
        return path[PATH_TARGET], 0.0, 0.0
    per = 1.0 / path[PATH_LENGTH]
    u = max(0.0, way) * per
    two, three, four, five = path[PATH_2], path[PATH_3], path[PATH_4], path[PATH_5]
    d = path[PATH_0] + u * (path[PATH_1] + u * (two + u * (three + u * (four + u * five))))
    slope = path[PATH_1] + u * (2.0 * two + u * (3.0 * three + u * (4.0 * four + u * 5.0 * five)))
    bend = 2.0 * two + u * (6.0 * three + u * (12.0 * four + u * 20.0 * five))
    return d, slope * per, bend * per * per
