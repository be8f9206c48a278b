"""One tick of perception: ego pose, tracks, and what of them goes into the command."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.jit import compiled, inlined
from adeye.signals import (
    DETECTION_COLUMNS,
    ESTIMATE_COLUMNS,
    IMU_COLUMNS,
    TRACK_COLUMNS,
    Bools,
    Floats,
    Ints,
    Measurement,
    Observation,
)
from adeye.simulate.channels.perception.localisation import Localiser
from adeye.simulate.channels.perception.pose import (
    POSE_REAR,
    POSE_WIDTH,
    clear_pose,
    has_pose,
    update_pose,
)
from adeye.simulate.channels.perception.tracking import (
    assumed_accuracy,
    drop_tentative,
    predict_tracks,
    update_tracks,
)
from adeye.simulate.channels.perception.tracks import (
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_STATE,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
    TRACKS,
    carried_by,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from adeye.ports import ChannelContext

# --- What a channel sees, laid out for its compiled step: the samples of all linked sensors -------

LEAST_SLOTS: Final = 4
"""Sensors that there is room for at least. A step is compiled for a number of slots, which is this
or the next power of two, so that a further sensor seldom costs a compilation."""

_BLIND: Final = frozenset({"localisation", "gnss", "imu"})

_FLOAT: Final = np.dtype(np.float64)
_BOOL: Final = np.dtype(np.bool_)


class Sight:
    """Shows the newest samples of the linked sensors, where they lie: nothing is copied.

    They are looked at during the tick only, because a sensor may write to its arrays at the next.

    Attributes:
        accuracy: (B, S, ACCURACY_WIDTH) what is assumed of the sensors that may detect something.
        mounts: (B, S, 2) x, y of these sensors in the vehicle frame [m].
        stamps: Time of the newest sample (B,) [s], -1 before the first; by sensor, and so are the
            next two. The slots beyond the S sensors are not to be read.
        masks: Which detections are there (B, M); M may differ.
        detections: (B, M, 7).
        alive: Whether each linked sensor delivers (B,), also one that detects nothing; true in the
            slots beyond.
        estimate: (B, 13) of the first linked sensor that gives one; without such a sensor, what the
            channel makes of its satellite receiver and inertial unit.
        estimate_stamp: (B,) its time [s]; -1 without any of them.
        places: (M, 2) scratch of the step, for the longest M.
        owner: (M,) scratch of the step.
    """

    def __init__(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Gives the linked sensors, their kinds, data sheets and mounts.
        """
        self._ids = tuple(link for link in context.links if link in context.sensors)
        # What knows the ego only has never seen anything, so nobody need look.
        self._seeing = tuple(name for name in self._ids if context.sensors[name] not in _BLIND)
        runs, sensors = context.runs, len(self._seeing)
        self.accuracy: Floats = assumed_accuracy(context, self._seeing)
        self.mounts: Floats = np.zeros((runs, sensors, 2))
        for index, name in enumerate(self._seeing):
            if name in context.mounts:
                self.mounts[:, index] = context.mounts[name][:, :2]
        self._slots = LEAST_SLOTS
        while self._slots < len(self._ids):
            self._slots *= 2
        self._nothing = (
            np.full(runs, -1.0),
            np.zeros((runs, 0), dtype=np.bool_),
            np.zeros((runs, 0, len(DETECTION_COLUMNS))),
        )
        self._all_alive: Bools = np.ones(runs, dtype=np.bool_)
        self.stamps: tuple[Floats, ...] = ()
        self.masks: tuple[Bools, ...] = ()
        self.detections: tuple[Floats, ...] = ()
        self.alive: tuple[Bools, ...] = ()
        self.places: Floats = np.zeros((0, 2))
        self.owner: Ints = np.zeros(0, dtype=np.int64)
        self.estimate: Floats = np.zeros((runs, len(ESTIMATE_COLUMNS)))
        self.estimate_stamp: Floats = np.full(runs, -1.0)
        self.localiser = Localiser.of(context)
        self._no_motion: Floats = np.zeros((runs, len(IMU_COLUMNS)))

    def take(self, measurements: Mapping[str, Measurement], time: float = math.nan) -> None:
        """Look at the measurements of a tick.

        Args:
            measurements: By sensor id.
            time: Of the tick [s]; a channel with a receiver and no inertial unit needs it.
        """
        stamp, mask, detections = self._nothing
        seen = [measurements[name] for name in self._seeing]
        spare = self._slots - len(seen)
        self.stamps = (*(_plain(item.stamp, _FLOAT) for item in seen), *[stamp] * spare)
        self.masks = (*(_plain(item.mask, _BOOL) for item in seen), *[mask] * spare)
        self.detections = (
            *(_plain(item.detections, _FLOAT) for item in seen),
            *[detections] * spare,
        )
        items = [measurements[name] for name in self._ids]
        self.alive = (
            *(_plain(item.alive, _BOOL) for item in items),
            *[self._all_alive] * (self._slots - len(items)),
        )
        size = max(rows.shape[1] for rows in self.masks)
        if size > self.owner.shape[0]:
            self.places, self.owner = np.zeros((size, 2)), np.zeros(size, dtype=np.int64)
        for item in items:
            if item.estimate is not None:
                self.estimate = _plain(item.estimate, _FLOAT)
                self.estimate_stamp = _plain(item.stamp, _FLOAT)
                return
        if self.localiser is not None:
            self._localise(self.localiser, measurements, time)

    def _localise(
        self, localiser: Localiser, measurements: Mapping[str, Measurement], time: float
    ) -> None:
        fix = measurements[localiser.gnss]
        if localiser.imu is None:
            sample, stamp = self._no_motion, np.full(self._no_motion.shape[0], time)
        else:
            unit = measurements[localiser.imu]
            sample, stamp = _plain(unit.values, _FLOAT), _plain(unit.stamp, _FLOAT)
        localiser.update(_plain(fix.values, _FLOAT), _plain(fix.stamp, _FLOAT), sample, stamp)
        self.estimate, self.estimate_stamp = localiser.estimate, localiser.stamp


def _plain(array: Any, kind: Any) -> Any:
    """Return an array of the one type that steps are compiled for, itself if it is one."""
    if array.dtype is kind and array.flags.carray:
        return array
    return np.array(array, dtype=kind, order="C")


# --- One tick of perception: ego pose, tracks, and what of them goes into the command -------------

BLOCK: Final = 64
"""Runs that go through a stage together. Neighbouring runs have nothing to do with each other, so
one waits for its divisions while the next is worked on, as long as a stage is short; and what a
block has touched is still near when the next stage wants it."""

# Columns of what is noted of a run from stage to stage.
(
    NOTE_END,  # all places from there on in its tracks are free; -1 without a pose
    NOTE_AGE,  # the time [s] over which the four columns after it tell how the ego has moved
    NOTE_MOTION,
) = range(3)
NOTE_WIDTH: Final = 6


class Perception:
    """What a channel knows of the ego and of the objects around it, from its linked sensors.

    Attributes:
        records: (B,) parameters, vehicle and road, see ``driving.channel_records``.
        segments: (B, R, 5) reference line of the road.
        running: (B,) runs that had not ended at the newest tick.
        pose: (B, POSE_WIDTH).
        tracks: (B, K, TRACK_STATE).
        notes: (B, NOTE_WIDTH), of which decisions read ``NOTE_END``.
        degraded: (B,) whether a linked sensor does not deliver.
        shown: (B, K, 6) confirmed tracks, see ``signals.TRACK_COLUMNS``; NaN rows are empty.
    """

    def __init__(self, context: ChannelContext, records: NDArray[np.void]) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Of the channel.
            records: (B,) see above; ``_perceive_block`` says what is read of them.
        """
        runs = context.runs
        self._sight = Sight(context)
        self._used = np.full(self._sight.mounts.shape[:2], -1.0)
        self.records = records
        self.segments: Floats = np.ascontiguousarray(context.road.segments)
        self.running: Bools = np.zeros(runs, dtype=np.bool_)
        self.pose: Floats = np.zeros((runs, POSE_WIDTH))
        self.pose[:, POSE_REAR] = [0.5 * vehicle.wheelbase for vehicle in context.vehicles]
        for row in self.pose:
            clear_pose(row)
        self.tracks: Floats = np.zeros((runs, TRACKS, TRACK_STATE))
        self.notes: Floats = np.zeros((runs, NOTE_WIDTH))
        self.degraded: Bools = np.zeros(runs, dtype=np.bool_)
        self.shown: Floats = np.full((runs, TRACKS, len(TRACK_COLUMNS)), np.nan)

    def update(self, observation: Observation) -> None:
        """Take in the measurements of a tick of the channel."""
        sight = self._sight
        sight.take(observation.measurements, observation.time)
        # A copy, because plug-ins are shown arrays that the compiler takes for another type.
        self.running = observation.running.copy()
        _perceive(
            self.records,
            observation.time,
            self.running,
            self.segments,
            sight.estimate,
            sight.estimate_stamp,
            sight.accuracy,
            sight.mounts,
            sight.stamps,
            sight.alive,
            sight.masks,
            sight.detections,
            self.pose,
            self.tracks,
            self._used,
            self.notes,
            self.degraded,
            self.shown,
            sight.places,
            sight.owner,
        )


@compiled
def _perceive(  # noqa: PLR0913, PLR0917 - a kernel
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
    degraded: Bools,
    shown: Floats,
    places: Floats,
    owner: Ints,
) -> None:
    for begin in range(0, records.shape[0], BLOCK):
        stop = min(begin + BLOCK, records.shape[0])
        _perceive_block(
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
            if running[run]:
                degraded[run] = _is_degraded(alive, run)
                _show_tracks(tracks[run], records[run]["confirm_hits"], shown[run])


@inlined
def _perceive_block(  # noqa: PLR0913, PLR0917 - a kernel
    begin: int,
    stop: int,
    records: Any,
    time: float,
    running: Bools,
    segments: Floats,
    estimate: Floats,
    estimate_stamp: Floats,
    accuracy: Floats,
    mounts: Floats,
    stamps: tuple[Floats, ...],
    masks: tuple[Bools, ...],
    detections: tuple[Floats, ...],
    pose: Floats,
    tracks: Floats,
    used: Floats,
    notes: Floats,
    places: Floats,
    owner: Ints,
) -> None:
    """Bring pose and tracks of a block of runs to the present tick, stage by stage.

    A sample is used once, whenever it arrives; a sensor that has dropped out shows its old stamp.

    Args:
        begin: First run.
        stop: Run behind the last.
        records: (B,) with ``period``: since the previous call [s], ``coast``: how long a confirmed
            track lives without a detection [s], ``gate``: largest distance between a track and its
            detection [m], ``behind``: how far behind the ego a track may begin [m],
            ``confirm_hits``: detections that confirm a track, ``confirm_window``: samples among
            which these must be, 0 for any.
        time: [s].
        running: (B,) runs that have not ended; the others are left alone.
        segments: (B, K, 5) reference line of the road.
        estimate: (B, 13) newest ego estimate.
        estimate_stamp: (B,) its time [s], -1 before the first.
        accuracy: (B, S, ACCURACY_WIDTH) what is assumed of each sensor.
        mounts: (B, S, 2) x, y [m].
        stamps: Time of each sensor's newest sample (B,) [s], see ``sight.Sight``.
        masks: Which detections are in it (B, M).
        detections: (B, M, 7).
        pose: (B, POSE_WIDTH) in and out.
        tracks: (B, K, TRACK_STATE) in and out.
        used: (B, S) stamp of each sensor's newest sample that was used [s]; in and out.
        notes: (B, NOTE_WIDTH) out.
        places: (M, 2) scratch.
        owner: (M,) scratch.
    """
    for run in range(begin, stop):
        if running[run]:
            update_pose(
                pose[run],
                segments[run],
                estimate[run],
                estimate_stamp[run],
                time,
                records[run]["period"],
            )
    for run in range(begin, stop):
        if running[run]:
            _predict(records[run], time, pose[run], tracks[run], notes[run])
    for sensor in range(mounts.shape[1]):
        stamp, mask, rows = stamps[sensor], masks[sensor], detections[sensor]
        for run in range(begin, stop):
            if running[run] and notes[run, NOTE_END] >= 0.0 and stamp[run] > used[run, sensor]:
                used[run, sensor] = stamp[run]
                _update(
                    records[run],
                    time,
                    sensor,
                    accuracy[run, sensor],
                    mounts[run, sensor],
                    stamp[run],
                    mask[run],
                    rows[run],
                    pose[run],
                    tracks[run],
                    notes[run],
                    places,
                    owner,
                )
    for run in range(begin, stop):
        if running[run]:
            end = int(notes[run, NOTE_END])
            drop_tentative(tracks[run], end, time, records[run]["confirm_hits"])


@inlined
def _predict(record: Any, time: float, pose: Floats, tracks: Floats, note: Floats) -> None:
    """Carry the tracks of one run on, or forget them where the ego does not know its own motion."""
    if not has_pose(pose, time):
        # Every standing object would seem to move.
        for row in range(tracks.shape[0]):
            tracks[row, TRACK_HITS] = 0.0
        note[NOTE_END] = -1.0
        return
    period = record["period"]
    motion = carried_by(pose, period)
    _note_motion(note, period, motion)
    note[NOTE_END] = predict_tracks(tracks, pose, motion, time, period, record["coast"])


@inlined
def _note_motion(note: Floats, age: float, motion: tuple[float, float, float, float]) -> None:
    note[NOTE_AGE] = age
    note[NOTE_MOTION], note[NOTE_MOTION + 1] = motion[0], motion[1]
    note[NOTE_MOTION + 2], note[NOTE_MOTION + 3] = motion[2], motion[3]


@inlined
def _update(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    time: float,
    sensor: int,
    accuracy: Floats,
    mount: Floats,
    stamp: float,
    mask: Bools,
    detections: Floats,
    pose: Floats,
    tracks: Floats,
    note: Floats,
    places: Floats,
    owner: Ints,
) -> None:
    """Update the tracks of one run with a new sample of one sensor."""
    age = time - stamp
    # Many a sensor is as late as the one before, so the way since then is the same.
    if age != note[NOTE_AGE]:
        _note_motion(note, age, carried_by(pose, age))
    note[NOTE_END] = update_tracks(
        tracks,
        int(note[NOTE_END]),
        pose,
        (
            note[NOTE_MOTION],
            note[NOTE_MOTION + 1],
            note[NOTE_MOTION + 2],
            note[NOTE_MOTION + 3],
        ),
        accuracy,
        mount[0],
        mount[1],
        mask,
        detections,
        stamp,
        age,
        record["gate"],
        (record["confirm_hits"], record["confirm_window"], float(sensor)),
        places,
        owner,
        record["behind"],
    )


@inlined
def _is_degraded(alive: tuple[Bools, ...], run: int) -> bool:
    """Tell whether a linked sensor does not deliver.

    Args:
        alive: Whether each delivers (B,), see ``sight.Sight``.
        run: Which row is meant.
    """
    for sensor in range(len(alive)):  # noqa: SIM110 - a kernel
        if not alive[sensor][run]:
            return True
    return False


@compiled
def _show_tracks(tracks: Floats, confirm_hits: float, shown: Floats) -> None:
    """Write the confirmed tracks for the command; the other rows are NaN.

    Args:
        tracks: (K, TRACK_STATE).
        confirm_hits: Detections that confirm a track.
        shown: (K, 6) in and out, see ``signals.TRACK_COLUMNS``: what was shown before, at first
            NaN.
    """
    for row in range(tracks.shape[0]):
        track, out = tracks[row], shown[row]
        if track[TRACK_HITS] >= confirm_hits:
            out[0], out[1], out[2] = track[TRACK_X], track[TRACK_Y], track[TRACK_VX]
            out[3], out[4], out[5] = track[TRACK_VY], track[TRACK_LENGTH], track[TRACK_WIDTH]
        elif not np.isnan(out[0]):
            # Most rows are empty, and were so at the tick before.
            out[:] = np.nan
