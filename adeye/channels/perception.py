"""One tick of perception of one run: ego pose, tracks, and what of them goes into the command."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.channels.pose import has_pose, update_pose
from adeye.channels.tracking import drop_tentative, predict_tracks, update_tracks
from adeye.channels.tracks import (
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
    carried_by,
)
from adeye.kernel.jit import compiled, inlined

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints

SHOWN: Final = (TRACK_X, TRACK_Y, TRACK_VX, TRACK_VY, TRACK_LENGTH, TRACK_WIDTH)
"""Columns of a track that a command shows, in the order of ``signals.TRACK_COLUMNS``."""


@inlined
def perceive(  # noqa: PLR0913, PLR0917 - a kernel
    time: float,
    period: float,
    coast: float,
    gate: float,
    confirm_hits: float,
    segments: Floats,
    estimate: Floats,
    estimate_stamp: float,
    kinds: Ints,
    mounts: Floats,
    run: int,
    stamps: tuple[Floats, ...],
    masks: tuple[Bools, ...],
    detections: tuple[Floats, ...],
    pose: Floats,
    tracks: Floats,
    used: Floats,
    places: Floats,
    owner: Ints,
) -> int:
    """Bring pose and tracks of one run to the present tick.

    A sample is used once, whenever it arrives; a sensor that has dropped out shows its old stamp.

    Args:
        time: [s].
        period: Since the previous call [s].
        coast: How long a confirmed track lives without a detection [s].
        gate: Largest distance between a track and its detection [m].
        confirm_hits: Detections that confirm a track.
        segments: (K, 5) reference line of the road.
        estimate: (13,) newest ego estimate.
        estimate_stamp: Its time [s], -1 before the first.
        kinds: (S,) index into ``SENSOR_KINDS``.
        mounts: (S, 2) x, y [m].
        run: Which row of the samples is meant.
        stamps: Time of each sensor's newest sample (B,) [s], see ``sight.Sight``.
        masks: Which detections are in it (B, M).
        detections: (B, M, 7).
        pose: (POSE_WIDTH,) in and out.
        tracks: (K, TRACK_STATE) in and out.
        used: (S,) stamp of each sensor's newest sample that was used [s]; in and out.
        places: (M, 2) scratch.
        owner: (M,) scratch.

    Returns:
        The end of the tracks: all places from there on are free.
    """
    update_pose(pose, segments, estimate, estimate_stamp, time, period)
    if not has_pose(pose, time):
        # Without its own motion every standing object would seem to move.
        for row in range(tracks.shape[0]):
            tracks[row, TRACK_HITS] = 0.0
        return 0
    # Many a sensor is as late as the one before, so the way since then is the same.
    age = period
    motion = carried_by(pose, age)
    end = predict_tracks(tracks, pose, motion, time, period, coast)
    for sensor in range(kinds.shape[0]):
        stamp = stamps[sensor][run]
        if not stamp > used[sensor]:
            continue
        used[sensor] = stamp
        if time - stamp != age:
            age = time - stamp
            motion = carried_by(pose, age)
        end = update_tracks(
            tracks,
            end,
            pose,
            motion,
            kinds[sensor],
            mounts[sensor, 0],
            mounts[sensor, 1],
            masks[sensor][run],
            detections[sensor][run],
            stamp,
            age,
            gate,
            places,
            owner,
        )
    drop_tentative(tracks, end, time, confirm_hits)
    return end


@inlined
def is_degraded(alive: tuple[Bools, ...], sensors: int, run: int) -> bool:
    """Tell whether a linked sensor does not deliver.

    Args:
        alive: Whether each delivers (B,), see ``sight.Sight``.
        sensors: How many are linked.
        run: Which row is meant.
    """
    for sensor in range(sensors):  # noqa: SIM110 - a kernel
        if not alive[sensor][run]:
            return True
    return False


@compiled
def show_tracks(tracks: Floats, confirm_hits: float, shown: Floats) -> None:
    """Write the confirmed tracks for the command; the other rows are NaN.

    Args:
        tracks: (K, TRACK_STATE).
        confirm_hits: Detections that confirm a track.
        shown: (K, 6) out, see ``signals.TRACK_COLUMNS``.
    """
    for row in range(tracks.shape[0]):
        for column in range(6):
            confirmed = tracks[row, TRACK_HITS] >= confirm_hits
            shown[row, column] = tracks[row, SHOWN[column]] if confirmed else np.nan
