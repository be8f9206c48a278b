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

from adeye.channels.confirmation import CONFIRM_SENSOR, count_hit, count_misses
from adeye.channels.pose import POSE_ACCELERATION, POSE_SPEED
from adeye.channels.tracks import (
    BEHIND,
    BLOCKED,
    FREE,
    TRACK_BEGUN_BY,
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
    TRACK_X,
    TRACK_Y,
    associate,
    behind_face,
    carry_by,
    learn_size,
    may_begin,
    room_for_track,
    with_face_kept,
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

SENSOR_KINDS: Final = ("ground_truth", "lidar", "radar", "camera", "ultrasonic")
"""Kinds that have a row in the table of assumed noise; every other sensor takes the camera's."""

# Standard deviations that a channel assumes: along the line of sight constant [m] and growing with
# the distance squared [1/m]; across constant [m] and growing with the distance; of the range rate
# [m/s]. Our choice, of the order of data sheets.
_NOISE: Final = np.array(
    [
        [0.02, 0.0, 0.02, 0.0, 0.05],
        [0.15, 0.0, 0.10, 0.002, 0.0],
        [0.50, 0.0, 0.20, 0.010, 0.25],
        [0.30, 3e-4, 0.10, 0.003, 0.0],
        [0.10, 0.0, 0.50, 0.100, 0.0],
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
"""Variance of the speed below which its change is no noise [m²/s²]: no camera's. Our choice."""

_SMOOTHING: Final = 0.3
"""Time constant of the smoothed acceleration [s]. Our choice: a brake needs about that long."""

_PRIOR_PLACE: Final = 100.0
"""Standard deviation of its place before its first detection [m]: nothing is known."""

_TENTATIVE: Final = 0.25
"""How long an unconfirmed track lives without a detection [s]: two missed samples at 10 Hz."""


@inlined
def predict_tracks(
    tracks: Floats,
    pose: Floats,
    motion: tuple[float, float, float, float],
    time: float,
    period: float,
    coast: float,
) -> int:
    """Carry tracks on by one tick and free those that have not been seen for too long.

    One close ahead of a slow ego is kept: it may have come too near to be seen.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        pose: (POSE_WIDTH,) of the ego now.
        motion: Of the vehicle frame over the period, see ``tracks.carried_by``.
        time: Now [s].
        period: Since the previous call [s].
        coast: How long a confirmed track lives without a detection [s].

    Returns:
        The end of the tracks: all places from there on are free.
    """
    end = 0
    sine, cosine = motion[2], motion[3]
    for row in range(tracks.shape[0]):
        if tracks[row, TRACK_HITS] <= 0.0:
            continue
        track = tracks[row]
        vx, vy = track[TRACK_VX], track[TRACK_VY]
        x, y = carry_by(motion, track[TRACK_X] + period * vx, track[TRACK_Y] + period * vy)
        braking = _smoothed_braking(track, vx, period)
        track[TRACK_X], track[TRACK_Y] = x, y
        track[TRACK_BRAKING] = braking
        track[TRACK_VX] = track[TRACK_LAST_VX] = cosine * vx + sine * vy
        track[TRACK_VY] = -sine * vx + cosine * vy
        _grow(track, TRACK_VAR_X, period, _FREEDOM_X)
        _grow(track, TRACK_VAR_Y, period, _FREEDOM_Y)
        if time - track[TRACK_SEEN] > coast + 1e-9:
            if not _is_hidden_near(track, pose):
                track[TRACK_HITS] = 0.0
                continue
            track[TRACK_VX] = track[TRACK_VY] = 0.0
            track[TRACK_COV_X] = track[TRACK_COV_Y] = 0.0
            track[TRACK_VAR_VX] = track[TRACK_VAR_VY] = 1.0
        end = row + 1
    return end


@inlined
def _smoothed_braking(track: Floats, vx: float, period: float) -> float:
    """Return the acceleration with the change of speed since the previous tick taken in."""
    if track[TRACK_VAR_VX] > _SURE_SPEED:
        return 0.0
    before = track[TRACK_BRAKING]
    change = (vx - track[TRACK_LAST_VX]) / period
    share = period / (period + _SMOOTHING)
    return float(before + share * (change - before))


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
def drop_tentative(tracks: Floats, end: int, time: float, confirm_hits: float) -> None:
    """Free tracks that are not confirmed and have not been seen lately.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        end: Of the tracks.
        time: Now [s].
        confirm_hits: Detections that confirm a track.
    """
    for row in range(end):
        unseen = time - tracks[row, TRACK_SEEN] > _TENTATIVE + 1e-9
        if 0.0 < tracks[row, TRACK_HITS] < confirm_hits and unseen:
            tracks[row, TRACK_HITS] = 0.0


@inlined
def update_tracks(  # noqa: PLR0913, PLR0917 - a kernel
    tracks: Floats,
    end: int,
    pose: Floats,
    motion: tuple[float, float, float, float],
    kind: int,
    mount_x: float,
    mount_y: float,
    mask: Bools,
    detections: Floats,
    stamp: float,
    age: float,
    gate: float,
    confirm: tuple[float, float, float],
    places: Floats,
    owner: Ints,
    behind: float = BEHIND,
) -> int:
    """Update tracks with one new sample of one sensor, and begin tracks for what fits none.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        end: Of the tracks.
        pose: (POSE_WIDTH,) of the ego now.
        motion: Of the vehicle frame since the sample, see ``tracks.carried_by``.
        kind: Index into ``SENSOR_KINDS``.
        mount_x: Of the sensor in the vehicle frame [m].
        mount_y: [m].
        mask: (M,) which detections are there.
        detections: (M, 7) in the vehicle frame of the sample's time.
        stamp: Time of the sample [s].
        age: Time since the sample [s].
        gate: Largest distance between a track and its detection [m].
        confirm: What confirms a track, see ``confirmation.CONFIRM_HITS``.
        places: (M, 2) scratch.
        owner: (M,) scratch.
        behind: How far behind the ego a track may begin [m].

    Returns:
        The end of the tracks.
    """
    count = 0
    for row in range(mask.shape[0]):
        owner[row] = BLOCKED
        if mask[row]:
            owner[row] = FREE
            count = row + 1
            places[row, 0], places[row, 1] = carry_by(
                motion, detections[row, DETECTION_X], detections[row, DETECTION_Y]
            )
    if count == 0:
        count_misses(tracks, end, confirm)
        return end
    mount_x, mount_y = carry_by(motion, mount_x, mount_y)
    speed = max(0.0, pose[POSE_SPEED] - pose[POSE_ACCELERATION] * age)
    origin = (mount_x, mount_y, speed)
    associate(tracks, end, detections, places, owner, count, age, gate, origin)
    room, most, is_known = -1, 0.0, False
    for row in range(count):
        x, y = places[row, 0], places[row, 1]
        place = owner[row]
        if place == BLOCKED or not np.isfinite(x + y):
            continue
        if place == FREE:
            if not may_begin(x, y, behind):
                continue
            # Once for all detections that follow one another without a track.
            if not is_known:
                room, most = room_for_track(tracks)
                is_known = True
            if not (most == math.inf or most > x * x + y * y):
                continue
            place = room
            end = max(end, place + 1)
            _begin(tracks[place], detections[row, DETECTION_CLASS], x, y)
            tracks[place, TRACK_BEGUN_BY] = confirm[CONFIRM_SENSOR]
        is_known = False
        track = tracks[place]
        _correct(track, detections[row], x, y, mount_x, mount_y, speed, kind, age)
        # When it arrived, not when it was made: a late sensor has not lost the object.
        track[TRACK_SEEN] = stamp + age
        count_hit(track, confirm)
    count_misses(tracks, end, confirm)
    return end


@inlined
def _noise(kind: int, ux: float, uy: float, distance: float) -> tuple[float, float, float]:
    """Return the assumed variance of a detection along x, along y and of its range rate."""
    along = _NOISE[kind, 0] + _NOISE[kind, 1] * distance * distance
    across = _NOISE[kind, 2] + _NOISE[kind, 3] * distance
    along, across = along * along, across * across
    rate = _NOISE[kind, 4]
    return (
        ux * ux * along + uy * uy * across,
        uy * uy * along + ux * ux * across,
        max(rate * rate, 0.05 * 0.05),
    )


@inlined
def _correct(  # noqa: PLR0913, PLR0917 - a kernel
    track: Floats,
    detection: Floats,
    x: float,
    y: float,
    mount_x: float,
    mount_y: float,
    ego_speed: float,
    kind: int,
    age: float,
) -> None:
    """Correct a track by a detection; its numbers are read and written once, which saves waiting.

    Args:
        track: (TRACK_STATE,) in and out.
        detection: (7,).
        x: Its place in the present vehicle frame [m].
        y: [m].
        mount_x: Of the sensor at the sample's time, in the same frame [m].
        mount_y: [m].
        ego_speed: At the sample's time [m/s].
        kind: Index into ``SENSOR_KINDS``.
        age: Time since the sample [s].
    """
    if detection[DETECTION_LENGTH] <= 0.0:
        x += behind_face(x, track[TRACK_LENGTH], detection[DETECTION_WIDTH])
    else:
        # What was seen so far is the face; another length is no motion.
        track[TRACK_X] += with_face_kept(x, track[TRACK_LENGTH], detection[DETECTION_LENGTH])
    dx, dy = x - mount_x, y - mount_y
    distance = math.sqrt(dx * dx + dy * dy)
    ux, uy = (dx / distance, dy / distance) if distance > 0.0 else (1.0, 0.0)
    noise_x, noise_y, noise_rate = _noise(kind, ux, uy, distance)
    at_x, vx, var_x, cov_x, var_vx = _corrected(track, TRACK_X, TRACK_VAR_X, x, noise_x, age)
    at_y, vy, var_y, cov_y, var_vy = _corrected(track, TRACK_Y, TRACK_VAR_Y, y, noise_y, age)
    if detection[DETECTION_HAS_RANGE_RATE] > 0.0 and distance > 0.0:
        # The component of its velocity along the line of sight.
        measured = detection[DETECTION_RANGE_RATE] + ux * ego_speed
        along_x, along_y = ux * var_vx, uy * var_vy
        cross_x, cross_y = ux * cov_x, uy * cov_y
        spread = ux * along_x + uy * along_y + noise_rate
        error = (measured - ux * vx - uy * vy) / spread
        at_x, at_y = at_x + cross_x * error, at_y + cross_y * error
        vx, vy = vx + along_x * error, vy + along_y * error
        var_x = max(1e-9, var_x - cross_x * cross_x / spread)
        var_y = max(1e-9, var_y - cross_y * cross_y / spread)
        cov_x, cov_y = cov_x - cross_x * along_x / spread, cov_y - cross_y * along_y / spread
        var_vx = max(1e-9, var_vx - along_x * along_x / spread)
        var_vy = max(1e-9, var_vy - along_y * along_y / spread)
    track[TRACK_X], track[TRACK_VX] = at_x, vx
    track[TRACK_Y], track[TRACK_VY] = at_y, vy
    track[TRACK_VAR_X], track[TRACK_COV_X], track[TRACK_VAR_VX] = var_x, cov_x, var_vx
    track[TRACK_VAR_Y], track[TRACK_COV_Y], track[TRACK_VAR_VY] = var_y, cov_y, var_vy
    learn_size(track, detection[DETECTION_LENGTH], detection[DETECTION_WIDTH])
    if track[TRACK_CLASS] < 0.0:
        track[TRACK_CLASS] = detection[DETECTION_CLASS]


@inlined
def _corrected(
    track: Floats, axis: int, column: int, measured: float, noise: float, age: float
) -> tuple[float, float, float, float, float]:
    """Correct one axis by a place measured some time ago.

    Args:
        track: (TRACK_STATE,).
        axis: Column of its place; that of its velocity is two further.
        column: First column of its uncertainty.
        measured: Place [m].
        noise: Variance of it [m²].
        age: How long ago [s].

    Returns:
        Place, velocity, and variance of the place, covariance, variance of the velocity.
    """
    at, speed = track[axis], track[axis + 2]
    var, cov, rate = track[column], track[column + 1], track[column + 2]
    with_place, with_speed = var - age * cov, cov - age * rate
    spread = with_place - age * with_speed + noise
    error = measured - (at - age * speed)
    return (
        at + with_place / spread * error,
        speed + with_speed / spread * error,
        max(1e-9, var - with_place * with_place / spread),
        cov - with_place * with_speed / spread,
        max(1e-9, rate - with_speed * with_speed / spread),
    )


@inlined
def _begin(track: Floats, kind: float, x: float, y: float) -> None:
    """Begin a track of a class at a place [m], about which nothing else is known yet."""
    track[:] = 0.0
    track[TRACK_X], track[TRACK_Y] = x, y
    track[TRACK_VAR_X] = track[TRACK_VAR_Y] = _PRIOR_PLACE * _PRIOR_PLACE
    track[TRACK_VAR_VX] = _PRIOR_VX * _PRIOR_VX
    track[TRACK_VAR_VY] = _PRIOR_VY * _PRIOR_VY
    track[TRACK_CLASS] = kind
