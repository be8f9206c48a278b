"""The fan of candidates of the trajectory channel: their paths and what each costs."""

import math

import numpy as np
import pytest

from adeye.kernel import profiles
from adeye.signals import Floats
from adeye.simulate.channels.trajectory import channel as planner
from tests.simulate.channels.trajectory.record import LANE, memory, pose, record


def nothing_driven() -> Floats:
    driven = np.zeros(profiles.PATH_ROW)
    driven[profiles.PATH_TARGET] = np.nan
    return driven


def laid(where: Floats, kept: Floats, driven: Floats, **more: float) -> Floats:
    paths = np.zeros((planner.PATHS, profiles.PATH_ROW))
    planner.lay_paths(record(**more), where, kept, driven, paths)
    return paths


def first(d: float = LANE, **more: float) -> Floats:
    return laid(pose(d=d), memory(np.nan), nothing_driven(), **more)


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
    assert first(d=1.75, shoulder=1.0)[planner.CHANGE_RIGHT, profiles.PATH_EXISTS] == 0.0
    assert first(d=8.75)[planner.CHANGE_LEFT, profiles.PATH_EXISTS] == 0.0


def test_ego_in_the_middle_of_its_lane_keeps_a_flat_path() -> None:
    paths = first()
    assert paths[planner.KEEP, profiles.PATH_IS_FLAT] == 1.0
    assert first(d=LANE + 0.5)[planner.KEEP, profiles.PATH_IS_FLAT] == 0.0


@pytest.mark.slow
def test_nudge_stays_inside_the_lane() -> None:
    wide = first(nudge=2.0)
    assert wide[planner.NUDGE_LEFT, profiles.PATH_TARGET] + 0.9 == pytest.approx(7.0)
    assert first(nudge=0.0)[planner.NUDGE_RIGHT, profiles.PATH_EXISTS] == 0.0


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


def test_accelerations_rise_from_emergency_to_the_largest() -> None:
    levels = np.zeros((planner.PROFILES + 1, planner.LEVEL_ROW))
    planner.set_accelerations(record(), levels)
    wanted = levels[: planner.PROFILES, planner.LEVEL_WANTED]
    assert (np.diff(wanted) > 0.0).all()
    assert (wanted[0], wanted[4], wanted[-1]) == (-8.0, 0.0, 1.5)


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


def test_calm_lane_change_takes_its_time() -> None:
    assert planner.calm_length(record(), 30.0, 3.5) == 4.0 * 30.0
    assert planner.inside_length(record(), 30.0, 0.4) == 2.0 * 30.0
    assert math.isclose(
        planner.inside_length(record(), 0.0, 0.4), planner.quick_length(record(), 0.0, 0.4)
    )
