"""Where an object will be: in road coordinates, at equal steps of time.

A vehicle goes on at its speed, or brakes on until it stands; one that moves sideways completes its
lane change. Cyclists and pedestrians go on straight, wherever that is. How unsure a prediction is
grows with its time, faster for those who may turn at any time; see ``margin_at``. Channels predict
their tracks with it, and the grid map what it draws.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from adeye.kernel.jit import inlined
from adeye.kernel.road import lane_center

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

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
    body: Floats,
    sideways: float,
    is_free: bool,  # noqa: FBT001 - a kernel
    acceleration: float,
    lane_width: float,
    lanes: int,
    interval: float,
    way: Floats,
) -> None:
    """Predict one object.

    Args:
        body: (OBJECT_ROW,) with its size, place and speed; the rest is written.
        sideways: Its speed to the left [m/s]; 0 for a vehicle that keeps its lane.
        is_free: Whether it goes on straight wherever that is: a cyclist or pedestrian.
        acceleration: Along the road [m/s²].
        lane_width: [m].
        lanes: How many there are.
        interval: Time between two samples [s]; the first is one interval ahead.
        way: (N, WAY_ROW) out, N samples.
    """
    d, forward = body[OBJECT_D], body[OBJECT_SPEED]
    body[OBJECT_BRAKING] = believed_braking(acceleration, forward)
    body[OBJECT_GROWTH] = FREE_GROWTH if is_free else 1.0
    _set_heading(body, forward, sideways)
    goal = sideways * math.inf if sideways != 0.0 else d
    if not is_free and sideways != 0.0:
        goal = lane_ahead(d, sideways, lane_width, lanes)
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
def lane_ahead(d: float, sideways: float, lane_width: float, lanes: int) -> float:
    """Return where a vehicle that moves sideways will end: the next lane centre that way [m].

    Args:
        d: Where it is [m].
        sideways: Its speed to the left, not 0 [m/s].
        lane_width: [m].
        lanes: How many there are; beyond the outermost centre it goes on, to infinity.
    """
    place = d / lane_width - 0.5
    lane = math.floor(place) + 1.0 if sideways > 0.0 else math.ceil(place) - 1.0
    if lane < 0.0 or lane >= lanes:
        return sideways * math.inf
    return lane_center(int(lane), lane_width)


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
