"""One run of a trace as others see it: in the coordinates of its map, frames and bodies by name.

Whatever is recorded of a run in left-hand traffic is its mirror image; here it is turned back, so
that left is left. Frames are right-handed with x ahead and z up: ``map``; ``base_link``, the middle
of the ego's box on the ground; and one for each sensor that has a mount. The ground is flat: z = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from adeye import signals as columns
from adeye.exchange.road_lines import VIEW, RoadLine, RoadLines, road_lines

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from adeye.signals import Bools, Floats
    from adeye.trace import Trace

MAP: Final = "map"
BASE: Final = "base_link"

Level = Literal["info", "warning", "error"]

_EGO_ASIDE: Final = (
    *(columns.EGO_Y, columns.EGO_HEADING, columns.EGO_STEERING),
    columns.EGO_YAW_RATE,
)
_OBJECT_ASIDE: Final = (columns.OBJECT_Y, columns.OBJECT_HEADING)
_TRACK_ASIDE: Final = (1, 3)
"""Columns of a state that are positive to the left."""
_OF_MOTION: Final = frozenset({"gnss", "imu"})
"""Kinds of sensors that look at nobody else."""


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that is told of a time in a run: an event, or a verdict.

    Attributes:
        time: [s].
        level: How bad it is.
        name: Whom or what it is about.
        text: One line for people.
    """

    time: float
    level: Level
    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Account:
    """What is known of a run beside its trace.

    Attributes:
        run: Result digest.
        about: Scenario, architecture, outcome and more, in words.
        remarks: In order of time.
        metrics: Value by id, in the unit that the id ends in; None for those without a value.
    """

    run: str
    about: Mapping[str, str]
    remarks: tuple[Remark, ...] = ()
    metrics: Mapping[str, float | None] | None = None


@dataclass(frozen=True, slots=True)
class SensorPose:
    """Where a sensor is mounted.

    Attributes:
        id: Of the sensor.
        kind: Camera, radar, ….
        index: Its place on the sensor axis of a trace.
        place: x, y, z in ``base_link`` [m].
        yaw: To the left [rad].
        pitch: With the nose down [rad].
    """

    id: str
    kind: str
    index: int
    place: tuple[float, float, float]
    yaw: float
    pitch: float

    @property
    def detects(self) -> bool:
        """Whether it delivers detections."""
        return self.kind not in _OF_MOTION

    @property
    def frame(self) -> str:
        """Name of its frame."""
        return f"sensor/{self.id}"


class RunView:
    """One run of a trace in the coordinates of its map.

    Attributes:
        trace: The batch.
        run: Its row in the batch.
        rows: Ticks that it has; nothing is decided at the last one.
        time: (rows,) [s].
        mirrored: Whether what is recorded is the mirror image.
    """

    def __init__(self, trace: Trace, run: int = 0) -> None:
        """Look at a run.

        Args:
            trace: The batch that it is in.
            run: Its row in the batch.
        """
        self.trace, self.run = trace, run
        self.rows = int(trace.length[run])
        self.time: Floats = trace.time[: self.rows]
        self.mirrored = trace.layout.context.road.left_hand

    def column(self, name: str, *aside: int) -> Any:
        """Return a column of the trace, (rows, ...).

        Args:
            name: Of the column.
            aside: Entries of its last axis that are positive to the left; of a column without such
                an axis, see ``turned``.
        """
        values = self.trace[name][self.run, : self.rows]
        if self.mirrored and aside:
            values = values.copy()
            values[..., list(aside)] = 0.0 - values[..., list(aside)]
        return values

    def turned(self, values: Any) -> Any:
        """Return values that are positive to the left."""
        return 0.0 - values if self.mirrored else values

    @cached_property
    def ego(self) -> Floats:
        """(rows, 7) states of the ego, ``signals.EGO_COLUMNS``."""
        found: Floats = self.column("ego", *_EGO_ASIDE)
        return found

    @cached_property
    def objects(self) -> Floats:
        """(rows, M, 5) states of the objects, ``signals.OBJECT_COLUMNS``."""
        found: Floats = self.column("objects", *_OBJECT_ASIDE)
        return found

    @cached_property
    def tracks(self) -> Floats:
        """(rows, C, K, 6) tracks in ``base_link``, ``signals.TRACK_COLUMNS``; NaN where none."""
        found: Floats = self.column("tracks", *_TRACK_ASIDE)
        return found

    @property
    def objects_of(self) -> tuple[str, ...]:
        """Names of the M objects; actors come first."""
        return self.trace.layout.context.object_ids

    @property
    def actors(self) -> int:
        """How many of the objects are actors."""
        return self.trace.layout.context.actor_count

    def kind(self, index: int) -> str:
        """Return the class of an object."""
        return columns.OBJECT_CLASSES[int(self.trace.layout.context.object_classes[index])]

    def size(self, index: int | None = None) -> tuple[float, float, float]:
        """Return length, width and height of an object, or of the ego [m]."""
        context = self.trace.layout.context
        size = context.ego_size if index is None else context.object_sizes[:, index]
        length, width, height = size[self.run].tolist()
        return length, width, height

    @property
    def rear_axle(self) -> float:
        """How far the middle of the ego's box is ahead of its rear axle [m]."""
        vehicle = self.trace.layout.architectures[self.run].vehicle
        return 0.5 * float(vehicle.wheelbase)

    @cached_property
    def sensors(self) -> tuple[SensorPose, ...]:
        """Sensors that have a mount."""
        listed = self.trace.layout.architectures[self.run].sensors
        return tuple(
            SensorPose(
                name,
                spec.kind,
                self.trace.layout.sensors.index(name),
                (spec.mount.x, self.turned(spec.mount.y), spec.mount.z),
                self.turned(spec.mount.yaw),
                spec.mount.pitch,
            )
            for name, spec in listed.items()
            if hasattr(spec, "mount")
        )

    def samples(self, sensor: int) -> Iterator[tuple[int, int, float, Floats, Bools]]:
        """Yield the samples of a sensor that were delivered.

        Args:
            sensor: Its place on the sensor axis.

        Yields:
            Row at which it was delivered, row of the ego's pose at its time, its time [s], (M, 2)
            measured places in the map [m], and (M,) which objects it has.
        """
        stamps = self.trace["sensor_stamp"][self.run, : self.rows - 1, sensor]
        alive = self.trace["sensor_alive"][self.run, : self.rows - 1, sensor] != 0
        detected = self.trace["detected"][self.run, : self.rows - 1, sensor] != 0
        places = self.column("detections", 1)[: self.rows - 1, sensor]
        step = self.trace.layout.context.step
        for row, stamp in enumerate(stamps.tolist()):
            if not alive[row] or stamp < 0.0 or (row and stamp == stamps[row - 1]):
                continue
            # As the recorder: a clock that is wrong may tell of a time that has not come.
            taken = min(stamp, float(self.time[row]))
            has = detected[row] if places.shape[1] else np.zeros(0, dtype=np.bool_)
            # A failed sensor reports places that are no numbers.
            yield (
                *(row, round(taken / step), taken, places[row]),
                has & np.isfinite(places[row]).all(axis=-1),
            )

    @cached_property
    def road(self) -> RoadLines:
        """The road before and behind what the ego drives.

        The right line of a lane is to the right of who looks towards greater s, also here.
        """
        context = self.trace.layout.context
        s = self.trace["ego_place"][self.run, : self.rows, columns.PLACE_S]
        ground = context.road.ground(self.run)
        found = road_lines(ground, float(s.min()) - VIEW, float(s.max()) + VIEW)
        if not self.mirrored:
            return found

        def turned(line: RoadLine) -> RoadLine:
            return replace(line, places=np.stack([line.places[:, 0], 0.0 - line.places[:, 1]], 1))

        return RoadLines(
            tuple(map(turned, found.boundaries)),
            tuple(replace(lane, right=lane.left, left=lane.right) for lane in found.lanes),
            None if found.shoulder is None else turned(found.shoulder),
        )


def quaternion(yaw: float, pitch: float = 0.0) -> tuple[float, float, float, float]:
    """Return a rotation to the left, and then with the nose down, as x, y, z, w.

    >>> quaternion(0.0)
    (0.0, 0.0, 0.0, 1.0)
    """
    sine, cosine = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
    down, level = math.sin(0.5 * pitch), math.cos(0.5 * pitch)
    return 0.0 - sine * down, cosine * down, sine * level, cosine * level


def nanoseconds(time: float) -> int:
    """Return a time [s] in whole nanoseconds."""
    return round(time * 1e9)
