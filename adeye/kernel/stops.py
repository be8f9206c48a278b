"""The library of safe stops: lateral paths and decelerations to standstill, in closed form.

A stop is a path along the road and a profile of the speed along it. Which of them can be had
depends on the road and on limits of the lateral movement; who is in the way is for the caller to
ask.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

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
    PROFILE_S,
    PROFILE_SPEED,
    at_path,
    fill_profile,
    lay_path,
)
from adeye.kernel.refuges import body_edge
from adeye.kernel.stop_rating import rate_footprint

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

# Lateral paths.
(
    IN_LANE,  # to the centre of the lane, along its curvature
    STRAIGHT,  # straight on, as with the steering in the middle
    RIGHT_LANE,  # to the centre of the lane to the right
    SHOULDER,  # to the middle of the shoulder
    REFUGE,  # into the next parking bay or rest area, see `kernel.refuge_stops`
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
        record: Has ``lane_width``, ``lanes``, ``shoulder``, ``width`` and ``max_curvature``.
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
            target = center - record["lane_width"]
            exists = target > 0.0
        elif row == SHOULDER:
            target = -0.5 * record["shoulder"]
            exists = record["shoulder"] >= record["width"]
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
    record: Any, refuges: Floats, path: Floats, begun: float, profile: Floats, d: float
) -> bool:
    """Tell whether a stop keeps to the lateral limits and between the edges of the road.

    The path straight on has no limits: it is what the vehicle does without steering.

    Args:
        record: Has ``width``, ``length``, ``lane_width``, ``lanes``, ``shoulder`` and ``verge``.
        refuges: (R, 5), see ``signals.REFUGE_COLUMNS``.
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
        edge = body_edge(
            refuges,
            path[PATH_START] + way,
            slope,
            record["length"],
            record["width"],
            record["shoulder"],
            record["verge"],
        )
        lowest = min(edge, d)
        highest = max(record["lanes"] * record["lane_width"] - reach, d)
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
    record: Any,
    rules: Floats,
    segments: Floats,
    refuges: Floats,
    s: float,
    path: Floats,
    profile: Floats,
) -> float:
    """Return the rating of the place where a stop ends, see ``kernel.stop_rating``.

    Args:
        record: Has the body of the ego, the lanes, shoulder, verge and ``speed_limit``.
        rules: (RULES,).
        segments: (K, 5) reference line of the road.
        refuges: (R, 5), see ``signals.REFUGE_COLUMNS``.
        s: Of the ego now [m].
        path: (PATH_ROW,).
        profile: (STOP_SAMPLES, PROFILE_ROW).
    """
    end = s + profile[STOP_SAMPLES - 1, PROFILE_S]
    d, slope, _ = at_path(path, end - path[PATH_START])
    return rate_footprint(
        rules,
        segments,
        refuges,
        end,
        d,
        slope,
        record["length"],
        record["width"],
        record["lane_width"],
        int(record["lanes"]),
        record["shoulder"],
        record["verge"],
        record["speed_limit"],
    )
