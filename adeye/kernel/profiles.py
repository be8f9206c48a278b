"""Lateral paths along a road and speed profiles along them, in closed form.

A path gives the lateral place over the way along the road, so it can be driven at any speed, also
to standstill. A profile gives way and speed over time. Every profile can be driven on every path.
Path: Werling, Ziegler, Kammel, Thrun (2010), "Optimal trajectory generation for dynamic street
scenarios in a Frenet frame", section IV, with the way as argument, as there for low speeds.

A vehicle goes on at its speed, or brakes on until it stands; one that moves sideways completes its
lane change. Cyclists and pedestrians go on straight, wherever that is. How unsure a prediction is
grows with its time, faster for those who may turn at any time; see ``margin_at``. Channels predict
their tracks with it, and the grid map what it draws.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import Ground, center_ahead

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

# --- Lateral paths along a road and speed profiles along them, in closed form ---------------------

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
    PATH_ROOM,  # way that is left of the lanes that it leads through [m], infinity without end
) = range(14)
PATH_ROW: Final = 14

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


# --- Where an object will be: in road coordinates, at equal steps of time -------------------------

# Columns of an object that is predicted.
(
    OBJECT_LENGTH,  # [m]
    OBJECT_WIDTH,
    OBJECT_SINE,  # of its heading against the road's
    OBJECT_COSINE,
    OBJECT_GROWTH,  # how many times faster than a vehicle's its prediction gets unsure
    OBJECT_BEHIND,  # whether all of it is behind the ego
    OBJECT_S,  # along the road from the ego's centre now [m]
    OBJECT_D,  # from the right edge to the left [m]
    OBJECT_SPEED,  # along the road [m/s]
    OBJECT_BRAKING,  # acceleration that it goes on with until it stands, <= 0 [m/s²]
) = range(10)
OBJECT_ROW: Final = 10

# Columns of a predicted place.
(
    WAY_S,  # along the road from the ego's centre now [m]
    WAY_D,  # from the right edge to the left [m]
    WAY_SPEED,  # along the road [m/s]
) = range(3)
WAY_ROW: Final = 3

FREE_GROWTH: Final = 2.5
"""How many times faster the prediction of a cyclist or pedestrian gets unsure. Our choice."""

MIN_LATERAL_SPEED: Final = 0.3
"""Lateral speed below which an object is taken to keep its lane [m/s], beside one standard
deviation of the track's own. Swaying in the lane reaches 0.3 m/s; a lane change peaks at 0.8 m/s
and more. Our choice."""

_LEAST_BRAKING: Final = 1.5
_MOST_BRAKING: Final = 10.0
"""Deceleration of an object that counts as braking, and the most that is believed [m/s²]."""

_TURNING: Final = 2.0
"""Speed from which the direction of motion tells the heading [m/s]."""


@inlined
def predict_body(
    ground: Ground,
    s: float,
    body: Floats,
    sideways: float,
    is_free: bool,  # noqa: FBT001 - a kernel
    acceleration: float,
    interval: float,
    way: Floats,
) -> None:
    """Predict one object.

    Args:
        ground: The road.
        s: Of it along the road [m].
        body: (OBJECT_ROW,) with its size, place and speed; the rest is written.
        sideways: Its speed to the left [m/s]; 0 for a vehicle that keeps its lane.
        is_free: Whether it goes on straight wherever that is: a cyclist or pedestrian.
        acceleration: Along the road [m/s²].
        interval: Time between two samples [s]; the first is one interval ahead.
        way: (N, WAY_ROW) out, N samples.
    """
    d, forward = body[OBJECT_D], body[OBJECT_SPEED]
    body[OBJECT_BRAKING] = believed_braking(acceleration, forward)
    body[OBJECT_GROWTH] = FREE_GROWTH if is_free else 1.0
    _set_heading(body, forward, sideways)
    goal = sideways * math.inf if sideways != 0.0 else d
    if not is_free and sideways != 0.0:
        goal = center_ahead(ground, s, d, sideways)
    _fill_way(body, sideways, goal, interval, way)


@inlined
def believed_braking(acceleration: float, forward: float) -> float:
    """Return the acceleration that an object is taken to go on with until it stands [m/s²].

    Args:
        acceleration: Of its track [m/s²].
        forward: Its speed along the road [m/s]; one that comes towards the ego does not brake.
    """
    if forward <= 0.0 or acceleration > -_LEAST_BRAKING:
        return 0.0
    return max(-_MOST_BRAKING, acceleration)


@inlined
def _set_heading(body: Floats, forward: float, sideways: float) -> None:
    body[OBJECT_SINE], body[OBJECT_COSINE] = 0.0, 1.0
    speed = math.sqrt(forward * forward + sideways * sideways)
    if speed > _TURNING:
        body[OBJECT_SINE], body[OBJECT_COSINE] = sideways / speed, forward / speed


@inlined
def _fill_way(body: Floats, sideways: float, goal: float, interval: float, way: Floats) -> None:
    """Write the places of one object, (N, WAY_ROW), that moves sideways as far as a goal."""
    speed, braking = body[OBJECT_SPEED], body[OBJECT_BRAKING]
    stands = speed / -braking if braking < 0.0 else math.inf
    for sample in range(way.shape[0]):
        time = (sample + 1) * interval
        rolling = min(time, stands)
        way[sample, WAY_S] = body[OBJECT_S] + (speed + 0.5 * braking * rolling) * rolling
        way[sample, WAY_SPEED] = speed + braking * rolling if time < stands else 0.0
        moved = body[OBJECT_D] + sideways * rolling
        way[sample, WAY_D] = min(moved, goal) if sideways > 0.0 else max(moved, goal)


@inlined
def margin_at(margin: float, growth: float, faster: float, time: float) -> float:
    """Return the distance from a predicted object below which a trajectory is too near [m].

    Args:
        margin: Now [m].
        growth: Of a vehicle's prediction [m/s].
        faster: How many times faster it grows, ``OBJECT_GROWTH``.
        time: Of the prediction [s].
    """
    return margin + growth * faster * time
