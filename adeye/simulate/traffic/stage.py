"""The ego, the scripted actors and the static objects of a batch in motion."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import FRICTION, advance_ego_fading, fade
from adeye.kernel.relation import AT_LEAST, compares, tick_time
from adeye.kernel.road import lane_center, lane_of, local
from adeye.kernel.storyboard import Events, begin_events, end_actions, move_actors
from adeye.signals import (
    PLACE_CURVATURE,
    PLACE_D,
    PLACE_HEADING,
    PLACE_LANE,
    PLACE_OFFSET,
    PLACE_S,
    ROAD_EDGE,
    Bools,
    Floats,
    Ints,
    Scene,
)
from adeye.simulate.traffic.contact import Contacts
from adeye.spec.clock import ticks

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.signals import SceneContext
    from adeye.simulate.world.compile import World
    from adeye.simulate.world.formulas import Situation

# --- The ego stage: commands become motion within the limits of vehicle and road ------------------


class Ego:
    """The vehicles of a batch; the centre of each box lies half-way between the axles."""

    def __init__(self, cases: Sequence[Situation], context: SceneContext) -> None:
        """Take the limits of each run's vehicle and the friction of its road."""
        self._step = context.step
        vehicles = [case.architecture.vehicle for case in cases]
        step = context.step
        self._friction = context.surroundings.friction
        self._limits = np.array(
            [
                [
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
                for vehicle, friction in zip(vehicles, context.surroundings.friction, strict=True)
            ]
        )

    def move(
        self,
        running: Bools,
        command: Floats,
        states: Floats,
        friction: Floats | None = None,
    ) -> None:
        """Advance the ego of every run that has not ended by one tick.

        Args:
            running: (B,).
            command: (B, 2) acting acceleration [m/s²] and steering angle [rad].
            states: (B, 7) in and out, see ``signals.EGO_COLUMNS``.
            friction: (B,) of the tyres at this tick; None for that of the road.
        """
        limits = self._limits
        if friction is not None and friction is not self._friction:
            limits = limits.copy()
            limits[:, FRICTION] = friction
        move_egos(running, command, limits, self._step, states)


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
    def ended(self) -> Bools:
        """Runs that have ended (B,)."""
        return ~self.running

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
        elif ego_s[run] > road_length[run] + ROAD_EDGE or ego_s[run] < -ROAD_EDGE:
            # What is true behind the end says nothing about a road.
            cut_short[run] = True
            horizon_row[run] = max(0, min(horizon_row[run], tick - 1))
            running[run] = False
        elif tick >= horizon_row[run] + tail:
            running[run] = False


# --- Find the ego and the objects of a batch on the road ------------------------------------------


@inlined
def locate(
    segments: Floats, lane_width: float, lanes: int, x: float, y: float, place: Floats
) -> None:
    """Write the place of a point on the road.

    Args:
        segments: (K, 5) reference line.
        lane_width: [m].
        lanes: Number of lanes.
        x: [m].
        y: [m].
        place: (6,) out, see ``signals.PLACE_COLUMNS``; off the lanes the lane is -1 and the offset
            counts from the nearest one. All NaN if the point is, but for the lane.
    """
    s, d, heading, curvature = local(segments, x, y)
    place[PLACE_S], place[PLACE_D] = s, d
    place[PLACE_HEADING], place[PLACE_CURVATURE] = heading, curvature
    place[PLACE_LANE] = lane_of(d, lane_width, lanes)
    if math.isnan(d):
        place[PLACE_OFFSET] = math.nan
    else:
        nearest = min(max(math.floor(d / lane_width), 0), lanes - 1)
        place[PLACE_OFFSET] = d - lane_center(int(nearest), lane_width)


@compiled
def locate_all(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    running: Bools,
    ego: Floats,
    objects: Floats,
    segments: Floats,
    lane_width: Floats,
    lanes: int,
    ego_place: Floats,
    object_places: Floats,
) -> None:
    """Write the places of ego and objects of all runs that have not ended.

    Args:
        running: (B,).
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        segments: (B, K, 5) reference lines.
        lane_width: (B,) [m].
        lanes: Number of lanes.
        ego_place: (B, 6) out.
        object_places: (B, M, 6) out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        road, width = segments[run], lane_width[run]
        locate(road, width, lanes, ego[run, 0], ego[run, 1], ego_place[run])
        for thing in range(objects.shape[1]):
            x, y = objects[run, thing, 0], objects[run, thing, 1]
            locate(road, width, lanes, x, y, object_places[run, thing])


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

    def __init__(self, world: World, cases: Sequence[Situation]) -> None:
        """Set everything to its start, and begin the events whose condition holds at once."""
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
        self._actors: Floats = world.actors.copy()
        self._ego_place: Floats = np.zeros((self.runs, 6))
        self._object_places: Floats = np.zeros((*self.objects.shape[:2], 6))
        shape = (self.runs, len(context.event_ids))
        self._events = Events(
            due=np.full(shape, -1, dtype=np.int64),
            begun=np.full(shape, np.nan),
            ended=np.zeros(shape, dtype=np.bool_),
        )
        self._motion = Ego(cases, context)
        self._contacts = Contacts(context)
        self._everyone: Bools = np.ones(self.runs, dtype=np.bool_)
        self._contacts.update(self._everyone, self.ego, self.objects, self.ego, self.objects)
        self._settle(self._everyone)

    def advance(self, command: Floats, reacted: Floats, friction: Floats | None = None) -> None:
        """Move everything from this tick to the next; runs that have ended stay as they are.

        Args:
            command: (B, 2) acting acceleration [m/s²] and steering angle [rad].
            reacted: (B, A, 5) states at the next tick of the reactive actors; others are not read.
            friction: (B,) of the ego's tyres; None for that of the road.
        """
        running = self.ending.running
        # Scenes keep the arrays of their tick; what changes is written to new ones.
        ego, objects = self.ego, self.objects
        self.ego, self.objects = ego.copy(), objects.copy()
        self._ego_place = self._ego_place.copy()
        self._object_places = self._object_places.copy()
        self._tick += 1
        self._motion.move(running, command, self.ego, friction)
        world = self.world
        move_actors(
            running,
            world.scripted,
            self._actors,
            world.context.road.segments,
            self._tick,
            world.context.step,
            self.objects,
        )
        take_reacted(running, world.scripted, reacted, self.objects)
        self._contacts.update(running, ego, objects, self.ego, self.objects)
        self._settle(running)

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

    def _settle(self, running: Bools) -> None:
        """Find everything on the road, end runs and begin events at the present tick."""
        world, script = self.world, self.world.script
        locate_all(
            running,
            self.ego,
            self.objects,
            world.context.road.segments,
            world.context.road.lane_width,
            world.context.road.lanes,
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

    @property
    def running(self) -> Bools:
        """Runs that have not ended (B,)."""
        return self._require_stage().ending.running

    @property
    def ended(self) -> Bools:
        """Runs that have ended (B,)."""
        return self._require_stage().ending.ended

    @property
    def arrived(self) -> Bools:
        """Runs whose ego has reached its goal within the horizon (B,)."""
        return self._require_stage().ending.arrived

    @property
    def horizon_row(self) -> Ints:
        """Last row at which an obligation may start (B,)."""
        return self._require_stage().ending.horizon_row

    @property
    def complete(self) -> Bools:
        """Runs that ended by goal or horizon, not by contact or the end of the road (B,)."""
        return self._require_stage().ending.complete

    def _require_stage(self) -> Stage:
        if self._stage is None:
            msg = "reset the traffic before it is used"
            raise RuntimeError(msg)
        return self._stage
