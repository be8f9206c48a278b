"""R6: the world obeys physics: grip, actuators, geometry, weather; and the step does not matter."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from adeye.signals import EGO_HEADING, EGO_SPEED, EGO_X, EGO_Y, Floats
from adeye.simulate.traffic import make_traffic
from tests.motorway import make_case, make_scenario

pytestmark = [
    pytest.mark.requirements,
    pytest.mark.parametrize("backend", ["batch", "highway"]),
]

GRAVITY = 9.80665
Command = Callable[[float], tuple[float, float]]


def drive(
    backend: str,
    command: Command,
    seconds: float,
    *,
    step: float = 0.05,
    friction: float = 0.9,
    speed: float = 20.0,
    **vehicle: str,
) -> Floats:
    """Drive the ego under a command of the time that is held for each step; (T, 7) states."""
    scenario = make_scenario(environment={"friction": friction}, horizon=f"{seconds} s")
    traffic = make_traffic(backend)
    case = make_case(scenario, {"ego_speed": speed}, vehicle=vehicle, step=step)
    _, scene = traffic.reset([case])
    rows: list[Any] = [scene.ego[0].copy()]
    for tick in range(round(seconds / step)):
        scene = traffic.step(np.array([command(tick * step)]))
        rows.append(scene.ego[0].copy())
    return np.array(rows)


@pytest.mark.parametrize(("friction", "deceleration"), [(0.9, 0.9 * GRAVITY), (0.3, 0.3 * GRAVITY)])
def test_emergency_stop_is_as_long_as_the_grip_allows(
    backend: str, friction: float, deceleration: float
) -> None:
    rows = drive(backend, lambda _: (-50.0, 0.0), 8.0, friction=friction, acceleration_lag="0 s")
    limit = min(deceleration, 9.0)
    assert rows[-1, EGO_SPEED] == 0.0
    assert rows[-1, EGO_X] - rows[0, EGO_X] == pytest.approx(20.0**2 / (2.0 * limit), abs=1e-9)


def test_actuator_lag_lengthens_the_stop_by_speed_times_lag(backend: str) -> None:
    ways = [
        np.ptp(drive(backend, lambda _: (-6.0, 0.0), 8.0, acceleration_lag=lag)[:, EGO_X])
        for lag in ("0 s", "0.2 s")
    ]
    assert ways[1] - ways[0] == pytest.approx(20.0 * 0.2, abs=6.0 * 0.2**2)


@pytest.mark.parametrize("friction", [0.3, 0.8])
def test_skid_pad_uses_the_grip_and_no_more(backend: str, friction: float) -> None:
    rows = drive(backend, lambda _: (2.0, 0.3), 12.0, friction=friction)
    turned = np.abs(np.unwrap(rows[:, EGO_HEADING]))
    lateral = np.diff(turned) / 0.05 * 0.5 * (rows[1:, EGO_SPEED] + rows[:-1, EGO_SPEED])
    assert lateral[20:].max() <= friction * GRAVITY * (1.0 + 1e-6)
    assert lateral[20:].max() > 0.95 * friction * GRAVITY


def test_halving_the_step_converges_with_second_order(backend: str) -> None:
    # The command changes only at multiples of the coarsest step, so every step drives the same.
    def swerve(time: float) -> tuple[float, float]:
        phase = math.floor(time / 0.4 + 1e-9) * 0.4
        return 1.5 * math.cos(phase), 0.05 * math.sin(phase)

    def end(step: float) -> Floats:
        last = drive(backend, swerve, 3.2, step=step)[-1]
        return np.asarray(last[[EGO_X, EGO_Y, EGO_HEADING]])

    exact = end(0.0125)
    errors = [float(np.abs(end(step) - exact).max()) for step in (0.4, 0.2, 0.1)]
    assert errors[0] > errors[1] > errors[2] > 0.0
    assert math.log2(errors[0] / errors[2]) / 2.0 > 1.9
    assert errors[2] < 1e-3
