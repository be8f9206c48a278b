"""Write a batch tick by tick into the columns of a trace."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled
from adeye.signals import (
    DETECTION_X,
    DETECTION_Y,
    EGO_HEADING,
    EGO_X,
    EGO_Y,
    Authority,
    Bools,
    ControlCommand,
    Floats,
    Ints,
    Measurement,
    Scene,
)
from adeye.trace import ChannelEvent, Layout, Trace

if TYPE_CHECKING:
    from collections.abc import Sequence

TRACKS = 8
"""Tracks of a channel that a trace keeps."""


class Recorder:
    """Collects the rows of B runs; a run stops growing after the scene in which it ended."""

    def __init__(self, layout: Layout, rows: int, case_digests: tuple[str, ...]) -> None:
        """Allocate the columns.

        Args:
            layout: Names behind the axes.
            rows: Most rows that a run can have.
            case_digests: Digest of the test case behind each run.
        """
        self._layout = layout
        self._case_digests = case_digests
        runs = len(case_digests)
        objects, events = len(layout.context.object_ids), len(layout.context.event_ids)
        sensors, channels = len(layout.sensors), len(layout.channels)
        self._time = np.arange(rows, dtype=np.float64) * layout.context.step
        self._length = np.zeros(runs, dtype=np.int64)
        self._open = np.ones(runs, dtype=np.bool_)
        self._last_row = 0

        def floats(*shape: int) -> Floats:
            return np.zeros((runs, rows, *shape), dtype=np.float64)

        def flags(*shape: int) -> Bools:
            return np.zeros((runs, rows, *shape), dtype=np.bool_)

        def codes(*shape: int) -> Ints:
            return np.zeros((runs, rows, *shape), dtype=np.int64)

        self._columns: dict[str, Floats | Ints | Bools] = {
            "ego": floats(7),
            "ego_place": floats(6),
            "objects": floats(objects, 5),
            "object_places": floats(objects, 6),
            "begun": floats(events),
            "contact": codes(),
            "impact_speed": floats(),
            "foreign_contact": flags(),
            "sensor_stamp": floats(sensors),
            "sensor_alive": flags(sensors),
            "detected": flags(sensors, objects),
            "detections": floats(sensors, objects, 2),
            "acceleration": floats(channels),
            "steering_angle": floats(channels),
            "stamp": floats(channels),
            "status": codes(channels),
            "monitors": flags(len(layout.monitors), 2),
            "tracks": floats(channels, TRACKS, 6),
            "authority": codes(),
            "reason": codes(),
            "command": floats(2),
            "fault_active": flags(len(layout.faults)),
        }

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
        row: int = scene.tick
        # Which columns hold floats, codes or flags is the table's business, not the checker's.
        columns: dict[str, Any] = self._columns
        runs = scene.running
        for index, name in enumerate(self._layout.sensors):
            reading = readings[name]
            columns["sensor_stamp"][runs, row, index] = reading.stamp[runs]
            columns["sensor_alive"][runs, row, index] = reading.alive[runs]
            _place_detections(
                runs,
                reading.mask,
                reading.detections,
                reading.source,
                reading.stamp,
                self._layout.context.step,
                columns["ego"],
                columns["detected"][:, row, index],
                columns["detections"][:, row, index],
            )
        monitor = 0
        for index, proposal in enumerate(proposals):
            columns["acceleration"][runs, row, index] = proposal.acceleration[runs]
            columns["steering_angle"][runs, row, index] = proposal.steering_angle[runs]
            columns["stamp"][runs, row, index] = proposal.stamp[runs]
            columns["status"][runs, row, index] = proposal.status[runs]
            if proposal.monitors is not None:
                width = proposal.monitors.shape[1]
                columns["monitors"][runs, row, monitor : monitor + width] = proposal.monitors[runs]
                monitor += width
            if proposal.tracks is None:
                columns["tracks"][runs, row, index] = np.nan
            else:
                columns["tracks"][runs, row, index] = proposal.tracks[runs, :TRACKS]
        columns["authority"][runs, row] = authority.channel[runs]
        columns["reason"][runs, row] = authority.reason[runs]
        columns["command"][runs, row] = command[runs]
        columns["fault_active"][runs, row] = active[runs]

    def close(self, scene: Scene) -> None:
        """Write the scene in which the last runs ended."""
        self._add_scene(scene)

    def trace(
        self,
        *,
        horizon_row: Ints,
        complete: Bools,
        events: Sequence[ChannelEvent | None],
    ) -> Trace:
        """Return what was recorded, cut to the longest run."""
        rows = int(self._length.max())
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
        row, columns, runs = scene.tick, self._columns, self._open
        for name in (
            "ego",
            "ego_place",
            "objects",
            "object_places",
            "begun",
            "contact",
            "impact_speed",
            "foreign_contact",
        ):
            columns[name][runs, row] = getattr(scene, name)[runs]
        self._length[runs] = row + 1
        self._open = runs & scene.running


@compiled
def _place_detections(  # noqa: PLR0913, PLR0917 - a kernel
    runs: Bools,
    mask: Bools,
    detections: Floats,
    source: Ints,
    stamp: Floats,
    step: float,
    ego: Floats,
    detected: Bools,
    places: Floats,
) -> None:
    """Sort detections by their true object and place them in the map, for the record only.

    Args:
        runs: (B,) runs to record.
        mask: (B, M) detections that are there.
        detections: (B, M, 7).
        source: (B, M) object behind each.
        stamp: (B,) time of the sample [s].
        step: Master clock [s].
        ego: (B, T, 7) recorded ego states, which hold the pose at the sample's time.
        detected: (B, M) out.
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
            x = detections[run, slot, DETECTION_X]
            y = detections[run, slot, DETECTION_Y]
            s, c = sin_cos(ego[run, row, EGO_HEADING])
            detected[run, thing] = True
            places[run, thing, 0] = ego[run, row, EGO_X] + c * x - s * y
            places[run, thing, 1] = ego[run, row, EGO_Y] + s * x + c * y
