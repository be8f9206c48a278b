"""Where the tracks will be: in road coordinates, at the sample times of the candidates.

A vehicle goes on at its speed, or brakes on until it stands; one that moves sideways completes its
lane change. Cyclists and pedestrians go on straight, wherever that is. How unsure a prediction is
grows with its time, faster for those who may turn at any time; see ``margin_at``. Road coordinates
are taken as straight over the length of a body.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.channels.corridor import MAX_SPEED_VARIANCE, MIN_LATERAL_SPEED
from adeye.channels.pose import POSE_HEADING, POSE_S, POSE_X, POSE_Y
from adeye.channels.tracks import (
    TRACK_BRAKING,
    TRACK_CLASS,
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_VAR_VX,
    TRACK_VAR_VY,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
)
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import lane_center, local
from adeye.signals import OBJECT_CLASSES

if TYPE_CHECKING:
    from adeye.signals import Floats

SAMPLES: Final = 16
"""Times at which candidates and predictions are compared, evenly over the horizon."""

# Columns of an object that is predicted.
(
    OBJECT_LENGTH,  # [m]
    OBJECT_WIDTH,
    OBJECT_SINE,  # of its heading against the road's
    OBJECT_COSINE,
    OBJECT_GROWTH,  # how many times faster than a vehicle's its prediction gets unsure
    OBJECT_BEHIND,  # whether all of it is behind the ego
    OBJECT_S,  # along the road from the ego's centre now [m]
    OBJECT_D,  # from the right edge to the left [m]
    OBJECT_SPEED,  # along the road [m/s]
    OBJECT_BRAKING,  # acceleration that it goes on with until it stands, <= 0 [m/s²]
) = range(10)
OBJECT_ROW: Final = 10

# Columns of a predicted place.
(
    WAY_S,  # along the road from the ego's centre now [m]
    WAY_D,  # from the right edge to the left [m]
    WAY_SPEED,  # along the road [m/s]
) = range(3)
WAY_ROW: Final = 3

FREE_GROWTH: Final = 2.5
"""How many times faster the prediction of a cyclist or pedestrian gets unsure. Our choice."""

_LEAST_BRAKING: Final = 1.5
_MOST_BRAKING: Final = 10.0
"""Deceleration of an object that counts as braking, and the most that is believed [m/s²]."""

_TURNING: Final = 2.0
"""Speed from which the direction of motion tells the heading [m/s]."""

_FIRST_FREE: Final = OBJECT_CLASSES.index("cyclist")
_LAST_FREE: Final = OBJECT_CLASSES.index("pedestrian")


@compiled
def predict_objects(  # noqa: PLR0913, PLR0917 - a kernel
    tracks: Floats,
    end: int,
    pose: Floats,
    segments: Floats,
    ego_length: float,
    lane_width: float,
    lanes: int,
    confirm_hits: float,
    interval: float,
    objects: Floats,
    ways: Floats,
) -> int:
    """Predict the confirmed tracks.

    Args:
        tracks: (K, TRACK_STATE).
        end: Rows of tracks from here on are free places.
        pose: (POSE_WIDTH,).
        segments: (R, 5) reference line of the road.
        ego_length: [m].
        lane_width: [m].
        lanes: How many there are.
        confirm_hits: Detections that confirm a track.
        interval: Time between two samples [s]; the first is one interval ahead.
        objects: (K, OBJECT_ROW) out.
        ways: (K, N, WAY_ROW) out, N samples.

    Returns:
        How many objects there are.
    """
    count = 0
    sine, cosine = sin_cos(pose[POSE_HEADING])
    for row in range(end):
        track = tracks[row]
        if track[TRACK_HITS] < confirm_hits or track[TRACK_VAR_VX] > MAX_SPEED_VARIANCE:
            continue
        x = pose[POSE_X] + cosine * track[TRACK_X] - sine * track[TRACK_Y]
        y = pose[POSE_Y] + sine * track[TRACK_X] + cosine * track[TRACK_Y]
        s, d, heading, _ = local(segments, x, y)
        turn_sine, turn_cosine = sin_cos(pose[POSE_HEADING] - heading)
        forward = turn_cosine * track[TRACK_VX] - turn_sine * track[TRACK_VY]
        sideways = turn_sine * track[TRACK_VX] + turn_cosine * track[TRACK_VY]
        if not np.isfinite(s + d + forward + sideways):
            continue
        body = objects[count]
        body[OBJECT_LENGTH], body[OBJECT_WIDTH] = track[TRACK_LENGTH], track[TRACK_WIDTH]
        body[OBJECT_S], body[OBJECT_D] = s - pose[POSE_S], d
        body[OBJECT_SPEED] = forward
        reach = 0.5 * (ego_length + track[TRACK_LENGTH])
        body[OBJECT_BEHIND] = 1.0 if body[OBJECT_S] <= -reach else 0.0
        body[OBJECT_BRAKING] = believed_braking(track[TRACK_BRAKING], forward)
        is_free = _FIRST_FREE <= track[TRACK_CLASS] <= _LAST_FREE
        body[OBJECT_GROWTH] = FREE_GROWTH if is_free else 1.0
        is_sure = abs(sideways) - math.sqrt(track[TRACK_VAR_VY]) >= MIN_LATERAL_SPEED
        if not is_free and not is_sure:
            sideways = 0.0
        _set_heading(body, forward, sideways)
        goal = sideways * math.inf if sideways != 0.0 else d
        if not is_free and sideways != 0.0:
            goal = lane_ahead(d, sideways, lane_width, lanes)
        _fill_way(body, sideways, goal, interval, ways[count])
        count += 1
    return count


@inlined
def believed_braking(acceleration: float, forward: float) -> float:
    """Return the acceleration that an object is taken to go on with until it stands [m/s²].

    Args:
        acceleration: Of its track [m/s²].
        forward: Its speed along the road [m/s]; one that comes towards the ego does not brake.
    """
    if forward <= 0.0 or acceleration > -_LEAST_BRAKING:
        return 0.0
    return max(-_MOST_BRAKING, acceleration)


@inlined
def lane_ahead(d: float, sideways: float, lane_width: float, lanes: int) -> float:
    """Return where a vehicle that moves sideways will end: the next lane centre that way [m].

    Args:
        d: Where it is [m].
        sideways: Its speed to the left, not 0 [m/s].
        lane_width: [m].
        lanes: How many there are; beyond the outermost centre it goes on, to infinity.
    """
    place = d / lane_width - 0.5
    lane = math.floor(place) + 1.0 if sideways > 0.0 else math.ceil(place) - 1.0
    if lane < 0.0 or lane >= lanes:
        return sideways * math.inf
    return lane_center(int(lane), lane_width)


@inlined
def _set_heading(body: Floats, forward: float, sideways: float) -> None:
    body[OBJECT_SINE], body[OBJECT_COSINE] = 0.0, 1.0
    speed = math.sqrt(forward * forward + sideways * sideways)
    if speed > _TURNING:
        body[OBJECT_SINE], body[OBJECT_COSINE] = sideways / speed, forward / speed


@inlined
def _fill_way(body: Floats, sideways: float, goal: float, interval: float, way: Floats) -> None:
    """Write the places of one object, (N, WAY_ROW), that moves sideways as far as a goal."""
    speed, braking = body[OBJECT_SPEED], body[OBJECT_BRAKING]
    stands = speed / -braking if braking < 0.0 else math.inf
    for sample in range(way.shape[0]):
        time = (sample + 1) * interval
        rolling = min(time, stands)
        way[sample, WAY_S] = body[OBJECT_S] + (speed + 0.5 * braking * rolling) * rolling
        way[sample, WAY_SPEED] = speed + braking * rolling if time < stands else 0.0
        moved = body[OBJECT_D] + sideways * rolling
        way[sample, WAY_D] = min(moved, goal) if sideways > 0.0 else max(moved, goal)


@inlined
def margin_at(margin: float, growth: float, faster: float, time: float) -> float:
    """Return the distance from a predicted object below which a trajectory is too near [m].

    Args:
        margin: Now [m].
        growth: Of a vehicle's prediction [m/s].
        faster: How many times faster it grows, ``OBJECT_GROWTH``.
        time: Of the prediction [s].
    """
    return margin + growth * faster * time
