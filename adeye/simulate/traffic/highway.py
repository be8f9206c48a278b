"""The reference traffic: highway_env's road, vehicles, IDM and MOBIL, one ``Road`` per run.

Its roads are driven directly, without its environments. The ego and the scripted actors stand on
them as vehicles that our kernels place, so that its drivers see them. Its y axis points to the
right and its headings turn clockwise; both change sign at this boundary, which is exact. It
numbers lanes from the left.

A tick from t to t + step: reactive actors decide from the state at t, one after the other in the
order of the scenario (a later one sees the target lane that an earlier one has just chosen); then
everything moves; contact is swept over the tick; last, the events whose condition holds begin.
"""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING, Any, Final, NoReturn

import numpy as np

from adeye.errors import UsageError
from adeye.kernel.random import owner_id, uniform
from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    Bools,
    Floats,
    Scene,
    SceneContext,
)
from adeye.simulate.traffic import variant_of
from adeye.simulate.traffic.stage import Stage, Staged
from adeye.simulate.world.compile import World, compile_world
from adeye.simulate.world.roads import RUN_OUT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.simulate.world.formulas import Situation

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

from highway_env.road.lane import AbstractLane, CircularLane, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Obstacle

JAM_GAP: Final = 5.0
"""Bumper-to-bumper gap at which IDM stands, as highway_env has it for cars of one length [m]."""


def flipped(value: float) -> float:
    """Change the sign of a lateral coordinate or a heading; zero stays positive."""
    return 0.0 - value


class _NoRandom:
    """Stands where highway_env takes a generator: nothing here may draw from one."""

    def __getattr__(self, name: str) -> NoReturn:
        msg = f"the traffic drew a random number ({name})"
        raise AssertionError(msg)


class PlacedVehicle(Vehicle):
    """A vehicle that our kernels move: the ego, or a scripted actor.

    Attributes:
        target_speed: What drivers who think for it (MOBIL) take for the speed that it wants.
    """

    target_speed: float

    def act(self, action: Any = None) -> None:
        """Decide nothing."""

    def step(self, dt: float) -> None:
        """Stay where the kernels placed it."""

    def place(self, x: float, y: float, heading: float, speed: float) -> None:
        """Take over a state of our frame."""
        self.position[0] = x
        self.position[1] = flipped(y)
        self.heading = flipped(heading)
        self.speed = speed


class ReactiveVehicle(IDMVehicle):
    """IDM and MOBIL for vehicles of different lengths that do not drive backwards."""

    speed: float
    action: dict[str, float]

    def desired_gap(
        self,
        ego_vehicle: Vehicle,
        front_vehicle: Vehicle = None,
        *rest: bool,
    ) -> float:
        """Add to IDM's desired distance between centres what the lengths differ by."""
        gap = super().desired_gap(ego_vehicle, front_vehicle, *rest)
        own = self.LENGTH
        return gap + 0.5 * ((ego_vehicle.LENGTH - own) + (front_vehicle.LENGTH - own))

    def step(self, dt: float) -> None:
        """Move, braking no further than to standstill."""
        if self.speed + self.action["acceleration"] * dt < 0.0:
            self.action["acceleration"] = -self.speed / dt
        super().step(dt)
        self.speed = max(0.0, self.speed)


class HighwayTraffic(Staged):
    """Traffic of a batch on highway_env's roads."""

    name = "highway"

    def __init__(self) -> None:
        self.variant = variant_of(self.name)
        self.roads: list[Road] = []
        super().__init__()

    def reset(self, cases: Sequence[Situation]) -> tuple[SceneContext, Scene]:
        """Build the world of each test case; all have one structure.

        Raises:
            SpecError: A value of a scenario is not possible.
            UsageError: Lanes of the road begin, end, or go the other way.
        """
        if cases[0].scenario.world.road.has_strips:
            raise UsageError(
                "the highway traffic has no imported roads, and none whose lanes end or go the "
                "other way",
                remedy="Use the batch traffic.",
            )
        world = compile_world(cases)
        self._stage = stage = Stage(world, cases, self.base_dir, self.scenario_dir)
        self._reactive = [int(actor) for actor in np.flatnonzero(~world.scripted)]
        self._desired = world.desired_speed
        self._reacted: Floats = np.zeros((stage.runs, len(world.scripted), 5))
        self.roads = [_build_road(world, run) for run in range(stage.runs)]
        return world.context, stage.scene()

    def step(self, command: Floats, friction: Floats | None = None) -> Scene:
        """Advance one tick with the acting command (B, 2) and return the next scene.

        Args:
            command: (B, 2) acceleration [m/s²] and steering angle [rad].
            friction: (B,) of the ego's tyres; None for that of the road.
        """
        stage = self._require_stage()
        running = stage.ending.running.copy()
        if self._reactive:
            self._react(running)
        stage.advance(command, self._reacted, friction)
        self._place(running)
        return stage.scene()

    def _react(self, running: Bools) -> None:
        step = self._require_stage().world.context.step
        for run in np.flatnonzero(running):
            road = self.roads[run]
            road.act()
            road.step(step)
            for actor in self._reactive:
                vehicle = road.vehicles[1 + actor]
                x, y = vehicle.position
                self._reacted[run, actor] = (
                    x,
                    flipped(y),
                    flipped(vehicle.heading),
                    vehicle.speed,
                    vehicle.action["acceleration"],
                )

    def _place(self, running: Bools) -> None:
        """Show the ego and the scripted actors to highway_env's drivers."""
        stage = self._require_stage()
        placed = [actor for actor, scripted in enumerate(stage.world.scripted) if scripted]
        for run in np.flatnonzero(running):
            vehicles = self.roads[run].vehicles
            ego = stage.ego[run]
            vehicles[0].place(ego[EGO_X], ego[EGO_Y], ego[EGO_HEADING], ego[EGO_SPEED])
            for actor in placed:
                vehicle, state = vehicles[1 + actor], stage.objects[run, actor]
                vehicle.place(*state[[OBJECT_X, OBJECT_Y, OBJECT_HEADING, OBJECT_SPEED]])
                vehicle.target_speed = state[OBJECT_SPEED]
            if self._reactive:
                # Nobody asks for the lane of a placed vehicle unless somebody reacts to it.
                for number in (0, *(1 + actor for actor in placed)):
                    vehicles[number].on_state_update()


def _build_road(world: World, run: int) -> Road:
    segments = world.context.road.segments[run]
    road = Road(
        network=build_network(
            segments, world.context.road.lanes, world.context.road.lane_width[run]
        ),
        np_random=_NoRandom(),
        neighbour_vehicles_connected_lanes=len(segments) > 1,
    )
    sizes = world.context.object_sizes[run]
    ego = world.ego[run]
    vehicle = PlacedVehicle(road, _pose_point(ego), flipped(ego[EGO_HEADING]), ego[EGO_SPEED])
    vehicle.target_speed = world.ego_desired_speed[run]
    _shape(vehicle, world.context.ego_size[run])
    road.vehicles.append(vehicle)
    for actor in range(len(world.scripted)):
        state = world.objects[run, actor]
        if world.scripted[actor]:
            vehicle = PlacedVehicle(
                road, _pose_point(state), flipped(state[OBJECT_HEADING]), state[OBJECT_SPEED]
            )
            vehicle.target_speed = state[OBJECT_SPEED]
        else:
            vehicle = _reactive_vehicle(road, world, run, actor)
        _shape(vehicle, sizes[actor])
        road.vehicles.append(vehicle)
    for thing in range(len(world.scripted), len(sizes)):
        state = world.objects[run, thing]
        obstacle = Obstacle(road, _pose_point(state), flipped(state[OBJECT_HEADING]))
        _shape(obstacle, sizes[thing])
        road.objects.append(obstacle)
    return road


def _pose_point(state: Floats) -> tuple[float, float]:
    return float(state[OBJECT_X]), flipped(float(state[OBJECT_Y]))


def _reactive_vehicle(road: Road, world: World, run: int, actor: int) -> ReactiveVehicle:
    state = world.objects[run, actor]
    vehicle = ReactiveVehicle(
        road,
        _pose_point(state),
        flipped(state[OBJECT_HEADING]),
        state[OBJECT_SPEED],
        enable_lane_change=bool(world.lane_changes[actor]),
    )
    # Set, not passed: its constructor takes zero for "not given".
    vehicle.target_speed = float(world.desired_speed[run, actor])
    owner = np.uint64(owner_id(world.context.object_ids[actor]))
    share = uniform(world.context.stream_seeds[run], owner, 0, 0)
    vehicle.timer = share * vehicle.LANE_CHANGE_DELAY
    vehicle.MAX_SPEED = math.inf
    vehicle.DISTANCE_WANTED = JAM_GAP + world.context.object_sizes[run, actor, 0]
    return vehicle


def _shape(thing: Vehicle | Obstacle, size: Floats) -> None:
    """Give it its size; contact is ours, so its own collisions are off."""
    thing.LENGTH, thing.WIDTH = float(size[0]), float(size[1])
    thing.diagonal = math.hypot(size[0], size[1])
    thing.collidable = thing.check_collisions = False


def build_network(segments: Floats, lanes: int, lane_width: float) -> RoadNetwork:
    """Build highway_env's lanes along a reference line.

    The first lane begins ``RUN_OUT`` before the road, for followers who start behind its origin.

    Args:
        segments: (K, 5) reference line, the first one straight.
        lanes: Number of lanes.
        lane_width: [m].
    """
    network = RoadNetwork()
    for number, segment in enumerate(segments):
        for lane in reversed(range(lanes)):
            lead = RUN_OUT if number == 0 else 0.0
            made = _build_lane(segment, (lane + 0.5) * lane_width, lane_width, lead)
            network.add_lane(str(number), str(number + 1), made)
    return network


def _build_lane(segment: Floats, d: float, width: float, lead: float) -> AbstractLane:
    x, y, heading, length, curvature = (float(value) for value in segment)
    sine, cosine = math.sin(heading), math.cos(heading)
    if curvature == 0.0:
        x, y = x - d * sine, y + d * cosine
        start = (x - lead * cosine, -(y - lead * sine))
        end = (x + length * cosine, -(y + length * sine))
        return StraightLane(start, end, width=width, speed_limit=None)
    radius = 1.0 / curvature
    left = curvature > 0.0
    # Direction of the segment's first point as seen from the centre of its circle.
    phase = heading - 0.5 * math.pi if left else heading + 0.5 * math.pi
    return CircularLane(
        (x - radius * sine, -(y + radius * cosine)),
        abs(radius - d),
        -phase,
        -(phase + curvature * length),
        clockwise=not left,
        width=width,
        speed_limit=None,
    )
