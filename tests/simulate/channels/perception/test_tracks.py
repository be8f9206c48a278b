"""Tracks: which detection belongs to which, what it teaches, and how objects are followed."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import Floats
from adeye.simulate.channels.perception import tracks as kept
from adeye.simulate.channels.perception.pose import POSE_REAR, POSE_SPEED, POSE_WIDTH, POSE_YAW_RATE
from adeye.simulate.channels.perception.tracking import (
    drop_tentative,
    predict_tracks,
    update_tracks,
)
from tests.simulate.channels.perceived import sample_of

GATE = 4.0
ORIGIN = (0.0, 0.0, 0.0, 0.0)


def tracks_at(*places: tuple[float, float], kind: float = 0.0) -> signals.Floats:
    tracks = np.zeros((kept.TRACKS, kept.TRACK_STATE))
    for row, (x, y) in enumerate(places):
        tracks[row, [kept.TRACK_X, kept.TRACK_Y]] = x, y
        tracks[row, [kept.TRACK_CLASS, kept.TRACK_HITS]] = kind, 3.0
    return tracks


def owners(tracks: signals.Floats, *places: tuple[float, float], kind: float = 0.0) -> list[int]:
    detections = np.zeros((len(places), 7))
    detections[:, signals.DETECTION_LENGTH] = 4.5
    detections[:, 6] = kind
    return owners_of(tracks, detections, places)


def owners_of(
    tracks: signals.Floats,
    detections: signals.Floats,
    places: Sequence[tuple[float, float]],
    turning: tuple[float, float, float, float] = ORIGIN,
) -> list[int]:
    """Return the track of each detection."""
    owner = np.full(len(places), kept.FREE, dtype=np.int64)
    at = np.array(places)
    offers = kept.Offers(detections, at, owner, len(places), 0.0, GATE, turning)
    kept.associate(tracks, kept.TRACKS, offers)
    found: list[int] = owner.tolist()
    return found


def test_standing_point_comes_nearer_and_turns_as_the_ego_moves() -> None:
    pose = np.zeros(POSE_WIDTH)
    pose[POSE_SPEED] = 20.0
    assert kept.carry_by(kept.carried_by(pose, 0.1), 50.0, 2.0) == pytest.approx((48.0, 2.0))
    pose[[POSE_SPEED, POSE_YAW_RATE]] = 0.0, np.pi / 2.0
    assert kept.carry_by(kept.carried_by(pose, 1.0), 10.0, 0.0) == pytest.approx(
        (0.0, -10.0), abs=1e-9
    )


def test_nearest_pair_is_joined_first_and_no_track_is_shared() -> None:
    # The second detection is near both tracks, the first one only near the first track.
    assert owners(tracks_at((20.0, 0.0), (22.0, 0.0)), (19.0, 0.0), (21.9, 0.0)) == [0, 1]
    assert sorted(owners(tracks_at((20.0, 0.0)), (20.5, 0.0), (20.1, 0.0))) == [-1, 0]
    # The middle one is nearest to both, and nearer to the first; the third takes what is left.
    three = tracks_at((18.0, 0.0), (20.0, 0.0), (22.5, 0.0))
    assert owners(three, (20.1, 0.0), (20.5, 0.0)) == [1, 2]
    # Competition takes nothing from a track that was served before it.
    served = tracks_at((60.0, 0.0), (20.0, 0.0), (22.0, 0.0))
    assert owners(served, (21.9, 0.0), (60.0, 0.0)) == [2, 0]


def test_gate_is_an_ellipse_that_is_longer_along_the_line_of_sight() -> None:
    for track, place, fits in (
        ((5.0, 0.0), (5.0, 4.1), False),
        ((5.0, 0.0), (5.0, 3.9), True),
        ((100.0, 0.0), (110.0, 0.0), True),
        ((100.0, 0.0), (100.0, 5.0), False),
        # 3.2 m along a gate of 4.4 m and 3.2 m across one of 4 m: 0.53 + 0.64.
        ((5.0, 0.0), (8.2, 3.2), False),
        ((5.0, 0.0), (7.9, 2.7), True),
        ((20.0, 0.0), (np.nan, 0.0), False),
    ):
        assert owners(tracks_at(track), place) == [0 if fits else kept.FREE], (track, place)


def test_other_class_does_not_fit_and_an_unknown_one_does() -> None:
    assert owners(tracks_at((20.0, 0.0), kind=6.0), (20.0, 0.0), kind=0.0) == [-1]
    assert owners(tracks_at((20.0, 0.0), kind=6.0), (20.0, 0.0), kind=-1.0) == [0]


def test_range_rate_tells_as_much_of_a_track_beside_as_of_one_ahead() -> None:
    fits = []
    for place, velocity in (
        ((20.0, 0.0), kept.TRACK_VAR_VX),
        ((0.0, 20.0), kept.TRACK_VAR_VY),
        ((0.0, -20.0), kept.TRACK_VAR_VY),
    ):
        tracks = tracks_at(place)
        tracks[0, velocity] = 4.0
        detections = np.zeros((1, 7))
        detections[:, [signals.DETECTION_LENGTH, signals.DETECTION_HAS_RANGE_RATE]] = 4.5, 1.0
        found = []
        for rate in np.arange(0.25, 20.0, 0.5):
            detections[:, signals.DETECTION_RANGE_RATE] = rate
            found += owners_of(tracks, detections, [place])
        fits.append(found)
    assert fits[0] == fits[1] == fits[2]
    assert {*fits[0]} == {0, kept.FREE}


def test_row_without_a_detection_belongs_to_nobody() -> None:
    places = np.array([[20.0, 0.0], [21.0, 0.0]])
    owner = np.array([kept.BLOCKED, kept.FREE])
    offers = kept.Offers(np.zeros((2, 7)), places, owner, 2, 0.0, GATE, ORIGIN)
    kept.associate(tracks_at((20.0, 0.0)), kept.TRACKS, offers)
    assert owner.tolist() == [kept.BLOCKED, 0]


def test_track_begins_where_something_can_come_into_the_path() -> None:
    for place in ((-10.0, 0.0), (60.0, 40.0), (-60.0, 3.5, 100.0)):
        assert kept.may_begin(*place)
    for place in ((-30.0, 0.0), (10.0, 40.0), (-60.0, 3.5)):
        assert not kept.may_begin(*place)


def test_face_of_a_truck_fits_its_track_though_its_centre_is_far() -> None:
    tracks = tracks_at((20.0, 0.0))
    tracks[0, kept.TRACK_LENGTH] = 12.0
    # Whoever tells the length has the same face, or another one.
    for place, length, owner in (
        (14.0, 0.0, 0),
        (10.25, 4.5, -1),
        (16.25, 4.5, 0),
        (22.0, 16.0, 0),
    ):
        detections = np.zeros((1, 7))
        detections[:, signals.DETECTION_LENGTH] = length
        assert owners_of(tracks, detections, [(place, 0.0)]) == [owner], (place, length)


def test_centre_lies_half_the_known_or_assumed_length_behind_the_face() -> None:
    for x, length, width, depth in (
        (10.0, 12.0, 0.0, 6.0),
        (-10.0, 12.0, 0.0, -6.0),
        (10.0, 0.0, 0.0, 2.25),
        (10.0, 0.0, 0.6, 0.3),
    ):
        assert kept.behind_face(x, length, width) == pytest.approx(depth)
    # It moves by half of what a box turns out to be longer.
    for x, before, after, moved in (
        (20.0, 4.5, 10.5, 3.0),
        (-20.0, 4.5, 10.5, -3.0),
        (20.0, 4.5, 4.5, 0.0),
        (20.0, 0.0, 4.5, 0.0),
    ):
        assert kept.with_face_kept(x, before, after) == moved


def echo(rate: float, kind: float = -1.0) -> signals.Floats:
    """One detection with a range rate."""
    detections = np.zeros((1, 7))
    detections[0, [signals.DETECTION_LENGTH, signals.DETECTION_RANGE_RATE]] = 4.5, rate
    detections[0, [signals.DETECTION_HAS_RANGE_RATE, signals.DETECTION_CLASS]] = 1.0, kind
    return detections


def test_standing_echo_does_not_update_the_track_of_a_vehicle_that_drives() -> None:
    # The ego drives 30 m/s, the vehicle 20 m/s; -30 m/s is the rate of what stands.
    tracks = tracks_at((40.0, 0.0))
    tracks[0, kept.TRACK_VX], tracks[0, kept.TRACK_VAR_VX] = 20.0, 0.04
    for rate, owner in ((-10.0, 0), (-13.5, 0), (-30.0, kept.FREE)):
        found = owners_of(tracks, echo(rate), [(41.0, 0.0)], (2.0, 0.0, 30.0, 0.0))
        assert found == [owner], rate


def test_echo_without_a_class_must_be_where_the_track_is_sure_to_be() -> None:
    tracks = tracks_at((40.0, 0.0))
    # Unless it is not sure of it.
    for kind, variance, owner in (
        (-1.0, 0.04, kept.FREE),
        (0.0, 0.04, 0),
        (-1.0, 4.0, 0),
        (0.0, 4.0, 0),
    ):
        tracks[0, kept.TRACK_VAR_X] = variance
        assert owners_of(tracks, echo(0.0, kind), [(43.5, 0.0)]) == [owner], (kind, variance)


def part_of_a_car(
    *, hits: float = 50.0, kind: float = -1.0, rate: float = 0.0, y: float = 0.95
) -> bool:
    """Whether what is on the flank of a car 20 m ahead, 2 m before its rear, is a part of it."""
    tracks = tracks_at((20.0, 0.0))
    tracks[0, [kept.TRACK_LENGTH, kept.TRACK_WIDTH]] = 4.5, 1.8
    tracks[0, [kept.TRACK_HITS, kept.TRACK_VX]] = hits, 10.0
    detection = np.zeros(7)
    detection[[signals.DETECTION_CLASS, signals.DETECTION_HAS_RANGE_RATE]] = kind, rate
    # A tenth of a second ago the car was a metre behind.
    return bool(kept.is_part(tracks, 1, detection, 17.5, y, 0.1))


def test_piece_of_a_flank_is_no_object_of_its_own() -> None:
    assert part_of_a_car()
    # What has a class or a range rate or stands aside is one; so is all on a new track.
    assert not part_of_a_car(kind=7.0)
    assert not part_of_a_car(rate=1.0)
    assert not part_of_a_car(y=1.3)
    assert not part_of_a_car(hits=3.0)


# m of n: which detections confirm a track.


def hits_after(pattern: str, *, hits: int = 3, window: int = 5, sensor: float = 0.0) -> float:
    """Hits of a track after samples that show it (x) or not (.), all of one sensor."""
    tracks = np.zeros((kept.TRACKS, kept.TRACK_STATE))
    confirm = (float(hits), float(window), sensor)
    for sample in pattern:
        _sample(tracks, confirm, is_hit=sample == "x")
    return float(tracks[0, kept.TRACK_HITS])


def _sample(tracks: signals.Floats, confirm: tuple[float, float, float], *, is_hit: bool) -> None:
    if is_hit:
        kept.count_hit(tracks[0], confirm)
    kept.count_misses(tracks, 1, confirm)


def test_three_of_five_confirm() -> None:
    for pattern in ("xxx", "x.x.x", "x...xxx", "xxx........"):
        assert hits_after(pattern) >= 3.0, pattern
    for pattern in ("x..x.x", "xx...x", "x.x..x.x"):
        assert hits_after(pattern) < 3.0, pattern


def test_hits_count_while_they_are_remembered_and_go_on_once_confirmed() -> None:
    assert hits_after("x....................xx", window=0) == 3.0
    assert hits_after("x....") == 1.0
    assert hits_after("x.....") == 0.0
    assert hits_after("xxx..x") == 4.0


def test_another_sensor_can_hit_a_track_but_not_miss_it() -> None:
    tracks = np.zeros((kept.TRACKS, kept.TRACK_STATE))
    tracks[0, kept.TRACK_BEGUN_BY] = 1.0
    first, other = (3.0, 3.0, 1.0), (3.0, 3.0, 0.0)
    _sample(tracks, first, is_hit=True)
    for _ in range(10):
        _sample(tracks, other, is_hit=False)
    assert tracks[0, kept.TRACK_HITS] == 1.0
    _sample(tracks, other, is_hit=True)
    _sample(tracks, first, is_hit=True)
    assert tracks[0, kept.TRACK_HITS] == 3.0


# The filter of a track against the textbook, written with matrices.

WEIGHTS = (0.8, -0.16, 0.6, -0.12)
GENERATOR = np.random.Generator(np.random.Philox(3))


def belief_of(mean: signals.Floats, p: signals.Floats) -> kept.Belief:
    return (
        tuple(mean),
        tuple(np.diag(p)),
        (p[0, 1], p[0, 2], p[0, 3]),
        (p[1, 2], p[1, 3], p[2, 3]),
    )


def matrices(belief: kept.Belief) -> tuple[signals.Floats, signals.Floats]:
    """Return mean (4,) and covariance (4, 4) of x, vx, y, vy."""
    p = np.diag(np.array(belief[1]))
    p[0, 1:], p[1, 2:], p[2, 3:] = belief[2], belief[3][:2], belief[3][2]
    return np.array(belief[0]), np.triu(p) + np.triu(p, 1).T


def some_belief() -> kept.Belief:
    root = GENERATOR.standard_normal((4, 4))
    return belief_of(10.0 * GENERATOR.standard_normal(4), root @ root.T + np.eye(4))


def as_track(belief: kept.Belief) -> signals.Floats:
    track = np.zeros(kept.TRACK_STATE)
    kept.write_belief(track, belief)
    return track


def test_number_is_taken_in_as_by_a_kalman_filter() -> None:
    belief = some_belief()
    mean, p = matrices(belief)
    h = np.array(WEIGHTS)
    gain = p @ h / (h @ p @ h + 0.3)
    got_mean, got_p = matrices(kept.learn(belief, WEIGHTS, 2.5, 0.3))
    assert got_mean == pytest.approx(mean + gain * (2.5 - h @ mean))
    assert got_p == pytest.approx(p - np.outer(gain, h @ p))


def test_uncertainty_grows_by_white_acceleration() -> None:
    belief, period = some_belief(), 0.05
    _, p = matrices(belief)
    axis = np.array([[1.0, period], [0.0, 1.0]])
    noise = np.array([[period**3 / 3.0, period**2 / 2.0], [period**2 / 2.0, period]])
    step = np.kron(np.eye(2), axis)
    track = as_track(belief)
    kept.grow(track, period)
    wanted = step @ p @ step.T + np.kron(np.diag([kept.FREEDOM_X, kept.FREEDOM_Y]), noise)
    assert matrices(kept.read_belief(track))[1] == pytest.approx(wanted)


def test_order_of_two_numbers_does_not_matter() -> None:
    belief, other = some_belief(), (0.0, 0.9, 0.0, -0.4)
    one = kept.learn(kept.learn(belief, WEIGHTS, 1.0, 0.2), other, 3.0, 0.5)
    two = kept.learn(kept.learn(belief, other, 3.0, 0.5), WEIGHTS, 1.0, 0.2)
    for first, second in zip(matrices(one), matrices(two), strict=True):
        assert first == pytest.approx(second)


def test_no_number_makes_anything_less_sure_and_what_is_written_is_read() -> None:
    belief: Any = some_belief()
    assert kept.read_belief(as_track(belief)) == belief
    after = kept.learn(belief, WEIGHTS, 1.0, 0.2)
    assert all(new <= old for new, old in zip(after[1], belief[1], strict=True))


def test_covariance_stays_one_over_many_samples() -> None:
    track = as_track(belief_of(np.zeros(4), np.diag([1e4, 225.0, 1e4, 25.0])))
    for _ in range(2000):
        kept.grow(track, 0.05)
        belief = kept.read_belief(track)
        for weights, noise in ((WEIGHTS, 4e-4), ((0.0, 0.8, 0.0, 0.6), 2.5e-3)):
            belief = kept.learn(belief, weights, 0.0, noise)
        kept.write_belief(track, belief)
        assert np.linalg.eigvalsh(matrices(belief)[1]).min() > 0.0


def test_range_rates_along_one_line_do_not_tell_the_speed_across_it() -> None:
    # However many there are: an object that drives aside by 2 m/s on a line 11 degrees off.
    line = np.array([0.98, -0.199])
    belief = belief_of(np.array([15.0, 15.0, -3.0, 0.0]), np.diag([0.1, 100.0, 0.1, 4.0]))
    for _ in range(500):
        belief = kept.learn(belief, (0.0, line[0], 0.0, line[1]), float(line @ [15.0, 2.0]), 0.01)
    mean, p = matrices(belief)
    across = np.array([0.0, -line[1], 0.0, line[0]])
    error = across @ (mean - [15.0, 15.0, -3.0, 2.0])
    assert abs(error) < 2.0 * np.sqrt(across @ p @ across)
    assert p[3, 3] > 3.0


def test_forgotten_motion_stands_with_one_uncertainty_and_ties_to_nothing() -> None:
    track = as_track(some_belief())
    place = track[kept.TRACK_X]
    kept.forget_motion(track, 1.0)
    mean, p = matrices(kept.read_belief(track))
    assert (mean[0], mean[1], track[kept.TRACK_VY]) == (place, 0.0, 0.0)
    assert (track[kept.TRACK_VAR_VX], track[kept.TRACK_VAR_VY]) == (1.0, 1.0)
    p[np.ix_([0, 2], [0, 2])] = np.eye(2)
    assert np.array_equal(p, np.eye(4))


# --- Objects followed through the readings of several sensors, late and in any order --------------

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
    motion = kept.carried_by(pose, age)
    # A default would be looked up anew at every call.
    return update_tracks(tracks, live_end(tracks), pose, motion, new, 4.0, CONFIRM, kept.BEHIND)


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
    motion = kept.carried_by(pose, 0.0)
    assert update_tracks(tracks, 0, pose, motion, new, 4.0, CONFIRM, kept.BEHIND) == 1
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
