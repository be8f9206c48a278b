"""Writes a batch tick by tick into the columns of a trace.

The recorder does this, with the truth; no channel ever sees it. A confirmed track belongs to the
object whose body is nearest to the track's centre, if that is no farther than a gate; of several
tracks of an object the nearest one counts, and the others are no false ones. Likewise a detection
of a sensor from outside the package: that is of what stands there, whatever it claims.

A column holds the rows of one run one after the other, so that a run can be read and hashed in one
go; a tick touches every run. Ticks are therefore collected in a ring that holds the rows of all
runs side by side, and a few of them at a time are moved to the columns.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye import signals
from adeye.kernel.elementary import sin_cos
from adeye.kernel.encounter import reachable_distance
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.relation import tick_times
from adeye.kernel.road import lane_way, local
from adeye.spec.sensors import LOWEST_LIDAR, FmuSensor, PluginSensor
from adeye.trace import COLUMNS, DRAWN, NO_TRACKS, ChannelEvent, Layout, Trace

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.signals import Authority, Bools, ControlCommand, Floats, Ints, Measurement, Scene
    from adeye.sweep.case import TestCase

# --- The rows of a trace in compiled loops: what a reading shows, and from the ring to the
# columns.


@compiled
def mark_detected(mask: Bools, source: Ints, detected: Bools) -> None:
    """Mark the objects behind detections, for the record only.

    Args:
        mask: (B, M) detections that are there.
        source: (B, M) object behind each.
        detected: (B, M) out, by object.
    """
    for run in range(mask.shape[0]):
        for thing in range(detected.shape[1]):
            detected[run, thing] = False
        for slot in range(mask.shape[1]):
            thing = source[run, slot]
            if mask[run, slot] and thing >= 0:
                detected[run, thing] = True


@compiled
def place_detections(  # noqa: PLR0913, PLR0917 - a kernel
    runs: Bools,
    mask: Bools,
    detections: Floats,
    source: Ints,
    stamp: Floats,
    step: float,
    ego: Floats,
    places: Floats,
) -> None:
    """Place detections in the map, sorted by true object.

    Args:
        runs: (B,) runs to record.
        mask: (B, M) detections that are there.
        detections: (B, M, 7).
        source: (B, M) object behind each.
        stamp: (B,) time of the sample [s].
        step: Master clock [s].
        ego: (B, T, 7) recorded ego states, which hold the pose at the sample's time.
        places: (B, M, 2) out [m].
    """
    for run in range(runs.shape[0]):
        if not runs[run]:
            continue
        row = round(stamp[run] / step)
        for slot in range(mask.shape[1]):
            thing = source[run, slot]
            if not mask[run, slot] or thing < 0:
                continue
            x = detections[run, slot, signals.DETECTION_X]
            y = detections[run, slot, signals.DETECTION_Y]
            sine, cosine = sin_cos(ego[run, row, signals.EGO_HEADING])
            places[run, thing, 0] = ego[run, row, signals.EGO_X] + cosine * x - sine * y
            places[run, thing, 1] = ego[run, row, signals.EGO_Y] + sine * x + cosine * y


@compiled
def place_points(  # noqa: PLR0913, PLR0917 - a kernel
    runs: Bools,
    points: Floats,
    stamp: Floats,
    mounts: Floats,
    step: float,
    ego: Floats,
    places: Any,
) -> None:
    """Place the returns of a lidar in the map, evenly thinned; those of the ground are left out.

    Args:
        runs: (B,) runs to record.
        points: (B, P, 3).
        stamp: (B,) time of the sample [s]; before the first one there are no returns.
        mounts: (B, 4) x, y, z, yaw of the lidar.
        step: Master clock [s].
        ego: (B, T, 7) recorded ego states, which hold the pose at the sample's time.
        places: (B, K, 2) NaN in, out [m].
    """
    most = places.shape[1]
    for run in range(runs.shape[0]):
        if not runs[run] or stamp[run] < 0.0:
            continue
        row = round(stamp[run] / step)
        total = 0
        for beam in range(points.shape[1]):
            total += 1 if _rises(points[run, beam], mounts[run, 2]) else 0
        sine, cosine = sin_cos(ego[run, row, signals.EGO_HEADING])
        count = 0
        for beam in range(points.shape[1]):
            if not _rises(points[run, beam], mounts[run, 2]):
                continue
            # The first one of each of equal parts.
            slot = count if total <= most else count * most // total
            is_first = total <= most or count == 0 or slot != (count - 1) * most // total
            count += 1
            if is_first:
                bearing = sin_cos(points[run, beam, signals.POINT_BEARING])
                way = (
                    points[run, beam, signals.POINT_RANGE]
                    * sin_cos(points[run, beam, signals.POINT_ELEVATION])[1]
                )
                x, y = mounts[run, 0] + way * bearing[1], mounts[run, 1] + way * bearing[0]
                places[run, slot, 0] = ego[run, row, signals.EGO_X] + cosine * x - sine * y
                places[run, slot, 1] = ego[run, row, signals.EGO_Y] + sine * x + cosine * y


@inlined
def _rises(point: Floats, height: float) -> bool:
    """Tell whether there is a return that is not of the ground."""
    way = point[signals.POINT_RANGE]
    return bool(
        way > 0.0 and height + way * sin_cos(point[signals.POINT_ELEVATION])[0] >= LOWEST_LIDAR
    )


@compiled
def cut(column: Any, length: Ints, kept: Any) -> None:
    """Keep the first rows of a column, zero beyond the length of each run.

    Args:
        column: (B, T, W).
        length: (B,).
        kept: (B, R, W) out, with at most as many rows; it may begin where the column begins.
    """
    for run in range(length.shape[0]):
        for row in range(min(length[run], kept.shape[1])):
            for place in range(column.shape[2]):
                kept[run, row, place] = column[run, row, place]
        for row in range(length[run], kept.shape[1]):
            for place in range(column.shape[2]):
                kept[run, row, place] = 0


@compiled
def move(ring: Any, first: int, length: Ints, column: Any) -> None:
    """Move what the ring has collected of one column.

    Args:
        ring: (RING, B, W) rows of all runs side by side.
        first: Row of the ring's first.
        length: (B,) rows that each run has so far.
        column: (B, T, W) out.
    """
    for run in range(ring.shape[1]):
        for row in range(min(length[run] - first, ring.shape[0])):
            for place in range(ring.shape[2]):
                column[run, first + row, place] = ring[row, run, place]


# --- Compiled: what a channel believes, compared with what was true when it looked ----------------

GATE: Final = 2.5
GATE_GROWTH: Final = 0.05
"""Largest distance of a track's centre from the body of its object [m], and its growth with the
distance from the ego. Our choice: above the distance error of a camera, below that to a neighbour
in the next lane."""


@compiled
def compare_tracks(  # noqa: PLR0913, PLR0917 - a kernel over scene and beliefs
    running: Bools,
    tracks: Floats,
    stamp: Floats,
    step: float,
    tick: int,
    first: int,
    recent: tuple[Floats, Floats, Floats],
    ego: Floats,
    places: Floats,
    objects: Floats,
    sizes: Floats,
    ego_size: Floats,
    friction: Floats,
    segments: Floats,
    error: Floats,
    false: NDArray[Any],
) -> None:
    """Compare the tracks of a channel with the objects at the time of its observation.

    Args:
        running: (B,) runs that have not ended.
        tracks: (B, K, 6) in the vehicle frame of that time; NaN rows are empty.
        stamp: (B,) time of the observation behind the command [s], -1 before the first.
        step: Master clock [s].
        tick: Of now.
        first: Row of the ring's first.
        recent: The rows from there on: ego (R, B, 7), its place (R, B, 6), objects (R, B, M, 5).
        ego: (B, T, 7) the rows before.
        places: (B, T, 6) of the ego.
        objects: (B, T, M, 5).
        sizes: (B, M, 3).
        ego_size: (B, 3).
        friction: (B,) of the road.
        segments: (B, S, 5) reference lines of the roads.
        error: (B, M, 2) out: track minus object along and across the line of sight from the ego
            [m], NaN for an object without a confirmed track.
        false: (B,) out: confirmed tracks that belong to no object and lie within what the ego
            reaches before it can stand.
    """
    for run in range(running.shape[0]):
        false[run] = 0
        for thing in range(error.shape[1]):
            error[run, thing, 0] = error[run, thing, 1] = math.nan
        if not (running[run] and stamp[run] >= 0.0):
            continue
        row = min(round(stamp[run] / step), tick)
        if row >= first:
            own, place = recent[0][row - first, run], recent[1][row - first, run]
            others = recent[2][row - first, run]
        else:
            own, place, others = ego[run, row], places[run, row], objects[run, row]
        sine, cosine = sin_cos(own[signals.EGO_HEADING])
        for track in range(tracks.shape[1]):
            x, y = tracks[run, track, 0], tracks[run, track, 1]
            # NaN compares false, so an empty row is no track.
            if not math.isfinite(x + y):
                continue
            map_x = own[signals.EGO_X] + cosine * x - sine * y
            map_y = own[signals.EGO_Y] + sine * x + cosine * y
            thing = _owner(map_x, map_y, math.sqrt(x * x + y * y), others, sizes[run])
            if thing >= 0:
                _keep_nearest(map_x, map_y, own, others[thing], error[run, thing])
            elif _is_reachable(
                map_x, map_y, tracks[run, track, 4], tracks[run, track, 5], own, place,
                ego_size[run], friction[run], segments[run],
            ):  # fmt: skip
                false[run] += 1


@compiled
def own_detections(  # noqa: PLR0913, PLR0917 - a kernel over scene and detections
    running: Bools,
    mask: Bools,
    detections: Floats,
    claimed: Ints,
    stamp: Floats,
    step: float,
    tick: int,
    first: int,
    recent: tuple[Floats, Floats],
    ego: Floats,
    objects: Floats,
    sizes: Floats,
    source: Ints,
) -> None:
    """Find the objects that detections are of by where they say that something is.

    Whoever measured says only whether a detection is of an object at all.

    Args:
        running: (B,) runs that have not ended.
        mask: (B, N) detections that are there.
        detections: (B, N, 7) in the vehicle frame of their time.
        claimed: (B, N) object that each is said to be of, -1 for none.
        stamp: (B,) time of the sample [s].
        step: Master clock [s].
        tick: Of now.
        first: Row of the ring's first.
        recent: The rows from there on: ego (R, B, 7), objects (R, B, M, 5).
        ego: (B, T, 7) the rows before.
        objects: (B, T, M, 5).
        sizes: (B, M, 3).
        source: (B, N) out: the object whose body is nearest, -1 if none is in the gate.
    """
    for run in range(running.shape[0]):
        source[run] = -1
        if not (running[run] and stamp[run] >= 0.0):
            continue
        row = min(round(stamp[run] / step), tick)
        if row >= first:
            own, others = recent[0][row - first, run], recent[1][row - first, run]
        else:
            own, others = ego[run, row], objects[run, row]
        sine, cosine = sin_cos(own[signals.EGO_HEADING])
        for slot in range(mask.shape[1]):
            x = detections[run, slot, signals.DETECTION_X]
            y = detections[run, slot, signals.DETECTION_Y]
            if not mask[run, slot] or claimed[run, slot] < 0 or not math.isfinite(x + y):
                continue
            map_x = own[signals.EGO_X] + cosine * x - sine * y
            map_y = own[signals.EGO_Y] + sine * x + cosine * y
            distance = math.sqrt(x * x + y * y)
            source[run, slot] = _owner(map_x, map_y, distance, others, sizes[run])


@compiled
def show_nothing(error: Floats, false: NDArray[Any]) -> None:
    """Say that a channel shows no tracks: NaN for every object, ``NO_TRACKS`` false ones."""
    for run in range(error.shape[0]):
        false[run] = NO_TRACKS
        for thing in range(error.shape[1]):
            error[run, thing, 0] = error[run, thing, 1] = math.nan


@inlined
def _owner(x: float, y: float, distance: float, objects: Floats, sizes: Floats) -> int:
    """Return the object whose body is nearest to a track's centre, -1 if none is in the gate."""
    nearest, owner = GATE + GATE_GROWTH * distance, -1
    for thing in range(objects.shape[0]):
        dx, dy = x - objects[thing, signals.OBJECT_X], y - objects[thing, signals.OBJECT_Y]
        half = 0.5 * (sizes[thing, 0] + sizes[thing, 1])
        within = nearest + half
        if dx * dx + dy * dy > within * within:
            continue
        sine, cosine = sin_cos(objects[thing, signals.OBJECT_HEADING])
        along = max(0.0, abs(cosine * dx + sine * dy) - 0.5 * sizes[thing, 0])
        across = max(0.0, abs(cosine * dy - sine * dx) - 0.5 * sizes[thing, 1])
        apart = math.sqrt(along * along + across * across)
        if apart < nearest:
            nearest, owner = apart, thing
    return owner


@inlined
def _keep_nearest(x: float, y: float, own: Floats, other: Floats, error: Floats) -> None:
    """Keep the error of the track whose centre is nearest to that of its object."""
    ux, uy = (
        other[signals.OBJECT_X] - own[signals.EGO_X],
        other[signals.OBJECT_Y] - own[signals.EGO_Y],
    )
    distance = math.sqrt(ux * ux + uy * uy)
    if distance > 0.0:
        ux, uy = ux / distance, uy / distance
    dx, dy = x - other[signals.OBJECT_X], y - other[signals.OBJECT_Y]
    along, across = ux * dx + uy * dy, ux * dy - uy * dx
    before = error[0] * error[0] + error[1] * error[1]
    if not before <= along * along + across * across:
        error[0], error[1] = along, across


@inlined
def _is_reachable(  # noqa: PLR0913, PLR0917 - a part of the kernel
    x: float,
    y: float,
    length: float,
    width: float,
    own: Floats,
    place: Floats,
    ego_size: Floats,
    friction: float,
    segments: Floats,
) -> bool:
    """Tell whether a body lies in the ego's corridor, no farther than it gets before it stands."""
    s, d, heading, _ = local(segments, x, y)
    apart = lane_way(
        place[signals.PLACE_S], place[signals.PLACE_HEADING], place[signals.PLACE_D], s, heading
    )
    gap = apart - 0.5 * (length + ego_size[0])
    beside = abs(d - place[signals.PLACE_D]) - 0.5 * (width + ego_size[1])
    is_ahead = s > place[signals.PLACE_S]
    return bool(
        is_ahead and beside < 0.0 and gap <= reachable_distance(own[signals.EGO_SPEED], friction)
    )


# --- Write a batch tick by tick into the columns of a trace ---------------------------------------

TRACKS: Final = 8
"""Tracks of a channel that a trace keeps."""

POINTS: Final = 256
"""Returns of a lidar's sample that a trace keeps."""

RING: Final = 16
"""Ticks that are collected before they are moved."""

_COLLECTED: Final = tuple(name for name in COLUMNS if name not in DRAWN)
"""Columns that go through the ring."""

_SEEN: Final = tuple(field.name for field in fields(signals.Scene) if field.name in COLUMNS)
"""Columns of the scene, which the last row of a run has too; what was decided from it is zero."""

_COARSE: Final = frozenset({"candidates", "candidate_costs", "points"})
"""Columns of which a picture needs no more than seven digits: a millimetre in ten kilometres."""

_CODES: Final = {
    "chosen": np.int16,
    "contact": np.int16,
    "status": np.int8,
    "false_tracks": np.int8,
    "authority": np.int8,
    "reason": np.int8,
}
_FLAGS: Final = frozenset(
    {"foreign_contact", "sensor_alive", "detected", "monitors", "fault_active"}
)


class Memory:
    """Memory of one trace at a time, used again by the next: fresh pages cost more than a run."""

    def __init__(self) -> None:
        """Start with none."""
        self._buffers: dict[str, NDArray[np.uint8]] = {}

    def array(self, name: str, shape: tuple[int, ...], kind: Any) -> Any:
        """Give an array whose content is anything.

        Args:
            name: Of its place in the memory; the array that had it before is overwritten.
            shape: Of the array.
            kind: Type of its values.
        """
        size = int(np.prod(shape)) * np.dtype(kind).itemsize
        buffer = self._buffers.get(name)
        if buffer is None or len(buffer) < size:
            self._buffers[name] = buffer = np.empty(size, dtype=np.uint8)
        return buffer[:size].view(kind).reshape(shape)


class Recorder:
    """Collects the rows of B runs; a run stops growing after the scene in which it ended."""

    def __init__(
        self,
        layout: Layout,
        rows: int,
        case_digests: tuple[str, ...],
        *,
        drawn: bool = False,
        memory: Memory | None = None,
        mounts: Mapping[str, Floats] | None = None,
    ) -> None:
        """Allocate the columns.

        Args:
            layout: Names behind the axes.
            rows: Most rows that a run can have.
            case_digests: Digest of the test case behind each run.
            drawn: Whether to keep the columns for pictures, ``trace.DRAWN``.
            memory: Where the columns lie; the trace is gone as soon as it is used again.
            mounts: (B, 4) x, y, z, yaw of each sensor that has a mount, for pictures of returns.
        """
        memory = self._memory = memory or Memory()
        self._layout = layout
        self._case_digests = case_digests
        runs = len(case_digests)
        self._time = tick_times(np.arange(rows), layout.context.step)
        self._length = np.zeros(runs, dtype=np.int64)
        self._open = np.ones(runs, dtype=np.bool_)
        self._is_drawn = drawn
        shapes = _shapes(
            objects=len(layout.context.object_ids),
            events=len(layout.context.event_ids),
            sensors=len(layout.sensors),
            channels=len(layout.channels),
            monitors=len(layout.monitors),
            faults=len(layout.faults),
            lidars=len(layout.lidars),
            is_drawn=drawn,
        )
        self._mounts = mounts or {}
        sensors = layout.architecture.sensors
        # Whose code is not of the package: what they claim to have seen is looked at.
        guests = (FmuSensor, PluginSensor)
        self._guests = {name for name in layout.sensors if isinstance(sensors.get(name), guests)}
        # Which columns hold floats, codes or flags is the table's business, not the checker's.
        self._columns: dict[str, Any] = {
            name: memory.array(name, (runs, rows, *shapes[name]), _kind(name)) for name in COLUMNS
        }
        for name in DRAWN:
            self._columns[name][:] = np.nan if name == "points" else 0.0
        self._ring: dict[str, Any] = {
            name: memory.array(f"ring of {name}", (RING, runs, *shapes[name]), _kind(name))
            for name in _COLLECTED
        }
        self._first = 0

    def add(
        self,
        scene: Scene,
        readings: dict[str, Measurement],
        proposals: Sequence[ControlCommand],
        command: Floats,
        authority: Authority,
        active: Bools,
    ) -> None:
        """Write the scene of a tick and what was decided from it."""
        self._add_scene(scene)
        ring, place = self._ring, scene.tick - self._first
        for index, name in enumerate(self._layout.sensors):
            reading = readings[name]
            ring["sensor_stamp"][place, :, index] = reading.stamp
            ring["sensor_alive"][place, :, index] = reading.alive
            if name in self._guests:
                reading = replace(reading, source=self._owned(scene, reading))
            mark_detected(reading.mask, reading.source, ring["detected"][place, :, index])
            if self._is_drawn:
                self._draw_detections(scene, index, reading)
        if self._is_drawn:
            for index, name in enumerate(self._layout.lidars):
                self._draw_points(scene, index, name, readings[name])
        monitor = 0
        ring["monitors"][place] = False
        for index, proposal in enumerate(proposals):
            for name in ("acceleration", "steering_angle", "stamp", "status"):
                ring[name][place, :, index] = getattr(proposal, name)
            if proposal.monitors is not None:
                end = monitor + proposal.monitors.shape[1]
                ring["monitors"][place, :, monitor:end] = proposal.monitors
                monitor = end
            self._compare_tracks(scene, index, proposal)
            if self._is_drawn:
                self._draw_tracks(scene, index, proposal)
                self._draw_fan(scene, index, proposal)
        ring["authority"][place] = authority.channel
        ring["reason"][place] = authority.reason
        ring["command"][place] = command
        ring["fault_active"][place] = active

    def _owned(self, scene: Scene, reading: Measurement) -> Ints:
        """Return the objects (B, N) that the detections of a guest are of."""
        ring, columns, context = self._ring, self._columns, self._layout.context
        source = np.full(reading.mask.shape, -1, dtype=np.int64)
        own_detections(
            scene.running,
            reading.mask,
            reading.detections,
            reading.source,
            np.minimum(reading.stamp, scene.time),
            context.step,
            scene.tick,
            self._first,
            (ring["ego"], ring["objects"]),
            columns["ego"],
            columns["objects"],
            context.object_sizes,
            source,
        )
        return source

    def _compare_tracks(self, scene: Scene, channel: int, proposal: ControlCommand) -> None:
        ring, columns, context = self._ring, self._columns, self._layout.context
        place = scene.tick - self._first
        error = ring["track_error"][place, :, channel]
        false = ring["false_tracks"][place, :, channel]
        if proposal.tracks is None:
            show_nothing(error, false)
            return
        compare_tracks(
            scene.running,
            proposal.tracks,
            proposal.stamp,
            context.step,
            scene.tick,
            self._first,
            (ring["ego"], ring["ego_place"], ring["objects"]),
            columns["ego"],
            columns["ego_place"],
            columns["objects"],
            context.object_sizes,
            context.ego_size,
            context.surroundings.friction,
            context.road.segments,
            error,
            false,
        )

    def _draw_tracks(self, scene: Scene, channel: int, proposal: ControlCommand) -> None:
        runs = scene.running
        shown = np.nan if proposal.tracks is None else proposal.tracks[runs, :TRACKS]
        self._columns["tracks"][runs, scene.tick, channel] = shown

    def _draw_fan(self, scene: Scene, channel: int, proposal: ControlCommand) -> None:
        runs, columns = scene.running, self._columns
        columns["chosen"][runs, scene.tick, channel] = (
            -1 if proposal.chosen is None else proposal.chosen[runs]
        )
        if proposal.candidates is None or proposal.candidate_costs is None:
            return
        fan, costs = proposal.candidates[runs], proposal.candidate_costs[runs]
        if columns["candidates"].shape[3] == 0:
            self._make_room(*fan.shape[1:3])
        count, points = (
            min(have, size)
            for have, size in zip(fan.shape[1:3], columns["candidates"].shape[3:5], strict=True)
        )
        rows = (runs, scene.tick, channel)
        columns["candidates"][(*rows, slice(count), slice(points))] = fan[:, :count, :points]
        columns["candidate_costs"][(*rows, slice(count))] = costs[:, :count]

    def _make_room(self, count: int, points: int) -> None:
        """Make the columns of the fan: how large it is, is known when the first one arrives."""
        shape = self._columns["candidate_costs"].shape[:3]
        for name, rest in (("candidates", (count, points, 2)), ("candidate_costs", (count,))):
            column = self._memory.array(name, (*shape, *rest), _kind(name))
            column[:] = np.nan
            self._columns[name] = column

    def _draw_detections(self, scene: Scene, sensor: int, reading: Measurement) -> None:
        # The pose at the time of the sample is in the ring or in the columns already.
        self._move("ego")
        place_detections(
            scene.running,
            reading.mask,
            reading.detections,
            reading.source,
            # A clock that is wrong may tell of a time that has not come.
            np.minimum(reading.stamp, scene.time),
            self._layout.context.step,
            self._columns["ego"],
            self._columns["detections"][:, scene.tick, sensor],
        )

    def _draw_points(self, scene: Scene, lidar: int, name: str, reading: Measurement) -> None:
        if reading.points is not None and name in self._mounts:
            place_points(
                scene.running,
                reading.points,
                np.minimum(reading.stamp, scene.time),
                self._mounts[name],
                self._layout.context.step,
                self._columns["ego"],
                self._columns["points"][:, scene.tick, lidar],
            )

    def close(self, scene: Scene) -> None:
        """Write the scene in which the last runs ended."""
        self._add_scene(scene)
        self._move()

    def trace(
        self,
        *,
        horizon_row: Ints,
        complete: Bools,
        events: Sequence[ChannelEvent | None],
    ) -> Trace:
        """Return what was recorded, cut to the longest run."""
        rows = int(self._length.max())
        every = np.arange(len(self._length))
        for name in _COLLECTED:
            if name not in _SEEN:
                self._columns[name][every, self._length - 1] = 0
        # Each is cut where it lies, so that kernels meet one layout however long runs are.
        kept = {}
        for name, values in self._columns.items():
            shape = (len(every), rows, *values.shape[2:])
            kept[name] = values.reshape(-1)[: math.prod(shape)].reshape(shape)
            column, first = (part.reshape(*part.shape[:2], -1) for part in (values, kept[name]))
            cut(column, self._length, first)
        return Trace(
            layout=self._layout,
            time=self._time[:rows],
            length=self._length,
            horizon_row=horizon_row.copy(),
            complete=complete.copy(),
            columns=kept,
            channel_events=tuple(events),
            case_digests=self._case_digests,
        )

    def _add_scene(self, scene: Scene) -> None:
        if scene.tick - self._first == RING:
            self._move()
            self._first = scene.tick
        np.putmask(self._length, self._open, scene.tick + 1)
        self._open &= scene.running
        for name in _SEEN:
            self._ring[name][scene.tick - self._first] = getattr(scene, name)

    def _move(self, *names: str) -> None:
        """Bring what the ring has of columns, all unless named, into them."""
        runs, rows = len(self._length), len(self._time)
        for name in names or self._ring:
            column = self._columns[name].reshape(runs, rows, -1)
            move(self._ring[name].reshape(RING, runs, -1), self._first, self._length, column)


def trace_bytes(case: TestCase) -> int:
    """Count the bytes that the trace of one run takes, if it lasts as long as it may.

    Args:
        case: One test case of a structure.
    """
    scenario, architecture = case.scenario, case.architecture
    shapes = _shapes(
        objects=len(scenario.actors) + len(scenario.world.objects),
        events=len(scenario.storyboard),
        sensors=len(architecture.sensors),
        channels=len(architecture.channels),
        # Of a byte each; how many a plug-in has is not known before it is built.
        monitors=0,
        lidars=0,
        faults=len(case.faults),
    )
    row = sum(int(np.prod(shapes[name])) * int(np.dtype(_kind(name)).itemsize) for name in COLUMNS)
    rows: int = round((scenario.horizon + scenario.tail) / case.step) + 1
    return row * rows


def _shapes(  # noqa: PLR0913 - one for each axis
    *,
    objects: int,
    events: int,
    sensors: int,
    channels: int,
    monitors: int,
    faults: int,
    lidars: int,
    is_drawn: bool = False,
) -> dict[str, tuple[int, ...]]:
    """Give the shape of one row of each column."""
    return {
        "ego": (7,),
        "ego_place": (6,),
        "objects": (objects, 5),
        "object_places": (objects, 6),
        "begun": (events,),
        "contact": (),
        "impact_speed": (),
        "foreign_contact": (),
        "sensor_stamp": (sensors,),
        "sensor_alive": (sensors,),
        "detected": (sensors, objects),
        "detections": (sensors, objects if is_drawn else 0, 2),
        "points": (lidars, POINTS if is_drawn else 0, 2),
        "acceleration": (channels,),
        "steering_angle": (channels,),
        "stamp": (channels,),
        "status": (channels,),
        "monitors": (monitors, 2),
        "tracks": (channels, TRACKS if is_drawn else 0, 6),
        "track_error": (channels, objects, 2),
        "false_tracks": (channels,),
        "candidates": (channels, 0, 0, 2),
        "candidate_costs": (channels, 0),
        "chosen": (channels if is_drawn else 0,),
        "authority": (),
        "reason": (),
        "command": (2,),
        "fault_active": (faults,),
    }


def _kind(name: str) -> Any:
    if name in _FLAGS:
        return np.bool_
    return np.float32 if name in _COARSE else _CODES.get(name, np.float64)
