"""Which tracks are in the ego's path: the corridor along its lane, now and within a short time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.criticality import required_deceleration, time_to_collision
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import inlined
from adeye.kernel.profiles import MIN_LATERAL_SPEED
from adeye.kernel.road import Ground, ground_of, has_strips, lane_way, place_on
from adeye.simulate.channels.perception import tracks as columns
from adeye.simulate.channels.perception.pose import (
    POSE_ALIGN,
    POSE_D,
    POSE_HEADING,
    POSE_S,
    POSE_SPEED,
    POSE_X,
    POSE_Y,
)
from adeye.simulate.channels.perception.step import NOTE_END

if TYPE_CHECKING:
    from adeye.signals import Floats
    from adeye.simulate.channels.perception.step import Seen

# Columns of a view of the path.
(
    PATH_GAP,  # bumper to bumper to the nearest object in the path [m], inf for none
    PATH_SPEED,  # its speed along the road [m/s]
    PATH_REQUIRED,  # greatest required deceleration for any object in the path [m/s²]
) = range(3)
PATH_WIDTH: Final = 3

PREDICTION: Final = 3.0
"""How far ahead a crossing object is predicted at constant velocity [s]. Our choice: about the time
in which a car stops from 13.9 m/s (50 km/h) with 6 m/s² after 0.75 s."""

SOON: Final = 1.0
"""An object that will be in the corridor this soon counts as in it, whoever passes first [s]. UN
R157 5.2.5.2 counts a cut-in as seen when its lateral movement is visible for 0.72 s before the lane
is taken (0.3 m past its marking); a little more here. Our choice."""

PASSING_MARGIN: Final = 0.5
"""How close in time to the ego's own passage an object may use the corridor [s]. Our choice."""

_LEAST_BRAKING: Final = 1.5
_MOST_BRAKING: Final = 10.0
"""Deceleration of an object ahead that counts as braking, and the most that is believed [m/s²]."""

_CROSSING: Final = 1.0
"""Velocity across the road from which it tells a heading, beyond what may be error [m/s]. Ours."""

MAX_SPEED_VARIANCE: Final = 36.0
"""Variance of a track's speed above which it does not count yet [m²/s²]: one that has just begun
would take every vehicle for a standing one. With 6 m/s of error a gap of 20 m seems to require
1 m/s² where none is. Our choice."""


@inlined
def view_path(seen: Seen, run: int, path_d: float, path: Floats) -> None:
    """Find the nearest object in the path, and the greatest deceleration that any requires.

    Args:
        seen: What the channel has perceived; its records have ``length`` and ``width`` of the ego
            [m], ``lateral_margin``: how much nearer than touching an object's side must come to
            count [m], and ``confirm_hits``: detections that confirm a track.
        run: Which row is meant.
        path_d: Lateral place of the path: the centre of the ego's lane [m].
        path: (PATH_WIDTH,) out.
    """
    record, pose, tracks = seen.records[run], seen.pose[run], seen.tracks[run]
    ego_length, ego_width = record["length"], record["width"]
    confirm_hits = record["confirm_hits"]
    path[PATH_GAP] = math.inf
    path[PATH_SPEED] = 0.0
    path[PATH_REQUIRED] = 0.0
    ego_s, ego_d, ego_x, ego_y = pose[POSE_S], pose[POSE_D], pose[POSE_X], pose[POSE_Y]
    ego_heading = pose[POSE_HEADING]
    road = ego_heading - pose[POSE_ALIGN]
    sine, cosine = sin_cos(ego_heading)
    # Seldom is it not the angle that the next track needs, too.
    turn = pose[POSE_ALIGN]
    turn_sine, turn_cosine = sin_cos(turn) if turn != ego_heading else (sine, cosine)
    speed = pose[POSE_SPEED] * turn_cosine
    ground = ground_of(seen.grounds, run)
    for row in range(int(seen.notes[run, NOTE_END])):
        if (
            tracks[row, columns.TRACK_HITS] < confirm_hits
            or tracks[row, columns.TRACK_VAR_VX] > MAX_SPEED_VARIANCE
        ):
            continue
        track = tracks[row]
        x = ego_x + cosine * track[columns.TRACK_X] - sine * track[columns.TRACK_Y]
        y = ego_y + sine * track[columns.TRACK_X] + cosine * track[columns.TRACK_Y]
        s, d, heading, _ = place_on(ground, x, y)
        if s <= ego_s:
            continue
        apart = lane_way(ego_s, road, ego_d, s, heading)
        # Zeros are equal although their signs may differ, so they do not count as known.
        if ego_heading - heading != turn or turn == 0.0:
            turn = ego_heading - heading
            turn_sine, turn_cosine = sin_cos(turn)
        forward = turn_cosine * track[columns.TRACK_VX] - turn_sine * track[columns.TRACK_VY]
        sideways = turn_sine * track[columns.TRACK_VX] + turn_cosine * track[columns.TRACK_VY]
        long, wide = extent_of(track, forward, sideways, ground)
        gap = apart - 0.5 * (ego_length + long)
        half = 0.5 * (ego_width + wide) + record["lateral_margin"]
        offset = offset_from_corridor(d, path_d, ego_d)
        length = ego_length + long
        # Towards the corridor, as far as the track is sure of it.
        inward = -sideways if offset > 0.0 else sideways
        inward -= math.sqrt(track[columns.TRACK_VAR_VY])
        if not uses_path(abs(offset), inward, half, gap, length, speed - forward):
            continue
        # Oncoming: to stop before the place is what the ego can do about it.
        ahead = max(0.0, forward)
        braking = max(-_MOST_BRAKING, track[columns.TRACK_BRAKING])
        if ahead <= 0.0 or braking > -_LEAST_BRAKING:
            braking = 0.0
        path[PATH_REQUIRED] = max(
            path[PATH_REQUIRED], required_deceleration(gap, speed, ahead, braking)
        )
        if gap < path[PATH_GAP]:
            path[PATH_GAP] = gap
            path[PATH_SPEED] = ahead


@inlined
def extent_of(
    track: Floats, forward: float, sideways: float, ground: Ground
) -> tuple[float, float]:
    """Return how far a track reaches along the road and across it [m].

    It heads where it goes: what surely goes rather across the road than along, and no slower than
    ``_CROSSING``, lies across it. Where lanes are not told strip by strip all is taken to lie
    along, as results there always had it.

    Args:
        track: (TRACK_STATE,).
        forward: Its velocity along the road [m/s].
        sideways: Across [m/s].
        ground: The road.
    """
    length, width = track[columns.TRACK_LENGTH], track[columns.TRACK_WIDTH]
    sure = abs(sideways) - math.sqrt(track[columns.TRACK_VAR_VY])
    if not has_strips(ground) or not sure > max(abs(forward), _CROSSING):
        return length, width
    speed = math.sqrt(forward * forward + sideways * sideways)
    along, across = abs(forward) / speed, abs(sideways) / speed
    return length * along + width * across, length * across + width * along


@inlined
def offset_from_corridor(d: float, path_d: float, ego_d: float) -> float:
    """Lateral distance from the strip between the path and the ego itself [m], left positive.

    An ego beside the centre of its lane blocks the strip between, on its way back.

    Args:
        d: Lateral place of the object [m].
        path_d: Lateral place of the path [m].
        ego_d: Lateral place of the ego [m].
    """
    left, right = max(path_d, ego_d), min(path_d, ego_d)
    if d > left:
        return d - left
    return d - right if d < right else 0.0


@inlined
def uses_path(
    offset: float, inward: float, half: float, gap: float, length: float, closing: float
) -> bool:
    """Tell whether an object is in the corridor or will be when the ego comes by.

    Args:
        offset: Lateral distance from the corridor's centre strip, >= 0 [m].
        inward: Its lateral speed towards that strip [m/s].
        half: Lateral distance from which the two touch, with margin [m].
        gap: Bumper-to-bumper distance along the road [m].
        length: Of ego and object together [m].
        closing: Ego speed minus its speed along the road [m/s].

    Returns:
        True if it is inside, will be within ``SOON``, or, at constant velocities, is inside within
        ``PREDICTION`` while the ego passes.
    """
    beyond = offset - half
    if beyond <= 0.0:
        return True
    if not inward >= MIN_LATERAL_SPEED:
        return False
    enters = beyond / inward
    if enters <= SOON:
        return True
    leaves = (offset + half) / inward
    arrives = time_to_collision(gap, closing)
    passed = time_to_collision(gap + length, closing)
    return bool(
        enters <= PREDICTION
        and enters <= passed + PASSING_MARGIN
        and leaves >= arrives - PASSING_MARGIN
        and np.isfinite(arrives)
    )
