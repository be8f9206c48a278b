import math

import numpy as np
import pytest

from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_IS_FLAT,
    PATH_LANE,
    PATH_LENGTH,
    PATH_ROW,
    PATH_START,
    PATH_TARGET,
    at_path,
    lay_path,
)
from adeye.signals import Floats
from adeye.simulate.channels.trajectory.planner import (
    CHANGE_LEFT,
    CHANGE_RIGHT,
    DODGE_LEFT,
    KEEP,
    LEVEL_ROW,
    LEVEL_WANTED,
    LOST,
    MEMORY_LANE,
    NUDGE_LEFT,
    NUDGE_RIGHT,
    PATHS,
    PROFILES,
    calm_length,
    inside_length,
    lay_paths,
    path_cost,
    quick_length,
    set_accelerations,
)
from tests.simulate.channels.trajectory.record import LANE, memory, pose, record


def nothing_driven() -> Floats:
    driven = np.zeros(PATH_ROW)
    driven[PATH_TARGET] = np.nan
    return driven


def laid(where: Floats, kept: Floats, driven: Floats, **more: float) -> Floats:
    paths = np.zeros((PATHS, PATH_ROW))
    lay_paths(record(**more), where, kept, driven, paths)
    return paths


def first(d: float = LANE, **more: float) -> Floats:
    return laid(pose(d=d), memory(np.nan), nothing_driven(), **more)


def test_fan_in_the_middle_lane_leads_to_both_neighbours() -> None:
    paths = first()
    assert (paths[:, PATH_EXISTS] == 1.0).all()
    assert paths[:, PATH_TARGET] == pytest.approx([5.25, 5.65, 4.85, 8.75, 8.75, 1.75, 1.75])
    assert paths[DODGE_LEFT, PATH_LENGTH] < paths[CHANGE_LEFT, PATH_LENGTH]


def test_beside_the_rightmost_lane_is_the_shoulder_if_there_is_room() -> None:
    paths = first(d=1.75)
    assert paths[CHANGE_RIGHT, PATH_TARGET] == -1.25
    assert math.isnan(paths[CHANGE_RIGHT, PATH_LANE])
    assert first(d=1.75, shoulder=1.0)[CHANGE_RIGHT, PATH_EXISTS] == 0.0


def test_beside_the_leftmost_lane_is_nothing() -> None:
    assert first(d=8.75)[CHANGE_LEFT, PATH_EXISTS] == 0.0


def test_ego_in_the_middle_of_its_lane_keeps_a_flat_path() -> None:
    paths = first()
    assert paths[KEEP, PATH_IS_FLAT] == 1.0
    assert first(d=LANE + 0.5)[KEEP, PATH_IS_FLAT] == 0.0


@pytest.mark.slow
def test_nudge_stays_inside_the_lane() -> None:
    wide = first(nudge=2.0)
    assert wide[NUDGE_LEFT, PATH_TARGET] + 0.9 == pytest.approx(7.0)
    assert first(nudge=0.0)[NUDGE_RIGHT, PATH_EXISTS] == 0.0


def changing(progress: float) -> tuple[Floats, Floats, float]:
    """Return the path of a lane change, and where the ego is on it."""
    driven = np.zeros(PATH_ROW)
    lay_path(driven, 0.0, LANE, 0.0, 0.0, LANE + 3.5, 100.0)
    d, _, _ = at_path(driven, progress)
    return driven, pose(d=d, s=progress), d


def test_lane_change_that_has_begun_is_finished_as_it_was_begun() -> None:
    driven, where, _ = changing(40.0)
    paths = laid(where, memory(LANE + 3.5), driven)
    for way in (0.0, 20.0, 59.0):
        assert at_path(paths[KEEP], way) == pytest.approx(at_path(driven, 40.0 + way), abs=1e-9)
    assert paths[CHANGE_RIGHT, PATH_TARGET] == LANE


def test_small_deviations_are_left_to_the_control() -> None:
    driven, where, d = changing(40.0)
    where[2] += 0.2
    paths = laid(where, memory(LANE + 3.5), driven)
    assert at_path(paths[KEEP], 0.0)[0] == pytest.approx(d)


def test_ego_that_somebody_else_has_driven_begins_anew_where_it_is() -> None:
    driven, where, d = changing(40.0)
    where[2] += LOST + 0.1
    kept = memory(LANE + 3.5)
    paths = laid(where, kept, driven)
    assert at_path(paths[KEEP], 0.0)[0] == pytest.approx(d + LOST + 0.1)
    assert paths[KEEP, PATH_START] == 40.0
    assert kept[MEMORY_LANE] in (LANE, LANE + 3.5)


def test_lane_costs_nothing_beside_it_a_little_and_leaving_it_much() -> None:
    paths, kept, driven = first(), memory(), nothing_driven()
    costs = [path_cost(record(), paths[row], row, kept, driven) for row in range(PATHS)]
    assert costs[KEEP] == 0.0
    assert 0.0 < costs[NUDGE_LEFT] == costs[NUDGE_RIGHT] < 5.0
    assert costs[CHANGE_LEFT] == costs[DODGE_LEFT] > 50.0


@pytest.mark.slow
def test_what_was_chosen_before_is_cheaper() -> None:
    paths, kept = first(), memory()
    other = path_cost(record(), paths[NUDGE_LEFT], NUDGE_LEFT, kept, nothing_driven())
    same = path_cost(record(), paths[NUDGE_LEFT], NUDGE_LEFT, kept, paths[NUDGE_LEFT])
    assert same == pytest.approx(other - record()["weight_change"])


def test_shoulder_costs_as_long_as_one_is_on_it() -> None:
    paths, kept = first(d=1.75), memory(1.75)
    staying = path_cost(record(), paths[CHANGE_RIGHT], CHANGE_RIGHT, kept, paths[CHANGE_RIGHT])
    assert staying == record()["weight_shoulder"]


def test_accelerations_rise_from_emergency_to_the_largest() -> None:
    levels = np.zeros((PROFILES + 1, LEVEL_ROW))
    set_accelerations(record(), levels)
    wanted = levels[:PROFILES, LEVEL_WANTED]
    assert (np.diff(wanted) > 0.0).all()
    assert (wanted[0], wanted[4], wanted[-1]) == (-8.0, 0.0, 1.5)


def path(d: float, slope: float, bend: float, target: float, length: float) -> Floats:
    made = np.zeros(PATH_ROW)
    lay_path(made, 100.0, d, slope, bend, target, length)
    return made


@pytest.mark.parametrize("speed", [10.0, 20.0, 36.0])
def test_quick_path_uses_the_assumed_lateral_acceleration_and_no_more(speed: float) -> None:
    limits = record()
    length = quick_length(limits, speed, 3.5)
    made = path(0.0, 0.0, 0.0, 3.5, length)
    bends = [abs(at_path(made, way)[2]) for way in np.linspace(0.0, length, 400)]
    lateral = speed * speed * max(bends)
    assert lateral <= 0.85 * 5.0 + 1e-9
    # At walking pace the steering is the limit, not the tyres.
    assert max(lateral / (0.85 * 5.0), max(bends) / (0.85 * 0.25)) == pytest.approx(1.0, abs=1e-3)


def test_calm_lane_change_takes_its_time() -> None:
    assert calm_length(record(), 30.0, 3.5) == 4.0 * 30.0
    assert inside_length(record(), 30.0, 0.4) == 2.0 * 30.0
    assert math.isclose(inside_length(record(), 0.0, 0.4), quick_length(record(), 0.0, 0.4))
