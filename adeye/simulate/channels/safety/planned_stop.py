"""The safety channel with a planner of safe stops."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.kernel.elementary import tan
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import (
    OBJECT_ROW,
    PATH_EXISTS,
    PATH_ROW,
    PATH_START,
    PATH_TARGET,
    PROFILE_ACCELERATION,
    PROFILE_ROW,
    PROFILE_S,
    PROFILE_SPEED,
    WAY_ROW,
    at_path,
)
from adeye.kernel.road import position
from adeye.kernel.stops import (
    ANYWHERE,
    LAID_PATHS,
    LAID_PROFILES,
    REFUGE,
    RULE_NAMES,
    STOP_INTERVAL,
    STOP_LEVELS,
    STOP_SAMPLES,
    STOPS,
    STRAIGHT,
    path_of,
    profile_of,
    stop_jerk,
    stop_level,
)
from adeye.signals import FAULT, ControlCommand, Floats, Ints, spec_columns
from adeye.simulate.channels.corridor import PATH_REQUIRED
from adeye.simulate.channels.driving import MAX_LATERAL
from adeye.simulate.channels.perception.pose import POSE_ACCELERATION, POSE_D, POSE_S, POSE_SPEED
from adeye.simulate.channels.perception.step import NOTE_END
from adeye.simulate.channels.perception.tracks import TRACKS
from adeye.simulate.channels.safety.in_lane import SafetyChannel
from adeye.simulate.channels.safety.monitors import (
    MEMORY_BRAKING,
    MEMORY_PATH,
    MEMORY_STOPPING,
    MONITOR_IDS,
    OBJECT_DANGER,
    SEEN_D,
    SEEN_OFFSET,
    Batch,
    answer,
    brake,
    coast,
    follow_lane,
    perceive,
    run_monitors,
    shadow,
    tell,
    update_stopping,
)
from adeye.simulate.channels.safety.stop_planner import (
    FOUND_COST,
    FOUND_FEASIBLE,
    FOUND_ROW,
    NO_STOP,
    plan_stop,
)
from adeye.simulate.channels.trajectory.cost import predict_objects
from adeye.simulate.channels.trajectory.planner import steer_along

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.spec.architecture import Vehicle
    from adeye.spec.channels import SafetyParameters

# --- The planned stop at one tick: supervise, plan, and the command that it would give ------------

LAST_SAFE_STOP: Final = len(MONITOR_IDS)
"""Column of the monitor that the planner adds."""

POINTS: Final = 5
"""Places of a stop that are shown, the first that of the ego."""

# Columns of what is kept of the choice.
(
    KEPT_STOP,  # number of the stop, NO_STOP for none
    KEPT_FEASIBLE,  # whether it was feasible at the last plan
) = range(2)
KEPT_ROW: Final = 2


class Plans(NamedTuple):
    """What a tick of the planner reads and writes beside ``supervision.Batch``.

    Attributes:
        rules: (B, RULES) rating of each kind of place.
        refuges: (B, R, 5) parking bays and rest areas, see ``signals.REFUGE_COLUMNS``.
        kept: (B, KEPT_ROW) choice so far; in and out.
        driven: (B, PATH_ROW) its path; in and out.
        objects: (K, OBJECT_ROW) scratch, as all that follows.
        ways: (K, STOP_SAMPLES, WAY_ROW).
        paths: (LAID_PATHS, PATH_ROW).
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW).
        line: (STOP_SAMPLES, 2).
        found: (STOPS, FOUND_ROW) what is found of the stops.
    """

    rules: Floats
    refuges: Floats
    kept: Floats
    driven: Floats
    objects: Floats
    ways: Floats
    paths: Floats
    profiles: Floats
    line: Floats
    found: Floats


@inlined
def planned_step(batch: Batch, plans: Plans, run: int, time: float, shows: bool) -> int:  # noqa: FBT001 - a kernel
    """Decide one run at one tick; as ``supervision.safety_step``, with a planned stop.

    Args:
        batch: What it reads and writes.
        plans: And of the stops.
        run: Which row is meant.
        time: [s].
        shows: Whether somebody looks at the stops.

    Returns:
        OK, REQUESTS_AUTHORITY, or FAULT without a recent ego estimate.
    """
    record, shown, kept = batch.records[run], batch.monitors[run], plans.kept[run]
    knows_pose = perceive(batch, run, time)
    count = 0
    shown[LAST_SAFE_STOP, 0] = False
    if knows_pose:
        count = foresee(batch, plans, run)
        # One tick more, and those in which the monitor is confirmed.
        wait = (record["confirm_ticks"] + 1.0) * record["period"]
        shown[LAST_SAFE_STOP, 0] = is_last_stop(batch, plans, run, count, wait)
    confirmed = run_monitors(record, batch.evidence, batch.states[run], shown)
    if not knows_pose:
        kept[KEPT_STOP] = NO_STOP
        return coast(batch, run)
    memory = batch.memory[run]
    update_stopping(memory, confirmed, batch.reason[run], batch.pose[run, POSE_ACCELERATION])
    is_stopping = memory[MEMORY_STOPPING] > 0.0
    if not is_stopping:
        kept[KEPT_STOP] = NO_STOP
    if is_stopping or shows:
        stop = ask_for_stop(batch, plans, run, count, ANYWHERE, 0.0, int(kept[KEPT_STOP]))
        if is_stopping:
            take_stop(plans, run, stop)
    if not is_stopping:
        return shadow(batch, run, confirmed)
    return drive_stop(batch, plans, run, confirmed, shown[OBJECT_DANGER, 1])


@inlined
def foresee(batch: Batch, plans: Plans, run: int) -> int:
    """Predict the objects, take the stop that is driven for the lane; return how many there are."""
    record, pose = batch.records[run], batch.pose[run]
    if _is_driven(batch.memory[run], plans.kept[run]):
        _look_along(pose, batch.memory[run], plans.driven[run], batch.evidence)
    return predict_objects(
        batch.tracks[run],
        int(batch.notes[run, NOTE_END]),
        pose,
        batch.segments[run],
        record["length"],
        record["lane_width"],
        int(record["lanes"]),
        record["confirm_hits"],
        STOP_INTERVAL,
        plans.objects,
        plans.ways,
    )


@inlined
def ask_for_stop(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    run: int,
    count: int,
    places: int,
    wait: float,
    kept: int,
    any_will_do: bool = False,  # noqa: FBT001, FBT002 - a kernel
) -> int:
    """Choose a stop in some places that begins after a while [s], see ``planner.plan_stop``."""
    return plan_stop(
        batch.records[run],
        plans.rules[run],
        batch.segments[run],
        plans.refuges[run],
        places,
        any_will_do,
        batch.pose[run],
        wait,
        batch.memory[run, MEMORY_PATH],
        count,
        plans.objects,
        plans.ways,
        kept,
        plans.driven[run],
        plans.paths,
        plans.profiles,
        plans.line,
        plans.found,
    )


@inlined
def take_stop(plans: Plans, run: int, stop: int) -> None:
    """Keep a choice and its path."""
    kept, driven = plans.kept[run], plans.driven[run]
    kept[KEPT_STOP], kept[KEPT_FEASIBLE] = stop, plans.found[stop, FOUND_FEASIBLE]
    for item in range(PATH_ROW):
        driven[item] = plans.paths[path_of(stop), item]


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
    record, pose = batch.records[run], batch.pose[run]
    stop, memory = int(plans.kept[run, KEPT_STOP]), batch.memory[run]
    if _drives_on(plans, stop):
        # On the way to a refuge nothing makes the ego faster.
        memory[MEMORY_BRAKING] = min(0.0, follow_lane(batch, run))
        acceleration = float(memory[MEMORY_BRAKING])
    else:
        is_in_lane = stop // STOP_LEVELS <= STRAIGHT
        acceleration = _stop(record, pose, memory, stop, batch.path, is_in_lane, is_danger)
    return answer(batch, run, acceleration, steer_along(record, pose, plans.driven[run]), requests)


@inlined
def _drives_on(plans: Plans, stop: int) -> bool:
    """Tell whether a stop is one in a refuge that does not brake yet."""
    first = plans.profiles[profile_of(stop), 0]
    is_ahead = stop // STOP_LEVELS == REFUGE and first[PROFILE_SPEED] > 0.0
    return bool(is_ahead and first[PROFILE_ACCELERATION] >= 0.0)


@inlined
def _is_driven(memory: Floats, kept: Floats) -> bool:
    """Tell whether the ego is in a stop that was chosen."""
    return bool(memory[MEMORY_STOPPING] > 0.0 and kept[KEPT_STOP] != NO_STOP)


@inlined
def _look_along(pose: Floats, memory: Floats, driven: Floats, seen: Floats) -> None:
    """Take a departure for one from the stop that is driven, wherever that leads."""
    way = pose[POSE_S] - driven[PATH_START]
    seen[SEEN_OFFSET] = pose[POSE_D] - at_path(driven, way)[0]
    seen[SEEN_D] = memory[MEMORY_PATH]


@inlined
def is_last_stop(batch: Batch, plans: Plans, run: int, count: int, wait: float) -> bool:
    """Tell whether no safe stop is left, after a while [s] or in the stop that the ego is in."""
    if _is_driven(batch.memory[run], plans.kept[run]):
        return bool(plans.kept[run, KEPT_FEASIBLE] <= 0.0)
    stop = ask_for_stop(batch, plans, run, count, ANYWHERE, wait, NO_STOP, True)  # noqa: FBT003
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
    level = stop % STOP_LEVELS
    memory[MEMORY_BRAKING] = brake(
        record,
        memory[MEMORY_BRAKING],
        pose[POSE_SPEED],
        stop_level(record, level),
        stop_jerk(level),
        path[PATH_REQUIRED] if is_in_lane else 0.0,
        is_in_lane and is_danger,
    )
    return float(memory[MEMORY_BRAKING])


@inlined
def show_plan(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    run: int,
    state: int,
    candidates: Floats,
    costs: Floats,
    chosen: Ints,
) -> None:
    """Write the stops of a run and the choice, for pictures.

    Args:
        batch: What is read.
        plans: And of the stops.
        run: Which row is meant.
        state: Of the channel; in FAULT it has no stops.
        candidates: (B, STOPS, POINTS, 2) out.
        costs: (B, STOPS) out.
        chosen: (B,) out.
    """
    chosen[run] = NO_STOP
    candidates[run] = np.nan
    costs[run] = np.nan
    if state != FAULT:
        chosen[run] = int(plans.kept[run, KEPT_STOP])
        show_stops(
            batch.pose[run],
            batch.segments[run],
            plans.paths,
            plans.profiles,
            plans.found,
            candidates[run],
            costs[run],
        )


@compiled
def show_stops(  # noqa: PLR0913, PLR0917 - a kernel
    pose: Floats,
    segments: Floats,
    paths: Floats,
    profiles: Floats,
    found: Floats,
    places: Floats,
    costs: Floats,
) -> None:
    """Write the places of all stops in the map, and what they cost.

    Args:
        pose: (POSE_WIDTH,).
        segments: (R, 5) reference line of the road.
        paths: (LAID_PATHS, PATH_ROW).
        profiles: (LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW).
        found: (STOPS, FOUND_ROW).
        places: (STOPS, POINTS, 2) out, NaN for stops that do not exist.
        costs: (STOPS,) out, infinity for stops that are not feasible.
    """
    for stop in range(STOPS):
        path, profile = paths[path_of(stop)], profiles[profile_of(stop)]
        if path[PATH_EXISTS] == 0.0:
            continue
        is_feasible = found[stop, FOUND_FEASIBLE] > 0.0
        costs[stop] = found[stop, FOUND_COST] if is_feasible else math.inf
        for point in range(POINTS):
            way = profile[STOP_SAMPLES - 1, PROFILE_S] * point / (POINTS - 1.0)
            d = at_path(path, pose[POSE_S] + way - path[PATH_START])[0]
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

    monitor_ids: tuple[str, ...] = (*MONITOR_IDS, "last_safe_stop")

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        super().reset(context)
        runs = context.runs
        rules = spec_columns(context.parameters, _rules)
        self._rules = np.stack([rules[name] for name in RULE_NAMES], axis=1)
        self._refuges = np.ascontiguousarray(context.road.refuges)
        self._kept = np.zeros((runs, KEPT_ROW))
        self._kept[:, KEPT_STOP] = NO_STOP
        self._driven = np.zeros((runs, PATH_ROW))
        self._driven[:, PATH_TARGET] = np.nan
        self._shows = context.shows_candidates
        shown = runs if self._shows else 0
        self._candidates = np.full((shown, STOPS, POINTS, 2), np.nan)
        self._costs = np.full((shown, STOPS), np.nan)
        self._chosen = np.full(shown, NO_STOP, dtype=np.int64)
        self._scratch = (
            np.zeros((TRACKS, OBJECT_ROW)),
            np.zeros((TRACKS, STOP_SAMPLES, WAY_ROW)),
            np.zeros((LAID_PATHS, PATH_ROW)),
            np.zeros((LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW)),
            np.zeros((STOP_SAMPLES, 2)),
            np.zeros((STOPS, FOUND_ROW)),
        )

    def _fields(self, context: ChannelContext) -> dict[str, Any]:
        rear = spec_columns(context.parameters, lambda item: {"rear_sight": float(item.rear_sight)})
        limits = spec_columns(context.vehicles, _limits)
        return super()._fields(context) | rear | limits | PLANNING

    def _decide(self, time: float) -> None:
        _act(
            self._batch(),
            self._plans(),
            time,
            self._shows,
            self._candidates,
            self._costs,
            self._chosen,
        )

    def _plans(self) -> Plans:
        return Plans(self._rules, self._refuges, self._kept, self._driven, *self._scratch)

    def _command_at(self, time: float) -> ControlCommand:
        command = super()._command_at(time)
        if self._shows:
            command.candidates = self._candidates.copy()
            command.candidate_costs = self._costs.copy()
            command.chosen = self._chosen.copy()
        return command


def _rules(item: SafetyParameters) -> dict[str, float]:
    return {name: float(getattr(item.ratings, name)) for name in RULE_NAMES}


def _limits(vehicle: Vehicle) -> dict[str, float]:
    return {
        "max_curvature": tan(vehicle.max_steering_angle) / vehicle.wheelbase,
        "steering_lag": vehicle.steering_lag,
        "acceleration_lag": vehicle.acceleration_lag,
    }


@compiled
def _act(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    time: float,
    shows: bool,  # noqa: FBT001 - a kernel
    candidates: Floats,
    costs: Floats,
    chosen: Ints,
) -> None:
    for run in range(batch.records.shape[0]):
        if not batch.running[run]:
            continue
        state = planned_step(batch, plans, run, time, shows)
        tell(batch, run, state)
        if shows:
            show_plan(batch, plans, run, state, candidates, costs, chosen)
