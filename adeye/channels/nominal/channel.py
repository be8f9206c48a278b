"""The built-in nominal channel on the batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.channels.corridor import PATH_WIDTH
from adeye.channels.driving import channel_records
from adeye.channels.nominal.planning import MEMORY_PATH, MEMORY_WIDTH, nominal_step
from adeye.channels.perception import (
    BLOCK,
    NOTE_END,
    NOTE_WIDTH,
    is_degraded,
    perceive,
    show_tracks,
)
from adeye.channels.pose import POSE_WIDTH, clear_pose
from adeye.channels.sight import Sight
from adeye.channels.tracks import TRACK_STATE, TRACKS
from adeye.kernel.jit import compiled
from adeye.signals import (
    DEGRADED,
    FAULT,
    OK,
    TRACK_COLUMNS,
    Bools,
    ControlCommand,
    Floats,
    Ints,
    Observation,
    spec_columns,
)
from adeye.spec.channels import NominalParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext


class NominalChannel:
    """Drives along its lane on what its linked sensors see, follows, and brakes in an emergency.

    It sees measurements only. Without a recent ego estimate its state is FAULT, with a linked
    sensor that does not deliver it is DEGRADED.
    """

    monitor_ids: tuple[str, ...] = ()

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs = context.runs
        names = tuple(NominalParameters.model_fields)
        fields = spec_columns(
            context.parameters, lambda item: {name: float(getattr(item, name)) for name in names}
        )
        self._channel_id = context.channel_id
        self._records = channel_records(context, fields)
        self._segments = np.ascontiguousarray(context.road.segments)
        self._sight = Sight(context)
        self._pose = np.zeros((runs, POSE_WIDTH))
        for row in self._pose:
            clear_pose(row)
        self._tracks = np.zeros((runs, TRACKS, TRACK_STATE))
        self._used = np.full(self._sight.mounts.shape[:2], -1.0)
        self._notes = np.zeros((runs, NOTE_WIDTH))
        self._memory = np.zeros((runs, MEMORY_WIDTH))
        self._memory[:, MEMORY_PATH] = np.nan
        self._command = np.zeros((runs, 2))
        self._status = np.full(runs, FAULT, dtype=np.int64)
        self._path = np.zeros(PATH_WIDTH)
        self._shown = np.full((runs, TRACKS, len(TRACK_COLUMNS)), np.nan)

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation with one command per run."""
        sight = self._sight
        sight.take(observation.measurements, observation.time)
        _act(
            self._records,
            observation.time,
            # A copy, because plug-ins are shown arrays that the compiler takes for another type.
            observation.running.copy(),
            self._segments,
            sight.estimate,
            sight.estimate_stamp,
            sight.accuracy,
            sight.mounts,
            sight.stamps,
            sight.alive,
            sight.masks,
            sight.detections,
            self._pose,
            self._tracks,
            self._used,
            self._notes,
            self._memory,
            self._command,
            self._status,
            self._shown,
            sight.places,
            sight.owner,
            self._path,
        )
        return ControlCommand(
            self._channel_id,
            self._command[:, 0].copy(),
            self._command[:, 1].copy(),
            np.full(self._status.shape, observation.time),
            self._status.copy(),
            tracks=self._shown.copy(),
        )


@compiled
def _act(  # noqa: PLR0913, PLR0917 - a kernel
    records: Any,
    time: float,
    running: Bools,
    segments: Floats,
    estimate: Floats,
    estimate_stamp: Floats,
    accuracy: Floats,
    mounts: Floats,
    stamps: tuple[Floats, ...],
    alive: tuple[Bools, ...],
    masks: tuple[Bools, ...],
    detections: tuple[Floats, ...],
    pose: Floats,
    tracks: Floats,
    used: Floats,
    notes: Floats,
    memory: Floats,
    command: Floats,
    status: Ints,
    shown: Floats,
    places: Floats,
    owner: Ints,
    path: Floats,
) -> None:
    for begin in range(0, records.shape[0], BLOCK):
        stop = min(begin + BLOCK, records.shape[0])
        perceive(
            begin,
            stop,
            records,
            time,
            running,
            segments,
            estimate,
            estimate_stamp,
            accuracy,
            mounts,
            stamps,
            masks,
            detections,
            pose,
            tracks,
            used,
            notes,
            places,
            owner,
        )
        for run in range(begin, stop):
            if not running[run]:
                continue
            state = nominal_step(
                records[run],
                time,
                segments[run],
                int(notes[run, NOTE_END]),
                pose[run],
                tracks[run],
                memory[run],
                command[run],
                path,
            )
            if state == OK and is_degraded(alive, run):
                state = DEGRADED
            status[run] = state
            show_tracks(tracks[run], records[run]["confirm_hits"], shown[run])
