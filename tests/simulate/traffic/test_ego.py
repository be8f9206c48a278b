"""The ego stage: limits, braking distance, batches."""

import math
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
    friction: float = 0.9,
    **vehicle: str,
) -> Floats:
    """Return the states (B, T, 7) after each tick under one command."""
    case = make_case(make_scenario(environment={"friction": friction}), vehicle=vehicle)
    world = compile_world([case] * runs)
    stage = Ego([case] * runs, world.context)
    states = world.ego.copy()
    rows: list[Any] = []
    for _ in range(ticks):
        stage.move(np.ones(runs, dtype=np.bool_), np.tile(command, (runs, 1)), states)
        rows.append(states.copy())
    return np.stack(rows, axis=1)


def test_ego_brakes_as_vehicle_and_road_let_it_and_turns_left_by_a_positive_angle() -> None:
    lost = 6.0 * (0.05 - 0.2 * (1.0 - math.exp(-0.05 / 0.2)))
    table: list[tuple[float, dict[str, Any], float]] = [
        (-6.0, {"acceleration_lag": "0 s"}, 6.0 * 0.05),
        (-6.0, {"acceleration_lag": "0.2 s"}, lost),
        (-50.0, {"acceleration_lag": "0 s", "max_deceleration": "5 m/s^2"}, 5.0 * 0.05),
    ]
    for command, limits, braked in table:
        states = drive((command, 0.0), 1, **limits)
        assert states[0, 0, EGO_SPEED] == pytest.approx(30.0 - braked), limits
    icy = drive((-9.0, 0.0), 1, acceleration_lag="0 s", friction=0.2)
    assert icy[0, 0, EGO_SPEED] == pytest.approx(30.0 - 0.2 * 9.80665 * 0.05)
    stopped = drive((-6.0, 0.0), 150, acceleration_lag="0 s")[0, -1]
    assert stopped[[EGO_X, EGO_SPEED]] == pytest.approx([200.0 + 30.0**2 / 12.0, 0.0])
    for angle in (0.02, -0.02):
        assert (drive((0.0, angle), 40)[0, -1, EGO_Y] - 5.25) / angle > 50.0


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
