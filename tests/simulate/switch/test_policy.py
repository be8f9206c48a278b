"""Who shall act: the return of hysteresis, and what holds under every policy."""

from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.signals import (
    DEGRADED,
    FAULT,
    NO_CHANNEL,
    OK,
    REASON_DEFAULT,
    REASON_LATCHED,
    REASON_REQUEST,
    REASON_RETURNED,
    REASON_STALENESS,
    REQUESTS_AUTHORITY,
    SILENT,
)
from adeye.simulate.switch import arbiter as columns
from adeye.spec.switch import Switch
from tests.simulate.switch.rig import IDS, NOMINAL, SAFETY, THIRD, holders, spec, switch, ticks

ASKED = (OK, REQUESTS_AUTHORITY)
QUIET = (OK, OK)
STATES = [OK, DEGRADED, REQUESTS_AUTHORITY, FAULT, SILENT]
VOTING: dict[str, Any] = {
    "policy": "voting",
    "voters": IDS,
    "acceleration_tolerance": "1 m/s^2",
    "steering_tolerance": "1 deg",
}


def returning(**changes: object) -> Any:
    return spec(**{"policy": "hysteresis", "return_after": "0.2 s", **changes})


def test_default_acts_again_exactly_after_the_time_of_quiet() -> None:
    found = ticks(switch(returning()), [QUIET, ASKED, ASKED, *[QUIET] * 7])
    assert holders(found) == [NOMINAL] + [SAFETY] * 6 + [NOMINAL] * 3
    held = [REASON_REQUEST] * 2 + [REASON_LATCHED] * 4
    again = [REASON_RETURNED] + [REASON_DEFAULT] * 2
    assert [tick.reason for tick in found] == [REASON_DEFAULT, *held, *again]


def test_return_at_once_is_no_latch() -> None:
    rows = [QUIET, ASKED, QUIET, (SILENT, OK), QUIET]
    once = ticks(switch(returning(return_after="0 s")), rows)
    assert holders(once) == holders(ticks(switch(spec(latch=False)), rows))


def test_time_of_quiet_begins_again_when_it_is_broken() -> None:
    for broken in ((SILENT, OK), (FAULT, OK), (DEGRADED, OK), (OK, REQUESTS_AUTHORITY)):
        rows = [QUIET, ASKED, *[QUIET] * 4, broken, *[QUIET] * 6]
        found = holders(ticks(switch(returning()), rows))
        assert found == [NOMINAL] + [SAFETY] * 10 + [NOMINAL] * 2, broken


def test_request_too_short_to_be_granted_breaks_the_quiet() -> None:
    rows = [QUIET, ASKED, ASKED, *[QUIET] * 3, ASKED, *[QUIET] * 6]
    found = ticks(switch(returning(debounce="0.05 s")), rows)
    assert holders(found) == [NOMINAL] * 2 + [SAFETY] * 9 + [NOMINAL] * 2


def test_degraded_default_counts_as_healthy_only_where_the_file_says_so() -> None:
    rows = [QUIET, ASKED, *[(DEGRADED, OK)] * 6]
    never = ticks(switch(returning()), rows)
    again = ticks(switch(returning(return_degraded=True)), rows)
    assert holders(never) == [NOMINAL] + [SAFETY] * 7
    assert holders(again) == [NOMINAL] + [SAFETY] * 5 + [NOMINAL] * 2


def test_lower_channel_that_stood_in_keeps_authority_until_the_return() -> None:
    made = switch(returning(priority=["nominal", "safety"]))
    found = ticks(made, [QUIET, (FAULT, OK), *[QUIET] * 6])
    assert holders(found) == [NOMINAL] + [SAFETY] * 5 + [NOMINAL] * 2
    assert found[1].reason == REASON_STALENESS


def test_higher_request_overrides_the_holder_and_keeps_its_authority() -> None:
    made = switch(returning(priority=["third", "safety", "nominal"]), channels=IDS)
    asked = [(OK, REQUESTS_AUTHORITY, OK), (OK, OK, REQUESTS_AUTHORITY)]
    found = ticks(made, [(OK, OK, OK), *asked, *[(OK, OK, OK)] * 6])
    assert holders(found) == [NOMINAL, SAFETY] + [THIRD] * 5 + [NOMINAL] * 2


def test_holder_that_fails_gets_its_authority_back_before_the_return() -> None:
    rows = [QUIET, ASKED, (OK, FAULT), *[QUIET] * 5]
    found = ticks(switch(returning()), rows)
    assert holders(found) == [NOMINAL, SAFETY, NOMINAL] + [SAFETY] * 3 + [NOMINAL] * 2


NUMBERS = st.sampled_from([-6.0, 0.0, 0.5, 3.0, float("nan"), float("inf")])
TICK = st.lists(st.tuples(st.sampled_from(STATES), NUMBERS), min_size=3, max_size=3)
POLICIES = [
    {},
    {"latch": False},
    {"policy": "hysteresis", "return_after": "0.1 s"},
    VOTING,
    {**VOTING, "voters": IDS[:2], "without_majority": "third", "vote": "median"},
    {"policy": "stuck"},
]


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(
    rows=st.lists(TICK, min_size=1, max_size=14),
    policy=st.sampled_from(POLICIES),
    priority=st.permutations(IDS),
    handover=st.sampled_from(["0 s", "0.1 s"]),
    meanwhile=st.sampled_from(["keep", "coast"]),
)
def test_one_usable_channel_or_nobody_acts_under_every_policy(
    rows: list[list[tuple[int, float]]],
    policy: dict[str, Any],
    priority: list[str],
    handover: str,
    meanwhile: str,
) -> None:
    made = switch(
        spec(**policy, priority=priority, handover=handover, meanwhile=meanwhile), channels=IDS
    )
    statuses = [[status for status, _ in row] for row in rows]
    commands = [[(number, 0.1) for _, number in row] for row in rows]
    for tick, (row, found) in enumerate(zip(rows, ticks(made, statuses, commands), strict=True)):
        sound = [
            k
            for k, (status, number) in enumerate(row)
            if status not in {FAULT, SILENT} and abs(number) < 10.0
        ]
        assert found.channel == NO_CHANNEL or 0 <= found.channel < len(IDS)
        if policy.get("policy") != "stuck" and found.channel != NO_CHANNEL:
            assert found.channel in sound
        if found.channel not in sound:
            assert found.acceleration == 0.0, tick
        elif policy.get("vote") != "median":
            assert found.acceleration == row[found.channel][1]


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(rows=st.lists(st.tuples(*[st.sampled_from(STATES)] * 2), min_size=1, max_size=20))
def test_latched_authority_never_goes_back_while_its_channel_is_usable(
    rows: list[tuple[int, int]],
) -> None:
    taken = False
    for row, channel in zip(rows, holders(ticks(switch(spec()), rows)), strict=True):
        if taken and row[SAFETY] not in {FAULT, SILENT}:
            assert channel == SAFETY
        taken |= channel == SAFETY


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(
    rows=st.lists(st.tuples(*[st.sampled_from(STATES)] * 2), min_size=1, max_size=25),
    wait=st.integers(0, 5),
)
def test_hysteresis_returns_after_quiet_alone_and_then_always(
    rows: list[tuple[int, int]], wait: int
) -> None:
    made = switch(returning(return_after=f"{wait * 50} ms"))
    quiet, before = 0, NOMINAL
    for row, channel in zip(rows, holders(ticks(made, rows)), strict=True):
        is_quiet = row[NOMINAL] in {OK, REQUESTS_AUTHORITY} and row[SAFETY] != REQUESTS_AUTHORITY
        quiet = quiet + 1 if is_quiet else 0
        if quiet > wait:
            assert channel == NOMINAL
        elif before == SAFETY and row[SAFETY] not in {FAULT, SILENT}:
            assert channel == SAFETY
        if channel != NO_CHANNEL:
            # A holder that failed for a while is not the one before, but it has its claim.
            before = channel


# Numbers that the compiled parts of the switch share fit what the file says.


def test_policies_are_those_of_the_file_in_its_order() -> None:
    assert get_args(Switch.model_fields["policy"].annotation) == columns.POLICIES
    numbers = (columns.FIXED_PRIORITY, columns.HYSTERESIS, columns.VOTING, columns.STUCK)
    assert numbers == tuple(range(len(columns.POLICIES)))


def test_before_the_first_channel_is_neither_a_channel_nor_nobody() -> None:
    assert {columns.START, NO_CHANNEL} == {-2, -1}
