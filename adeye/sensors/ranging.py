"""Object-level camera, radar and lidar: field of view, range, occlusion by geometry, noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal, normal_pair
from adeye.kernel.sight import (
    COSINE,
    DISTANCE,
    DX,
    DY,
    HALF,
    OUTLINE_WIDTH,
    SINE,
    bearings,
    find_shape,
    nearest_point,
    sight,
    visible_share,
)
from adeye.sensors.delivery import Delivery, clear, insert, no_measurement, sample_at
from adeye.sensors.reach import CAMERA, LIDAR, RADAR, fill_reach, reach_in_glare
from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    OBJECT_SPEED,
    Bools,
    Floats,
    Ints,
    Measurement,
    Scene,
    parameter_record,
    spec_columns,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.ports import SensorContext
    from adeye.spec.sensors import Camera, Lidar, Radar

_KINDS = {"camera": CAMERA, "radar": RADAR, "lidar": LIDAR}
_NOISES = ("bearing_noise", "distance_noise", "range_noise", "range_rate_noise")
_OPTIONAL = {**dict.fromkeys(_NOISES, 0.0), "night_range": 1.0, "reference_reflectivity": 1.0}
DRAWS = 2
"""Pairs of random numbers per object and sample: distance and bearing, range rate."""


class RangingSensor:
    """A camera, radar or lidar that reports boxes."""

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        self._context = context
        scene = context.scene
        self._kind = _KINDS[context.specs[0].kind]
        specs = [cast("Camera | Radar | Lidar", spec) for spec in context.specs]
        weather = scene.surroundings
        self._parameters = parameter_record(
            {
                **spec_columns(specs, _numbers),
                "rain": weather.rain,
                "visibility": weather.fog_visibility,
                "illuminance": weather.illuminance,
                "sun_elevation": weather.sun_elevation,
                "sun_azimuth": weather.sun_azimuth,
            }
        )
        self._objects = len(scene.object_ids)
        self._reach: Floats = np.zeros((scene.runs, self._objects))
        fill_reach(self._kind, self._parameters, scene.object_reflectivity, self._reach)
        self._pieces: Floats = np.zeros((self._objects, 2))
        self._looks: Floats = np.zeros((self._objects, OUTLINE_WIDTH))
        self._found: Floats = np.zeros((self._objects, 3))
        self._order: Ints = np.zeros(self._objects, dtype=np.int64)
        self._sample_number = 0
        first = no_measurement(scene.runs, self._objects, with_estimate=False)
        self._delivery = Delivery.of(context, first)

    def sense(self, scene: Scene) -> Measurement:
        """Sample if it is time to, and return the newest delivered sample."""
        if self._delivery.is_due(scene.tick):
            self._delivery.push(scene.tick, self._sample(scene))
        return self._delivery.newest(scene.tick)

    def _sample(self, scene: Scene) -> Measurement:
        context = self._context.scene
        sample = sample_at(scene.time, context.runs, self._objects)
        _sample_batch(
            self._kind,
            self._parameters,
            context.stream_seeds,
            np.uint64(self._context.owner),
            self._sample_number,
            scene.ego,
            scene.objects,
            context.object_sizes,
            context.object_classes,
            scene.running,
            self._reach,
            self._pieces,
            self._looks,
            self._found,
            self._order,
            sample.mask,
            sample.detections,
            sample.source,
        )
        self._sample_number += 1
        return sample


def _numbers(spec: Camera | Radar | Lidar) -> dict[str, float]:
    """List what the compiled step reads of a sensor; both edges are 0 from half a turn on."""
    angle = spec.field_of_view
    sine, cosine = sin_cos(0.5 * angle) if angle < math.pi else (0.0, 0.0)
    return {
        "x": spec.mount.x,
        "y": spec.mount.y,
        "yaw": spec.mount.yaw,
        "field_of_view": angle,
        "range": spec.range,
        "min_visible": spec.min_visible,
        **{name: float(getattr(spec, name, default)) for name, default in _OPTIONAL.items()},
        "edge_sine": sine,
        "edge_cosine": cosine,
    }


@compiled
def _sample_batch(  # noqa: PLR0913, PLR0917 - a kernel
    kind: int,
    parameters: Any,
    seeds: NDArray[np.uint64],
    owner: np.uint64,
    number: int,
    ego: Floats,
    objects: Floats,
    sizes: Floats,
    classes: Ints,
    running: Bools,
    reach: Floats,
    pieces: Floats,
    looks: Floats,
    found: Floats,
    order: Ints,
    mask: Bools,
    detections: Floats,
    source: Ints,
) -> None:
    """Sample every run of a batch: empty where it has ended, else a call of ``_sample_run``."""
    for run in range(ego.shape[0]):
        if not running[run]:
            clear(mask[run], detections[run], source[run], 0)
            continue
        _sample_run(
            kind,
            parameters[run],
            seeds[run],
            owner,
            number,
            ego[run],
            objects[run],
            sizes[run],
            classes,
            reach[run],
            pieces,
            looks,
            found,
            order,
            mask[run],
            detections[run],
            source[run],
        )


@inlined
def _sample_run(  # noqa: PLR0913, PLR0917 - a kernel
    kind: int,
    parameters: Any,
    seed: np.uint64,
    owner: np.uint64,
    number: int,
    ego: Floats,
    objects: Floats,
    sizes: Floats,
    classes: Ints,
    reach: Floats,
    pieces: Floats,
    looks: Floats,
    found: Floats,
    order: Ints,
    mask: Bools,
    detections: Floats,
    source: Ints,
) -> None:
    """Detect the objects of one run and pack them by increasing distance.

    What is measured is the centre of a box; its noise is drawn by sensor, sample and object.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        parameters: Record of the sensor's parameters and the weather.
        seed: Stream seed of the run.
        owner: Owner number of the sensor.
        number: Number of the sample.
        ego: (7,) state.
        objects: (M, 5) states.
        sizes: (M, 3).
        classes: (M,).
        reach: (M,) how near each object must be [m].
        pieces: (M, 2) scratch.
        looks: (M, OUTLINE_WIDTH) scratch.
        found: (M, 3) scratch: place in the vehicle frame and range rate of each.
        order: (M,) scratch: who is detected, in order.
        mask: (M,) out.
        detections: (M, 7) out.
        source: (M,) out.
    """
    s, c = sin_cos(ego[EGO_HEADING])
    sensor_x = ego[EGO_X] + c * parameters["x"] - s * parameters["y"]
    sensor_y = ego[EGO_Y] + s * parameters["x"] + c * parameters["y"]
    ahead_y, ahead_x = sin_cos(ego[EGO_HEADING] + parameters["yaw"])
    for thing in range(objects.shape[0]):
        sight(sensor_x, sensor_y, objects[thing], sizes[thing], looks[thing])
    count = 0
    is_glared = kind == CAMERA and parameters["sun_elevation"] >= 0.0
    for thing in range(objects.shape[0]):
        left = reach[thing]
        if is_glared:
            left = reach_in_glare(parameters, left, looks[thing])
        if not _is_seen(parameters, left, ahead_x, ahead_y, thing, objects, sizes, looks, pieces):
            continue
        x, y, rate = _measure(
            kind,
            parameters,
            seed,
            owner,
            number,
            thing,
            ego[EGO_SPEED],
            c,
            s,
            objects[thing],
            looks[thing],
            sensor_x,
            sensor_y,
        )
        dx, dy = x - ego[EGO_X], y - ego[EGO_Y]
        found[thing, 0] = c * dx + s * dy
        found[thing, 1] = -s * dx + c * dy
        found[thing, 2] = rate
        insert(order, found, count, thing, dx * dx + dy * dy)
        count += 1
    for row in range(count):
        thing = order[row]
        mask[row] = True
        source[row] = thing
        detections[row, DETECTION_X] = found[thing, 0]
        detections[row, DETECTION_Y] = found[thing, 1]
        detections[row, DETECTION_RANGE_RATE] = found[thing, 2]
        detections[row, DETECTION_HAS_RANGE_RATE] = 1.0 if kind == RADAR else 0.0
        detections[row, DETECTION_LENGTH] = sizes[thing, 0]
        detections[row, DETECTION_WIDTH] = sizes[thing, 1]
        detections[row, DETECTION_CLASS] = classes[thing]
    clear(mask, detections, source, count)


@inlined
def _is_seen(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    reach: float,
    ahead_x: float,
    ahead_y: float,
    thing: int,
    objects: Floats,
    sizes: Floats,
    looks: Floats,
    pieces: Floats,
) -> bool:
    """Tell whether an object is detected.

    Its nearest point must be within reach, and of its angular extent the unoccluded share and the
    share in view must each be at least ``min_visible``.
    """
    look = looks[thing]
    if look[DISTANCE] > reach + look[HALF]:
        return False
    # How far the centre lies outside of the nearer edge of view; a circle around the object that is
    # all outside or all inside spares the angles.
    sine, cosine = parameters["edge_sine"], parameters["edge_cosine"]
    along = ahead_x * look[DX] + ahead_y * look[DY]
    across = ahead_x * look[DY] - ahead_y * look[DX]
    outside = abs(across) * cosine - along * sine
    has_edges = sine > 0.0
    if has_edges and parameters["min_visible"] > 0.0 and outside > look[HALF]:
        return False
    find_shape(objects[thing], sizes[thing], look)
    if not nearest_point(sizes[thing], look) <= reach:
        return False
    is_amid = has_edges and outside < -look[HALF]
    if not is_amid and not _is_in_view(parameters, ahead_x, ahead_y, look):
        return False
    seen = visible_share(thing, ahead_x, ahead_y, objects, sizes, looks, pieces)
    return bool(seen >= parameters["min_visible"])


@inlined
def _is_in_view(parameters: Any, ahead_x: float, ahead_y: float, look: Floats) -> bool:
    """Tell whether enough of the angular extent of an object lies in the field of view."""
    half = 0.5 * parameters["field_of_view"]
    if not half < math.pi:
        return True
    right, left = bearings(ahead_x, ahead_y, look)
    extent = left - right
    # The left edge may lie beyond pi, so the field of view is met from both sides.
    inside = max(0.0, min(left, half) - max(right, -half))
    inside += max(0.0, min(left - 2.0 * math.pi, half) - max(right - 2.0 * math.pi, -half))
    return not (extent > 0.0 and inside < parameters["min_visible"] * extent)


@inlined
def _measure(  # noqa: PLR0913, PLR0917 - a kernel
    kind: int,
    parameters: Any,
    seed: np.uint64,
    owner: np.uint64,
    number: int,
    thing: int,
    ego_speed: float,
    cosine: float,
    sine: float,
    target: Floats,
    look: Floats,
    sensor_x: float,
    sensor_y: float,
) -> tuple[float, float, float]:
    """Measured place of a box centre in the map [m] and, for a radar, its range rate [m/s]."""
    distance = look[DISTANCE]
    # The line of sight as a unit vector: no angle is needed.
    ux, uy = (look[DX] / distance, look[DY] / distance) if distance > 0.0 else (cosine, sine)
    if kind == CAMERA:
        # Distance from the height in the image: its error grows with the distance squared.
        sigma = parameters["distance_noise"] * distance * distance / parameters["range"]
    else:
        sigma = parameters["range_noise"]
    first = DRAWS * thing
    rate = 0.0
    if kind == RADAR and distance > 0.0:
        rate = target[OBJECT_SPEED] * (look[COSINE] * ux + look[SINE] * uy)
        rate -= ego_speed * (cosine * ux + sine * uy)
        if parameters["range_rate_noise"] > 0.0:
            rate += parameters["range_rate_noise"] * normal(seed, owner, number, first + 1)
    bearing_noise = parameters["bearing_noise"]
    if sigma > 0.0 or bearing_noise > 0.0:
        along, aside = normal_pair(seed, owner, number, first)
        distance = max(0.0, distance + sigma * along)
        s, c = sin_cos(bearing_noise * aside)
        ux, uy = c * ux - s * uy, s * ux + c * uy
    return sensor_x + distance * ux, sensor_y + distance * uy, rate
