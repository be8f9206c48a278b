"""How authority passes: latency in ticks, what acts meanwhile, limited rates, a switch at fault."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.signals import (
    FAULT,
    NO_CHANNEL,
    OK,
    REASON_DEFAULT,
    REASON_HANDOVER,
    REASON_LATCHED,
    REASON_NO_CHANNEL,
    REASON_REQUEST,
    REASON_STUCK,
    REQUESTS_AUTHORITY,
    SILENT,
)
from tests.simulate.switch.rig import (
    NOMINAL,
    SAFETY,
    STEP,
    Tick,
    all_ok,
    holders,
    spec,
    switch,
    ticks,
)

QUIET, ASKED = (OK, OK), (OK, REQUESTS_AUTHORITY)
BRAKES = [(1.0, 0.1), (-6.0, -0.2)]


@pytest.mark.parametrize("latency", range(5))
def test_command_of_the_new_channel_acts_so_many_ticks_after_the_decision(latency: int) -> None:
    made = switch(spec(handover=f"{latency * 50} ms"))
    found = ticks(made, [QUIET, QUIET, *[ASKED] * 8], [BRAKES] * 10)
    assert holders(found) == [NOMINAL] * (2 + latency) + [SAFETY] * (8 - latency)
    assert [tick.acceleration for tick in found] == [1.0] * (2 + latency) + [-6.0] * (8 - latency)
    assert [tick.reason for tick in found] == (
        [REASON_DEFAULT] * 2 + [REASON_HANDOVER] * latency + [REASON_REQUEST] * (8 - latency)
    )


def test_reason_of_the_decision_is_told_when_it_takes_effect() -> None:
    found = ticks(switch(spec(handover="0.1 s")), [QUIET, ASKED, QUIET, QUIET, QUIET])
    assert [tick.reason for tick in found[1:]] == [
        REASON_HANDOVER,
        REASON_HANDOVER,
        REASON_REQUEST,
        REASON_LATCHED,
    ]


def test_ego_can_coast_meanwhile_with_its_steering_held() -> None:
    made = switch(spec(handover="0.1 s", meanwhile="coast"))
    found = ticks(made, [QUIET, *[ASKED] * 3], [BRAKES] * 4)
    assert found[1:3] == [Tick(NO_CHANNEL, REASON_HANDOVER, 0.0, 0.1)] * 2
    assert found[3] == Tick(SAFETY, REASON_REQUEST, -6.0, -0.2)


def test_old_channel_that_fails_meanwhile_does_not_act() -> None:
    made = switch(spec(handover="0.15 s"))
    found = ticks(made, [QUIET, ASKED, (FAULT, OK), ASKED, ASKED], [BRAKES] * 5)
    assert holders(found) == [NOMINAL, NOMINAL, NO_CHANNEL, NOMINAL, SAFETY]
    assert found[2].acceleration == 0.0


def test_decision_that_is_withdrawn_takes_no_effect_and_the_next_one_waits_in_full() -> None:
    made = switch(spec(handover="0.1 s", latch=False))
    found = ticks(made, [QUIET, ASKED, ASKED, QUIET, ASKED, ASKED, ASKED, ASKED])
    assert holders(found) == [NOMINAL] * 6 + [SAFETY] * 2
    assert found[3].reason == REASON_DEFAULT
    # So it does where nobody is left for it.
    made = switch(spec(handover="0.15 s", latch=False))
    found = ticks(made, [QUIET, ASKED, ASKED, (FAULT, FAULT), *[ASKED] * 4])
    assert holders(found) == [*[NOMINAL] * 3, NO_CHANNEL, *[NOMINAL] * 3, SAFETY]


def test_first_channel_and_nobody_act_at_once_and_the_old_one_comes_back_without_a_handover() -> (
    None
):
    found = ticks(switch(spec(handover="1 s")), [(SILENT, OK), *all_ok(2)])
    assert [(tick.channel, tick.reason) for tick in found] == [
        (NO_CHANNEL, REASON_NO_CHANNEL),
        (NOMINAL, REASON_DEFAULT),
        (NOMINAL, REASON_DEFAULT),
    ]
    found = ticks(switch(spec(handover="1 s")), [QUIET, (FAULT, FAULT), QUIET])
    assert holders(found) == [NOMINAL, NO_CHANNEL, NOMINAL]


def test_return_takes_its_time_too() -> None:
    made = switch(spec(handover="0.1 s", latch=False))
    found = ticks(made, [QUIET, *[ASKED] * 4, *[QUIET] * 4])
    assert holders(found) == [NOMINAL] * 3 + [SAFETY] * 4 + [NOMINAL] * 2


JERK, RATE = 20.0, 0.5


def test_acting_command_moves_to_the_new_one_at_its_limits() -> None:
    made = switch(spec(bumpless={"jerk": "20 m/s^3", "steering_rate": "2 rad/s"}))
    found = ticks(made, [QUIET, *[ASKED] * 9], [BRAKES] * 10)
    assert holders(found) == [NOMINAL] + [SAFETY] * 9
    assert [tick.acceleration for tick in found] == pytest.approx(
        [1.0, 0.0, -1.0, -2.0, -3.0, -4.0, -5.0, -6.0, -6.0, -6.0]
    )
    assert [tick.steering for tick in found] == pytest.approx(
        [0.1, 0.0, -0.1, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2]
    )


def test_without_a_handover_the_command_is_not_limited() -> None:
    made = switch(spec(bumpless={"jerk": "1 m/s^3", "steering_rate": "1 deg/s"}))
    rows = [[(value, 0.1 * value), (0.0, 0.0)] for value in (0.0, 3.0, -9.0)]
    assert [tick.acceleration for tick in ticks(made, all_ok(3), rows)] == [0.0, 3.0, -9.0]


def test_once_arrived_the_command_follows_its_channel_as_it_is() -> None:
    made = switch(spec(bumpless={"jerk": "100 m/s^3", "steering_rate": "10 rad/s"}))
    rows = [BRAKES, BRAKES, BRAKES, [(1.0, 0.1), (5.0, 0.6)]]
    found = ticks(made, [QUIET, ASKED, ASKED, ASKED], rows)
    assert [tick.acceleration for tick in found] == [1.0, -4.0, -6.0, 5.0]


def test_ego_coasts_at_once_and_the_next_channel_begins_from_there() -> None:
    made = switch(spec(bumpless={"jerk": "20 m/s^3", "steering_rate": "2 rad/s"}))
    found = ticks(made, [QUIET, (FAULT, FAULT), (FAULT, OK), (FAULT, OK)], [BRAKES] * 4)
    assert [tick.acceleration for tick in found] == pytest.approx([1.0, 0.0, -1.0, -2.0])
    assert [tick.steering for tick in found] == pytest.approx([0.1, 0.1, 0.0, -0.1])


PAIR = st.tuples(st.floats(-9.0, 3.0), st.floats(-0.5, 0.5))


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(
    targets=st.lists(st.tuples(PAIR, PAIR), min_size=6, max_size=20),
    asked_at=st.integers(1, 4),
    last=st.tuples(PAIR, PAIR),
)
def test_rates_are_never_exceeded_on_the_way_and_the_target_is_reached(
    targets: list[tuple[tuple[float, float], tuple[float, float]]],
    asked_at: int,
    last: tuple[tuple[float, float], tuple[float, float]],
) -> None:
    made = switch(spec(bumpless={"jerk": f"{JERK} m/s^3", "steering_rate": f"{RATE} rad/s"}))
    # At most 18 m/s² at 20 m/s³ and 1 rad at 0.5 rad/s: two seconds and a tick.
    rows = [list(row) for row in [*targets, *[last] * 41]]
    found = ticks(made, [QUIET if k < asked_at else ASKED for k in range(len(rows))], rows)
    arrived = False
    for tick in range(asked_at, len(rows)):
        now, before = found[tick], found[tick - 1]
        assert now.channel == SAFETY
        if not arrived:
            assert abs(now.acceleration - before.acceleration) <= JERK * STEP + 1e-12
            assert abs(now.steering - before.steering) <= RATE * STEP + 1e-12
            arrived = (now.acceleration, now.steering) == rows[tick][SAFETY]
        else:
            assert (now.acceleration, now.steering) == rows[tick][SAFETY]
    assert (found[-1].acceleration, found[-1].steering) == last[SAFETY]


def test_stuck_switch_keeps_the_present_holder_from_the_onset() -> None:
    stuck = [False] * 3 + [True] * 3 + [False] * 2
    rows = [QUIET, ASKED, ASKED, *[QUIET] * 5]
    found = ticks(switch(spec(latch=False)), rows, stuck=stuck)
    assert holders(found) == [NOMINAL, SAFETY, SAFETY, SAFETY, SAFETY, SAFETY, NOMINAL, NOMINAL]
    assert [tick.reason for tick in found[3:6]] == [REASON_STUCK] * 3
    assert found[6].reason == REASON_DEFAULT


def test_stuck_switch_ignores_requests_and_coasts_with_a_holder_that_cannot_act() -> None:
    rows = [QUIET, ASKED, (FAULT, REQUESTS_AUTHORITY), ASKED]
    found = ticks(switch(spec()), rows, [BRAKES] * 4, stuck=[False, True, True, True])
    assert holders(found) == [NOMINAL] * 4
    assert [tick.acceleration for tick in found] == [1.0, 1.0, 0.0, 1.0]
    # Stuck from the start it lies at the default.
    found = ticks(switch(spec()), [ASKED, ASKED], stuck=[True, True])
    assert [(tick.channel, tick.reason) for tick in found] == [(NOMINAL, REASON_STUCK)] * 2


def test_stuck_switch_breaks_off_a_handover_and_begins_it_again_afterwards() -> None:
    made = switch(spec(handover="0.1 s"))
    stuck = [False, False, True, True, False, False, False]
    found = ticks(made, [QUIET, *[ASKED] * 6], stuck=stuck)
    assert holders(found) == [NOMINAL] * 6 + [SAFETY]


@pytest.mark.parametrize("late", [0, 1, 3])
def test_late_switch_takes_so_much_longer(late: int) -> None:
    made = switch(spec(handover="0.05 s"))
    found = ticks(made, [QUIET, *[ASKED] * 8], delay=[late * STEP] * 9)
    assert holders(found) == [NOMINAL] * (2 + late) + [SAFETY] * (7 - late)


def test_only_a_change_that_is_decided_while_the_switch_is_late_is_late() -> None:
    rows = [QUIET, *[ASKED] * 6]
    before = ticks(switch(spec()), rows, delay=[0.0, 0.0, *[0.2] * 5])
    assert holders(before) == [NOMINAL] + [SAFETY] * 6
    during = ticks(switch(spec()), rows, delay=[0.0, 0.2, *[0.0] * 5])
    assert holders(during) == [NOMINAL] * 5 + [SAFETY] * 2


STATES = st.sampled_from([OK, REQUESTS_AUTHORITY, FAULT, SILENT])


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(
    rows=st.lists(st.tuples(STATES, STATES), min_size=1, max_size=20),
    onset=st.integers(0, 20),
    latch=st.booleans(),
)
def test_stuck_switch_never_changes_hands_and_before_it_nothing_differs(
    rows: list[tuple[int, int]],
    onset: int,
    latch: bool,  # noqa: FBT001 - a test's choice
) -> None:
    sound = ticks(switch(spec(latch=latch)), rows)
    stuck = [tick >= onset for tick in range(len(rows))]
    found = ticks(switch(spec(latch=latch)), rows, stuck=stuck)
    assert found[:onset] == sound[:onset]
    held = [tick.channel for tick in sound[:onset] if tick.channel != NO_CHANNEL]
    assert {tick.channel for tick in found[onset:]} <= {held[-1] if held else NOMINAL}


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(rows=st.lists(st.tuples(STATES, STATES), min_size=1, max_size=20))
def test_delay_of_nothing_changes_no_bit(rows: list[tuple[int, int]]) -> None:
    made = switch(spec())
    numbers = [[(0.1 * k, 0.01), (-0.3 * k, np.pi)] for k in range(len(rows))]
    assert ticks(made, rows, numbers, delay=[0.0] * len(rows)) == ticks(
        switch(spec()), rows, numbers
    )
