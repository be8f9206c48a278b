"""How runs end, whether they came about, and what road and vehicle allow."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.judge import outcome
from adeye.judge.verdict import Outcome
from adeye.kernel.motion import GRAVITY
from adeye.signals import EGO_HEADING, PLACE_D, PLACE_LANE, PLACE_S
from adeye.trace import ChannelEvent
from tests.judge.conftest import HandMade


def test_run_alone_keeps_its_own_sizes(hand_made: Any) -> None:
    made = hand_made(runs=3).object("lead", run=1, size=(12.0, 2.5))
    alone = made.trace().select([1])
    assert alone.runs == alone.layout.context.runs == 1
    assert alone.layout.context.object_sizes[0, 0, 0] == 12.0
    assert alone.select([0]).layout.context.runs == 1


def begun(made: Any, at: float, *, row: int = -1) -> Any:
    """Begin the first event at a time that is known from a row on."""
    return made.set("begun", at, rows=slice(row, None), at=0)


def test_run_to_the_horizon_is_completed(hand_made: Any) -> None:
    found = outcome.outcomes(hand_made().trace()).run(0)
    assert (found.outcome, found.channel, found.detail) == (Outcome.COMPLETED, None, None)
    assert (found.is_realised, found.end_reason) == (True, "horizon")


def test_run_to_the_goal_says_so(hand_made: Any) -> None:
    made = hand_made()
    made.horizon_row[:], made.length[:] = 8, 14
    assert outcome.outcomes(made.trace()).run(0).end_reason == "goal"
    assert outcome.obligation_rows(made.trace()).tolist() == [8]


def test_ego_is_at_its_goal_from_there_on_and_a_run_that_ends_before_is_nowhere(
    hand_made: Any,
) -> None:
    made = hand_made(runs=3).touch(6, "lead", run=2)
    made.horizon_row[0], made.length[0], made.horizon_row[2] = 8, 14, 6
    marks = outcome.at_goal(made.trace())
    assert marks[0].tolist() == [row >= 8 for row in range(marks.shape[1])]
    assert not marks[1:].any()


def test_ego_that_passes_its_goal_beside_the_lanes_is_not_there(hand_made: Any) -> None:
    made = hand_made()
    made.horizon_row[:], made.length[:] = 8, 14
    trace = made.trace()
    trace["ego_place"][:, 8, PLACE_LANE] = -1.0
    assert not outcome.at_goal(trace).any()


def test_event_within_the_horizon_realises_the_scenario(hand_made: Any) -> None:
    trace = begun(hand_made(events=("cut_in",)), 1.4, row=14).trace()
    assert outcome.missing_events(trace) == ((),)
    assert outcome.invalid_reasons(trace) == (None,)


@pytest.mark.parametrize("at", [float("nan"), 1.5, 1.6])
def test_event_that_begins_never_or_late_does_not(hand_made: Any, at: float) -> None:
    trace = begun(hand_made(events=("cut_in",)), at).trace()
    found = outcome.outcomes(trace).run(0)
    assert (found.outcome, found.is_realised) == (Outcome.NOT_REALISED, False)
    assert "cut_in did not begin" in str(found.detail)
    assert "not realised: cut_in" in str(outcome.invalid_reasons(trace)[0])


def test_event_that_nobody_asked_for_may_stay_away(hand_made: Any) -> None:
    made = hand_made(events=("cut_in",))
    made.realised = ()
    assert outcome.invalid_reasons(made.trace()) == (None,)


def test_contact_before_the_event_does_not_hide_itself(hand_made: Any) -> None:
    trace = hand_made(events=("cut_in",)).touch(6, "lead").trace()
    assert outcome.missing_events(trace) == ((),)
    assert outcome.invalid_reasons(trace) == (None,)
    assert outcome.outcomes(trace).run(0).end_reason == "contact"


def test_failed_channel_is_named_before_the_scenario_that_it_spoilt(hand_made: Any) -> None:
    made = hand_made(events=("cut_in",))
    made.channel_events = [ChannelEvent("channel_error", "nominal", 0.4, "ValueError: no")]
    found = outcome.outcomes(made.trace()).run(0)
    assert (found.outcome, found.channel) == (Outcome.CHANNEL_ERROR, "nominal")
    assert found.detail == "at 0.4 s: ValueError: no"
    assert not found.is_realised


def test_contact_from_the_start_or_of_other_traffic_first_is_invalid(hand_made: Any) -> None:
    assert "from the start" in str(outcome.invalid_reasons(hand_made().touch(0, "lead").trace())[0])
    for row, reason in ((3, "other traffic collided first, at 0.3 s"), (6, None), (7, None)):
        made = hand_made().set("foreign_contact", value=True, rows=slice(row, None))
        assert outcome.invalid_reasons(made.touch(6, "lead").trace()) == (reason,)


def test_obligations_that_a_contact_cut_off_are_counted(hand_made: Any) -> None:
    made = hand_made(runs=3).touch(6, "lead", run=1).touch(18, "lead", run=2)
    trace = made.trace()
    assert outcome.ended_by_contact(trace).tolist() == [False, True, True]
    # To the horizon; to the horizon although the run ended before; to the contact in the tail.
    assert outcome.obligation_rows(trace).tolist() == [15, 15, 18]


def faulty(made: Any, *rows: int, fault: str = "late") -> Any:
    """Let a run have a fault that is present at some rows."""
    made.faults, made.has_own_faults = (fault,), True
    for row in rows:
        made.set("fault_active", 1, rows=row, at=0)
    return made


def test_fault_within_the_horizon_has_acted(hand_made: Any) -> None:
    trace = faulty(hand_made(), 15).trace()
    assert outcome.idle_faults(trace) == ((),)
    assert outcome.invalid_reasons(trace) == (None,)


@pytest.mark.parametrize("rows", [(), (16,), (20,)])
def test_fault_that_acts_never_or_in_the_tail_has_tested_nothing(
    hand_made: Any, rows: tuple[int, ...]
) -> None:
    trace = faulty(hand_made(), *rows).trace()
    assert outcome.idle_faults(trace) == (("late",),)
    reason = outcome.invalid_reasons(trace)[0]
    assert reason == "not tested: fault late did not act within the horizon"
    assert not outcome.bars(reason)
    found = outcome.outcomes(trace).run(0)
    assert (found.outcome, found.is_realised) == (Outcome.NOT_REALISED, False)
    assert found.detail == "fault late did not act within the horizon"


def test_contact_before_the_fault_leaves_the_run_what_it_was(hand_made: Any) -> None:
    trace = faulty(hand_made().touch(6, "lead"), 15).trace()
    assert outcome.outcomes(trace).run(0).outcome is Outcome.COMPLETED
    assert outcome.idle_faults(trace) == (("late",),)


def over_the_end(made: Any) -> Any:
    """Let the ego drive over the end of its road, of 10 km, at row 6."""
    made.ego(s=10_000.0 - 11.0 + 2.0 * np.arange(made.rows))
    made.length[:], made.horizon_row[:], made.complete[:] = 7, 5, False
    return made


def test_drive_over_the_end_of_the_road_tests_nothing_and_says_so(hand_made: Any) -> None:
    trace = over_the_end(hand_made(events=("cut_in",))).trace()
    found = outcome.outcomes(trace).run(0)
    said = "the ego drove over the end of the road of 10000 m at 0.6 s"
    assert (found.outcome, found.detail) == (Outcome.NOT_REALISED, said)
    assert (found.is_realised, found.end_reason) == (False, "road_end")
    assert outcome.invalid_reasons(trace) == (f"not tested: {said}",)
    # What failed while there was a road has failed.
    assert not outcome.bars(outcome.invalid_reasons(trace)[0])
    assert outcome.obligation_rows(trace).tolist() == [5]


def test_contact_behind_the_end_of_the_road_is_a_contact(hand_made: Any) -> None:
    trace = over_the_end(hand_made()).touch(6, "lead").trace()
    assert outcome.outcomes(trace).run(0).end_reason == "contact"
    assert outcome.invalid_reasons(trace) == (None,)


def test_vehicle_limits_on_a_dry_road_and_friction_on_ice(hand_made: Any) -> None:
    trace = hand_made(runs=2).trace()
    surroundings = trace.layout.context.surroundings
    friction = replace(surroundings, friction=np.array([1.0, 0.1]))
    context = replace(trace.layout.context, surroundings=friction)
    found = outcome.abilities(replace(trace, layout=replace(trace.layout, context=context)))
    assert found[0].tolist() == [9.0, GRAVITY, 3.0]
    assert found[1] == pytest.approx([0.1 * GRAVITY] * 3)


Make = Callable[..., HandMade]
BAY = np.array([[[0.0, 40.0, 60.0, 4.0, 20.0]]])


def test_the_bay_belongs_to_the_road(hand_made: Make) -> None:
    made = hand_made(rows=6)
    made.ego(s=np.array([0.0, 50.0, 50.0, 50.0, 50.0, 30.0]), d=-5.0, speed=1.0)
    trace = made.trace()
    road, places = trace.layout.context.road, trace["ego_place"].astype(np.float64)
    places[0, :, PLACE_D] = [1.0, 1.0, -5.0, -6.1, np.nan, -5.0]
    assert outcome.on_road(road, places).tolist() == [[True, True, False, False, False, False]]
    bay = replace(road, refuges=BAY)
    assert outcome.on_road(bay, places).tolist() == [[True, True, True, False, False, False]]
    verge = replace(road, verge=road.verge + 3.0)
    assert outcome.on_road(verge, places).tolist() == [[True, True, True, False, False, True]]


def test_the_whole_ego_is_in_the_bay_or_it_is_not(hand_made: Make) -> None:
    made = hand_made(rows=4)
    made.ego(s=np.array([50.0, 50.0, 50.0, 25.0]), d=-4.0, speed=1.0)
    trace = made.trace()
    context = trace.layout.context
    places = trace["ego_place"].astype(np.float64)
    headings = trace["ego"][..., EGO_HEADING].astype(np.float64)
    places[0, :, PLACE_S] = [50.0, 50.0, 50.0, 25.0]
    places[0, :, PLACE_D] = [-4.0, -2.9, -4.0, -4.0]
    headings[0, 2] = 0.8
    assert not outcome.in_refuge(context, places, headings).any()
    with_bay = replace(context, road=replace(context.road, refuges=BAY))
    assert outcome.in_refuge(with_bay, places, headings).tolist() == [[True, False, False, False]]


def test_the_road_begins_and_ends(hand_made: Make) -> None:
    made = hand_made(rows=6)
    trace = made.trace()
    road, places = trace.layout.context.road, trace["ego_place"].astype(np.float64)
    road = replace(road, length=np.array([3000.0]), verge=np.array([9.0]))
    places[0, :, PLACE_S] = [-0.1, 0.0, 1.0, 3000.0, 3000.1, np.nan]
    for d in (5.25, -9.0):
        places[0, :, PLACE_D] = d
        assert outcome.on_road(road, places).tolist() == [[False, True, True, True, False, False]]
