"""How well a run stopped: the rating of where it stands, and the best that was to be had.

Judged from the trace, in hindsight: what was reachable is what the library of stops offers at the
row of the fault, among the objects as they then moved. Who was behind the ego in its own lane is
not asked, because whoever follows reacts to the ego.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye import signals as columns
from adeye.judge.trace_signals import STANDSTILL_SPEED
from adeye.kernel import stops
from adeye.kernel.boxes import box_of, signed_box_distance
from adeye.kernel.elementary import atan, tan
from adeye.kernel.jit import compiled
from adeye.kernel.profiles import PATH_EXISTS, PATH_ROW, PATH_START, PROFILE_ROW, PROFILE_S, at_path
from adeye.kernel.road import NO_REFUGE, Ground, center_at, position
from adeye.signals import parameter_record

if TYPE_CHECKING:
    from adeye.signals import Floats
    from adeye.spec.architecture import Architecture
    from adeye.spec.channels import SafetyParameters, StopRatings
    from adeye.trace import Trace

DECELERATIONS: Final = {"stop_deceleration": 4.0, "emergency_deceleration": 8.0}
"""Of the library that says what was reachable, where no safety channel has its own [m/s²]: the
defaults of the safety channel, so that architectures with and without one can be compared."""


def achieved_rating(trace: Trace, run: int, rules: Floats) -> float:
    """Rate the place where a run ends; NaN if the ego does not stand there.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        rules: (RULES,).
    """
    last = int(trace.length[run]) - 1
    if trace["contact"][run, last] >= 0:
        return stops.CONTACT
    ego, place = trace["ego"][run, last], trace["ego_place"][run, last]
    if not ego[columns.EGO_SPEED] <= STANDSTILL_SPEED:
        return np.nan
    ground = trace.layout.context.road.ground(run)
    length, width = trace.layout.context.ego_size[run, :2]
    slope = tan(ego[columns.EGO_HEADING] - place[columns.PLACE_HEADING])
    return stops.rate_footprint(
        rules, ground, place[columns.PLACE_S], place[columns.PLACE_D], slope, length, width
    )


def best_rating(trace: Trace, run: int, row: int, rules: Floats) -> float:
    """Return the best rating of the stops that were feasible from a row on.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        row: From which row of the trace on the ego might have stopped.
        rules: (RULES,).
    """
    record = _record(trace, run, trace.layout.architectures[run])
    ground = trace.layout.context.road.ground(run)
    ego, place = trace["ego"][run, row], trace["ego_place"][run, row]
    s, d, speed = place[columns.PLACE_S], place[columns.PLACE_D], ego[columns.EGO_SPEED]
    slope = tan(ego[columns.EGO_HEADING] - place[columns.PLACE_HEADING])
    paths = np.zeros((stops.LAID_PATHS, PATH_ROW))
    profiles = np.zeros((stops.LAID_PROFILES, stops.STOP_SAMPLES, PROFILE_ROW))
    center, driven = center_at(ground, s, d), np.full(PATH_ROW, np.nan)
    curvature, acceleration = place[columns.PLACE_CURVATURE], ego[columns.EGO_ACCELERATION]
    stops.lay_stops(record, ground, s, d, slope, 0.0, speed, center, curvature, driven, paths)
    for level in range(stops.STOP_LEVELS):
        wanted, jerk = stops.stop_level(record, level), stops.stop_jerk(level)
        stops.fill_stop(
            speed, acceleration, wanted, jerk, record["acceleration_lag"], profiles[level]
        )
    here, start = (s, d, speed, acceleration), (s, d, slope, 0.0)
    approach = stops.Approach(record, ground, here, start, 0.0, center, driven)
    stops.lay_refuge_stops(approach, stops.ANYWHERE, NO_REFUGE, paths, profiles)
    context, objects = trace.layout.context, trace["object_places"][run, row]
    beside = 0.5 * (context.object_sizes[run, :, 1] + context.ego_size[run, 1])
    follows = (objects[:, columns.PLACE_S] < s) & (abs(objects[:, columns.PLACE_D] - d) < beside)
    meets = np.flatnonzero(~follows)
    later = np.rint(
        (np.arange(stops.STOP_SAMPLES) + 1) * stops.STOP_INTERVAL / context.step
    ).astype(np.int64)
    rows = np.minimum(int(trace.length[run]) - 1, row + later)
    return _best_of(
        record,
        rules,
        ground,
        (s, d),
        paths,
        profiles,
        np.ascontiguousarray(trace["objects"][run, rows][:, meets]),
        context.object_sizes[run, meets],
    )


def decelerations_of(architecture: Architecture) -> dict[str, float]:
    """Return the stop and emergency deceleration [m/s²] of the first built-in safety channel.

    Args:
        architecture: Without such a channel ``DECELERATIONS`` count.
    """
    own = _safety_of(architecture)
    return {name: getattr(own, name, default) for name, default in DECELERATIONS.items()}


def ratings_of(architecture: Architecture) -> StopRatings:
    """Return how the safety channel of an architecture rates places; the defaults without one."""
    from adeye.spec.channels import StopRatings

    own = _safety_of(architecture)
    return StopRatings() if own is None else own.ratings


def _safety_of(architecture: Architecture) -> SafetyParameters | None:
    """Return the parameters of the first built-in safety channel."""
    from adeye.spec.channels import SafetyChannel

    channels = architecture.channels.values()
    found = (item.parameters for item in channels if isinstance(item, SafetyChannel))
    return next(found, None)


def rules_of(architecture: Architecture) -> Floats:
    """Return the ratings (RULES,) of ``ratings_of`` as a table."""
    ratings = ratings_of(architecture)
    return np.array([getattr(ratings, name) for name in stops.RULE_NAMES], dtype=np.float64)


def _record(trace: Trace, run: int, architecture: Architecture) -> np.void:
    """Pack what the library reads of a run's vehicle."""
    vehicle = architecture.vehicle
    fields = decelerations_of(architecture) | {
        "length": trace.layout.context.ego_size[run : run + 1, 0],
        "width": trace.layout.context.ego_size[run, 1],
        "acceleration_lag": vehicle.acceleration_lag,
        "max_curvature": tan(vehicle.max_steering_angle) / vehicle.wheelbase,
    }
    record: np.void = parameter_record(fields)[0]
    return record


@compiled
def _best_of(  # noqa: PLR0913, PLR0917 - the stops, and what decides which are feasible
    record: Any,
    rules: Floats,
    ground: Ground,
    start: tuple[float, float],
    paths: Floats,
    profiles: Floats,
    objects: Floats,
    sizes: Floats,
) -> float:
    """Find the best rating of the feasible stops; contact if none is.

    Args:
        record: See ``_record``.
        rules: (RULES,).
        ground: The road.
        start: Place of the ego on the road [m].
        paths: (LAID_PATHS, PATH_ROW).
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW).
        objects: (STOP_SAMPLES, M, 5) states at the time of each sample of a profile.
        sizes: (M, 3).
    """
    s, d = start
    best = stops.CONTACT
    for stop in range(stops.STOPS):
        path, profile = paths[stops.path_of(stop)], profiles[stops.profile_of(stop)]
        if path[PATH_EXISTS] == 0.0 or stops.stands_at(profile) == stops.STOP_SAMPLES:
            continue
        if not stops.fits_limits(record, ground, path, s - path[PATH_START], profile, d):
            continue
        rating = stops.rate_stop(record, rules, ground, s, path, profile)
        if rating < best and _is_free(record, ground.segments, s, path, profile, objects, sizes):
            best = rating
    return best


@compiled
def _is_free(  # noqa: PLR0913, PLR0917 - a stop and what it may meet
    record: Any,
    segments: Floats,
    start: float,
    path: Floats,
    profile: Floats,
    objects: Floats,
    sizes: Floats,
) -> bool:
    """Tell whether a stop meets no object, as these moved; after the end of the run they stay."""
    for sample in range(min(stops.stands_at(profile) + 1, stops.STOP_SAMPLES)):
        s = start + profile[sample, PROFILE_S]
        d, slope, _ = at_path(path, s - path[PATH_START])
        x, y, heading = position(segments, s, d)
        own = (x, y, heading + atan(slope), record["length"], record["width"])
        for index in range(sizes.shape[0]):
            other = box_of(objects[sample, index], sizes[index])
            if not signed_box_distance(own, other) > 0.0:
                return False
    return True
