import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_ROW,
    PROFILE_ROW,
    at_path,
    fill_profile,
    lay_path,
)
from adeye.kernel.road import position
from adeye.signals import Floats
from adeye.simulate.channels.driving import HOLD_DECELERATION
from adeye.simulate.channels.trajectory.candidates import CANDIDATES, PATHS, PROFILES
from adeye.simulate.channels.trajectory.cost import LINE_D, LINE_ROW, LINE_SLOPE, SAMPLES
from adeye.simulate.channels.trajectory.planner import (
    PLAN_HEADING,
    PLAN_ROW,
    PLAN_SPEED,
    PLAN_X,
    PLAN_Y,
    POINTS,
    accelerate,
    show_candidates,
    show_plan,
    steer_along,
)
from tests.simulate.channels.trajectory.record import LANE, pose, record


def straight_path(target: float = LANE, length: float = 60.0) -> Floats:
    path = np.zeros(PATH_ROW)
    lay_path(path, 0.0, LANE, 0.0, 0.0, target, length)
    return path


def test_ego_on_its_straight_path_does_not_steer() -> None:
    assert steer_along(record(), pose(), straight_path()) == 0.0


@pytest.mark.parametrize("side", [-0.3, 0.3])
def test_ego_beside_its_path_steers_back(side: float) -> None:
    assert steer_along(record(), pose(d=LANE + side), straight_path()) * side < 0.0


def test_curvature_is_fed_forward_from_where_the_wheels_will_have_turned() -> None:
    path = straight_path(LANE + 3.5, 100.0)
    bend = at_path(path, 30.0 * (0.1 + 0.025))[2]
    assert at_path(path, 0.0)[2] == 0.0
    # The slip of the body's centre takes a little of it.
    assert steer_along(record(), pose(), path) == pytest.approx(math.atan(2.7 * bend), rel=0.15)


def test_command_runs_to_the_wanted_acceleration_at_the_largest_jerk() -> None:
    limits = record()
    assert accelerate(limits, 20.0, 0.0, -8.0) == -25.0 * 0.05
    assert accelerate(limits, 20.0, -7.5, -8.0) == -8.0
    assert accelerate(limits, 20.0, -8.0, 1.0) == -8.0 + 25.0 * 0.05


def test_standing_ego_is_held_until_it_is_to_start() -> None:
    limits = record()
    assert accelerate(limits, 0.0, 0.0, 0.1) == -HOLD_DECELERATION
    assert accelerate(limits, 0.0, -HOLD_DECELERATION, 0.9) == 0.9


@pytest.mark.parametrize("curvature", [0.0, 1.0 / 400.0])
def test_plan_is_in_the_map(curvature: float) -> None:
    segments = np.array([[10.0, -4.0, 0.3, 900.0, curvature]])
    profile, line = np.zeros((SAMPLES, PROFILE_ROW)), np.zeros((SAMPLES, LINE_ROW))
    fill_profile(20.0, 0.0, 0.0, 25.0, 0.25, 0.0, profile)
    line[:, LINE_D], line[:, LINE_SLOPE] = 3.0, 0.02
    plan = np.zeros((SAMPLES, PLAN_ROW))
    show_plan(pose(s=50.0), segments, profile, line, plan)
    x, y, heading = position(segments, 50.0 + 80.0, 3.0)
    assert plan[-1, [PLAN_X, PLAN_Y]] == pytest.approx([x, y])
    assert plan[-1, PLAN_HEADING] == pytest.approx(heading + math.atan(0.02))
    assert plan[-1, PLAN_SPEED] == 20.0


@pytest.mark.slow
def test_candidates_begin_at_the_ego_and_those_that_do_not_exist_are_not_shown() -> None:
    segments = np.array([[0.0, 0.0, 0.0, 900.0, 0.0]])
    paths = np.array([straight_path(LANE + 0.5 * row) for row in range(PATHS)])
    paths[:, PATH_EXISTS] = 1.0
    paths[2, PATH_EXISTS] = 0.0
    profiles = np.zeros((PROFILES + 1, SAMPLES, PROFILE_ROW))
    for row in range(PROFILES):
        fill_profile(20.0, 0.0, float(row - PROFILES), 25.0, 0.25, 0.0, profiles[row])
    shown = np.zeros((CANDIDATES, POINTS, 2))
    show_candidates(pose(), segments, paths, profiles, shown)
    there: Any = np.isfinite(shown).all(axis=(1, 2))
    assert there.sum() == CANDIDATES - PROFILES
    assert not there[2 * PROFILES : 3 * PROFILES].any()
    assert shown[there, 0].tolist() == [[0.0, LANE]] * int(there.sum())
    assert shown[PROFILES - 1, -1, 0] == pytest.approx(profiles[PROFILES - 1, -1, 0])
