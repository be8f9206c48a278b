"""What is in the path of a channel, and how hard it brakes for that."""

from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.kernel.road import position
from adeye.signals import Floats, parameter_record
from adeye.simulate.channels import corridor as subject
from adeye.simulate.channels import driving
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.perception import pose as poses
from adeye.simulate.channels.perception import tracks as kept
from adeye.simulate.channels.safety import PlannedSafetyChannel
from adeye.simulate.channels.trajectory.channel import TrajectoryChannel
from adeye.spec.channels import NominalParameters, SafetyParameters, TrajectoryParameters
from adeye.testing import channel_context
from adeye.testing.scenes import straight_road
from tests.kernel.stop_limits import GROUND
from tests.kernel.test_strips import SLABS, STRIPS
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
    road = straight_road(curvature=curvature)
    pose = np.zeros(poses.POSE_WIDTH)
    pose[poses.POSE_D], pose[poses.POSE_SPEED] = ego_d, speed
    pose[poses.POSE_X], pose[poses.POSE_Y], pose[poses.POSE_HEADING] = position(
        road.segments[0], 0.0, ego_d
    )
    pose[poses.POSE_S] = 0.0
    tracks = np.zeros((kept.TRACKS, kept.TRACK_STATE))
    for row, item in enumerate(objects):
        tracks[row, [kept.TRACK_X, kept.TRACK_Y, kept.TRACK_VX, kept.TRACK_VY]] = item
        tracks[row, [kept.TRACK_LENGTH, kept.TRACK_WIDTH]] = 4.5, 1.8
        tracks[row, [kept.TRACK_HITS, kept.TRACK_VAR_VX]] = 3, variance
    tracks[:, kept.TRACK_BRAKING] = braking
    path = np.zeros(subject.PATH_WIDTH)
    ego = {"length": 4.5, "width": 1.8, "lateral_margin": 0.3, "confirm_hits": 3.0}
    subject.view_path(perceived(ego, pose, tracks, road), 0, LANE, path)
    return path


PATHS: dict[str, tuple[tuple[float, float, float, float], float, float]] = {
    "from bumper to bumper": ((40.0, 0.0, 12.0, 0.0), 35.5, 8.0**2 / 71.0),
    "in the left lane": ((40.0, 3.5, 0.0, 0.0), np.inf, 0.0),
    "in the right lane": ((40.0, -3.5, 0.0, 0.0), np.inf, 0.0),
    "just beyond the margin": ((40.0, 2.2, 0.0, 0.0), np.inf, 0.0),
    "reaches into the margin": ((40.0, 2.0, 0.0, 0.0), 35.5, 20.0**2 / 71.0),
    "behind": ((-10.0, 0.0, 30.0, 0.0), np.inf, 0.0),
    "oncoming is to be stopped for": ((60.0, 0.0, -10.0, 0.0), 55.5, 20.0**2 / 111.0),
    "cuts in within a second": ((40.0, 3.5, 20.0, -1.5), 35.5, 0.0),
    "cuts in later": ((40.0, 3.5, 20.0, -0.6), np.inf, 0.0),
    # At 20 m/s the ego is 2 s away; at 1.5 m/s the pedestrian enters after 1.8 s.
    "crosses and meets the ego": ((44.5, -4.8, 0.0, 1.5), 40.0, 20.0**2 / 80.0),
    "crosses after the ego": ((14.5, -4.8, 0.0, 1.5), np.inf, 0.0),
    "crosses before the ego": ((140.0, -4.8, 0.0, 1.5), np.inf, 0.0),
    "walks away": ((44.5, -4.8, 0.0, -1.5), np.inf, 0.0),
    "walks along": ((44.5, -4.8, 1.5, 0.0), np.inf, 0.0),
    "contact": ((4.0, 0.0, 0.0, 0.0), -0.5, np.inf),
}
"""An object, the gap to what is followed, and the deceleration that is required."""


def test_path_has_what_is_or_comes_ahead_in_the_lane() -> None:
    for name, (thing, gap, required) in PATHS.items():
        path = view(thing)
        found = path[subject.PATH_GAP], path[subject.PATH_REQUIRED]
        assert found == (pytest.approx(gap), pytest.approx(required)), name
    assert view((40.0, 0.0, 12.0, 0.0))[subject.PATH_SPEED] == pytest.approx(12.0)
    assert view((60.0, 0.0, -10.0, 0.0))[subject.PATH_SPEED] == 0.0
    empty = view()
    assert (empty[subject.PATH_GAP], empty[subject.PATH_REQUIRED]) == (np.inf, 0.0)


def test_nearest_is_followed_and_the_most_demanding_is_required() -> None:
    path = view((80.0, 0.0, 0.0, 0.0), (30.0, 0.0, 20.0, 0.0))
    assert path[subject.PATH_GAP] == pytest.approx(25.5)
    assert path[subject.PATH_REQUIRED] == pytest.approx(20.0**2 / (2.0 * 75.5))


def test_object_on_the_way_back_counts_and_one_of_unsure_speed_does_not_yet() -> None:
    for y in (0.0, 1.5):
        assert view((40.0, y, 0.0, 0.0), ego_d=LANE - 1.5)[subject.PATH_GAP] < np.inf
    assert view((40.0, 0.0, 0.0, 0.0), variance=100.0)[subject.PATH_GAP] == np.inf


@pytest.mark.slow
def test_braking_of_the_object_ahead_counts_until_it_stands() -> None:
    # Both at 20 m/s: it stops within 200/6 m, which is added to the gap.
    path = view((40.0, 0.0, 20.0, 0.0), braking=-6.0)
    assert path[subject.PATH_REQUIRED] == pytest.approx(20.0**2 / (2.0 * (35.5 + 400.0 / 12.0)))
    assert view((40.0, 0.0, 20.0, 0.0), braking=-1.0)[subject.PATH_REQUIRED] == 0.0
    standing = view((40.0, 0.0, 0.0, 0.0), braking=-6.0)
    assert standing[subject.PATH_REQUIRED] == pytest.approx(20.0**2 / 71.0)


def test_path_follows_the_curve() -> None:
    radius = 200.0
    straight_on = view((80.0, 0.0, 0.0, 0.0), curvature=1.0 / radius)
    assert straight_on[subject.PATH_GAP] == np.inf
    angle = 80.0 / (radius - LANE)
    along = (radius - LANE) * np.sin(angle), (radius - LANE) * (1.0 - np.cos(angle))
    in_the_lane = view((*along, 0.0, 0.0), curvature=1.0 / radius)
    assert in_the_lane[subject.PATH_GAP] == pytest.approx((radius - LANE) * angle - 4.5, rel=1e-6)


def test_offset_is_from_the_strip_between_path_and_ego() -> None:
    for d, offset in ((7.0, 1.0), (5.5, 0.0), (4.0, -1.0)):
        assert subject.offset_from_corridor(d, 5.0, 6.0) == offset


def test_vehicle_lies_where_it_goes_across_a_road_of_strips() -> None:
    track = np.zeros(kept.TRACK_STATE)
    track[[kept.TRACK_LENGTH, kept.TRACK_WIDTH]] = 4.5, 1.8
    of_strips = GROUND._replace(slabs=SLABS, strips=STRIPS)
    for forward, sideways, extent in (
        (0.0, -5.0, (1.8, 4.5)),
        (-3.0, 4.0, (0.6 * 4.5 + 0.8 * 1.8, 0.8 * 4.5 + 0.6 * 1.8)),
        # Who changes lanes, or stands as far as is known, lies along the road.
        (20.0, 1.5, (4.5, 1.8)),
        (0.0, 0.9, (4.5, 1.8)),
    ):
        found = subject.extent_of(track, forward, sideways, of_strips)
        assert found == pytest.approx(extent), (forward, sideways)
        assert subject.extent_of(track, forward, sideways, GROUND) == (4.5, 1.8)
    track[kept.TRACK_VAR_VY] = 4.5**2
    assert subject.extent_of(track, 0.0, -5.0, of_strips) == (4.5, 1.8)


def test_use_of_the_path_grows_with_inward_speed() -> None:
    uses = [subject.uses_path(4.0, inward, 1.5, 30.0, 9.0, 10.0) for inward in (0.0, 0.2, 1.0, 3.0)]
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
    FOLLOWING
    | driving.vehicle_fields(channel_context(None, links=(), sensors={}, desired_speed=30.0))
)[0]


def pose(*, d: float = 5.25, speed: float = 20.0, curvature: float = 0.0) -> Floats:
    state = np.zeros(poses.POSE_WIDTH)
    state[[poses.POSE_D, poses.POSE_SPEED, poses.POSE_CURVATURE]] = d, speed, curvature
    return state


def test_channels_have_one_type_of_record() -> None:
    channels: tuple[Any, ...] = (NominalChannel(), PlannedSafetyChannel(), TrajectoryChannel())
    specs = (NominalParameters(), SafetyParameters(), TrajectoryParameters())
    contexts = [channel_context(item, links=(), sensors={}) for item in specs]
    for channel, context in zip(channels, contexts, strict=True):
        channel.reset(context)
    assert len({channel._seen.records.dtype for channel in channels}) == 1


def test_record_has_no_number_where_a_channel_has_no_parameter() -> None:
    context = channel_context(None, links=(), sensors={}, desired_speed=30.0)
    safety = driving.channel_records(context, {"staleness": [0.2], "heal_ticks": [20]})
    assert np.isnan(safety["time_gap"]).all()
    assert safety["staleness"] == 0.2
    assert safety["heal_ticks"] == 20.0
    assert safety["desired_speed"] == 30.0


def test_ego_left_of_its_path_steers_right() -> None:
    assert (
        driving.steer(RECORD, GROUND, pose(d=5.75), 5.25)
        < 0.0
        < driving.steer(RECORD, GROUND, pose(d=4.75), 5.25)
    )
    assert driving.steer(RECORD, GROUND, pose(), 5.25) == 0.0


def test_free_straight_road_allows_the_lower_of_desire_and_limit() -> None:
    assert driving.allowed_speed(RECORD, GROUND, pose(), 5.25) == (30.0, 0.0)
    assert driving.allowed_speed(RECORD, GROUND._replace(speed_limit=22.0), pose(), 5.25) == (
        22.0,
        0.0,
    )


def test_curve_allows_the_lateral_acceleration_that_is_planned_for() -> None:
    ground = straight_road(curvature=0.01).ground(0)
    allowed = driving.allowed_speed(RECORD, ground, pose(curvature=0.01), 0.0)[0]
    assert allowed == pytest.approx(np.sqrt(driving.MAX_LATERAL * 100.0))


def test_curve_ahead_slows_down_before_it() -> None:
    line = np.array([[0.0, 0.0, 0.0, 60.0, 0.0], [60.0, 0.0, 0.0, 100.0, 0.02]])
    ground = GROUND._replace(segments=line)
    assert driving.allowed_speed(RECORD, ground, pose(), 0.0)[0] < 30.0
    assert driving.allowed_speed(RECORD, ground, pose(speed=5.0), 0.0)[0] == 30.0


def approach(grade: float) -> list[tuple[float, float]]:
    """Drive at 20 m/s to where the limit falls to 10 m/s at 100 m; return places and speeds."""
    across: Any = {"slabs": SLABS[np.newaxis], "strips": STRIPS[np.newaxis]}
    ground = replace(straight_road(), **across).ground(0)
    s, speed, passed = 0.0, 20.0, []
    # Sensing, command and brake are late by 0.4 s.
    commands = deque([0.0] * 8)
    while s < 160.0:
        at = pose(d=-1.5, speed=speed)
        at[poses.POSE_S] = s
        allowed = driving.allowed_speed(RECORD, ground, at, -1.5)
        commands.append(driving.follow(RECORD, ground, speed, allowed, np.inf, 0.0, 6.0))
        speed += 0.05 * (commands.popleft() + grade)
        s += 0.05 * speed
        passed.append((s, speed))
    return passed


@pytest.mark.parametrize("grade", [0.0, 0.3])
def test_a_lower_limit_is_kept_from_where_it_begins_also_downhill(grade: float) -> None:
    passed = approach(grade)
    begins = next(speed for s, speed in passed if s >= 100.0)
    assert 8.8 < begins <= 10.0
    assert max(speed for s, speed in passed if s >= 100.0) <= 10.25
    # It is braked for as late as the comfortable deceleration lets.
    assert max(s for s, speed in passed if speed >= 19.5) > 20.0


def test_a_bend_that_grows_is_steered_for_where_the_wheels_have_turned() -> None:
    line = np.array([[0.0, 0.0, 0.0, 3.0, 0.0], [3.0, 0.0, 0.0, 100.0, 0.02]])
    ground = GROUND._replace(segments=line)
    assert driving.steer(RECORD, ground, pose(), 5.25) == 0.0
    assert driving.steer(RECORD, ground._replace(slabs=SLABS, strips=STRIPS), pose(), 5.25) > 0.0


def test_standing_ego_is_held_while_it_may_not_go_and_nobody_brakes_harder_than_allowed() -> None:
    assert (
        driving.follow(RECORD, GROUND, 0.0, (30.0, 0.0), 3.0, 0.0, 3.5)
        == -driving.HOLD_DECELERATION
    )
    assert driving.follow(RECORD, GROUND, 0.0, (30.0, 0.0), 30.0, 0.0, 3.5) > 0.0
    assert driving.follow(RECORD, GROUND, 30.0, (30.0, 0.0), 5.0, 0.0, 3.5) == -3.5
