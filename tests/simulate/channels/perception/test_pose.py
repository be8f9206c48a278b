import math

import numpy as np
import pytest

from adeye.kernel.road import position
from adeye.signals import Floats
from adeye.simulate.channels.perception.pose import (
    HEADING_GAIN,
    LATERAL_GAIN,
    MAX_AGE,
    POSE_ALIGN,
    POSE_D,
    POSE_REAR,
    POSE_S,
    POSE_SPEED,
    POSE_STAMP,
    POSE_WIDTH,
    POSE_X,
    POSE_Y,
    clear_pose,
    has_pose,
    update_pose,
)
from adeye.testing.scenes import ego_estimate, straight_road

STEP = 0.05


def fresh_pose() -> Floats:
    pose = np.zeros(POSE_WIDTH)
    clear_pose(pose)
    return pose


def estimate_at(time: float, *, speed: float = 20.0, curvature: float = 0.0) -> Floats:
    """Ego on the line 5 m left of the reference line."""
    road = straight_road(curvature=curvature)
    s = speed * time / (1.0 - 5.0 * curvature)
    x, y, heading = position(road.segments[0], s, 5.0)
    yaw_rate = curvature * speed / (1.0 - 5.0 * curvature)
    estimates = ego_estimate(road, np.array([[x, y, heading, speed, 0.0, 0.0, yaw_rate]]))
    return estimates.reshape(-1)


def test_pose_is_unknown_before_the_first_sample() -> None:
    pose = fresh_pose()
    update_pose(pose, straight_road().segments[0], np.zeros(13), -1.0, 0.0, STEP)
    assert not has_pose(pose, 0.0)


def test_late_sample_is_carried_to_now() -> None:
    pose = fresh_pose()
    update_pose(pose, straight_road().segments[0], estimate_at(1.0), 1.0, 1.2, STEP)
    assert pose[POSE_S] == pytest.approx(24.0)
    assert pose[POSE_STAMP] == 1.0


@pytest.mark.parametrize("curvature", [0.0, 1.0 / 200.0, -1.0 / 200.0])
def test_pose_stays_true_between_rare_late_samples(curvature: float) -> None:
    pose = fresh_pose()
    segments = straight_road(curvature=curvature).segments[0]
    for tick in range(2, 60):
        stamp = (tick // 4) * 4 * STEP - 2 * STEP
        sample = estimate_at(stamp, curvature=curvature)
        update_pose(pose, segments, sample, stamp, tick * STEP, STEP)
    truth = estimate_at(59 * STEP, curvature=curvature)
    assert pose[[POSE_X, POSE_Y]] == pytest.approx(truth[:2], abs=0.02)
    assert pose[POSE_ALIGN] == pytest.approx(0.0, abs=1e-3)


def test_noise_is_reduced_as_the_gain_promises() -> None:
    generator = np.random.Generator(np.random.Philox(1))
    pose, places, headings = fresh_pose(), [], []
    for tick in range(3000):
        sample = estimate_at(tick * STEP)
        sample[8] += 0.1 * generator.standard_normal()
        sample[2] += 0.01 * generator.standard_normal()
        update_pose(pose, straight_road().segments[0], sample, tick * STEP, tick * STEP, STEP)
        places.append(pose[POSE_D])
        headings.append(pose[POSE_ALIGN])
    assert np.std(headings) == pytest.approx(
        0.01 * np.sqrt(HEADING_GAIN / (2.0 - HEADING_GAIN)), rel=0.1
    )
    assert np.std(places) >= 0.1 * np.sqrt(LATERAL_GAIN / (2.0 - LATERAL_GAIN)) * 0.9
    assert np.std(places) < 0.08


def test_braking_ego_is_carried_to_standstill_and_no_further() -> None:
    pose = fresh_pose()
    sample = estimate_at(0.0, speed=2.0)
    sample[4] = -8.0
    update_pose(pose, straight_road().segments[0], sample, 0.0, 0.0, STEP)
    start = pose[POSE_S]
    for tick in range(1, 9):
        update_pose(pose, straight_road().segments[0], sample, 0.0, tick * STEP, STEP)
    assert pose[POSE_SPEED] == 0.0
    assert pose[POSE_S] - start == pytest.approx(0.25, abs=1e-9)


def test_pose_is_lost_when_samples_stay_away() -> None:
    pose = fresh_pose()
    update_pose(pose, straight_road().segments[0], estimate_at(0.0), 0.0, 0.0, STEP)
    assert has_pose(pose, MAX_AGE)
    assert not has_pose(pose, MAX_AGE + STEP)


def test_sample_that_is_no_number_is_not_used() -> None:
    pose = fresh_pose()
    sample = estimate_at(0.0)
    sample[1] = np.nan
    update_pose(pose, straight_road().segments[0], sample, 0.0, 0.0, STEP)
    assert not has_pose(pose, 0.0)


@pytest.mark.parametrize("curvature", [1.0 / 60.0, -1.0 / 60.0])
def test_pose_of_a_box_centre_that_swings_around_the_rear_axle_stays_true(
    curvature: float,
) -> None:
    """The body is turned in: its centre moves along the lane and not along the heading."""
    pose, rear = fresh_pose(), 1.45
    pose[POSE_REAR] = rear
    segments = straight_road(curvature=curvature).segments[0]
    speed, d = 12.0, 5.0
    bend = curvature / (1.0 - d * curvature)
    turned_in = math.asin(rear * bend)
    rate = speed * math.cos(turned_in) * bend
    forward = speed * math.cos(turned_in)

    def sample(time: float) -> Floats:
        return true_sample(time, speed, curvature, turned_in, forward, rate)

    for tick in range(2, 60):
        stamp = (tick // 4) * 4 * STEP - 2 * STEP
        # The centre drives at the speed over the cosine of what it slips.
        update_pose(pose, segments, sample(stamp), stamp, tick * STEP, STEP)
    truth = sample(59 * STEP)
    assert pose[[POSE_X, POSE_Y]] == pytest.approx(truth[:2], abs=0.01)
    assert pose[POSE_ALIGN] == pytest.approx(-turned_in, abs=2e-3)


def true_sample(
    time: float, speed: float, curvature: float, turned_in: float, forward: float, rate: float
) -> Floats:
    """Centre at ``speed`` along the line 5 m left of the reference line, turned in by an angle."""
    road = straight_road(curvature=curvature)
    s = speed * time / (1.0 - 5.0 * curvature)
    x, y, heading = position(road.segments[0], s, 5.0)
    state = np.array([[x, y, heading - turned_in, forward, 0.0, 0.0, rate]])
    return ego_estimate(road, state).reshape(-1)
