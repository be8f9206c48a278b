"""The ego, the scripted actors and the static objects of a batch in motion, and their contacts.

Contact between bodies is swept over each tick, so that nothing passes through.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from adeye import signals
from adeye.kernel.boxes import swept_contact, wrap_to_pi
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import (
    FRICTION,
    GRAVITY,
    MAX_ACCELERATION,
    MAX_DECELERATION,
    advance_ego_fading,
    clip,
    fade,
)
from adeye.kernel.relation import AT_LEAST, compares, tick_time
from adeye.kernel.road import Ground, Grounds, ground_of, lane_and_center, local_near
from adeye.kernel.storyboard import (
    Events,
    S,
    begin_events,
    end_actions,
    follow_lanes,
    move_actors,
)
from adeye.kernel.strips import slab_at
from adeye.signals import Bools, Floats, Ints, Scene, SceneContext
from adeye.simulate.traffic.drivers import Drivers
from adeye.simulate.traffic.plant import Plants
from adeye.simulate.world.clock import ticks

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.simulate.world.compile import World
    from adeye.simulate.world.formulas import Situation
    from adeye.spec.architecture import Vehicle

# --- Contact between bodies, swept over each tick so that nothing passes through ------------------


class Contacts:
    """What has touched what so far.

    Attributes:
        touched: (B,) object that the ego touches, -1 for none.
        impact_speed: (B,) size of the relative velocity at contact [m/s], 0 before.
        foreign: (B,) whether an actor has touched another object.
    """

    def __init__(self, context: SceneContext) -> None:
        """Start without any contact."""
        self._context = context
        self.touched: Ints = np.full(context.runs, -1, dtype=np.int64)
        self.impact_speed: Floats = np.zeros(context.runs)
        self.foreign: Bools = np.zeros(context.runs, dtype=np.bool_)
        self._extents: Floats = np.zeros((3, len(context.object_ids)))

    def update(
        self,
        running: Bools,
        ego_before: Floats,
        objects_before: Floats,
        ego: Floats,
        objects: Floats,
    ) -> None:
        """Look for contact between two ticks; runs that have ended keep what they have.

        What was found before stays as it is in the arrays of before.

        Args:
            running: (B,).
            ego_before: (B, 7) states at the earlier tick.
            objects_before: (B, M, 5) states at the earlier tick.
            ego: (B, 7) states at the later tick.
            objects: (B, M, 5) states at the later tick.
        """
        self.touched = self.touched.copy()
        self.impact_speed = self.impact_speed.copy()
        self.foreign = self.foreign.copy()
        sweep_contacts(
            running,
            ego_before,
            objects_before,
            ego,
            objects,
            self._context.ego_size,
            self._context.object_sizes,
            self._context.actor_count,
            self._extents,
            self.touched,
            self.impact_speed,
            self.foreign,
        )


@compiled
def sweep_contacts(  # noqa: PLR0913, PLR0917 - a kernel over both ticks
    running: Bools,
    ego_before: Floats,
    objects_before: Floats,
    ego: Floats,
    objects: Floats,
    ego_size: Floats,
    sizes: Floats,
    actors: int,
    extents: Floats,
    touched: Ints,
    impact_speed: Floats,
    foreign: Bools,
) -> None:
    """Find the first contact of the ego, and any of the actors, between two ticks.

    Args:
        running: (B,).
        ego_before: (B, 7) states at the earlier tick.
        objects_before: (B, M, 5) states at the earlier tick.
        ego: (B, 7) states at the later tick.
        objects: (B, M, 5) states at the later tick.
        ego_size: (B, 3).
        sizes: (B, M, 3).
        actors: How many of the objects are actors.
        extents: (3, M) scratch: x, y and extent of each object.
        touched: (B,) out.
        impact_speed: (B,) out [m/s].
        foreign: (B,) in and out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        first = math.inf
        x, y = ego_before[run, signals.OBJECT_X], ego_before[run, signals.OBJECT_Y]
        extent = _extent(ego_before[run], ego[run], ego_size[run])
        for thing in range(objects.shape[1]):
            extents[0, thing] = objects_before[run, thing, signals.OBJECT_X]
            extents[1, thing] = objects_before[run, thing, signals.OBJECT_Y]
            extents[2, thing] = _extent(
                objects_before[run, thing], objects[run, thing], sizes[run, thing]
            )
            if not _are_near(extents, thing, x, y, extent):
                continue
            share = contact_share(
                ego_before[run],
                ego[run],
                ego_size[run],
                objects_before[run, thing],
                objects[run, thing],
                sizes[run, thing],
            )
            if share < first:
                first = share
                touched[run] = thing
                impact_speed[run] = speed_between(
                    ego_before[run],
                    ego[run],
                    objects_before[run, thing],
                    objects[run, thing],
                    share,
                )
        if not foreign[run]:
            foreign[run] = _do_actors_touch(
                objects_before[run], objects[run], sizes[run], actors, extents
            )


@inlined
def _do_actors_touch(
    before: Floats, after: Floats, sizes: Floats, actors: int, extents: Floats
) -> bool:
    """Tell whether any of the actors of a run touches another object.

    Args:
        before: (M, 5) states at the earlier tick.
        after: (M, 5) states at the later tick.
        sizes: (M, 3).
        actors: How many of the objects are actors.
        extents: (3, M) x, y and extent of each object.
    """
    for one in range(actors):
        x, y, extent = extents[0, one], extents[1, one], extents[2, one]
        # Nobody else is near most of them, which a loop over all without jumps tells soonest.
        near = 0
        for other in range(extents.shape[1]):
            near += 1 if _are_near(extents, other, x, y, extent) else 0
        if near == 1:
            continue
        for other in range(one + 1, extents.shape[1]):
            if _are_near(extents, other, x, y, extent):
                share = contact_share(
                    before[one], after[one], sizes[one], before[other], after[other], sizes[other]
                )
                if share < math.inf:
                    return True
    return False


@inlined
def _extent(start: Floats, end: Floats, size: Floats) -> float:
    """Return how far from where it starts a body comes in the tick, its own size included [m].

    In either axis; amply, by a millimetre, so that rounding does not decide who is near.
    """
    way = abs(end[signals.OBJECT_X] - start[signals.OBJECT_X]) + abs(
        end[signals.OBJECT_Y] - start[signals.OBJECT_Y]
    )
    return float(0.5 * (size[0] + size[1]) + way + 1e-3)


@inlined
def _are_near(extents: Floats, thing: int, x: float, y: float, extent: float) -> bool:
    """Tell whether an object and a body at (x, y) [m] may touch; also if nobody knows, with NaN."""
    reach = extents[2, thing] + extent
    return not (abs(extents[0, thing] - x) > reach) | (abs(extents[1, thing] - y) > reach)


@compiled
def contact_share(
    start_1: Floats, end_1: Floats, size_1: Floats, start_2: Floats, end_2: Floats, size_2: Floats
) -> float:
    """Share of the tick at which two bodies first touch, inf if they do not.

    Args:
        start_1: State of one body at the earlier tick: an ego's or an object's, whose first
            columns agree.
        end_1: Its state at the later tick.
        size_1: (3,) length, width, height [m].
        start_2: State of the other body at the earlier tick.
        end_2: Its state at the later tick.
        size_2: (3,) [m].
    """
    dx, dy = (
        start_2[signals.OBJECT_X] - start_1[signals.OBJECT_X],
        start_2[signals.OBJECT_Y] - start_1[signals.OBJECT_Y],
    )
    rate_x = end_2[signals.OBJECT_X] - end_1[signals.OBJECT_X] - dx
    rate_y = end_2[signals.OBJECT_Y] - end_1[signals.OBJECT_Y] - dy
    # Half diagonals are at most half of length and width together.
    reach = 0.5 * (size_1[0] + size_1[1] + size_2[0] + size_2[1])
    reach += abs(rate_x) + abs(rate_y)
    if dx * dx + dy * dy > reach * reach:
        return math.inf
    _, share = swept_contact(
        _pose(start_1),
        _pose(end_1),
        (size_1[0], size_1[1]),
        _pose(start_2),
        _pose(end_2),
        (size_2[0], size_2[1]),
    )
    return share


@inlined
def _pose(state: Floats) -> tuple[float, float, float]:
    return state[signals.OBJECT_X], state[signals.OBJECT_Y], state[signals.OBJECT_HEADING]


@compiled
def speed_between(
    start_1: Floats, end_1: Floats, start_2: Floats, end_2: Floats, share: float
) -> float:
    """Size of the relative velocity of two bodies at a share of the tick [m/s].

    Speeds and headings change evenly between the ticks.

    Args:
        start_1: State of one body at the earlier tick: x, y, heading, speed first.
        end_1: Its state at the later tick.
        start_2: State of the other body at the earlier tick.
        end_2: Its state at the later tick.
        share: From 0 to 1.
    """
    u, v = _velocity(start_1, end_1, share)
    other_u, other_v = _velocity(start_2, end_2, share)
    return math.sqrt((u - other_u) * (u - other_u) + (v - other_v) * (v - other_v))


@compiled
def _velocity(start: Floats, end: Floats, share: float) -> tuple[float, float]:
    speed = start[signals.OBJECT_SPEED] + share * (
        end[signals.OBJECT_SPEED] - start[signals.OBJECT_SPEED]
    )
    turn = wrap_to_pi(end[signals.OBJECT_HEADING] - start[signals.OBJECT_HEADING])
    sine, cosine = sin_cos(start[signals.OBJECT_HEADING] + share * turn)
    return speed * cosine, speed * sine


# --- The ego stage: commands become motion within the limits of vehicle and road ------------------


class Ego:
    """The vehicles of a batch; the centre of each box lies half-way between the axles."""

    def __init__(self, cases: Sequence[Situation], context: SceneContext, base_dir: Path) -> None:
        """Take the limits of each run's vehicle, its FMU if it has one, and the friction."""
        self._step = context.step
        vehicles = [case.architecture.vehicle for case in cases]
        step = context.step
        self._friction = context.surroundings.friction
        self._grades = context.road.grades
        driven = {run: item.plant for run, item in enumerate(vehicles) if item.plant is not None}
        self._plants = Plants(driven, base_dir, step) if driven else None
        self._limits = np.array(
            [
                vehicle_limits(vehicle, friction, step)
                for vehicle, friction in zip(vehicles, context.surroundings.friction, strict=True)
            ]
        )

    def move(
        self,
        running: Bools,
        command: Floats,
        states: Floats,
        s: Floats,
        friction: Floats | None = None,
    ) -> None:
        """Advance the ego of every run that has not ended by one tick.

        Args:
            running: (B,).
            command: (B, 2) acting acceleration [m/s²] and steering angle [rad].
            states: (B, 7) in and out, see ``signals.EGO_COLUMNS``.
            s: (B,) of the egos along the road [m].
            friction: (B,) of the tyres at this tick; None for that of the road.
        """
        limits = self._limits
        if friction is not None and friction is not self._friction:
            limits = limits.copy()
            limits[:, FRICTION] = friction
        if self._grades.shape[1]:
            command = command.copy()
            pull_egos(running, limits, self._grades, s, command)
        before = None if self._plants is None else states.copy()
        move_egos(running, command, limits, self._step, states)
        if self._plants is not None and before is not None:
            self._plants.move(running, command, limits[:, FRICTION], before, states)

    def close(self) -> None:
        """End what moves vehicles outside of this process."""
        if self._plants is not None:
            self._plants.close()


def vehicle_limits(vehicle: Vehicle, friction: float, step: float) -> list[float]:
    """List what a vehicle can do (13,), see ``kernel.motion.advance_ego_fading``.

    Args:
        vehicle: The vehicle.
        friction: Of its tyres.
        step: From a tick to the next [s].
    """
    return [
        vehicle.wheelbase,
        0.5 * vehicle.wheelbase,
        vehicle.max_acceleration,
        vehicle.max_deceleration,
        vehicle.max_steering_angle,
        vehicle.max_steering_rate,
        vehicle.acceleration_lag,
        vehicle.steering_lag,
        friction,
        fade(step, vehicle.acceleration_lag),
        fade(0.5 * step, vehicle.acceleration_lag),
        fade(step, vehicle.steering_lag),
        fade(0.5 * step, vehicle.steering_lag),
    ]


@compiled
def pull_egos(running: Bools, limits: Floats, grades: Floats, s: Floats, command: Floats) -> None:
    """Add what gravity does on a grade to what the ego's drive and brakes can do of a command.

    Args:
        running: (B,).
        limits: (B, 13), see ``kernel.motion.advance_ego_fading``.
        grades: (B, G, 2), see ``signals.RoadMap``.
        s: (B,) along the road [m].
        command: (B, 2) in and out.
    """
    for run in range(running.shape[0]):
        grade = grades[run, slab_at(grades[run], s[run]), 1]
        if grade == 0.0 or not running[run]:
            continue
        can = clip(command[run, 0], -limits[run, MAX_DECELERATION], limits[run, MAX_ACCELERATION])
        command[run, 0] = can - GRAVITY * grade / math.sqrt(1.0 + grade * grade)


@compiled
def move_egos(running: Bools, command: Floats, limits: Floats, step: float, states: Floats) -> None:
    """Advance the ego of every run that has not ended by one tick.

    Args:
        running: (B,).
        command: (B, 2) acceleration [m/s²] and steering angle [rad].
        limits: (B, 13), see ``kernel.motion.advance_ego_fading``.
        step: Master clock [s].
        states: (B, 7) in and out.
    """
    for run in range(running.shape[0]):
        if running[run]:
            acceleration, angle = command[run, 0], command[run, 1]
            advance_ego_fading(states[run], acceleration, angle, step, limits[run], states[run])


# --- When runs end: at contact, after horizon and tail, a tail after the goal, at the road's end --


class Ending:
    """Keeps which runs have ended, and up to which row their obligations may start.

    Attributes:
        running: (B,) which runs have not ended.
        arrived: (B,) which egos have reached their goal within the horizon.
    """

    def __init__(
        self, *, step: float, horizon: float, tail: float, goal: Floats, road_length: Floats
    ) -> None:
        """Start with every run running.

        Args:
            step: Master clock [s].
            horizon: Obligations start within it [s].
            tail: What is simulated after it, and after the goal [s].
            goal: (B,) place along the road where the ego is to arrive [m], inf for none.
            road_length: (B,) where the road ends [m].

        Raises:
            SpecError: Horizon or tail is no whole number of steps.
        """
        self._horizon = ticks(horizon, step, "horizon")
        self._tail = ticks(tail, step, "tail")
        self._goal = goal
        self._road_length = road_length
        self.running: Bools = np.ones(goal.shape, dtype=np.bool_)
        self.arrived: Bools = np.zeros(goal.shape, dtype=np.bool_)
        self._cut_short: Bools = np.zeros(goal.shape, dtype=np.bool_)
        self._horizon_row: Ints = np.full(goal.shape, self._horizon, dtype=np.int64)

    def update(self, tick: int, ego_s: Floats, contact: Ints) -> None:
        """End the runs that end at a tick.

        Args:
            tick: Number of the tick.
            ego_s: (B,) place of the ego along the road [m].
            contact: (B,) object that the ego touches, -1 for none.
        """
        # Scenes keep the array of their tick.
        self.running = self.running.copy()
        end_runs(
            tick,
            self._tail,
            ego_s,
            self._goal,
            self._road_length,
            contact,
            self.running,
            self.arrived,
            self._cut_short,
            self._horizon_row,
        )

    @property
    def horizon_row(self) -> Ints:
        """Last row at which an obligation may start (B,): horizon, goal, contact, road's end."""
        return self._horizon_row

    @property
    def complete(self) -> Bools:
        """Runs that ended by goal or horizon, not by contact or the end of the road (B,)."""
        return ~self.running & ~self._cut_short


@compiled
def end_runs(  # noqa: PLR0913, PLR0917 - a kernel
    tick: int,
    tail: int,
    ego_s: Floats,
    goal: Floats,
    road_length: Floats,
    contact: Ints,
    running: Bools,
    arrived: Bools,
    cut_short: Bools,
    horizon_row: Ints,
) -> None:
    """End the runs that end at a tick.

    Args:
        tick: Number of the tick.
        tail: Ticks that are simulated after the horizon and after the goal.
        ego_s: (B,) place of the ego along the road [m].
        goal: (B,) where it is to arrive [m], inf for nowhere.
        road_length: (B,) where the road ends [m]; it begins at 0.
        contact: (B,) object that the ego touches, -1 for none.
        running: (B,) in and out.
        arrived: (B,) in and out.
        cut_short: (B,) whether a run has ended by contact or the end of the road, in and out.
        horizon_row: (B,) in and out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        is_there = compares(AT_LEAST, ego_s[run], goal[run], max(abs(ego_s[run]), abs(goal[run])))
        if is_there and tick < horizon_row[run]:
            horizon_row[run] = tick
            arrived[run] = True
        if contact[run] >= 0:
            cut_short[run] = True
            horizon_row[run] = min(horizon_row[run], tick)
            running[run] = False
        elif ego_s[run] > road_length[run] + signals.ROAD_EDGE or ego_s[run] < -signals.ROAD_EDGE:
            # What is true behind the end says nothing about a road.
            cut_short[run] = True
            horizon_row[run] = max(0, min(horizon_row[run], tick - 1))
            running[run] = False
        elif tick >= horizon_row[run] + tail:
            running[run] = False


# --- Find the ego and the objects of a batch on the road ------------------------------------------


@inlined
def locate(ground: Ground, x: float, y: float, place: Floats) -> None:
    """Write the place of a point on the road.

    Args:
        ground: The road.
        x: [m].
        y: [m].
        place: (6,) out, see ``signals.PLACE_COLUMNS``; off the lanes the lane is -1 and the offset
            counts from the nearest one. All NaN if the point is, but for the lane.
    """
    locate_near(ground, 0, x, y, place)


@inlined
def locate_near(ground: Ground, near: int, x: float, y: float, place: Floats) -> int:
    """Do what ``locate`` does, from the segment beside which the point was; return that."""
    s, d, heading, curvature, near = local_near(ground.segments, ground.guide, near, x, y)
    place[signals.PLACE_S], place[signals.PLACE_D] = s, d
    place[signals.PLACE_HEADING], place[signals.PLACE_CURVATURE] = heading, curvature
    _write_lane(ground, place)
    return near


@inlined
def _write_lane(ground: Ground, place: Floats) -> None:
    """Write the lane of a place, and the offset from its centre."""
    s, d = place[signals.PLACE_S], place[signals.PLACE_D]
    lane, center = lane_and_center(ground, s, d)
    place[signals.PLACE_LANE], place[signals.PLACE_OFFSET] = lane, d - center


@inlined
def _take_place(ground: Ground, known: Floats, place: Floats) -> None:
    """Take a place that is known, and find its lane where that is not."""
    for column in range(known.shape[0]):
        place[column] = known[column]
    if math.isnan(known[signals.PLACE_LANE]):
        _write_lane(ground, place)


@compiled
def locate_all(  # noqa: PLR0913, PLR0917 - a kernel
    running: Bools,
    ego: Floats,
    objects: Floats,
    grounds: Grounds,
    known: Floats,
    near: Ints,
    ego_place: Floats,
    object_places: Floats,
) -> None:
    """Write the places of ego and objects of all runs that have not ended.

    Args:
        running: (B,).
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        grounds: Their roads.
        known: (B, A, 6) places of the first A objects where whoever moves them knows them; NaN as
            s where not, and as lane where only that is not known. A may be 0.
        near: (B, 1 + M) segments that ego and objects were beside, in and out; zeros at first.
        ego_place: (B, 6) out.
        object_places: (B, M, 6) out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        ground = ground_of(grounds, run)
        near[run, 0] = locate_near(ground, near[run, 0], ego[run, 0], ego[run, 1], ego_place[run])
        for thing in range(objects.shape[1]):
            if thing < known.shape[1] and not math.isnan(known[run, thing, signals.PLACE_S]):
                _take_place(ground, known[run, thing], object_places[run, thing])
                continue
            x, y = objects[run, thing, 0], objects[run, thing, 1]
            near[run, 1 + thing] = locate_near(
                ground, near[run, 1 + thing], x, y, object_places[run, thing]
            )


# --- The ego, the scripted actors and the static objects of a batch in motion ---------------------


class Stage:
    """Moves everything but the reactive actors, and keeps what is true at the present tick.

    Attributes:
        world: What the runs began with.
        runs: Number of runs B.
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        ending: Which runs have ended.
    """

    def __init__(
        self, world: World, cases: Sequence[Situation], base_dir: Path, scenario_dir: Path
    ) -> None:
        """Set everything to its start, and begin the events whose condition holds at once.

        Args:
            world: What the runs begin with.
            cases: Of one structure.
            base_dir: Folder of the architecture's file, where the FMUs of vehicles are.
            scenario_dir: That of the scenario's, where those are that drive actors.
        """
        context = world.context
        self.world = world
        self.runs = context.runs
        self.ego: Floats = world.ego.copy()
        self.objects: Floats = world.objects.copy()
        self.ending = Ending(
            step=context.step,
            horizon=world.horizon,
            tail=world.tail,
            goal=world.goal,
            road_length=context.road.length,
        )
        self._tick = 0
        self._grounds = context.road.grounds()
        self._script = world.script._replace(actions=world.script.actions.copy())
        self._actors: Floats = world.actors.copy()
        self._ego_place: Floats = np.zeros((self.runs, 6))
        self._object_places: Floats = np.zeros((*self.objects.shape[:2], 6))
        self._near: Ints = np.zeros((self.runs, 1 + self.objects.shape[1]), dtype=np.int64)
        shape = (self.runs, len(context.event_ids))
        self._events = Events(
            due=np.full(shape, -1, dtype=np.int64),
            begun=np.full(shape, np.nan),
            ended=np.zeros(shape, dtype=np.bool_),
        )
        self._motion = Ego(cases, context, base_dir)
        is_driven = any(item.driver is not None for item in cases[0].scenario.actors.values())
        self._drivers = Drivers(cases, world, scenario_dir) if is_driven else None
        self._contacts = Contacts(context)
        self._everyone: Bools = np.ones(self.runs, dtype=np.bool_)
        self._contacts.update(self._everyone, self.ego, self.objects, self.ego, self.objects)
        self._follows = bool(context.road.slabs.shape[1] and world.scripted.any())
        self._nothing_known: Floats = np.zeros((self.runs, 0, 6))
        self._settle(self._everyone, self._nothing_known)

    def advance(
        self,
        command: Floats,
        reacted: Floats,
        friction: Floats | None = None,
        known: Floats | None = None,
    ) -> None:
        """Move everything from this tick to the next; runs that have ended stay as they are.

        Args:
            command: (B, 2) acting acceleration [m/s²] and steering angle [rad].
            reacted: (B, A, 5) states at the next tick of the reactive actors; others are not read.
            friction: (B,) of the ego's tyres; None for that of the road.
            known: (B, A, 6) where along the road they are then, see ``locate_all``.
        """
        running = self.ending.running
        before = self.scene() if self._drivers is not None else None
        # Scenes keep the arrays of their tick; what changes is written to new ones.
        ego, objects = self.ego, self.objects
        self.ego, self.objects = ego.copy(), objects.copy()
        self._ego_place = self._ego_place.copy()
        self._object_places = self._object_places.copy()
        self._tick += 1
        self._motion.move(running, command, self.ego, self._ego_place[:, 0], friction)
        world = self.world
        places = self._actors[:, :, S].copy()
        move_actors(
            running,
            world.scripted,
            self._actors,
            world.context.road.segments,
            self._tick,
            world.context.step,
            self.objects,
        )
        if self._follows:
            follow_lanes(running, self._script, self._actors, places, self._grounds, self.objects)
        take_reacted(running, world.scripted, reacted, self.objects)
        if self._drivers is not None and before is not None:
            self._drivers.move(before, self._grounds, self.objects)
        self._contacts.update(running, ego, objects, self.ego, self.objects)
        self._settle(running, self._nothing_known if known is None else known)

    def close(self) -> None:
        """End what moves vehicles outside of this process."""
        self._motion.close()
        if self._drivers is not None:
            self._drivers.close()

    def scene(self) -> Scene:
        """Show what is true at the present tick; later ticks leave it as it is."""
        contacts = self._contacts
        return Scene(
            tick=self._tick,
            time=tick_time(self._tick, self.world.context.step),
            ego=self.ego,
            ego_place=self._ego_place,
            objects=self.objects,
            object_places=self._object_places,
            begun=self._events.begun,
            ended=self._events.ended,
            contact=contacts.touched,
            impact_speed=contacts.impact_speed,
            foreign_contact=contacts.foreign,
            running=self.ending.running,
        )

    def _settle(self, running: Bools, known: Floats) -> None:
        """Find everything on the road, end runs and begin events at the present tick."""
        world, script = self.world, self._script
        locate_all(
            running,
            self.ego,
            self.objects,
            self._grounds,
            known,
            self._near,
            self._ego_place,
            self._object_places,
        )
        if len(world.context.event_ids):
            past = self._events
            events = self._events = Events(past.due, past.begun.copy(), past.ended.copy())
            tick, step = self._tick, world.context.step
            end_actions(running, script, tick, step, events, self._actors)
            begin_events(
                running,
                script,
                world.triggers.values(self.scene()),
                world.triggers.first_event,
                tick,
                tick_time(tick, step),
                events,
                self._actors,
            )
        self.ending.update(self._tick, self._ego_place[:, 0], self._contacts.touched)


@compiled
def take_reacted(running: Bools, scripted: Bools, reacted: Floats, objects: Floats) -> None:
    """Take the states of the reactive actors from what they have decided.

    Args:
        running: (B,) runs to do it in.
        scripted: (A,) which actors are not reactive.
        reacted: (B, A, 5) states.
        objects: (B, M, 5) out, the actors first.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        for actor in range(scripted.shape[0]):
            if not scripted[actor]:
                for column in range(reacted.shape[2]):
                    objects[run, actor, column] = reacted[run, actor, column]


class Staged:
    """A traffic that moves its reactive actors itself and leaves everything else to a stage."""

    def __init__(self) -> None:
        """Begin without a stage; ``reset`` of the traffic sets it up."""
        self._stage: Stage | None = None
        self.base_dir = Path()
        """Folder of the architecture's file, where the FMUs of vehicles are."""
        self.scenario_dir = Path()
        """Folder of the scenario's file, where those are that drive actors."""

    def close(self) -> None:
        """End what moves vehicles outside of this process."""
        if self._stage is not None:
            self._stage.close()

    @property
    def ending(self) -> Ending:
        """Which runs have ended, and up to which row their obligations may start."""
        return self._require_stage().ending

    def _require_stage(self) -> Stage:
        if self._stage is None:
            msg = "reset the traffic before it is used"
            raise RuntimeError(msg)
        return self._stage
