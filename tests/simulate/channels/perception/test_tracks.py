from typing import Any

import numpy as np
import pytest

from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    Floats,
    Ints,
)
from adeye.simulate.channels.perception.pose import POSE_SPEED, POSE_WIDTH, POSE_YAW_RATE
from adeye.simulate.channels.perception.tracks import (
    BLOCKED,
    FREE,
    FREEDOM_X,
    FREEDOM_Y,
    TRACK_BEGUN_BY,
    TRACK_CLASS,
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_STATE,
    TRACK_VAR_VX,
    TRACK_VAR_VY,
    TRACK_VAR_X,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
    TRACKS,
    Belief,
    associate,
    behind_face,
    carried_by,
    carry_by,
    count_hit,
    count_misses,
    forget_motion,
    grow,
    is_part,
    learn,
    may_begin,
    read_belief,
    room_for_track,
    with_face_kept,
    write_belief,
)

GATE = 4.0
ORIGIN = (0.0, 0.0, 0.0, 0.0)


def tracks_at(*places: tuple[float, float], kind: float = 0.0) -> Floats:
    tracks = np.zeros((TRACKS, TRACK_STATE))
    for row, (x, y) in enumerate(places):
        tracks[row, [TRACK_X, TRACK_Y, TRACK_CLASS, TRACK_HITS]] = x, y, kind, 3.0
    return tracks


def owners(tracks: Floats, *places: tuple[float, float], kind: float = 0.0) -> Ints:
    owner = np.full(len(places), FREE, dtype=np.int64)
    detections = np.zeros((len(places), 7))
    detections[:, DETECTION_LENGTH] = 4.5
    detections[:, 6] = kind
    associate(tracks, TRACKS, detections, np.array(places), owner, len(places), 0.0, GATE, ORIGIN)
    return owner


def test_standing_point_comes_nearer_by_the_way_of_the_ego() -> None:
    pose = np.zeros(POSE_WIDTH)
    pose[POSE_SPEED] = 20.0
    assert carry_by(carried_by(pose, 0.1), 50.0, 2.0) == pytest.approx((48.0, 2.0))


def test_point_turns_away_from_a_turning_ego() -> None:
    pose = np.zeros(POSE_WIDTH)
    pose[POSE_YAW_RATE] = np.pi / 2.0
    assert carry_by(carried_by(pose, 1.0), 10.0, 0.0) == pytest.approx((0.0, -10.0), abs=1e-9)


def test_nearest_pair_is_joined_first() -> None:
    # The second detection is near both tracks, the first one only near the first track.
    assert owners(tracks_at((20.0, 0.0), (22.0, 0.0)), (19.0, 0.0), (21.9, 0.0)).tolist() == [0, 1]


def test_two_detections_never_share_a_track() -> None:
    assert sorted(owners(tracks_at((20.0, 0.0)), (20.5, 0.0), (20.1, 0.0)).tolist()) == [-1, 0]


def test_detection_outside_the_gate_fits_no_track() -> None:
    assert owners(tracks_at((5.0, 0.0)), (5.0, 4.1)).tolist() == [-1]
    assert owners(tracks_at((5.0, 0.0)), (5.0, 3.9)).tolist() == [0]


@pytest.mark.slow
def test_gate_is_longer_along_the_line_of_sight() -> None:
    assert owners(tracks_at((100.0, 0.0)), (110.0, 0.0)).tolist() == [0]
    assert owners(tracks_at((100.0, 0.0)), (100.0, 5.0)).tolist() == [-1]


def test_other_class_does_not_fit_and_an_unknown_one_does() -> None:
    assert owners(tracks_at((20.0, 0.0), kind=6.0), (20.0, 0.0), kind=0.0).tolist() == [-1]
    assert owners(tracks_at((20.0, 0.0), kind=6.0), (20.0, 0.0), kind=-1.0).tolist() == [0]


def test_detection_that_is_no_number_fits_nothing() -> None:
    assert owners(tracks_at((20.0, 0.0)), (np.nan, 0.0)).tolist() == [-1]


def test_gate_is_an_ellipse_not_its_box() -> None:
    # 3.2 m along a gate of 4.4 m and 3.2 m across one of 4 m: 0.53 + 0.64.
    assert owners(tracks_at((5.0, 0.0)), (8.2, 3.2)).tolist() == [-1]
    assert owners(tracks_at((5.0, 0.0)), (7.9, 2.7)).tolist() == [0]


def test_three_tracks_compete_for_two_detections() -> None:
    # The middle one is nearest to both, and nearer to the first; the third takes what is left.
    tracks = tracks_at((18.0, 0.0), (20.0, 0.0), (22.5, 0.0))
    assert owners(tracks, (20.1, 0.0), (20.5, 0.0)).tolist() == [1, 2]


def test_competition_takes_nothing_from_a_track_that_was_served_before_it() -> None:
    tracks = tracks_at((60.0, 0.0), (20.0, 0.0), (22.0, 0.0))
    assert owners(tracks, (21.9, 0.0), (60.0, 0.0)).tolist() == [2, 0]


def test_row_without_a_detection_belongs_to_nobody() -> None:
    places = np.array([[20.0, 0.0], [21.0, 0.0]])
    owner = np.array([BLOCKED, FREE])
    associate(tracks_at((20.0, 0.0)), TRACKS, np.zeros((2, 7)), places, owner, 2, 0.0, GATE, ORIGIN)
    assert owner.tolist() == [BLOCKED, 0]


def test_new_track_takes_a_free_place_or_that_of_the_farthest() -> None:
    assert room_for_track(tracks_at((20.0, 0.0))) == (1, np.inf)
    full = tracks_at(*[(20.0 + 5.0 * row, 0.0) for row in range(TRACKS)])
    assert room_for_track(full) == (TRACKS - 1, 55.0**2)


@pytest.mark.parametrize("place", [(-30.0, 0.0), (10.0, 40.0)])
def test_no_track_begins_where_nothing_can_come_into_the_path(place: tuple[float, float]) -> None:
    assert not may_begin(*place)


def test_track_begins_further_behind_where_a_channel_looks_back() -> None:
    assert may_begin(-60.0, 3.5, 100.0)
    assert not may_begin(-60.0, 3.5)


@pytest.mark.parametrize("place", [(-10.0, 0.0), (60.0, 40.0)])
def test_track_begins_beside_and_far_ahead(place: tuple[float, float]) -> None:
    assert may_begin(*place)


def test_face_of_a_truck_fits_its_track_though_its_centre_is_far() -> None:
    tracks = tracks_at((20.0, 0.0))
    tracks[0, TRACK_LENGTH] = 12.0
    places = np.array([[14.0, 0.0]])
    detections = np.zeros((1, 7))
    owner = np.full(1, FREE, dtype=np.int64)
    associate(tracks, TRACKS, detections, places, owner, 1, 0.0, GATE, ORIGIN)
    assert owner.tolist() == [0]
    # Whoever tells the length has the same face, or another one.
    for place, length, expected in ((10.25, 4.5, FREE), (16.25, 4.5, 0), (22.0, 16.0, 0)):
        places[0, 0], detections[:, DETECTION_LENGTH], owner[:] = place, length, FREE
        associate(tracks, TRACKS, detections, places, owner, 1, 0.0, GATE, ORIGIN)
        assert owner.tolist() == [expected], (place, length)


def test_centre_moves_by_half_of_what_a_box_is_longer_away_from_its_face() -> None:
    assert with_face_kept(20.0, 4.5, 10.5) == 3.0
    assert with_face_kept(-20.0, 4.5, 10.5) == -3.0
    assert with_face_kept(20.0, 4.5, 4.5) == 0.0
    assert with_face_kept(20.0, 0.0, 4.5) == 0.0


@pytest.mark.parametrize(
    ("x", "length", "width", "depth"),
    [
        (10.0, 12.0, 0.0, 6.0),
        (-10.0, 12.0, 0.0, -6.0),
        (10.0, 0.0, 0.0, 2.25),
        (10.0, 0.0, 0.6, 0.3),
    ],
)
def test_centre_lies_half_the_known_or_assumed_length_behind_the_face(
    x: float, length: float, width: float, depth: float
) -> None:
    assert behind_face(x, length, width) == pytest.approx(depth)


def echo(x: float, y: float, rate: float, kind: float = -1.0) -> tuple[Floats, Floats, Ints]:
    """One detection with a range rate: detections, places, owner."""
    detections = np.zeros((1, 7))
    detections[0, [DETECTION_LENGTH, DETECTION_RANGE_RATE]] = 4.5, rate
    detections[0, [DETECTION_HAS_RANGE_RATE, DETECTION_CLASS]] = 1.0, kind
    return detections, np.array([[x, y]]), np.full(1, FREE, dtype=np.int64)


@pytest.mark.parametrize(("rate", "fits"), [(-10.0, True), (-13.5, True), (-30.0, False)])
def test_standing_echo_does_not_update_the_track_of_a_vehicle_that_drives(
    rate: float, *, fits: bool
) -> None:
    # The ego drives 30 m/s, the vehicle 20 m/s; -30 m/s is the rate of what stands.
    tracks = tracks_at((40.0, 0.0))
    tracks[0, TRACK_VX], tracks[0, TRACK_VAR_VX] = 20.0, 0.04
    detections, places, owner = echo(41.0, 0.0, rate)
    associate(tracks, TRACKS, detections, places, owner, 1, 0.0, GATE, (2.0, 0.0, 30.0, 0.0))
    assert bool(owner[0] == 0) is fits


@pytest.mark.parametrize(("kind", "fits"), [(-1.0, False), (0.0, True)])
def test_echo_without_a_class_must_be_where_the_track_is_sure_to_be(
    kind: float, *, fits: bool
) -> None:
    tracks = tracks_at((40.0, 0.0))
    tracks[0, TRACK_VAR_X] = 0.04
    detections, places, owner = echo(43.5, 0.0, 0.0, kind)
    associate(tracks, TRACKS, detections, places, owner, 1, 0.0, GATE, ORIGIN)
    assert bool(owner[0] == 0) is fits
    # Unless it is not sure of it.
    tracks[0, TRACK_VAR_X] = 4.0
    owner[:] = FREE
    associate(tracks, TRACKS, detections, places, owner, 1, 0.0, GATE, ORIGIN)
    assert owner[0] == 0


def part_of_a_car(
    *, hits: float = 50.0, kind: float = -1.0, rate: float = 0.0, y: float = 0.95
) -> bool:
    """Whether what is on the flank of a car 20 m ahead, 2 m before its rear, is a part of it."""
    tracks = tracks_at((20.0, 0.0))
    tracks[0, [TRACK_LENGTH, TRACK_WIDTH, TRACK_HITS, TRACK_VX]] = 4.5, 1.8, hits, 10.0
    detection = np.zeros(7)
    detection[[DETECTION_CLASS, DETECTION_HAS_RANGE_RATE]] = kind, rate
    # A tenth of a second ago the car was a metre behind.
    return bool(is_part(tracks, 1, detection, 17.5, y, 0.1))


def test_piece_of_a_flank_is_no_object_of_its_own() -> None:
    assert part_of_a_car()


def test_what_has_a_class_or_a_range_rate_or_stands_aside_is_one() -> None:
    assert not part_of_a_car(kind=7.0)
    assert not part_of_a_car(rate=1.0)
    assert not part_of_a_car(y=1.3)


def test_body_of_a_new_track_hides_nothing() -> None:
    assert not part_of_a_car(hits=3.0)


# m of n: which detections confirm a track.


def hits_after(pattern: str, *, hits: int = 3, window: int = 5, sensor: float = 0.0) -> float:
    """Hits of a track after samples that show it (x) or not (.), all of one sensor."""
    tracks = np.zeros((TRACKS, TRACK_STATE))
    confirm = (float(hits), float(window), sensor)
    for sample in pattern:
        _sample(tracks, confirm, is_hit=sample == "x")
    return float(tracks[0, TRACK_HITS])


def _sample(tracks: Floats, confirm: tuple[float, float, float], *, is_hit: bool) -> None:
    if is_hit:
        count_hit(tracks[0], confirm)
    count_misses(tracks, 1, confirm)


@pytest.mark.parametrize(
    ("pattern", "confirmed"),
    [
        ("xxx", True),
        ("x.x.x", True),
        ("x..x.x", False),
        ("x...xxx", True),
        ("xx...x", False),
        ("x.x..x.x", False),
        ("xxx........", True),
    ],
)
def test_three_of_five_confirm(pattern: str, *, confirmed: bool) -> None:
    assert (hits_after(pattern) >= 3.0) is confirmed


def test_without_a_window_every_detection_counts() -> None:
    assert hits_after("x....................xx", window=0) == 3.0


def test_track_is_free_when_its_last_hit_is_forgotten() -> None:
    assert hits_after("x....") == 1.0
    assert hits_after("x.....") == 0.0


def test_hits_of_a_confirmed_track_go_on_counting() -> None:
    assert hits_after("xxx..x") == 4.0


def test_another_sensor_can_hit_a_track_but_not_miss_it() -> None:
    tracks = np.zeros((TRACKS, TRACK_STATE))
    tracks[0, TRACK_BEGUN_BY] = 1.0
    first, other = (3.0, 3.0, 1.0), (3.0, 3.0, 0.0)
    _sample(tracks, first, is_hit=True)
    for _ in range(10):
        _sample(tracks, other, is_hit=False)
    assert tracks[0, TRACK_HITS] == 1.0
    _sample(tracks, other, is_hit=True)
    _sample(tracks, first, is_hit=True)
    assert tracks[0, TRACK_HITS] == 3.0


# The filter of a track against the textbook, written with matrices.

WEIGHTS = (0.8, -0.16, 0.6, -0.12)
GENERATOR = np.random.Generator(np.random.Philox(3))


def belief_of(mean: Floats, p: Floats) -> Belief:
    return (
        tuple(mean),
        tuple(np.diag(p)),
        (p[0, 1], p[0, 2], p[0, 3]),
        (p[1, 2], p[1, 3], p[2, 3]),
    )


def matrices(belief: Belief) -> tuple[Floats, Floats]:
    """Return mean (4,) and covariance (4, 4) of x, vx, y, vy."""
    p = np.diag(np.array(belief[1]))
    p[0, 1:], p[1, 2:], p[2, 3:] = belief[2], belief[3][:2], belief[3][2]
    return np.array(belief[0]), np.triu(p) + np.triu(p, 1).T


def some_belief() -> Belief:
    root = GENERATOR.standard_normal((4, 4))
    return belief_of(10.0 * GENERATOR.standard_normal(4), root @ root.T + np.eye(4))


def as_track(belief: Belief) -> Floats:
    track = np.zeros(TRACK_STATE)
    write_belief(track, belief)
    return track


def test_what_is_written_is_read() -> None:
    belief = some_belief()
    assert read_belief(as_track(belief)) == belief


def test_number_is_taken_in_as_by_a_kalman_filter() -> None:
    belief = some_belief()
    mean, p = matrices(belief)
    h = np.array(WEIGHTS)
    gain = p @ h / (h @ p @ h + 0.3)
    got_mean, got_p = matrices(learn(belief, WEIGHTS, 2.5, 0.3))
    assert got_mean == pytest.approx(mean + gain * (2.5 - h @ mean))
    assert got_p == pytest.approx(p - np.outer(gain, h @ p))


def test_uncertainty_grows_by_white_acceleration() -> None:
    belief, period = some_belief(), 0.05
    _, p = matrices(belief)
    axis = np.array([[1.0, period], [0.0, 1.0]])
    noise = np.array([[period**3 / 3.0, period**2 / 2.0], [period**2 / 2.0, period]])
    step = np.kron(np.eye(2), axis)
    track = as_track(belief)
    grow(track, period)
    wanted = step @ p @ step.T + np.kron(np.diag([FREEDOM_X, FREEDOM_Y]), noise)
    assert matrices(read_belief(track))[1] == pytest.approx(wanted)


def test_order_of_two_numbers_does_not_matter() -> None:
    belief, other = some_belief(), (0.0, 0.9, 0.0, -0.4)
    one = learn(learn(belief, WEIGHTS, 1.0, 0.2), other, 3.0, 0.5)
    two = learn(learn(belief, other, 3.0, 0.5), WEIGHTS, 1.0, 0.2)
    for first, second in zip(matrices(one), matrices(two), strict=True):
        assert first == pytest.approx(second)


def test_no_number_makes_anything_less_sure() -> None:
    belief: Any = some_belief()
    after = learn(belief, WEIGHTS, 1.0, 0.2)
    assert all(new <= old for new, old in zip(after[1], belief[1], strict=True))


@pytest.mark.slow
def test_covariance_stays_one_over_many_samples() -> None:
    track = as_track(belief_of(np.zeros(4), np.diag([1e4, 225.0, 1e4, 25.0])))
    for _ in range(2000):
        grow(track, 0.05)
        belief = read_belief(track)
        for weights, noise in ((WEIGHTS, 4e-4), ((0.0, 0.8, 0.0, 0.6), 2.5e-3)):
            belief = learn(belief, weights, 0.0, noise)
        write_belief(track, belief)
        assert np.linalg.eigvalsh(matrices(belief)[1]).min() > 0.0


def test_range_rates_along_one_line_do_not_tell_the_speed_across_it() -> None:
    # However many there are: an object that drives aside by 2 m/s on a line 11 degrees off.
    line = np.array([0.98, -0.199])
    belief = belief_of(np.array([15.0, 15.0, -3.0, 0.0]), np.diag([0.1, 100.0, 0.1, 4.0]))
    for _ in range(500):
        belief = learn(belief, (0.0, line[0], 0.0, line[1]), float(line @ [15.0, 2.0]), 0.01)
    mean, p = matrices(belief)
    across = np.array([0.0, -line[1], 0.0, line[0]])
    error = across @ (mean - [15.0, 15.0, -3.0, 2.0])
    assert abs(error) < 2.0 * np.sqrt(across @ p @ across)
    assert p[3, 3] > 3.0


def test_forgotten_motion_stands_with_one_uncertainty_and_ties_to_nothing() -> None:
    track = as_track(some_belief())
    place = track[TRACK_X]
    forget_motion(track, 1.0)
    mean, p = matrices(read_belief(track))
    assert (mean[0], mean[1], track[TRACK_VY]) == (place, 0.0, 0.0)
    assert (track[TRACK_VAR_VX], track[TRACK_VAR_VY]) == (1.0, 1.0)
    p[np.ix_([0, 2], [0, 2])] = np.eye(2)
    assert np.array_equal(p, np.eye(4))
