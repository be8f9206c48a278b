import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.ports import SwitchContext, SwitchModel
from adeye.signals import (
    DEGRADED,
    FAULT,
    NO_CHANNEL,
    OK,
    REASON_DEFAULT,
    REASON_LATCHED,
    REASON_NO_CHANNEL,
    REASON_REQUEST,
    REASON_STALENESS,
    REASON_STUCK,
    REQUESTS_AUTHORITY,
    SILENT,
    ControlCommand,
)
from adeye.simulate.switch import Arbiter, make_switch
from tests.simulate.switch.rig import (
    IDS,
    NOMINAL,
    SAFETY,
    STEP,
    THIRD,
    command,
    spec,
    switch,
    ticks,
)


def drive(made: SwitchModel, *statuses: tuple[int, ...]) -> list[tuple[int, int]]:
    """Arbitrate fresh commands of the given states, one tuple a tick."""
    return [(tick.channel, tick.reason) for tick in ticks(made, statuses)]


def test_default_acts_when_nobody_requests() -> None:
    assert drive(switch(spec()), (OK, OK)) == [(NOMINAL, REASON_DEFAULT)]


def test_degraded_default_still_acts() -> None:
    assert drive(switch(spec()), (DEGRADED, OK)) == [(NOMINAL, REASON_DEFAULT)]


def test_request_is_granted_at_once_without_debounce() -> None:
    decisions = drive(switch(spec()), (OK, OK), (OK, REQUESTS_AUTHORITY))
    assert decisions[-1] == (SAFETY, REASON_REQUEST)


def test_request_is_granted_after_standing_for_the_debounce_time() -> None:
    rows = [(OK, REQUESTS_AUTHORITY)] * 4
    decisions = drive(switch(spec(debounce="0.1 s")), *rows)
    assert [channel for channel, _ in decisions] == [NOMINAL, NOMINAL, SAFETY, SAFETY]


def test_interrupted_request_starts_the_debounce_again() -> None:
    rows = [(OK, REQUESTS_AUTHORITY), (OK, REQUESTS_AUTHORITY), (OK, OK)] * 2
    decisions = drive(switch(spec(debounce="0.1 s")), *rows)
    assert {channel for channel, _ in decisions} == {NOMINAL}


def test_latched_authority_outlasts_the_request() -> None:
    decisions = drive(switch(spec()), (OK, REQUESTS_AUTHORITY), (OK, OK), (OK, OK))
    assert decisions[1:] == [(SAFETY, REASON_LATCHED)] * 2


def test_without_latch_authority_goes_back_with_the_request() -> None:
    decisions = drive(switch(spec(latch=False)), (OK, REQUESTS_AUTHORITY), (OK, OK))
    assert decisions[-1] == (NOMINAL, REASON_DEFAULT)


@pytest.mark.parametrize("status", [SILENT, FAULT])
def test_next_channel_acts_when_the_default_cannot(status: int) -> None:
    decisions = drive(switch(spec()), (OK, OK), (status, OK))
    assert decisions[-1] == (SAFETY, REASON_STALENESS)


def test_authority_taken_for_staleness_is_latched_too() -> None:
    decisions = drive(switch(spec()), (OK, OK), (SILENT, OK), (OK, OK))
    assert decisions[-1] == (SAFETY, REASON_LATCHED)


def test_without_latch_a_recovered_default_acts_again() -> None:
    decisions = drive(switch(spec(latch=False)), (OK, OK), (SILENT, OK), (OK, OK))
    assert decisions[-1] == (NOMINAL, REASON_DEFAULT)


def test_old_command_is_replaced_only_beyond_the_staleness_time() -> None:
    made = switch(spec(staleness="0.2 s"))
    reasons = []
    for tick in range(7):
        time = tick * STEP
        proposals = [command(NOMINAL, OK, 0.0), command(SAFETY, OK, time)]
        reasons.append(int(made.arbitrate(time, proposals)[1].reason[0]))
    assert reasons == [REASON_DEFAULT] * 5 + [REASON_STALENESS] * 2


def test_latched_channel_that_fails_hands_back_to_the_next_usable() -> None:
    rows = [(OK, REQUESTS_AUTHORITY), (OK, SILENT), (OK, OK)]
    decisions = drive(switch(spec()), *rows)
    assert decisions[1:] == [(NOMINAL, REASON_STALENESS), (SAFETY, REASON_LATCHED)]


def test_higher_priority_overrides_a_latched_channel() -> None:
    made = switch(spec(priority=["third", "safety", "nominal"]), channels=IDS)
    rows = [(OK, REQUESTS_AUTHORITY, OK), (OK, OK, REQUESTS_AUTHORITY), (OK, OK, OK)]
    channels = [channel for channel, _ in drive(made, *rows)]
    assert channels == [SAFETY, THIRD, THIRD]


def test_lower_priority_does_not_override_a_latched_channel() -> None:
    made = switch(spec(priority=["third", "safety", "nominal"]), channels=IDS)
    rows = [(OK, OK, REQUESTS_AUTHORITY), (OK, REQUESTS_AUTHORITY, OK)]
    assert drive(made, *rows)[-1] == (THIRD, REASON_LATCHED)


def test_ego_coasts_with_held_steering_when_no_channel_can_act() -> None:
    made = switch(spec())
    made.arbitrate(0.0, [command(NOMINAL, OK, 0.0, (2.0, 0.3)), command(SAFETY, OK, 0.0)])
    silent = [command(NOMINAL, SILENT, -1.0), command(SAFETY, FAULT, 0.0)]
    acting, authority = made.arbitrate(STEP, silent)
    assert acting.tolist() == [[0.0, 0.3]]
    assert (authority.channel[0], authority.reason[0]) == (NO_CHANNEL, REASON_NO_CHANNEL)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_command_that_is_no_number_never_acts(bad: float) -> None:
    made = switch(spec())
    made.arbitrate(0.0, [command(NOMINAL, OK, 0.0), command(SAFETY, OK, 0.0)])
    proposals = [command(NOMINAL, OK, STEP, (bad, 0.0)), command(SAFETY, OK, STEP, (-4.0, 0.0))]
    acting, _ = made.arbitrate(STEP, proposals)
    assert acting[0, 0] == -4.0


def test_stamp_that_is_no_number_is_not_usable() -> None:
    made = switch(spec())
    drive(made, (OK, OK))
    proposals = [command(NOMINAL, OK, np.nan), command(SAFETY, OK, STEP)]
    assert made.arbitrate(STEP, proposals)[1].channel[0] == SAFETY


def test_stuck_switch_ignores_requests() -> None:
    made = switch(spec(policy="stuck"))
    decisions = drive(made, (OK, REQUESTS_AUTHORITY), (OK, REQUESTS_AUTHORITY))
    assert decisions == [(NOMINAL, REASON_STUCK)] * 2


def test_stuck_switch_on_a_silent_channel_coasts() -> None:
    made = switch(spec(policy="stuck"))
    made.arbitrate(0.0, [command(NOMINAL, OK, 0.0, (2.0, 0.3)), command(SAFETY, OK, 0.0)])
    acting, authority = made.arbitrate(
        STEP, [command(NOMINAL, SILENT, -1.0, (2.0, 0.5)), command(SAFETY, OK, STEP)]
    )
    assert acting.tolist() == [[0.0, 0.3]]
    assert authority.reason[0] == REASON_STUCK


def test_default_without_first_command_hands_over_only_after_the_staleness_time() -> None:
    rows = [(SILENT, OK)] * 7
    decisions = drive(switch(spec(staleness="0.2 s")), *rows)
    assert decisions[:5] == [(NO_CHANNEL, REASON_NO_CHANNEL)] * 5
    assert decisions[5:] == [(SAFETY, REASON_STALENESS)] * 2


def test_request_during_start_up_is_granted() -> None:
    assert drive(switch(spec()), (SILENT, REQUESTS_AUTHORITY)) == [(SAFETY, REASON_REQUEST)]


def test_run_with_another_spec_in_the_batch_decides_for_itself() -> None:
    made = switch(spec(), spec(policy="stuck"), spec(default="safety"))
    proposals = [
        ControlCommand(
            name, np.full(3, 1.0), np.zeros(3), np.zeros(3), np.full(3, status, dtype=np.int64)
        )
        for name, status in (("nominal", OK), ("safety", OK))
    ]
    _, authority = made.arbitrate(0.0, proposals)
    assert authority.channel.tolist() == [NOMINAL, NOMINAL, SAFETY]
    assert authority.reason.tolist() == [REASON_DEFAULT, REASON_STUCK, REASON_DEFAULT]


def test_channel_outside_the_priority_list_never_acts() -> None:
    made = switch(spec(), channels=IDS)
    rows = [(OK, OK, OK), (SILENT, SILENT, REQUESTS_AUTHORITY)]
    assert drive(made, *rows)[-1] == (NO_CHANNEL, REASON_NO_CHANNEL)


def test_made_switch_is_the_arbiter() -> None:
    assert isinstance(make_switch(SwitchContext([spec()], IDS[:2], STEP)), Arbiter)


ROW = st.tuples(*[st.sampled_from([OK, DEGRADED, REQUESTS_AUTHORITY, FAULT, SILENT])] * 3)


@pytest.mark.slow
@settings(max_examples=60)
@given(
    rows=st.lists(ROW, min_size=1, max_size=12),
    latch=st.booleans(),
    debounce=st.sampled_from(["0 s", "0.1 s"]),
    priority=st.permutations(IDS),
)
def test_exactly_one_usable_channel_or_none_has_authority(
    rows: list[tuple[int, ...]],
    latch: bool,  # noqa: FBT001 - a test's choice
    debounce: str,
    priority: list[str],
) -> None:
    made = switch(spec(latch=latch, debounce=debounce, priority=priority), channels=IDS)
    for row, (channel, reason) in zip(rows, drive(made, *rows), strict=True):
        usable = [index for index, status in enumerate(row) if status not in (FAULT, SILENT)]
        if channel == NO_CHANNEL:
            assert reason == REASON_NO_CHANNEL
            assert NOMINAL not in usable
        else:
            assert channel in usable
            assert reason != REASON_NO_CHANNEL


def test_silent_channel_is_noticed_by_the_age_of_its_last_command() -> None:
    made = switch(spec(staleness="0.2 s"))
    made.arbitrate(0.0, [command(NOMINAL, OK, 0.0), command(SAFETY, OK, 0.0)])
    holders = []
    for tick in range(1, 7):
        time = tick * STEP
        proposals = [command(NOMINAL, SILENT, 0.0), command(SAFETY, OK, time)]
        _, authority = made.arbitrate(time, proposals)
        holders.append(int(authority.channel[0]))
    assert holders == [NOMINAL] * 4 + [SAFETY] * 2


EVERY = (
    spec(priority=IDS),
    spec(priority=IDS, latch=False, handover="0.1 s", meanwhile="coast"),
    spec(priority=IDS, policy="hysteresis", return_after="0.1 s"),
    spec(
        priority=IDS,
        policy="voting",
        voters=IDS,
        acceleration_tolerance="1 m/s^2",
        steering_tolerance="1 rad",
        bumpless={"jerk": "20 m/s^3", "steering_rate": "1 rad/s"},
    ),
    spec(priority=IDS, policy="stuck"),
)
NUMBERS = st.tuples(st.sampled_from([-6.0, 0.0, 0.7, np.nan]), st.floats(-0.4, 0.4))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(rows=st.lists(st.tuples(ROW, st.tuples(NUMBERS, NUMBERS, NUMBERS)), min_size=1, max_size=12))
def test_every_policy_gives_the_same_bits_beside_the_others_as_alone(
    rows: list[tuple[tuple[int, ...], tuple[tuple[float, float], ...]]],
) -> None:
    statuses, numbers = [row for row, _ in rows], [row for _, row in rows]
    alone = [ticks(switch(one, channels=IDS), statuses, numbers) for one in EVERY]
    batch = switch(*EVERY, channels=IDS)
    for tick, (row, given_numbers) in enumerate(rows):
        time = tick * STEP
        proposals = [
            ControlCommand(
                name,
                np.full(len(EVERY), given_numbers[k][0]),
                np.full(len(EVERY), given_numbers[k][1]),
                np.full(len(EVERY), -1.0 if row[k] == SILENT else time),
                np.full(len(EVERY), row[k], dtype=np.int64),
            )
            for k, name in enumerate(IDS)
        ]
        acting, authority = batch.arbitrate(time, proposals)
        for run, found in enumerate(alone):
            assert authority.channel[run] == found[tick].channel
            assert authority.reason[run] == found[tick].reason
            assert acting[run].tolist() == [found[tick].acceleration, found[tick].steering]
