"""Scenes on highway-env's own roads, and the same ones in the arrays of the compiled kernels.

highway-env's objects are used as they are; networks come from its environments. Our frame has y to
the left, so y, headings and lateral places change sign, which is exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from highway_env.envs.intersection_env import IntersectionEnv
from highway_env.road.lane import (
    CircularLane,
    SineLane,
    StraightLane,
)
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.controller import ControlledVehicle, MDPVehicle
from highway_env.vehicle.objects import Obstacle

from adeye.kernel.random import uniform
from adeye.kernel.traffic import network as lane_kernel
from adeye.kernel.traffic import network as n
from adeye.kernel.traffic.drivers import locate
from adeye.kernel.traffic.network import build_links, make_lists, mark_alongside
from benchmarks.support.crash import advance_crashing_reference, make_bodies

if TYPE_CHECKING:
    from adeye.signals import Floats, Ints

STEP = 1.0 / 15.0
"""Of highway-env's environments [s]."""

Advance = Callable[..., None]


class Draw:
    """Random numbers of a scene, one after the other."""

    def __init__(self, seed: int) -> None:
        self._seed = np.uint64(seed)
        self._count = 0

    def between(self, low: float, high: float) -> float:
        """Return a number between two."""
        self._count += 1
        return low + (high - low) * float(uniform(self._seed, np.uint64(1), self._count, 0))

    def below(self, count: int) -> int:
        """Return a whole number from 0 to below a count."""
        return min(count - 1, int(self.between(0.0, count)))

    def chance(self, share: float) -> bool:
        """Return true in a share of the draws."""
        return self.between(0.0, 1.0) < share


@dataclass
class Converted:
    """A road of highway-env in our arrays."""

    road: n.Road
    bodies: tuple[Floats, Ints, Floats]

    def advance(self, kernel: Advance = advance_crashing_reference, step: float = STEP) -> None:
        """Advance everything by one tick."""
        kernel(self.road, *self.bodies, step)

    @property
    def lanes(self) -> Floats:
        """(L, LANE_WIDTH)."""
        return self.road.lanes

    @property
    def vehicles(self) -> Floats:
        """(N, VEHICLE_WIDTH)."""
        return self.road.vehicles

    @property
    def marks(self) -> Ints:
        """(N, MARK_WIDTH)."""
        return self.road.marks

    @property
    def states(self) -> Floats:
        """(N, 4) x, y, heading, speed in our frame."""
        return self.vehicles[self.marks[:, n.ROLE] != n.FIXED, :4].copy()

    @property
    def own_lanes(self) -> list[int]:
        """Lane that each vehicle is on."""
        return [int(lane) for lane in self.marks[self.marks[:, n.ROLE] != n.FIXED, n.LANE]]


def _mirrored(point: Any) -> tuple[float, float]:
    return float(point[0]), 0.0 - float(point[1])


def _write_lane(row: Floats, lane: Any) -> None:
    limit = math.inf if lane.speed_limit is None else float(lane.speed_limit)
    if isinstance(lane, CircularLane):
        lane_kernel.write_arc(
            row,
            *_mirrored(lane.center),
            float(lane.radius),
            -float(lane.start_phase),
            -float(lane.direction),
            float(lane.length),
            float(lane.width),
            limit,
        )
    elif isinstance(lane, StraightLane) and not isinstance(lane, SineLane):
        heading, length = -float(lane.heading), float(lane.length)
        lane_kernel.write_straight(
            row, *_mirrored(lane.start), heading, length, float(lane.width), limit
        )
        # To the bit what highway-env has: it takes the direction from the two ends.
        row[lane_kernel.LANE_COSINE], row[lane_kernel.LANE_SINUS] = _mirrored(lane.direction)
    else:
        msg = f"there is no kernel for a {type(lane).__name__}"
        raise TypeError(msg)
    row[lane_kernel.FORBIDDEN] = float(lane.forbidden)


def convert_network(network: Any, *, connected: bool) -> tuple[Floats, Ints]:
    """Write a road network as lanes and links."""
    roads = [
        (begin, end, len(lanes))
        for begin, ends in network.graph.items()
        for end, lanes in ends.items()
    ]
    found = network.lanes_list()
    rows = np.zeros((len(found), lane_kernel.LANE_WIDTH))
    for row, lane in zip(rows, found, strict=True):
        _write_lane(row, lane)
    links = build_links(roads, connected=connected)
    mark_alongside(rows, links)
    return rows, links


def convert(road: Any) -> Converted:
    """Write a road and everything on it, as it is now."""
    lanes, links = convert_network(road.network, connected=road.neighbour_vehicles_connected_lanes)
    numbers = {index: number for number, index in enumerate(road.network.lanes_dict())}
    things = [*road.vehicles, *road.objects]
    vehicles = np.zeros((len(things), n.VEHICLE_WIDTH))
    marks = np.zeros((len(things), n.MARK_WIDTH), dtype=np.int64)
    marks[:, n.ORDER] = marks[:, n.ORDER_X] = np.arange(len(things))
    own = n.Road(lanes, links, vehicles, marks, *make_lists(len(lanes), len(things)))
    for who, thing in enumerate(things):
        row = vehicles[who]
        row[n.X], row[n.Y] = _mirrored(thing.position)
        row[n.HEADING], row[n.SPEED] = 0.0 - float(thing.heading), float(thing.speed)
        row[n.COSINE], row[n.SINUS] = math.cos(row[n.HEADING]), math.sin(row[n.HEADING])
        # All of one length: highway-env's gap knows no other.
        row[n.LENGTH] = IDMVehicle.LENGTH
        marks[who, n.LANE] = numbers[thing.lane_index]
        locate(own, who)
        if marks[who, n.LANE] != numbers[thing.lane_index]:
            msg = f"a thing is on {thing.lane_index} in highway-env and not here"
            raise RuntimeError(msg)
        marks[who, n.TARGET] = marks[who, n.LANE]
        if isinstance(thing, ControlledVehicle):
            _write_driver(row, marks[who], thing)
            marks[who, n.TARGET] = numbers[thing.target_lane_index]
    sizes = np.array([[thing.LENGTH, thing.WIDTH] for thing in things])
    return Converted(own, make_bodies(sizes))


def _write_driver(row: Floats, marks: Ints, driver: Any) -> None:
    row[n.DESIRED_SPEED] = float(driver.target_speed)
    row[n.TOP_SPEED] = float(driver.MAX_SPEED)
    marks[n.ROLE] = n.CRUISING
    if isinstance(driver, IDMVehicle):
        marks[n.ROLE] = n.CHANGING if driver.enable_lane_change else n.FOLLOWING
        row[n.TIMER] = float(driver.timer)
        row[n.EXPONENT] = float(driver.DELTA)
        row[n.JAM_DISTANCE] = float(driver.DISTANCE_WANTED)
        row[n.TIME_GAP] = float(driver.TIME_WANTED)
        row[n.GAIN] = float(driver.COMFORT_ACC_MAX)
        row[n.BRAKING] = 2.0 * math.sqrt(-driver.COMFORT_ACC_MAX * driver.COMFORT_ACC_MIN)


# --- roads ----------------------------------------------------------------------------------------


def _from_environment(environment: Any, *, connected: bool) -> Any:
    """Let an environment of highway-env make its road, without making the environment."""
    config = {
        "show_trajectories": False,
        "neighbour_vehicles_connected_lanes": connected,
    }
    stand_in = SimpleNamespace(config=config, np_random=None)
    environment._make_road(stand_in)
    made = stand_in.road
    road = Road(made.network, neighbour_vehicles_connected_lanes=connected)
    for thing in made.objects:
        road.objects.append(Obstacle(road, thing.position, thing.heading))
    return road


def straight_road(*, connected: bool) -> Any:
    """Four lanes, 3 km."""
    network = RoadNetwork.straight_road_network(4, length=3000.0, speed_limit=30.0)
    return Road(network, neighbour_vehicles_connected_lanes=connected)


def curved_road(*, connected: bool) -> Any:
    """Straight, a left arc, a right arc, straight; three lanes, the last road two."""
    network = RoadNetwork()
    width, radius, angle = 4.0, 120.0, 1.2
    for lane in range(3):
        y = width * lane
        network.add_lane("a", "b", StraightLane((0.0, y), (150.0, y), width=width, speed_limit=30))
    centre = (150.0, radius)
    for lane in range(3):
        phase = -0.5 * math.pi
        network.add_lane(
            "b",
            "c",
            CircularLane(centre, radius - width * lane, phase, phase + angle, speed_limit=25),
        )
    turned = (
        centre[0] + 2.0 * radius * math.sin(angle),
        centre[1] - 2.0 * radius * math.cos(angle),
    )
    for lane in range(3):
        phase = 0.5 * math.pi + angle
        network.add_lane(
            "c",
            "d",
            CircularLane(
                turned,
                radius + width * lane,
                phase,
                phase - angle,
                clockwise=False,
                speed_limit=None,
            ),
        )
    x, y = turned[0], turned[1] + radius
    for lane in range(2):
        across = width * lane
        network.add_lane("d", "e", StraightLane((x, y + across), (x + 400.0, y + across)))
    return Road(network, neighbour_vehicles_connected_lanes=connected)


def intersection(*, connected: bool) -> Any:
    """The road of intersection-v0."""
    return _from_environment(IntersectionEnv, connected=connected)


ROADS: dict[str, Callable[..., Any]] = {
    "straight": straight_road,
    "curved": curved_road,
    "intersection": intersection,
}


# --- scenes ---------------------------------------------------------------------------------------


def scene(kind: str, seed: int, vehicles: int) -> Any:
    """Make a road of highway-env with vehicles beside the centres of their lanes."""
    draw = Draw(seed)
    road = ROADS[kind](connected=kind != "straight" and draw.chance(0.5))
    lanes = road.network.lanes_list()
    dense = draw.chance(0.5)
    attempts = 0
    while len(road.vehicles) < vehicles:
        attempts += 1
        lane = lanes[draw.below(len(lanes))]
        room = min(lane.length, (15.0 if dense else 30.0) * vehicles + 40.0)
        s, lateral = draw.between(0.0, room), draw.between(-1.0, 1.0)
        position = lane.position(s, lateral)
        near = min(
            (float(np.linalg.norm(position - v.position)) for v in road.vehicles), default=math.inf
        )
        # A full road takes no more: then they stand closer, and some touch at once.
        if near < (9.0 if attempts < 40 * vehicles else 5.5):
            if attempts > 400 * vehicles:
                break
            continue
        road.vehicles.append(_driver(road, draw, position, lane.heading_at(s), lane.speed_limit))
    return road


def _driver(road: Any, draw: Draw, position: Any, along: float, limit: float | None) -> Any:
    heading = along + draw.between(-0.12, 0.12)
    usual = 25.0 if limit is None else float(limit)
    speed = usual * draw.between(0.4, 1.2)
    if not road.vehicles and draw.chance(0.5):
        return MDPVehicle(road, position, heading, speed)
    vehicle = IDMVehicle(
        road,
        position,
        heading,
        speed,
        target_speed=usual * draw.between(0.5, 1.3),
        enable_lane_change=draw.chance(0.9),
    )
    if draw.chance(0.8):
        vehicle.DELTA = draw.between(3.5, 4.5)
    if draw.chance(0.3):
        vehicle.DISTANCE_WANTED, vehicle.COMFORT_ACC_MAX, vehicle.COMFORT_ACC_MIN = 7.0, 6.0, -3.0
    return vehicle
