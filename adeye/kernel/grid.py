"""Compiled: the layers of a grid map, cell by cell, in the frame of the ego.

The frame is that of the vehicle: x forward, y left, the origin at the centre of its body. A layer
is an array (X, Y); cell (i, j) has its centre at ``((i + 0.5) cell - behind, (j + 0.5) cell -
right)``. What lies in a cell is told by its area: a body occupies every cell that it overlaps.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel import profiles
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan2, sin_cos, tan
from adeye.kernel.jit import allocating, compiled, inlined
from adeye.kernel.road import Ground, depth_at, lane_of, place_on, position, refuge_depth
from adeye.kernel.stops import RULE_REFUGE, place_kind, rate_footprint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

_TOUCHING: Final = 1e-9
"""Overlap up to which two edges only touch [m]."""

_HALF_RIGHT: Final = 0.5 * math.pi


@compiled
def fill_ground(
    table: Floats,
    ground: Ground,
    ego: Floats,
    xs: Floats,
    ys: Floats,
    cell: float,
    kinds: Ints,
    lane: Ints,
    refuge: Ints,
    numbers: Floats,
) -> None:
    """Tell what each cell of the ground is, and what the worst of its ground counts.

    Args:
        table: (RULES,) number of each kind of place.
        ground: What there is.
        ego: (3,) x [m], y [m] and heading [rad] in the map.
        xs: (X,) of the centres of the cells [m].
        ys: (Y,) [m].
        cell: Edge of a cell [m].
        kinds: (X, Y) out: kind of place at the centre, see ``stops.place_kind``.
        lane: (X, Y) out: lane of the centre, -1 off the lanes.
        refuge: (X, Y) out: row of the refuge that the centre is in, -1 for none.
        numbers: (X, Y) out: that of a body of the size of the cell which stands on it.
    """
    sine, cosine = sin_cos(ego[2])
    for i in range(xs.shape[0]):
        for j in range(ys.shape[0]):
            x = ego[0] + cosine * xs[i] - sine * ys[j]
            y = ego[1] + sine * xs[i] + cosine * ys[j]
            s, d, heading, _ = place_on(ground, x, y)
            kinds[i, j] = place_kind(ground, s, d)
            lane[i, j] = lane_of(ground, s, d)
            refuge[i, j] = -1
            if kinds[i, j] == RULE_REFUGE:
                depth = refuge_depth(ground.refuges, s)
                for row in range(ground.refuges.shape[0]):
                    if depth_at(ground.refuges[row], s) == depth:
                        refuge[i, j] = row
            # A square looks the same from four sides.
            turn = wrap_to_pi(ego[2] - heading)
            turn -= _HALF_RIGHT * math.floor(turn / _HALF_RIGHT + 0.5)
            numbers[i, j] = rate_footprint(table, ground, s, d, tan(turn), cell, cell)


@inlined
def _cells(center: float, reach: float, first: float, cell: float, count: int) -> tuple[int, int]:
    """Return the first cell that an interval about a centre may reach, and that behind the last."""
    # Bounded before they become whole numbers, which what is far away would not fit into.
    low = max(0.0, (center - reach - first) / cell + 0.5)
    high = min(count - 1.0, (center + reach - first) / cell - 0.5)
    return math.floor(min(low, float(count))), math.ceil(max(high, -1.0)) + 1


@compiled
def cover(
    box: Floats,
    value: float,
    xs: Floats,
    ys: Floats,
    cell: float,
    layer: Floats,
) -> None:
    """Lower the cells that a box overlaps to a value.

    Args:
        box: (6,) centre x, y [m], sine and cosine of its heading in the frame of the ego, its
            length and width [m].
        value: E.g. the time at which it is there [s].
        xs: (X,) of the centres of the cells [m].
        ys: (Y,) [m].
        cell: Edge of a cell [m].
        layer: (X, Y) in and out.
    """
    x, y, sine, cosine = box[0], box[1], abs(box[2]), abs(box[3])
    half, length, width = 0.5 * cell, 0.5 * box[4], 0.5 * box[5]
    # Half the shadow of the box on the axes of the cells, and of a cell on those of the box.
    along, across = cosine * length + sine * width, sine * length + cosine * width
    shadow = half * (sine + cosine)
    if not math.isfinite(x + y + along + across):
        return
    first, last = _cells(x, along, xs[0], cell, xs.shape[0])
    low, high = _cells(y, across, ys[0], cell, ys.shape[0])
    for i in range(first, last):
        dx = xs[i] - x
        if abs(dx) > half + along - _TOUCHING:
            continue
        for j in range(low, high):
            dy = ys[j] - y
            if (
                abs(dy) <= half + across - _TOUCHING
                and abs(box[3] * dx + box[2] * dy) <= length + shadow - _TOUCHING
                and abs(box[3] * dy - box[2] * dx) <= width + shadow - _TOUCHING
            ):
                layer[i, j] = min(layer[i, j], value)


@inlined
def place_box(
    ego: Floats, x: float, y: float, heading: float, length: float, width: float, box: Floats
) -> None:
    """Write a box of the map in the frame of the ego.

    Args:
        ego: (3,) x [m], y [m] and heading [rad] in the map.
        x: Of the centre of the box in the map [m].
        y: [m].
        heading: [rad].
        length: [m].
        width: [m].
        box: (6,) out, see ``cover``.
    """
    sine, cosine = sin_cos(ego[2])
    dx, dy = x - ego[0], y - ego[1]
    box[0], box[1] = cosine * dx + sine * dy, cosine * dy - sine * dx
    box[2], box[3] = sin_cos(wrap_to_pi(heading - ego[2]))
    box[4], box[5] = length, width


@allocating
def cover_at(
    ego: Floats,
    body: Floats,
    value: float,
    xs: Floats,
    ys: Floats,
    cell: float,
    layer: Floats,
) -> None:
    """Lower the cells that a body of the map overlaps to a value.

    Args:
        ego: (3,) x [m], y [m] and heading [rad] in the map.
        body: (5,) x, y [m], heading [rad], length, width [m].
        value: See ``cover``.
        xs: (X,) of the centres of the cells [m].
        ys: (Y,) [m].
        cell: Edge of a cell [m].
        layer: (X, Y) in and out.
    """
    box = np.empty(6)
    place_box(ego, body[0], body[1], body[2], body[3], body[4], box)
    cover(box, value, xs, ys, cell, layer)


@allocating
def sweep(
    ground: Ground,
    ego: Floats,
    body: Floats,
    velocity: Floats,
    acceleration: float,
    is_free: bool,  # noqa: FBT001 - a kernel
    interval: float,
    samples: int,
    xs: Floats,
    ys: Floats,
    cell: float,
    times: Floats,
) -> None:
    """Lower each cell to the time at which a predicted object is first in it.

    Between two samples of the prediction the object goes on steadily.

    Args:
        ground: The road.
        ego: (3,) x [m], y [m] and heading [rad] in the map.
        body: (5,) x, y [m], heading [rad], length, width [m]; where it is now is not covered.
        velocity: (2,) in the map [m/s].
        acceleration: Along the road [m/s²].
        is_free: Whether it goes where it likes, see ``prediction.predict_body``.
        interval: Time between two samples [s].
        samples: How many.
        xs: (X,) of the centres of the cells [m].
        ys: (Y,) [m].
        cell: Edge of a cell [m].
        times: (X, Y) in and out [s].
    """
    s, d, heading, _ = place_on(ground, body[0], body[1])
    sine, cosine = sin_cos(heading)
    forward = cosine * velocity[0] + sine * velocity[1]
    sideways = cosine * velocity[1] - sine * velocity[0]
    if not math.isfinite(s + d + forward + sideways):
        return
    if not is_free and abs(sideways) < profiles.MIN_LATERAL_SPEED:
        sideways = 0.0
    item, way = np.zeros(profiles.OBJECT_ROW), np.empty((samples, profiles.WAY_ROW))
    item[profiles.OBJECT_LENGTH], item[profiles.OBJECT_WIDTH] = body[3], body[4]
    item[profiles.OBJECT_S], item[profiles.OBJECT_D], item[profiles.OBJECT_SPEED] = s, d, forward
    profiles.predict_body(ground, s, item, sideways, is_free, acceleration, interval, way)
    box = np.empty(6)
    reach = 0.5 * (body[3] + body[4]) + cell
    for sample in range(samples):
        ahead, aside = way[sample, profiles.WAY_S] - s, way[sample, profiles.WAY_D] - d
        steps = math.ceil(2.0 * math.sqrt(ahead * ahead + aside * aside) / cell)
        for step in range(1, steps + 1):
            share = step / steps
            x, y, heading = position(ground.segments, s + share * ahead, d + share * aside)
            place_box(ego, x, y, heading, body[3], body[4], box)
            if not (
                xs[0] - reach < box[0] < xs[-1] + reach and ys[0] - reach < box[1] < ys[-1] + reach
            ):
                continue
            turned = box[3] * item[profiles.OBJECT_SINE] + box[2] * item[profiles.OBJECT_COSINE]
            box[3] = box[3] * item[profiles.OBJECT_COSINE] - box[2] * item[profiles.OBJECT_SINE]
            box[2] = turned
            cover(box, (sample + share) * interval, xs, ys, cell, times)
        s, d = way[sample, profiles.WAY_S], way[sample, profiles.WAY_D]


@compiled
def count_cover(
    x: float,
    y: float,
    yaw: float,
    field_of_view: float,
    reach: float,
    xs: Floats,
    ys: Floats,
    counts: Ints,
) -> None:
    """Count a sensor in the cells whose centre it covers.

    Args:
        x: Of its mount in the frame of the vehicle [m].
        y: [m].
        yaw: [rad].
        field_of_view: Whole angle [rad].
        reach: [m].
        xs: (X,) of the centres of the cells [m].
        ys: (Y,) [m].
        counts: (X, Y) in and out.
    """
    half = 0.5 * field_of_view
    for i in range(xs.shape[0]):
        for j in range(ys.shape[0]):
            dx, dy = xs[i] - x, ys[j] - y
            bearing = wrap_to_pi(atan2(dy, dx) - yaw)
            if dx * dx + dy * dy <= reach * reach and abs(bearing) <= half:
                counts[i, j] += 1
