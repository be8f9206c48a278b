import math

import numpy as np
import pytest

from adeye.kernel.profiles import PATH_ROW, PROFILE_ROW, fill_profile, lay_path
from adeye.signals import Floats
from adeye.simulate.channels.trajectory.cost import (
    LINE_D,
    LINE_ROW,
    SAMPLES,
    drive_line,
    profile_cost,
    rounded_square,
)
from tests.simulate.channels.trajectory.record import LANE, record


def profile(speed: float, wanted: float) -> Floats:
    made = np.zeros((SAMPLES, PROFILE_ROW))
    fill_profile(speed, wanted, wanted, 25.0, 0.25, 0.0, made)
    return made


def cost(speed: float, wanted: float, allowed: float = 30.0, previous: float = 0.0) -> float:
    return profile_cost(record(), profile(speed, wanted), wanted, previous, speed, allowed)


def test_rounded_square_is_smooth_at_its_knee() -> None:
    knee, step = 0.4, 1e-6
    assert rounded_square(knee - step, knee) == pytest.approx(
        rounded_square(knee + step, knee), abs=3.0 * step
    )
    slopes = [
        (rounded_square(knee + sign * 2 * step, knee) - rounded_square(knee + sign * step, knee))
        / (sign * step)
        for sign in (-1, 1)
    ]
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-3)


def test_nothing_costs_less_than_driving_at_the_allowed_speed() -> None:
    assert cost(30.0, 0.0) == 0.0
    assert cost(30.0, 0.2) > 0.0
    assert cost(30.0, -0.2) > 0.0


def test_slow_ego_gains_by_accelerating_and_fast_one_by_braking() -> None:
    assert cost(20.0, 0.5) < cost(20.0, 0.0)
    assert cost(34.0, -0.5) < cost(34.0, 0.0)


def test_becoming_faster_than_allowed_is_worse_than_hard_braking() -> None:
    assert cost(30.0, 1.5) > cost(30.0, -8.0)


@pytest.mark.slow
def test_another_acceleration_than_before_costs() -> None:
    assert cost(20.0, 1.0, previous=1.0) < cost(20.0, 1.0, previous=0.0)


def driven(target: float, length: float, wanted: float, **more: float) -> tuple[float, Floats]:
    path, line = np.zeros(PATH_ROW), np.zeros((SAMPLES, LINE_ROW))
    lay_path(path, 0.0, LANE, 0.0, 0.0, target, length)
    found = drive_line(
        record(),
        path,
        profile(30.0, wanted),
        0.0,
        more.get("curvature", 0.0),
        -1.6,
        9.6,
        more.get("last", 0.0) > 0.0,
        line,
    )
    return found, line


def test_lane_costs_nothing_to_keep() -> None:
    found, line = driven(LANE, 60.0, 0.0)
    assert found == 0.0
    assert (line[:, LINE_D] == LANE).all()


def test_quick_lane_change_costs_more_than_a_calm_one() -> None:
    assert 0.0 < driven(LANE + 3.5, 120.0, 0.0)[0] < driven(LANE + 3.5, 70.0, 0.0)[0] < math.inf


def test_too_short_a_path_is_beyond_the_assumed_limits() -> None:
    assert driven(LANE + 3.5, 45.0, 0.0)[0] == math.inf


def test_braking_leaves_less_for_the_way_aside() -> None:
    assert driven(LANE + 3.5, 68.0, 0.0)[0] < math.inf
    assert driven(LANE + 3.5, 68.0, -7.0)[0] == math.inf


def test_last_resort_is_never_forbidden() -> None:
    found, line = driven(LANE, 60.0, -8.0, curvature=0.003, last=1.0)
    assert found < math.inf
    assert (line[:, LINE_D] == LANE).all()
    assert driven(LANE, 60.0, -8.0, curvature=0.003)[0] == math.inf


@pytest.mark.parametrize("target", [-3.0, 11.0])
def test_place_off_the_road_is_forbidden(target: float) -> None:
    assert driven(target, 110.0, 0.0)[0] == math.inf
