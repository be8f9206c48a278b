"""From detections of several sensors to tracks: association, filter, confirmation, coasting.

Tracks live in the vehicle frame of the channel's tick, with velocities relative to the ground. Each
axis has a filter of its own for place and velocity; coupling between the axes is left out, which
is exact straight ahead, where it matters. A sample is old when it arrives: a track is compared
with it at the sample's time, from where the ego has been carried on since.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from adeye.channels.pose import POSE_ACCELERATION, POSE_SPEED
from adeye.channels.tracks import (
    TRACK_BRAKING,
    TRACK_CLASS,
    TRACK_COV_X,
    TRACK_COV_Y,
    TRACK_HITS,
    TRACK_LAST_VX,
    TRACK_LENGTH,
    TRACK_SEEN,
    TRACK_VAR_VX,
    TRACK_VAR_VY,
    TRACK_VAR_X,
    TRACK_VAR_Y,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
    associate,
    carried_by,
    carry_by,
    free_place,
)
from adeye.kernel.jit import inlined
from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    Bools,
    Floats,
    Ints,
)

SENSOR_KINDS: Final = ("ground_truth", "lidar", "radar", "camera")
"""Kinds that have a row in the table of assumed noise; every other sensor takes the camera's."""

# Standard deviations that a channel assumes; sensors do not tell it theirs. Along the line of
# sight: constant [m], growth with the distance squared [1/m]; across: constant [m], growth with
# the distance; of the range rate [m/s]. Our choice, of the order of data sheets: a camera's
# distance error grows with the square (stereo and size alike), radar is sharp in range and rate.
_NOISE: Final = np.array(
    [
        [0.02, 0.0, 0.02, 0.0, 0.05],
        [0.15, 0.0, 0.10, 0.002, 0.0],
        [0.50, 0.0, 0.20, 0.010, 0.25],
        [0.30, 3e-4, 0.10, 0.003, 0.0],
    ]
)
_FREEDOM_X: Final = 10.0
_FREEDOM_Y: Final = 0.5
"""Spectral density of the unknown acceleration of a track [m²/s³]: within one second its velocity
changes by 3.2 m/s along and 0.7 m/s across with one standard deviation, hard braking and quick
lane changes by two to three of them. Our choice."""

_PRIOR_VX: Final = 15.0
_PRIOR_VY: Final = 5.0
"""Standard deviation of the velocity of a new track, whose mean is standing [m/s]. Our choice."""

_NEAR: Final = 8.0
_NEAR_ASIDE: Final = 2.5
_SLOW: Final = 3.0
"""Where a track outlives coasting: centre ahead and aside [m], ego speed [m/s]. Our choice: at 8 m
to its centre the rear of a car of 2 m reaches 16 degrees to each side of a sensor in the grille."""

_SURE_SPEED: Final = 1.0
"""Variance of the speed from which its change is an acceleration, not noise [m²/s²]: ground truth
and radar get there, a camera alone does not. Our choice."""

_SMOOTHING: Final = 0.3
"""Time constant of the smoothed acceleration [s]. Our choice: a brake needs about that long."""

_PRIOR_PLACE: Final = 100.0
"""Standard deviation of its place before its first detection [m]: nothing is known."""

_TENTATIVE: Final = 0.25
"""How long a track that is not confirmed lives without a detection [s]: two missed samples at
10 Hz."""


@inlined
def predict_tracks(tracks: Floats, pose: Floats, time: float, period: float, coast: float) -> None:
    """Carry tracks on by one tick and free those that have not been seen for too long.

    One close ahead of a slow ego is kept: it may have come too near to be seen.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        pose: (POSE_WIDTH,) of the ego now.
        time: Now [s].
        period: Since the previous call [s].
        coast: How long a confirmed track lives without a detection [s].
    """
    motion = carried_by(pose, period)
    sine, cosine = motion[2], motion[3]
    for row in range(tracks.shape[0]):
        if tracks[row, TRACK_HITS] <= 0.0:
            continue
        track = tracks[row]
        track[TRACK_X], track[TRACK_Y] = carry_by(
            motion,
            track[TRACK_X] + period * track[TRACK_VX],
            track[TRACK_Y] + period * track[TRACK_VY],
        )
        _smooth_braking(track, period)
        vx, vy = track[TRACK_VX], track[TRACK_VY]
        track[TRACK_VX] = cosine * vx + sine * vy
        track[TRACK_VY] = -sine * vx + cosine * vy
        track[TRACK_LAST_VX] = track[TRACK_VX]
        _grow(track, TRACK_VAR_X, period, _FREEDOM_X)
        _grow(track, TRACK_VAR_Y, period, _FREEDOM_Y)
        if time - track[TRACK_SEEN] > coast + 1e-9:
            if _is_hidden_near(track, pose):
                track[TRACK_VX] = track[TRACK_VY] = 0.0
                track[TRACK_COV_X] = track[TRACK_COV_Y] = 0.0
                track[TRACK_VAR_VX] = track[TRACK_VAR_VY] = 1.0
            else:
                track[TRACK_HITS] = 0.0


@inlined
def _smooth_braking(track: Floats, period: float) -> None:
    """Take the change of speed since the previous tick into the smoothed acceleration."""
    if track[TRACK_VAR_VX] > _SURE_SPEED:
        track[TRACK_BRAKING] = 0.0
        return
    change = (track[TRACK_VX] - track[TRACK_LAST_VX]) / period
    share = period / (period + _SMOOTHING)
    track[TRACK_BRAKING] += share * (change - track[TRACK_BRAKING])


@inlined
def _is_hidden_near(track: Floats, pose: Floats) -> bool:
    """Tell whether an object may be there although no sensor sees it: close ahead of a slow ego.

    What is that near fills more than the field of view; such a track is taken to stand.
    """
    is_near = 0.0 < track[TRACK_X] < _NEAR and abs(track[TRACK_Y]) < _NEAR_ASIDE
    return bool(is_near and pose[POSE_SPEED] < _SLOW)


@inlined
def _grow(track: Floats, column: int, period: float, freedom: float) -> None:
    """Let the uncertainty of one axis grow over a period (white acceleration)."""
    var, cov, rate = track[column], track[column + 1], track[column + 2]
    track[column] = var + period * (2.0 * cov + period * (rate + period * freedom / 3.0))
    track[column + 1] = cov + period * (rate + 0.5 * period * freedom)
    track[column + 2] = rate + period * freedom


@inlined
def drop_tentative(tracks: Floats, time: float, confirm_hits: float) -> None:
    """Free tracks that are not confirmed and have not been seen lately.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        time: Now [s].
        confirm_hits: Detections that confirm a track.
    """
    for row in range(tracks.shape[0]):
        unseen = time - tracks[row, TRACK_SEEN] > _TENTATIVE + 1e-9
        if 0.0 < tracks[row, TRACK_HITS] < confirm_hits and unseen:
            tracks[row, TRACK_HITS] = 0.0


@inlined
def update_tracks(  # noqa: PLR0913, PLR0917 - a kernel
    tracks: Floats,
    pose: Floats,
    kind: int,
    mount_x: float,
    mount_y: float,
    mask: Bools,
    detections: Floats,
    stamp: float,
    age: float,
    gate: float,
    places: Floats,
    owner: Ints,
) -> None:
    """Update tracks with one new sample of one sensor, and begin tracks for what fits none.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        pose: (POSE_WIDTH,) of the ego now.
        kind: Index into ``SENSOR_KINDS``.
        mount_x: Of the sensor in the vehicle frame [m].
        mount_y: [m].
        mask: (M,) which detections are there.
        detections: (M, 7) in the vehicle frame of the sample's time.
        stamp: Time of the sample [s].
        age: Time since the sample [s].
        gate: Largest distance between a track and its detection [m].
        places: (M, 2) scratch.
        owner: (M,) scratch.
    """
    motion = carried_by(pose, age)
    count = 0
    for row in range(detections.shape[0]):
        owner[row] = -1
        if mask[row]:
            count = row + 1
            places[row, 0], places[row, 1] = carry_by(
                motion, detections[row, DETECTION_X], detections[row, DETECTION_Y]
            )
    if count == 0:
        return
    mount_x, mount_y = carry_by(motion, mount_x, mount_y)
    associate(tracks, mask, detections, places, owner, age, gate)
    for row in range(count):
        if not mask[row] or not np.isfinite(places[row, 0] + places[row, 1]):
            continue
        if owner[row] >= 0:
            track = tracks[owner[row]]
            _correct(track, detections[row], places[row], mount_x, mount_y, pose, kind, age)
        else:
            place = free_place(tracks, places[row])
            if place >= 0:
                track = tracks[place]
                _begin(track, detections[row], places[row], mount_x, mount_y, pose, kind, age)
                owner[row] = place
        if owner[row] >= 0:
            # When it arrived, not when it was made: a late sensor has not lost the object.
            tracks[owner[row], TRACK_SEEN] = stamp + age


@inlined
def _noise(kind: int, dx: float, dy: float, distance: float) -> tuple[float, float, float]:
    """Return the assumed variance of a detection along x, along y and of its range rate."""
    along = _NOISE[kind, 0] + _NOISE[kind, 1] * distance * distance
    across = _NOISE[kind, 2] + _NOISE[kind, 3] * distance
    if distance > 0.0:
        dx, dy = dx / distance, dy / distance
    else:
        dx, dy = 1.0, 0.0
    along, across = along * along, across * across
    rate = _NOISE[kind, 4]
    return (
        dx * dx * along + dy * dy * across,
        dy * dy * along + dx * dx * across,
        max(rate * rate, 0.05 * 0.05),
    )


@inlined
def _correct(  # noqa: PLR0913, PLR0917 - a kernel
    track: Floats,
    detection: Floats,
    place: Floats,
    mount_x: float,
    mount_y: float,
    pose: Floats,
    kind: int,
    age: float,
) -> None:
    dx, dy = place[0] - mount_x, place[1] - mount_y
    distance = math.sqrt(dx * dx + dy * dy)
    noise_x, noise_y, noise_rate = _noise(kind, dx, dy, distance)
    _correct_axis(track, TRACK_X, TRACK_VX, TRACK_VAR_X, place[0], noise_x, age)
    _correct_axis(track, TRACK_Y, TRACK_VY, TRACK_VAR_Y, place[1], noise_y, age)
    if detection[DETECTION_HAS_RANGE_RATE] > 0.0 and distance > 0.0:
        ux, uy = dx / distance, dy / distance
        rate = detection[DETECTION_RANGE_RATE] + ux * _speed_at(pose, age)
        _correct_rate(track, ux, uy, rate, noise_rate)
    track[TRACK_LENGTH] = detection[DETECTION_LENGTH]
    track[TRACK_WIDTH] = detection[DETECTION_WIDTH]
    if track[TRACK_CLASS] < 0.0:
        track[TRACK_CLASS] = detection[DETECTION_CLASS]
    track[TRACK_HITS] += 1.0


@inlined
def _speed_at(pose: Floats, age: float) -> float:
    """Speed of the ego at the sample's time [m/s]."""
    return float(max(0.0, pose[POSE_SPEED] - pose[POSE_ACCELERATION] * age))


@inlined
def _correct_axis(  # noqa: PLR0913, PLR0917 - a kernel
    track: Floats, at: int, speed: int, column: int, measured: float, noise: float, age: float
) -> None:
    """Correct place and velocity of one axis by a place measured some time ago."""
    var, cov, rate = track[column], track[column + 1], track[column + 2]
    with_place, with_speed = var - age * cov, cov - age * rate
    spread = with_place - age * with_speed + noise
    error = measured - (track[at] - age * track[speed])
    track[at] += with_place / spread * error
    track[speed] += with_speed / spread * error
    track[column] = max(1e-9, var - with_place * with_place / spread)
    track[column + 1] = cov - with_place * with_speed / spread
    track[column + 2] = max(1e-9, rate - with_speed * with_speed / spread)


@inlined
def _correct_rate(track: Floats, ux: float, uy: float, measured: float, noise: float) -> None:
    """Correct a track by the component of its velocity along the line of sight."""
    along_x, along_y = ux * track[TRACK_VAR_VX], uy * track[TRACK_VAR_VY]
    cross_x, cross_y = ux * track[TRACK_COV_X], uy * track[TRACK_COV_Y]
    spread = ux * along_x + uy * along_y + noise
    error = (measured - ux * track[TRACK_VX] - uy * track[TRACK_VY]) / spread
    track[TRACK_X] += cross_x * error
    track[TRACK_Y] += cross_y * error
    track[TRACK_VX] += along_x * error
    track[TRACK_VY] += along_y * error
    track[TRACK_VAR_X] = max(1e-9, track[TRACK_VAR_X] - cross_x * cross_x / spread)
    track[TRACK_VAR_Y] = max(1e-9, track[TRACK_VAR_Y] - cross_y * cross_y / spread)
    track[TRACK_COV_X] -= cross_x * along_x / spread
    track[TRACK_COV_Y] -= cross_y * along_y / spread
    track[TRACK_VAR_VX] = max(1e-9, track[TRACK_VAR_VX] - along_x * along_x / spread)
    track[TRACK_VAR_VY] = max(1e-9, track[TRACK_VAR_VY] - along_y * along_y / spread)


@inlined
def _begin(  # noqa: PLR0913, PLR0917 - a kernel
    track: Floats,
    detection: Floats,
    place: Floats,
    mount_x: float,
    mount_y: float,
    pose: Floats,
    kind: int,
    age: float,
) -> None:
    track[:] = 0.0
    track[TRACK_X], track[TRACK_Y] = place[0], place[1]
    track[TRACK_VAR_X] = track[TRACK_VAR_Y] = _PRIOR_PLACE * _PRIOR_PLACE
    track[TRACK_VAR_VX] = _PRIOR_VX * _PRIOR_VX
    track[TRACK_VAR_VY] = _PRIOR_VY * _PRIOR_VY
    track[TRACK_CLASS] = detection[DETECTION_CLASS]
    _correct(track, detection, place, mount_x, mount_y, pose, kind, age)
