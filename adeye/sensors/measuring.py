"""From what object-level sensors see to what they report: noise, drawn for many runs at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import inlined
from adeye.kernel.random import normal_pairs_of
from adeye.sensors.delivery import clear, insert
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

# Columns of what is seen: its direction in the map as a unit vector, later its place in the vehicle
# frame; its distance [m] and range rate [m/s].
SEEN_X, SEEN_Y, SEEN_DISTANCE, SEEN_RATE = range(4)


class Seen(NamedTuple):
    """Memory for what a block of runs sees, run after run.

    Attributes:
        items: (N, 4) how each detected object is seen.
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
        items=np.zeros((size, 4)),
        things=np.zeros(size, dtype=np.int64),
        seeds=np.zeros(size, dtype=np.uint64),
        indices=np.zeros((DRAWS, size), dtype=np.int64),
        noise=np.zeros((2 * DRAWS, size)),
        poses=np.zeros((BLOCK, 4)),
        ends=np.zeros(BLOCK, dtype=np.int64),
    )


@inlined
def name(seen: Seen, item: int, seed: np.uint64, thing: int) -> None:
    """Note whose draws an item needs.

    Args:
        seen: In and out.
        item: Which one.
        seed: Stream seed of its run.
        thing: Object that is seen.
    """
    seen.things[item] = thing
    seen.seeds[item] = seed
    for draw in range(DRAWS):
        seen.indices[draw, item] = DRAWS * thing + draw


@inlined
def draw_noise(kind: int, seen: Seen, count: int, owner: np.uint64, number: int) -> None:
    """Draw the noise of all items of a block of runs.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        seen: In and out.
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


@inlined
def write(  # noqa: PLR0913, PLR0917 - a kernel
    kind: int,
    parameters: Any,
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
    """Add noise to what one run of a block sees, and write it by increasing distance.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        parameters: Record of the sensor.
        ego: (7,) state.
        sizes: (M, 3).
        classes: (M,).
        seen: Of the block, with the noise drawn.
        row: Of the run in its block.
        first: Its first item.
        order: (M,) scratch.
        mask: (M,) out.
        detections: (M, 7) out.
        source: (M,) out.
    """
    count = seen.ends[row] - first
    c, s = seen.poses[row, 0], seen.poses[row, 1]
    items = seen.items[first:]
    for item in range(count):
        x, y = _measure(kind, parameters, seen, row, first + item)
        dx, dy = x - ego[EGO_X], y - ego[EGO_Y]
        items[item, SEEN_X] = c * dx + s * dy
        items[item, SEEN_Y] = -s * dx + c * dy
        insert(order, items, item, item, dx * dx + dy * dy)
    for place in range(count):
        item = order[place]
        thing = seen.things[first + item]
        mask[place] = True
        source[place] = thing
        detections[place, DETECTION_X] = items[item, SEEN_X]
        detections[place, DETECTION_Y] = items[item, SEEN_Y]
        detections[place, DETECTION_RANGE_RATE] = items[item, SEEN_RATE]
        detections[place, DETECTION_HAS_RANGE_RATE] = 1.0 if kind == RADAR else 0.0
        detections[place, DETECTION_LENGTH] = sizes[thing, 0]
        detections[place, DETECTION_WIDTH] = sizes[thing, 1]
        detections[place, DETECTION_CLASS] = classes[thing]
    clear(mask, detections, source, count)


@inlined
def _measure(kind: int, parameters: Any, seen: Seen, row: int, number: int) -> tuple[float, float]:
    """Measured place of a box centre in the map [m]; the range rate gets its noise in place."""
    item = seen.items[number]
    distance, ux, uy = item[SEEN_DISTANCE], item[SEEN_X], item[SEEN_Y]
    if kind == CAMERA:
        # Distance from the height in the image: its error grows with the distance squared.
        sigma = parameters["distance_noise"] * distance * distance / parameters["range"]
    else:
        sigma = parameters["range_noise"]
    if kind == RADAR and distance > 0.0 and parameters["range_rate_noise"] > 0.0:
        item[SEEN_RATE] += parameters["range_rate_noise"] * seen.noise[2, number]
    bearing_noise = parameters["bearing_noise"]
    if sigma > 0.0 or bearing_noise > 0.0:
        distance = max(0.0, distance + sigma * seen.noise[0, number])
        s, c = sin_cos(bearing_noise * seen.noise[1, number])
        ux, uy = c * ux - s * uy, s * ux + c * uy
    return seen.poses[row, 2] + distance * ux, seen.poses[row, 3] + distance * uy
