"""The arbiter: who has authority, what acts, and why."""

from typing import Any

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


QUIET, ASKED = (OK, OK), (OK, REQUESTS_AUTHORITY)
DEFAULT, REQUEST = (NOMINAL, REASON_DEFAULT), (SAFETY, REASON_REQUEST)
STALE, LATCHED = (SAFETY, REASON_STALENESS), (SAFETY, REASON_LATCHED)
NOBODY = (NO_CHANNEL, REASON_NO_CHANNEL)
DECISIONS: dict[str, tuple[dict[str, object], list[Any], list[Any]]] = {
    "nobody requests": ({}, [QUIET], [DEFAULT]),
    "the default is degraded": ({}, [(DEGRADED, OK)], [DEFAULT]),
    "request": ({}, [QUIET, ASKED], [DEFAULT, REQUEST]),
    "request during start-up": ({}, [(SILENT, REQUESTS_AUTHORITY)], [REQUEST]),
    "request to a stuck switch": ({"policy": "stuck"}, [ASKED] * 2, [(NOMINAL, REASON_STUCK)] * 2),
    "request that stands": ({"debounce": "0.1 s"}, [ASKED] * 4, [DEFAULT] * 2 + [REQUEST] * 2),
    "request that is interrupted": (
        {"debounce": "0.1 s"},
        [ASKED, ASKED, QUIET] * 2,
        [DEFAULT] * 6,
    ),
    "request that ends": ({}, [ASKED, QUIET, QUIET], [REQUEST, LATCHED, LATCHED]),
    "request that ends, no latch": ({"latch": False}, [ASKED, QUIET], [REQUEST, DEFAULT]),
    "the default is silent": ({}, [QUIET, (SILENT, OK)], [DEFAULT, STALE]),
    "the default is in fault": ({}, [QUIET, (FAULT, OK)], [DEFAULT, STALE]),
    "the default recovers": ({}, [QUIET, (SILENT, OK), QUIET], [DEFAULT, STALE, LATCHED]),
    "the default recovers, no latch": (
        {"latch": False},
        [QUIET, (SILENT, OK), QUIET],
        [DEFAULT, STALE, DEFAULT],
    ),
    "the latched channel fails": (
        {},
        [ASKED, (OK, SILENT), QUIET],
        [REQUEST, (NOMINAL, REASON_STALENESS), LATCHED],
    ),
    # Without a first command it hands over only after the staleness time.
    "the default never spoke": (
        {"staleness": "0.2 s"},
        [(SILENT, OK)] * 7,
        [NOBODY] * 5 + [STALE] * 2,
    ),
}
"""Changes of the switch, states of both channels tick by tick, who has authority and why."""


def test_authority_is_that_of_the_states() -> None:
    for name, (changes, states, expected) in DECISIONS.items():
        assert drive(switch(spec(**changes)), *states) == expected, name


def test_old_command_is_replaced_only_beyond_the_staleness_time() -> None:
    # Whether its channel says that it is silent or goes on with an old stamp.
    for status in (OK, SILENT):
        made = switch(spec(staleness="0.2 s"))
        found = []
        for tick in range(7):
            time = tick * STEP
            proposals = [command(NOMINAL, status if tick else OK, 0.0), command(SAFETY, OK, time)]
            _, authority = made.arbitrate(time, proposals)
            found.append((int(authority.channel[0]), int(authority.reason[0])))
        assert found == [DEFAULT] * 5 + [STALE] * 2


def test_higher_priority_and_no_lower_one_overrides_a_latched_channel() -> None:
    quiet, safety, third = (OK, OK, OK), (OK, REQUESTS_AUTHORITY, OK), (OK, OK, REQUESTS_AUTHORITY)
    for rows, expected in (
        ((safety, third, quiet), [REQUEST, (THIRD, REASON_REQUEST), (THIRD, REASON_LATCHED)]),
        ((third, safety), [(THIRD, REASON_REQUEST), (THIRD, REASON_LATCHED)]),
    ):
        made = switch(spec(priority=["third", "safety", "nominal"]), channels=IDS)
        assert drive(made, *rows) == expected


def test_ego_coasts_with_held_steering_when_no_channel_can_act_or_a_stuck_one_not() -> None:
    silent = command(NOMINAL, SILENT, -1.0, (2.0, 0.5))
    for changes, other, expected in (
        ({}, command(SAFETY, FAULT, 0.0), NOBODY),
        ({"policy": "stuck"}, command(SAFETY, OK, STEP), (NOMINAL, REASON_STUCK)),
    ):
        made = switch(spec(**changes))
        made.arbitrate(0.0, [command(NOMINAL, OK, 0.0, (2.0, 0.3)), command(SAFETY, OK, 0.0)])
        acting, authority = made.arbitrate(STEP, [silent, other])
        assert acting.tolist() == [[0.0, 0.3]]
        assert (authority.channel[0], authority.reason[0]) == expected


def test_command_or_stamp_that_is_no_number_never_acts() -> None:
    for wrong in (
        command(NOMINAL, OK, STEP, (np.nan, 0.0)),
        command(NOMINAL, OK, STEP, (np.inf, 0.0)),
        command(NOMINAL, OK, np.nan),
    ):
        made = switch(spec())
        drive(made, (OK, OK))
        acting, authority = made.arbitrate(STEP, [wrong, command(SAFETY, OK, STEP, (-4.0, 0.0))])
        assert acting[0, 0] == -4.0
        assert authority.channel[0] == SAFETY


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
