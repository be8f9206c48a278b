"""Objects followed through the readings of several sensors, late and in any order."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.signals import Floats
from adeye.simulate.channels.perception import tracking as kept
from adeye.simulate.channels.perception.pose import POSE_REAR, POSE_SPEED, POSE_WIDTH, POSE_YAW_RATE
from adeye.simulate.channels.perception.tracking import (
    drop_tentative,
    predict_tracks,
    update_tracks,
)
from tests.simulate.channels.perceived import sample_of

STEP = 0.05
EGO_SPEED = 20.0
CONFIRM = (3.0, 0.0, 0.0)
TRUTH, RADAR, CAMERA, LIDAR = (
    np.square(row)
    for row in (
        (0.02, 0.0, 0.02, 0.0, 0.05),
        (0.50, 0.0, 0.20, 0.010, 0.25),
        (0.30, 3e-4, 0.10, 0.003, 0.05),
        (0.15, 0.0, 0.10, 0.002, 0.05),
    )
)
"""Variances that are assumed of sensors, see ``accuracy.ACCURACY_WIDTH``."""


def nothing() -> tuple[Floats, Floats]:
    """Return no tracks yet, and the pose of an ego that drives straight on."""
    pose = np.zeros(POSE_WIDTH)
    pose[POSE_SPEED] = EGO_SPEED
    return np.zeros((kept.TRACKS, kept.TRACK_STATE)), pose


def predict(tracks: Floats, pose: Floats, time: float) -> int:
    return predict_tracks(tracks, pose, kept.carried_by(pose, STEP), time, STEP, 0.5)


def update(
    tracks: Floats,
    pose: Floats,
    accuracy: Floats,
    detections: Floats,
    stamp: float,
    age: float = 0.0,
) -> int:
    """Update with a sample of a sensor in the origin; return the end of the tracks."""
    new = sample_of(accuracy, detections, stamp, age)
    return update_tracks(
        tracks, live_end(tracks), pose, kept.carried_by(pose, age), new, 4.0, CONFIRM
    )


def live_end(tracks: Floats) -> int:
    live = np.flatnonzero(tracks[:, kept.TRACK_HITS] > 0.0)
    return int(live[-1]) + 1 if live.size else 0


def sample(*places: tuple[float, float], rate: float | None = None) -> Floats:
    """Return detections of cars at places."""
    rows = np.zeros((len(places), 7))
    rows[:, :2], rows[:, 4:6] = places, (4.5, 1.8)
    if rate is not None:
        rows[:, [2, 3]] = rate, 1.0
    return rows


def track(
    accuracy: Floats,
    ticks: int,
    *,
    velocity: tuple[float, float] = (10.0, 0.0),
    latency: int = 0,
    noise: float = 0.0,
    with_rate: bool = False,
) -> Floats:
    """Track one object that starts 60 m ahead; return the tracks at the last tick."""
    generator = np.random.Generator(np.random.Philox(2))
    tracks, pose = nothing()
    for tick in range(ticks):
        time = tick * STEP
        predict(tracks, pose, time)
        stamp = time - latency * STEP
        if stamp < 0.0:
            continue
        x = 60.0 + (velocity[0] - EGO_SPEED) * stamp + noise * generator.standard_normal()
        rate = velocity[0] - EGO_SPEED if with_rate else None
        detection = sample((x, 2.0 + velocity[1] * stamp), rate=rate)
        update(tracks, pose, accuracy, detection, stamp, time - stamp)
    return tracks


def test_two_exact_samples_give_place_and_velocity() -> None:
    first = track(TRUTH, 2)[0]
    assert first[[kept.TRACK_X, kept.TRACK_Y]] == pytest.approx([59.5, 2.0], abs=0.02)
    assert first[[kept.TRACK_VX, kept.TRACK_VY]] == pytest.approx([10.0, 0.0], abs=0.3)
    assert track(TRUTH, 3)[0, kept.TRACK_HITS] == 3.0


def test_latency_does_not_bias_place_or_velocity_and_loses_no_object() -> None:
    late = track(TRUTH, 40, latency=3)[0]
    assert late[kept.TRACK_X] == pytest.approx(60.0 - 10.0 * 39 * STEP, abs=0.02)
    assert late[kept.TRACK_VX] == pytest.approx(10.0, abs=0.05)
    for latency in (6, 12, 20):
        assert track(TRUTH, 60, latency=latency)[0][kept.TRACK_HITS] >= 3.0, latency


def test_range_rate_gives_the_velocity_at_once() -> None:
    slow, quick = track(CAMERA, 1)[0], track(RADAR, 1, with_rate=True)[0]
    assert quick[kept.TRACK_VX] == pytest.approx(10.0, abs=0.2)
    assert quick[kept.TRACK_VAR_VX] < 1.0 < slow[kept.TRACK_VAR_VX]


def test_crossing_object_is_tracked_across() -> None:
    crossing = track(TRUTH, 20, velocity=(0.0, -1.5))[0]
    assert crossing[kept.TRACK_VY] == pytest.approx(-1.5, abs=0.1)
    assert crossing[kept.TRACK_VX] == pytest.approx(0.0, abs=0.2)


def test_noisy_object_makes_one_track_that_ends_within_its_own_uncertainty() -> None:
    tracks = track(CAMERA, 80, noise=1.0)
    assert abs(tracks[0, kept.TRACK_VX] - 10.0) < 3.0 * np.sqrt(tracks[0, kept.TRACK_VAR_VX])
    assert (tracks[:, kept.TRACK_HITS] > 0.0).sum() == 1


def test_braking_of_an_object_is_found_by_exact_sensors_only() -> None:
    def braking_seen_by(accuracy: Floats) -> float:
        tracks, pose = nothing()
        for tick in range(40):
            time = tick * STEP
            predict(tracks, pose, time)
            x = 60.0 + (20.0 - EGO_SPEED) * time - 3.0 * time * time
            update(tracks, pose, accuracy, sample((x, 0.0)), time)
        return float(tracks[0, kept.TRACK_BRAKING])

    assert braking_seen_by(TRUTH) == pytest.approx(-6.0, abs=0.5)
    assert braking_seen_by(CAMERA) == 0.0


def test_unseen_track_coasts_and_is_then_forgotten() -> None:
    tracks, (_, pose) = track(TRUTH, 10), nothing()
    last = 9 * STEP
    for tick in range(10, 20):
        predict(tracks, pose, tick * STEP)
    assert tracks[0, kept.TRACK_HITS] > 0.0
    assert tracks[0, kept.TRACK_X] == pytest.approx(60.0 - 10.0 * (last + 0.5), abs=0.3)
    predict(tracks, pose, 20 * STEP)
    assert tracks[0, kept.TRACK_HITS] == 0.0


def test_object_too_near_to_be_seen_is_kept_while_the_ego_is_slow() -> None:
    tracks, (_, pose) = track(TRUTH, 10), nothing()
    tracks[0, [kept.TRACK_X, kept.TRACK_Y, kept.TRACK_VX]] = 5.0, 0.0, 0.2
    pose[POSE_SPEED] = 0.0
    for tick in range(10, 100):
        predict(tracks, pose, tick * STEP)
    assert tracks[0, kept.TRACK_HITS] > 0.0
    assert tracks[0, kept.TRACK_X] == pytest.approx(5.0, abs=0.15)
    assert tracks[0, kept.TRACK_VAR_VX] <= 1.0
    pose[POSE_SPEED] = 5.0
    predict(tracks, pose, 100 * STEP)
    assert tracks[0, kept.TRACK_HITS] == 0.0


def test_tentative_track_is_dropped_sooner_than_a_confirmed_one() -> None:
    tracks = track(TRUTH, 2)
    drop_tentative(tracks, 1, 1 * STEP + 0.25, 3.0)
    assert tracks[0, kept.TRACK_HITS] == 2.0
    confirmed = tracks.copy()
    drop_tentative(tracks, 1, 1 * STEP + 0.3, 3.0)
    drop_tentative(confirmed, 1, 1 * STEP + 0.3, 2.0)
    assert (tracks[0, kept.TRACK_HITS], confirmed[0, kept.TRACK_HITS]) == (0.0, 2.0)


def test_detection_that_is_no_number_or_none_at_all_makes_no_track() -> None:
    tracks, pose = nothing()
    assert update(tracks, pose, TRUTH, sample((np.nan, 0.0)), 0.0) == 0
    assert (tracks[:, kept.TRACK_HITS] == 0.0).all()
    new = sample_of(TRUTH, sample((30.0, 0.0), (60.0, 0.0)), 0.0, mask=np.array([False, True]))
    assert update_tracks(tracks, 0, pose, kept.carried_by(pose, 0.0), new, 4.0, CONFIRM) == 1
    assert tracks[0, kept.TRACK_X] == pytest.approx(60.0)


def test_length_that_turns_out_to_be_another_is_no_motion() -> None:
    # A truck whose rear stands still relative to the ego, taken for a car until its side is seen.
    tracks, pose = nothing()
    row = np.zeros((1, 7))
    row[0, [0, 4, 5]] = (20.0, 0.0, 2.5)
    speeds = []
    for tick in range(40):
        if tick == 20:
            row[0, [0, 4]] = (26.0, 12.0)
        predict(tracks, pose, STEP * tick)
        update(tracks, pose, LIDAR, row, STEP * tick)
        speeds.append(tracks[0, kept.TRACK_VX])
    assert tracks[0, kept.TRACK_X] == pytest.approx(26.0, abs=0.05)
    assert speeds[19:] == pytest.approx([EGO_SPEED] * 21, abs=0.05)
    assert np.count_nonzero(tracks[:, kept.TRACK_HITS]) == 1


def test_end_of_the_tracks_is_behind_the_last_live_one_and_a_new_one_fills_a_hole() -> None:
    tracks, pose = nothing()
    assert update(tracks, pose, TRUTH, sample((30.0, 0.0), (60.0, 0.0)), 0.0) == 2
    # A track that is gone leaves a hole, which the end does not count.
    tracks[0, kept.TRACK_HITS] = 0.0
    assert predict(tracks.copy(), pose, STEP) == 2
    filled = tracks.copy()
    assert update(filled, pose, TRUTH, sample((10.0, 0.0)), 0.0) == 2
    assert filled[0, kept.TRACK_X] == pytest.approx(10.0)
    tracks[1, kept.TRACK_HITS] = 0.0
    assert predict(tracks, pose, STEP) == 0


def test_nearer_objects_take_the_places_of_the_farthest() -> None:
    tracks, pose = nothing()
    far = sample(*((50.0 + 10.0 * row, 0.0) for row in range(kept.TRACKS)))
    update(tracks, pose, TRUTH, far, 0.0)
    near = sample((10.0, 0.0), (20.0, 0.0), (300.0, 0.0))
    assert update(tracks, pose, TRUTH, near, 0.0) == kept.TRACKS
    places = tracks[:, kept.TRACK_X].tolist()
    assert places == pytest.approx([50.0, 60.0, 70.0, 80.0, 90.0, 100.0, 20.0, 10.0])


@pytest.mark.parametrize("latency", [0, 3])
@pytest.mark.parametrize("with_rate", [False, True])
def test_what_stands_beside_a_bend_has_no_speed(latency: int, *, with_rate: bool) -> None:
    """The ego turns about a centre; its box centre is ahead of the rear axle, the sensor aside."""
    speed, turning, rear = 8.0, 0.3, 1.45
    radius = speed / turning
    tracks, pose = nothing()
    pose[POSE_SPEED], pose[POSE_YAW_RATE], pose[POSE_REAR] = speed, turning, rear

    def seen(time: float) -> Any:
        """Place in the vehicle frame of what stands at (20, 3) as the turn begins."""
        turn = turning * time
        x = 20.0 - radius * math.sin(turn) - rear * math.cos(turn)
        y = 3.0 - radius * (1.0 - math.cos(turn)) - rear * math.sin(turn)
        c, s = math.cos(turn), math.sin(turn)
        return np.array([c * x + s * y, c * y - s * x])

    for tick in range(40):
        time = tick * STEP
        predict(tracks, pose, time)
        stamp = time - latency * STEP
        if stamp < 0.0:
            continue
        before, after = (np.hypot(*seen(stamp + late)) for late in (-1e-4, 1e-4))
        detection = sample(seen(stamp), rate=(after - before) / 2e-4 if with_rate else None)
        update(tracks, pose, RADAR if with_rate else TRUTH, detection, stamp, time - stamp)
    assert np.hypot(tracks[0, kept.TRACK_VX], tracks[0, kept.TRACK_VY]) < 0.02
