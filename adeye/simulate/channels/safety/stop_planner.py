"""The planner of safe stops: judge every stop of the library, and choose.

A stop is feasible if it keeps to its lateral limits and the road, meets no predicted object and
cuts up nobody. Of the feasible ones that with the best rating of its end is taken; if there is
none, the one that does least harm. Who drives behind the ego in its own lane is not asked: to brake
is right whoever follows, and how hard is in the order of the decelerations.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import (
    OBJECT_BEHIND,
    OBJECT_GROWTH,
    PATH_EXISTS,
    PATH_LENGTH,
    PATH_START,
    PATH_TARGET,
    PROFILE_S,
    PROFILE_SPEED,
    WAY_D,
    WAY_S,
    WAY_SPEED,
    at_path,
    margin_at,
)
from adeye.kernel.road import NO_REFUGE, REST_AREA
from adeye.kernel.stops import (
    ANYWHERE,
    IN_LANE,
    ONLY_REST_AREA,
    REFUGE,
    RIGHT_LANE,
    ROADSIDE,
    SHOULDER,
    STOP_INTERVAL,
    STOP_LEVELS,
    STOP_SAMPLES,
    STOPS,
    STRAIGHT,
    fill_stop,
    fits_limits,
    lay_refuge_stops,
    lay_stops,
    path_of,
    profile_of,
    rate_stop,
    refuge_of,
    stands_at,
    stop_jerk,
    stop_level,
)
from adeye.simulate.channels.perception.pose import (
    POSE_ACCELERATION,
    POSE_ALIGN,
    POSE_CURVATURE,
    POSE_D,
    POSE_S,
    POSE_SPEED,
)
from adeye.simulate.channels.trajectory.candidates import LOST
from adeye.simulate.channels.trajectory.cost import is_cut_up, overlap

if TYPE_CHECKING:
    from adeye.signals import Floats

# --- Whether a safe stop cuts up somebody in a lane that it enters or crosses ---------------------


@inlined
def cuts_up(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    row: int,
    path: Floats,
    begun: float,
    profile: Floats,
    count: int,
    objects: Floats,
    ways: Floats,
) -> bool:
    """Tell whether a path to the right cuts up somebody in a lane that it enters or crosses.

    Args:
        record: See ``trajectory.obstacles.is_cut_up``.
        pose: (POSE_WIDTH,).
        row: Which of the paths it is.
        path: (PATH_ROW,).
        begun: Way along the path that is behind the ego [m].
        profile: (STOP_SAMPLES, PROFILE_ROW).
        count: How many objects there are.
        objects: (K, OBJECT_ROW).
        ways: (K, STOP_SAMPLES, WAY_ROW).
    """
    target, width = path[PATH_TARGET], record["lane_width"]
    speed = 0.0
    if np.isnan(target) or target < 0.0:
        # Only those who come before the ego has left the lane count.
        for sample in range(STOP_SAMPLES):
            way = begun + profile[sample, PROFILE_S]
            is_out = way >= path[PATH_LENGTH]
            if row == REFUGE:
                is_out = at_path(path, way)[0] <= -0.5 * record["width"]
            if is_out:
                speed = profile[sample, PROFILE_SPEED]
                break
        if is_cut_up(record, target, False, pose[POSE_D], 0.0, objects, ways, count):  # noqa: FBT003
            return True
    lane = 0.5 * width
    while lane < pose[POSE_D] - 0.5 * width:
        if lane >= target - 0.01 and is_cut_up(
            record,
            lane,
            True,  # noqa: FBT003 - a kernel
            pose[POSE_D],
            speed,
            objects,
            ways,
            count,
        ):
            return True
        lane += width
    return False


@inlined
def strays(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    center: float,
    path: Floats,
    begun: float,
    profile: Floats,
    count: int,
    objects: Floats,
    ways: Floats,
) -> bool:
    """Tell whether straight on leads into a lane in which it cuts up somebody.

    Args:
        record: See ``trajectory.obstacles.is_cut_up``.
        center: Centre of the ego's lane [m].
        path: (PATH_ROW,).
        begun: Way along the path that is behind the ego [m].
        profile: (STOP_SAMPLES, PROFILE_ROW).
        count: How many objects there are.
        objects: (K, OBJECT_ROW).
        ways: (K, STOP_SAMPLES, WAY_ROW).
    """
    end = at_path(path, begun + profile[STOP_SAMPLES - 1, PROFILE_S])[0]
    width = record["lane_width"]
    beside = 0.5 * (width + record["width"])
    for row in range(int(record["lanes"])):
        lane = (row + 0.5) * width
        # Beyond its own lane as far as the one in which it ends up, if only with its side. Whoever
        # is over the edge of its lane already can still come back, so that is asked, too.
        is_left = center + 0.5 * width < lane < end + beside
        is_right = end - beside < lane < center - 0.5 * width
        if (is_left or is_right) and is_cut_up(
            record,
            lane,
            True,  # noqa: FBT003 - a kernel
            center,
            0.0,
            objects,
            ways,
            count,
        ):
            return True
    return False


# --- The planner of safe stops: judge every stop of the library, and choose -----------------------

# Columns of what is found of a stop.
(
    FOUND_FEASIBLE,
    FOUND_RATING,  # of the place where it ends
    FOUND_IMPACT,  # speed at which it meets an object [m/s], inf for one that cannot be driven
    FOUND_COST,  # rating, and below one what orders stops of one rating
    FOUND_PLACE,  # the most that can be asked of the place and is had: ROADSIDE and so on
) = range(5)
FOUND_ROW: Final = 5

NO_STOP: Final = -1
"""Number of the stop while none has been chosen."""

_LEVEL_COSTS: Final = (0.1, 0.0, 0.3, 0.6)
_PATH_COSTS: Final = (0.0, 0.05, 0.1, 0.0, 0.0)
"""What orders stops of one rating: the stop deceleration before a gentle one before harder ones,
the lane before straight on. Their sums are below one, so the rating comes first. Our choice."""

_GROWS: Final = 4.0
"""Time of the prediction from which its distance grows no more [s]: at 16 s, nothing would be free
beside anybody. Our choice."""

_SAME_IMPACT: Final = 0.5
"""Difference in impact speed for which a choice is not changed [m/s]. Our choice."""


@compiled
def plan_stop(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    rules: Floats,
    segments: Floats,
    refuges: Floats,
    places: int,
    any_will_do: bool,  # noqa: FBT001 - a kernel
    pose: Floats,
    wait: float,
    center: float,
    count: int,
    objects: Floats,
    ways: Floats,
    kept: int,
    driven: Floats,
    paths: Floats,
    profiles: Floats,
    line: Floats,
    found: Floats,
) -> int:
    """Choose a safe stop that begins after a while.

    Args:
        record: Parameters, see ``planned.PlannedSafetyChannel``.
        rules: (RULES,) rating of each kind of place.
        segments: (K, 5) reference line of the road.
        refuges: (R, 5) parking bays and rest areas, see ``signals.REFUGE_COLUMNS``.
        places: Where the ego may stop: ``ANYWHERE``, ``ROADSIDE`` or ``ONLY_REST_AREA``.
        any_will_do: Whether the first feasible stop is the answer, because nothing but its being
            there is asked; ``found`` is filled no further then.
        pose: (POSE_WIDTH,).
        wait: Time before it begins [s].
        center: Centre of the ego's lane [m].
        count: How many objects there are.
        objects: (K, OBJECT_ROW) see ``trajectory.prediction``.
        ways: (K, STOP_SAMPLES, WAY_ROW).
        kept: Stop that is being driven, ``NO_STOP`` for none.
        driven: (PATH_ROW,) its path; in and out.
        paths: (LAID_PATHS, PATH_ROW) out.
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW) out.
        line: (STOP_SAMPLES, 2) scratch.
        found: (STOPS, FOUND_ROW) out.

    Returns:
        The stop that is chosen; ``NO_STOP`` if places are asked for and none can be had.
    """
    s, d, slope, bend = _start(pose, wait, kept, driven)
    speed, curvature = pose[POSE_SPEED], pose[POSE_CURVATURE]
    lay_stops(record, s, d, slope, bend, speed, center, curvature, driven, paths)
    for stop in range(STOPS):
        row, level = stop // STOP_LEVELS, stop % STOP_LEVELS
        # What is laid out as it is needed costs nothing where the first stop will do.
        if row == 0:
            fill_stop(
                speed,
                pose[POSE_ACCELERATION],
                stop_level(record, level),
                stop_jerk(level),
                # The brakes answer to the command with their lag.
                wait + record["acceleration_lag"],
                profiles[level],
            )
        if stop == REFUGE * STOP_LEVELS:
            lay_refuge_stops(
                record,
                refuges,
                places,
                (pose[POSE_S], pose[POSE_D], speed, pose[POSE_ACCELERATION]),
                (s, d, slope, bend),
                wait,
                center,
                kept % STOP_LEVELS if kept // STOP_LEVELS == REFUGE else NO_STOP,
                driven,
                paths,
                profiles,
            )
        path, profile = paths[path_of(stop)], profiles[profile_of(stop)]
        _judge(
            record,
            rules,
            segments,
            refuges,
            pose,
            center,
            row,
            path,
            profile,
            count,
            objects,
            ways,
            line,
            found[stop],
        )
        if any_will_do and found[stop, FOUND_FEASIBLE] > 0.0:
            return stop
        found[stop, FOUND_COST] = found[stop, FOUND_RATING] + _LEVEL_COSTS[level] + _PATH_COSTS[row]
    if kept // STOP_LEVELS == REFUGE and driven[PATH_START] > pose[POSE_S]:
        # On the way to a refuge nothing has been begun: what has come within reach may be milder.
        kept = NO_STOP
    return choose_stop(found, kept, places)


@inlined
def _start(
    pose: Floats, wait: float, kept: int, driven: Floats
) -> tuple[float, float, float, float]:
    """Return where the paths begin: s, d, slope and bend; on the path that is being driven."""
    if kept != NO_STOP:
        d, slope, bend = at_path(driven, pose[POSE_S] - driven[PATH_START])
        if abs(d - pose[POSE_D]) < LOST:
            return pose[POSE_S], d, slope, bend
    driven[PATH_TARGET] = math.nan
    speed = pose[POSE_SPEED]
    later = max(0.0, speed + pose[POSE_ACCELERATION] * wait)
    way = 0.5 * (speed + later) * wait
    slope = sin_cos(pose[POSE_ALIGN])[0]
    return pose[POSE_S] + way, pose[POSE_D] + slope * way, slope, 0.0


@compiled
def _judge(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    rules: Floats,
    segments: Floats,
    refuges: Floats,
    pose: Floats,
    center: float,
    row: int,
    path: Floats,
    profile: Floats,
    count: int,
    objects: Floats,
    ways: Floats,
    line: Floats,
    found: Floats,
) -> None:
    """Find whether a stop is feasible, what it meets and how its end is rated."""
    found[FOUND_FEASIBLE], found[FOUND_RATING] = 0.0, math.inf
    found[FOUND_IMPACT], found[FOUND_PLACE] = math.inf, ANYWHERE
    if path[PATH_EXISTS] == 0.0 or stands_at(profile) == STOP_SAMPLES:
        return
    begun = pose[POSE_S] - path[PATH_START]
    fits = fits_limits(record, refuges, path, begun, profile, pose[POSE_D])
    # To stay in the lane is to be had in any case.
    if not fits and row != IN_LANE:
        return
    if row == SHOULDER:
        found[FOUND_PLACE] = ROADSIDE
    elif row == REFUGE:
        kind = refuge_of(record, refuges, pose[POSE_S], path, profile)
        if kind == NO_REFUGE:
            return
        found[FOUND_PLACE] = ONLY_REST_AREA if kind == REST_AREA else ROADSIDE
    if row in (RIGHT_LANE, SHOULDER, REFUGE) and cuts_up(
        record, pose, row, path, begun, profile, count, objects, ways
    ):
        return
    if row == STRAIGHT and strays(record, center, path, begun, profile, count, objects, ways):
        return
    found[FOUND_RATING] = rate_stop(record, rules, segments, refuges, pose[POSE_S], path, profile)
    is_near, impact = meet_objects(record, path, begun, profile, count, objects, ways, line)
    found[FOUND_FEASIBLE] = 0.0 if is_near or not fits else 1.0
    found[FOUND_IMPACT] = impact


@compiled
def meet_objects(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    path: Floats,
    begun: float,
    profile: Floats,
    count: int,
    objects: Floats,
    ways: Floats,
    line: Floats,
) -> tuple[bool, float]:
    """Drive a stop among the predicted objects until it stands.

    Args:
        record: Has the ego's body, ``lateral_margin`` and ``uncertainty_growth``.
        path: (PATH_ROW,).
        begun: Way along the path that is behind the ego [m].
        profile: (STOP_SAMPLES, PROFILE_ROW).
        count: How many objects there are.
        objects: (K, OBJECT_ROW).
        ways: (K, STOP_SAMPLES, WAY_ROW).
        line: (STOP_SAMPLES, 2) scratch.

    Returns:
        Whether it comes too near to any, and the speed against the first one that it touches [m/s],
        0 for none.
    """
    end = min(stands_at(profile) + 1, STOP_SAMPLES)
    for sample in range(end):
        line[sample, 0], line[sample, 1], _ = at_path(path, begun + profile[sample, PROFILE_S])
    is_near, impact, first = False, 0.0, end
    for row in range(count):
        body, way = objects[row], ways[row]
        if body[OBJECT_BEHIND] > 0.0:
            continue
        for sample in range(min(first + 1, end)):
            closing = abs(profile[sample, PROFILE_SPEED] - way[sample, WAY_SPEED])
            time = min(_GROWS, (sample + 1) * STOP_INTERVAL)
            depth = overlap(
                record,
                way[sample, WAY_S] - profile[sample, PROFILE_S],
                way[sample, WAY_D] - line[sample, 0],
                line[sample, 1],
                body,
                closing * STOP_INTERVAL,
                margin_at(
                    record["lateral_margin"],
                    record["uncertainty_growth"],
                    body[OBJECT_GROWTH],
                    time,
                ),
            )
            is_near = is_near or depth > 0.0
            if depth >= 1.0:
                impact = closing if sample < first else max(impact, closing)
                first = sample
                break
    return is_near, impact


@inlined
def choose_stop(found: Floats, kept: int, places: int) -> int:
    """Choose a stop, and keep the choice unless it is infeasible now or clearly worse.

    Args:
        found: (STOPS, FOUND_ROW).
        kept: Stop that is being driven, ``NO_STOP`` for none.
        places: Where the ego may stop: ``ANYWHERE``, ``ROADSIDE`` or ``ONLY_REST_AREA``.

    Returns:
        The feasible stop that costs least. Without any, ``NO_STOP`` unless it may stop anywhere:
        then that with the lowest impact speed, and of
        several with the lowest rating. Clearly worse is a rating worse than another's, or without a
        feasible one an impact that is noticeably harder.
    """
    best, least = NO_STOP, math.inf
    for stop in range(STOPS):
        is_allowed = found[stop, FOUND_FEASIBLE] > 0.0 and found[stop, FOUND_PLACE] >= places
        if is_allowed and found[stop, FOUND_COST] < least:
            best, least = stop, found[stop, FOUND_COST]
    if best != NO_STOP:
        is_kept = kept != NO_STOP and found[kept, FOUND_PLACE] >= places
        if is_kept and found[kept, FOUND_FEASIBLE] > 0.0:
            return kept if found[kept, FOUND_RATING] <= found[best, FOUND_RATING] else best
        return best
    if places != ANYWHERE:
        return NO_STOP
    best = IN_LANE * STOP_LEVELS + STOP_LEVELS - 1
    for stop in range(STOPS):
        softer = found[stop, FOUND_IMPACT] - found[best, FOUND_IMPACT]
        if softer < 0.0 or (
            found[stop, FOUND_IMPACT] == found[best, FOUND_IMPACT]
            and found[stop, FOUND_COST] < found[best, FOUND_COST]
        ):
            best = stop
    if kept != NO_STOP and found[kept, FOUND_IMPACT] <= found[best, FOUND_IMPACT] + _SAME_IMPACT:
        return kept
    return best
