"""The fast traffic: the model of the reference traffic, compiled, for all runs at once.

Reactive actors decide and move as ``highway`` has them do it, with the same equations in the same
order; everything else is the stage's, as there. It works in our frame throughout. On roads that
are told strip by strip they are on rails instead, see ``rails``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import owner_id, uniform
from adeye.kernel.traffic import network
from adeye.kernel.traffic.drivers import advance_fast, advance_reference, locate
from adeye.kernel.traffic.network import Road
from adeye.simulate.traffic import rails, variant_of
from adeye.simulate.traffic.rails import Laid, lay_rails, react_on_rails, write_reacted
from adeye.simulate.traffic.stage import Stage, Staged
from adeye.simulate.world.compile import World, compile_world
from adeye.simulate.world.roads import RUN_OUT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats, Ints, Scene, SceneContext
    from adeye.simulate.world.formulas import Situation

COMFORT_ACCELERATION: Final = 3.0
"""IDM's largest acceleration [m/s²]."""

COMFORT_BRAKING: Final = 5.0
"""IDM's comfortable deceleration [m/s²]."""

DESIRED_TIME_GAP: Final = 1.5
"""IDM's time gap [s]."""

SPEED_EXPONENT: Final = 4.0
"""IDM's exponent of the share of the desired speed."""

JAM_GAP: Final = 5.0
"""Bumper-to-bumper gap at which IDM stands [m]."""


class BatchTraffic(Staged):
    """Traffic of a batch in compiled kernels."""

    name = "batch"

    def __init__(self, variant: str = "reference") -> None:
        """Choose the arithmetic.

        Args:
            variant: ``reference`` computes in the order of the reference traffic, ``fast`` in
                simpler algebra.

        Raises:
            UsageError: There is no such variant.
        """
        super().__init__()
        self.variant = variant_of(self.name, variant)
        self._rails: Laid | None = None
        self._react = react_fast if self.variant.startswith("fast") else react_reference

    def reset(self, cases: Sequence[Situation]) -> tuple[SceneContext, Scene]:
        """Build the world of each test case; all have one structure.

        Raises:
            SpecError: A value of a scenario is not possible.
        """
        world = compile_world(cases)
        self._stage = stage = Stage(world, cases, self.base_dir, self.scenario_dir)
        self._reacted: Floats = np.zeros((stage.runs, len(world.scripted), 5))
        self._is_reactive = not world.scripted.all()
        vehicles, marks = _begin_vehicles(world)
        road, self._rails = world.context.road, None
        if cases[0].scenario.world.road.has_strips:
            if self._is_reactive:
                self._rails = lay_rails(world, stage.scene(), vehicles, marks)
            return world.context, stage.scene()
        pieces = road.segments.shape[1]
        lanes: Floats = np.zeros((stage.runs, pieces * road.lanes, network.LANE_WIDTH))
        links = network.build_links(
            [(number, number + 1, road.lanes) for number in range(pieces)], connected=pieces > 1
        )
        build_lanes(road.segments, links, road.lane_width, RUN_OUT, lanes)
        scratch = network.make_lists(lanes.shape[1], vehicles.shape[1])
        self._roads = Road(lanes, links, vehicles, marks, *scratch)
        if self._is_reactive:
            locate_all_vehicles(self._roads)
        return world.context, stage.scene()

    def step(self, command: Floats, friction: Floats | None = None) -> Scene:
        """Advance one tick with the acting command (B, 2) and return the next scene.

        Args:
            command: (B, 2) acceleration [m/s²] and steering angle [rad].
            friction: (B,) of the ego's tyres; None for that of the road.
        """
        stage = self._require_stage()
        running = stage.ending.running.copy()
        step, laid = stage.world.context.step, self._rails
        if laid is not None:
            react_on_rails(running, laid, step, self._reacted)
        elif self._is_reactive:
            self._react(running, self._roads, step, self._reacted)
        known = None if laid is None else laid.known
        stage.advance(command, self._reacted, friction, known)
        scene = stage.scene()
        if laid is not None:
            places = scene.ego_place, scene.object_places
            rails.show_placed(running, stage.ego, stage.objects, *places, laid)
        elif self._is_reactive:
            show_placed(running, stage.ego, stage.objects, self._roads)
        return scene


def _begin_vehicles(world: World) -> tuple[Floats, Ints]:
    """Write the rows of everything on the road: the ego, the actors, the static objects."""
    context = world.context
    runs, things = world.objects.shape[:2]
    actors = len(world.scripted)
    vehicles: Floats = np.zeros((runs, 1 + things, network.VEHICLE_WIDTH))
    marks: Ints = np.zeros((runs, 1 + things, network.MARK_WIDTH), dtype=np.int64)
    columns = [network.X, network.Y, network.HEADING, network.SPEED]
    vehicles[:, 0, columns] = world.ego[:, :4]
    vehicles[:, 1:, columns] = world.objects[..., :4]
    vehicles[:, 0, network.LENGTH] = context.ego_size[:, 0]
    vehicles[:, 1:, network.LENGTH] = context.object_sizes[..., 0]
    vehicles[..., network.JAM_DISTANCE] = JAM_GAP + vehicles[..., network.LENGTH]
    vehicles[..., network.TIME_GAP] = DESIRED_TIME_GAP
    vehicles[..., network.GAIN] = COMFORT_ACCELERATION
    vehicles[..., network.BRAKING] = 2.0 * math.sqrt(COMFORT_ACCELERATION * COMFORT_BRAKING)
    vehicles[..., network.EXPONENT] = SPEED_EXPONENT
    vehicles[..., network.TOP_SPEED] = math.inf
    vehicles[:, 0, network.DESIRED_SPEED] = world.ego_desired_speed
    wanted = np.where(world.scripted, world.objects[:, :actors, 3], world.desired_speed)
    vehicles[:, 1 : 1 + actors, network.DESIRED_SPEED] = wanted
    owners = np.array([owner_id(name) for name in context.object_ids[:actors]], dtype=np.uint64)
    draw_timers(context.stream_seeds, owners, vehicles)
    marks[:, :, network.ORDER] = marks[:, :, network.ORDER_X] = np.arange(1 + things)
    marks[:, :, network.ROLE] = network.FIXED
    marks[:, 0, network.ROLE] = network.PLACED
    reactive = np.where(world.lane_changes, network.CHANGING, network.FOLLOWING)
    marks[:, 1 : 1 + actors, network.ROLE] = np.where(world.scripted, network.PLACED, reactive)
    return vehicles, marks


@compiled
def draw_timers(seeds: NDArray[np.uint64], owners: NDArray[np.uint64], vehicles: Floats) -> None:
    """Draw how long ago each actor last thought of changing lanes, up to a second.

    Args:
        seeds: (B,) stream seeds.
        owners: (A,) numbers of the actors.
        vehicles: (B, 1 + M, VEHICLE_WIDTH) out, the actors after the ego.
    """
    for run in range(seeds.shape[0]):
        for actor in range(owners.shape[0]):
            vehicles[run, 1 + actor, network.TIMER] = uniform(seeds[run], owners[actor], 0, 0)


@compiled
def build_lanes(
    segments: Floats, links: Ints, lane_width: Floats, lead: float, out: Floats
) -> None:
    """Build the lanes along the reference line of each run.

    Args:
        segments: (B, K, 5) reference lines, the first one straight.
        links: (K * lanes, T) of the lanes, see ``kernel.traffic.network``.
        lane_width: (B,) [m].
        lead: How far before the road its first lanes begin [m].
        out: (B, K * lanes, LANE_WIDTH), segment by segment, from the left.
    """
    lanes = out.shape[1] // segments.shape[1]
    for run in range(segments.shape[0]):
        width = lane_width[run]
        for number in range(segments.shape[1]):
            x, y, heading, length, curvature = segments[run, number]
            sine, cosine = sin_cos(heading)
            for place in range(lanes):
                row = out[run, number * lanes + place]
                d = (lanes - 1 - place + 0.5) * width
                if curvature == 0.0:
                    before = lead if number == 0 else 0.0
                    network.write_straight(
                        row,
                        x - d * sine - before * cosine,
                        y + d * cosine - before * sine,
                        heading,
                        length + before,
                        width,
                        math.inf,
                    )
                    continue
                radius = 1.0 / curvature
                turn = 1.0 if curvature > 0.0 else -1.0
                beside = abs(radius - d)
                network.write_arc(
                    row,
                    x - radius * sine,
                    y + radius * cosine,
                    beside,
                    heading - turn * 0.5 * math.pi,
                    turn,
                    beside * abs(curvature) * length,
                    width,
                    math.inf,
                )
        network.mark_alongside(out[run], links)


@inlined
def _road_of(roads: Road, run: int) -> Road:
    """Return the road of one run."""
    return Road(
        roads.lanes[run],
        roads.links,
        roads.vehicles[run],
        roads.marks[run],
        roads.seen,
        roads.along,
        roads.listed,
    )


@compiled
def locate_all_vehicles(roads: Road) -> None:
    """Find the lane of everything on the road at the beginning; drivers keep to theirs.

    Args:
        roads: In and out: lanes, vehicles and marks of all runs (B, ...).
    """
    for run in range(roads.lanes.shape[0]):
        road = _road_of(roads, run)
        for who in range(road.vehicles.shape[0]):
            vehicle = road.vehicles[who]
            vehicle[network.SINUS], vehicle[network.COSINE] = sin_cos(vehicle[network.HEADING])
            locate(road, who)
            road.marks[who, network.TARGET] = road.marks[who, network.LANE]


@compiled
def show_placed(running: Bools, ego: Floats, objects: Floats, roads: Road) -> None:
    """Show the ego and the scripted actors to the drivers.

    Args:
        running: (B,) runs to do it in.
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        roads: In and out: lanes, vehicles and marks of all runs (B, ...).
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        road = _road_of(roads, run)
        for who in range(road.vehicles.shape[0]):
            if road.marks[who, network.ROLE] != network.PLACED:
                continue
            vehicle = road.vehicles[who]
            state = ego[run] if who == 0 else objects[run, who - 1]
            vehicle[network.X], vehicle[network.Y], vehicle[network.HEADING] = (
                state[0],
                state[1],
                state[2],
            )
            vehicle[network.SPEED] = state[3]
            if who > 0:
                vehicle[network.DESIRED_SPEED] = state[3]
            vehicle[network.SINUS], vehicle[network.COSINE] = sin_cos(vehicle[network.HEADING])
            locate(road, who)


@compiled
def react_reference(running: Bools, roads: Road, step: float, reacted: Floats) -> None:
    """Advance the reactive actors of all runs by one tick, in the reference arithmetic.

    Args:
        running: (B,) runs to do it in.
        roads: In and out: lanes, vehicles and marks of all runs (B, ...).
        step: [s].
        reacted: (B, A, 5) states of the reactive actors, out.
    """
    for run in range(running.shape[0]):
        if running[run]:
            road = _road_of(roads, run)
            advance_reference(road, step)
            write_reacted(road.vehicles, road.marks, reacted[run])


@compiled
def react_fast(running: Bools, roads: Road, step: float, reacted: Floats) -> None:
    """Do what ``react_reference`` does, in the fast arithmetic."""
    for run in range(running.shape[0]):
        if running[run]:
            road = _road_of(roads, run)
            advance_fast(road, step)
            write_reacted(road.vehicles, road.marks, reacted[run])
