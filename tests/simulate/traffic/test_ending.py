"""Runs end at contact, after horizon and tail, or a tail after the goal."""

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.signals import Ints
from adeye.simulate.traffic.stage import Ending

NOTHING: Ints = np.array([-1], dtype=np.int64)


def end(
    goal: float = np.inf, *, horizon: float = 1.0, tail: float = 0.5, road: float = 1000.0
) -> Ending:
    length = np.array([road])
    return Ending(step=0.1, horizon=horizon, tail=tail, goal=np.array([goal]), road_length=length)


def drive(ending: Ending, speed: float = 10.0, contact_at: int = 10_000) -> int:
    """Return the tick at which the run ends; it drives past s = 0 at tick 0."""
    tick = 0
    while True:
        touched = np.array([0 if tick >= contact_at else -1], dtype=np.int64)
        ending.update(tick, np.array([speed * 0.1 * tick]), touched)
        if not ending.running[0]:
            return tick
        tick += 1


def test_a_run_without_goal_ends_after_horizon_and_tail() -> None:
    ending = end()
    assert drive(ending) == 15
    assert ending.horizon_row.tolist() == [10]
    assert ending.complete.tolist() == [True]
    assert ending.arrived.tolist() == [False]


def test_a_run_that_reaches_its_goal_ends_a_tail_later() -> None:
    ending = end(goal=4.0)
    assert drive(ending) == 9
    assert ending.horizon_row.tolist() == [4]
    assert ending.complete.tolist() == [True]
    assert ending.arrived.tolist() == [True]


def test_a_goal_that_is_reached_in_the_tail_changes_nothing() -> None:
    ending = end(goal=12.0)
    assert drive(ending) == 15
    assert ending.horizon_row.tolist() == [10]
    assert ending.arrived.tolist() == [False]


def test_contact_ends_a_run_at_once_and_it_is_not_complete() -> None:
    ending = end()
    assert drive(ending, contact_at=6) == 6
    assert ending.horizon_row.tolist() == [6]
    assert ending.complete.tolist() == [False]
    assert ending.ended.tolist() == [True]


def test_contact_in_the_tail_keeps_the_row_of_the_goal() -> None:
    ending = end(goal=4.0)
    assert drive(ending, contact_at=7) == 7
    assert ending.horizon_row.tolist() == [4]
    assert ending.complete.tolist() == [False]


def test_without_a_tail_the_goal_ends_the_run_at_once() -> None:
    assert drive(end(goal=4.0, tail=0.0)) == 4


def test_initial_contact_ends_the_run_before_it_begins() -> None:
    ending = end()
    assert drive(ending, contact_at=0) == 0
    assert ending.horizon_row.tolist() == [0]


def test_the_end_of_the_road_ends_a_run_whose_last_row_on_it_counts() -> None:
    ending = end(road=4.5)
    assert drive(ending) == 5
    assert ending.horizon_row.tolist() == [4]
    assert ending.complete.tolist() == [False]
    on_it = end(road=5.0)
    assert drive(on_it) == 6


def test_the_begin_of_the_road_is_an_end_too() -> None:
    ending = end()
    assert drive(ending, speed=-10.0) == 1
    assert ending.horizon_row.tolist() == [0]


def test_what_happens_first_ends_the_run() -> None:
    assert drive(end(road=4.5), contact_at=3) == 3
    assert drive(end(road=4.5, goal=4.0, tail=0.0)) == 4
    arrived = end(road=4.5, goal=3.0)
    assert drive(arrived) == 5
    assert arrived.horizon_row.tolist() == [3]
    assert arrived.complete.tolist() == [False]


def test_an_unknown_place_is_no_end_of_the_road() -> None:
    ending = end()
    ending.update(0, np.array([np.nan]), NOTHING)
    assert ending.running.tolist() == [True]


def test_a_run_that_has_ended_stays_ended() -> None:
    ending = end()
    drive(ending, contact_at=6)
    ending.update(7, np.array([0.0]), NOTHING)
    assert ending.running.tolist() == [False]
    assert ending.complete.tolist() == [False]


def test_runs_of_a_batch_end_one_by_one() -> None:
    length = np.full(2, 1000.0)
    goal = np.array([3.0, np.inf])
    ending = Ending(step=0.1, horizon=1.0, tail=0.0, goal=goal, road_length=length)
    seen = []
    for tick in range(11):
        ending.update(tick, np.full(2, float(tick)), np.full(2, -1))
        seen.append(ending.running.tolist())
    assert seen[2:4] == [[True, True], [False, True]]
    assert seen[-1] == [False, False]
    assert ending.horizon_row.tolist() == [3, 10]


def test_a_horizon_between_two_ticks_is_refused() -> None:
    with pytest.raises(SpecError, match=r"horizon: 0\.25 s is no whole number of steps"):
        end(horizon=0.25)
