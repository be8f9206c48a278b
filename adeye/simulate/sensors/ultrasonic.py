"""Ultrasonic sensor: the nearest echo in its cone, beyond a blind zone."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from adeye import signals
from adeye.delivery import no_measurement, sample_at
from adeye.fields import fields_of
from adeye.kernel.boxes import Vector, box_of
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal
from adeye.kernel.sight import ray_box_distance
from adeye.signals import Bools, Floats, Measurement, Scene, parameter_record, spec_columns
from adeye.simulate.sensors.sampling import Found, Sampling, Truth
from adeye.simulate.world.clock import period_ticks
from adeye.spec.sensors import Ultrasonic

if TYPE_CHECKING:
    from adeye.ports import SensorContext

NOTHING_KNOWN: Final = -1.0
"""Class of a detection: an echo does not tell what it came from."""

_TOUCH: Final = 1e-9
"""Boxes that touch do not hide each other's surface [m]."""


class UltrasonicSensor(Sampling):
    """A sensor that knows how far the nearest thing in its cone is, and nothing else.

    The detection lies on the axis of the cone, wherever in the cone the echo came from. Surfaces
    are flat to sound: a face returns an echo from where it is met at right angles only, a corner
    from wherever it can be seen, so a long wall at an angle may stay silent. Every echo from within
    the range is heard, however small the object; plan view, so the road returns none.

    Source:
        Kuc & Siegel (1987), "Physically based simulation model for acoustic sensor robot
        navigation", IEEE Trans. PAMI 9(6), 766-778.
    """

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run, and those of the sensors that it may hear."""
        scene = context.scene
        specs = [cast("Ultrasonic", spec) for spec in context.specs]
        self._parameters = parameter_record(spec_columns(specs, _numbers))
        others = [
            [cast("Ultrasonic", spec) for spec in context.others[name]]
            for name in sorted(context.others)
            if isinstance(context.others[name][0], Ultrasonic)
        ]
        self._every = [period_ticks(other[0].rate, scene.step, "sensors.rate") for other in others]
        listed = [parameter_record(spec_columns(other, _numbers)) for other in others]
        # Rows of other sensors, so that one type serves for none and for many.
        self._others = np.stack([self._parameters, *listed])
        self._fires: Bools = np.zeros(len(listed) + 1, dtype=np.bool_)
        super().__init__(context, no_measurement(scene.runs, 1, with_estimate=False))

    def _sample(self, scene: Scene) -> Measurement:
        sample = sample_at(scene.time, self._context.scene.runs, 1)
        self._fires[1:] = [scene.tick % every == 0 for every in self._every]
        truth, found = self._truth(scene), Found.of(sample)
        _sample_batch(self._parameters, self._others, self._fires, truth, found)
        return sample


def _numbers(spec: Ultrasonic) -> dict[str, float]:
    """List what the compiled step reads of a sensor."""
    sine, cosine = sin_cos(0.5 * spec.field_of_view)
    return {
        **fields_of(spec.mount, "x", "y", "yaw"),
        "edge_sine": sine,
        "edge_cosine": cosine,
        **fields_of(spec, "range", "blind_zone", "range_noise", "cross_talk"),
    }


@compiled
def _sample_batch(parameters: Any, others: Any, fires: Bools, truth: Truth, found: Found) -> None:
    """Sample every run of a batch: empty where it has ended.

    Args:
        parameters: (B,) records of the sensor.
        others: (1 + S, B) records of the sensors that it may hear; the first row is itself.
        fires: (1 + S,) which of them fire now.
        truth: What is true.
        found: Out.
    """
    for run in range(truth.running.shape[0]):
        if not truth.running[run]:
            continue
        own = parameters[run]
        thing, way = _nearest_echo(
            own, others, fires, run, truth.ego[run], truth.objects[run], truth.sizes[run]
        )
        if thing < 0:
            continue
        if own["range_noise"] > 0.0:
            # Of what nearly touches it may be below zero: cut, its mean would be wrong.
            way += own["range_noise"] * normal(truth.seeds[run], truth.owner, truth.number, 0)
        s, c = sin_cos(own["yaw"])
        found.mask[run, 0], found.source[run, 0] = True, thing
        detection = found.detections[run, 0]
        detection[signals.DETECTION_X] = own["x"] + way * c
        detection[signals.DETECTION_Y] = own["y"] + way * s
        detection[signals.DETECTION_CLASS] = NOTHING_KNOWN


@inlined
def _pose(parameters: Any, ego: Floats) -> tuple[float, float, float, float]:
    """Return place [m] and direction (a unit vector) of a sensor in the map."""
    s, c = sin_cos(ego[signals.EGO_HEADING])
    x = ego[signals.EGO_X] + c * parameters["x"] - s * parameters["y"]
    y = ego[signals.EGO_Y] + s * parameters["x"] + c * parameters["y"]
    ahead_y, ahead_x = sin_cos(ego[signals.EGO_HEADING] + parameters["yaw"])
    return x, y, ahead_x, ahead_y


@inlined
def _nearest_echo(  # noqa: PLR0913, PLR0917 - a kernel
    own: Any,
    others: Any,
    fires: Bools,
    run: int,
    ego: Floats,
    objects: Floats,
    sizes: Floats,
) -> tuple[int, float]:
    """Return the object of the first echo after the blind time, -1 for none, and how far it seems.

    Args:
        own: Record of the sensor.
        others: (1 + S, B) records of the sensors that it may hear.
        fires: (1 + S,) which of them fire now.
        run: Column of the others.
        ego: (7,).
        objects: (M, 5).
        sizes: (M, 3).
    """
    pose = _pose(own, ego)
    x, y, ahead_x, ahead_y = pose
    hears_others = own["cross_talk"] > 0.0
    # Of a way that another sensor shares, the part of this one may be longer than the range.
    reach = 2.0 * own["range"] if hears_others else own["range"]
    found, least = -1, own["range"]
    for thing in range(objects.shape[0]):
        dx, dy = objects[thing, 0] - x, objects[thing, 1] - y
        half = 0.5 * (sizes[thing, 0] + sizes[thing, 1])
        # A circle around the box that is out of reach or of the cone spares what is dearer.
        along, across = ahead_x * dx + ahead_y * dy, abs(ahead_x * dy - ahead_y * dx)
        if not dx * dx + dy * dy <= (reach + half) * (reach + half) or (
            across * own["edge_cosine"] - along * own["edge_sine"] > half
        ):
            continue
        way, from_u, from_v = _echo(own, pose, thing, objects, sizes)
        if own["blind_zone"] <= way <= least:
            # The first of two at one distance, whatever their order.
            found = thing if way < least or found < 0 else found
            least = way
        if not hears_others or way == math.inf:
            continue
        for other in range(1, others.shape[0]):
            if not fires[other]:
                continue
            there = others[other, run]
            shared, to_u, to_v = _echo(there, _pose(there, ego), thing, objects, sizes)
            heard = _shared_way(way, from_u, from_v, shared, to_u, to_v)
            if own["blind_zone"] <= heard <= least:
                found = thing if heard < least or found < 0 else found
                least = heard
    return found, least


@inlined
def _shared_way(
    way: float, from_u: float, from_v: float, shared: float, to_u: float, to_v: float
) -> float:
    """Return how far an object seems whose echo was sent by another sensor [m].

    Half of the whole way: from the sender to the surface and on to this sensor. On a flat face that
    is the straight way to the mirror image, from a corner the sum of both.

    Args:
        way: From this sensor to where it meets the surface at right angles, or to the corner [m].
        from_u: That point, in the frame of the object [m].
        from_v: [m].
        shared: The same from the sender [m].
        to_u: Its point [m].
        to_v: [m].
    """
    du, dv = to_u - from_u, to_v - from_v
    both = way + shared
    return 0.5 * math.sqrt(both * both + du * du + dv * dv)


@inlined
def _echo(
    sensor: Any,
    pose: tuple[float, float, float, float],
    thing: int,
    objects: Floats,
    sizes: Floats,
) -> tuple[float, float, float]:
    """Return how far away an object echoes, infinity if it does not, and from where.

    Args:
        sensor: Its record.
        pose: Its place and direction in the map.
        thing: Row of the object.
        objects: (M, 5).
        sizes: (M, 3).

    Returns:
        Distance, and the point in the frame of the object along and across its length [m].
    """
    x, y, ahead_x, ahead_y = pose
    box, size = objects[thing], sizes[thing]
    s, c = sin_cos(box[2])
    dx, dy = x - box[0], y - box[1]
    u, v = dx * c + dy * s, dy * c - dx * s
    forward, sideways = ahead_x * c + ahead_y * s, ahead_y * c - ahead_x * s
    half_length, half_width = 0.5 * size[0], 0.5 * size[1]
    near_u = min(max(u, -half_length), half_length)
    near_v = min(max(v, -half_width), half_width)
    least = math.inf
    if _is_in_cone(sensor, forward, sideways, near_u - u, near_v - v):
        least = math.sqrt((near_u - u) * (near_u - u) + (near_v - v) * (near_v - v))
    else:
        for corner in range(4):
            at_u = half_length if corner < 2 else -half_length
            at_v = half_width if corner % 2 == 0 else -half_width
            # Seen if one of its two faces looks at the sensor.
            is_seen = (u - at_u) * at_u > 0.0 or (v - at_v) * at_v > 0.0
            if is_seen and _is_in_cone(sensor, forward, sideways, at_u - u, at_v - v):
                way = math.sqrt((at_u - u) * (at_u - u) + (at_v - v) * (at_v - v))
                if way < least:
                    least, near_u, near_v = way, at_u, at_v
    if 0.0 < least < math.inf:
        to_x = ((near_u - u) * c - (near_v - v) * s) / least
        to_y = ((near_u - u) * s + (near_v - v) * c) / least
        if _is_hidden(thing, (x, y), (to_x, to_y), least, objects, sizes):
            least = math.inf
    return least, near_u, near_v


@inlined
def _is_in_cone(sensor: Any, forward: float, sideways: float, to_u: float, to_v: float) -> bool:
    """Tell whether a way leads into the cone about a direction; both in the frame of a box."""
    along = forward * to_u + sideways * to_v
    across = forward * to_v - sideways * to_u
    return bool(abs(across) * sensor["edge_cosine"] <= along * sensor["edge_sine"])


@inlined
def _is_hidden(
    thing: int, place: Vector, to: Vector, way: float, objects: Floats, sizes: Floats
) -> bool:
    """Tell whether another box stands in a way, or is no number."""
    for other in range(objects.shape[0]):
        if other == thing:
            continue
        box, size = objects[other], sizes[other]
        dx, dy = box[0] - place[0], box[1] - place[1]
        half = 0.5 * (size[0] + size[1])
        if dx * dx + dy * dy > (way + half) * (way + half):
            continue
        free = ray_box_distance(place, to, box_of(box, size))
        if not free >= way - _TOUCH:
            return True
    return False
