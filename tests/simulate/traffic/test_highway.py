"""The reference traffic and the compiled one compute what highway-env does."""

import subprocess
import sys
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pytest
from highway_env.road.lane import StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle

from adeye.errors import UsageError
from adeye.kernel.road import position
from adeye.kernel.traffic import network as n
from adeye.kernel.traffic.network import ALONGSIDE
from adeye.signals import Floats
from adeye.simulate.traffic import make_traffic, variant_of
from adeye.simulate.traffic.highway import HighwayTraffic, build_network
from adeye.simulate.world.compile import compile_world
from adeye.sweep.case import TestCase
from benchmarks.support.crash import advance_crashing_fast, advance_crashing_reference
from benchmarks.support.highway_scenes import ROADS, Converted, convert, scene
from tests.motorway import make_case, make_scenario
from tests.simulate.traffic import test_batch as batch
from tests.simulate.traffic.parity import SLOWEST, Comparison, compare


# Size of highway_env's own vehicles, with which its constants agree.
def plain(actor: dict[str, Any]) -> dict[str, Any]:
    return {**actor, "size": {"length": "5 m", "width": "2 m", "height": "1.5 m"}}


drive = partial(batch.drive, HighwayTraffic())


# Of the size of highway_env's own vehicles, with which its constants agree.
DENSE: dict[str, Any] = {
    name: plain(actor) for name, actor in batch.DENSE.items() if name[1] == "_"
}


def reference(case: TestCase, ticks: int) -> tuple[Floats, set[int]]:
    """Drive highway_env by hand, with nothing of ours but the ego's and the timers' values."""
    network = RoadNetwork()
    for d in (8.75, 5.25, 1.75):
        lane = StraightLane((-1000.0, -d), (3000.0, -d), width=3.5, speed_limit=None)
        network.add_lane("0", "1", lane)
    road = Road(network=network)
    ego = Vehicle(road, (200.0, -5.25), 0.0, 10.0)
    ego.target_speed = 10.0
    road.vehicles.append(ego)
    world = compile_world([case])
    mirror = HighwayTraffic()
    mirror.reset([case])
    for number, state in enumerate(world.objects[0]):
        vehicle = IDMVehicle(road, (state[0], -state[1]), 0.0, state[3])
        vehicle.target_speed = world.desired_speed[0, number]
        vehicle.timer = mirror.roads[0].vehicles[1 + number].timer
        road.vehicles.append(vehicle)
    for vehicle in road.vehicles:
        vehicle.collidable = False
    lanes: set[int] = set()
    rows = [world.objects[0]]
    for tick in range(ticks):
        road.act()
        road.step(0.05)
        ego.position = np.array([200.0 + 10.0 * 0.05 * (tick + 1), -5.25])
        ego.on_state_update()
        others = road.vehicles[1:]
        states = [
            [*v.position * [1, -1], -v.heading, v.speed, v.action["acceleration"]] for v in others
        ]
        rows.append(np.array(states))
        lanes.add(others[1].lane_index[2])
    return np.stack(rows), lanes


@pytest.mark.slow
def test_reactive_actors_have_the_bits_of_a_road_built_by_hand() -> None:
    scenario = make_scenario(actors=DENSE, ego={"speed": "10 m/s"}, horizon="20 s")
    case = make_case(scenario)
    expected, lanes = reference(case, 300)
    found = drive([case], 300)[0]
    # The scene has teeth: the fast one overtakes.
    assert len(lanes) > 1
    np.testing.assert_array_equal(found, expected)


def test_a_reactive_actor_does_not_exceed_its_desired_speed_or_lose_it_to_the_limit() -> None:
    actors = {"fast": plain(batch.car(2, "300 m", "40 m/s", "48 m/s"))}
    last = drive([make_case(make_scenario(actors=actors, horizon="60 s"))], 900)[0, -1]
    assert last[0, 3] == pytest.approx(48.0, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("radius", ["500 m", "-500 m"])
def test_reactive_actors_follow_a_curve_in_their_lane(radius: str) -> None:
    def actor(lane: int) -> dict[str, Any]:
        start = {"lane": lane, "s": "20 m", "speed": "25 m/s"}
        return {"kind": "car", "start": start, "reactive": {}}

    road = {"kind": "s_curve", "radius": radius, "length": "900 m"}
    actors = {"a_right": actor(0), "b_left": actor(2)}
    ego = {"speed": "0 m/s"}
    scenario = make_scenario(actors=actors, world={"road": road}, ego=ego, horizon="60 s")
    traffic = HighwayTraffic()
    traffic.reset([make_case(scenario)])
    for _ in range(600):
        scene = traffic.step(np.zeros((1, 2)))
        places = scene.object_places[0]
        assert places[:, 4].tolist() == [0.0, 2.0]
        assert np.abs(places[:, 5]).max() < 0.6
    assert scene.object_places[0, :, 0].min() > 700.0


@pytest.mark.parametrize("radius", ["300 m", "-300 m"])
def test_the_lanes_of_highway_env_are_ours_with_y_flipped(radius: str) -> None:
    road = {"kind": "s_curve", "radius": radius, "length": "900 m"}
    world = compile_world([make_case(make_scenario(world={"road": road}))])
    segments = world.context.road.segments[0]
    network = build_network(segments, 3, 3.5)
    start = 0.0
    for number, segment in enumerate(segments):
        for along in (0.0, 0.5 * segment[3], segment[3]):
            for lane in range(3):
                theirs = network.get_lane((str(number), str(number + 1), 2 - lane))
                # Theirs is measured along the lane's own centre.
                d = (lane + 0.5) * 3.5
                own = along * (1.0 - segment[4] * d) + (1000.0 if number == 0 else 0.0)
                x, y, heading = position(segments, start + along, d)
                np.testing.assert_allclose(theirs.position(own, 0.0), [x, -y], atol=1e-8)
                turned = theirs.heading_at(own) + heading
                assert np.cos(turned) == pytest.approx(1.0)
        start += segment[3]


def test_the_ego_and_scripted_actors_stand_where_their_states_say() -> None:
    actors = {
        **DENSE,
        "script": {"kind": "van", "start": {"lane": 2, "s": "500 m", "speed": "7 m/s"}},
    }
    traffic = HighwayTraffic()
    traffic.reset([make_case(make_scenario(actors=actors))])
    for _ in range(20):
        scene = traffic.step(np.array([[-1.0, 0.01]]))
    vehicles = traffic.roads[0].vehicles
    ego = scene.ego[0]
    assert vehicles[0].position.tolist() == [ego[0], -ego[1]]
    assert (vehicles[0].heading, vehicles[0].speed) == (-ego[2], ego[3])
    assert ego[2] > 0.0
    van = scene.objects[0, -1]
    assert vehicles[-1].position.tolist() == [van[0], -van[1]]
    assert vehicles[-1].target_speed == 7.0
    assert (vehicles[-1].LENGTH, vehicles[-1].WIDTH) == (5.9, 2.0)


def global_generator() -> tuple[list[int], int]:
    state: Any = np.random.get_state()  # noqa: NPY002 - the generator that must not matter
    return state[1].tolist(), state[2]


def test_the_global_generators_of_numpy_change_nothing() -> None:
    case = make_case(make_scenario(actors=DENSE))
    first = drive([case], 80)
    untouched = global_generator()
    np.random.normal(size=1000)  # noqa: NPY002
    moved = global_generator()
    np.testing.assert_array_equal(drive([case], 80), first)
    assert moved != untouched
    assert global_generator() == moved


def test_traffic_is_made_by_its_name() -> None:
    assert make_traffic("highway").name == "highway"
    assert variant_of("highway").startswith("highway-env-1.")
    with pytest.raises(UsageError, match="Did you mean 'highway'"):
        make_traffic("highwai")


@pytest.mark.slow
def test_importing_it_prints_nothing_and_naming_it_imports_nothing() -> None:
    program = (
        "import sys; from adeye.simulate.traffic import variant_of, make_traffic;"
        "variant_of('highway');"
        "assert 'highway_env' not in sys.modules; make_traffic('highway');"
        "assert 'highway_env' in sys.modules"
    )
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, check=False
    )
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


# --- The compiled traffic computes what highway-env computes, on all its kinds of roads -----------

SAME = 1e-9
"""Difference up to which two arithmetics of one model agree [m], [rad], [m/s]."""


class Plan(NamedTuple):
    """Scenes of one kind of road, and what makes them a trial.

    Attributes:
        counts: Scenes for each number of vehicles.
        steps: Compared at least.
        changes: Lane changes at least.
        contacts: Vehicles that touch something at least.
    """

    counts: dict[int, int]
    steps: int
    changes: int
    contacts: int


# 55 scenes.
PLANS = {
    "straight": Plan({2: 4, 3: 4, 5: 6, 8: 3, 12: 2, 20: 1, 50: 1}, 5000, 60, 5),
    "curved": Plan({2: 6, 3: 4, 5: 6, 12: 2, 20: 1}, 4000, 30, 6),
    "intersection": Plan({2: 8, 3: 4, 5: 6, 12: 2, 20: 1}, 4000, 0, 4),
}
# Of many vehicles, and of the two networks where they change lanes all the time.
LONG_PLANS = {
    "straight": Plan({5: 30, 20: 6, 35: 2, 50: 2}, 7500, 200, 10),
    "curved": Plan({5: 30, 20: 6, 35: 2, 50: 1}, 6000, 150, 20),
    "intersection": Plan({5: 40, 20: 4, 35: 1}, 5000, 0, 12),
}


def seed_of(vehicles: int, number: int) -> int:
    return 100 * vehicles + number


def check(kind: str, plan: Plan) -> None:
    """Compare all scenes of a plan, and see that they were worth it."""
    found = {
        (vehicles, seed_of(vehicles, number)): compare(
            scene(kind, seed_of(vehicles, number), vehicles)
        )
        for vehicles, count in plan.counts.items()
        for number in range(count)
    }
    assert {
        where: result.worst for where, result in found.items() if not result.worst <= SAME
    } == {}
    assert sum(result.steps for result in found.values()) >= plan.steps
    assert sum(result.changes for result in found.values()) >= plan.changes
    assert sum(result.crashed for result in found.values()) >= plan.contacts
    # Nobody is exactly on a centre line, where much would be exactly zero.
    assert max(result.turned for result in found.values()) > 0.2


@pytest.mark.slow
@pytest.mark.parametrize("kind", PLANS)
def test_reference_is_highway_env_to_a_billionth(kind: str) -> None:
    check(kind, PLANS[kind])


@pytest.mark.slow
@pytest.mark.parametrize("kind", LONG_PLANS)
def test_reference_is_highway_env_to_a_billionth_in_many_scenes(kind: str) -> None:
    check(kind, LONG_PLANS[kind])


# --- teeth ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("column", [n.X, n.Y, n.HEADING, n.SPEED])
def test_a_billionth_at_the_start_is_seen(column: int) -> None:
    def disturb(ours: Converted) -> None:
        ours.vehicles[0, column] += 1e-9
        heading = ours.vehicles[0, n.HEADING]
        ours.vehicles[0, [n.SINUS, n.COSINE]] = np.sin(heading), np.cos(heading)

    assert compare(scene("straight", 4, 5), 3).worst < 1e-13
    assert 0.9e-9 < compare(scene("straight", 4, 5), 3, disturb=disturb).worst < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("column", "by"),
    [
        (n.EXPONENT, 1e-6),
        (n.JAM_DISTANCE, 1e-6),
        (n.TIME_GAP, 1e-6),
        (n.GAIN, 1e-6),
        (n.BRAKING, 1e-5),
        (n.DESIRED_SPEED, 1e-6),
    ],
)
def test_a_millionth_of_a_driver_s_parameter_is_seen(column: int, by: float) -> None:
    def disturb(ours: Converted) -> None:
        ours.vehicles[:, column] += by

    undisturbed = compare(scene("straight", 503, 5))
    assert undisturbed.steps == 300
    assert undisturbed.worst <= SAME
    assert compare(scene("straight", 503, 5), disturb=disturb).worst > 100 * SAME


@pytest.mark.slow
def test_a_later_thought_of_changing_lanes_is_seen() -> None:
    def disturb(ours: Converted) -> None:
        ours.vehicles[:, n.TIMER] -= 0.5

    assert compare(scene("straight", 2000, 20)).changes > 0
    assert compare(scene("straight", 2000, 20), 150, disturb=disturb).worst > 1e-3


def test_a_wider_body_is_seen() -> None:
    def disturb(ours: Converted) -> None:
        ours.bodies[0][:, 1] += 0.5
        ours.bodies[0][:, 2] += 0.5

    plain = compare(scene("straight", 2, 5))
    assert plain.crashed > 0
    assert compare(scene("straight", 2, 5), disturb=disturb).worst > 1e-3


# --- the fast arithmetic --------------------------------------------------------------------------


def difference(kind: str, seed: int, vehicles: int) -> tuple[float, int, int]:
    """Return the worst difference of the two arithmetics, steps and contacts."""
    road = scene(kind, seed, vehicles)
    reference, fast = convert(road), convert(road)
    # Where it goes another way, it does.
    assert bool(fast.lanes[0, ALONGSIDE]) == (kind == "straight")
    worst, steps = 0.0, 0
    for _ in range(300):
        reference.advance(advance_crashing_reference)
        fast.advance(advance_crashing_fast)
        if (np.abs(reference.states[:, 3]) <= SLOWEST).any():
            break
        worst = max(worst, float(np.abs(reference.states - fast.states).max()))
        assert np.isfinite(worst)
        steps += 1
    return worst, steps, int(reference.marks[:, n.CRASHED].sum())


@pytest.mark.slow
@pytest.mark.parametrize("kind", ROADS)
def test_fast_is_the_reference_to_a_billionth(kind: str) -> None:
    # In none of these scenes a decision hangs on the last bits; where one does, both are right.
    counts = {2: 30, 5: 30, 12: 8, 20: 4, 50: 1}
    found = [
        difference(kind, 7000 + seed_of(vehicles, number), vehicles)
        for vehicles, count in counts.items()
        for number in range(count)
    ]
    assert max(worst for worst, _, _ in found) <= SAME
    # And it is another arithmetic.
    assert max(worst for worst, _, _ in found) > 0.0
    assert sum(steps for _, steps, _ in found) > 8000
    assert sum(contacts for _, _, contacts in found) > 5


@pytest.mark.slow
def test_fast_is_highway_env_to_a_billionth() -> None:
    found: list[Comparison] = [
        compare(scene(kind, seed, 5), kernel=advance_crashing_fast)
        for kind in ("straight", "curved", "intersection")
        for seed in range(6)
    ]
    assert max(result.worst for result in found) <= SAME
    assert sum(result.changes for result in found) > 5
