"""Faults of drive, brake, steering and tyres: what the vehicle then does, in closed form."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from adeye.kernel.motion import GRAVITY
from adeye.signals import EGO_SPEED, EGO_STEERING, EGO_X, EGO_Y, Floats
from adeye.simulate.faults import FaultPlan
from adeye.simulate.faults.command_faults import part_of
from adeye.simulate.traffic import make_traffic
from adeye.testing.sensors import injector, moment, scene_of
from tests.motorway import fault
from tests.simulate.faults.test_plan import ARCHITECTURE, CONTEXT, SCENARIO, STEP, case

QUICK = ARCHITECTURE.model_copy(
    update={
        "vehicle": ARCHITECTURE.vehicle.model_copy(
            update={"acceleration_lag": 0.0, "steering_lag": 0.0}
        )
    }
)
FREE = SCENARIO.model_copy(
    update={"actors": {}, "world": SCENARIO.world.model_copy(update={"objects": {}})}
)
SPEED = 20.0
ON = np.array([True])


def drive(command: tuple[float, float], *faults: Any, backend: str = "batch") -> list[Floats]:
    """Return the states of the ego (7,) tick by tick under a constant command, for 4 s."""
    whole = [_quick(case(*faults))]
    traffic = make_traffic(backend, None)
    context, scene = traffic.reset(whole)
    plan = FaultPlan(whole, context)
    asked = np.array([command])
    states = []
    for _ in range(80):
        states.append(scene.ego[0].copy())
        active = plan.update(scene)
        done = plan.on_actuators(asked, active, scene)
        scene = traffic.step(done, plan.on_tyres(context.surroundings.friction, active, scene))
    assert asked.tolist() == [list(command)]
    return states


def _quick(item: Any) -> Any:
    return replace(item, architecture=QUICK, scenario=FREE)


def test_braking_distance_with_half_the_brakes_is_twice_as_long() -> None:
    whole = drive((-8.0, 0.0))[-1][EGO_X]
    half = drive((-8.0, 0.0), fault("it", "actuators.brake", "loss", share=0.5))[-1]
    assert whole == pytest.approx(SPEED**2 / (2.0 * 8.0))
    assert half[EGO_SPEED] == pytest.approx(SPEED - 4.0 * 79 * STEP)
    assert half[EGO_X] == pytest.approx(SPEED * 79 * STEP - 0.5 * 4.0 * (79 * STEP) ** 2)


def test_loss_of_the_drive_leaves_the_brake() -> None:
    dead = fault("it", "actuators.drive", "loss", share=1.0)
    assert drive((2.0, 0.0), dead)[-1][EGO_SPEED] == pytest.approx(SPEED)
    assert drive((-2.0, 0.0), dead)[-1][EGO_SPEED] == pytest.approx(SPEED - 2.0 * 79 * STEP)


def test_faded_brake_loses_evenly() -> None:
    faded = fault("it", "actuators.brake", "fade", share=0.5, over="2 s")
    states = drive((-4.0, 0.0), faded)
    lost = [4.0 + (b[EGO_SPEED] - a[EGO_SPEED]) / STEP for a, b in pairwise(states)]
    ages = STEP * np.arange(79)
    assert lost == pytest.approx(2.0 * np.minimum(ages / 2.0, 1.0), abs=1e-9)


def test_offset_of_the_steering_is_at_the_wheels() -> None:
    states = drive(
        (0.0, 0.0), fault("it", "actuators.steering", "offset", "1 s", steering_angle="1 deg")
    )
    angles = np.array([state[EGO_STEERING] for state in states])
    assert (angles[:21] == 0.0).all()
    assert angles[21:] == pytest.approx(np.radians(1.0))
    assert states[-1][EGO_Y] > states[0][EGO_Y]


def test_rate_limited_steering_reaches_its_angle_late() -> None:
    limited = fault("it", "actuators.steering", "rate_limit", steering_rate="0.1 rad/s")
    angles = [state[EGO_STEERING] for state in drive((0.0, 0.02), limited)]
    assert angles[:6] == pytest.approx([0.0, 0.005, 0.01, 0.015, 0.02, 0.02])


def test_delayed_brake_begins_late() -> None:
    late = drive((-5.0, 0.0), fault("it", "actuators.brake", "delay", by="0.5 s"))
    speeds = np.array([state[EGO_SPEED] for state in late])
    assert (speeds[:11] == SPEED).all()
    assert speeds[11] == pytest.approx(SPEED - 5.0 * STEP)


def test_stuck_brake_goes_on_braking_while_the_drive_pulls() -> None:
    stuck = injector("stuck", "actuators.brake", runs=1)
    stuck.apply(np.array([-3.0]), moment(~ON))
    assert stuck.apply(np.array([0.0]), moment(ON)).tolist() == [-3.0]
    plan = FaultPlan([case(fault("it", "actuators.brake", "stuck", "0.1 s"))] * 3, CONTEXT)
    seen = []
    for tick, asked in enumerate((-1.0, -3.0, 2.0, 0.5)):
        scene = scene_of(CONTEXT, tick)
        command = np.array([[asked, 0.1]] * 3)
        seen.append(plan.on_actuators(command, plan.update(scene), scene)[0].tolist())
    assert seen == [[-1.0, 0.1], [-3.0, 0.1], [-1.0, 0.1], [-2.5, 0.1]]


@pytest.mark.parametrize("backend", ["batch", "highway"])
def test_slippery_tyres_brake_with_what_the_friction_leaves(backend: str) -> None:
    ice = drive((-8.0, 0.0), fault("it", "tyres", "friction", "1 s", value=0.1), backend=backend)
    speeds = np.array([state[EGO_SPEED] for state in ice])
    assert speeds[20] == pytest.approx(SPEED - 8.0 * 1.0)
    assert speeds[40] == pytest.approx(speeds[20] - 0.1 * GRAVITY * 1.0)


def test_factor_is_of_the_friction_of_the_road() -> None:
    made = injector(
        "friction", "tyres", parameters=[{"factor": 0.5}, {"value": 0.2}, {"factor": 1.0}]
    )
    road = np.array([0.9, 0.9, 0.7])
    assert made.apply(road, moment(np.ones(3, dtype=np.bool_))).tolist() == [0.45, 0.2, 0.7]


def test_no_fault_of_an_actuator_hands_on_the_very_same_command() -> None:
    scene = scene_of(CONTEXT, 0)
    command, friction = np.ones((3, 2)), np.ones(3)
    for faults in ((), (fault("it", "actuators.brake", "loss", "9 s", share=1.0),)):
        plan = FaultPlan([case(*faults)] * 3, CONTEXT)
        active = plan.update(scene)
        assert plan.on_actuators(command, active, scene) is command
        assert plan.on_tyres(friction, active, scene) is friction


def test_parts_of_a_command_add_up_to_it() -> None:
    command = np.array([[2.0, 0.1], [-3.0, -0.2], [0.0, 0.0]])
    assert part_of("drive", command).tolist() == [2.0, 0.0, 0.0]
    assert part_of("brake", command).tolist() == [0.0, -3.0, 0.0]
    assert part_of("steering", command).tolist() == [0.1, -0.2, 0.0]
