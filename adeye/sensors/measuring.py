"""From what object-level sensors see to what they report: noise, drawn for many runs at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.kernel.branchless import sin_cos_of_any
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal_pairs_of
from adeye.sensors.delivery import insert
from adeye.sensors.reach import CAMERA, RADAR
from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    EGO_X,
    EGO_Y,
    Bools,
    Floats,
    Ints,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

DRAWS = 2
"""Pairs of random numbers per object and sample: distance and bearing, range rate."""

BLOCK: Final = 64
"""Runs whose noise is drawn together, in a fraction of the time that single draws take."""

# Rows of what is seen.
(
    SEEN_X,  # its direction in the map as a unit vector, then its place [m]
    SEEN_Y,
    SEEN_DISTANCE,  # [m]
    SEEN_RATE,  # range rate [m/s]
    SEEN_DISTANCE_NOISE,  # standard deviation of the error of its distance [m]
    SEEN_BEARING_NOISE,  # of its bearing [rad]
    SEEN_RATE_NOISE,  # of its range rate [m/s]
) = range(7)
_SEEN_WIDTH: Final = 7


class Seen(NamedTuple):
    """Memory for what a block of runs sees, run after run.

    Attributes:
        items: (_SEEN_WIDTH, N) how each detected object is seen.
        things: (N,) which object that is.
        seeds: (N,) stream seed of its run.
        indices: (DRAWS, N) of its draws.
        noise: (2 DRAWS, N) what was drawn.
        poses: (BLOCK, 4) cosine and sine of the ego's heading, x and y of the sensor [m].
        ends: (BLOCK,) item behind the last of a run.
    """

    items: Floats
    things: Ints
    seeds: NDArray[np.uint64]
    indices: Ints
    noise: Floats
    poses: Floats
    ends: Ints


def memory_for(objects: int) -> Seen:
    """Make the memory for a block of runs with M objects."""
    size = BLOCK * objects
    return Seen(
        items=np.zeros((_SEEN_WIDTH, size)),
        things=np.zeros(size, dtype=np.int64),
        seeds=np.zeros(size, dtype=np.uint64),
        indices=np.zeros((DRAWS, size), dtype=np.int64),
        noise=np.zeros((2 * DRAWS, size)),
        poses=np.zeros((BLOCK, 4)),
        ends=np.zeros(BLOCK, dtype=np.int64),
    )


@inlined
def note(  # noqa: PLR0913, PLR0917 - a kernel
    kind: int,
    parameters: Any,
    seen: Seen,
    item: int,
    seed: np.uint64,
    thing: int,
    ux: float,
    uy: float,
    distance: float,
    rate: float,
) -> None:
    """Note an object that is seen, and the noise that it is to get.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        parameters: Record of the sensor.
        seen: In and out.
        item: Which one of the block.
        seed: Stream seed of its run.
        thing: Object that is seen.
        ux: Unit vector towards it in the map.
        uy: Of the same.
        distance: [m].
        rate: Range rate [m/s].
    """
    items = seen.items
    items[SEEN_X, item], items[SEEN_Y, item] = ux, uy
    items[SEEN_DISTANCE, item], items[SEEN_RATE, item] = distance, rate
    items[SEEN_BEARING_NOISE, item] = parameters["bearing_noise"]
    if kind == CAMERA:
        # Distance from the height in the image: its error grows with the distance squared.
        sigma = parameters["distance_noise"] * distance * distance / parameters["range"]
    else:
        sigma = parameters["range_noise"]
    items[SEEN_DISTANCE_NOISE, item] = sigma
    if kind == RADAR:
        items[SEEN_RATE_NOISE, item] = parameters["range_rate_noise"] if distance > 0.0 else 0.0
    seen.things[item] = thing
    seen.seeds[item] = seed
    for draw in range(DRAWS):
        seen.indices[draw, item] = DRAWS * thing + draw


@inlined
def measure(kind: int, seen: Seen, count: int, owner: np.uint64, number: int) -> None:
    """Draw the noise of all items of a block of runs, and add it.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        seen: In and out: directions become places from the sensor in the map.
        count: Number of items.
        owner: Owner number of the sensor.
        number: Number of the sample.
    """
    for draw in range(DRAWS if kind == RADAR else 1):
        normal_pairs_of(
            seen.seeds[:count],
            owner,
            number,
            seen.indices[draw, :count],
            seen.noise[2 * draw],
            seen.noise[2 * draw + 1],
        )
    _disturb(seen.items, seen.noise, count)
    if kind == RADAR:
        rates, sigmas = seen.items[SEEN_RATE], seen.items[SEEN_RATE_NOISE]
        for item in range(count):
            rates[item] += sigmas[item] * seen.noise[2, item]


@compiled
def _disturb(items: Floats, noise: Floats, count: int) -> None:
    """Turn directions and distances into places with an error, several at a time.

    A distance below zero lies on the other side of the sensor: cut, its mean would be wrong.
    """
    for item in range(count):
        distance = items[SEEN_DISTANCE, item] + items[SEEN_DISTANCE_NOISE, item] * noise[0, item]
        s, c = sin_cos_of_any(items[SEEN_BEARING_NOISE, item] * noise[1, item])
        ux, uy = items[SEEN_X, item], items[SEEN_Y, item]
        items[SEEN_X, item] = distance * (c * ux - s * uy)
        items[SEEN_Y, item] = distance * (s * ux + c * uy)


@inlined
def write(  # noqa: PLR0913, PLR0917 - a kernel
    kind: int,
    ego: Floats,
    sizes: Floats,
    classes: Ints,
    seen: Seen,
    row: int,
    first: int,
    order: Ints,
    mask: Bools,
    detections: Floats,
    source: Ints,
) -> None:
    """Write what one run of a block has measured, by increasing distance.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        ego: (7,) state.
        sizes: (M, 3).
        classes: (M,).
        seen: Of the block, measured.
        row: Of the run in its block.
        first: Its first item.
        order: (M,) scratch.
        mask: (M,) out.
        detections: (M, 7) out.
        source: (M,) out.
    """
    count = seen.ends[row] - first
    c, s, x, y = seen.poses[row]
    items, things = seen.items.T[first:], seen.things[first:]
    for item in range(count):
        dx, dy = x + items[item, SEEN_X] - ego[EGO_X], y + items[item, SEEN_Y] - ego[EGO_Y]
        items[item, SEEN_X] = c * dx + s * dy
        items[item, SEEN_Y] = -s * dx + c * dy
        insert(order, items, item, item, dx * dx + dy * dy)
    for place in range(count):
        item = order[place]
        thing = things[item]
        mask[place] = True
        source[place] = thing
        detections[place, DETECTION_X] = items[item, SEEN_X]
        detections[place, DETECTION_Y] = items[item, SEEN_Y]
        detections[place, DETECTION_RANGE_RATE] = items[item, SEEN_RATE]
        detections[place, DETECTION_HAS_RANGE_RATE] = 1.0 if kind == RADAR else 0.0
        detections[place, DETECTION_LENGTH] = sizes[thing, 0]
        detections[place, DETECTION_WIDTH] = sizes[thing, 1]
        detections[place, DETECTION_CLASS] = classes[thing]
