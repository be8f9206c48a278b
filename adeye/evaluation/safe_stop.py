"""How well a run stopped: the rating of where it stands, and the best that was to be had.

Judged from the trace, in hindsight: what was reachable is what the library of stops offers at the
row of the fault, among the objects as they then moved. Who was behind the ego in its own lane is
not asked, because whoever follows reacts to the ego.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.elementary import atan, tan
from adeye.kernel.geometry import signed_box_distance
from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_ROW,
    PATH_START,
    PROFILE_ROW,
    PROFILE_S,
    at_path,
)
from adeye.kernel.refuge_stops import ANYWHERE, lay_refuge_stops
from adeye.kernel.refuges import NO_REFUGE
from adeye.kernel.road import position
from adeye.kernel.stop_rating import CONTACT, DEFAULT_RULES, rate_footprint
from adeye.kernel.stops import (
    LAID_PATHS,
    LAID_PROFILES,
    STOP_INTERVAL,
    STOP_LEVELS,
    STOP_SAMPLES,
    STOPS,
    fill_stop,
    fits_limits,
    lay_stops,
    path_of,
    profile_of,
    rate_stop,
    stands_at,
    stop_jerk,
    stop_level,
)
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    OBJECT_HEADING,
    OBJECT_X,
    OBJECT_Y,
    PLACE_CURVATURE,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
    parameter_record,
)
from adeye.spec.channels import SafetyChannel

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.signals import Floats
    from adeye.spec.architecture import Architecture
    from adeye.trace import Trace

DECELERATIONS: Final = {"stop_deceleration": 4.0, "emergency_deceleration": 8.0}
"""Of the library that says what was reachable, where no safety channel has its own [m/s²]: the
defaults of the safety channel, so that architectures with and without one can be compared."""


@dataclass(frozen=True, slots=True)
class StopQuality:
    """Where a run stands, on the scale of ``kernel.stop_rating``.

    Attributes:
        achieved: Rating of the place; contact if it touched anything, NaN if it does not stand.
        best: Best rating that was reachable at the row of the fault, contact if no stop was
            feasible; NaN without a fault.
        regret: Their difference, NaN where either is missing.
    """

    achieved: float
    best: float
    regret: float


def rate_run(
    trace: Trace,
    run: int,
    rules: Sequence[float] = DEFAULT_RULES,
    architecture: Architecture | None = None,
) -> StopQuality:
    """Rate where a run stands, against the best that was reachable when its first fault began.

    What comes within reach later does not count as reachable, so a regret may be negative: the run
    went on to a better place than the library of stops had at the fault.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        rules: (RULES,) rating of each kind of place.
        architecture: That of the run, whose vehicle and safety channel say how it can stop; that of
            the trace's layout, the first of the batch, unless given.
    """
    table = np.array(rules, dtype=np.float64)
    active = trace["fault_active"][run, : trace.length[run]].any(axis=-1)
    achieved = achieved_rating(trace, run, table)
    if not active.any():
        return StopQuality(achieved, np.nan, np.nan)
    best = best_rating(trace, run, int(np.argmax(active)), table, architecture)
    return StopQuality(achieved, best, achieved - best)


def achieved_rating(trace: Trace, run: int, rules: Floats) -> float:
    """Rate the place where a run ends; NaN if the ego does not stand there.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        rules: (RULES,).
    """
    last = int(trace.length[run]) - 1
    if trace["contact"][run, last] >= 0:
        return CONTACT
    ego, place = trace["ego"][run, last], trace["ego_place"][run, last]
    if ego[EGO_SPEED] > 0.0:
        return np.nan
    road = trace.layout.context.road
    length, width = trace.layout.context.ego_size[run, :2]
    return rate_footprint(
        rules,
        road.segments[run],
        road.refuges[run],
        place[PLACE_S],
        place[PLACE_D],
        tan(ego[EGO_HEADING] - place[PLACE_HEADING]),
        length,
        width,
        road.lane_width[run],
        road.lanes,
        road.shoulder[run],
        road.verge[run],
        road.speed_limit[run],
    )


def best_rating(
    trace: Trace, run: int, row: int, rules: Floats, architecture: Architecture | None = None
) -> float:
    """Return the best rating of the stops that were feasible from a row on.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        row: From which row of the trace on the ego might have stopped.
        rules: (RULES,).
        architecture: See ``rate_run``.
    """
    record = _record(trace, run, architecture or trace.layout.architecture)
    road = trace.layout.context.road
    ego, place = trace["ego"][run, row], trace["ego_place"][run, row]
    s, d, speed = place[PLACE_S], place[PLACE_D], ego[EGO_SPEED]
    slope = tan(ego[EGO_HEADING] - place[PLACE_HEADING])
    lane = min(road.lanes - 1, max(0, int(d // road.lane_width[run])))
    paths = np.zeros((LAID_PATHS, PATH_ROW))
    profiles = np.zeros((LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW))
    center, driven = (lane + 0.5) * road.lane_width[run], np.full(PATH_ROW, np.nan)
    curvature, acceleration = place[PLACE_CURVATURE], ego[EGO_ACCELERATION]
    lay_stops(record, s, d, slope, 0.0, speed, center, curvature, driven, paths)
    for level in range(STOP_LEVELS):
        wanted, jerk = stop_level(record, level), stop_jerk(level)
        fill_stop(speed, acceleration, wanted, jerk, record["acceleration_lag"], profiles[level])
    lay_refuge_stops(
        record,
        road.refuges[run],
        ANYWHERE,
        (s, d, speed, acceleration),
        (s, d, slope, 0.0),
        0.0,
        center,
        NO_REFUGE,
        driven,
        paths,
        profiles,
    )
    best = CONTACT
    for stop in range(STOPS):
        path, profile = paths[path_of(stop)], profiles[profile_of(stop)]
        if path[PATH_EXISTS] == 0.0 or stands_at(profile) == STOP_SAMPLES:
            continue
        if not fits_limits(record, road.refuges[run], path, s - path[PATH_START], profile, d):
            continue
        rating = rate_stop(record, rules, road.segments[run], road.refuges[run], s, path, profile)
        if rating < best and _is_free(trace, run, row, path, profile):
            best = rating
    return best


def decelerations_of(architecture: Architecture) -> dict[str, float]:
    """Return the stop and emergency deceleration [m/s²] of the first built-in safety channel.

    Args:
        architecture: Without such a channel ``DECELERATIONS`` count.
    """
    for channel in architecture.channels.values():
        if isinstance(channel, SafetyChannel):
            return {name: getattr(channel.parameters, name) for name in DECELERATIONS}
    return dict(DECELERATIONS)


def _record(trace: Trace, run: int, architecture: Architecture) -> np.void:
    """Pack what the library reads of a run's vehicle and road."""
    road, vehicle = trace.layout.context.road, architecture.vehicle
    fields = decelerations_of(architecture) | {
        "length": trace.layout.context.ego_size[run : run + 1, 0],
        "width": trace.layout.context.ego_size[run, 1],
        "lane_width": road.lane_width[run],
        "lanes": float(road.lanes),
        "shoulder": road.shoulder[run],
        "verge": road.verge[run],
        "speed_limit": road.speed_limit[run],
        "acceleration_lag": vehicle.acceleration_lag,
        "max_curvature": tan(vehicle.max_steering_angle) / vehicle.wheelbase,
    }
    record: np.void = parameter_record(fields)[0]
    return record


def _is_free(trace: Trace, run: int, row: int, path: Floats, profile: Floats) -> bool:
    """Tell whether a stop meets no object, as these moved; after the end of the run they stay."""
    context = trace.layout.context
    segments, size = context.road.segments[run], context.ego_size[run]
    last = int(trace.length[run]) - 1
    places, start = trace["object_places"][run, row], trace["ego_place"][run, row]
    beside = 0.5 * (context.object_sizes[run, :, 1] + size[1])
    behind = (places[:, PLACE_S] < start[PLACE_S]) & (
        abs(places[:, PLACE_D] - start[PLACE_D]) < beside
    )
    for sample in range(min(stands_at(profile) + 1, STOP_SAMPLES)):
        s = start[PLACE_S] + profile[sample, PROFILE_S]
        d, slope, _ = at_path(path, s - path[PATH_START])
        x, y, heading = position(segments, s, d)
        then = min(last, row + round((sample + 1) * STOP_INTERVAL / context.step))
        for index in np.flatnonzero(~behind):
            other = trace["objects"][run, then, index]
            apart = signed_box_distance(
                x,
                y,
                heading + atan(slope),
                size[0],
                size[1],
                other[OBJECT_X],
                other[OBJECT_Y],
                other[OBJECT_HEADING],
                context.object_sizes[run, index, 0],
                context.object_sizes[run, index, 1],
            )
            if not apart > 0.0:
                return False
    return True
