import numpy as np
import pytest

from adeye.signals import Floats, parameter_record
from adeye.simulate.channels.driving import (
    HOLD_DECELERATION,
    MAX_LATERAL,
    allowed_speed,
    channel_records,
    follow,
    lane_at,
    path_of_lane,
    steer,
    vehicle_fields,
)
from adeye.simulate.channels.perception.pose import POSE_CURVATURE, POSE_D, POSE_SPEED, POSE_WIDTH
from adeye.testing import channel_context
from adeye.testing.scenes import straight_road

FOLLOWING = {
    "time_gap": 1.8,
    "standstill_gap": 4.0,
    "max_acceleration": 1.5,
    "comfort_deceleration": 2.5,
}
RECORD = parameter_record(
    FOLLOWING | vehicle_fields(channel_context(None, links=(), sensors={}, desired_speed=30.0))
)[0]


def pose(*, d: float = 5.25, speed: float = 20.0, curvature: float = 0.0) -> Floats:
    state = np.zeros(POSE_WIDTH)
    state[[POSE_D, POSE_SPEED, POSE_CURVATURE]] = d, speed, curvature
    return state


def test_channels_have_one_type_of_record_and_no_number_where_one_has_no_parameter() -> None:
    context = channel_context(None, links=(), sensors={}, desired_speed=30.0)
    nominal = channel_records(context, FOLLOWING)
    safety = channel_records(context, {"staleness": [0.2], "heal_ticks": [20]})
    assert nominal.dtype == safety.dtype
    assert nominal["time_gap"] == FOLLOWING["time_gap"]
    assert np.isnan(nominal["staleness"]).all()
    assert np.isnan(safety["time_gap"]).all()
    assert safety["staleness"] == 0.2
    assert safety["heal_ticks"] == 20.0
    assert safety["desired_speed"] == 30.0


@pytest.mark.parametrize(("d", "lane"), [(-1.0, 0), (0.0, 0), (3.6, 1), (10.4, 2), (12.0, 2)])
def test_place_off_the_lanes_belongs_to_the_outermost_lane(d: float, lane: int) -> None:
    assert lane_at(d, 3.5, 3) == lane
    assert path_of_lane(RECORD, d) == pytest.approx(3.5 * lane + 1.75)


def test_ego_left_of_its_path_steers_right() -> None:
    assert steer(RECORD, pose(d=5.75), 5.25) < 0.0 < steer(RECORD, pose(d=4.75), 5.25)
    assert steer(RECORD, pose(), 5.25) == 0.0


def test_free_straight_road_allows_the_lower_of_desire_and_limit() -> None:
    segments = straight_road().segments[0]
    assert allowed_speed(RECORD, segments, pose(), 5.25) == 30.0
    limited = RECORD.copy()
    limited["speed_limit"] = 22.0
    assert allowed_speed(limited, segments, pose(), 5.25) == 22.0


def test_curve_allows_the_lateral_acceleration_that_is_planned_for() -> None:
    segments = straight_road(curvature=0.01).segments[0]
    allowed = allowed_speed(RECORD, segments, pose(curvature=0.01), 0.0)
    assert allowed == pytest.approx(np.sqrt(MAX_LATERAL * 100.0))


def test_curve_ahead_slows_down_before_it() -> None:
    segments = np.array([[0.0, 0.0, 0.0, 60.0, 0.0], [60.0, 0.0, 0.0, 100.0, 0.02]])
    assert allowed_speed(RECORD, segments, pose(), 0.0) < 30.0
    assert allowed_speed(RECORD, segments, pose(speed=5.0), 0.0) == 30.0


def test_standing_ego_is_held_while_it_may_not_go() -> None:
    assert follow(RECORD, 0.0, 30.0, 3.0, 0.0, 3.5) == -HOLD_DECELERATION
    assert follow(RECORD, 0.0, 30.0, 30.0, 0.0, 3.5) > 0.0


def test_following_never_brakes_harder_than_allowed() -> None:
    assert follow(RECORD, 30.0, 30.0, 5.0, 0.0, 3.5) == -3.5
