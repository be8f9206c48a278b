"""Object-level camera, radar and lidar: field of view, range, occlusion by geometry, noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np

from adeye import signals
from adeye.delivery import insert, no_measurement, sample_at
from adeye.fields import fields_of
from adeye.kernel import sight
from adeye.kernel.elementary import sin_cos, sin_cos_of_any
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal_pairs_of
from adeye.signals import Floats, Ints, Measurement, Scene, parameter_record, spec_columns
from adeye.simulate.sensors.sampling import Found, Sampling, Truth, rear_axles, velocity_at
from adeye.simulate.world.weather import (
    camera_range,
    glare_contrast,
    lidar_range,
    light_share,
    sun_cosine,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.ports import SensorContext
    from adeye.spec.sensors import Camera, Lidar, Radar

# --- How far an object-level camera, radar or lidar reaches in the weather and light of a run -----

CAMERA, RADAR, LIDAR = range(3)
"""Kinds of object-level sensor."""


@compiled
def fill_reach(kind: int, parameters: Any, reflectivity: Floats, reach: Floats) -> None:
    """Compute the range that weather and light leave for each object; glare is left out.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        parameters: (B,) records of the sensor's parameters and the conditions.
        reflectivity: (B, M) of each object.
        reach: (B, M) out [m].
    """
    for run in range(reach.shape[0]):
        for thing in range(reach.shape[1]):
            reach[run, thing] = _reach(kind, parameters[run], reflectivity[run, thing])


@compiled
def _reach(kind: int, parameters: Any, reflectivity: float) -> float:
    if kind == LIDAR:
        return lidar_range(
            parameters["range"],
            reflectivity,
            parameters["reference_reflectivity"],
            parameters["rain"],
            parameters["visibility"],
        )
    if kind == CAMERA:
        return _seen_from(parameters, 1.0)
    return float(parameters["range"])


@inlined
def _seen_from(parameters: Any, contrast: float) -> float:
    """Range of a camera at a share of the contrast [m]."""
    share = light_share(parameters["night_range"], parameters["illuminance"])
    return camera_range(
        parameters["range"], parameters["rain"], parameters["visibility"], share * contrast
    )


@inlined
def reach_in_glare(parameters: Any, reach: float, look: Floats) -> float:
    """Range of a camera that is left for an object when the sun stands above the horizon [m].

    Args:
        parameters: Record of the sensor's parameters and the conditions.
        reach: Without glare [m].
        look: (OUTLINE_WIDTH,) where the object is from the camera.
    """
    distance = look[sight.DISTANCE]
    if distance <= 0.0:
        return reach
    contrast = glare_contrast(
        sun_cosine(
            look[sight.DX] / distance,
            look[sight.DY] / distance,
            parameters["sun_elevation"],
            parameters["sun_azimuth"],
        ),
        parameters["illuminance"],
    )
    return _seen_from(parameters, contrast) if contrast < 1.0 else reach


# --- From what object-level sensors see to what they report: noise, drawn for many runs at a time -

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
    truth: Truth,
    run: int,
    seen: Seen,
    row: int,
    first: int,
    order: Ints,
    found: Found,
) -> None:
    """Write what one run of a block has measured, by increasing distance.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        truth: What is true.
        run: Which one.
        seen: Of the block, measured.
        row: Of the run in its block.
        first: Its first item.
        order: (M,) scratch.
        found: Out.
    """
    ego, sizes = truth.ego[run], truth.sizes[run]
    count = seen.ends[row] - first
    c, s, x, y = seen.poses[row]
    items, things = seen.items.T[first:], seen.things[first:]
    for item in range(count):
        dx, dy = (
            x + items[item, SEEN_X] - ego[signals.EGO_X],
            y + items[item, SEEN_Y] - ego[signals.EGO_Y],
        )
        items[item, SEEN_X] = c * dx + s * dy
        items[item, SEEN_Y] = -s * dx + c * dy
        insert(order, items, item, item, dx * dx + dy * dy)
    for place in range(count):
        item = order[place]
        thing = things[item]
        found.mask[run, place] = True
        found.source[run, place] = thing
        detection = found.detections[run, place]
        detection[signals.DETECTION_X] = items[item, SEEN_X]
        detection[signals.DETECTION_Y] = items[item, SEEN_Y]
        detection[signals.DETECTION_RANGE_RATE] = items[item, SEEN_RATE]
        detection[signals.DETECTION_HAS_RANGE_RATE] = 1.0 if kind == RADAR else 0.0
        detection[signals.DETECTION_LENGTH] = sizes[thing, 0]
        detection[signals.DETECTION_WIDTH] = sizes[thing, 1]
        detection[signals.DETECTION_CLASS] = truth.classes[thing]


# --- Object-level camera, radar and lidar: field of view, range, occlusion by geometry, noise -----

_KINDS = {"camera": CAMERA, "radar": RADAR, "lidar": LIDAR}
_NOISES = ("bearing_noise", "distance_noise", "range_noise", "range_rate_noise")
_OPTIONAL = {**dict.fromkeys(_NOISES, 0.0), "night_range": 1.0, "reference_reflectivity": 1.0}


class Memory(NamedTuple):
    """What a sensor knows of the objects beforehand, and scratch.

    Attributes:
        reach: (B, M) how near each object must be [m].
        extents: (3, B * M) see ``sight.fill_extents``.
        pieces: (M, 2) scratch.
        looks: (OUTLINE_WIDTH, BLOCK * M) scratch: how the objects of a block look.
        order: (M,) scratch: what a run sees, in order.
    """

    reach: Floats
    extents: Floats
    pieces: Floats
    looks: Floats
    order: Ints


class RangingSensor(Sampling):
    """A camera, radar or lidar that reports boxes."""

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        scene = context.scene
        self._kind = _KINDS[context.specs[0].kind]
        specs = [cast("Camera | Radar | Lidar", spec) for spec in context.specs]
        weather = scene.surroundings
        self._parameters = parameter_record(
            {
                **spec_columns(specs, _numbers),
                "rain": weather.rain,
                "visibility": weather.fog_visibility,
                **fields_of(weather, "illuminance", "sun_elevation", "sun_azimuth"),
                "rear": rear_axles(context),
            }
        )
        self._objects = len(scene.object_ids)
        reach: Floats = np.zeros((scene.runs, self._objects))
        fill_reach(self._kind, self._parameters, scene.object_reflectivity, reach)
        extents: Floats = np.zeros((3, scene.runs * self._objects))
        sight.fill_extents(scene.object_sizes, extents)
        self._memory = Memory(
            reach,
            extents,
            np.zeros((self._objects, 2)),
            np.zeros((sight.OUTLINE_WIDTH, BLOCK * self._objects)),
            np.zeros(self._objects, dtype=np.int64),
        )
        self._seen = memory_for(self._objects)
        super().__init__(context, no_measurement(scene.runs, self._objects, with_estimate=False))

    def _sample(self, scene: Scene) -> Measurement:
        sample = sample_at(scene.time, self._context.scene.runs, self._objects)
        _sample_batch(
            self._kind,
            self._parameters,
            self._truth(scene),
            self._memory,
            self._seen,
            Found.of(sample),
        )
        return sample


def _numbers(spec: Camera | Radar | Lidar) -> dict[str, float]:
    """List what the compiled step reads of a sensor; both edges are 0 from half a turn on."""
    angle = spec.field_of_view
    sine, cosine = sin_cos(0.5 * angle) if angle < math.pi else (0.0, 0.0)
    return {
        **fields_of(spec.mount, "x", "y", "yaw"),
        "field_of_view": angle,
        "range": spec.range,
        "min_visible": spec.min_visible,
        **{name: float(getattr(spec, name, default)) for name, default in _OPTIONAL.items()},
        "edge_sine": sine,
        "edge_cosine": cosine,
    }


@compiled
def _sample_batch(
    kind: int, parameters: Any, truth: Truth, memory: Memory, seen: Seen, found: Found
) -> None:
    """Detect the objects of each run and pack them by increasing distance; none where it has ended.

    What is measured is the centre of a box; its noise is drawn by sensor, sample and object.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        parameters: (B,) records of the sensor's parameters and the weather.
        truth: What is true.
        memory: Of the objects, and scratch.
        seen: Scratch.
        found: Out.
    """
    runs, things = truth.objects.shape[:2]
    for begin in range(0, runs, BLOCK):
        stop = min(begin + BLOCK, runs)
        _place(begin, stop, parameters, truth, seen.poses, memory.looks)
        sight.outlines((stop - begin) * things, begin * things, memory.extents, memory.looks)
        count = 0
        for run in range(begin, stop):
            if truth.running[run]:
                row = run - begin
                looks = memory.looks.T[row * things : (row + 1) * things]
                count = _look(kind, parameters[run], truth, run, memory, looks, seen, row, count)
            seen.ends[run - begin] = count
        measure(kind, seen, count, truth.owner, truth.number)
        first = 0
        for run in range(begin, stop):
            write(kind, truth, run, seen, run - begin, first, memory.order, found)
            first = seen.ends[run - begin]


@inlined
def _place(
    begin: int, stop: int, parameters: Any, truth: Truth, poses: Floats, looks: Floats
) -> None:
    """Find where the sensors of a block of runs are, and where the objects are from there."""
    place = 0
    for run in range(begin, stop):
        item = parameters[run]
        ego = truth.ego[run]
        s, c = sin_cos(ego[signals.EGO_HEADING])
        sensor_x = ego[signals.EGO_X] + c * item["x"] - s * item["y"]
        sensor_y = ego[signals.EGO_Y] + s * item["x"] + c * item["y"]
        pose = poses[run - begin]
        pose[0], pose[1], pose[2], pose[3] = c, s, sensor_x, sensor_y
        for thing in range(truth.objects.shape[1]):
            box = truth.objects[run, thing]
            looks[sight.DX, place], looks[sight.DY, place] = box[0] - sensor_x, box[1] - sensor_y
            looks[sight.HEADING, place] = box[2]
            place += 1


@inlined
def _look(  # noqa: PLR0913, PLR0917 - a kernel
    kind: int,
    parameters: Any,
    truth: Truth,
    run: int,
    memory: Memory,
    looks: Floats,
    seen: Seen,
    row: int,
    count: int,
) -> int:
    """Note what one run of a block sees, without noise, behind the items before.

    Args: as of ``_sample_batch``, the looks and the row in the block those of the run.

    Returns:
        Number of items.
    """
    ego, objects, sizes = truth.ego[run], truth.objects[run], truth.sizes[run]
    c, s = seen.poses[row, 0], seen.poses[row, 1]
    ahead_y, ahead_x = sin_cos(ego[signals.EGO_HEADING] + parameters["yaw"])
    is_glared = kind == CAMERA and parameters["sun_elevation"] >= 0.0
    for thing in range(objects.shape[0]):
        left = memory.reach[run, thing]
        if is_glared:
            left = reach_in_glare(parameters, left, looks[thing])
        if not _is_seen(parameters, left, ahead_x, ahead_y, thing, sizes, looks, memory.pieces):
            continue
        look = looks[thing]
        distance = look[sight.DISTANCE]
        # The line of sight as a unit vector: no angle is needed.
        ux, uy = (
            (look[sight.DX] / distance, look[sight.DY] / distance) if distance > 0.0 else (c, s)
        )
        rate = 0.0
        if kind == RADAR and distance > 0.0:
            rate = objects[thing, signals.OBJECT_SPEED] * (
                look[sight.COSINE] * ux + look[sight.SINE] * uy
            )
            forward, aside = velocity_at(ego, parameters["x"] + parameters["rear"], parameters["y"])
            rate -= forward * (c * ux + s * uy)
            rate -= aside * (c * uy - s * ux)
        note(kind, parameters, seen, count, truth.seeds[run], thing, ux, uy, distance, rate)
        count += 1
    return count


@inlined
def _is_seen(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    reach: float,
    ahead_x: float,
    ahead_y: float,
    thing: int,
    sizes: Floats,
    looks: Floats,
    pieces: Floats,
) -> bool:
    """Tell whether an object is detected.

    Its nearest point must be within reach, and of its angular extent the unoccluded share and the
    share in view must each be at least ``min_visible``.
    """
    look = looks[thing]
    # How far the centre lies outside of the nearer edge of view; a circle around the object that is
    # all outside or all inside spares the angles.
    sine, cosine = parameters["edge_sine"], parameters["edge_cosine"]
    along = ahead_x * look[sight.DX] + ahead_y * look[sight.DY]
    across = ahead_x * look[sight.DY] - ahead_y * look[sight.DX]
    outside = abs(across) * cosine - along * sine
    has_edges = sine > 0.0
    is_outside = has_edges & (outside > look[sight.HALF])
    is_near = look[sight.NEAREST] <= reach
    if is_outside or not is_near:
        return False
    is_amid = has_edges & (outside < -look[sight.HALF])
    if not is_amid and not _is_in_view(parameters, ahead_x, ahead_y, look):
        return False
    seen = sight.visible_share(thing, ahead_x, ahead_y, sizes, looks, pieces)
    return bool(seen >= parameters["min_visible"])


@inlined
def _is_in_view(parameters: Any, ahead_x: float, ahead_y: float, look: Floats) -> bool:
    """Tell whether enough of the angular extent of an object lies in the field of view."""
    half = 0.5 * parameters["field_of_view"]
    if not half < math.pi:
        return True
    right, left = sight.bearings(ahead_x, ahead_y, look)
    extent = left - right
    # The left edge may lie beyond pi, so the field of view is met from both sides.
    inside = max(0.0, min(left, half) - max(right, -half))
    inside += max(0.0, min(left - 2.0 * math.pi, half) - max(right - 2.0 * math.pi, -half))
    return not (extent > 0.0 and inside < parameters["min_visible"] * extent)
