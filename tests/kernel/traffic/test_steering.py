"""How vehicles steer and move: laws, and highway-env's own controller and bicycle."""

import math
from typing import Any

import numpy as np
import pytest
from highway_env.vehicle.controller import ControlledVehicle

from adeye.kernel.elementary import atan, sin
from adeye.kernel.traffic import drivers as k
from adeye.kernel.traffic import network as n
from benchmarks.support.highway_scenes import STEP, Draw, convert, scene
from tests.kernel.lane_road import LaneRoad

POSES = [
    (lateral, heading, speed)
    for lateral in (-3.0, -0.4, 0.0, 1e-9, 2.0)
    for heading in (-2.5, -0.3, 0.0, 0.02, 1.5)
    for speed in (0.0, 0.7, 5.0, 30.0)
]


@pytest.mark.parametrize("kind", ["straight", "curved"])
def test_steering_is_highway_env_s(kind: str) -> None:
    road = scene(kind, 11, 6)
    ours = convert(road)
    k.steer_reference(ours.road)
    for who, vehicle in enumerate(road.vehicles):
        expected = ControlledVehicle.steering_control(vehicle, vehicle.target_lane_index)
        assert ours.vehicles[who, n.CONTROL] == pytest.approx(-math.tan(expected), abs=1e-12)
        assert expected != 0.0


def test_slip_sine_is_that_of_the_steering_angle() -> None:
    for pose in POSES:
        given = (0.1, *pose, 5.0)
        slip = atan(0.5 * k.steering_tangent(*given))
        assert k.slip_sine(*given) == pytest.approx(sin(slip), abs=1e-14)


@pytest.mark.parametrize("speed", [0.0, 0.3, 30.0])
def test_on_the_centre_of_a_lane_and_along_it_the_control_is_exactly_zero(speed: float) -> None:
    assert k.steering_tangent(0.7, 0.0, 0.7, speed, 5.0) == 0.0
    assert k.slip_sine(0.7, 0.0, 0.7, speed, 5.0) == 0.0


@pytest.mark.parametrize("steer", [k.steering_tangent, k.slip_sine])
def test_steering_is_odd(steer: Any) -> None:
    for lateral, heading, speed in POSES:
        mirrored = steer(0.0, -lateral, -heading, speed, 5.0)
        assert mirrored == pytest.approx(-steer(0.0, lateral, heading, speed, 5.0), abs=1e-15)


@pytest.mark.parametrize("steer", [k.steering_tangent, k.slip_sine])
def test_left_of_the_centre_it_steers_to_the_right(steer: Any) -> None:
    assert steer(0.0, 1.0, 0.0, 20.0, 5.0) < 0.0


def test_a_hard_turn_is_at_the_limit_of_the_wheels_in_both_arithmetics() -> None:
    assert k.steering_tangent(0.0, 0.0, 1.5, 1.0, 5.0) == -k.MAX_STEERING_TANGENT
    assert k.slip_sine(0.0, 0.0, 1.5, 1.0, 5.0) == -k.MAX_SLIP_SINE
    assert math.sin(math.atan(0.5 * math.tan(math.pi / 3.0))) == pytest.approx(k.MAX_SLIP_SINE)


@pytest.mark.parametrize("kind", ["straight", "curved"])
def test_a_step_is_highway_env_s_bicycle(kind: str) -> None:
    road = scene(kind, 12, 6)
    ours = convert(road)
    draw = Draw(5)
    for who, vehicle in enumerate(road.vehicles):
        steering, acceleration = draw.between(-0.6, 0.6), draw.between(-4.0, 4.0)
        vehicle.action = {"steering": -steering, "acceleration": acceleration}
        ours.vehicles[who, [n.CONTROL, n.ACCELERATION]] = math.tan(steering), acceleration
        vehicle.step(STEP)
    k.move_reference(ours.vehicles, ours.marks, STEP)
    for who, vehicle in enumerate(road.vehicles):
        x, y = vehicle.position
        expected = [x, -y, -vehicle.heading, vehicle.speed]
        assert ours.vehicles[who, :4].tolist() == pytest.approx(expected, abs=1e-12)


def test_both_arithmetics_move_alike() -> None:
    slow, quick = LaneRoad(), LaneRoad()
    for road in (slow, quick):
        for place, control in enumerate((-0.6, 0.0, 0.003, 0.9)):
            road.put(1, 30.0 * place, 20.0, heading=0.1 * place, control=control)
    quick.vehicles[:, n.CONTROL] = np.sin(np.arctan(0.5 * slow.vehicles[:, n.CONTROL]))
    k.move_reference(slow.vehicles, slow.marks, STEP)
    k.move_fast(quick.vehicles, quick.marks, STEP)
    columns = [n.X, n.Y, n.HEADING, n.SPEED, n.SINUS, n.COSINE, n.TIMER]
    np.testing.assert_allclose(
        slow.vehicles[:, columns], quick.vehicles[:, columns], rtol=0, atol=1e-13
    )


@pytest.mark.slow
@pytest.mark.parametrize("move", [k.move_reference, k.move_fast])
def test_braking_ends_at_standstill_and_says_what_it_took(move: Any) -> None:
    road = LaneRoad()
    road.put(1, 100.0, 0.2, acceleration=-6.0)
    move(road.vehicles, road.marks, STEP)
    assert road.vehicles[0, n.SPEED] == 0.0
    assert road.vehicles[0, n.ACCELERATION] == pytest.approx(-0.2 / STEP)
    move(road.vehicles, road.marks, STEP)
    assert (road.vehicles[0, n.SPEED], road.vehicles[0, n.ACCELERATION]) == (0.0, 0.0)
    assert road.vehicles[0, n.X] == pytest.approx(100.0 + 0.2 * STEP)


@pytest.mark.slow
@pytest.mark.parametrize("move", [k.move_reference, k.move_fast])
def test_a_crashed_vehicle_brakes_straight_on(move: Any) -> None:
    road = LaneRoad()
    road.put(1, 100.0, 12.0, control=0.2, acceleration=3.0)
    road.marks[0, n.CRASHED] = 1
    move(road.vehicles, road.marks, STEP)
    assert road.vehicles[0, n.SPEED] == pytest.approx(12.0 * (1.0 - STEP))
    assert (road.vehicles[0, n.HEADING], road.vehicles[0, n.Y]) == (0.0, -4.0)


@pytest.mark.parametrize("move", [k.move_reference, k.move_fast])
def test_above_its_top_speed_a_vehicle_slows_down(move: Any) -> None:
    road = LaneRoad()
    road.put(1, 100.0, 42.0, top_speed=40.0, acceleration=5.0)
    move(road.vehicles, road.marks, STEP)
    assert road.vehicles[0, n.SPEED] == pytest.approx(42.0 - 2.0 * STEP)


@pytest.mark.parametrize("move", [k.move_reference, k.move_fast])
def test_objects_and_placed_vehicles_are_not_moved(move: Any) -> None:
    road = LaneRoad()
    road.put(1, 100.0, 20.0, n.PLACED, acceleration=2.0)
    road.put(1, 150.0, 0.0, n.FIXED)
    before = road.vehicles.copy()
    move(road.vehicles, road.marks, STEP)
    np.testing.assert_array_equal(road.vehicles, before)


@pytest.mark.slow
@pytest.mark.parametrize("advance", [k.advance_reference, k.advance_fast])
def test_an_oblique_vehicle_settles_on_the_centre_of_its_lane(advance: Any) -> None:
    road = LaneRoad()
    road.put(1, 100.0, 20.0, n.FOLLOWING, y=-5.2, heading=0.2)
    for _ in range(150):
        advance(road.road, STEP)
    assert road.vehicles[0, n.LATERAL] == pytest.approx(0.0, abs=1e-4)
    assert road.vehicles[0, n.HEADING] == pytest.approx(0.0, abs=1e-4)
    assert road.vehicles[0, n.S] > 250.0


@pytest.mark.slow
def test_a_driver_in_its_lane_keeps_the_exact_centre_line_and_its_kinematics() -> None:
    road = LaneRoad()
    road.put(1, 100.0, 20.0, n.FOLLOWING)
    for _ in range(50):
        k.advance_fast(road.road, STEP)
    assert road.vehicles[0, [n.Y, n.HEADING, n.LATERAL]].tolist() == [-4.0, 0.0, 0.0]


def test_locate_finds_lane_and_place() -> None:
    road = LaneRoad()
    who = road.put(2, 77.0, y=-7.5)
    road.marks[who, n.LANE] = 0
    k.locate(road.road, who)
    assert road.marks[who, n.LANE] == 2
    assert road.vehicles[who, [n.S, n.LATERAL]].tolist() == [77.0, 0.5]


def test_locating_the_drivers_leaves_everybody_else() -> None:
    road = LaneRoad()
    driver, placed = road.put(0, 50.0), road.put(0, 90.0, role=n.PLACED)
    road.vehicles[:, n.X] += 10.0
    k.locate_drivers(road.road)
    assert road.vehicles[[driver, placed], n.S].tolist() == [60.0, 90.0]
