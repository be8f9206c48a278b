"""Lanes as rows of numbers: straight and circular ones, and places beside their centre.

A lane is a row (LANE_WIDTH,). A place is (s, lateral): s [m] along its centre from its start, and
how far to the left of the centre [m].

Source:
    Formulas and their order are those of highway-env 1.12 (``road/lane.py``), with y to the left.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import atan2, cos, sin_cos
from adeye.kernel.jit import compiled, inlined

Floats = NDArray[np.float64]

# Columns of a lane. X and Y are its start, of an arc the centre of its circle.
(
    KIND,
    LANE_X,
    LANE_Y,
    LANE_HEADING,
    LANE_COSINE,
    LANE_SINUS,
    LANE_LENGTH,
    WIDTH,
    LIMIT,
    FORBIDDEN,
    RADIUS,
    PHASE,
    TURN,
    LEAST_X,
    MOST_X,
    LEAST_Y,
    MOST_Y,
    ALONGSIDE,
) = range(18)
LANE_WIDTH: Final = 18
"""Columns of a lane. ``LIMIT`` is its speed limit [m/s], inf for none; ``TURN`` of an arc is 1 to
the left and -1 to the right; four are a box around the centre line, for quick looks; the last says
that all lanes are side by side on one straight road, see ``network.mark_alongside``."""

STRAIGHT, ARC = 0.0, 1.0

OVERHANG: Final = 5.0
"""How far before its start and past its end something still counts as on a lane [m]."""


@inlined
def wrapped(angle: float) -> float:
    """Return the same direction in [-pi, pi) [rad], rounded as ``(angle + pi) % (2 pi) - pi``."""
    turned = angle + math.pi
    if not 0.0 <= turned < 2.0 * math.pi:
        turned %= 2.0 * math.pi
    return turned - math.pi


@inlined
def _arc_local(
    dx: float, dy: float, radius: float, phase: float, turn: float
) -> tuple[float, float]:
    """Return the place beside an arc of a point given from the centre of its circle."""
    phi = phase + wrapped(atan2(dy, dx) - phase)
    return turn * (phi - phase) * radius, turn * (radius - math.sqrt(dx * dx + dy * dy))


@inlined
def straight_local(lanes: Floats, lane: int, x: float, y: float) -> tuple[float, float]:
    """Return the place (s, lateral) of a point beside the straight line of a lane's row [m]."""
    dx = x - lanes[lane, LANE_X]
    dy = y - lanes[lane, LANE_Y]
    s = dx * lanes[lane, LANE_COSINE] + dy * lanes[lane, LANE_SINUS]
    return s, dy * lanes[lane, LANE_COSINE] - dx * lanes[lane, LANE_SINUS]


@inlined
def lane_local(lanes: Floats, lane: int, x: float, y: float) -> tuple[float, float]:
    """Return the place (s, lateral) of a point beside a lane [m].

    Args:
        lanes: (L, LANE_WIDTH).
        lane: Number of the lane.
        x: [m].
        y: [m].
    """
    dx = x - lanes[lane, LANE_X]
    dy = y - lanes[lane, LANE_Y]
    s = dx * lanes[lane, LANE_COSINE] + dy * lanes[lane, LANE_SINUS]
    lateral = dy * lanes[lane, LANE_COSINE] - dx * lanes[lane, LANE_SINUS]
    if lanes[lane, KIND] == ARC:
        s, lateral = _arc_local(dx, dy, lanes[lane, RADIUS], lanes[lane, PHASE], lanes[lane, TURN])
    return s, lateral


@inlined
def lane_heading(lanes: Floats, lane: int, s: float) -> float:
    """Return the direction of a lane at a place along it [rad], not wrapped.

    Args:
        lanes: (L, LANE_WIDTH).
        lane: Number of the lane.
        s: [m].
    """
    heading = lanes[lane, LANE_HEADING]
    if lanes[lane, KIND] == ARC:
        turn = lanes[lane, TURN]
        heading = turn * s / lanes[lane, RADIUS] + lanes[lane, PHASE] + math.pi / 2.0 * turn
    return heading


@inlined
def lane_point(lanes: Floats, lane: int, s: float, lateral: float) -> tuple[float, float]:
    """Return the point (x, y) at a place beside a lane [m].

    Args:
        lanes: (L, LANE_WIDTH).
        lane: Number of the lane.
        s: [m].
        lateral: To the left of the centre [m].
    """
    if lanes[lane, KIND] == ARC:
        sine, cosine = sin_cos(lanes[lane, TURN] * s / lanes[lane, RADIUS] + lanes[lane, PHASE])
        reach = lanes[lane, RADIUS] - lateral * lanes[lane, TURN]
        return lanes[lane, LANE_X] + reach * cosine, lanes[lane, LANE_Y] + reach * sine
    x = lanes[lane, LANE_X] + s * lanes[lane, LANE_COSINE] - lateral * lanes[lane, LANE_SINUS]
    return x, lanes[lane, LANE_Y] + s * lanes[lane, LANE_SINUS] + lateral * lanes[lane, LANE_COSINE]


@inlined
def is_on_lane(lanes: Floats, lane: int, s: float, lateral: float, margin: float) -> bool:
    """Tell whether a place lies on a lane widened by a margin [m] to either side."""
    return (
        abs(lateral) <= lanes[lane, WIDTH] / 2.0 + margin
        and -OVERHANG <= s < lanes[lane, LANE_LENGTH] + OVERHANG
    )


@inlined
def is_reachable(lanes: Floats, lane: int, s: float, lateral: float) -> bool:
    """Tell whether one may change to a lane from a place beside it."""
    return (
        lanes[lane, FORBIDDEN] == 0.0
        and abs(lateral) <= 2.0 * lanes[lane, WIDTH]
        and 0.0 <= s < lanes[lane, LANE_LENGTH] + OVERHANG
    )


@inlined
def distance_to_lane(lanes: Floats, lane: int, s: float, lateral: float) -> float:
    """Return how far a place is from the centre line, along plus across [m]."""
    return abs(lateral) + max(s - lanes[lane, LANE_LENGTH], 0.0) + max(0.0 - s, 0.0)


@inlined
def least_distance(lanes: Floats, lane: int, x: float, y: float) -> float:
    """Return a distance [m] that a point has at least from a lane; cheap, and often far too low.

    Never above ``distance_to_lane`` of its place, nor above what a place on the lane's margin and
    overhang has, but for rounding.
    """
    dx = max(lanes[lane, LEAST_X] - x, x - lanes[lane, MOST_X])
    return max(dx, lanes[lane, LEAST_Y] - y, y - lanes[lane, MOST_Y])


@compiled
def write_straight(
    lane: Floats, x: float, y: float, heading: float, length: float, width: float, limit: float
) -> None:
    """Write a straight lane.

    Args:
        lane: (LANE_WIDTH,) out.
        x: Of its start [m].
        y: Of its start [m].
        heading: [rad].
        length: [m].
        width: [m].
        limit: Speed limit [m/s], inf for none.
    """
    lane[:] = 0.0
    lane[KIND], lane[LANE_X], lane[LANE_Y], lane[LANE_HEADING] = STRAIGHT, x, y, heading
    lane[LANE_SINUS], lane[LANE_COSINE] = sin_cos(heading)
    lane[LANE_LENGTH], lane[WIDTH], lane[LIMIT] = length, width, limit
    _bound(lane, x, y, x + length * lane[LANE_COSINE], y + length * lane[LANE_SINUS], 0.0)


@compiled
def write_arc(
    lane: Floats,
    x: float,
    y: float,
    radius: float,
    phase: float,
    turn: float,
    length: float,
    width: float,
    limit: float,
) -> None:
    """Write a circular lane.

    Args:
        lane: (LANE_WIDTH,) out.
        x: Of the centre [m].
        y: Of the centre [m].
        radius: > 0 [m].
        phase: Direction of its start as seen from the centre [rad].
        turn: 1 to the left, -1 to the right.
        length: [m].
        width: [m].
        limit: Speed limit [m/s], inf for none.
    """
    lane[:] = 0.0
    lane[KIND], lane[LANE_X], lane[LANE_Y], lane[RADIUS] = ARC, x, y, radius
    lane[PHASE], lane[TURN] = phase, turn
    lane[LANE_LENGTH], lane[WIDTH], lane[LIMIT] = length, width, limit
    half = 0.5 * length / radius
    if half >= 0.5 * math.pi:
        _bound(lane, x, y, x, y, radius)
        return
    # An arc of less than a half turn lies within its sagitta of its chord.
    sine, cosine = sin_cos(phase)
    sine_end, cosine_end = sin_cos(phase + turn * length / radius)
    _bound(
        lane,
        x + radius * cosine,
        y + radius * sine,
        x + radius * cosine_end,
        y + radius * sine_end,
        radius * (1.0 - cos(half)),
    )


@inlined
def _bound(lane: Floats, x_1: float, y_1: float, x_2: float, y_2: float, margin: float) -> None:
    """Write the box around two points, larger by a margin on all sides."""
    lane[LEAST_X], lane[MOST_X] = min(x_1, x_2) - margin, max(x_1, x_2) + margin
    lane[LEAST_Y], lane[MOST_Y] = min(y_1, y_2) - margin, max(y_1, y_2) + margin
