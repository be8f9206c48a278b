"""Object-level camera, radar and lidar: field of view, range, occlusion by geometry, noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import point_velocity
from adeye.kernel.occlusion import visible_share
from adeye.kernel.sight import (
    COSINE,
    DISTANCE,
    DX,
    DY,
    HALF,
    HEADING,
    NEAREST,
    OUTLINE_WIDTH,
    SINE,
    bearings,
    fill_extents,
    outlines,
)
from adeye.sensors.delivery import Delivery, no_measurement, sample_at
from adeye.sensors.gnss import rear_axles
from adeye.sensors.measuring import (
    BLOCK,
    Seen,
    measure,
    memory_for,
    note,
    write,
)
from adeye.sensors.reach import CAMERA, LIDAR, RADAR, fill_reach, reach_in_glare
from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    EGO_YAW_RATE,
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
                "rear": rear_axles(context),
            }
        )
        self._objects = len(scene.object_ids)
        self._reach: Floats = np.zeros((scene.runs, self._objects))
        fill_reach(self._kind, self._parameters, scene.object_reflectivity, self._reach)
        self._pieces: Floats = np.zeros((self._objects, 2))
        self._extents: Floats = np.zeros((3, scene.runs * self._objects))
        fill_extents(scene.object_sizes, self._extents)
        self._looks: Floats = np.zeros((OUTLINE_WIDTH, BLOCK * self._objects))
        self._seen = memory_for(self._objects)
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
            self._extents,
            self._pieces,
            self._looks,
            self._seen,
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
    extents: Floats,
    pieces: Floats,
    looks: Floats,
    seen: Seen,
    order: Ints,
    mask: Bools,
    detections: Floats,
    source: Ints,
) -> None:
    """Detect the objects of each run and pack them by increasing distance; none where it has ended.

    What is measured is the centre of a box; its noise is drawn by sensor, sample and object.

    Args:
        kind: CAMERA, RADAR or LIDAR.
        parameters: (B,) records of the sensor's parameters and the weather.
        seeds: (B,) stream seeds.
        owner: Owner number of the sensor.
        number: Number of the sample.
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        sizes: (B, M, 3).
        classes: (M,).
        running: (B,).
        reach: (B, M) how near each object must be [m].
        extents: (3, B * M) see ``sight.fill_extents``.
        pieces: (M, 2) scratch.
        looks: (OUTLINE_WIDTH, BLOCK * M) scratch: how the objects of a block look.
        seen: Scratch.
        order: (M,) scratch: what a run sees, in order.
        mask: (B, M) out.
        detections: (B, M, 7) out.
        source: (B, M) out.
    """
    runs, things = objects.shape[:2]
    for begin in range(0, runs, BLOCK):
        stop = min(begin + BLOCK, runs)
        _place(begin, stop, parameters, ego, objects, seen.poses, looks)
        outlines((stop - begin) * things, begin * things, extents, looks)
        count = 0
        for run in range(begin, stop):
            if running[run]:
                row, views = (
                    run - begin,
                    looks.T[(run - begin) * things : (run - begin + 1) * things],
                )
                count = _look(
                    kind, parameters[run], seeds[run], ego[run], objects[run], sizes[run],
                    reach[run], pieces, views, seen, row, count,
                )  # fmt: skip
            seen.ends[run - begin] = count
        measure(kind, seen, count, owner, number)
        first = 0
        for run in range(begin, stop):
            write(
                kind, ego[run], sizes[run], classes, seen, run - begin, first,
                order, mask[run], detections[run], source[run],
            )  # fmt: skip
            first = seen.ends[run - begin]


@inlined
def _place(  # noqa: PLR0913, PLR0917 - a kernel
    begin: int,
    stop: int,
    parameters: Any,
    ego: Floats,
    objects: Floats,
    poses: Floats,
    looks: Floats,
) -> None:
    """Find where the sensors of a block of runs are, and where the objects are from there."""
    place = 0
    for run in range(begin, stop):
        item = parameters[run]
        s, c = sin_cos(ego[run, EGO_HEADING])
        sensor_x = ego[run, EGO_X] + c * item["x"] - s * item["y"]
        sensor_y = ego[run, EGO_Y] + s * item["x"] + c * item["y"]
        pose = poses[run - begin]
        pose[0], pose[1], pose[2], pose[3] = c, s, sensor_x, sensor_y
        for thing in range(objects.shape[1]):
            box = objects[run, thing]
            looks[DX, place], looks[DY, place] = box[0] - sensor_x, box[1] - sensor_y
            looks[HEADING, place] = box[2]
            place += 1


@inlined
def _look(  # noqa: PLR0913, PLR0917 - a kernel
    kind: int,
    parameters: Any,
    seed: np.uint64,
    ego: Floats,
    objects: Floats,
    sizes: Floats,
    reach: Floats,
    pieces: Floats,
    looks: Floats,
    seen: Seen,
    row: int,
    count: int,
) -> int:
    """Note what one run of a block sees, without noise, behind the items before.

    Args: as of ``_sample_batch``, of one run.

    Returns:
        Number of items.
    """
    c, s = seen.poses[row, 0], seen.poses[row, 1]
    ahead_y, ahead_x = sin_cos(ego[EGO_HEADING] + parameters["yaw"])
    is_glared = kind == CAMERA and parameters["sun_elevation"] >= 0.0
    for thing in range(objects.shape[0]):
        left = reach[thing]
        if is_glared:
            left = reach_in_glare(parameters, left, looks[thing])
        if not _is_seen(parameters, left, ahead_x, ahead_y, thing, sizes, looks, pieces):
            continue
        look = looks[thing]
        distance = look[DISTANCE]
        # The line of sight as a unit vector: no angle is needed.
        ux, uy = (look[DX] / distance, look[DY] / distance) if distance > 0.0 else (c, s)
        rate = 0.0
        if kind == RADAR and distance > 0.0:
            rate = objects[thing, OBJECT_SPEED] * (look[COSINE] * ux + look[SINE] * uy)
            forward, aside = point_velocity(
                ego[EGO_SPEED],
                ego[EGO_YAW_RATE],
                parameters["x"] + parameters["rear"],
                parameters["y"],
            )
            rate -= forward * (c * ux + s * uy)
            rate -= aside * (c * uy - s * ux)
        note(kind, parameters, seen, count, seed, thing, ux, uy, distance, rate)
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
    along = ahead_x * look[DX] + ahead_y * look[DY]
    across = ahead_x * look[DY] - ahead_y * look[DX]
    outside = abs(across) * cosine - along * sine
    has_edges = sine > 0.0
    is_outside = has_edges & (parameters["min_visible"] > 0.0) & (outside > look[HALF])
    is_near = look[NEAREST] <= reach
    if is_outside or not is_near:
        return False
    is_amid = has_edges & (outside < -look[HALF])
    if not is_amid and not _is_in_view(parameters, ahead_x, ahead_y, look):
        return False
    seen = visible_share(thing, ahead_x, ahead_y, sizes, looks, pieces)
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
