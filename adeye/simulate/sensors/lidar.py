"""Physical lidar: beams cast at everything around, and the returns that are strong enough.

A beam that comes back is listed, so that noise is drawn for many at a time and the next sample
clears what this one has written and nothing else.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self, cast

import numpy as np

from adeye import signals
from adeye.delivery import no_measurement
from adeye.fields import fields_of
from adeye.kernel import scan
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal_pairs_at, uniform
from adeye.kernel.sight import DISTANCE, HALF, OUTLINE_WIDTH, bearings, find_shape, sight
from adeye.signals import Floats, Ints, Measurement, Scene, parameter_record, spec_columns
from adeye.simulate.sensors.sampling import Sampling, Truth
from adeye.simulate.world.weather import ROAD_REFLECTIVITY, lidar_rain_noise, lidar_range
from adeye.spec.sensors import PhysicalLidar

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.ports import SensorContext
    from adeye.spec.architecture import Architecture

# --- The compiled step of a physical lidar: beams cast at one run after the other, and their
# noise.

DRAWS: Final = 2
"""Random numbers per beam and sample: a pair for range and bearing, one for its loss."""

TURNS: Final = 3
"""Intervals of beams that may meet a box: a turn to the right, as it is, a turn to the left."""

GROUND: Final = -1
"""What a beam has hit that has met no object but the ground."""


class Frame(NamedTuple):
    """Memory of one sample, and which of its rows are not empty.

    Attributes:
        points: (B, P, 3).
        hits: (B, P).
        returns: (B, P) beams whose rows are not empty, in the first places.
        counts: (B,) how many they are.
    """

    points: Floats
    hits: Ints
    returns: Ints
    counts: Ints

    @classmethod
    def of(cls, runs: int, beams: int) -> Self:
        """Make an empty one."""
        return cls(
            points=np.zeros((runs, beams, len(signals.POINT_COLUMNS))),
            hits=np.full((runs, beams), GROUND, dtype=np.int64),
            returns=np.empty((runs, beams), dtype=np.int64),
            counts=np.zeros(runs, dtype=np.int64),
        )


class Memory(NamedTuple):
    """What a lidar knows of its beams and the objects beforehand, and scratch for a run.

    Attributes:
        tables: (G, BEAM_WIDTH, P) beams, see ``fill_beams``.
        table_of: (B,) which of them a run has.
        reach: (B, M + 1) how near each object must be, and the ground [m].
        looks: (M, OUTLINE_WIDTH) scratch.
        spans: (M, 2 * TURNS) scratch.
        nearest: (P,) scratch, infinite before and after.
        who: (P,) scratch.
        order: (2, P) scratch.
        ways: (3, P) scratch.
    """

    tables: Floats
    table_of: Ints
    reach: Floats
    looks: Floats
    spans: Ints
    nearest: Floats
    who: Ints
    order: Ints
    ways: Floats


@compiled
def sample_batch(parameters: Any, truth: Truth, beams: int, memory: Memory, frame: Frame) -> None:
    """Sample every run of a batch; one that has ended has no returns.

    Args:
        parameters: (B,) records of the sensor's parameters and the weather.
        truth: What is true.
        beams: In a layer.
        memory: Scratch.
        frame: In: as an earlier sample left it; out.
    """
    for run in range(truth.running.shape[0]):
        for place in range(frame.counts[run]):
            beam = frame.returns[run, place]
            frame.points[run, beam, signals.POINT_RANGE] = 0.0
            frame.points[run, beam, signals.POINT_BEARING] = 0.0
            frame.points[run, beam, signals.POINT_ELEVATION] = 0.0
            frame.hits[run, beam] = GROUND
        frame.counts[run] = 0
        if not truth.running[run]:
            continue
        count = _scan(parameters[run], truth, run, beams, memory)
        frame.counts[run] = _measure(parameters[run], truth, run, count, memory, frame)


@inlined
def _scan(parameters: Any, truth: Truth, run: int, beams: int, memory: Memory) -> int:
    """Cast the beams of one run; list those that come back in ``order``, return their number."""
    ego, objects, sizes = truth.ego[run], truth.objects[run], truth.sizes[run]
    table, reach = memory.tables[memory.table_of[run]], memory.reach[run]
    looks, spans, nearest, who = memory.looks, memory.spans, memory.nearest, memory.who
    order, ways = memory.order[0], memory.ways[0]
    s, c = sin_cos(ego[signals.EGO_HEADING])
    sensor_x = ego[signals.EGO_X] + c * parameters["x"] - s * parameters["y"]
    sensor_y = ego[signals.EGO_Y] + s * parameters["x"] + c * parameters["y"]
    ahead_y, ahead_x = sin_cos(ego[signals.EGO_HEADING] + parameters["yaw"])
    has_ground = parameters["has_ground"] > 0.0
    if has_ground:
        _scan_ground(parameters["z"], table, reach, nearest, who)
    farthest = 0.0
    for thing in range(objects.shape[0]):
        farthest = max(farthest, reach[thing])
    for thing in range(objects.shape[0]):
        look, span, size = looks[thing], spans[thing], sizes[thing]
        sight(sensor_x, sensor_y, objects[thing], size, look)
        _find_spans(parameters, ahead_x, ahead_y, size, farthest, beams, look, span)
        _scan_spans(look, size, s, c, parameters, table, beams, thing, span, nearest, who)
    if has_ground:
        return _list_hits(0, table.shape[1] - 1, table, reach, nearest, who, order, ways, 0)
    count = 0
    for thing in range(objects.shape[0]):
        for part in range(0, 2 * TURNS, 2):
            first, last = spans[thing, part], spans[thing, part + 1]
            if first <= last:
                for layer in range(0, table.shape[1], beams):
                    count = _list_hits(
                        layer + first, layer + last, table, reach, nearest, who, order, ways, count
                    )
    return count


@inlined
def _find_spans(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    ahead_x: float,
    ahead_y: float,
    size: Floats,
    farthest: float,
    beams: int,
    look: Floats,
    span: Ints,
) -> None:
    """Find which beams of a layer may meet a box: first and last beam of up to three intervals."""
    for part in range(0, 2 * TURNS, 2):
        span[part], span[part + 1] = 0, -1
    # Whatever is behind it is beyond every reach, too. NaN compares false.
    if not look[DISTANCE] - look[HALF] <= farthest:
        return
    find_shape(size, look)
    right, left = bearings(ahead_x, ahead_y, look)
    if not right <= left:
        return
    departure, field_of_view = parameters["departure"], parameters["field_of_view"]
    # An edge may lie beyond half a turn to either side, where the layer begins again.
    for turn in range(TURNS):
        back = 2.0 * math.pi * (turn - 1)
        span[2 * turn], span[2 * turn + 1] = scan.beams_between(
            right - departure - back, left + departure - back, field_of_view, beams
        )


@inlined
def _scan_spans(  # noqa: PLR0913, PLR0917 - a kernel
    look: Floats,
    size: Floats,
    sine: float,
    cosine: float,
    parameters: Any,
    table: Floats,
    beams: int,
    thing: int,
    span: Ints,
    nearest: Floats,
    who: Ints,
) -> None:
    """Cast the beams of all layers that may meet a box; see ``kernel.scan.scan_box``."""
    height = parameters["z"]
    for part in range(0, 2 * TURNS, 2):
        if span[part] > span[part + 1]:
            continue
        for layer in range(0, table.shape[1], beams):
            first, last = layer + span[part], layer + span[part + 1]
            if parameters["is_level"] > 0.0:
                scan.scan_box_level(
                    look, size, sine, cosine, height, table, first, last, thing, nearest, who
                )
            else:
                scan.scan_box(
                    look, size, sine, cosine, height, table, first, last, thing, nearest, who
                )


@inlined
def _scan_ground(height: float, table: Floats, reach: Floats, nearest: Floats, who: Ints) -> None:
    """Cast the beams that point down at the ground, as far as it returns anything."""
    for beam in range(table.shape[1]):
        slope = table[scan.BEAM_SLOPE, beam]
        if slope < 0.0:
            distance = -height / slope
            if distance * table[scan.BEAM_SECANT, beam] <= reach[-1]:
                nearest[beam] = distance
                who[beam] = GROUND


@inlined
def _list_hits(  # noqa: PLR0913, PLR0917 - a kernel
    first: int,
    last: int,
    table: Floats,
    reach: Floats,
    nearest: Floats,
    who: Ints,
    order: Ints,
    ways: Floats,
    count: int,
) -> int:
    """List the beams of an interval that come back, and make room for the next run.

    Args:
        first: Beam.
        last: Beam.
        table: (BEAM_WIDTH, P).
        reach: (M + 1,) how near each object must be, and the ground [m].
        nearest: (P,) distance in plan view in, or infinity; infinity out.
        who: (P,) what is hit.
        order: (P,) beams in the list, in and out.
        ways: (P,) distance along each of them [m], in and out.
        count: How many there are.

    Returns:
        How many there are now.
    """
    for beam in range(first, last + 1):
        if nearest[beam] < math.inf:
            distance = nearest[beam] * table[scan.BEAM_SECANT, beam]
            nearest[beam] = math.inf
            # The ground is number -1 and so the last.
            if 0.0 < distance <= reach[who[beam]]:
                order[count] = beam
                ways[count] = distance
                count += 1
    return count


@inlined
def _measure(
    parameters: Any, truth: Truth, run: int, hits: int, memory: Memory, frame: Frame
) -> int:
    """Measure the hits of one run with their noise; its numbers are drawn by beam.

    Args:
        parameters: Record of the sensor's parameters and the weather.
        truth: Whose random numbers are drawn.
        run: Which one.
        hits: How many beams come back.
        memory: Which these are, how far, and scratch.
        frame: Empty in, out.

    Returns:
        Number of the rows of ``points`` that are not empty.
    """
    table = memory.tables[memory.table_of[run]]
    order, ways = memory.order[0][:hits], memory.ways[0][:hits]
    indices, farther, aside = memory.order[1][:hits], memory.ways[1][:hits], memory.ways[2][:hits]
    seed, owner, number = truth.seeds[run], truth.owner, truth.number
    sigma, rain_noise = parameters["range_noise"], parameters["rain_noise"]
    bearing_noise, drop_out = parameters["bearing_noise"], parameters["drop_out"]
    has_noise = sigma > 0.0 or rain_noise > 0.0 or bearing_noise > 0.0
    if has_noise:
        for place in range(order.shape[0]):
            indices[place] = DRAWS * order[place]
        normal_pairs_at(seed, owner, number, indices, farther, aside)
    count = 0
    for place in range(order.shape[0]):
        beam, way = order[place], ways[place]
        if drop_out > 0.0 and uniform(seed, owner, number, DRAWS * beam + 1) < drop_out:
            continue
        bearing = table[scan.BEAM_BEARING, beam]
        if has_noise:
            # Both are independent, so their variances add up.
            wet = rain_noise * way
            way += math.sqrt(sigma * sigma + wet * wet) * farther[place]
            bearing += bearing_noise * aside[place]
            if way <= 0.0:
                continue
        point = frame.points[run, beam]
        point[signals.POINT_RANGE] = way
        point[signals.POINT_BEARING] = bearing
        point[signals.POINT_ELEVATION] = table[scan.BEAM_ELEVATION, beam]
        frame.hits[run, beam] = memory.who[beam]
        frame.returns[run, count] = beam
        count += 1
    return count


# --- Physical lidar: beams cast at everything around, and the returns that are strong enough ------

_FREE: Final = 2
"""References to an array that nobody but its frame holds: the frame's, and that of the count."""


FRAMES: Final = 3
"""Samples of a lidar whose memory is in use at a time: delivered, waiting, being made."""


def sample_bytes(architecture: Architecture) -> int:
    """Count the bytes that the returns of one run's lidars take while it is executed.

    Args:
        architecture: Of the run.
    """
    beams = sum(
        spec.beams * spec.layers
        for spec in architecture.sensors.values()
        if isinstance(spec, PhysicalLidar)
    )
    return FRAMES * beams * (len(signals.POINT_COLUMNS) + 2) * np.dtype(np.float64).itemsize


class LidarSensor(Sampling):
    """A lidar that delivers the returns of its beams; it detects no objects itself.

    Beams stand layer by layer, see ``kernel.scan.fill_beams``. Where a beam's nearest hit returns
    too little light nothing comes back, and what is behind is hidden all the same.
    """

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        self._context = context
        scene = context.scene
        specs = [cast("PhysicalLidar", spec) for spec in context.specs]
        tables, table_of, departure = _tables(specs)
        self._beams = specs[0].beams
        slopes = tables[:, scan.BEAM_SLOPE]
        self._parameters = parameter_record(
            {
                **spec_columns(specs, _numbers),
                "departure": departure[table_of],
                "has_ground": slopes.min(axis=1)[table_of] < 0.0,
                "is_level": np.abs(slopes).max(axis=1)[table_of] == 0.0,
                "rain": scene.surroundings.rain,
                "visibility": scene.surroundings.fog_visibility,
                "rain_noise": [lidar_rain_noise(float(r)) for r in scene.surroundings.rain],
            }
        )
        objects, size = len(scene.object_ids), specs[0].beams * specs[0].layers
        # The last column is that of the ground.
        reach: Floats = np.zeros((scene.runs, objects + 1))
        _fill_reach(self._parameters, scene.object_reflectivity, reach)
        self._memory = Memory(
            tables,
            table_of,
            reach,
            np.zeros((objects, OUTLINE_WIDTH)),
            np.zeros((objects, 2 * TURNS), dtype=np.int64),
            np.full(size, np.inf),
            np.full(size, GROUND, dtype=np.int64),
            np.zeros((2, size), dtype=np.int64),
            np.zeros((3, size)),
        )
        self._frames: list[Frame] = []
        self._nothing = no_measurement(scene.runs, objects, with_estimate=False)
        super().__init__(context, self._shown(self._frame(), -1.0))

    def _shown(self, frame: Frame, time: float) -> Measurement:
        """Return a sample of a time [s] whose returns are in a frame."""
        runs, nothing = self._context.scene.runs, self._nothing
        return Measurement(
            stamp=np.full(runs, time),
            fresh=np.zeros(runs, dtype=np.bool_),
            alive=np.ones(runs, dtype=np.bool_),
            mask=nothing.mask.copy(),
            detections=nothing.detections.copy(),
            source=nothing.source.copy(),
            points=frame.points,
            hits=frame.hits,
        )

    def _sample(self, scene: Scene) -> Measurement:
        frame = self._frame()
        sample_batch(self._parameters, self._truth(scene), self._beams, self._memory, frame)
        return self._shown(frame, scene.time)

    def _frame(self) -> Frame:
        """Return a frame that nobody looks at any more, or a new one: fresh memory is dear."""
        for frame in self._frames:
            if sys.getrefcount(frame.points) <= _FREE and sys.getrefcount(frame.hits) <= _FREE:
                return frame
        self._frames.append(Frame.of(self._context.scene.runs, len(self._memory.nearest)))
        return self._frames[-1]


def _numbers(spec: PhysicalLidar) -> dict[str, float]:
    """List what the compiled step reads of a lidar."""
    return {
        **fields_of(spec.mount, "x", "y", "z", "yaw"),
        **fields_of(spec, "field_of_view", "range", "reference_reflectivity"),
        **fields_of(spec, "range_noise", "bearing_noise", "drop_out"),
    }


def _tables(specs: Sequence[PhysicalLidar]) -> tuple[Floats, Ints, Floats]:
    """Find the directions of the beams of every run.

    Returns:
        Tables of beams (G, BEAM_WIDTH, P), number of the table of each run (B,), and how far the
        bearings of each depart from the angles in a layer (G,) [rad].
    """
    known: dict[tuple[float, float, float, float], int] = {}
    of_run = np.zeros(len(specs), dtype=np.int64)
    for run, spec in enumerate(specs):
        shape = (
            spec.mount.yaw,
            spec.mount.pitch,
            spec.field_of_view,
            spec.vertical_field_of_view,
        )
        of_run[run] = known.setdefault(shape, len(known))
    beams, layers = specs[0].beams, specs[0].layers
    tables: Floats = np.zeros((len(known), scan.BEAM_WIDTH, beams * layers))
    departure: Floats = np.zeros(len(known))
    for shape, number in known.items():
        departure[number] = scan.fill_beams(*shape, beams, layers, tables[number])
    return tables, of_run, departure


@compiled
def _fill_reach(parameters: Any, reflectivity: Floats, reach: Floats) -> None:
    """Compute the range (B, M + 1) that the weather leaves for each object and the ground [m]."""
    for run in range(reach.shape[0]):
        record = parameters[run]
        for thing in range(reach.shape[1]):
            is_ground = thing == reach.shape[1] - 1
            reach[run, thing] = lidar_range(
                record["range"],
                ROAD_REFLECTIVITY if is_ground else reflectivity[run, thing],
                record["reference_reflectivity"],
                record["rain"],
                record["visibility"],
            )
