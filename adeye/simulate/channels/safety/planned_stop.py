"""The safety channel with a planner of safe stops, which judges every stop of the library.

A stop is feasible if it keeps to its lateral limits and the road, meets no predicted object and
cuts up nobody. Of the feasible ones that with the best rating of its end is taken; if there is
none, the one that does least harm. Who drives behind the ego in its own lane is not asked: to brake
is right whoever follows, and how hard is in the order of the decelerations.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.fields import fields_of
from adeye.kernel import profiles, stops
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import (
    NO_REFUGE,
    REST_AREA,
    Ground,
    center_beside,
    ground_of,
    is_beside,
    is_on_lanes,
    lane_center,
    lane_width,
    lanes_at,
    position,
)
from adeye.signals import FAULT, Floats, spec_columns
from adeye.simulate.channels.corridor import PATH_REQUIRED
from adeye.simulate.channels.driving import MAX_LATERAL, parameter_columns
from adeye.simulate.channels.hooks import POINTS, Shown
from adeye.simulate.channels.perception.pose import (
    POSE_ACCELERATION,
    POSE_ALIGN,
    POSE_CURVATURE,
    POSE_D,
    POSE_S,
    POSE_SPEED,
)
from adeye.simulate.channels.perception.tracks import TRACKS
from adeye.simulate.channels.safety import in_lane
from adeye.simulate.channels.safety.in_lane import Batch, SafetyChannel
from adeye.simulate.channels.trajectory.channel import LOST, steer_along
from adeye.simulate.channels.trajectory.cost import Others, is_cut_up, overlap, predict_objects

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.signals import Floats
    from adeye.simulate.channels.perception.step import Seen

# --- Whether a safe stop cuts up somebody in a lane that it enters or crosses ---------------------


class StopTask(NamedTuple):
    """What the planner reads and writes for one run.

    Attributes:
        record: Parameters, see ``PlannedSafetyChannel``.
        rules: (RULES,) rating of each kind of place.
        ground: The road.
        pose: (POSE_WIDTH,).
        center: Centre of the ego's lane [m].
        others: The predicted objects, with STOP_SAMPLES each.
        driven: (PATH_ROW,) path of the stop that is being driven; in and out.
        paths: (LAID_PATHS, PATH_ROW) out.
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW) out.
        line: (STOP_SAMPLES, 2) scratch.
        found: (STOPS, FOUND_ROW) what is found of the stops, out.
    """

    record: Any
    rules: Floats
    ground: Ground
    pose: Floats
    center: float
    others: Others
    driven: Floats
    paths: Floats
    profiles: Floats
    line: Floats
    found: Floats


@inlined
def cuts_up(task: StopTask, row: int, path: Floats, begun: float, profile: Floats) -> bool:
    """Tell whether a path to the right cuts up somebody in a lane that it enters or crosses.

    Args:
        task: What is read.
        row: Which of the paths it is.
        path: (PATH_ROW,).
        begun: Way along the path that is behind the ego [m].
        profile: (STOP_SAMPLES, PROFILE_ROW).
    """
    record, ground, others = task.record, task.ground, task.others
    s, d = place = task.pose[POSE_S], task.pose[POSE_D]
    target, speed = path[profiles.PATH_TARGET], 0.0
    if np.isnan(target) or is_beside(ground, s, target):
        # Only those who come before the ego has left the lane count.
        for sample in range(stops.STOP_SAMPLES):
            way = begun + profile[sample, profiles.PROFILE_S]
            is_out = way >= path[profiles.PATH_LENGTH]
            if row == stops.REFUGE:
                is_out = profiles.at_path(path, way)[0] <= -0.5 * record["width"]
            if is_out:
                speed = profile[sample, profiles.PROFILE_SPEED]
                break
        if is_cut_up(record, ground, place, target, False, 0.0, others):  # noqa: FBT003 - a kernel
            return True
    lane, half = lane_center(ground, s, 0), 0.5 * lane_width(ground, s, d)
    while lane < d - half:
        is_entered = lane >= target - 0.01
        if is_entered and is_cut_up(record, ground, place, lane, True, speed, others):  # noqa: FBT003
            return True
        lane = center_beside(ground, s, lane, 1.0)
    return False


@inlined
def strays(task: StopTask, path: Floats, begun: float, profile: Floats) -> bool:
    """Tell whether straight on leads into a lane in which it cuts up somebody.

    Args:
        task: What is read.
        path: (PATH_ROW,).
        begun: Way along the path that is behind the ego [m].
        profile: (STOP_SAMPLES, PROFILE_ROW).
    """
    record, ground, s, center = task.record, task.ground, task.pose[POSE_S], task.center
    end = profiles.at_path(path, begun + profile[stops.STOP_SAMPLES - 1, profiles.PROFILE_S])[0]
    width = lane_width(ground, s, center)
    beside = 0.5 * (width + record["width"])
    for row in range(lanes_at(ground, s)):
        lane = lane_center(ground, s, row)
        # Beyond its own lane as far as the one in which it ends up, if only with its side. Whoever
        # is over the edge of its lane already can still come back, so that is asked, too.
        is_left = center + 0.5 * width < lane < end + beside
        is_right = end - beside < lane < center - 0.5 * width
        is_entered = is_left or is_right
        if is_entered and is_cut_up(record, ground, (s, center), lane, True, 0.0, task.others):  # noqa: FBT003
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
def plan_stop(task: StopTask, places: int, wait: float, kept: int, any_will_do: bool) -> int:  # noqa: FBT001 - a kernel
    """Choose a safe stop that begins after a while.

    Args:
        task: What is read and written.
        places: Where the ego may stop: ``ANYWHERE``, ``ROADSIDE`` or ``ONLY_REST_AREA``.
        wait: Time before it begins [s].
        kept: Stop that is being driven, ``NO_STOP`` for none.
        any_will_do: Whether the first feasible stop is the answer, because nothing but its being
            there is asked; ``found`` is filled no further then.

    Returns:
        The stop that is chosen; ``NO_STOP`` if places are asked for and none can be had.
    """
    record, pose, driven, found = task.record, task.pose, task.driven, task.found
    paths, speeds = task.paths, task.profiles
    s, d, slope, bend = _start(pose, wait, kept, driven)
    speed, curvature = pose[POSE_SPEED], pose[POSE_CURVATURE]
    stops.lay_stops(
        record, task.ground, s, d, slope, bend, speed, task.center, curvature, driven, paths
    )
    for stop in range(stops.STOPS):
        row, level = stop // stops.STOP_LEVELS, stop % stops.STOP_LEVELS
        # What is laid out as it is needed costs nothing where the first stop will do.
        if row == 0:
            stops.fill_stop(
                speed,
                pose[POSE_ACCELERATION],
                stops.stop_level(record, level),
                stops.stop_jerk(level),
                # The brakes answer to the command with their lag.
                wait + record["acceleration_lag"],
                speeds[level],
            )
        if stop == stops.REFUGE * stops.STOP_LEVELS:
            here = pose[POSE_S], pose[POSE_D], speed, pose[POSE_ACCELERATION]
            start = s, d, slope, bend
            approach = stops.Approach(record, task.ground, here, start, wait, task.center, driven)
            is_kept = kept // stops.STOP_LEVELS == stops.REFUGE
            held = kept % stops.STOP_LEVELS if is_kept else NO_STOP
            stops.lay_refuge_stops(approach, places, held, paths, speeds)
        _judge(task, row, paths[stops.path_of(stop)], speeds[stops.profile_of(stop)], found[stop])
        if any_will_do and found[stop, FOUND_FEASIBLE] > 0.0:
            return stop
        found[stop, FOUND_COST] = found[stop, FOUND_RATING] + _LEVEL_COSTS[level] + _PATH_COSTS[row]
    if kept // stops.STOP_LEVELS == stops.REFUGE and driven[profiles.PATH_START] > pose[POSE_S]:
        # On the way to a refuge nothing has been begun: what has come within reach may be milder.
        kept = NO_STOP
    return choose_stop(found, kept, places)


@inlined
def _start(
    pose: Floats, wait: float, kept: int, driven: Floats
) -> tuple[float, float, float, float]:
    """Return where the paths begin: s, d, slope and bend; on the path that is being driven."""
    if kept != NO_STOP:
        d, slope, bend = profiles.at_path(driven, pose[POSE_S] - driven[profiles.PATH_START])
        if abs(d - pose[POSE_D]) < LOST:
            return pose[POSE_S], d, slope, bend
    driven[profiles.PATH_TARGET] = math.nan
    speed = pose[POSE_SPEED]
    later = max(0.0, speed + pose[POSE_ACCELERATION] * wait)
    way = 0.5 * (speed + later) * wait
    slope = sin_cos(pose[POSE_ALIGN])[0]
    return pose[POSE_S] + way, pose[POSE_D] + slope * way, slope, 0.0


@compiled
def _judge(task: StopTask, row: int, path: Floats, profile: Floats, found: Floats) -> None:
    """Find whether a stop is feasible, what it meets and how its end is rated."""
    record, ground, pose = task.record, task.ground, task.pose
    found[FOUND_FEASIBLE], found[FOUND_RATING] = 0.0, math.inf
    found[FOUND_IMPACT], found[FOUND_PLACE] = math.inf, stops.ANYWHERE
    if path[profiles.PATH_EXISTS] == 0.0 or stops.stands_at(profile) == stops.STOP_SAMPLES:
        return
    begun = pose[POSE_S] - path[profiles.PATH_START]
    fits = stops.fits_limits(record, ground, path, begun, profile, pose[POSE_D])
    # To stay in the lane is to be had in any case.
    if not fits and row != stops.IN_LANE:
        return
    if row == stops.SHOULDER:
        found[FOUND_PLACE] = stops.ROADSIDE
    elif row == stops.REFUGE:
        kind = stops.refuge_of(record, ground, pose[POSE_S], path, profile)
        if kind == NO_REFUGE:
            return
        found[FOUND_PLACE] = stops.ONLY_REST_AREA if kind == REST_AREA else stops.ROADSIDE
    if row in (stops.RIGHT_LANE, stops.SHOULDER, stops.REFUGE) and cuts_up(
        task, row, path, begun, profile
    ):
        return
    if row == stops.STRAIGHT and strays(task, path, begun, profile):
        return
    found[FOUND_RATING] = stops.rate_stop(record, task.rules, ground, pose[POSE_S], path, profile)
    is_near, impact = meet_objects(record, path, begun, profile, task.others, task.line)
    found[FOUND_FEASIBLE] = 0.0 if is_near or not fits else 1.0
    found[FOUND_IMPACT] = impact


@compiled
def meet_objects(
    record: Any, path: Floats, begun: float, profile: Floats, others: Others, line: Floats
) -> tuple[bool, float]:
    """Drive a stop among the predicted objects until it stands.

    Args:
        record: Has the ego's body, ``lateral_margin`` and ``uncertainty_growth``.
        path: (PATH_ROW,).
        begun: Way along the path that is behind the ego [m].
        profile: (STOP_SAMPLES, PROFILE_ROW).
        others: The predicted objects, with STOP_SAMPLES each.
        line: (STOP_SAMPLES, 2) scratch.

    Returns:
        Whether it comes too near to any, and the speed against the first one that it touches [m/s],
        0 for none.
    """
    end = min(stops.stands_at(profile) + 1, stops.STOP_SAMPLES)
    for sample in range(end):
        line[sample, 0], line[sample, 1], _ = profiles.at_path(
            path, begun + profile[sample, profiles.PROFILE_S]
        )
    is_near, impact, first = False, 0.0, end
    for row in range(others.objects.shape[0]):
        body, way = others.objects[row], others.ways[row]
        if body[profiles.OBJECT_BEHIND] > 0.0:
            continue
        for sample in range(min(first + 1, end)):
            closing = abs(profile[sample, profiles.PROFILE_SPEED] - way[sample, profiles.WAY_SPEED])
            time = min(_GROWS, (sample + 1) * stops.STOP_INTERVAL)
            depth = overlap(
                record,
                way[sample, profiles.WAY_S] - profile[sample, profiles.PROFILE_S],
                way[sample, profiles.WAY_D] - line[sample, 0],
                line[sample, 1],
                body,
                closing * stops.STOP_INTERVAL,
                profiles.margin_at(
                    record["lateral_margin"],
                    record["uncertainty_growth"],
                    body[profiles.OBJECT_GROWTH],
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
    for stop in range(stops.STOPS):
        is_allowed = found[stop, FOUND_FEASIBLE] > 0.0 and found[stop, FOUND_PLACE] >= places
        if is_allowed and found[stop, FOUND_COST] < least:
            best, least = stop, found[stop, FOUND_COST]
    if best != NO_STOP:
        is_kept = kept != NO_STOP and found[kept, FOUND_PLACE] >= places
        if is_kept and found[kept, FOUND_FEASIBLE] > 0.0:
            return kept if found[kept, FOUND_RATING] <= found[best, FOUND_RATING] else best
        return best
    if places != stops.ANYWHERE:
        return NO_STOP
    best = stops.IN_LANE * stops.STOP_LEVELS + stops.STOP_LEVELS - 1
    for stop in range(stops.STOPS):
        softer = found[stop, FOUND_IMPACT] - found[best, FOUND_IMPACT]
        if softer < 0.0 or (
            found[stop, FOUND_IMPACT] == found[best, FOUND_IMPACT]
            and found[stop, FOUND_COST] < found[best, FOUND_COST]
        ):
            best = stop
    if kept != NO_STOP and found[kept, FOUND_IMPACT] <= found[best, FOUND_IMPACT] + _SAME_IMPACT:
        return kept
    return best


# --- The planned stop at one tick: supervise, plan, and the command that it would give ------------

LAST_SAFE_STOP: Final = len(in_lane.MONITOR_IDS)
"""Column of the monitor that the planner adds."""

# Columns of what is kept of the choice.
(
    KEPT_STOP,  # number of the stop, NO_STOP for none
    KEPT_FEASIBLE,  # whether it was feasible at the last plan
) = range(2)
KEPT_ROW: Final = 2


class Plans(NamedTuple):
    """What a tick of the planner reads and writes beside ``in_lane.Batch``.

    Attributes:
        rules: (B, RULES) rating of each kind of place.
        kept: (B, KEPT_ROW) choice so far; in and out.
        driven: (B, PATH_ROW) its path; in and out.
        others: Room for the predicted objects; scratch, as all that follows.
        paths: (LAID_PATHS, PATH_ROW).
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW).
        line: (STOP_SAMPLES, 2).
        found: (STOPS, FOUND_ROW) what is found of the stops.
    """

    rules: Floats
    kept: Floats
    driven: Floats
    others: Others
    paths: Floats
    profiles: Floats
    line: Floats
    found: Floats


@inlined
def planned_step(batch: Batch, plans: Plans, run: int, time: float, shows: bool) -> int:  # noqa: FBT001 - a kernel
    """Decide one run at one tick; as ``in_lane.safety_step``, with a planned stop.

    Args:
        batch: What it reads and writes.
        plans: And of the stops.
        run: Which row is meant.
        time: [s].
        shows: Whether somebody looks at the stops.

    Returns:
        OK, REQUESTS_AUTHORITY, or FAULT without a recent ego estimate.
    """
    record, shown, kept = batch.seen.records[run], batch.monitors[run], plans.kept[run]
    knows_pose = in_lane.perceive(batch, run, time)
    others = Others(plans.others.objects[:0], plans.others.ways[:0])
    shown[LAST_SAFE_STOP, 0] = False
    if knows_pose:
        others = foresee(batch, plans, run)
        # One tick more, and those in which the monitor is confirmed.
        wait = (record["confirm_ticks"] + 1.0) * record["period"]
        shown[LAST_SAFE_STOP, 0] = is_last_stop(batch, plans, run, others, wait)
    confirmed = in_lane.run_monitors(record, batch.evidence, batch.states[run], shown)
    if not knows_pose:
        kept[KEPT_STOP] = NO_STOP
        return in_lane.coast(batch, run)
    memory = batch.memory[run]
    in_lane.update_stopping(
        memory, confirmed, batch.reason[run], batch.seen.pose[run, POSE_ACCELERATION]
    )
    is_stopping = memory[in_lane.MEMORY_STOPPING] > 0.0
    if not is_stopping:
        kept[KEPT_STOP] = NO_STOP
    if is_stopping or shows:
        stop = ask_for_stop(batch, plans, run, others, stops.ANYWHERE, 0.0, int(kept[KEPT_STOP]))
        if is_stopping:
            take_stop(plans, run, stop)
    if not is_stopping:
        return in_lane.shadow(batch, run, confirmed)
    return drive_stop(batch, plans, run, confirmed, shown[in_lane.OBJECT_DANGER, 1])


@inlined
def foresee(batch: Batch, plans: Plans, run: int) -> Others:
    """Predict the objects, and take the stop that is driven for the lane."""
    if _is_driven(batch.memory[run], plans.kept[run]):
        _look_along(batch, run, plans.driven[run])
    return predict_objects(batch.seen, run, stops.STOP_INTERVAL, plans.others)


@inlined
def ask_for_stop(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    run: int,
    others: Others,
    places: int,
    wait: float,
    kept: int,
    any_will_do: bool = False,  # noqa: FBT001, FBT002 - a kernel
) -> int:
    """Choose a stop in some places that begins after a while [s], see ``plan_stop``."""
    task = StopTask(
        batch.seen.records[run],
        plans.rules[run],
        ground_of(batch.seen.grounds, run),
        batch.seen.pose[run],
        batch.memory[run, in_lane.MEMORY_PATH],
        others,
        plans.driven[run],
        plans.paths,
        plans.profiles,
        plans.line,
        plans.found,
    )
    return plan_stop(task, places, wait, kept, any_will_do)


@inlined
def take_stop(plans: Plans, run: int, stop: int) -> None:
    """Keep a choice and its path."""
    kept, driven = plans.kept[run], plans.driven[run]
    kept[KEPT_STOP], kept[KEPT_FEASIBLE] = stop, plans.found[stop, FOUND_FEASIBLE]
    for item in range(profiles.PATH_ROW):
        driven[item] = plans.paths[stops.path_of(stop), item]


@inlined
def drive_stop(batch: Batch, plans: Plans, run: int, requests: bool, is_danger: bool) -> int:  # noqa: FBT001 - a kernel
    """Give the command of the stop that is kept.

    Args:
        batch: What is read and written.
        plans: And of the stops.
        run: Which row is meant.
        requests: Whether authority is wanted.
        is_danger: Whether an object ahead is a confirmed danger.
    """
    record, pose = batch.seen.records[run], batch.seen.pose[run]
    stop, memory = int(plans.kept[run, KEPT_STOP]), batch.memory[run]
    if _drives_on(plans, stop):
        # On the way to a refuge nothing makes the ego faster.
        memory[in_lane.MEMORY_BRAKING] = min(0.0, in_lane.follow_lane(batch, run))
        acceleration = float(memory[in_lane.MEMORY_BRAKING])
    else:
        is_in_lane = stop // stops.STOP_LEVELS <= stops.STRAIGHT
        acceleration = _stop(record, pose, memory, stop, batch.path, is_in_lane, is_danger)
    ground = ground_of(batch.seen.grounds, run)
    steering = steer_along(record, ground, pose, plans.driven[run])
    return in_lane.answer(batch, run, acceleration, steering, requests)


@inlined
def _drives_on(plans: Plans, stop: int) -> bool:
    """Tell whether a stop is one in a refuge that does not brake yet."""
    first = plans.profiles[stops.profile_of(stop), 0]
    is_ahead = stop // stops.STOP_LEVELS == stops.REFUGE and first[profiles.PROFILE_SPEED] > 0.0
    return bool(is_ahead and first[profiles.PROFILE_ACCELERATION] >= 0.0)


@inlined
def _is_driven(memory: Floats, kept: Floats) -> bool:
    """Tell whether the ego is in a stop that was chosen."""
    return bool(memory[in_lane.MEMORY_STOPPING] > 0.0 and kept[KEPT_STOP] != NO_STOP)


@inlined
def _look_along(batch: Batch, run: int, driven: Floats) -> None:
    """Take a departure for one from the stop that is driven, wherever that leads."""
    pose, ground = batch.seen.pose[run], ground_of(batch.seen.grounds, run)
    way, center = pose[POSE_S] - driven[profiles.PATH_START], batch.memory[run, in_lane.MEMORY_PATH]
    batch.evidence[in_lane.SEEN_OFFSET] = pose[POSE_D] - profiles.at_path(driven, way)[0]
    batch.evidence[in_lane.SEEN_ON_LANES] = is_on_lanes(ground, pose[POSE_S], center)


@inlined
def is_last_stop(batch: Batch, plans: Plans, run: int, others: Others, wait: float) -> bool:
    """Tell whether no safe stop is left, after a while [s] or in the stop that the ego is in."""
    if _is_driven(batch.memory[run], plans.kept[run]):
        return bool(plans.kept[run, KEPT_FEASIBLE] <= 0.0)
    stop = ask_for_stop(batch, plans, run, others, stops.ANYWHERE, wait, NO_STOP, True)  # noqa: FBT003
    return bool(plans.found[stop, FOUND_FEASIBLE] <= 0.0)


@inlined
def _stop(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    memory: Floats,
    stop: int,
    path: Floats,
    is_in_lane: bool,  # noqa: FBT001 - a kernel
    is_danger: bool,  # noqa: FBT001 - a kernel
) -> float:
    """Return the acceleration of a stop; in the lane, an object ahead may ask for more [m/s²]."""
    level = stop % stops.STOP_LEVELS
    memory[in_lane.MEMORY_BRAKING] = in_lane.brake(
        record,
        memory[in_lane.MEMORY_BRAKING],
        pose[POSE_SPEED],
        stops.stop_level(record, level),
        stops.stop_jerk(level),
        path[PATH_REQUIRED] if is_in_lane else 0.0,
        is_in_lane and is_danger,
    )
    return float(memory[in_lane.MEMORY_BRAKING])


@inlined
def show_plan(batch: Batch, plans: Plans, run: int, state: int, shown: Shown) -> None:
    """Write the stops of a run and the choice, for pictures.

    Args:
        batch: What is read.
        plans: And of the stops.
        run: Which row is meant.
        state: Of the channel; in FAULT it has no stops.
        shown: Out, of the run.
    """
    shown.chosen[run] = NO_STOP
    shown.candidates[run] = np.nan
    shown.costs[run] = np.nan
    if state != FAULT:
        shown.chosen[run] = int(plans.kept[run, KEPT_STOP])
        show_stops(batch.seen, plans, run, shown)


@compiled
def show_stops(seen: Seen, plans: Plans, run: int, shown: Shown) -> None:
    """Write the places of all stops in the map, and what they cost.

    Stops that do not exist stay NaN; what is not feasible costs infinity.
    """
    pose, segments = seen.pose[run], seen.grounds.segments[run]
    paths, speeds, found = plans.paths, plans.profiles, plans.found
    places, costs = shown.candidates[run], shown.costs[run]
    for stop in range(stops.STOPS):
        path, profile = paths[stops.path_of(stop)], speeds[stops.profile_of(stop)]
        if path[profiles.PATH_EXISTS] == 0.0:
            continue
        is_feasible = found[stop, FOUND_FEASIBLE] > 0.0
        costs[stop] = found[stop, FOUND_COST] if is_feasible else math.inf
        for point in range(POINTS):
            way = profile[stops.STOP_SAMPLES - 1, profiles.PROFILE_S] * point / (POINTS - 1.0)
            d = profiles.at_path(path, pose[POSE_S] + way - path[profiles.PATH_START])[0]
            x, y, _ = position(segments, pose[POSE_S] + way, d)
            places[stop, point, 0], places[stop, point, 1] = x, y


# --- The safety channel with a planner of safe stops ----------------------------------------------

PLANNING: Final = {
    "uncertainty_growth": 0.1,
    "follower_deceleration": 3.0,
    "max_lateral_acceleration": 1.5 * MAX_LATERAL / 1.3,
}
"""Growth of a prediction [m/s], what a stop may ask of who comes from behind and the lateral
acceleration that steering may use, in the end as much as the in-lane stop [m/s²]: those of the
trajectory channel."""


class PlannedSafetyChannel(SafetyChannel):
    """Supervises as ``SafetyChannel`` does, and chooses where and how hard it stops.

    While a monitor is confirmed it follows the stop of the library whose end is rated best. It
    plans at each tick and keeps its choice unless that has become infeasible or clearly worse. One
    monitor more fires when no safe stop would exist once the monitor could be confirmed.
    """

    monitor_ids: tuple[str, ...] = (*in_lane.MONITOR_IDS, "last_safe_stop")
    _candidates = stops.STOPS

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        super().reset(context)
        runs = context.runs
        rules = spec_columns(
            context.parameters, lambda item: fields_of(item.ratings, *stops.RULE_NAMES)
        )
        self._plans = Plans(
            rules=np.stack([rules[name] for name in stops.RULE_NAMES], axis=1),
            kept=np.zeros((runs, KEPT_ROW)),
            driven=np.zeros((runs, profiles.PATH_ROW)),
            others=Others(
                np.zeros((TRACKS, profiles.OBJECT_ROW)),
                np.zeros((TRACKS, stops.STOP_SAMPLES, profiles.WAY_ROW)),
            ),
            paths=np.zeros((stops.LAID_PATHS, profiles.PATH_ROW)),
            profiles=np.zeros((stops.LAID_PROFILES, stops.STOP_SAMPLES, profiles.PROFILE_ROW)),
            line=np.zeros((stops.STOP_SAMPLES, 2)),
            found=np.zeros((stops.STOPS, FOUND_ROW)),
        )
        self._plans.kept[:, KEPT_STOP] = NO_STOP
        self._plans.driven[:, profiles.PATH_TARGET] = np.nan

    def _fields(self, context: ChannelContext) -> dict[str, Any]:
        rear = parameter_columns(context, ["rear_sight"])
        return super()._fields(context) | rear | PLANNING

    def _step(self, time: float) -> None:
        _act(self._batch, self._plans, time, self._shown)


@compiled
def _act(batch: Batch, plans: Plans, time: float, shown: Shown) -> None:
    shows = shown.chosen.shape[0] > 0
    for run in range(batch.seen.records.shape[0]):
        if batch.seen.running[run]:
            state = planned_step(batch, plans, run, time, shows)
            in_lane.tell(batch, run, state)
            if shows:
                show_plan(batch, plans, run, state, shown)
