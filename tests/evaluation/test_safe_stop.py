from collections.abc import Callable

import numpy as np
import pytest

from adeye.evaluation.safe_stop import achieved_rating, best_rating, rate_run
from adeye.kernel.stop_rating import CONTACT, DEFAULT_RULES
from tests.evaluation.conftest import HandMade

Make = Callable[..., HandMade]
RULES = np.array(DEFAULT_RULES)
SLOW, MIDDLE = 1.75, 5.25


def stopped(make: Make, d: float, *, after: float = 1.0, **arguments: object) -> HandMade:
    """Let the ego stop with 4 m/s² from 20 m/s after a while; the fault begins there."""
    made = make(rows=91, **arguments)
    braking = np.clip(made.time - after, 0.0, 5.0)
    way = 20.0 * np.minimum(made.time, after) + 20.0 * braking - 2.0 * braking * braking
    made.ego(s=way, speed=20.0 - 4.0 * braking, d=d)
    made.set("fault_active", value=True, rows=slice(round(after / made.step), None))
    return made


def test_stop_in_the_slow_lane_beside_a_free_shoulder_is_regretted(hand_made: Make) -> None:
    made = stopped(hand_made, SLOW).object("lead", d=8.75)
    quality = rate_run(made.trace(), 0)
    assert (quality.achieved, quality.best, quality.regret) == (3.0, 3.0, 0.0)
    wide = made.trace()
    wide.layout.context.road.shoulder[:] = 2.5
    quality = rate_run(wide, 0)
    assert (quality.achieved, quality.best, quality.regret) == (3.0, 1.0, 2.0)


def test_shoulder_that_was_blocked_is_not_regretted(hand_made: Make) -> None:
    made = stopped(hand_made, SLOW).object("lead", d=-1.25, s=40.0, speed=0.0, size=(300.0, 2.0))
    trace = made.trace()
    trace.layout.context.road.shoulder[:] = 2.5
    assert rate_run(trace, 0).regret == 0.0


def test_objects_count_where_they_were_at_the_time(hand_made: Make) -> None:
    """A vehicle crosses the place of the shoulder before the ego could have come there."""
    made = stopped(hand_made, SLOW)
    made.object("lead", d=-1.25, speed=40.0, s=0.0 + 40.0 * made.time)
    trace = made.trace()
    trace.layout.context.road.shoulder[:] = 2.5
    assert best_rating(trace, 0, 10, RULES) == 1.0


def test_nothing_reachable_is_rated_as_contact(hand_made: Make) -> None:
    made = stopped(hand_made, MIDDLE, objects=("wall",))
    made.object("wall", d=MIDDLE, s=36.0, speed=0.0, size=(4.0, 40.0))
    assert best_rating(made.trace(), 0, 10, RULES) == CONTACT


def test_follower_in_the_own_lane_does_not_forbid_to_stop(hand_made: Make) -> None:
    made = stopped(hand_made, MIDDLE)
    made.object("lead", d=MIDDLE, s=20.0 * made.time - 10.0)
    # The lane to the right is free.
    assert best_rating(made.trace(), 0, 10, RULES) == 3.0


def test_who_drives_on_or_has_no_fault_has_no_rating(hand_made: Make) -> None:
    driving = rate_run(hand_made().trace(), 0)
    assert np.isnan([driving.achieved, driving.best, driving.regret]).all()


def test_contact_is_the_worst_that_can_be_achieved(hand_made: Make) -> None:
    made = stopped(hand_made, SLOW).touch(60, "lead")
    assert achieved_rating(made.trace(), 0, RULES) == CONTACT


@pytest.mark.parametrize(("d", "rating"), [(MIDDLE, 5.0), (3.5, 5.0), (SLOW, 3.0), (-9.0, 7.0)])
def test_achieved_rating_is_that_of_the_place(hand_made: Make, d: float, rating: float) -> None:
    assert achieved_rating(stopped(hand_made, d).trace(), 0, RULES) == rating
