import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel.jit import compiled
from adeye.kernel.profiles import (
    FREE_GROWTH,
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
from adeye.signals import OBJECT_CLASSES, Floats
from adeye.simulate.channels.perception.step import Seen
from adeye.simulate.channels.perception.tracks import (
    TRACK_BRAKING,
    TRACK_CLASS,
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_STATE,
    TRACK_VAR_VX,
    TRACK_VAR_VY,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
)
from adeye.simulate.channels.trajectory.cost import (
    LINE_D,
    LINE_ROW,
    SAMPLES,
    Others,
    critical_distance,
    drive_line,
    is_cut_up,
    lane_speed_cost,
    mark_interest,
    object_cost,
    overlap,
    predict_objects,
    profile_cost,
    rounded_square,
)
from tests.simulate.channels.perceived import perceived
from tests.simulate.channels.trajectory.record import LANE, pose, record

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


def others(*items: tuple[Floats, Floats]) -> Others:
    """Return things as the predicted objects."""
    objects = np.array([body for body, _ in items]).reshape(-1, OBJECT_ROW)
    return Others(objects, np.array([way for _, way in items]).reshape(-1, SAMPLES, WAY_ROW))


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
    mark_interest(limits, profile, others(item), window)
    if window[0, 0] >= window[0, 1]:
        return 0.0
    return object_cost(limits, profile, line, body, way, window[0], leaving)


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
    limits = record(**({"rear_sight": 100.0} | more))
    return is_cut_up(limits, LANE + 3.5, is_lane, d, 30.0, others(*items))


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
        return lane_speed_cost(record(), LANE, 30.0, 30.0, others(thing(60.0, LANE, speed)))

    assert lane(15.0) > lane(25.0) > lane(35.0) == 0.0


def track(x: float, y: float, vx: float, vy: float = 0.0, **more: float) -> Floats:
    made = np.zeros(TRACK_STATE)
    made[TRACK_X], made[TRACK_Y], made[TRACK_VX], made[TRACK_VY] = x, y, vx, vy
    made[TRACK_LENGTH], made[TRACK_WIDTH] = 4.5, 1.8
    made[TRACK_HITS] = more.get("hits", 5.0)
    made[TRACK_VAR_VX] = more.get("var_vx", 0.1)
    made[TRACK_VAR_VY] = more.get("var_vy", 0.01)
    made[TRACK_BRAKING] = more.get("braking", 0.0)
    made[TRACK_CLASS] = more.get("kind", 0.0)
    return made


def predicted(*tracks: Floats) -> tuple[int, Floats, Floats]:
    room = Others(np.zeros((8, OBJECT_ROW)), np.zeros((8, SAMPLES, WAY_ROW)))
    segments = np.array([[0.0, 0.0, 0.0, 3000.0, 0.0]])
    road = {"length": 4.5, "lane_width": 3.5, "lanes": 3.0, "confirm_hits": 3.0}
    seen = perceived(road, pose(), np.array(tracks), segments)
    return _predicted(seen, INTERVAL, room), room.objects, room.ways


@compiled
def _predicted(seen: Seen, interval: float, room: Others) -> int:
    """Count the objects: outside of compiled code, a part of an array comes back whole."""
    return int(predict_objects(seen, 0, interval, room).objects.shape[0])


def test_vehicle_goes_on_at_its_speed_in_its_lane() -> None:
    _, objects, ways = predicted(track(40.0, 3.5, 25.0))
    assert ways[0, :, WAY_S] == pytest.approx(40.0 + 25.0 * TIMES)
    assert ways[0, :, WAY_D] == pytest.approx(LANE + 3.5)
    assert objects[0, OBJECT_S] == 40.0


def test_swaying_vehicle_stays_where_it_is() -> None:
    _, _, ways = predicted(track(40.0, 3.5, 25.0, -0.25), track(40.0, 3.5, 25.0, -0.8, var_vy=0.49))
    assert ways[:2, :, WAY_D] == pytest.approx(LANE + 3.5)


@pytest.mark.slow
def test_vehicle_that_moves_sideways_completes_its_lane_change() -> None:
    _, objects, ways = predicted(track(40.0, 3.3, 25.0, -1.0))
    assert ways[0, :, WAY_D] == pytest.approx(np.maximum(LANE, LANE + 3.3 - TIMES))
    assert objects[0, OBJECT_SINE] < 0.0


def test_pedestrian_goes_on_across_all_lanes() -> None:
    kind = float(OBJECT_CLASSES.index("pedestrian"))
    _, objects, ways = predicted(track(40.0, -6.0, 0.0, 2.0, kind=kind))
    assert ways[0, :, WAY_D] == pytest.approx(LANE - 6.0 + 2.0 * TIMES)
    assert objects[0, OBJECT_GROWTH] == FREE_GROWTH


def test_braking_vehicle_stands_and_stays() -> None:
    _, _, ways = predicted(track(40.0, 0.0, 12.0, braking=-6.0))
    assert ways[0, -1, WAY_S] == pytest.approx(40.0 + 12.0**2 / 12.0)
    assert ways[0, -1, WAY_SPEED] == 0.0
    assert ways[0, 3, WAY_SPEED] == pytest.approx(12.0 - 6.0)


def test_track_that_is_not_sure_yet_is_left_out() -> None:
    count, _, _ = predicted(track(40.0, 0.0, 0.0, hits=2.0), track(40.0, 0.0, 0.0, var_vx=100.0))
    assert count == 0


@pytest.mark.slow
def test_only_what_is_all_behind_the_ego_is_behind() -> None:
    _, objects, _ = predicted(track(-4.0, 3.5, 30.0), track(-5.0, 3.5, 30.0))
    assert objects[:2, OBJECT_BEHIND].tolist() == [0.0, 1.0]


def profile(speed: float, wanted: float) -> Floats:
    made = np.zeros((SAMPLES, PROFILE_ROW))
    fill_profile(speed, wanted, wanted, 25.0, 0.25, 0.0, made)
    return made


def cost_scoring(
    speed: float, wanted: float, allowed: float = 30.0, previous: float = 0.0
) -> float:
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
    assert cost_scoring(30.0, 0.0) == 0.0
    assert cost_scoring(30.0, 0.2) > 0.0
    assert cost_scoring(30.0, -0.2) > 0.0


def test_slow_ego_gains_by_accelerating_and_fast_one_by_braking() -> None:
    assert cost_scoring(20.0, 0.5) < cost_scoring(20.0, 0.0)
    assert cost_scoring(34.0, -0.5) < cost_scoring(34.0, 0.0)


def test_becoming_faster_than_allowed_is_worse_than_hard_braking() -> None:
    assert cost_scoring(30.0, 1.5) > cost_scoring(30.0, -8.0)


@pytest.mark.slow
def test_another_acceleration_than_before_costs() -> None:
    assert cost_scoring(20.0, 1.0, previous=1.0) < cost_scoring(20.0, 1.0, previous=0.0)


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
