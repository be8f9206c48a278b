"""The compiled steps of tracking: which detection belongs to which track, and what it teaches."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    Floats,
)
from adeye.simulate.channels.perception import tracking as kept
from adeye.simulate.channels.perception.pose import POSE_SPEED, POSE_WIDTH, POSE_YAW_RATE

GATE = 4.0
ORIGIN = (0.0, 0.0, 0.0, 0.0)


def tracks_at(*places: tuple[float, float], kind: float = 0.0) -> Floats:
    tracks = np.zeros((kept.TRACKS, kept.TRACK_STATE))
    for row, (x, y) in enumerate(places):
        tracks[row, [kept.TRACK_X, kept.TRACK_Y]] = x, y
        tracks[row, [kept.TRACK_CLASS, kept.TRACK_HITS]] = kind, 3.0
    return tracks


def owners(tracks: Floats, *places: tuple[float, float], kind: float = 0.0) -> list[int]:
    detections = np.zeros((len(places), 7))
    detections[:, DETECTION_LENGTH] = 4.5
    detections[:, 6] = kind
    return owners_of(tracks, detections, places)


def owners_of(
    tracks: Floats,
    detections: Floats,
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


def test_row_without_a_detection_belongs_to_nobody() -> None:
    places = np.array([[20.0, 0.0], [21.0, 0.0]])
    owner = np.array([kept.BLOCKED, kept.FREE])
    offers = kept.Offers(np.zeros((2, 7)), places, owner, 2, 0.0, GATE, ORIGIN)
    kept.associate(tracks_at((20.0, 0.0)), kept.TRACKS, offers)
    assert owner.tolist() == [kept.BLOCKED, 0]


def test_new_track_takes_a_free_place_or_that_of_the_farthest() -> None:
    assert kept.room_for_track(tracks_at((20.0, 0.0))) == (1, np.inf)
    full = tracks_at(*[(20.0 + 5.0 * row, 0.0) for row in range(kept.TRACKS)])
    assert kept.room_for_track(full) == (kept.TRACKS - 1, 55.0**2)


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
        detections[:, DETECTION_LENGTH] = length
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


def echo(rate: float, kind: float = -1.0) -> Floats:
    """One detection with a range rate."""
    detections = np.zeros((1, 7))
    detections[0, [DETECTION_LENGTH, DETECTION_RANGE_RATE]] = 4.5, rate
    detections[0, [DETECTION_HAS_RANGE_RATE, DETECTION_CLASS]] = 1.0, kind
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
    detection[[DETECTION_CLASS, DETECTION_HAS_RANGE_RATE]] = kind, rate
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


def _sample(tracks: Floats, confirm: tuple[float, float, float], *, is_hit: bool) -> None:
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


def belief_of(mean: Floats, p: Floats) -> kept.Belief:
    return (
        tuple(mean),
        tuple(np.diag(p)),
        (p[0, 1], p[0, 2], p[0, 3]),
        (p[1, 2], p[1, 3], p[2, 3]),
    )


def matrices(belief: kept.Belief) -> tuple[Floats, Floats]:
    """Return mean (4,) and covariance (4, 4) of x, vx, y, vy."""
    p = np.diag(np.array(belief[1]))
    p[0, 1:], p[1, 2:], p[2, 3:] = belief[2], belief[3][:2], belief[3][2]
    return np.array(belief[0]), np.triu(p) + np.triu(p, 1).T


def some_belief() -> kept.Belief:
    root = GENERATOR.standard_normal((4, 4))
    return belief_of(10.0 * GENERATOR.standard_normal(4), root @ root.T + np.eye(4))


def as_track(belief: kept.Belief) -> Floats:
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


@pytest.mark.slow
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
