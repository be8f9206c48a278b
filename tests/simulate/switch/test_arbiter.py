"""The arbiter: who has authority, what acts, and why."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye import signals as s
from adeye.ports import SwitchModel
from tests.simulate.switch.rig import (
    IDS,
    NOMINAL,
    SAFETY,
    STEP,
    THIRD,
    Tick,
    command,
    spec,
    switch,
    ticks,
)

STATED = {
    "default": (NOMINAL, s.REASON_DEFAULT),
    "request": (SAFETY, s.REASON_REQUEST),
    "stale": (SAFETY, s.REASON_STALENESS),
    "latched": (SAFETY, s.REASON_LATCHED),
    "back": (NOMINAL, s.REASON_STALENESS),
    "stuck": (NOMINAL, s.REASON_STUCK),
    "nobody": (s.NO_CHANNEL, s.REASON_NO_CHANNEL),
    "third": (THIRD, s.REASON_REQUEST),
    "third_latched": (THIRD, s.REASON_LATCHED),
}


def drive(made: SwitchModel, statuses: str) -> list[tuple[int, int]]:
    """Arbitrate fresh commands of the given states."""
    return [(tick.channel, tick.reason) for tick in ticks(made, statuses)]


def stated(words: str) -> list[tuple[int, int]]:
    return [STATED[word] for word in words.split()]


LATE, WAITS, FREE = {"staleness": "0.2 s"}, {"debounce": "0.1 s"}, {"latch": False}
DECISIONS: dict[str, tuple[dict[str, Any], str, str]] = {
    "nobody requests": ({}, "oo", "default"),
    "the default is degraded": ({}, "do", "default"),
    "request": ({}, "oo or", "default request"),
    "request during start-up": ({}, "-r", "request"),
    "request to a stuck switch": ({"policy": "stuck"}, "or*2", "stuck stuck"),
    "request that stands": (WAITS, "or*4", "default default request request"),
    "request that is interrupted": (WAITS, "or*2 oo or*2 oo", "default " * 6),
    "request that ends": ({}, "or oo oo", "request latched latched"),
    "request that ends, no latch": (FREE, "or oo", "request default"),
    "the default is silent": ({}, "oo -o", "default stale"),
    "the default is in fault": ({}, "oo fo", "default stale"),
    "the default recovers": ({}, "oo -o oo", "default stale latched"),
    "the default recovers, no latch": (FREE, "oo -o oo", "default stale default"),
    "the latched channel fails": ({}, "or o- oo", "request back latched"),
    # Without a first command it hands over only after the staleness time.
    "the default never spoke": (LATE, "-o*7", "nobody " * 5 + "stale stale"),
}
"""Changes of the switch, states of both channels tick by tick, who has authority and why."""


def test_authority_is_that_of_the_states() -> None:
    for name, (changes, states, expected) in DECISIONS.items():
        assert drive(switch(spec(**changes)), states) == stated(expected), name


def test_old_command_is_replaced_only_beyond_the_staleness_time() -> None:
    # Whether its channel says that it is silent or goes on with an old stamp.
    for status in (s.OK, s.SILENT):
        made = switch(spec(staleness="0.2 s"))
        found = []
        for tick in range(7):
            time = tick * STEP
            proposals = [
                command(NOMINAL, status if tick else s.OK, 0.0),
                command(SAFETY, s.OK, time),
            ]
            _, authority = made.arbitrate(time, proposals)
            found.append((int(authority.channel[0]), int(authority.reason[0])))
        assert found == stated("default " * 5 + "stale stale")


def test_higher_priority_and_no_lower_one_overrides_a_latched_channel() -> None:
    for rows, expected in (
        ("oro oor ooo", "request third third_latched"),
        ("oor oro", "third third_latched"),
    ):
        made = switch(spec(priority=["third", "safety", "nominal"]), channels=IDS)
        assert drive(made, rows) == stated(expected)


def test_ego_coasts_with_held_steering_when_no_channel_can_act_or_a_stuck_one_not() -> None:
    silent = command(NOMINAL, s.SILENT, -1.0, (2.0, 0.5))
    for changes, other, expected in (
        ({}, command(SAFETY, s.FAULT, 0.0), "nobody"),
        ({"policy": "stuck"}, command(SAFETY, s.OK, STEP), "stuck"),
    ):
        made = switch(spec(**changes))
        made.arbitrate(0.0, [command(NOMINAL, s.OK, 0.0, (2.0, 0.3)), command(SAFETY, s.OK, 0.0)])
        acting, authority = made.arbitrate(STEP, [silent, other])
        assert acting.tolist() == [[0.0, 0.3]]
        assert (authority.channel[0], authority.reason[0]) == STATED[expected]


def test_command_or_stamp_that_is_no_number_never_acts() -> None:
    for wrong in (
        command(NOMINAL, s.OK, STEP, (np.nan, 0.0)),
        command(NOMINAL, s.OK, STEP, (np.inf, 0.0)),
        command(NOMINAL, s.OK, np.nan),
    ):
        made = switch(spec())
        drive(made, "oo")
        acting, authority = made.arbitrate(STEP, [wrong, command(SAFETY, s.OK, STEP, (-4.0, 0.0))])
        assert acting[0, 0] == -4.0
        assert authority.channel[0] == SAFETY


def test_channel_outside_the_priority_list_never_acts() -> None:
    made = switch(spec(), channels=IDS)
    assert drive(made, "ooo --r")[-1] == STATED["nobody"]


ROW = st.tuples(*[st.sampled_from([s.OK, s.DEGRADED, s.REQUESTS_AUTHORITY, s.FAULT, s.SILENT])] * 3)


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
    batch, runs = switch(*EVERY, channels=IDS), len(EVERY)
    for tick, (row, given_numbers) in enumerate(rows):
        time = tick * STEP
        proposals = []
        for name, status, numbers_of_one in zip(IDS, row, given_numbers, strict=True):
            values = (*numbers_of_one, -1.0 if status == s.SILENT else time)
            one, two, stamp = (np.full(runs, value) for value in values)
            proposals.append(s.ControlCommand(name, one, two, stamp, np.full(runs, status)))
        kept = [item.copy() for item in proposals]
        acting, authority = batch.arbitrate(time, proposals)
        for run, found in enumerate(alone):
            here = int(authority.channel[run]), int(authority.reason[run]), *acting[run].tolist()
            assert Tick(*here) == found[tick]
        # The switch works on copies: what the channels gave stays as it was.
        for made, other in zip(proposals, kept, strict=True):
            assert made.acceleration.tobytes() == other.acceleration.tobytes()
