"""The ego stage: limits, braking distance, batches."""

from typing import Any

import numpy as np
import pytest

from adeye.signals import EGO_SPEED, EGO_X, EGO_Y, Floats
from adeye.simulate.traffic.stage import Ego
from adeye.simulate.world.compile import compile_world
from tests.motorway import make_case, make_scenario


def drive(
    command: tuple[float, float],
    ticks: int,
    *,
    runs: int = 1,
    step: float = 0.05,
    friction: float = 0.9,
    **vehicle: str,
) -> Floats:
    scenario = make_scenario(environment={"friction": friction})
    case = make_case(scenario, vehicle=vehicle, step=step)
    world = compile_world([case] * runs)
    stage = Ego([case] * runs, world.context)
    states = world.ego.copy()
    rows: list[Any] = []
    for _ in range(ticks):
        stage.move(np.ones(runs, dtype=np.bool_), np.tile(command, (runs, 1)), states)
        rows.append(states.copy())
    return np.stack(rows, axis=1)


def test_braking_without_lag_takes_speed_squared_over_twice_the_deceleration() -> None:
    states = drive((-6.0, 0.0), 150, acceleration_lag="0 s")
    assert states[0, -1, EGO_X] - 200.0 == pytest.approx(30.0**2 / 12.0, abs=1e-9)
    assert states[0, -1, EGO_SPEED] == 0.0


def test_lag_adds_speed_times_lag_to_the_braking_distance() -> None:
    prompt = drive((-6.0, 0.0), 200, acceleration_lag="0 s")[0, -1, EGO_X]
    late = drive((-6.0, 0.0), 200, acceleration_lag="0.2 s")[0, -1, EGO_X]
    # The lagged response loses 6 * lag of speed, which the full deceleration makes up for;
    # the speed that is left when the acceleration has settled differs by terms of lag squared.
    assert late - prompt == pytest.approx(30.0 * 0.2, abs=6.0 * 0.2**2)


def test_the_deceleration_is_limited_by_the_vehicle() -> None:
    limited = drive((-50.0, 0.0), 120, acceleration_lag="0 s", max_deceleration="5 m/s^2")
    assert limited[0, 0, EGO_SPEED] == pytest.approx(30.0 - 5.0 * 0.05)


def test_the_deceleration_is_limited_by_the_friction() -> None:
    icy = drive((-9.0, 0.0), 1, acceleration_lag="0 s", friction=0.2)
    assert icy[0, 0, EGO_SPEED] == pytest.approx(30.0 - 0.2 * 9.80665 * 0.05)


def test_a_positive_steering_angle_turns_left() -> None:
    assert drive((0.0, 0.02), 40)[0, -1, EGO_Y] > 5.25 + 1.0
    assert drive((0.0, -0.02), 40)[0, -1, EGO_Y] < 5.25 - 1.0


def test_runs_of_a_batch_have_the_bits_of_a_single_run() -> None:
    alone = drive((-2.0, 0.01), 60)
    together = drive((-2.0, 0.01), 60, runs=7)
    assert all(together[run].tolist() == alone[0].tolist() for run in range(7))


def test_a_run_that_has_ended_stays_where_it_is() -> None:
    cases = [make_case(make_scenario())] * 2
    world = compile_world(cases)
    states = world.ego.copy()
    Ego(cases, world.context).move(np.array([False, True]), np.zeros((2, 2)), states)
    assert states[0].tolist() == world.ego[0].tolist()
    assert states[1, EGO_X] == pytest.approx(201.5)
