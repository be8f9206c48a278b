import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_ROW,
    PATH_TARGET,
    PROFILE_ROW,
    PROFILE_SPEED,
    at_path,
    fill_profile,
    lay_path,
)
from adeye.kernel.road import position
from adeye.signals import Floats
from adeye.simulate.channels.driving import HOLD_DECELERATION
from adeye.simulate.channels.hooks import POINTS
from adeye.simulate.channels.trajectory.cost import LINE_D, LINE_ROW, LINE_SLOPE, SAMPLES
from adeye.simulate.channels.trajectory.planner import (
    CANDIDATES,
    KEEP,
    LEVEL_ROW,
    MEMORY_LANE,
    MEMORY_WANTED,
    PATHS,
    PLAN_HEADING,
    PLAN_ROW,
    PLAN_SPEED,
    PLAN_X,
    PLAN_Y,
    PROFILES,
    Fan,
    accelerate,
    plan_step,
    show_candidates,
    show_plan,
    steer_along,
)
from tests.simulate.channels.trajectory.record import LANE, memory, pose, record
from tests.simulate.channels.trajectory.test_obstacles import others, thing


class Plan:
    """One tick of the planner, and what it leaves behind."""

    def __init__(self, *items: tuple[Floats, Floats], shown: bool = True, **more: float) -> None:
        self.memory = memory()
        self.driven = np.zeros(PATH_ROW)
        self.driven[PATH_TARGET] = np.nan
        self.profiles = np.zeros((PROFILES + 1, SAMPLES, PROFILE_ROW))
        self.costs = np.zeros(CANDIDATES)
        fan = Fan(
            record(rear_sight=100.0, **more),
            pose(),
            30.0,
            others(*items),
            self.memory,
            self.driven,
            np.zeros((PATHS, PATH_ROW)),
            self.profiles,
            np.zeros((PROFILES + 1, 8, 2), dtype=np.int64),
            np.zeros((SAMPLES, LINE_ROW)),
            np.zeros((PROFILES + 1, LEVEL_ROW)),
            self.costs,
        )
        self.best = plan_step(fan, shown)

    @property
    def wanted(self) -> float:
        return float(self.memory[MEMORY_WANTED])


def test_free_road_is_driven_on() -> None:
    plan = Plan()
    assert plan.best == KEEP * PROFILES + 4
    assert plan.wanted == 0.0
    assert plan.driven[PATH_TARGET] == LANE


def test_chosen_candidate_is_the_cheapest_of_the_fan() -> None:
    plan = Plan(thing(60.0, LANE, 20.0))
    assert plan.best == int(np.argmin(plan.costs))
    assert np.isfinite(plan.costs).sum() > PROFILES


@pytest.mark.slow
@pytest.mark.parametrize("ahead", [20.0, 35.0, 50.0, 75.0, 120.0, 400.0])
@pytest.mark.parametrize("speed", [0.0, 15.0, 28.0])
def test_dropping_dear_candidates_early_never_drops_the_best(ahead: float, speed: float) -> None:
    scene = (thing(ahead, LANE, speed), thing(5.0, LANE + 3.5, 30.0), thing(-60.0, 1.75, 33.0))
    whole, quick = Plan(*scene), Plan(*scene, shown=False)
    assert whole.best == quick.best
    assert whole.wanted == quick.wanted
    assert whole.driven.tobytes() == quick.driven.tobytes()
    known = quick.costs < whole.costs[whole.best]
    assert not known.any()


def test_acceleration_is_refined_between_those_of_the_fan() -> None:
    wanted = [Plan(thing(gap, LANE, 25.0)).wanted for gap in (40.0, 45.0, 50.0, 55.0, 60.0)]
    assert wanted == sorted(wanted)
    assert len({round(value, 6) for value in wanted}) >= 4


def test_profile_of_the_choice_is_the_last_one() -> None:
    plan = Plan(thing(45.0, LANE, 20.0))
    last = plan.profiles[PROFILES, -1, PROFILE_SPEED]
    # The ramp of 25 m/s³ loses half of its own duration.
    ramp = abs(plan.wanted) / 25.0
    assert last == pytest.approx(30.0 + plan.wanted * (4.0 - 0.5 * ramp))


@pytest.mark.slow
def test_lane_that_is_changed_to_is_remembered() -> None:
    plan = Plan(thing(55.0, LANE, 0.0))
    assert plan.memory[MEMORY_LANE] in (LANE - 3.5, LANE + 3.5)
    assert plan.driven[PATH_TARGET] == plan.memory[MEMORY_LANE]


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
