"""The library of safe stops: lateral paths and decelerations to standstill, in closed form.

A stop is a path along the road and a profile of the speed along it. Which of them can be had
depends on the road and on limits of the lateral movement; who is in the way is for the caller to
ask.

The worst cell under a body counts. The planner of safe stops, the evaluation of a trace and the
picture of the grid map all call these functions, so they cannot disagree.

Path and profile depend on each other here. The profile goes on at the present speed until the
deceleration of its level just brings the ego to its place; the path leaves the lane as late as the
lateral limits allow at the speeds that the profile then has.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from adeye.kernel.criticality import stopping_distance
from adeye.kernel.elementary import power
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import (
    PATH_3,
    PATH_4,
    PATH_5,
    PATH_EXISTS,
    PATH_IS_FLAT,
    PATH_LANE,
    PATH_LENGTH,
    PATH_START,
    PATH_TARGET,
    PEAK,
    PROFILE_ACCELERATION,
    PROFILE_ROW,
    PROFILE_S,
    PROFILE_SPEED,
    at_path,
    fill_profile,
    lay_path,
)
from adeye.kernel.road import (
    NO_REFUGE,
    REST_AREA,
    Ground,
    body_edge,
    center_beside,
    curvature_at,
    is_beside,
    is_in_refuge,
    lane_center,
    lane_of,
    lanes_right,
    left_edge,
    limit_at,
    refuge_depth,
    right_edge,
    shoulder_middle,
    shoulder_width,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

# --- How safe a place is to stand in: an ordinal scale, cell by cell ------------------------------

SCALE: Final = (
    "refuge or parking place",
    "hard shoulder",
    "free verge",
    "slow lane with sight distance",
    "slow lane",
    "fast lane",
    "curve, crest, tunnel, bridge, ramp or junction",
    "obstructing",
    "contact",
)
"""The scale in words, from the safest place to contact. Our choice."""

CONTACT: Final = 8.0
"""Rating of a place that is occupied."""

# Kinds of places that a road of this kind has, in the order of the table of rules.
(
    RULE_REFUGE,
    RULE_SHOULDER,
    RULE_VERGE,
    RULE_SLOW_LANE_IN_SIGHT,
    RULE_SLOW_LANE,
    RULE_FAST_LANE,
    RULE_CURVE,
    RULE_OFF_ROAD,
) = range(8)
RULES: Final = 8

RULE_NAMES: Final = (
    "refuge",
    "hard_shoulder",
    "verge",
    "slow_lane_in_sight",
    "slow_lane",
    "fast_lane",
    "curve",
    "off_road",
)
"""Names of these kinds."""

DEFAULT_RULES: Final = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
"""What each is rated. Ground beside lanes and shoulder of which the map says nothing is not taken
for a free verge."""

CELL: Final = 0.5
"""Largest edge of a cell [m]."""

_CALM: Final = (1.0, 4.0)
_BRISK: Final = (0.5, 5.0)
"""Reaction time [s] and deceleration [m/s²] of who comes from behind: one who need not hurry, one
who must. Our choice."""


@inlined
def sight_distance(curvature: float, inside: float) -> float:
    """Return how far a driver sees along a curve if the view ends at the inner edge of the road.

    Args:
        curvature: Of the driver's line [1/m].
        inside: From this line to the edge on the inside of the curve [m].

    Returns:
        Along the line [m], infinity on a straight.

    Source:
        AASHTO (2018), "A Policy on Geometric Design of Highways and Streets", horizontal sightline
        offset, for small angles: offset = distance² / (8 radius).
    """
    bend = abs(curvature)
    return math.sqrt(8.0 * max(0.0, inside) / bend) if bend > 0.0 else math.inf


@inlined
def place_kind(ground: Ground, s: float, d: float) -> int:
    """Return what kind of place a cell is, an index into the rules.

    Args:
        ground: Where it is.
        s: Along the road [m].
        d: From the right edge to the left [m].
    """
    shoulder = shoulder_width(ground, s)
    if not right_edge(ground, s) <= d <= left_edge(ground, s):
        return RULE_OFF_ROAD
    if d < lanes_right(ground, s) - shoulder:
        depth = refuge_depth(ground.refuges, s)
        return RULE_REFUGE if d >= -shoulder - depth else RULE_VERGE
    if is_beside(ground, s, d):
        return RULE_SHOULDER
    return _lane_kind(ground, s, d)


@inlined
def _lane_kind(ground: Ground, s: float, d: float) -> int:
    """Return what kind of place a cell in a lane is; see ``place_kind``."""
    curvature, limit = curvature_at(ground.segments, s), limit_at(ground, s, d)
    lane = max(0, lane_of(ground, s, d))
    middle = lane_center(ground, s, lane)
    left = left_edge(ground, s) - middle
    right = middle - (lanes_right(ground, s) - shoulder_width(ground, s))
    sight = sight_distance(curvature, left if curvature > 0.0 else right)
    if sight < stopping_distance(limit, _BRISK[0], _BRISK[1]):
        return RULE_CURVE
    if lane > 0:
        return RULE_FAST_LANE
    if sight < stopping_distance(limit, _CALM[0], _CALM[1]):
        return RULE_SLOW_LANE
    return RULE_SLOW_LANE_IN_SIGHT


@compiled
def rate_footprint(
    rules: Floats, ground: Ground, s: float, d: float, slope: float, length: float, width: float
) -> float:
    """Return the rating of standing somewhere: that of the worst cell under the body.

    Road coordinates are taken as straight over the length of the body.

    Args:
        rules: (RULES,) rating of each kind of place.
        ground: Where it stands.
        s: Of the centre of the body along the road [m].
        d: From the right edge to the left [m].
        slope: Tangent of the heading against the road's.
        length: Of the body [m].
        width: [m].
    """
    along, across = math.ceil(length / CELL), math.ceil(width / CELL)
    cosine = 1.0 / math.sqrt(1.0 + slope * slope)
    sine = slope * cosine
    worst = 0.0
    for i in range(along + 1):
        x = length * (i / along - 0.5)
        for j in range(across + 1):
            y = width * (j / across - 0.5)
            place = s + cosine * x - sine * y
            kind = place_kind(ground, place, d + sine * x + cosine * y)
            worst = max(worst, rules[kind])
    return worst


# --- The library of safe stops: lateral paths and decelerations to standstill, in closed form -----

# Lateral paths.
(
    IN_LANE,  # to the centre of the lane, along its curvature
    STRAIGHT,  # straight on, as with the steering in the middle
    RIGHT_LANE,  # to the centre of the lane to the right
    SHOULDER,  # to the middle of the shoulder
    REFUGE,  # into the next parking bay or rest area, see `kernel.stops`
) = range(5)
STOP_PATHS: Final = 5

STOP_LEVELS: Final = 4
"""Decelerations: gentle, that of the stop, between, emergency."""

STOPS: Final = STOP_PATHS * STOP_LEVELS

LAID_PATHS: Final = REFUGE + STOP_LEVELS
LAID_PROFILES: Final = 2 * STOP_LEVELS
"""Rows of paths and profiles. A profile goes with every path and a path with every profile, but
into a refuge each level has its own path and profile."""

STOP_SAMPLES: Final = 80
STOP_INTERVAL: Final = 0.2
"""Samples of a stop and time between two of them [s]: together 16 s, in which 2.4 m/s² stops from
130 km/h."""

GENTLE: Final = 2.4
"""Deceleration that standing passengers bear [m/s²]: EU 2022/1426."""

ONSET_JERK: Final = 12.65
"""Growth of the braking of a stop that no object hurries [m/s³]: that of the careful and competent
driver of UN R157."""

BRAKES_AT_ONCE: Final = 100.0
"""Growth of the braking for an object ahead [m/s³]: none that is slower than the actuator's own."""

LATERAL_ACCELERATION: Final = 2.0
LATERAL_JERK: Final = 5.0
"""Lateral acceleration and jerk of a stop on top of those of the road [m/s²], [m/s³]. The jerk is
that which UN R79, 5.6.2.1.3 allows lane keeping systems on average over half a second; the
acceleration is our choice below the 3 m/s² there, because the curve has its share, too."""

LATERAL_SHARE: Final = 0.8
"""Share of these limits that a path is laid out for: braking adds to the jerk. Our choice."""

JERK_PEAK: Final = 60.0
"""Largest third derivative of the quintic from rest to rest, over a length and a height of 1."""

_SETTLING: Final = 2.0
"""Least time of a path within the lane [s]. Our choice."""

_FAR: Final = 1e4
"""Length of the path straight on [m]: none reaches it."""


@inlined
def path_of(stop: int) -> int:
    """Return the row of the path of a stop."""
    row = stop // STOP_LEVELS
    return row if row < REFUGE else REFUGE + stop % STOP_LEVELS


@inlined
def profile_of(stop: int) -> int:
    """Return the row of the profile of a stop."""
    level = stop % STOP_LEVELS
    return level if stop // STOP_LEVELS < REFUGE else STOP_LEVELS + level


@inlined
def stop_level(record: Any, level: int) -> float:
    """Return the deceleration of a level [m/s²].

    Args:
        record: Has ``stop_deceleration`` and ``emergency_deceleration`` [m/s²].
        level: 0 gentle, 1 the stop deceleration, 2 half way, 3 emergency.
    """
    wanted = record["stop_deceleration"]
    hardest = max(wanted, record["emergency_deceleration"])
    if level == 0:
        return float(min(GENTLE, wanted))
    if level == 1:
        return float(wanted)
    return float(0.5 * (wanted + hardest) if level == 2 else hardest)


@inlined
def stop_jerk(level: int) -> float:
    """Return how quickly the braking of a level is built up [m/s³]."""
    return ONSET_JERK if level <= 1 else BRAKES_AT_ONCE


@compiled
def fill_stop(
    speed: float,
    acceleration: float,
    deceleration: float,
    jerk: float,
    wait: float,
    profile: Floats,
) -> float:
    """Go on for a while, then brake to standstill.

    Args:
        speed: Now, >= 0 [m/s].
        acceleration: Now [m/s²]; kept while waiting.
        deceleration: > 0 [m/s²].
        jerk: A magnitude, > 0 [m/s³].
        wait: Time before the braking begins to change [s].
        profile: (STOP_SAMPLES, PROFILE_ROW) out; stays where it stands.

    Returns:
        Way that is driven while waiting [m].
    """
    begun = wait
    if acceleration < 0.0 and speed + acceleration * wait < 0.0:
        begun = speed / -acceleration
    way = (speed + 0.5 * acceleration * begun) * begun
    later = max(0.0, speed + acceleration * begun)
    fill_profile(later, acceleration, -deceleration, jerk, STOP_INTERVAL, wait, profile)
    for sample in range(STOP_SAMPLES):
        time = (sample + 1) * STOP_INTERVAL
        profile[sample, PROFILE_S] += way
        if time < wait:
            part = min(time, begun)
            profile[sample, PROFILE_S] = (speed + 0.5 * acceleration * part) * part
            profile[sample, PROFILE_SPEED] = max(0.0, speed + acceleration * part)
            profile[sample, PROFILE_ACCELERATION] = acceleration if time < begun else 0.0
    return way


@inlined
def stands_at(profile: Floats) -> int:
    """Return the first sample (STOP_SAMPLES, PROFILE_ROW) at standstill; all of them if none."""
    for sample in range(STOP_SAMPLES):
        if profile[sample, PROFILE_SPEED] <= 0.0:
            return sample
    return STOP_SAMPLES


@inlined
def stop_length(record: Any, speed: float, height: float) -> float:
    """Return the length of the shortest path to the side within the lateral limits [m].

    Args:
        record: Has ``max_curvature`` of the vehicle [1/m].
        speed: At its start [m/s].
        height: How far aside it leads [m].
    """
    high = abs(height)
    wide = math.sqrt(PEAK * high / (LATERAL_SHARE * LATERAL_ACCELERATION)) * speed
    smooth = power(JERK_PEAK * high / (LATERAL_SHARE * LATERAL_JERK), 1.0 / 3.0) * speed
    return max(wide, smooth, math.sqrt(PEAK * high / (LATERAL_SHARE * record["max_curvature"])))


@compiled
def lay_stops(
    record: Any,
    ground: Ground,
    s: float,
    d: float,
    slope: float,
    bend: float,
    speed: float,
    center: float,
    curvature: float,
    driven: Floats,
    paths: Floats,
) -> None:
    """Lay the lateral paths from a lateral state, but for those into a refuge.

    Args:
        record: Has ``width`` and ``max_curvature`` of the vehicle.
        ground: The road.
        s: Where they begin along the road [m].
        d: Lateral place there, from the right edge to the left [m].
        slope: Its change along the road.
        bend: The change of that [1/m].
        speed: There [m/s].
        center: Centre of the ego's lane [m].
        curvature: Of the road [1/m].
        driven: (PATH_ROW,) path that is being driven, its target NaN for none: what has been begun
            is finished as it was begun.
        paths: (LAID_PATHS, PATH_ROW) out.
    """
    for row in range(REFUGE):
        path = paths[row]
        target, exists = center, True
        if row == RIGHT_LANE:
            target = center_beside(ground, s, center, -1.0)
            exists = lane_of(ground, s, target) >= 0
        elif row == SHOULDER:
            target = shoulder_middle(ground, s)
            exists = shoulder_width(ground, s) >= record["width"]
        path[PATH_EXISTS] = 1.0 if exists else 0.0
        path[PATH_LANE] = math.nan if row == SHOULDER else target
        if row == STRAIGHT:
            _lay_straight(path, s, d, slope, curvature)
            continue
        length = stop_length(record, speed, target - d)
        if row == IN_LANE:
            length = max(length, _SETTLING * speed)
        if abs(target - driven[PATH_TARGET]) < 0.01:
            length = max(0.0, driven[PATH_START] + driven[PATH_LENGTH] - s)
        lay_path(path, s, d, slope, bend, target, length)


@inlined
def _lay_straight(path: Floats, s: float, d: float, slope: float, curvature: float) -> None:
    """Lay the path straight on: its bend against the road is the opposite of the road's."""
    lay_path(path, s, d, slope, -curvature, d, _FAR)
    path[PATH_IS_FLAT] = 0.0
    path[PATH_3] = path[PATH_4] = path[PATH_5] = 0.0
    path[PATH_TARGET] = math.nan


@inlined
def lateral_movement(
    path: Floats, way: float, speed: float, acceleration: float
) -> tuple[float, float]:
    """Return lateral acceleration [m/s²] and jerk [m/s³] on top of the road's.

    Args:
        path: (PATH_ROW,).
        way: From its start [m].
        speed: Along the road [m/s].
        acceleration: [m/s²].
    """
    _, slope, bend = at_path(path, way)
    aside = speed * speed * bend + acceleration * slope
    if path[PATH_IS_FLAT] > 0.0 or not 0.0 <= way < path[PATH_LENGTH]:
        return aside, 0.0
    per = 1.0 / path[PATH_LENGTH]
    u = way * per
    third = 6.0 * path[PATH_3] + u * (24.0 * path[PATH_4] + u * 60.0 * path[PATH_5])
    jerk = speed * speed * speed * third * per * per * per
    return aside, jerk + 3.0 * speed * acceleration * bend


@compiled
def fits_limits(
    record: Any, ground: Ground, path: Floats, begun: float, profile: Floats, d: float
) -> bool:
    """Tell whether a stop keeps to the lateral limits and between the edges of the road.

    The path straight on has no limits: it is what the vehicle does without steering.

    Args:
        record: Has ``width`` and ``length``.
        ground: The road.
        path: (PATH_ROW,).
        begun: Way along the path that is behind the ego [m].
        profile: (STOP_SAMPLES, PROFILE_ROW).
        d: Of the ego now [m]; who is beyond an edge already may come back.
    """
    half = 0.5 * record["width"]
    end = stands_at(profile)
    for sample in range(min(end + 1, STOP_SAMPLES)):
        way = begun + profile[sample, PROFILE_S]
        speed, braking = profile[sample, PROFILE_SPEED], profile[sample, PROFILE_ACCELERATION]
        place, slope, _ = at_path(path, way)
        reach = half + 0.5 * record["length"] * abs(slope)
        s = path[PATH_START] + way
        lowest = min(body_edge(ground, s, slope, record["length"], record["width"]), d)
        highest = max(left_edge(ground, s) - reach, d)
        if not lowest - 1e-9 <= place <= highest + 1e-9:
            return False
        aside, jerk = lateral_movement(path, way, speed, braking)
        if math.isnan(path[PATH_TARGET]):
            continue
        if abs(aside) > LATERAL_ACCELERATION or abs(jerk) > LATERAL_JERK:
            return False
    return True


@compiled
def rate_stop(
    record: Any, rules: Floats, ground: Ground, s: float, path: Floats, profile: Floats
) -> float:
    """Return the rating of the place where a stop ends, see ``kernel.stops``.

    Args:
        record: Has the body of the ego.
        rules: (RULES,).
        ground: The road.
        s: Of the ego now [m].
        path: (PATH_ROW,).
        profile: (STOP_SAMPLES, PROFILE_ROW).
    """
    end = s + profile[STOP_SAMPLES - 1, PROFILE_S]
    d, slope, _ = at_path(path, end - path[PATH_START])
    return rate_footprint(rules, ground, end, d, slope, record["length"], record["width"])


# --- Stops in parking bays and rest areas: drive on in the lane, enter, stand in the middle -------

# Columns of a refuge, as `signals.REFUGE_COLUMNS`.
_KIND, _S, _LENGTH, _DEPTH = range(4)

# Places that a stop may be asked for, each among those before it.
(
    ANYWHERE,
    ROADSIDE,  # shoulder, parking bay or rest area
    ONLY_REST_AREA,
) = range(3)

ROOM_ALONG: Final = 2.0
"""Between the body and the ends of the full depth [m]. Our choice."""

ROOM_BESIDE: Final = 1.5
"""Between the body and the shoulder, where the refuge is deep enough for as much on the other side
[m]. Our choice."""

ASTRAY: Final = 0.5
"""From the centre of the lane: who is farther off does not drive on along it before it leaves it
[m]. Our choice."""

CRAWL: Final = 1.0
"""Speed below which a stop that was begun is finished where it ends [m/s]. Our choice."""


class Approach(NamedTuple):
    """From where a refuge is approached.

    Attributes:
        record: Has the body, ``max_curvature``, ``acceleration_lag`` and the two decelerations.
        ground: The road.
        here: s, d, speed and acceleration of the ego now.
        start: s, d, slope and bend where a path would begin, after the wait.
        wait: Time before a stop begins [s].
        center: Centre of the ego's lane [m].
        driven: (PATH_ROW,) path of the stop in a refuge that is being driven.
    """

    record: Any
    ground: Ground
    here: tuple[float, float, float, float]
    start: tuple[float, float, float, float]
    wait: float
    center: float
    driven: Floats


@compiled
def lay_refuge_stops(
    approach: Approach, places: int, kept: int, paths: Floats, profiles: Floats
) -> None:
    """Lay path and profile of each level into the first refuge that can be had.

    Args:
        approach: From where.
        places: ``ONLY_REST_AREA`` leaves parking bays out.
        kept: Level of the stop in a refuge that is being driven, -1 for none.
        paths: (LAID_PATHS, PATH_ROW) out, those of the refuge only.
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW) out, those of the refuge only; the
            others are filled.
    """
    ground = approach.ground
    for level in range(STOP_LEVELS):
        stop = REFUGE * STOP_LEVELS + level
        path, profile = paths[path_of(stop)], profiles[profile_of(stop)]
        path[PATH_EXISTS] = 0.0
        at_once = profiles[level]
        if stands_at(at_once) == STOP_SAMPLES:
            continue
        for row in range(ground.refuges.shape[0]):
            refuge = ground.refuges[row]
            if places == ONLY_REST_AREA and refuge[_KIND] != REST_AREA:
                continue
            for sample in range(STOP_SAMPLES):
                for item in range(PROFILE_ROW):
                    profile[sample, item] = at_once[sample, item]
            if _enters(approach, refuge, kept == level, level, path, profile):
                path[PATH_EXISTS], path[PATH_LANE] = 1.0, math.nan
                break


@compiled
def _enters(
    approach: Approach,
    refuge: Floats,
    is_kept: bool,  # noqa: FBT001 - a kernel
    level: int,
    path: Floats,
    profile: Floats,
) -> bool:
    """Lay path and profile of a level into one refuge; tell whether it can be had.

    ``profile`` holds that of braking at once.
    """
    record, ground, here, start = approach.record, approach.ground, approach.here, approach.start
    center, driven = approach.center, approach.driven
    first, last = standing_room(record, refuge)
    target, middle = refuge_target(record, ground, refuge), 0.5 * (first + last)
    soonest = here[0] + profile[STOP_SAMPLES - 1, PROFILE_S]
    # The brakes may miss a place by part of the room that was left for it.
    farthest = last + 0.5 * ROOM_ALONG if is_kept else last
    if first > last or refuge[_DEPTH] < record["width"] or soonest > farthest:
        return False
    begun = driven[PATH_START] + driven[PATH_LENGTH]
    if is_kept and first <= begun <= last:
        brakes = here[3] < -0.5 * stop_level(record, level) or here[2] < CRAWL
        if not (brakes and soonest >= first):
            _drive_on(approach, level, max(begun, soonest), profile)
        if driven[PATH_START] > start[0]:
            lay_path(path, driven[PATH_START], center, 0.0, 0.0, target, driven[PATH_LENGTH])
        else:
            rest = max(0.0, begun - start[0])
            lay_path(path, start[0], start[1], start[2], start[3], target, rest)
        return stands_at(profile) < STOP_SAMPLES
    # In its middle; nearer where there is no time for it, farther where there is no way to turn in.
    spare = STOP_INTERVAL * (STOP_SAMPLES - 2.0 - stands_at(profile))
    last = min(last, soonest + here[2] * spare)
    if last < first:
        return False
    for end in (min(last, max(middle, soonest)), last):
        _drive_on(approach, level, end, profile)
        if stands_at(profile) == STOP_SAMPLES:
            return False
        length = entry_length(record, here[2], stop_level(record, level), target - center)
        if end - length <= start[0] or abs(start[1] - center) > ASTRAY:
            lay_path(path, start[0], start[1], start[2], start[3], target, end - start[0])
        else:
            lay_path(path, end - length, center, 0.0, 0.0, target, length)
        if fits_limits(record, ground, path, here[0] - path[PATH_START], profile, here[1]):
            return True
    return False


@inlined
def standing_room(record: Any, refuge: Floats) -> tuple[float, float]:
    """Return the first and the last s at which the body stands within the full depth [m]."""
    room = 0.5 * record["length"] + ROOM_ALONG
    return refuge[_S] + room, refuge[_S] + refuge[_LENGTH] - room


@inlined
def refuge_target(record: Any, ground: Ground, refuge: Floats) -> float:
    """Return the lateral place of a body that stands in a refuge [m]: in its middle, or nearer."""
    beside = min(0.5 * refuge[_DEPTH], 0.5 * record["width"] + ROOM_BESIDE)
    return -shoulder_width(ground, refuge[_S]) - beside


@inlined
def entry_length(record: Any, speed: float, deceleration: float, height: float) -> float:
    """Return the length of the shortest path that ends at standstill within the lateral limits [m].

    The limits bind at its start, where the speed is ``min(speed, sqrt(2 deceleration length))`` and
    the length must be that speed times a time.

    Args:
        record: Has ``max_curvature`` of the vehicle [1/m].
        speed: Before the ego brakes [m/s].
        deceleration: To standstill at its end [m/s²].
        height: How far aside it leads [m].
    """
    high = abs(height)
    wide = math.sqrt(PEAK * high / (LATERAL_SHARE * LATERAL_ACCELERATION))
    time = max(wide, power(JERK_PEAK * high / (LATERAL_SHARE * LATERAL_JERK), 1.0 / 3.0))
    tight = math.sqrt(PEAK * high / (LATERAL_SHARE * record["max_curvature"]))
    return max(tight, time * min(speed, 2.0 * deceleration * time))


@inlined
def _drive_on(approach: Approach, level: int, end: float, profile: Floats) -> None:
    """Fill a profile (STOP_SAMPLES, PROFILE_ROW) that stands at an s, if it has the way for it.

    The present acceleration is taken to end at once, for the change of speed that it leaves.
    """
    record, here, wait = approach.record, approach.here, approach.wait
    wanted, jerk, lag = stop_level(record, level), stop_jerk(level), record["acceleration_lag"]
    speed = max(0.0, here[2] + 0.5 * here[3] * abs(here[3]) / ONSET_JERK)
    fill_stop(speed, 0.0, wanted, jerk, lag, profile)
    spare = end - here[0] - profile[STOP_SAMPLES - 1, PROFILE_S]
    later = max(wait, spare / speed) if speed > 0.0 else wait
    fill_stop(speed, 0.0, wanted, jerk, later + lag, profile)


@inlined
def refuge_of(record: Any, ground: Ground, s: float, path: Floats, profile: Floats) -> int:
    """Return the kind of the refuge that the body wholly stands in after a stop, or ``NO_REFUGE``.

    Args:
        record: Has the body of the ego.
        ground: The road.
        s: Of the ego now [m].
        path: (PATH_ROW,).
        profile: (STOP_SAMPLES, PROFILE_ROW).
    """
    end = s + profile[STOP_SAMPLES - 1, PROFILE_S]
    d, slope, _ = at_path(path, end - path[PATH_START])
    kind = NO_REFUGE
    for row in range(ground.refuges.shape[0]):
        refuge = ground.refuges[row]
        if is_in_refuge(ground, refuge, end, d, slope, record["length"], record["width"]):
            kind = int(refuge[_KIND])
    return kind
