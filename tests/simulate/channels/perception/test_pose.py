"""The pose of a channel: carried on between the estimates of its sensors, and given up."""

import math
from functools import partial

import numpy as np
import pytest

from adeye.kernel.road import position
from adeye.signals import Floats
from adeye.simulate.channels.perception import pose as subject
from adeye.testing.scenes import ego_estimate, straight_road

STEP = 0.05


STRAIGHT = straight_road().segments[0]


def fresh_pose() -> Floats:
    pose = np.zeros(subject.POSE_WIDTH)
    subject.clear_pose(pose)
    return pose


def estimate_at(
    time: float, *, speed: float = 20.0, curvature: float = 0.0, rear: float = 0.0
) -> Floats:
    """Ego whose centre moves along the line 5 m left of the reference line.

    Its body is turned in where its centre is ahead of the rear axle, by ``rear``.
    """
    road = straight_road(curvature=curvature)
    s = speed * time / (1.0 - 5.0 * curvature)
    x, y, heading = position(road.segments[0], s, 5.0)
    bend = curvature / (1.0 - 5.0 * curvature)
    turned_in = math.asin(rear * bend)
    forward = speed * math.cos(turned_in)
    state = np.array([[x, y, heading - turned_in, forward, 0.0, 0.0, forward * bend]])
    return ego_estimate(road, state).reshape(-1)


def test_pose_is_unknown_before_the_first_sample_that_is_a_number() -> None:
    wrong = estimate_at(0.0)
    wrong[1] = np.nan
    for sample, stamp in ((np.zeros(13), -1.0), (wrong, 0.0)):
        pose = fresh_pose()
        subject.update_pose(pose, STRAIGHT, sample, stamp, 0.0, STEP)
        assert not subject.has_pose(pose, 0.0)


def test_late_sample_is_carried_to_now() -> None:
    pose = fresh_pose()
    subject.update_pose(pose, STRAIGHT, estimate_at(1.0), 1.0, 1.2, STEP)
    assert pose[subject.POSE_S] == pytest.approx(24.0)
    assert pose[subject.POSE_STAMP] == 1.0


@pytest.mark.parametrize(
    ("curvature", "speed", "rear", "near"),
    [
        (0.0, 20.0, 0.0, 0.02),
        (1.0 / 200.0, 20.0, 0.0, 0.02),
        (-1.0 / 200.0, 20.0, 0.0, 0.02),
        # A box centre that swings around the rear axle.
        (1.0 / 60.0, 12.0, 1.45, 0.01),
        (-1.0 / 60.0, 12.0, 1.45, 0.01),
    ],
)
def test_pose_stays_true_between_rare_late_samples(
    curvature: float, speed: float, rear: float, near: float
) -> None:
    pose = fresh_pose()
    pose[subject.POSE_REAR] = rear
    segments = straight_road(curvature=curvature).segments[0]
    sample = partial(estimate_at, speed=speed, curvature=curvature, rear=rear)
    for tick in range(2, 60):
        stamp = (tick // 4) * 4 * STEP - 2 * STEP
        subject.update_pose(pose, segments, sample(stamp), stamp, tick * STEP, STEP)
    assert pose[[subject.POSE_X, subject.POSE_Y]] == pytest.approx(sample(59 * STEP)[:2], abs=near)
    turned_in = math.asin(rear * curvature / (1.0 - 5.0 * curvature))
    assert pose[subject.POSE_ALIGN] == pytest.approx(-turned_in, abs=2e-3 if rear else 1e-3)


def test_noise_is_reduced_as_the_gain_promises() -> None:
    generator = np.random.Generator(np.random.Philox(1))
    pose, places, headings = fresh_pose(), [], []
    for tick in range(3000):
        sample = estimate_at(tick * STEP)
        sample[8] += 0.1 * generator.standard_normal()
        sample[2] += 0.01 * generator.standard_normal()
        subject.update_pose(pose, STRAIGHT, sample, tick * STEP, tick * STEP, STEP)
        places.append(pose[subject.POSE_D])
        headings.append(pose[subject.POSE_ALIGN])
    promised = 0.01 * np.sqrt(subject.HEADING_GAIN / (2.0 - subject.HEADING_GAIN))
    assert np.std(headings) == pytest.approx(promised, rel=0.1)
    assert (
        np.std(places) >= 0.1 * np.sqrt(subject.LATERAL_GAIN / (2.0 - subject.LATERAL_GAIN)) * 0.9
    )
    assert np.std(places) < 0.08


def test_braking_ego_is_carried_to_standstill_and_no_further() -> None:
    pose = fresh_pose()
    sample = estimate_at(0.0, speed=2.0)
    sample[4] = -8.0
    subject.update_pose(pose, straight_road().segments[0], sample, 0.0, 0.0, STEP)
    start = pose[subject.POSE_S]
    for tick in range(1, 9):
        subject.update_pose(pose, straight_road().segments[0], sample, 0.0, tick * STEP, STEP)
    assert pose[subject.POSE_SPEED] == 0.0
    assert pose[subject.POSE_S] - start == pytest.approx(0.25, abs=1e-9)


def test_pose_is_lost_when_samples_stay_away() -> None:
    pose = fresh_pose()
    subject.update_pose(pose, straight_road().segments[0], estimate_at(0.0), 0.0, 0.0, STEP)
    assert subject.has_pose(pose, subject.MAX_AGE)
    assert not subject.has_pose(pose, subject.MAX_AGE + STEP)
