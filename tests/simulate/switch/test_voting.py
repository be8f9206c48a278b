"""Who shall act: the majority among channels that vote, hysteresis, and what every policy keeps."""

from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye import signals as s
from adeye.simulate.switch import arbiter as columns
from adeye.spec.architecture import Switch
from tests.simulate.switch.rig import (
    IDS,
    NOMINAL,
    SAFETY,
    THIRD,
    Tick,
    hands,
    holders,
    spec,
    switch,
    ticks,
)

TOLERANCE = 1.0


def voting(**changes: object) -> Any:
    values = {
        "policy": "voting",
        "priority": IDS,
        "voters": IDS,
        "acceleration_tolerance": f"{TOLERANCE} m/s^2",
        "steering_tolerance": "0.1 rad",
    }
    return spec(**{**values, **changes})


def vote(*accelerations: float, states: str = "ooo", **changes: object) -> Tick:
    """Vote once, after a tick at which all agreed."""
    made = switch(voting(**changes), channels=IDS)
    rows = [[(0.0, 0.0)] * 3, [(value, 0.0) for value in accelerations]]
    return ticks(made, f"ooo {states}", rows)[-1]


def test_default_acts_while_a_majority_agrees_with_it() -> None:
    found = vote(1.0, 1.5, -8.0)
    assert (found.channel, found.reason, found.acceleration) == (NOMINAL, s.REASON_DEFAULT, 1.0)


def test_outvoted_default_gives_way_to_the_first_of_the_majority() -> None:
    found = vote(-8.0, 1.5, 1.0)
    assert (found.channel, found.reason, found.acceleration) == (SAFETY, s.REASON_VOTED, 1.5)
    turned = vote(-8.0, 1.5, 1.0, priority=["third", "safety", "nominal"])
    assert (turned.channel, turned.acceleration) == (THIRD, 1.0)


def test_commands_agree_up_to_and_with_the_tolerance() -> None:
    assert vote(0.0, 1.0, 9.0).reason == s.REASON_DEFAULT
    assert vote(0.0, 1.0 + 1e-9, 9.0).reason == s.REASON_NO_MAJORITY


def test_steering_that_differs_is_no_agreement() -> None:
    made = switch(voting(), channels=IDS)
    rows = [[(0.0, 0.0), (0.0, 0.3), (0.0, 0.35)]]
    (found,) = ticks(made, "ooo", rows)
    assert (found.channel, found.steering) == (SAFETY, 0.3)


def test_without_a_majority_the_ego_coasts_with_its_steering_held() -> None:
    made = switch(voting(), channels=IDS)
    rows = [[(1.0, 0.2)] * 3, [(0.0, 0.0), (3.0, 0.0), (-3.0, 0.0)]]
    found = ticks(made, "ooo*2", rows)[-1]
    assert found == Tick(s.NO_CHANNEL, s.REASON_NO_MAJORITY, 0.0, 0.2)


def test_without_a_majority_the_named_channel_acts_as_long_as_it_can() -> None:
    found = vote(0.0, 3.0, -3.0, without_majority="third")
    assert (found.channel, found.reason, found.acceleration) == (
        THIRD,
        s.REASON_NO_MAJORITY,
        -3.0,
    )
    gone = vote(0.0, 3.0, -3.0, states="oof", without_majority="third")
    assert (gone.channel, gone.reason) == (s.NO_CHANNEL, s.REASON_NO_MAJORITY)


def test_channel_above_the_default_keeps_what_it_took_without_a_majority() -> None:
    apart, together = [(0.0, 0.0), (3.0, 0.0), (-3.0, 0.0)], [(0.0, 0.0)] * 3
    for latch, then, why in (
        (True, THIRD, s.REASON_LATCHED),
        (False, NOMINAL, s.REASON_DEFAULT),
    ):
        pair = voting(**PAIR, without_majority="third", latch=latch)
        made = switch(pair, channels=IDS)
        found = ticks(made, "ooo*3", [together, apart, together])
        assert holders(found) == [NOMINAL, THIRD, then]
        assert found[2].reason == why


def test_usable_voters_must_be_a_majority_of_all_or_the_quorum() -> None:
    assert vote(0.0, 0.0, 0.0, states="oof").reason == s.REASON_DEFAULT
    assert vote(0.0, 0.0, 0.0, states="off").reason == s.REASON_NO_MAJORITY
    assert vote(0.0, 0.5, 9.0, quorum=3).reason == s.REASON_NO_MAJORITY
    assert vote(0.0, 0.5, 0.9, quorum=3).reason == s.REASON_DEFAULT


def test_median_of_those_that_agree_acts_for_each_part_of_the_command() -> None:
    made = switch(voting(vote="median"), channels=IDS)
    rows = [[(0.0, 0.04), (0.4, 0.0), (0.9, 0.02)], [(0.0, 0.04), (0.4, 0.0), (9.0, 0.02)]]
    three, two = ticks(made, "ooo*2", rows)
    assert (three.channel, three.acceleration, three.steering) == (NOMINAL, 0.4, 0.02)
    assert (two.channel, two.acceleration, two.steering) == (NOMINAL, 0.2, 0.02)
    for last in (0.9, 0.5):
        assert vote(0.5, 0.5, last, vote="median").acceleration == 0.5


PAIR: dict[str, Any] = {"voters": IDS[:2], "priority": ["third", "nominal", "safety"]}


def test_request_of_one_that_does_not_vote_is_granted_and_one_of_a_voter_is_not() -> None:
    asked = vote(0.0, 0.0, -5.0, states="oor", **PAIR)
    assert (asked.channel, asked.reason, asked.acceleration) == (THIRD, s.REASON_REQUEST, -5.0)
    voter = vote(0.0, 0.0, -5.0, states="oro", **PAIR)
    assert (voter.channel, voter.reason) == (NOMINAL, s.REASON_DEFAULT)


def test_granted_request_is_latched_and_given_up_only_when_it_cannot_act() -> None:
    found = ticks(switch(voting(**PAIR), channels=IDS), "oor ooo oof ooo")
    assert hands(found) == "ttnt"
    assert found[1].reason == s.REASON_LATCHED


def test_start_up_waits_for_the_first_majority_up_to_the_staleness_time() -> None:
    found = ticks(switch(voting(staleness="0.2 s"), channels=IDS), "o--*7")
    assert [tick.reason for tick in found] == [s.REASON_NO_CHANNEL] * 5 + [s.REASON_NO_MAJORITY] * 2


VALUES = st.floats(-9.0, 9.0)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(
    sound=st.tuples(VALUES, st.floats(-TOLERANCE, TOLERANCE)),
    wrong=st.one_of(VALUES, st.sampled_from([np.nan, np.inf, -np.inf])),
    status=st.sampled_from("of-r"),
    byzantine=st.integers(0, 2),
    kind=st.sampled_from(["majority", "median"]),
)
def test_one_of_three_that_lies_in_any_way_never_moves_the_ego_beyond_the_tolerance(
    sound: tuple[float, float], wrong: float, status: str, byzantine: int, kind: str
) -> None:
    one, other = sound[0], sound[0] + sound[1]
    if abs(one - other) > TOLERANCE:  # rounding
        other = one
    values = [one, other]
    values.insert(byzantine, wrong)
    states = ["o", "o"]
    states.insert(byzantine, status)
    found = vote(*values, states="".join(states), vote=kind)
    assert found.channel != s.NO_CHANNEL
    low, high = min(one, other) - TOLERANCE, max(one, other) + TOLERANCE
    assert low - 1e-12 <= found.acceleration <= high + 1e-12


# --- Who shall act: the return of hysteresis, and what holds under every policy -------------------

STATES = [s.OK, s.DEGRADED, s.REQUESTS_AUTHORITY, s.FAULT, s.SILENT]
VOTING: dict[str, Any] = {
    "policy": "voting",
    "voters": IDS,
    "acceleration_tolerance": "1 m/s^2",
    "steering_tolerance": "1 deg",
}


def returning(**changes: object) -> Any:
    return spec(**{"policy": "hysteresis", "return_after": "0.2 s", **changes})


THREE = ["third", "safety", "nominal"]
RETURNS: dict[str, tuple[dict[str, object], str, str]] = {
    "after the time of quiet": ({}, "oo or*2 oo*7", "nssssssnnn"),
    "silence breaks the quiet": ({}, "oo or oo*4 -o oo*6", "nssssssssssnn"),
    "a fault breaks the quiet": ({}, "oo or oo*4 fo oo*6", "nssssssssssnn"),
    "a degraded default breaks the quiet": ({}, "oo or oo*4 do oo*6", "nssssssssssnn"),
    "a request breaks the quiet": ({}, "oo or oo*4 or oo*6", "nssssssssssnn"),
    "so does one too short": ({"debounce": "0.05 s"}, "oo or*2 oo*3 or oo*6", "nnsssssssssnn"),
    "degraded is not healthy": ({}, "oo or do*6", "nsssssss"),
    "but where the file says so": ({"return_degraded": True}, "oo or do*6", "nsssssnn"),
    "of a lower one": ({"priority": ["nominal", "safety"]}, "oo fo oo*6", "nsssssnn"),
    "of a higher one that took it": ({"priority": THREE}, "ooo oro oor ooo*6", "nstttttnn"),
    "a holder that failed is first again": ({}, "oo or of oo*5", "nsnsssnn"),
}
"""Changes of the switch, states tick by tick, and who has authority."""


def test_default_acts_again_after_the_time_of_quiet() -> None:
    for name, (changes, states, expected) in RETURNS.items():
        channels = IDS if len(states.split()[0]) == 3 else IDS[:2]
        assert hands(ticks(switch(returning(**changes), channels=channels), states)) == expected, (
            name
        )


def test_reason_of_the_return_is_told() -> None:
    found = ticks(switch(returning()), "oo or*2 oo*7")
    held = [s.REASON_REQUEST] * 2 + [s.REASON_LATCHED] * 4
    again = [s.REASON_RETURNED] + [s.REASON_DEFAULT] * 2
    assert [tick.reason for tick in found] == [s.REASON_DEFAULT, *held, *again]
    lower = ticks(switch(returning(priority=["nominal", "safety"])), "oo fo")
    assert lower[1].reason == s.REASON_STALENESS


def test_return_at_once_is_no_latch() -> None:
    rows = "oo or oo -o oo"
    once = ticks(switch(returning(return_after="0 s")), rows)
    assert hands(once) == hands(ticks(switch(spec(latch=False)), rows))


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
            if status not in {s.FAULT, s.SILENT} and abs(number) < 10.0
        ]
        assert found.channel == s.NO_CHANNEL or 0 <= found.channel < len(IDS)
        if policy.get("policy") != "stuck" and found.channel != s.NO_CHANNEL:
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
        if taken and row[SAFETY] not in {s.FAULT, s.SILENT}:
            assert channel == SAFETY
        taken |= channel == SAFETY


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(
    rows=st.lists(st.tuples(*[st.sampled_from(STATES)] * 2), min_size=1, max_size=25),
    wait=st.integers(0, 5),
)
def test_hysteresis_returns_after_quiet_alone(rows: list[tuple[int, int]], wait: int) -> None:
    made = switch(returning(return_after=f"{wait * 50} ms"))
    quiet, before = 0, NOMINAL
    for row, channel in zip(rows, holders(ticks(made, rows)), strict=True):
        is_quiet = (
            row[NOMINAL] in {s.OK, s.REQUESTS_AUTHORITY} and row[SAFETY] != s.REQUESTS_AUTHORITY
        )
        quiet = quiet + 1 if is_quiet else 0
        if quiet > wait:
            assert channel == NOMINAL
        elif before == SAFETY and row[SAFETY] not in {s.FAULT, s.SILENT}:
            assert channel == SAFETY
        if channel != s.NO_CHANNEL:
            # A holder that failed for a while is not the one before, but it has its claim.
            before = channel


# Numbers that the compiled parts of the switch share fit what the file says.


def test_policies_are_those_of_the_file_in_its_order() -> None:
    assert get_args(Switch.model_fields["policy"].annotation) == columns.POLICIES
    numbers = (columns.FIXED_PRIORITY, columns.HYSTERESIS, columns.VOTING, columns.STUCK)
    assert numbers == tuple(range(len(columns.POLICIES)))
