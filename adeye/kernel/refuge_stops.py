"""Stops in parking bays and rest areas: drive on in the lane, enter, stand in the middle.

Path and profile depend on each other here. The profile goes on at the present speed until the
deceleration of its level just brings the ego to its place; the path leaves the lane as late as the
lateral limits allow at the speeds that the profile then has.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from adeye.kernel.elementary import power
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_LANE,
    PATH_LENGTH,
    PATH_START,
    PEAK,
    PROFILE_ROW,
    PROFILE_S,
    at_path,
    lay_path,
)
from adeye.kernel.refuges import NO_REFUGE, REST_AREA, is_in_refuge
from adeye.kernel.stops import (
    JERK_PEAK,
    LATERAL_ACCELERATION,
    LATERAL_JERK,
    LATERAL_SHARE,
    ONSET_JERK,
    REFUGE,
    STOP_INTERVAL,
    STOP_LEVELS,
    STOP_SAMPLES,
    fill_stop,
    fits_limits,
    path_of,
    profile_of,
    stands_at,
    stop_jerk,
    stop_level,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

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


@compiled
def lay_refuge_stops(
    record: Any,
    refuges: Floats,
    places: int,
    here: tuple[float, float, float, float],
    start: tuple[float, float, float, float],
    wait: float,
    center: float,
    kept: int,
    driven: Floats,
    paths: Floats,
    profiles: Floats,
) -> None:
    """Lay path and profile of each level into the first refuge that can be had.

    Args:
        record: Has the body, ``lane_width``, ``lanes``, ``shoulder``, ``verge``,
            ``max_curvature``, ``acceleration_lag`` and the two decelerations.
        refuges: (R, 5), see ``signals.REFUGE_COLUMNS``.
        places: ``ONLY_REST_AREA`` leaves parking bays out.
        here: s, d, speed and acceleration of the ego now.
        start: s, d, slope and bend where a path would begin, after the wait.
        wait: Time before a stop begins [s].
        center: Centre of the ego's lane [m].
        kept: Level of the stop in a refuge that is being driven, -1 for none.
        driven: (PATH_ROW,) its path.
        paths: (LAID_PATHS, PATH_ROW) out, those of the refuge only.
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW) out, those of the refuge only; the
            others are filled.
    """
    for level in range(STOP_LEVELS):
        stop = REFUGE * STOP_LEVELS + level
        path, profile = paths[path_of(stop)], profiles[profile_of(stop)]
        path[PATH_EXISTS] = 0.0
        at_once = profiles[level]
        if stands_at(at_once) == STOP_SAMPLES:
            continue
        for row in range(refuges.shape[0]):
            refuge = refuges[row]
            if places == ONLY_REST_AREA and refuge[_KIND] != REST_AREA:
                continue
            for sample in range(STOP_SAMPLES):
                for item in range(PROFILE_ROW):
                    profile[sample, item] = at_once[sample, item]
            if _enters(
                record,
                refuge,
                refuges,
                here,
                start,
                wait,
                center,
                kept == level,
                driven,
                level,
                path,
                profile,
            ):
                path[PATH_EXISTS], path[PATH_LANE] = 1.0, math.nan
                break


@compiled
def _enters(
    record: Any,
    refuge: Floats,
    refuges: Floats,
    here: tuple[float, float, float, float],
    start: tuple[float, float, float, float],
    wait: float,
    center: float,
    is_kept: bool,  # noqa: FBT001 - a kernel
    driven: Floats,
    level: int,
    path: Floats,
    profile: Floats,
) -> bool:
    """Lay path and profile of a level into one refuge; tell whether it can be had.

    ``profile`` holds that of braking at once.
    """
    first, last = standing_room(record, refuge)
    target, middle = refuge_target(record, refuge), 0.5 * (first + last)
    soonest = here[0] + profile[STOP_SAMPLES - 1, PROFILE_S]
    # The brakes may miss a place by part of the room that was left for it.
    farthest = last + 0.5 * ROOM_ALONG if is_kept else last
    if first > last or refuge[_DEPTH] < record["width"] or soonest > farthest:
        return False
    begun = driven[PATH_START] + driven[PATH_LENGTH]
    if is_kept and first <= begun <= last:
        brakes = here[3] < -0.5 * stop_level(record, level) or here[2] < CRAWL
        if not (brakes and soonest >= first):
            _drive_on(record, here, wait, level, max(begun, soonest), profile)
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
        _drive_on(record, here, wait, level, end, profile)
        if stands_at(profile) == STOP_SAMPLES:
            return False
        length = entry_length(record, here[2], stop_level(record, level), target - center)
        if end - length <= start[0] or abs(start[1] - center) > ASTRAY:
            lay_path(path, start[0], start[1], start[2], start[3], target, end - start[0])
        else:
            lay_path(path, end - length, center, 0.0, 0.0, target, length)
        if fits_limits(record, refuges, path, here[0] - path[PATH_START], profile, here[1]):
            return True
    return False


@inlined
def standing_room(record: Any, refuge: Floats) -> tuple[float, float]:
    """Return the first and the last s at which the body stands within the full depth [m]."""
    room = 0.5 * record["length"] + ROOM_ALONG
    return refuge[_S] + room, refuge[_S] + refuge[_LENGTH] - room


@inlined
def refuge_target(record: Any, refuge: Floats) -> float:
    """Return the lateral place of a body that stands in a refuge [m]: in its middle, or nearer."""
    return -record["shoulder"] - min(0.5 * refuge[_DEPTH], 0.5 * record["width"] + ROOM_BESIDE)


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
def _drive_on(
    record: Any,
    here: tuple[float, float, float, float],
    wait: float,
    level: int,
    end: float,
    profile: Floats,
) -> None:
    """Fill a profile (STOP_SAMPLES, PROFILE_ROW) that stands at an s, if it has the way for it.

    The present acceleration is taken to end at once, for the change of speed that it leaves.
    """
    wanted, jerk, lag = stop_level(record, level), stop_jerk(level), record["acceleration_lag"]
    speed = max(0.0, here[2] + 0.5 * here[3] * abs(here[3]) / ONSET_JERK)
    fill_stop(speed, 0.0, wanted, jerk, lag, profile)
    spare = end - here[0] - profile[STOP_SAMPLES - 1, PROFILE_S]
    later = max(wait, spare / speed) if speed > 0.0 else wait
    fill_stop(speed, 0.0, wanted, jerk, later + lag, profile)


@inlined
def refuge_of(record: Any, refuges: Floats, s: float, path: Floats, profile: Floats) -> int:
    """Return the kind of the refuge that the body wholly stands in after a stop, or ``NO_REFUGE``.

    Args:
        record: Has the body of the ego and ``shoulder``.
        refuges: (R, 5), see ``signals.REFUGE_COLUMNS``.
        s: Of the ego now [m].
        path: (PATH_ROW,).
        profile: (STOP_SAMPLES, PROFILE_ROW).
    """
    end = s + profile[STOP_SAMPLES - 1, PROFILE_S]
    d, slope, _ = at_path(path, end - path[PATH_START])
    kind = NO_REFUGE
    for row in range(refuges.shape[0]):
        if is_in_refuge(
            refuges[row],
            end,
            d,
            slope,
            record["length"],
            record["width"],
            record["shoulder"],
        ):
            kind = int(refuges[row, _KIND])
    return kind
