import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel.profiles import (
    OBJECT_BEHIND,
    OBJECT_COSINE,
    OBJECT_D,
    OBJECT_GROWTH,
    OBJECT_LENGTH,
    OBJECT_ROW,
    OBJECT_S,
    OBJECT_SINE,
    OBJECT_SPEED,
    OBJECT_WIDTH,
    PATH_ROW,
    PROFILE_ROW,
    WAY_D,
    WAY_ROW,
    WAY_S,
    WAY_SPEED,
    fill_profile,
    lay_path,
)
from adeye.signals import Floats
from adeye.simulate.channels.trajectory.cost import (
    LINE_ROW,
    SAMPLES,
    critical_distance,
    drive_line,
    is_cut_up,
    lane_speed_cost,
    mark_interest,
    object_cost,
    overlap,
)
from tests.simulate.channels.trajectory.record import LANE, record

INTERVAL = 0.25
TIMES = INTERVAL * np.arange(1, SAMPLES + 1)


def thing(s: float, d: float, speed: float, *, heading: float = 0.0) -> tuple[Floats, Floats]:
    """Return a car and its way at constant speed."""
    body, way = np.zeros(OBJECT_ROW), np.zeros((SAMPLES, WAY_ROW))
    body[OBJECT_LENGTH], body[OBJECT_WIDTH], body[OBJECT_GROWTH] = 4.5, 1.8, 1.0
    body[OBJECT_SINE], body[OBJECT_COSINE] = math.sin(heading), math.cos(heading)
    body[OBJECT_S], body[OBJECT_D], body[OBJECT_SPEED] = s, d, speed
    body[OBJECT_BEHIND] = float(s <= -4.5)
    way[:, WAY_S], way[:, WAY_D], way[:, WAY_SPEED] = s + speed * TIMES, d, speed
    return body, way


def cost(
    item: tuple[Floats, Floats],
    *,
    wanted: float = 0.0,
    target: float = LANE,
    leaving: bool = False,
    speed: float = 30.0,
) -> float:
    limits, window = record(), np.zeros((1, 2), dtype=np.int64)
    path, line = np.zeros(PATH_ROW), np.zeros((SAMPLES, LINE_ROW))
    profile = np.zeros((SAMPLES, PROFILE_ROW))
    fill_profile(speed, wanted, wanted, 25.0, INTERVAL, 0.0, profile)
    lay_path(path, 0.0, LANE, 0.0, 0.0, target, 68.0)
    drive_line(limits, path, profile, 0.0, 0.0, -9.0, 99.0, True, line)  # noqa: FBT003
    body, way = item
    mark_interest(limits, profile, body[np.newaxis], way[np.newaxis], 1, INTERVAL, window)
    if window[0, 0] >= window[0, 1]:
        return 0.0
    return object_cost(limits, profile, line, body, way, window[0], INTERVAL, leaving)


def test_far_away_and_beside_cost_nothing() -> None:
    assert cost(thing(400.0, LANE, 30.0)) == 0.0
    assert cost(thing(0.0, LANE + 3.5, 30.0)) == 0.0
    assert cost(thing(60.0, LANE - 3.5, 10.0)) == 0.0


def test_distance_that_is_kept_costs_nothing_and_a_shorter_one_more_and_more() -> None:
    gaps = [4.0 + 1.8 * 30.0 + 4.5 + 0.1, 50.0, 30.0, 20.0]
    costs = [cost(thing(gap, LANE, 30.0)) for gap in gaps]
    assert costs[0] == 0.0
    assert costs == sorted(costs)
    assert 0.0 < costs[1] < costs[3] < 50.0


def test_collision_dominates_everything_else() -> None:
    assert cost(thing(60.0, LANE, 0.0)) > 1000.0


def test_imminent_collision_is_worse_than_a_late_one() -> None:
    assert cost(thing(35.0, LANE, 10.0)) > cost(thing(75.0, LANE, 10.0)) > 200.0


@pytest.mark.slow
def test_hard_collision_is_worse_than_a_soft_one() -> None:
    assert cost(thing(60.0, LANE, 0.0), wanted=-3.0) > cost(thing(60.0, LANE, 0.0), wanted=-8.0)


@pytest.mark.slow
def test_braking_to_come_is_paid_for_now() -> None:
    """The wall is beyond the horizon, but a stop before it is no longer a gentle one."""
    wall = thing(200.0, LANE, 0.0)
    assert cost(wall) > cost(wall, wanted=-2.0) > cost(wall, wanted=-3.5)


def test_dodged_wall_costs_nothing_but_a_late_dodge_does() -> None:
    assert cost(thing(75.0, LANE, 0.0), target=LANE + 3.5) < 30.0
    assert cost(thing(30.0, LANE, 0.0), target=LANE + 3.5) > 1000.0


def test_lane_is_never_left_into_somebody() -> None:
    neighbour = thing(2.0, LANE + 3.5, 30.0)
    assert cost(neighbour, target=LANE + 3.5, leaving=True) == math.inf
    assert 100.0 < cost(neighbour, target=LANE + 3.5) < math.inf


def test_who_is_behind_is_not_braked_for_nor_fled_from() -> None:
    assert cost(thing(-6.0, LANE, 60.0)) == 0.0


@pytest.mark.parametrize("across", [1.9, 2.05, 2.3])
def test_overlap_falls_from_contact_to_the_margin(across: float) -> None:
    body, _ = thing(0.0, LANE, 30.0)
    found = overlap(record(), 0.0, across, 0.0, body, 0.0, 0.4)
    assert found == pytest.approx(max(0.0, 1.0 - (across - 1.8) / 0.4))


def test_overlap_is_whole_from_contact_on() -> None:
    body, _ = thing(0.0, LANE, 30.0)
    assert overlap(record(), 0.0, 1.7, 0.0, body, 0.0, 0.4) == 1.0
    assert overlap(record(), 4.4, 0.0, 0.0, body, 0.0, 0.4) == 1.0


def test_turned_body_reaches_further() -> None:
    straight, _ = thing(0.0, LANE, 30.0)
    turned, _ = thing(0.0, LANE, 30.0, heading=0.3)
    assert overlap(record(), 0.0, 2.3, 0.0, straight, 0.0, 0.4) == 0.0
    assert overlap(record(), 0.0, 2.3, 0.0, turned, 0.0, 0.4) > 0.5


def test_what_passes_between_two_samples_is_met() -> None:
    body, _ = thing(0.0, LANE, 0.0)
    assert overlap(record(), 6.0, 0.0, 0.0, body, 0.0, 0.4) == 0.0
    assert overlap(record(), 6.0, 0.0, 0.0, body, 7.5, 0.4) == 1.0


def test_critical_distance_is_that_of_the_regulation() -> None:
    # 130 km/h behind 100 km/h: closing 8.33 m/s for 0.4 s, then braking with 3 m/s², then 1 s.
    closing = 30.0 / 3.6
    wanted = closing * 0.4 + closing**2 / 6.0 + 100.0 / 3.6
    assert critical_distance(record(), 130.0 / 3.6, 100.0 / 3.6) == pytest.approx(wanted)
    assert critical_distance(record(), 20.0, 30.0) == 30.0


def cut_up(*items: Any, d: float = LANE, is_lane: bool = True, **more: float) -> bool:
    objects = np.array([body for body, _ in items]).reshape(-1, OBJECT_ROW)
    ways = np.array([way for _, way in items]).reshape(-1, SAMPLES, WAY_ROW)
    limits = record(**({"rear_sight": 100.0} | more))
    return is_cut_up(limits, LANE + 3.5, is_lane, d, 30.0, objects, ways, len(items))


@pytest.mark.slow
def test_empty_lane_that_is_seen_cuts_up_nobody() -> None:
    assert not cut_up()
    assert not cut_up(thing(-30.0, LANE, 40.0))


@pytest.mark.slow
def test_lane_that_is_not_seen_is_taken_to_be_used() -> None:
    assert cut_up(rear_sight=0.0)
    assert cut_up(rear_sight=30.0)
    assert not cut_up(rear_sight=0.0, is_lane=False)


def test_follower_is_cut_up_if_it_would_have_to_brake_too_hard() -> None:
    assert cut_up(thing(-40.0, LANE + 3.5, 40.0))
    assert not cut_up(thing(-90.0, LANE + 3.5, 40.0))
    assert not cut_up(thing(-40.0, LANE + 3.5, 30.0))


def test_nobody_asks_once_the_ego_is_in_the_lane() -> None:
    assert not cut_up(thing(-10.0, LANE + 3.5, 60.0), d=LANE + 1.5)


def test_slow_traffic_makes_a_lane_dearer_and_fast_does_not() -> None:
    def lane(speed: float) -> float:
        body, way = thing(60.0, LANE, speed)
        return lane_speed_cost(record(), LANE, 30.0, 30.0, body[np.newaxis], way[np.newaxis], 1)

    assert lane(15.0) > lane(25.0) > lane(35.0) == 0.0
