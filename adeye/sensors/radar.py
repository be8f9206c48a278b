"""Physical radar: echoes by the radar equation, detected in cells of range, bearing and rate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from adeye.kernel.elementary import atan2, exp, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import point_velocity
from adeye.kernel.occlusion import visible_share
from adeye.kernel.sight import (
    COSINE,
    DX,
    DY,
    HALF,
    INSIDE,
    OUTLINE_WIDTH,
    SINE,
    find_shape,
    sight,
)
from adeye.sensors.delivery import Delivery, no_measurement, sample_at
from adeye.sensors.gnss import rear_axles
from adeye.sensors.radar_cells import (
    ECHO_BEARING,
    ECHO_RANGE,
    ECHO_RATE,
    ECHO_SIGNAL,
    ECHO_WIDTH,
    ECHO_X,
    ECHO_Y,
    add_ghosts,
    detect,
    folded,
    most_events,
)
from adeye.sensors.radar_equation import (
    LEAST_SIGNAL,
    cross_sections,
    detection_threshold,
    facing,
    rain_echo,
    signal_for,
    signal_to_noise,
)
from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_RANGE_RATE,
    DETECTION_X,
    DETECTION_Y,
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
from adeye.world.weather import NEPER, radar_rain_extinction

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.ports import SensorContext
    from adeye.spec.sensors import PhysicalRadar

NOTHING_KNOWN: Final = -1.0
"""Class of a detection: a radar does not tell what it is."""


class RadarSensor:
    """A radar that reports points with a range rate, and now and then one that is not there.

    Plan view: neither ground nor elevation takes part, and there is one path to each object, so it
    does not see beneath a truck what drives ahead of it.
    """

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        self._context = context
        scene = context.scene
        specs = [cast("PhysicalRadar", spec) for spec in context.specs]
        columns = spec_columns(specs, _numbers)
        rain = scene.surroundings.rain
        volume = columns.pop("cell_volume") * np.array([rain_echo(each) for each in rain])
        self._parameters = parameter_record(
            {
                **columns,
                "extinction": np.array([radar_rain_extinction(each) for each in rain]),
                "rain_in_cell": volume,
                "rear": rear_axles(context),
            }
        )
        self._objects = len(scene.object_ids)
        ghosts = int(columns["most_ghosts"].max())
        self._rows = self._objects + ghosts
        self._cross_sections = cross_sections(scene.object_classes)
        self._pieces: Floats = np.zeros((self._objects, 2))
        self._looks: Floats = np.zeros((self._objects, OUTLINE_WIDTH))
        self._echoes: Floats = np.zeros((self._rows, ECHO_WIDTH))
        self._order: Ints = np.zeros(self._rows, dtype=np.int64)
        self._sample_number = 0
        first = no_measurement(scene.runs, self._rows, with_estimate=False)
        self._delivery = Delivery.of(context, first)

    def sense(self, scene: Scene) -> Measurement:
        """Sample if it is time to, and return the newest delivered sample."""
        if self._delivery.is_due(scene.tick):
            self._delivery.push(scene.tick, self._sample(scene))
        return self._delivery.newest(scene.tick)

    def _sample(self, scene: Scene) -> Measurement:
        context = self._context.scene
        sample = sample_at(scene.time, context.runs, self._rows)
        _sample_batch(
            self._parameters,
            context.stream_seeds,
            np.uint64(self._context.owner),
            self._sample_number,
            scene.ego,
            scene.objects,
            context.object_sizes,
            self._cross_sections,
            scene.running,
            self._pieces,
            self._looks,
            self._echoes,
            self._order,
            sample.mask,
            sample.detections,
            sample.source,
        )
        self._sample_number += 1
        return sample


def _numbers(spec: PhysicalRadar) -> dict[str, float]:
    """List what the compiled step reads of a radar; both edges are 0 from half a turn on."""
    angle = spec.field_of_view
    half = 0.5 * angle
    sine, cosine = sin_cos(half) if angle < math.pi else (0.0, 0.0)
    square = spec.range * spec.range
    signal = signal_for(0.5, spec.false_alarm_rate)
    # Two Poisson distributed numbers add up to one, of which each event is of either kind.
    ghosts = spec.false_alarm_rate * spec.cells + spec.clutter
    return {
        "x": spec.mount.x,
        "y": spec.mount.y,
        "yaw": spec.mount.yaw,
        "half_view": half,
        "edge_sine": sine,
        "edge_cosine": cosine,
        "range": spec.range,
        "strength": signal * square * square / spec.reference_cross_section,
        "threshold": detection_threshold(spec.false_alarm_rate),
        "beam": 2.0 * spec.edge_loss / NEPER / (half * half),
        "range_resolution": spec.range_resolution,
        "bearing_resolution": spec.bearing_resolution,
        "range_rate_resolution": spec.range_rate_resolution,
        "max_range_rate": spec.max_range_rate,
        "cell_volume": spec.range_resolution * spec.bearing_resolution * spec.elevation_beam,
        "ghosts": ghosts,
        "no_ghost": exp(-ghosts),
        "most_ghosts": most_events(ghosts),
        "clutter_share": spec.clutter / ghosts,
    }


@compiled
def _sample_batch(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    seeds: NDArray[np.uint64],
    owner: np.uint64,
    number: int,
    ego: Floats,
    objects: Floats,
    sizes: Floats,
    cross_sections: Floats,
    running: Bools,
    pieces: Floats,
    looks: Floats,
    echoes: Floats,
    order: Ints,
    mask: Bools,
    detections: Floats,
    source: Ints,
) -> None:
    """Sample every run of a batch: empty where it has ended.

    Args:
        parameters: (B,) records of the sensor's parameters and the weather.
        seeds: (B,) stream seeds.
        owner: Owner number of the sensor.
        number: Number of the sample.
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        sizes: (B, M, 3).
        cross_sections: (M, 2) of ends and sides [m²].
        running: (B,) runs that have not ended.
        pieces: (M, 2) scratch.
        looks: (M, OUTLINE_WIDTH) scratch.
        echoes: (K, ECHO_WIDTH) scratch.
        order: (K,) scratch: the detections, nearest first.
        mask: (B, K) out.
        detections: (B, K, 7) out.
        source: (B, K) out.
    """
    for run in range(ego.shape[0]):
        count = 0
        if running[run]:
            count = _sample_run(
                parameters[run],
                seeds[run],
                owner,
                number,
                ego[run],
                objects[run],
                sizes[run],
                cross_sections,
                pieces,
                looks,
                echoes,
                order,
            )
        _write(objects.shape[1], count, echoes, order, mask[run], detections[run], source[run])


@inlined
def _write(  # noqa: PLR0913, PLR0917 - a kernel
    objects: int,
    count: int,
    echoes: Floats,
    order: Ints,
    mask: Bools,
    detections: Floats,
    source: Ints,
) -> None:
    """Write the detections of one run, nearest first; see ``_sample_batch``."""
    for row in range(count):
        thing = order[row]
        mask[row] = True
        source[row] = thing if thing < objects else -1
        detections[row, DETECTION_X] = echoes[thing, ECHO_X]
        detections[row, DETECTION_Y] = echoes[thing, ECHO_Y]
        detections[row, DETECTION_RANGE_RATE] = echoes[thing, ECHO_RATE]
        detections[row, DETECTION_HAS_RANGE_RATE] = 1.0
        detections[row, DETECTION_CLASS] = NOTHING_KNOWN


@inlined
def _sample_run(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    seed: np.uint64,
    owner: np.uint64,
    number: int,
    ego: Floats,
    objects: Floats,
    sizes: Floats,
    cross_sections: Floats,
    pieces: Floats,
    looks: Floats,
    echoes: Floats,
    order: Ints,
) -> int:
    """Detect in one run, see ``_sample_batch``; return the number of detections.

    The sensor moves with the ego: with its rear axle, and around that as the ego turns.
    """
    s, c = sin_cos(ego[EGO_HEADING])
    lever_x = c * parameters["x"] - s * parameters["y"]
    lever_y = s * parameters["x"] + c * parameters["y"]
    forward, aside = point_velocity(
        ego[EGO_SPEED], ego[EGO_YAW_RATE], parameters["x"] + parameters["rear"], parameters["y"]
    )
    velocity_x, velocity_y = forward * c - aside * s, forward * s + aside * c
    ahead_y, ahead_x = sin_cos(ego[EGO_HEADING] + parameters["yaw"])
    count = objects.shape[0]
    for thing in range(count):
        sight(
            ego[EGO_X] + lever_x, ego[EGO_Y] + lever_y, objects[thing], sizes[thing], looks[thing]
        )
    for thing in range(count):
        echoes[thing, ECHO_SIGNAL] = 0.0
        if not _may_echo(parameters, ahead_x, ahead_y, looks[thing]):
            continue
        find_shape(sizes[thing], looks[thing])
        _find_echo(
            parameters,
            (ahead_x, ahead_y),
            (velocity_x, velocity_y),
            objects[thing],
            sizes[thing],
            cross_sections[thing],
            looks[thing],
            echoes[thing],
        )
        # Who is too weak anyway need not be looked for behind others.
        if echoes[thing, ECHO_SIGNAL] > LEAST_SIGNAL:
            share = visible_share(thing, ahead_x, ahead_y, sizes, looks, pieces)
            echoes[thing, ECHO_SIGNAL] *= share
    found = detect(parameters, seed, owner, number, echoes[:count], order)
    forward = ahead_x * velocity_x + ahead_y * velocity_y
    sideways = ahead_x * velocity_y - ahead_y * velocity_x
    return add_ghosts(
        parameters, seed, owner, number, (forward, sideways), count, found, echoes, order
    )


@inlined
def _may_echo(parameters: Any, ahead_x: float, ahead_y: float, look: Floats) -> bool:
    """Tell whether a circle around a box reaches into the field of view; spares what is dearer."""
    sine, cosine = parameters["edge_sine"], parameters["edge_cosine"]
    along = ahead_x * look[DX] + ahead_y * look[DY]
    across = ahead_x * look[DY] - ahead_y * look[DX]
    return not (sine > 0.0 and abs(across) * cosine - along * sine > look[HALF])


@inlined
def _find_echo(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    ahead: tuple[float, float],
    velocity: tuple[float, float],
    target: Floats,
    size: Floats,
    cross_section: Floats,
    look: Floats,
    echo: Floats,
) -> None:
    """Find the mean echo of one box, as if nothing hid it.

    It has two centres of reflection, the middles of the end and of the side that face the sensor;
    each returns its cross section times the squared cosine of the incidence, and the echo lies at
    their mean, weighted with that.

    Args:
        parameters: Record of the sensor.
        ahead: Unit vector of the boresight.
        velocity: Of the sensor [m/s].
        target: (5,) state.
        size: (3,).
        cross_section: (2,) of its ends and its sides [m²].
        look: (OUTLINE_WIDTH,) of the box.
        echo: (ECHO_WIDTH,) out; no signal where there is none, from inside the box for one.
    """
    dx, dy, c, s = look[DX], look[DY], look[COSINE], look[SINE]
    along, across = dx * c + dy * s, dy * c - dx * s
    end = cross_section[0] * facing(along, across, 0.5 * size[0])
    side = cross_section[1] * facing(across, along, 0.5 * size[1])
    if look[INSIDE] > 0.0 or not end + side > 0.0:
        return
    near = math.copysign(0.5 * size[0], along) * end / (end + side)
    beside = math.copysign(0.5 * size[1], across) * side / (end + side)
    x, y = dx - near * c + beside * s, dy - near * s - beside * c
    distance = math.sqrt(x * x + y * y)
    if not distance > 0.0:
        return
    bearing = atan2(ahead[0] * y - ahead[1] * x, ahead[0] * x + ahead[1] * y)
    if not abs(bearing) <= parameters["half_view"]:
        return
    echo[ECHO_SIGNAL] = signal_to_noise(
        parameters["strength"],
        end + side,
        # Nearer than one cell the fourth power means nothing any more.
        max(distance, parameters["range_resolution"]),
        bearing,
        parameters["beam"],
        parameters["extinction"],
        parameters["rain_in_cell"],
    )
    echo[ECHO_RANGE], echo[ECHO_BEARING] = distance, bearing
    rate = (target[OBJECT_SPEED] * c - velocity[0]) * x
    rate += (target[OBJECT_SPEED] * s - velocity[1]) * y
    echo[ECHO_RATE] = folded(rate / distance, parameters["max_range_rate"])
