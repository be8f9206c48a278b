"""The filter of a track against the textbook, written with matrices."""

from typing import Any

import numpy as np
import pytest

from adeye.signals import Floats
from adeye.simulate.channels.perception.tracks import (
    FREEDOM_X,
    FREEDOM_Y,
    TRACK_STATE,
    TRACK_VAR_VX,
    TRACK_VAR_VY,
    TRACK_VY,
    TRACK_X,
    Belief,
    forget_motion,
    grow,
    learn,
    read_belief,
    write_belief,
)

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
