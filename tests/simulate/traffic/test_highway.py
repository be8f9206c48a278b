"""The reference traffic: its drivers are highway_env's, in our frame, to the last bit."""

import subprocess
import sys
from functools import partial
from typing import Any

import numpy as np
import pytest
from highway_env.road.lane import StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle

from adeye.errors import UsageError
from adeye.kernel.road import position
from adeye.signals import Floats
from adeye.simulate.traffic import make_traffic, variant_of
from adeye.simulate.traffic.highway import HighwayTraffic, build_network
from adeye.simulate.world.compile import compile_world
from adeye.sweep.case import TestCase
from tests.motorway import make_case, make_scenario
from tests.simulate.traffic import test_batch as batch


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
    ego.collidable = False
    road.vehicles.append(ego)
    world = compile_world([case])
    mirror = HighwayTraffic()
    mirror.reset([case])
    for number, state in enumerate(world.objects[0]):
        vehicle = IDMVehicle(road, (state[0], -state[1]), 0.0, state[3])
        vehicle.target_speed = world.desired_speed[0, number]
        vehicle.timer = mirror.roads[0].vehicles[1 + number].timer
        vehicle.collidable = False
        road.vehicles.append(vehicle)
    lanes: set[int] = set()
    rows = [world.objects[0]]
    for tick in range(ticks):
        road.act()
        road.step(0.05)
        ego.position = np.array([200.0 + 10.0 * 0.05 * (tick + 1), -5.25])
        ego.on_state_update()
        rows.append(
            np.array(
                [
                    [v.position[0], -v.position[1], -v.heading, v.speed, v.action["acceleration"]]
                    for v in road.vehicles[1:]
                ]
            )
        )
        lanes.add(road.vehicles[2].lane_index[2])
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


@pytest.mark.slow
def test_a_follower_settles_behind_a_slow_leader_at_the_desired_gap() -> None:
    actors = {
        "ahead": {"kind": "truck", "start": {"lane": 0, "s": "400 m", "speed": "15 m/s"}},
        "follower": {
            "kind": "car",
            "start": {"lane": 0, "ahead_of": "ahead", "gap": "-60 m", "speed": "25 m/s"},
            "reactive": {"desired_speed": "30 m/s"},
        },
    }
    case = make_case(make_scenario(actors=actors, horizon="60 s"))
    last = drive([case], 1000)[0, -1]
    gap = last[0, 0] - last[1, 0] - 6.0 - 2.25
    assert last[1, 3] == pytest.approx(15.0, abs=0.01)
    # IDM's equilibrium between centres, less the bodies: (s0 + v T + lengths) / sqrt(1 - (v/v0)^4).
    lengths = 6.0 + 2.25
    equilibrium = (5.0 + 15.0 * 1.5 + lengths) / np.sqrt(1.0 - (15.0 / 30.0) ** 4) - lengths
    assert gap == pytest.approx(equilibrium, abs=0.05)


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


def test_a_step_to_the_left_of_a_lane_is_negative_in_highway_env() -> None:
    world = compile_world([make_case(make_scenario())])
    network = build_network(world.context.road.segments[0], 3, 3.5)
    lane = network.get_lane(("0", "1", 1))
    assert lane.local_coordinates(np.array([10.0, -(5.25 + 1.0)]))[1] == -1.0


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


def test_lane_change_timers_follow_the_situation_and_the_actor() -> None:
    scenario = make_scenario(actors=DENSE)
    timers = []
    for seed in (7, 7, 8):
        traffic = HighwayTraffic()
        traffic.reset([make_case(scenario, seed=seed)])
        timers.append([vehicle.timer for vehicle in traffic.roads[0].vehicles[1:]])
    assert timers[0] == timers[1]
    assert timers[0] != timers[2]
    assert len(set(timers[0])) == 5
    assert all(0.0 < timer < 1.0 for timer in timers[0])


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
