"""One tick of perception: ego pose, tracks, and what of them goes into the command."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye import signals
from adeye.kernel.jit import compiled, inlined
from adeye.signals import Bools, Floats, Ints, Measurement, Observation
from adeye.simulate.channels.perception import tracking
from adeye.simulate.channels.perception import tracks as columns
from adeye.simulate.channels.perception.localisation import Localiser
from adeye.simulate.channels.perception.pose import (
    first_poses,
    has_pose,
    update_pose,
)
from adeye.simulate.channels.perception.tracking import Sample
from adeye.simulate.channels.perception.tracks import TRACKS, carried_by

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.kernel.road import Grounds
    from adeye.ports import ChannelContext

# --- What a channel sees, laid out for its compiled step: the samples of all linked sensors -------

LEAST_SLOTS: Final = 4
"""Sensors that there is room for at least. A step is compiled for a number of slots, which is this
or the next power of two, so that a further sensor seldom costs a compilation."""

_BLIND: Final = frozenset({"localisation", "gnss", "imu"})

_FLOAT: Final = np.dtype(np.float64)
_BOOL: Final = np.dtype(np.bool_)


class Samples(NamedTuple):
    """The newest samples of the linked sensors, where they lie: nothing is copied.

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

    accuracy: Floats
    mounts: Floats
    stamps: tuple[Floats, ...]
    masks: tuple[Bools, ...]
    detections: tuple[Floats, ...]
    alive: tuple[Bools, ...]
    estimate: Floats
    estimate_stamp: Floats
    places: Floats
    owner: Ints


class Sight:
    """Shows the newest samples of the linked sensors."""

    def __init__(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Gives the linked sensors, their kinds, data sheets and mounts.
        """
        self._ids = tuple(link for link in context.links if link in context.sensors)
        # What knows the ego only has never seen anything, so nobody need look.
        self._seeing = tuple(name for name in self._ids if context.sensors[name] not in _BLIND)
        runs, sensors = context.runs, len(self._seeing)
        self.accuracy: Floats = tracking.assumed_accuracy(context, self._seeing)
        self.mounts: Floats = np.zeros((runs, sensors, 2))
        for index, name in enumerate(self._seeing):
            if name in context.mounts:
                self.mounts[:, index] = context.mounts[name][:, :2]
        self._slots = LEAST_SLOTS
        while self._slots < len(self._ids):
            self._slots *= 2
        self._no_stamp: Floats = np.full(runs, -1.0)
        self._nothing = (
            self._no_stamp,
            np.zeros((runs, 0), dtype=np.bool_),
            np.zeros((runs, 0, len(signals.DETECTION_COLUMNS))),
        )
        self._all_alive: Bools = np.ones(runs, dtype=np.bool_)
        self._places: Floats = np.zeros((0, 2))
        self._owner: Ints = np.zeros(0, dtype=np.int64)
        self._no_estimate: Floats = np.zeros((runs, len(signals.ESTIMATE_COLUMNS)))
        self.localiser = Localiser.of(context)
        self._no_motion: Floats = np.zeros((runs, len(signals.IMU_COLUMNS)))

    def take(self, measurements: Mapping[str, Measurement], time: float = math.nan) -> Samples:
        """Look at the measurements of a tick.

        Args:
            measurements: By sensor id.
            time: Of the tick [s]; a channel with a receiver and no inertial unit needs it.
        """
        seen = [measurements[name] for name in self._seeing]
        rows = [
            (_plain(item.stamp, _FLOAT), _plain(item.mask, _BOOL), _plain(item.detections, _FLOAT))
            for item in seen
        ]
        stamps, masks, detections = zip(
            *rows, *[self._nothing] * (self._slots - len(seen)), strict=True
        )
        items = [measurements[name] for name in self._ids]
        alive = [_plain(item.alive, _BOOL) for item in items]
        size = max(mask.shape[1] for mask in masks)
        if size > self._owner.shape[0]:
            self._places, self._owner = np.zeros((size, 2)), np.zeros(size, dtype=np.int64)
        estimate, estimate_stamp = self._estimate(items, measurements, time)
        return Samples(
            self.accuracy,
            self.mounts,
            stamps,
            masks,
            detections,
            (*alive, *[self._all_alive] * (self._slots - len(items))),
            estimate,
            estimate_stamp,
            self._places,
            self._owner,
        )

    def _estimate(
        self, items: Sequence[Measurement], measurements: Mapping[str, Measurement], time: float
    ) -> tuple[Floats, Floats]:
        for item in items:
            if item.estimate is not None:
                return _plain(item.estimate, _FLOAT), _plain(item.stamp, _FLOAT)
        localiser = self.localiser
        if localiser is None:
            return self._no_estimate, self._no_stamp
        fix = measurements[localiser.gnss]
        if localiser.imu is None:
            sample, stamp = self._no_motion, np.full(self._no_motion.shape[0], time)
        else:
            unit = measurements[localiser.imu]
            sample, stamp = _plain(unit.values, _FLOAT), _plain(unit.stamp, _FLOAT)
        localiser.update(_plain(fix.values, _FLOAT), _plain(fix.stamp, _FLOAT), sample, stamp)
        return localiser.estimate, localiser.stamp


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


class Seen(NamedTuple):
    """What a channel knows of the ego and of the objects around it, run by run.

    Attributes:
        records: (B,) parameters and vehicle, see ``driving.channel_records``.
        grounds: The roads.
        running: (B,) runs that had not ended at the newest tick; the others are left alone.
        pose: (B, POSE_WIDTH).
        tracks: (B, K, TRACK_STATE).
        notes: (B, NOTE_WIDTH), of which decisions read ``NOTE_END``.
        degraded: (B,) whether a linked sensor does not deliver.
        shown: (B, K, 6) confirmed tracks, see ``signals.TRACK_COLUMNS``; NaN rows are empty.
    """

    records: Any
    grounds: Grounds
    running: Bools
    pose: Floats
    tracks: Floats
    notes: Floats
    degraded: Bools
    shown: Floats


class Perception:
    """Makes what a channel knows from its linked sensors.

    Attributes:
        seen: What it knows; the arrays stay the same.
    """

    def __init__(self, context: ChannelContext, records: NDArray[np.void]) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Of the channel.
            records: (B,) see ``driving.channel_records``, with ``period``: since the previous call
                [s], ``coast``: how long a confirmed track lives without a detection [s], ``gate``:
                largest distance between a track and its detection [m], ``behind``: how far behind
                the ego a track may begin [m], ``confirm_hits``: detections that confirm a track,
                ``confirm_window``: samples among which these must be, 0 for any.
        """
        runs = context.runs
        self._sight = Sight(context)
        self._used = np.full(self._sight.mounts.shape[:2], -1.0)
        self.seen = Seen(
            records=records,
            grounds=context.road.grounds(),
            running=np.zeros(runs, dtype=np.bool_),
            pose=first_poses(context.vehicles),
            tracks=np.zeros((runs, TRACKS, columns.TRACK_STATE)),
            notes=np.zeros((runs, NOTE_WIDTH)),
            degraded=np.zeros(runs, dtype=np.bool_),
            shown=np.full((runs, TRACKS, len(signals.TRACK_COLUMNS)), np.nan),
        )

    def update(self, observation: Observation) -> None:
        """Take in the measurements of a tick of the channel."""
        samples = self._sight.take(observation.measurements, observation.time)
        # A copy, because a channel keeps what it was shown, whatever becomes of the array.
        self.seen.running[:] = observation.running
        _perceive(self.seen, samples, self._used, observation.time)


@compiled
def _perceive(seen: Seen, samples: Samples, used: Floats, time: float) -> None:
    for begin in range(0, seen.records.shape[0], BLOCK):
        stop = min(begin + BLOCK, seen.records.shape[0])
        _perceive_block(begin, stop, seen, samples, used, time)
        for run in range(begin, stop):
            if seen.running[run]:
                seen.degraded[run] = _is_degraded(samples.alive, run)
                _show_tracks(seen.tracks[run], seen.records[run]["confirm_hits"], seen.shown[run])


@inlined
def _perceive_block(
    begin: int, stop: int, seen: Seen, samples: Samples, used: Floats, time: float
) -> None:
    """Bring pose and tracks of a block of runs to the present tick, stage by stage.

    A sample is used once, whenever it arrives; a sensor that has dropped out shows its old stamp.

    Args:
        begin: First run.
        stop: Run behind the last.
        seen: In and out.
        samples: Newest ones.
        used: (B, S) stamp of each sensor's newest sample that was used [s]; in and out.
        time: [s].
    """
    records, running, pose = seen.records, seen.running, seen.pose
    tracks, notes = seen.tracks, seen.notes
    for run in range(begin, stop):
        if running[run]:
            update_pose(
                pose[run],
                seen.grounds.segments[run],
                samples.estimate[run],
                samples.estimate_stamp[run],
                time,
                records[run]["period"],
            )
    for run in range(begin, stop):
        if running[run]:
            _predict(records[run], time, pose[run], tracks[run], notes[run])
    for sensor in range(samples.mounts.shape[1]):
        stamp = samples.stamps[sensor]
        mask, rows = samples.masks[sensor], samples.detections[sensor]
        for run in range(begin, stop):
            if running[run] and notes[run, NOTE_END] >= 0.0 and stamp[run] > used[run, sensor]:
                used[run, sensor] = stamp[run]
                sample = Sample(
                    samples.accuracy[run, sensor],
                    samples.mounts[run, sensor],
                    stamp[run],
                    time - stamp[run],
                    mask[run],
                    rows[run],
                    samples.places,
                    samples.owner,
                )
                _update(records[run], sensor, sample, pose[run], tracks[run], notes[run])
    for run in range(begin, stop):
        if running[run]:
            end = int(notes[run, NOTE_END])
            tracking.drop_tentative(tracks[run], end, time, records[run]["confirm_hits"])


@inlined
def _predict(record: Any, time: float, pose: Floats, tracks: Floats, note: Floats) -> None:
    """Carry the tracks of one run on, or forget them where the ego does not know its own motion."""
    if not has_pose(pose, time):
        # Every standing object would seem to move.
        for row in range(tracks.shape[0]):
            tracks[row, columns.TRACK_HITS] = 0.0
        note[NOTE_END] = -1.0
        return
    period = record["period"]
    motion = carried_by(pose, period)
    _note_motion(note, period, motion)
    note[NOTE_END] = tracking.predict_tracks(tracks, pose, motion, time, period, record["coast"])


@inlined
def _note_motion(note: Floats, age: float, motion: tuple[float, float, float, float]) -> None:
    note[NOTE_AGE] = age
    note[NOTE_MOTION], note[NOTE_MOTION + 1] = motion[0], motion[1]
    note[NOTE_MOTION + 2], note[NOTE_MOTION + 3] = motion[2], motion[3]


@inlined
def _update(
    record: Any, sensor: int, sample: Sample, pose: Floats, tracks: Floats, note: Floats
) -> None:
    """Update the tracks of one run with a new sample of one sensor."""
    # Many a sensor is as late as the one before, so the way since then is the same.
    if sample.age != note[NOTE_AGE]:
        _note_motion(note, sample.age, carried_by(pose, sample.age))
    note[NOTE_END] = tracking.update_tracks(
        tracks,
        int(note[NOTE_END]),
        pose,
        (
            note[NOTE_MOTION],
            note[NOTE_MOTION + 1],
            note[NOTE_MOTION + 2],
            note[NOTE_MOTION + 3],
        ),
        sample,
        record["gate"],
        (record["confirm_hits"], record["confirm_window"], float(sensor)),
        record["behind"],
    )


@inlined
def _is_degraded(alive: tuple[Bools, ...], run: int) -> bool:
    """Tell whether a linked sensor does not deliver.

    Args:
        alive: Whether each delivers (B,), see ``Samples``.
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
        if track[columns.TRACK_HITS] >= confirm_hits:
            out[0], out[1], out[2] = (
                track[columns.TRACK_X],
                track[columns.TRACK_Y],
                track[columns.TRACK_VX],
            )
            out[3], out[4], out[5] = (
                track[columns.TRACK_VY],
                track[columns.TRACK_LENGTH],
                track[columns.TRACK_WIDTH],
            )
        elif not np.isnan(out[0]):
            # Most rows are empty, and were so at the tick before.
            out[:] = np.nan
