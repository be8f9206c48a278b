"""Write a batch tick by tick into the columns of a trace.

A column holds the rows of one run one after the other, so that a run can be read and hashed in one
go; a tick touches every run. Ticks are therefore collected in a ring that holds the rows of all
runs side by side, and a few of them at a time are moved to the columns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.clock import tick_times
from adeye.recorder.beliefs import compare_tracks, show_nothing
from adeye.recorder.rows import clear, mark_detected, move, place_detections, place_points
from adeye.trace import COLUMNS, DRAWN, ChannelEvent, Layout, Trace

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.signals import Authority, Bools, ControlCommand, Floats, Ints, Measurement, Scene
    from adeye.sweep.case import TestCase

TRACKS: Final = 8
"""Tracks of a channel that a trace keeps."""

POINTS: Final = 256
"""Returns of a lidar's sample that a trace keeps."""

RING: Final = 16
"""Ticks that are collected before they are moved."""

_COLLECTED: Final = tuple(name for name in COLUMNS if name not in DRAWN)
"""Columns that go through the ring."""

_SEEN: Final = (
    "ego",
    "ego_place",
    "objects",
    "object_places",
    "begun",
    "contact",
    "impact_speed",
    "foreign_contact",
)
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
        self._move()
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
        for values in self._columns.values():
            clear(values.reshape(len(self._length), len(self._time), -1), self._length, rows)
        return Trace(
            layout=self._layout,
            time=self._time[:rows],
            length=self._length,
            horizon_row=horizon_row.copy(),
            complete=complete.copy(),
            columns={name: values[:, :rows] for name, values in self._columns.items()},
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

    def _move(self) -> None:
        runs, rows = len(self._length), len(self._time)
        for name, ring in self._ring.items():
            column = self._columns[name].reshape(runs, rows, -1)
            move(ring.reshape(RING, runs, -1), self._first, self._length, column)


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
