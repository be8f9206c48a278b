"""The planner: its fan of candidates, which one it chooses, and what it commands."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel import profiles
from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_ROW,
    PATH_TARGET,
    PROFILE_ROW,
    PROFILE_S,
    PROFILE_SPEED,
    at_path,
    fill_profile,
    lay_path,
)
from adeye.kernel.road import Ground, position
from adeye.signals import Floats
from adeye.simulate.channels.driving import HOLD_DECELERATION
from adeye.simulate.channels.hooks import POINTS
from adeye.simulate.channels.trajectory import channel as planner
from adeye.simulate.channels.trajectory.cost import (
    LINE_D,
    LINE_ROW,
    LINE_SLOPE,
    SAMPLES,
    drive_line,
)
from tests.kernel.stop_limits import GROUND
from tests.simulate.channels.trajectory.record import LANE, memory, pose, record
from tests.simulate.channels.trajectory.test_obstacles import others, thing


class Plan:
    """One tick of the planner, and what it leaves behind."""

    def __init__(self, *items: tuple[Floats, Floats], shown: bool = True, **more: float) -> None:
        self.memory = memory()
        self.driven = np.zeros(PATH_ROW)
        self.driven[PATH_TARGET] = np.nan
        self.profiles = np.zeros((planner.PROFILES + 1, SAMPLES, PROFILE_ROW))
        self.costs = np.zeros(planner.CANDIDATES)
        fan = planner.Fan(
            record(rear_sight=100.0, **more),
            GROUND,
            pose(),
            30.0,
            others(*items),
            self.memory,
            self.driven,
            np.zeros((planner.PATHS, PATH_ROW)),
            self.profiles,
            np.zeros((planner.PROFILES + 1, 8, 2), dtype=np.int64),
            np.zeros((SAMPLES, LINE_ROW)),
            np.zeros((planner.PROFILES + 1, planner.LEVEL_ROW)),
            self.costs,
        )
        self.best = planner.plan_step(fan, shown)

    @property
    def wanted(self) -> float:
        return float(self.memory[planner.MEMORY_WANTED])


def test_chosen_candidate_is_the_cheapest_of_the_fan() -> None:
    plan = Plan(thing(60.0, LANE, 20.0))
    assert plan.best == int(np.argmin(plan.costs))
    assert np.isfinite(plan.costs).sum() > planner.PROFILES


@pytest.mark.slow
def test_dropping_dear_candidates_early_never_drops_the_best() -> None:
    for ahead, speed in itertools.product(
        (20.0, 35.0, 50.0, 75.0, 120.0, 400.0), (0.0, 15.0, 28.0)
    ):
        lead = thing(ahead, LANE, speed)
        scene = (lead, thing(5.0, LANE + 3.5, 30.0), thing(-60.0, 1.75, 33.0))
        whole, quick = Plan(*scene), Plan(*scene, shown=False)
        assert whole.best == quick.best, (ahead, speed)
        assert whole.wanted == quick.wanted
        assert whole.driven.tobytes() == quick.driven.tobytes()
        assert not (quick.costs < whole.costs[whole.best]).any()


def test_acceleration_is_refined_between_those_of_the_fan() -> None:
    wanted = [Plan(thing(gap, LANE, 25.0)).wanted for gap in (40.0, 45.0, 50.0, 55.0, 60.0)]
    assert wanted == sorted(wanted)
    assert len({round(value, 6) for value in wanted}) >= 4


def test_profile_of_the_choice_is_the_last_one() -> None:
    plan = Plan(thing(45.0, LANE, 20.0))
    last = plan.profiles[planner.PROFILES, -1, PROFILE_SPEED]
    # The ramp of 25 m/s³ loses half of its own duration.
    ramp = abs(plan.wanted) / 25.0
    assert last == pytest.approx(30.0 + plan.wanted * (4.0 - 0.5 * ramp))


def straight_path(target: float = LANE, length: float = 60.0) -> Floats:
    path = np.zeros(PATH_ROW)
    lay_path(path, 0.0, LANE, 0.0, 0.0, target, length)
    return path


def test_ego_steers_back_to_its_path() -> None:
    assert planner.steer_along(record(), GROUND, pose(), straight_path()) == 0.0
    for side in (-0.3, 0.3):
        assert (
            planner.steer_along(record(), GROUND, pose(d=LANE + side), straight_path()) * side < 0.0
        )


def test_curvature_is_fed_forward_from_where_the_wheels_will_have_turned() -> None:
    path = straight_path(LANE + 3.5, 100.0)
    bend = at_path(path, 30.0 * (0.1 + 0.025))[2]
    assert at_path(path, 0.0)[2] == 0.0
    # The slip of the body's centre takes a little of it.
    assert planner.steer_along(record(), GROUND, pose(), path) == pytest.approx(
        math.atan(2.7 * bend), rel=0.15
    )


def test_command_runs_to_the_wanted_acceleration_at_the_largest_jerk() -> None:
    limits = record()
    assert planner.accelerate(limits, 20.0, 0.0, -8.0) == -25.0 * 0.05
    assert planner.accelerate(limits, 20.0, -7.5, -8.0) == -8.0
    assert planner.accelerate(limits, 20.0, -8.0, 1.0) == -8.0 + 25.0 * 0.05
    # A standing ego is held until it is to start.
    assert planner.accelerate(limits, 0.0, 0.0, 0.1) == -HOLD_DECELERATION
    assert planner.accelerate(limits, 0.0, -HOLD_DECELERATION, 0.9) == 0.9


@pytest.mark.parametrize("curvature", [0.0, 1.0 / 400.0])
def test_plan_is_in_the_map(curvature: float) -> None:
    segments = np.array([[10.0, -4.0, 0.3, 900.0, curvature]])
    profile, line = np.zeros((SAMPLES, PROFILE_ROW)), np.zeros((SAMPLES, LINE_ROW))
    fill_profile(20.0, 0.0, 0.0, 25.0, 0.25, 0.0, profile)
    line[:, LINE_D], line[:, LINE_SLOPE] = 3.0, 0.02
    plan = np.zeros((SAMPLES, planner.PLAN_ROW))
    planner.show_plan(pose(s=50.0), segments, profile, line, plan)
    x, y, heading = position(segments, 50.0 + 80.0, 3.0)
    assert plan[-1, [planner.PLAN_X, planner.PLAN_Y]] == pytest.approx([x, y])
    assert plan[-1, planner.PLAN_HEADING] == pytest.approx(heading + math.atan(0.02))
    assert plan[-1, planner.PLAN_SPEED] == 20.0


def test_candidates_begin_at_the_ego_and_those_that_do_not_exist_are_not_shown() -> None:
    segments = np.array([[0.0, 0.0, 0.0, 900.0, 0.0]])
    paths = np.array([straight_path(LANE + 0.5 * row) for row in range(planner.PATHS)])
    paths[:, PATH_EXISTS] = 1.0
    paths[2, PATH_EXISTS] = 0.0
    profiles = np.zeros((planner.PROFILES + 1, SAMPLES, PROFILE_ROW))
    for row in range(planner.PROFILES):
        fill_profile(20.0, 0.0, float(row - planner.PROFILES), 25.0, 0.25, 0.0, profiles[row])
    shown = np.zeros((planner.CANDIDATES, POINTS, 2))
    planner.show_candidates(pose(), segments, paths, profiles, shown)
    there: Any = np.isfinite(shown).all(axis=(1, 2))
    assert there.sum() == planner.CANDIDATES - planner.PROFILES
    assert not there[2 * planner.PROFILES : 3 * planner.PROFILES].any()
    assert shown[there, 0].tolist() == [[0.0, LANE]] * int(there.sum())
    assert shown[planner.PROFILES - 1, -1, 0] == pytest.approx(
        profiles[planner.PROFILES - 1, -1, 0]
    )


# --- The fan of candidates of the trajectory channel: their paths and what each costs -------------


def nothing_driven() -> Floats:
    driven = np.zeros(profiles.PATH_ROW)
    driven[profiles.PATH_TARGET] = np.nan
    return driven


def laid(where: Floats, kept: Floats, driven: Floats, ground: Ground = GROUND) -> Floats:
    paths = np.zeros((planner.PATHS, profiles.PATH_ROW))
    planner.lay_paths(record(), ground, where, kept, driven, paths)
    return paths


def first(d: float = LANE, ground: Ground = GROUND) -> Floats:
    return laid(pose(d=d), memory(np.nan), nothing_driven(), ground)


def test_fan_in_the_middle_lane_leads_to_both_neighbours() -> None:
    paths = first()
    assert (paths[:, profiles.PATH_EXISTS] == 1.0).all()
    assert paths[:, profiles.PATH_TARGET] == pytest.approx(
        [5.25, 5.65, 4.85, 8.75, 8.75, 1.75, 1.75]
    )
    assert (
        paths[planner.DODGE_LEFT, profiles.PATH_LENGTH]
        < paths[planner.CHANGE_LEFT, profiles.PATH_LENGTH]
    )


def test_beside_the_outer_lanes_is_nothing_but_the_shoulder_if_there_is_room() -> None:
    paths = first(d=1.75)
    assert paths[planner.CHANGE_RIGHT, profiles.PATH_TARGET] == -1.25
    assert math.isnan(paths[planner.CHANGE_RIGHT, profiles.PATH_LANE])
    narrow = GROUND._replace(shoulder=1.0)
    assert first(1.75, narrow)[planner.CHANGE_RIGHT, profiles.PATH_EXISTS] == 0.0
    assert first(d=8.75)[planner.CHANGE_LEFT, profiles.PATH_EXISTS] == 0.0


def changing(progress: float) -> tuple[Floats, Floats, float]:
    """Return the path of a lane change, and where the ego is on it."""
    driven = np.zeros(profiles.PATH_ROW)
    profiles.lay_path(driven, 0.0, LANE, 0.0, 0.0, LANE + 3.5, 100.0)
    d, _, _ = profiles.at_path(driven, progress)
    return driven, pose(d=d, s=progress), d


def test_lane_change_that_has_begun_is_finished_as_it_was_begun() -> None:
    driven, where, _ = changing(40.0)
    paths = laid(where, memory(LANE + 3.5), driven)
    for way in (0.0, 20.0, 59.0):
        assert profiles.at_path(paths[planner.KEEP], way) == pytest.approx(
            profiles.at_path(driven, 40.0 + way), abs=1e-9
        )
    assert paths[planner.CHANGE_RIGHT, profiles.PATH_TARGET] == LANE


def test_ego_begins_anew_where_it_is_only_if_it_is_far_from_its_path() -> None:
    for off, begins_anew in ((0.2, False), (planner.LOST + 0.1, True)):
        driven, where, d = changing(40.0)
        where[2] += off
        kept = memory(LANE + 3.5)
        paths = laid(where, kept, driven)
        # Small deviations are left to the control.
        begin = d + off if begins_anew else d
        assert profiles.at_path(paths[planner.KEEP], 0.0)[0] == pytest.approx(begin)
        assert paths[planner.KEEP, profiles.PATH_START] == 40.0
        assert kept[planner.MEMORY_LANE] in (LANE, LANE + 3.5)


def test_lane_costs_nothing_beside_it_a_little_and_leaving_it_much() -> None:
    def costs(paths: Floats, driven: Floats, lane: float = LANE) -> list[float]:
        kept = memory(lane)
        return [
            planner.path_cost(record(), paths[row], row, kept, driven)
            for row in range(planner.PATHS)
        ]

    paths = first()
    new = costs(paths, nothing_driven())
    assert new[planner.KEEP] == 0.0
    assert 0.0 < new[planner.NUDGE_LEFT] == new[planner.NUDGE_RIGHT] < 5.0
    assert new[planner.CHANGE_LEFT] == new[planner.DODGE_LEFT] > 50.0
    # What was chosen before is cheaper.
    again = costs(paths, paths[planner.NUDGE_LEFT])[planner.NUDGE_LEFT]
    assert again == pytest.approx(new[planner.NUDGE_LEFT] - record()["weight_change"])
    # The shoulder costs as long as one is on it.
    aside = first(d=1.75)
    staying = costs(aside, aside[planner.CHANGE_RIGHT], 1.75)[planner.CHANGE_RIGHT]
    assert staying == record()["weight_shoulder"]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_tyres_hold_what_the_path_takes_from_the_bend_and_not_what_it_adds(side: float) -> None:
    path, profile, length = np.zeros(PATH_ROW), np.zeros((SAMPLES, PROFILE_ROW)), 80.0
    lay_path(path, 0.0, 0.0, 0.0, 0.0, 3.5 * side, length)
    # Its second half bends to the other side.
    ways = np.linspace(0.5 * length, length, SAMPLES)
    sharpest = max(abs(at_path(path, float(way))[2]) for way in ways)
    most = record()["max_lateral_acceleration"]
    profile[:, PROFILE_S] = ways - ways[0]
    profile[:, PROFILE_SPEED] = math.sqrt(0.6 * most / sharpest)

    def cost(curvature: float) -> float:
        line, half, last_resort = np.zeros((SAMPLES, LINE_ROW)), 0.5 * length, False
        limits = -9.0, 9.0, last_resort
        found: float = drive_line(record(), path, profile, half, curvature, *limits, line)
        return found

    assert cost(0.0) == cost(side * sharpest) < math.inf
    assert cost(-side * sharpest) == math.inf


def test_quick_path_uses_the_assumed_lateral_acceleration_and_no_more() -> None:
    for speed in (10.0, 20.0, 36.0):
        length, path = planner.quick_length(record(), speed, 3.5), np.zeros(profiles.PATH_ROW)
        profiles.lay_path(path, 100.0, 0.0, 0.0, 0.0, 3.5, length)
        sharpest = max(abs(profiles.at_path(path, way)[2]) for way in np.linspace(0.0, length, 400))
        lateral = speed * speed * sharpest
        assert lateral <= 0.85 * 5.0 + 1e-9
        # At walking pace the steering is the limit, not the tyres.
        used = max(lateral / (0.85 * 5.0), sharpest / (0.85 * 0.25))
        assert used == pytest.approx(1.0, abs=1e-3), speed
