"""The tracks of a channel: which detection belongs to which, their filter, and when they count."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from adeye import signals
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import inlined
from adeye.signals import Floats, Ints
from adeye.simulate.channels.perception.pose import (
    POSE_ACCELERATION,
    POSE_REAR,
    POSE_SPEED,
    POSE_YAW_RATE,
)

if TYPE_CHECKING:
    pass

# --- The row of a track, and which detection belongs to which track -------------------------------

TRACKS: Final = 8
"""Tracks that a channel keeps."""

# Columns of a track.
(
    TRACK_X,  # centre, forward [m]
    TRACK_Y,  # centre, to the left [m]
    TRACK_VX,  # relative to the ground [m/s]
    TRACK_VY,
    TRACK_VAR_X,  # variance of the place along x [m²]
    TRACK_COV_X,  # covariance of place and velocity along x
    TRACK_VAR_VX,
    TRACK_VAR_Y,
    TRACK_COV_Y,
    TRACK_VAR_VY,
    TRACK_LENGTH,  # [m]
    TRACK_WIDTH,
    TRACK_CLASS,
    TRACK_HITS,  # detections so far; 0 marks a free place
    TRACK_SEEN,  # time at which the newest sample that has it arrived [s]
    TRACK_BRAKING,  # acceleration along x, smoothed; 0 while the speed is not sure [m/s²]
    TRACK_LAST_VX,  # speed along x at the previous tick [m/s]
    TRACK_NEAREST,  # while detections are shared out: the nearest free one, -1 for none
    TRACK_COST,  # how far away it is, 1 at the gate
    TRACK_BEGUN_BY,  # number of the sensor that began it
    TRACK_HISTORY,  # of its first samples, a bit each: 1 for a hit, the newest lowest
    TRACK_COV_XY,  # covariance of the places along x and y
    TRACK_COV_X_VY,
    TRACK_COV_Y_VX,
    TRACK_COV_V,  # of the velocities along x and y
) = range(25)
TRACK_STATE: Final = 25

FREE: Final = -1
"""Owner of a detection that belongs to no track yet."""

BLOCKED: Final = -2
"""Owner of a row in which there is no detection."""

_GATE_GROWTH: Final = 0.08
"""Growth of the gate along the line of sight with distance, for cameras. Our choice."""

_RATE_SIGMAS: Final = 5.0
_RATE_SLACK: Final = 3.0
"""Gate of the range rate: standard deviations of the track's velocity, and on top [m/s]. Wide, so
that it parts what stands from what drives and nothing else. Our choice."""

_POINT_SIGMAS: Final = 3.0
_POINT_SLACK: Final = 1.0
_POINT_NOISE: Final = 0.25
"""Gate along the line of sight for what has a range rate and no class, which may be clutter:
standard deviations of the place, on top [m], and variance of the detection [m²]. Our choice."""

_CAR_LENGTH: Final = 4.5
_SHORT: Final = 0.6
_NARROW: Final = 1.0
"""Length that an object is taken to have where sensors do not tell [m]: that of a car, unless it is
seen to be narrower than any."""

CAR_WIDTH: Final = 1.8
"""Width that an object is taken to have where sensors do not tell [m]."""

_SURE_HITS: Final = 5.0
_SKIN: Final = 0.3
"""Detections from which on a track's body is believed in, and how far beside it its flank may seem
to be [m]. Our choice."""

BEHIND: Final = 15.0
_ASIDE: Final = 20.0
"""New tracks begin no further behind than this, unless a channel asks for more, nor further aside
than this and half the distance ahead [m]: what is outside cannot come into the path within the
prediction of three seconds."""


@inlined
def carried_by(pose: Floats, age: float) -> tuple[float, float, float, float]:
    """Return how the vehicle frame has moved since some time ago, for ``carry_by``.

    Its origin is the box centre, which swings around the rear axle while that moves along the
    heading.

    Args:
        pose: (POSE_WIDTH,) of the ego now.
        age: How long ago [s].

    Returns:
        Way along x and y of the earlier frame [m], sine and cosine of the turn.
    """
    turn = pose[POSE_YAW_RATE] * age
    earlier = max(0.0, pose[POSE_SPEED] - pose[POSE_ACCELERATION] * age)
    way = 0.5 * (pose[POSE_SPEED] + earlier) * age
    sine, cosine = sin_cos(0.5 * turn)
    turn_sine, turn_cosine = sin_cos(turn)
    swing = 2.0 * pose[POSE_REAR] * sine
    return way * cosine - swing * sine, way * sine + swing * cosine, turn_sine, turn_cosine


@inlined
def carry_by(motion: tuple[float, float, float, float], x: float, y: float) -> tuple[float, float]:
    """Express a point of an earlier vehicle frame in the present one.

    Args:
        motion: Of the frame, see ``carried_by``.
        x: [m].
        y: [m].
    """
    along, across, sine, cosine = motion
    dx, dy = x - along, y - across
    return cosine * dx + sine * dy, -sine * dx + cosine * dy


class Offers(NamedTuple):
    """The detections of a sample that tracks are compared with.

    Attributes:
        detections: (M, 7).
        places: (M, 2) of the detections in the present vehicle frame [m].
        owner: (M,) ``FREE`` or ``BLOCKED`` in, the track of each detection that has one out.
        filled: Rows of detections from here on are empty.
        age: Time since the sample [s].
        gate: Largest distance between a track and its detection [m].
        origin: Place and velocity of the sensor at the sample's time, in the present vehicle
            frame [m, m/s].
    """

    detections: Floats
    places: Floats
    owner: Ints
    filled: int
    age: float
    gate: float
    origin: tuple[float, float, float, float]


@inlined
def associate(tracks: Floats, end: int, offers: Offers) -> None:
    """Give each track the detection that is nearest to it, the nearest pair first.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        end: Rows of tracks from here on are free places.
        offers: In and out: the owners.
    """
    for place in range(end):
        if tracks[place, TRACK_HITS] > 0.0:
            track = tracks[place]
            track[TRACK_NEAREST], track[TRACK_COST] = _nearest(track, offers)
    if not _take_nearest(tracks, end, offers.owner):
        _share_out(tracks, end, offers)


@inlined
def _share_out(tracks: Floats, end: int, offers: Offers) -> None:
    """Join the nearest pair; who wanted the same detection looks for another; and so on."""
    while True:
        best = -1
        least = math.inf
        for place in range(end):
            if tracks[place, TRACK_HITS] > 0.0 and tracks[place, TRACK_NEAREST] >= 0.0:
                cost = tracks[place, TRACK_COST]
                if cost < least:
                    best, least = place, cost
        if best < 0:
            return
        taken = tracks[best, TRACK_NEAREST]
        offers.owner[int(taken)] = best
        tracks[best, TRACK_NEAREST] = -1.0
        for place in range(end):
            if tracks[place, TRACK_HITS] > 0.0 and tracks[place, TRACK_NEAREST] == taken:
                track = tracks[place]
                track[TRACK_NEAREST], track[TRACK_COST] = _nearest(track, offers)


@inlined
def _take_nearest(tracks: Floats, end: int, owner: Ints) -> bool:
    """Give every track its nearest detection, unless two want the same; tell whether it was done.

    Where nobody competes the order of the pairs does not matter.
    """
    for place in range(end):
        if tracks[place, TRACK_HITS] > 0.0 and tracks[place, TRACK_NEAREST] >= 0.0:
            wanted = int(tracks[place, TRACK_NEAREST])
            if owner[wanted] != FREE:
                for earlier in range(place):
                    if tracks[earlier, TRACK_HITS] > 0.0 and tracks[earlier, TRACK_NEAREST] >= 0.0:
                        owner[int(tracks[earlier, TRACK_NEAREST])] = FREE
                return False
            owner[wanted] = place
    return True


@inlined
def _nearest(track: Floats, offers: Offers) -> tuple[int, float]:
    """Return the nearest detection that is free, inside the gate and of the track's class."""
    detections, places, gate = offers.detections, offers.places, offers.gate
    x = track[TRACK_X] - offers.age * track[TRACK_VX]
    y = track[TRACK_Y] - offers.age * track[TRACK_VY]
    distance = math.sqrt(x * x + y * y)
    ux, uy = (x / distance, y / distance) if distance > 0.0 else (1.0, 0.0)
    longest = gate + _GATE_GROWTH * distance
    # Beyond the far corner of the gate, which is no wider than long; saves what is dearer.
    reach = 1.5 * longest
    kind = track[TRACK_CLASS]
    chosen, least = -1, 1.0
    for row in range(offers.filled):
        dx = places[row, 0] - x
        if abs(dx) > reach + track[TRACK_LENGTH] or offers.owner[row] != FREE:
            continue
        dy = places[row, 1] - y
        if detections[row, signals.DETECTION_LENGTH] <= 0.0:
            dx += behind_face(x, track[TRACK_LENGTH], detections[row, signals.DETECTION_WIDTH])
        else:
            dx -= with_face_kept(x, track[TRACK_LENGTH], detections[row, signals.DETECTION_LENGTH])
        along, across = ux * dx + uy * dy, ux * dy - uy * dx
        # NaN compares false, so a detection that is no number fits nothing.
        if not (abs(along) < longest and abs(across) < gate):
            continue
        if detections[row, signals.DETECTION_CLASS] != kind and (
            detections[row, signals.DETECTION_CLASS] >= 0.0 and kind >= 0.0
        ):
            continue
        along, across = along / longest, across / gate
        cost = along * along + across * across
        if cost < least and _moves_alike(
            track, detections[row], places[row], offers.origin, along * longest
        ):
            chosen, least = row, cost
    return chosen, least


@inlined
def _moves_alike(
    track: Floats,
    detection: Floats,
    place: Floats,
    origin: tuple[float, float, float, float],
    along: float,
) -> bool:
    """Tell whether a detection has the range rate of a track, as far as both are known.

    Otherwise a standing thing at the roadside would stop the vehicle that drives past it. What has
    no class may be clutter, so it must also be where the track is sure to be.

    Args:
        track: (TRACK_STATE,).
        detection: (7,).
        place: (2,) of it in the present vehicle frame [m].
        origin: See ``Offers``.
        along: How far it is from the track along the line of sight [m].
    """
    if not detection[signals.DETECTION_HAS_RANGE_RATE] > 0.0:
        return True
    dx, dy = place[0] - origin[0], place[1] - origin[1]
    distance = math.sqrt(dx * dx + dy * dy)
    if not distance > 0.0:
        return True
    ux, uy = dx / distance, dy / distance
    if detection[signals.DETECTION_CLASS] < 0.0:
        spread = ux * ux * track[TRACK_VAR_X] + uy * uy * track[TRACK_VAR_Y] + _POINT_NOISE
        if not abs(along) <= _POINT_SIGMAS * math.sqrt(spread) + _POINT_SLACK:
            return False
    variance = ux * ux * track[TRACK_VAR_VX] + uy * uy * track[TRACK_VAR_VY]
    error = detection[signals.DETECTION_RANGE_RATE] + (ux * origin[2] + uy * origin[3])
    error -= ux * track[TRACK_VX] + uy * track[TRACK_VY]
    return bool(abs(error) <= _RATE_SIGMAS * math.sqrt(variance) + _RATE_SLACK)


@inlined
def behind_face(x: float, length: float, width: float) -> float:
    """Return how far the centre of a box lies beyond its nearest face, along x [m].

    Args:
        x: Of the face [m]; behind the ego the centre is further behind.
        length: Of the track [m], 0 while it is unknown.
        width: Of the detection [m], 0 if it is unknown.
    """
    depth = length if length > 0.0 else assumed_length(width)
    return 0.5 * depth if x >= 0.0 else -0.5 * depth


@inlined
def with_face_kept(x: float, length: float, other: float) -> float:
    """Return how far the centre of a box moves along x if it is longer and its face stays [m].

    Args:
        x: Of its centre [m].
        length: Of the box [m], 0 while it is unknown.
        other: Length that it turns out to have [m].
    """
    if length <= 0.0:
        return 0.0
    return 0.5 * (other - length) if x >= 0.0 else 0.5 * (length - other)


@inlined
def assumed_length(width: float) -> float:
    """Return the length that an object of a width is taken to have [m]; of a car if unknown (0)."""
    return _SHORT if 0.0 < width < _NARROW else _CAR_LENGTH


@inlined
def learn_size(track: Floats, length: float, width: float) -> None:
    """Take over the size of a detection, as far as it tells it; what is unknown is assumed."""
    if length > 0.0:
        track[TRACK_LENGTH] = length
    elif track[TRACK_LENGTH] <= 0.0:
        track[TRACK_LENGTH] = assumed_length(width)
    if width > 0.0:
        track[TRACK_WIDTH] = width
    elif track[TRACK_WIDTH] <= 0.0:
        track[TRACK_WIDTH] = CAR_WIDTH


@inlined
def may_begin(x: float, y: float, behind: float = BEHIND) -> bool:
    """Tell whether a track may begin at a place in the vehicle frame [m].

    Args:
        x: Forward [m].
        y: To the left [m].
        behind: How far behind the ego at most [m].
    """
    return not (x < -behind or abs(y) > _ASIDE + 0.5 * max(0.0, x))


@inlined
def is_part(tracks: Floats, end: int, detection: Floats, x: float, y: float, age: float) -> bool:
    """Tell whether a detection is a part of an object that has a track: flanks fall into pieces.

    Args:
        tracks: (K, TRACK_STATE).
        end: Of the tracks.
        detection: (7,).
        x: Its place in the present vehicle frame [m].
        y: [m].
        age: Time since the sample [s].
    """
    if (
        detection[signals.DETECTION_CLASS] >= 0.0
        or detection[signals.DETECTION_HAS_RANGE_RATE] > 0.0
    ):
        return False
    for track in tracks[:end]:
        dx = abs(x - track[TRACK_X] + age * track[TRACK_VX])
        dy = abs(y - track[TRACK_Y] + age * track[TRACK_VY])
        is_in = dx <= 0.5 * track[TRACK_LENGTH] and dy <= 0.5 * track[TRACK_WIDTH] + _SKIN
        if is_in and track[TRACK_HITS] >= _SURE_HITS:
            return True
    return False


@inlined
def room_for_track(tracks: Floats) -> tuple[int, float]:
    """Return where a new track finds room: a free place, or that of the farthest track.

    Args:
        tracks: (K, TRACK_STATE).

    Returns:
        The place, and how far its track is away: the new one must be nearer; squared [m²], infinity
        for a free place.
    """
    farthest, most = -1, -1.0
    for row in range(tracks.shape[0]):
        if tracks[row, TRACK_HITS] <= 0.0:
            return row, math.inf
        x, y = tracks[row, TRACK_X], tracks[row, TRACK_Y]
        if x * x + y * y > most:
            farthest, most = row, x * x + y * y
    return farthest, most


# --- The filter of a track: place and velocity in the plane, with everything that they share ------

FREEDOM_X: Final = 10.0
FREEDOM_Y: Final = 0.5
"""Spectral density of the unknown acceleration of a track [m²/s³]: within one second its velocity
changes by 3.2 m/s along and 0.7 m/s across with one standard deviation, hard braking and quick
lane changes by two to three of them. Our choice."""

_LEAST_VARIANCE: Final = 1e-9
"""No variance falls below it, whatever rounding does."""

Four = tuple[float, float, float, float]

Belief = tuple[Four, Four, tuple[float, float, float], tuple[float, float, float]]
"""What is held of a track: x, vx, y, vy; the variances of these; their covariances x-vx, x-y, x-vy
and vx-y, vx-vy, y-vy."""


@inlined
def read_belief(track: Floats) -> Belief:
    """Read what is held of a track.

    Args:
        track: (TRACK_STATE,).
    """
    return (
        (track[TRACK_X], track[TRACK_VX], track[TRACK_Y], track[TRACK_VY]),
        (track[TRACK_VAR_X], track[TRACK_VAR_VX], track[TRACK_VAR_Y], track[TRACK_VAR_VY]),
        (track[TRACK_COV_X], track[TRACK_COV_XY], track[TRACK_COV_X_VY]),
        (track[TRACK_COV_Y_VX], track[TRACK_COV_V], track[TRACK_COV_Y]),
    )


@inlined
def write_belief(track: Floats, belief: Belief) -> None:
    """Write what is held of a track.

    Args:
        track: (TRACK_STATE,) in and out.
        belief: See ``Belief``.
    """
    mean, variance, first, second = belief
    track[TRACK_X], track[TRACK_VX], track[TRACK_Y], track[TRACK_VY] = mean
    track[TRACK_VAR_X], track[TRACK_VAR_VX] = variance[0], variance[1]
    track[TRACK_VAR_Y], track[TRACK_VAR_VY] = variance[2], variance[3]
    track[TRACK_COV_X], track[TRACK_COV_XY], track[TRACK_COV_X_VY] = first
    track[TRACK_COV_Y_VX], track[TRACK_COV_V], track[TRACK_COV_Y] = second


@inlined
def learn(belief: Belief, weights: Four, measured: float, noise: float) -> Belief:
    """Take in one number that is a weighted sum of x, vx, y, vy.

    Args:
        belief: See ``Belief``.
        weights: Of x, vx, y, vy.
        measured: The number.
        noise: Variance of its error.
    """
    (x, vx, y, vy), (x_x, v_v, y_y, w_w), (x_v, x_y, x_w), (v_y, v_w, y_w) = belief
    a, b, c, d = weights
    # Covariances of the number with x, vx, y, vy; w stands for vy.
    to_x = a * x_x + b * x_v + c * x_y + d * x_w
    to_v = a * x_v + b * v_v + c * v_y + d * v_w
    to_y = a * x_y + b * v_y + c * y_y + d * y_w
    to_w = a * x_w + b * v_w + c * y_w + d * w_w
    scale = 1.0 / (a * to_x + b * to_v + c * to_y + d * to_w + noise)
    error = measured - (a * x + b * vx + c * y + d * vy)
    gain_x, gain_v, gain_y, gain_w = scale * to_x, scale * to_v, scale * to_y, scale * to_w
    return (
        (x + gain_x * error, vx + gain_v * error, y + gain_y * error, vy + gain_w * error),
        (
            max(_LEAST_VARIANCE, x_x - gain_x * to_x),
            max(_LEAST_VARIANCE, v_v - gain_v * to_v),
            max(_LEAST_VARIANCE, y_y - gain_y * to_y),
            max(_LEAST_VARIANCE, w_w - gain_w * to_w),
        ),
        (x_v - gain_x * to_v, x_y - gain_x * to_y, x_w - gain_x * to_w),
        (v_y - gain_v * to_y, v_w - gain_v * to_w, y_w - gain_y * to_w),
    )


@inlined
def grow(track: Floats, period: float) -> None:
    """Let the uncertainty of a track grow over a period.

    Args:
        track: (TRACK_STATE,) in and out.
        period: [s].
    """
    _grow_axis(track, TRACK_VAR_X, period, FREEDOM_X)
    _grow_axis(track, TRACK_VAR_Y, period, FREEDOM_Y)
    x_vy, y_vx, speeds = track[TRACK_COV_X_VY], track[TRACK_COV_Y_VX], track[TRACK_COV_V]
    track[TRACK_COV_XY] += period * (x_vy + y_vx + period * speeds)
    track[TRACK_COV_X_VY] = x_vy + period * speeds
    track[TRACK_COV_Y_VX] = y_vx + period * speeds


@inlined
def _grow_axis(track: Floats, column: int, period: float, freedom: float) -> None:
    """Let the uncertainty of one axis grow over a period (white acceleration)."""
    var, cov, rate = track[column], track[column + 1], track[column + 2]
    track[column] = var + period * (2.0 * cov + period * (rate + period * freedom / 3.0))
    track[column + 1] = cov + period * (rate + 0.5 * period * freedom)
    track[column + 2] = rate + period * freedom


@inlined
def forget_motion(track: Floats, variance: float) -> None:
    """Take a track to stand, with the same uncertainty along and across.

    Args:
        track: (TRACK_STATE,) in and out.
        variance: Of each component of its velocity [m²/s²].
    """
    track[TRACK_VX] = track[TRACK_VY] = 0.0
    track[TRACK_COV_X] = track[TRACK_COV_Y] = track[TRACK_COV_V] = 0.0
    track[TRACK_COV_X_VY] = track[TRACK_COV_Y_VX] = 0.0
    track[TRACK_VAR_VX] = track[TRACK_VAR_VY] = variance


# --- When a track counts: enough detections among the last samples that could have shown it -------

CONFIRM_HITS, CONFIRM_WINDOW, CONFIRM_SENSOR = range(3)
"""What confirms a track, as kernels hand it on: detections, samples among which they must be (0 for
any), number of the sensor whose sample is being used."""

_HIT: Final = -1.0
"""Mark of a track that this sample has shown, in the column of its cost, which is not negative."""


@inlined
def count_hit(track: Floats, confirm: tuple[float, float, float]) -> None:
    """Count a detection of a track, by any sensor.

    With a window, the hits of a track that is not confirmed yet are those among its last samples;
    a confirmed track stays so.

    Args:
        track: (TRACK_STATE,) in and out.
        confirm: See ``CONFIRM_HITS``.
    """
    hits, window = confirm[CONFIRM_HITS], confirm[CONFIRM_WINDOW]
    track[TRACK_COST] = _HIT
    if window > 0.0 and track[TRACK_HITS] < hits:
        track[TRACK_HITS] = _remembered(track, 1, int(window))
    else:
        track[TRACK_HITS] += 1.0


@inlined
def count_misses(tracks: Floats, end: int, confirm: tuple[float, float, float]) -> None:
    """Count a sample that did not show tracks, which are not confirmed yet.

    A sensor that has not begun a track may look elsewhere, so only the one that did can miss it. A
    track whose last hit is forgotten is free.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        end: Of the tracks.
        confirm: See ``CONFIRM_HITS``.
    """
    hits, window = confirm[CONFIRM_HITS], confirm[CONFIRM_WINDOW]
    if not window > 0.0:
        return
    for row in range(end):
        track = tracks[row]
        was_hit = track[TRACK_COST] == _HIT
        # The next sample may be empty, and then nobody asks for the cost.
        track[TRACK_COST] = 0.0
        is_tentative = 0.0 < track[TRACK_HITS] < hits
        if is_tentative and not was_hit and track[TRACK_BEGUN_BY] == confirm[CONFIRM_SENSOR]:
            track[TRACK_HITS] = _remembered(track, 0, int(window))


@inlined
def _remembered(track: Floats, newest: int, window: int) -> float:
    """Remember whether the newest sample shows the track; return the hits among the last ones."""
    history = (2 * int(track[TRACK_HISTORY]) + newest) % (1 << window)
    track[TRACK_HISTORY] = float(history)
    hits = 0
    while history > 0:
        hits += history & 1
        history >>= 1
    return float(hits)
