"""From detections of several sensors to tracks: association, filter, confirmation, coasting.

Tracks live in the vehicle frame of the channel's tick, with velocities relative to the ground. Each
has a filter; that the frame turns is left out of its covariances, because new samples come sooner
than a turn matters. A sample is old when it arrives: a track is compared with it at the sample's
time, from where the ego has been carried on since.

It is a Kalman filter at nearly constant velocity. Place along and place across the line of sight
and the range rate are taken in one after the other, as independent numbers, so nothing is inverted.
What the axes share is kept: a range rate tells one component of the velocity, and if that were
split into two numbers known for themselves, a few radars would soon be sure of a lateral speed that
none of them has seen.

A channel knows the data sheet of a sensor, as it was bought; it knows neither the error of a sample
nor a fault. Where a sweep changes a noise it changes the data sheet, and with it what is assumed.

Source:
    Bar-Shalom, Li & Kirubarajan (2001), "Estimation with applications to tracking and navigation",
    section 6.2.2 (white noise acceleration, discretised).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from adeye import signals
from adeye.kernel.elementary import tan
from adeye.kernel.jit import inlined
from adeye.kernel.motion import point_velocity
from adeye.signals import Bools, Floats, Ints
from adeye.simulate.channels.perception import tracks as columns
from adeye.simulate.channels.perception.pose import (
    POSE_ACCELERATION,
    POSE_REAR,
    POSE_SPEED,
    POSE_YAW_RATE,
)
from adeye.simulate.channels.perception.tracks import (
    Offers,
    associate,
    behind_face,
    carry_by,
    count_hit,
    count_misses,
    forget_motion,
    grow,
    is_part,
    learn,
    learn_size,
    may_begin,
    read_belief,
    room_for_track,
    with_face_kept,
    write_belief,
)
from adeye.simulate.sensors.radar import detection_threshold

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from adeye.ports import ChannelContext

# --- How accurate a channel takes its sensors to be: what their data sheets tell, and floors ------

# Columns of what is assumed of a sensor, variances all.
(
    ALONG,  # of the place along the line of sight [m²]
    ALONG_GROWTH,  # what is added to it, times the fourth power of the distance [1/m²]
    ACROSS,  # of the place across the line of sight [m²]
    BEARING,  # of the bearing, which is added to it times the square of the distance [rad²]
    RATE,  # of the range rate [m²/s²]
) = range(5)
ACCURACY_WIDTH: Final = 5

# Standard deviations (m, 1/m, m, rad, m/s) of what no data sheet tells, which are added to what it
# does, as independent errors are. So they are floors. Our choice.
_CENTRES: Final = (0.02, 0.0, 0.02, 0.0, 0.05)
"""Sensors that report the centre of a box: what is left is how the ego turns and speeds up
unnoticed between sample and use, and how well it knows its own speed."""

_GROUND_CONTACTS: Final = (0.3, 0.0, 0.1, 0.0, 0.05)
"""Cameras that find the lower edge of an object and guess the rest of it from its class."""

_OUTLINES: Final = (0.15, 0.0, 0.1, 0.0, 0.05)
"""Lidars that see a face: bent, aslant, and part of it only."""

_REFLECTIONS: Final = (0.5, 0.0, 0.2, 0.0, 0.25)
"""Radars whose echo comes from somewhere on an object. A point at the side of a body that turns
does not have the rate of its centre, nor has a sensor ahead of the ego's axle that of the ego."""

_ECHOES: Final = (0.1, 0.0, 0.5, 0.0, 0.05)
"""Ultrasonic sensors that hear the nearest surface, wherever the middle of it is."""

_UNKNOWN: Final = (0.3, 3e-4, 0.1, 0.003, 0.05)
"""Where no data sheet can be read: those of a middling camera."""

_HALF_PIXEL: Final = 0.5
"""Standard deviation of the row of a ground contact [pixels]. Rounding alone has 1/√12, but stays
the same from sample to sample, so a filter that takes errors for independent must assume more."""

Columns = tuple["Floats | float", ...]
"""Standard deviations in the order of the columns, each for every run (B,) or the same for all."""


@inlined
def assumed_noise(accuracy: Floats, distance: float) -> tuple[float, float]:
    """Return the assumed variance of a detection along and across the line of sight [m²].

    Args:
        accuracy: (ACCURACY_WIDTH,) of the sensor.
        distance: From the sensor [m].
    """
    square = distance * distance
    return (
        accuracy[ALONG] + accuracy[ALONG_GROWTH] * square * square,
        accuracy[ACROSS] + accuracy[BEARING] * square,
    )


def assumed_accuracy(context: ChannelContext, sensors: Sequence[str]) -> Floats:
    """Return what a channel assumes of some of its linked sensors (B, S, ACCURACY_WIDTH).

    Args:
        context: Gives their models, data sheets and mounts.
        sensors: Their ids.
    """
    found = np.zeros((context.runs, len(sensors), ACCURACY_WIDTH))
    for index, name in enumerate(sensors):
        model = context.models.get(name, context.sensors[name])
        floors, read = _MODELS.get(model, (_UNKNOWN, None))
        told: Columns = (0.0,) * ACCURACY_WIDTH
        sheet = context.data_sheets.get(name)
        if sheet is not None and read is not None:
            told = read(sheet)
        elif model != "ground_truth":
            floors = _UNKNOWN
        for column in range(ACCURACY_WIDTH):
            found[:, index, column] = np.square(floors[column]) + np.square(told[column])
    return found


def _object_camera(sheet: Mapping[str, Floats]) -> Columns:
    """At full range the deviation is that share of it, and it grows with the square."""
    growth = sheet["distance_noise"] / sheet["range"]
    return 0.0, growth, 0.0, sheet["bearing_noise"], 0.0


def _object_radar(sheet: Mapping[str, Floats]) -> Columns:
    return sheet["range_noise"], 0.0, 0.0, sheet["bearing_noise"], sheet["range_rate_noise"]


def _object_lidar(sheet: Mapping[str, Floats]) -> Columns:
    return sheet["range_noise"], 0.0, 0.0, sheet["bearing_noise"], 0.0


def _physical_camera(sheet: Mapping[str, Floats]) -> Columns:
    """A row of the ground at depth z is z²/(f·h) deep, f in pixels; a column is 1/f wide."""
    edges = np.array([tan(0.5 * angle) for angle in sheet["field_of_view"]])
    focal = 0.5 * sheet["columns"] / edges
    return 0.0, _HALF_PIXEL / (focal * sheet["mount.z"]), 0.0, 1.0 / focal, 0.0


def _physical_lidar(sheet: Mapping[str, Floats]) -> Columns:
    """The end of a face is anywhere between two beams."""
    spacing = sheet["field_of_view"] / sheet["beams"]
    bearing = np.sqrt(np.square(sheet["bearing_noise"]) + np.square(spacing) / 12.0)
    return sheet["range_noise"], 0.0, 0.0, bearing, 0.0


def _physical_radar(sheet: Mapping[str, Floats]) -> Columns:
    """Resolution / sqrt(2·SNR), at the weakest echo that is detected; stronger ones are better.

    Source:
        Curry (2005), "Radar system performance modeling", 2nd ed.
    """
    weakest = np.array([detection_threshold(rate) for rate in sheet["false_alarm_rate"]])
    share = 1.0 / np.sqrt(2.0 * weakest)
    return (
        share * sheet["range_resolution"],
        0.0,
        0.0,
        share * sheet["bearing_resolution"],
        share * sheet["range_rate_resolution"],
    )


def _ultrasonic(sheet: Mapping[str, Floats]) -> Columns:
    """The echo comes from anywhere in the cone."""
    return sheet["range_noise"], 0.0, 0.0, sheet["field_of_view"] / math.sqrt(12.0), 0.0


_MODELS: Final[
    dict[str, tuple[tuple[float, ...], Callable[[Mapping[str, Floats]], Columns] | None]]
] = {
    "ground_truth": (_CENTRES, None),
    "camera": (_CENTRES, _object_camera),
    "radar": (_CENTRES, _object_radar),
    "lidar": (_CENTRES, _object_lidar),
    "camera/physical": (_GROUND_CONTACTS, _physical_camera),
    "radar/physical": (_REFLECTIONS, _physical_radar),
    "lidar/physical": (_OUTLINES, _physical_lidar),
    "ultrasonic": (_ECHOES, _ultrasonic),
}
"""Floors of every model, and how its data sheet is read."""


# --- From detections of several sensors to tracks: association, filter, confirmation, coasting ----

_PRIOR_VX: Final = 15.0
_PRIOR_VY: Final = 5.0
"""Standard deviation of the velocity of a new track, whose mean is standing [m/s]. Our choice."""

_NEAR: Final = 8.0
_NEAR_ASIDE: Final = 2.5
_SLOW: Final = 3.0
"""Where a track outlives coasting: centre ahead and aside [m], ego speed [m/s]. Our choice: at 8 m
to its centre the rear of a car of 2 m reaches 16 degrees to each side of a sensor in the grille."""

_HIDDEN_SPEED: Final = 1.0
"""Standard deviation of the velocity of such a track, which is taken to stand [m/s]. Our choice."""

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
        motion: Of the vehicle frame over the period, see ``carried_by``.
        time: Now [s].
        period: Since the previous call [s].
        coast: How long a confirmed track lives without a detection [s].

    Returns:
        The end of the tracks: all places from there on are free.
    """
    end = 0
    sine, cosine = motion[2], motion[3]
    for row in range(tracks.shape[0]):
        if tracks[row, columns.TRACK_HITS] <= 0.0:
            continue
        track = tracks[row]
        vx, vy = track[columns.TRACK_VX], track[columns.TRACK_VY]
        x, y = carry_by(
            motion, track[columns.TRACK_X] + period * vx, track[columns.TRACK_Y] + period * vy
        )
        braking = _smoothed_braking(track, vx, period)
        track[columns.TRACK_X], track[columns.TRACK_Y] = x, y
        track[columns.TRACK_BRAKING] = braking
        track[columns.TRACK_VX] = track[columns.TRACK_LAST_VX] = cosine * vx + sine * vy
        track[columns.TRACK_VY] = -sine * vx + cosine * vy
        grow(track, period)
        if time - track[columns.TRACK_SEEN] > coast + 1e-9:
            if not _is_hidden_near(track, pose):
                track[columns.TRACK_HITS] = 0.0
                continue
            forget_motion(track, _HIDDEN_SPEED * _HIDDEN_SPEED)
        end = row + 1
    return end


@inlined
def _smoothed_braking(track: Floats, vx: float, period: float) -> float:
    """Return the acceleration with the change of speed since the previous tick taken in."""
    if track[columns.TRACK_VAR_VX] > _SURE_SPEED:
        return 0.0
    before = track[columns.TRACK_BRAKING]
    change = (vx - track[columns.TRACK_LAST_VX]) / period
    share = period / (period + _SMOOTHING)
    return float(before + share * (change - before))


@inlined
def _is_hidden_near(track: Floats, pose: Floats) -> bool:
    """Tell whether an object may be there although no sensor sees it: close ahead of a slow ego.

    What is that near fills more than the field of view; such a track is taken to stand.
    """
    is_near = 0.0 < track[columns.TRACK_X] < _NEAR and abs(track[columns.TRACK_Y]) < _NEAR_ASIDE
    return bool(is_near and pose[POSE_SPEED] < _SLOW)


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
        unseen = time - tracks[row, columns.TRACK_SEEN] > _TENTATIVE + 1e-9
        if 0.0 < tracks[row, columns.TRACK_HITS] < confirm_hits and unseen:
            tracks[row, columns.TRACK_HITS] = 0.0


class Sample(NamedTuple):
    """A new sample of one sensor.

    Attributes:
        accuracy: (ACCURACY_WIDTH,) what is assumed of the sensor.
        mount: (2,) x, y of the sensor in the vehicle frame [m].
        stamp: Its time [s].
        age: Time since then [s].
        mask: (M,) which detections are there.
        detections: (M, 7) in the vehicle frame of the sample's time.
        places: (M, 2) scratch.
        owner: (M,) scratch.
    """

    accuracy: Floats
    mount: Floats
    stamp: float
    age: float
    mask: Bools
    detections: Floats
    places: Floats
    owner: Ints


@inlined
def update_tracks(  # noqa: PLR0913, PLR0917 - a kernel
    tracks: Floats,
    end: int,
    pose: Floats,
    motion: tuple[float, float, float, float],
    sample: Sample,
    gate: float,
    confirm: tuple[float, float, float],
    behind: float = columns.BEHIND,
) -> int:
    """Update tracks with one new sample of one sensor, and begin tracks for what fits none.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        end: Of the tracks.
        pose: (POSE_WIDTH,) of the ego now.
        motion: Of the vehicle frame since the sample, see ``carried_by``.
        sample: The sample.
        gate: Largest distance between a track and its detection [m].
        confirm: What confirms a track, see ``CONFIRM_HITS``.
        behind: How far behind the ego a track may begin [m].

    Returns:
        The end of the tracks.
    """
    detections, age = sample.detections, sample.age
    places, owner = sample.places, sample.owner
    count = 0
    for row in range(sample.mask.shape[0]):
        owner[row] = columns.BLOCKED
        if sample.mask[row]:
            owner[row] = columns.FREE
            count = row + 1
            places[row, 0], places[row, 1] = carry_by(
                motion, detections[row, signals.DETECTION_X], detections[row, signals.DETECTION_Y]
            )
    if count == 0:
        count_misses(tracks, end, confirm)
        return end
    speed = max(0.0, pose[POSE_SPEED] - pose[POSE_ACCELERATION] * age)
    forward, aside = point_velocity(
        speed, pose[POSE_YAW_RATE], sample.mount[0] + pose[POSE_REAR], sample.mount[1]
    )
    mount_x, mount_y = carry_by(motion, sample.mount[0], sample.mount[1])
    sine, cosine = motion[2], motion[3]
    origin = (
        mount_x, mount_y, cosine * forward + sine * aside, cosine * aside - sine * forward
    )  # fmt: skip
    associate(tracks, end, Offers(detections, places, owner, count, age, gate, origin))
    room, most, is_known = -1, 0.0, False
    for row in range(count):
        x, y = places[row, 0], places[row, 1]
        place = owner[row]
        if place == columns.BLOCKED or not np.isfinite(x + y):
            continue
        if place == columns.FREE:
            if not may_begin(x, y, behind) or is_part(tracks, end, detections[row], x, y, age):
                continue
            # Once for all detections that follow one another without a track.
            if not is_known:
                room, most = room_for_track(tracks)
                is_known = True
            if not (most == math.inf or most > x * x + y * y):
                continue
            place = room
            end = max(end, place + 1)
            _begin(tracks[place], detections[row, signals.DETECTION_CLASS], x, y)
            tracks[place, columns.TRACK_BEGUN_BY] = confirm[columns.CONFIRM_SENSOR]
        is_known = False
        track = tracks[place]
        _correct(track, detections[row], x, y, origin, sample.accuracy, age)
        # When it arrived, not when it was made: a late sensor has not lost the object.
        track[columns.TRACK_SEEN] = sample.stamp + age
        count_hit(track, confirm)
    count_misses(tracks, end, confirm)
    return end


@inlined
def _correct(  # noqa: PLR0913, PLR0917 - a kernel
    track: Floats,
    detection: Floats,
    x: float,
    y: float,
    origin: tuple[float, float, float, float],
    accuracy: Floats,
    age: float,
) -> None:
    """Correct a track by a detection; its numbers are read and written once, which saves waiting.

    Args:
        track: (TRACK_STATE,) in and out.
        detection: (7,).
        x: Its place in the present vehicle frame [m].
        y: [m].
        origin: Place and velocity of the sensor at the sample's time, in the same frame [m, m/s].
        accuracy: (ACCURACY_WIDTH,) what is assumed of the sensor.
        age: Time since the sample [s].
    """
    if detection[signals.DETECTION_LENGTH] <= 0.0:
        x += behind_face(x, track[columns.TRACK_LENGTH], detection[signals.DETECTION_WIDTH])
    else:
        # What was seen so far is the face; another length is no motion.
        track[columns.TRACK_X] += with_face_kept(
            x, track[columns.TRACK_LENGTH], detection[signals.DETECTION_LENGTH]
        )
    dx, dy = x - origin[0], y - origin[1]
    distance = math.sqrt(dx * dx + dy * dy)
    ux, uy = (dx / distance, dy / distance) if distance > 0.0 else (1.0, 0.0)
    along, across = assumed_noise(accuracy, distance)
    belief = read_belief(track)
    belief = learn(belief, (ux, -age * ux, uy, -age * uy), ux * x + uy * y, along)
    belief = learn(belief, (-uy, age * uy, ux, -age * ux), ux * y - uy * x, across)
    if detection[signals.DETECTION_HAS_RANGE_RATE] > 0.0 and distance > 0.0:
        # The component of its velocity along the line of sight. That errs by the bearing, and so
        # takes in some of what goes across it.
        measured = detection[signals.DETECTION_RANGE_RATE] + (ux * origin[2] + uy * origin[3])
        turning = (uy * (belief[0][1] - origin[2]) - ux * (belief[0][3] - origin[3])) / distance
        noise = accuracy[RATE] + turning * turning * across
        belief = learn(belief, (0.0, ux, 0.0, uy), measured, noise)
    write_belief(track, belief)
    learn_size(track, detection[signals.DETECTION_LENGTH], detection[signals.DETECTION_WIDTH])
    if track[columns.TRACK_CLASS] < 0.0:
        track[columns.TRACK_CLASS] = detection[signals.DETECTION_CLASS]


@inlined
def _begin(track: Floats, kind: float, x: float, y: float) -> None:
    """Begin a track of a class at a place [m], about which nothing else is known yet."""
    track[:] = 0.0
    track[columns.TRACK_X], track[columns.TRACK_Y] = x, y
    track[columns.TRACK_VAR_X] = track[columns.TRACK_VAR_Y] = _PRIOR_PLACE * _PRIOR_PLACE
    track[columns.TRACK_VAR_VX] = _PRIOR_VX * _PRIOR_VX
    track[columns.TRACK_VAR_VY] = _PRIOR_VY * _PRIOR_VY
    track[columns.TRACK_CLASS] = kind
