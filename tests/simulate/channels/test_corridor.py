import numpy as np
import pytest

from adeye.kernel.road import position
from adeye.signals import Floats, parameter_record
from adeye.simulate.channels.corridor import (
    PATH_GAP,
    PATH_REQUIRED,
    PATH_SPEED,
    PATH_WIDTH,
    offset_from_corridor,
    uses_path,
    view_path,
)
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
from adeye.simulate.channels.perception.pose import (
    POSE_CURVATURE,
    POSE_D,
    POSE_HEADING,
    POSE_S,
    POSE_SPEED,
    POSE_WIDTH,
    POSE_X,
    POSE_Y,
)
from adeye.simulate.channels.perception.tracks import (
    TRACK_BRAKING,
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_STATE,
    TRACK_VAR_VX,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
    TRACKS,
)
from adeye.testing import channel_context
from adeye.testing.scenes import straight_road
from tests.simulate.channels.perceived import perceived

LANE = 5.25


def view(
    *objects: tuple[float, float, float, float],
    speed: float = 20.0,
    ego_d: float = LANE,
    variance: float = 0.0,
    braking: float = 0.0,
    curvature: float = 0.0,
) -> Floats:
    """Look at objects x, y, vx, vy in the vehicle frame of an ego on the lane at d = 5.25 m."""
    segments = straight_road(curvature=curvature).segments[0]
    pose = np.zeros(POSE_WIDTH)
    pose[POSE_D], pose[POSE_SPEED] = ego_d, speed
    pose[POSE_X], pose[POSE_Y], pose[POSE_HEADING] = position(segments, 0.0, ego_d)
    pose[POSE_S] = 0.0
    tracks = np.zeros((TRACKS, TRACK_STATE))
    for row, item in enumerate(objects):
        tracks[row, [TRACK_X, TRACK_Y, TRACK_VX, TRACK_VY]] = item
        tracks[row, [TRACK_LENGTH, TRACK_WIDTH, TRACK_HITS, TRACK_VAR_VX]] = 4.5, 1.8, 3, variance
    tracks[:, TRACK_BRAKING] = braking
    path = np.zeros(PATH_WIDTH)
    ego = {"length": 4.5, "width": 1.8, "lateral_margin": 0.3, "confirm_hits": 3.0}
    view_path(perceived(ego, pose, tracks, segments), 0, LANE, path)
    return path


def test_empty_road_has_an_infinite_gap_and_requires_nothing() -> None:
    path = view()
    assert path[PATH_GAP] == np.inf
    assert path[PATH_REQUIRED] == 0.0


def test_object_ahead_in_the_lane_is_followed_bumper_to_bumper() -> None:
    path = view((40.0, 0.0, 12.0, 0.0))
    assert path[PATH_GAP] == pytest.approx(35.5)
    assert path[PATH_SPEED] == pytest.approx(12.0)
    assert path[PATH_REQUIRED] == pytest.approx(8.0**2 / (2.0 * 35.5))


def test_nearest_is_followed_and_the_most_demanding_is_required() -> None:
    path = view((80.0, 0.0, 0.0, 0.0), (30.0, 0.0, 20.0, 0.0))
    assert path[PATH_GAP] == pytest.approx(25.5)
    assert path[PATH_REQUIRED] == pytest.approx(20.0**2 / (2.0 * 75.5))


@pytest.mark.parametrize("y", [3.5, -3.5, 2.2])
def test_object_in_the_next_lane_is_not_in_the_path(y: float) -> None:
    assert view((40.0, y, 0.0, 0.0))[PATH_GAP] == np.inf


def test_object_that_reaches_into_the_margin_is_in_the_path() -> None:
    assert view((40.0, 2.0, 0.0, 0.0))[PATH_GAP] == pytest.approx(35.5)


@pytest.mark.slow
def test_braking_of_the_object_ahead_counts_until_it_stands() -> None:
    # Both at 20 m/s: it stops within 200/6 m, which is added to the gap.
    path = view((40.0, 0.0, 20.0, 0.0), braking=-6.0)
    assert path[PATH_REQUIRED] == pytest.approx(20.0**2 / (2.0 * (35.5 + 400.0 / 12.0)))
    assert view((40.0, 0.0, 20.0, 0.0), braking=-1.0)[PATH_REQUIRED] == 0.0
    standing = view((40.0, 0.0, 0.0, 0.0), braking=-6.0)
    assert standing[PATH_REQUIRED] == pytest.approx(20.0**2 / 71.0)


def test_object_behind_is_not_in_the_path() -> None:
    assert view((-10.0, 0.0, 30.0, 0.0))[PATH_GAP] == np.inf


def test_unconfirmed_speed_does_not_count_yet() -> None:
    assert view((40.0, 0.0, 0.0, 0.0), variance=100.0)[PATH_GAP] == np.inf


@pytest.mark.slow
def test_object_on_the_way_back_to_the_lane_centre_is_in_the_path() -> None:
    assert view((40.0, 1.5, 0.0, 0.0), ego_d=LANE - 1.5)[PATH_GAP] < np.inf
    assert view((40.0, 0.0, 0.0, 0.0), ego_d=LANE - 1.5)[PATH_GAP] < np.inf


def test_path_follows_the_curve() -> None:
    radius = 200.0
    straight_on = view((80.0, 0.0, 0.0, 0.0), curvature=1.0 / radius)
    assert straight_on[PATH_GAP] == np.inf
    angle = 80.0 / (radius - LANE)
    along = (radius - LANE) * np.sin(angle), (radius - LANE) * (1.0 - np.cos(angle))
    in_the_lane = view((*along, 0.0, 0.0), curvature=1.0 / radius)
    assert in_the_lane[PATH_GAP] == pytest.approx((radius - LANE) * angle - 4.5, rel=1e-6)


def test_oncoming_object_is_to_be_stopped_for() -> None:
    path = view((60.0, 0.0, -10.0, 0.0))
    assert path[PATH_SPEED] == 0.0
    assert path[PATH_REQUIRED] == pytest.approx(20.0**2 / (2.0 * 55.5))


def test_cutting_in_counts_within_a_second_of_entering() -> None:
    assert view((40.0, 3.5, 20.0, -1.5))[PATH_GAP] == pytest.approx(35.5)
    assert view((40.0, 3.5, 20.0, -0.6))[PATH_GAP] == np.inf


def test_crossing_pedestrian_counts_when_both_come_together() -> None:
    # At 20 m/s the ego is 2 s away; at 1.5 m/s the pedestrian enters after 1.8 s.
    together = view((44.5, -4.8, 0.0, 1.5))
    assert together[PATH_REQUIRED] == pytest.approx(20.0**2 / 80.0)
    assert view((14.5, -4.8, 0.0, 1.5))[PATH_REQUIRED] == 0.0
    assert view((140.0, -4.8, 0.0, 1.5))[PATH_REQUIRED] == 0.0


def test_pedestrian_walking_away_or_along_does_not_count() -> None:
    assert view((44.5, -4.8, 0.0, -1.5))[PATH_REQUIRED] == 0.0
    assert view((44.5, -4.8, 1.5, 0.0))[PATH_REQUIRED] == 0.0


def test_contact_requires_without_bound() -> None:
    assert view((4.0, 0.0, 0.0, 0.0))[PATH_REQUIRED] == np.inf


@pytest.mark.parametrize(("d", "offset"), [(7.0, 1.0), (5.5, 0.0), (4.0, -1.0)])
def test_offset_is_from_the_strip_between_path_and_ego(d: float, offset: float) -> None:
    assert offset_from_corridor(d, 5.0, 6.0) == offset


def test_use_of_the_path_grows_with_inward_speed() -> None:
    uses = [uses_path(4.0, inward, 1.5, 30.0, 9.0, 10.0) for inward in (0.0, 0.2, 1.0, 3.0)]
    assert uses == sorted(uses)
    assert uses[0] is False
    assert uses[-1] is True


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
