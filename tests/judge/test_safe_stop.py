"""Where a run stands, the best that was in reach at its fault, and what is regretted."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from adeye import signals as columns
from adeye.judge import safe_stop
from adeye.kernel.stops import CONTACT, DEFAULT_RULES
from adeye.signals import RoadMap
from adeye.spec.architecture import Architecture
from adeye.spec.channels import SafetyChannel, SafetyParameters
from adeye.trace import Trace
from tests.judge.conftest import HandMade, rate_run

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
    assert safe_stop.best_rating(trace, 0, 10, RULES) == 1.0


def test_nothing_reachable_is_rated_as_contact(hand_made: Make) -> None:
    made = stopped(hand_made, MIDDLE, objects=("wall",))
    made.object("wall", d=MIDDLE, s=36.0, speed=0.0, size=(4.0, 40.0))
    assert safe_stop.best_rating(made.trace(), 0, 10, RULES) == CONTACT


def test_follower_in_the_own_lane_does_not_forbid_to_stop(hand_made: Make) -> None:
    made = stopped(hand_made, MIDDLE)
    made.object("lead", d=MIDDLE, s=20.0 * made.time - 10.0)
    # The lane to the right is free.
    assert safe_stop.best_rating(made.trace(), 0, 10, RULES) == 3.0


@pytest.mark.parametrize(("d", "rating"), [(MIDDLE, 5.0), (3.5, 5.0), (SLOW, 3.0), (-9.0, 7.0)])
def test_achieved_rating_is_that_of_the_place(hand_made: Make, d: float, rating: float) -> None:
    assert safe_stop.achieved_rating(stopped(hand_made, d).trace(), 0, RULES) == rating


@pytest.mark.parametrize(("across", "rating"), [(0.0, 3.0), (0.5, 5.0), (-0.5, 5.0)])
def test_how_it_stands_counts_against_the_road_there(
    hand_made: Make, across: float, rating: float
) -> None:
    made = stopped(hand_made, 2.2)
    made.ego(heading=0.6 + across)
    made.columns["ego_place"][..., columns.PLACE_HEADING] = 0.6
    assert safe_stop.achieved_rating(made.trace(), 0, RULES) == rating


def test_a_bay_that_was_in_reach_is_regretted(hand_made: Make) -> None:
    trace = stopped(hand_made, SLOW).object("lead", d=8.75).trace()
    road = trace.layout.context.road
    bay = np.array([[[0.0, 130.0, 60.0, 4.0, 30.0]]])
    near = replaced(trace, replace(road, refuges=bay))
    assert rate_run(near, 0).regret == 3.0
    far = replaced(trace, replace(road, refuges=np.add(bay, [0.0, 500.0, 0.0, 0.0, 0.0])))
    assert rate_run(far, 0).regret == 0.0


@pytest.mark.parametrize(("d", "rating"), [(-4.0, 0.0), (-2.5, 1.0), (-0.5, 3.0)])
def test_who_stands_in_a_bay_stands_best(hand_made: Make, d: float, rating: float) -> None:
    trace = stopped(hand_made, d).trace()
    bay = np.array([[[0.0, 40.0, 60.0, 4.0, 30.0]]])
    context = replaced(trace, replace(trace.layout.context.road, refuges=bay))
    assert safe_stop.achieved_rating(context, 0, RULES) == rating


def test_a_free_verge_is_better_than_a_lane_and_worse_than_a_shoulder(hand_made: Make) -> None:
    trace = stopped(hand_made, -1.25).trace()
    road = trace.layout.context.road
    ratings = []
    for shoulder, verge in ((0.0, 0.0), (0.0, 2.5), (2.5, 0.0)):
        other = replace(road, shoulder=road.shoulder * 0.0 + shoulder, verge=road.verge + verge)
        ratings.append(safe_stop.achieved_rating(replaced(trace, other), 0, RULES))
    assert ratings == [7.0, 2.0, 1.0]


def test_the_safety_channel_s_own_decelerations_say_what_was_in_reach(hand_made: Make) -> None:
    trace = stopped(hand_made, SLOW).object("lead", d=8.75).trace()
    architecture = trace.layout.architecture
    assert safe_stop.decelerations_of(architecture) == safe_stop.DECELERATIONS
    links = ("channels.nominal",)
    weak = {"stop_deceleration": "1.3 m/s^2", "emergency_deceleration": "1.5 m/s^2"}
    channel = SafetyChannel(
        kind="safety", links=links, rate="20 Hz", parameters=SafetyParameters.model_validate(weak)
    )
    weaker = architecture.model_copy(update={"channels": {"safety": channel}})
    slow = safe_stop.decelerations_of(weaker)
    assert slow == {"stop_deceleration": 1.3, "emergency_deceleration": 1.5}
    # At 1.5 m/s² it stands 133 m after the fault at 20 m.
    bay = np.array([[[0.0, 110.0, 40.0, 4.0, 20.0]]])
    near = replaced(trace, replace(trace.layout.context.road, refuges=bay))
    assert rate_run(near, 0).best == 0.0
    assert rate_run(of_architecture(near, weaker), 0).best == 3.0


def test_each_run_of_a_batch_has_its_own_decelerations_and_ratings(hand_made: Make) -> None:
    trace = stopped(hand_made, SLOW, runs=2).object("lead", d=8.75).trace()
    trace.layout.context.road.shoulder[:] = 2.5
    ratings = {"slow_lane_in_sight": 0, "hard_shoulder": 2}
    parameters = {"stop": "planned", "ratings": ratings}
    channel = SafetyChannel(
        kind="safety",
        links=("channels.nominal",),
        rate="20 Hz",
        parameters=SafetyParameters.model_validate(parameters),
    )
    first = trace.layout.architecture
    other = first.model_copy(update={"channels": {"safety": channel}})
    mixed = of_architecture(trace, first, other)
    found = [rate_run(mixed, run) for run in range(2)]
    assert [(item.achieved, item.best) for item in found] == [(3.0, 1.0), (0.0, 0.0)]
    assert rate_run(mixed.select([1]), 0) == found[1]
    assert safe_stop.rules_of(other)[[1, 3]].tolist() == [2.0, 0.0]


def of_architecture(trace: Trace, *architectures: Architecture) -> Trace:
    return replace(trace, layout=replace(trace.layout, architectures=architectures))


def replaced(trace: Trace, road: RoadMap) -> Trace:
    context = replace(trace.layout.context, road=road)
    return replace(trace, layout=replace(trace.layout, context=context))
