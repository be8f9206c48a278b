"""The majority among channels that vote: which one acts, and that one faulty of three does not."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.ports import SwitchContext
from adeye.signals import (
    FAULT,
    NO_CHANNEL,
    OK,
    REASON_DEFAULT,
    REASON_LATCHED,
    REASON_NO_CHANNEL,
    REASON_NO_MAJORITY,
    REASON_REQUEST,
    REASON_VOTED,
    REQUESTS_AUTHORITY,
    SILENT,
)
from adeye.simulate.switch import make_switch
from tests.simulate.switch.rig import (
    IDS,
    NOMINAL,
    SAFETY,
    STEP,
    THIRD,
    Tick,
    command,
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


def vote(*accelerations: float, states: tuple[int, ...] = (OK, OK, OK), **changes: object) -> Tick:
    """Vote once, after a tick at which all agreed."""
    made = switch(voting(**changes), channels=IDS)
    rows = [[(0.0, 0.0)] * 3, [(value, 0.0) for value in accelerations]]
    return ticks(made, [(OK, OK, OK), states], rows)[-1]


def test_default_acts_while_a_majority_agrees_with_it() -> None:
    found = vote(1.0, 1.5, -8.0)
    assert (found.channel, found.reason, found.acceleration) == (NOMINAL, REASON_DEFAULT, 1.0)


def test_outvoted_default_gives_way_to_the_first_of_the_majority() -> None:
    found = vote(-8.0, 1.5, 1.0)
    assert (found.channel, found.reason, found.acceleration) == (SAFETY, REASON_VOTED, 1.5)
    turned = vote(-8.0, 1.5, 1.0, priority=["third", "safety", "nominal"])
    assert (turned.channel, turned.acceleration) == (THIRD, 1.0)


def test_commands_agree_up_to_and_with_the_tolerance() -> None:
    assert vote(0.0, 1.0, 9.0).reason == REASON_DEFAULT
    assert vote(0.0, 1.0 + 1e-9, 9.0).reason == REASON_NO_MAJORITY


def test_steering_that_differs_is_no_agreement() -> None:
    made = switch(voting(), channels=IDS)
    rows = [[(0.0, 0.0), (0.0, 0.3), (0.0, 0.35)]]
    (found,) = ticks(made, [(OK, OK, OK)], rows)
    assert (found.channel, found.steering) == (SAFETY, 0.3)


def test_without_a_majority_the_ego_coasts_with_its_steering_held() -> None:
    made = switch(voting(), channels=IDS)
    rows = [[(1.0, 0.2)] * 3, [(0.0, 0.0), (3.0, 0.0), (-3.0, 0.0)]]
    found = ticks(made, [(OK, OK, OK)] * 2, rows)[-1]
    assert found == Tick(NO_CHANNEL, REASON_NO_MAJORITY, 0.0, 0.2)


def test_without_a_majority_the_named_channel_acts_as_long_as_it_can() -> None:
    found = vote(0.0, 3.0, -3.0, without_majority="third")
    assert (found.channel, found.reason, found.acceleration) == (THIRD, REASON_NO_MAJORITY, -3.0)
    gone = vote(0.0, 3.0, -3.0, states=(OK, OK, FAULT), without_majority="third")
    assert (gone.channel, gone.reason) == (NO_CHANNEL, REASON_NO_MAJORITY)


def test_channel_above_the_default_keeps_what_it_took_without_a_majority() -> None:
    apart, together = [(0.0, 0.0), (3.0, 0.0), (-3.0, 0.0)], [(0.0, 0.0)] * 3
    for latch, then, why in ((True, THIRD, REASON_LATCHED), (False, NOMINAL, REASON_DEFAULT)):
        pair = voting(**PAIR, without_majority="third", latch=latch)
        found = ticks(switch(pair, channels=IDS), [(OK, OK, OK)] * 3, [together, apart, together])
        assert holders(found) == [NOMINAL, THIRD, then]
        assert found[2].reason == why


def test_usable_voters_must_be_a_majority_of_all_or_the_quorum() -> None:
    assert vote(0.0, 0.0, 0.0, states=(OK, OK, FAULT)).reason == REASON_DEFAULT
    assert vote(0.0, 0.0, 0.0, states=(OK, FAULT, FAULT)).reason == REASON_NO_MAJORITY
    assert vote(0.0, 0.5, 9.0, quorum=3).reason == REASON_NO_MAJORITY
    assert vote(0.0, 0.5, 0.9, quorum=3).reason == REASON_DEFAULT


def test_median_of_those_that_agree_acts_for_each_part_of_the_command() -> None:
    made = switch(voting(vote="median"), channels=IDS)
    rows = [[(0.0, 0.04), (0.4, 0.0), (0.9, 0.02)], [(0.0, 0.04), (0.4, 0.0), (9.0, 0.02)]]
    three, two = ticks(made, [(OK, OK, OK)] * 2, rows)
    assert (three.channel, three.acceleration, three.steering) == (NOMINAL, 0.4, 0.02)
    assert (two.channel, two.acceleration, two.steering) == (NOMINAL, 0.2, 0.02)
    for last in (0.9, 0.5):
        assert vote(0.5, 0.5, last, vote="median").acceleration == 0.5


PAIR: dict[str, Any] = {"voters": IDS[:2], "priority": ["third", "nominal", "safety"]}


def test_request_of_one_that_does_not_vote_is_granted_and_one_of_a_voter_is_not() -> None:
    asked = vote(0.0, 0.0, -5.0, states=(OK, OK, REQUESTS_AUTHORITY), **PAIR)
    assert (asked.channel, asked.reason, asked.acceleration) == (THIRD, REASON_REQUEST, -5.0)
    voter = vote(0.0, 0.0, -5.0, states=(OK, REQUESTS_AUTHORITY, OK), **PAIR)
    assert (voter.channel, voter.reason) == (NOMINAL, REASON_DEFAULT)


def test_granted_request_is_latched_and_given_up_only_when_it_cannot_act() -> None:
    rows = [(OK, OK, REQUESTS_AUTHORITY), (OK, OK, OK), (OK, OK, FAULT), (OK, OK, OK)]
    found = ticks(switch(voting(**PAIR), channels=IDS), rows)
    assert holders(found) == [THIRD, THIRD, NOMINAL, THIRD]
    assert found[1].reason == REASON_LATCHED


def test_start_up_waits_for_the_first_majority_up_to_the_staleness_time() -> None:
    rows = [(OK, SILENT, SILENT)] * 7
    found = ticks(switch(voting(staleness="0.2 s"), channels=IDS), rows)
    assert [tick.reason for tick in found] == [REASON_NO_CHANNEL] * 5 + [REASON_NO_MAJORITY] * 2


VALUES = st.floats(-9.0, 9.0)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(
    sound=st.tuples(VALUES, st.floats(-TOLERANCE, TOLERANCE)),
    wrong=st.one_of(VALUES, st.sampled_from([np.nan, np.inf, -np.inf])),
    status=st.sampled_from([OK, FAULT, SILENT, REQUESTS_AUTHORITY]),
    byzantine=st.integers(0, 2),
    kind=st.sampled_from(["majority", "median"]),
)
def test_one_of_three_that_lies_in_any_way_never_moves_the_ego_beyond_the_tolerance(
    sound: tuple[float, float], wrong: float, status: int, byzantine: int, kind: str
) -> None:
    one, other = sound[0], sound[0] + sound[1]
    if abs(one - other) > TOLERANCE:  # rounding
        other = one
    values = [one, other]
    values.insert(byzantine, wrong)
    states = [OK, OK]
    states.insert(byzantine, status)
    found = vote(*values, states=tuple(states), vote=kind)
    assert found.channel != NO_CHANNEL
    low, high = min(one, other) - TOLERANCE, max(one, other) + TOLERANCE
    assert low - 1e-12 <= found.acceleration <= high + 1e-12


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(values=st.lists(st.tuples(VALUES, VALUES, VALUES), min_size=1, max_size=5))
def test_runs_of_a_batch_vote_for_themselves(values: list[tuple[float, float, float]]) -> None:
    specs = [voting(vote=("majority", "median")[run % 2]) for run in range(len(values))]
    batch = make_switch(SwitchContext(specs, IDS, STEP))
    columns = np.array(values)
    proposals = [
        type(command(k, OK, 0.0))(
            name,
            columns[:, k].copy(),
            np.zeros(len(values)),
            np.zeros(len(values)),
            np.zeros(len(values), dtype=np.int64),
        )
        for k, name in enumerate(IDS)
    ]
    acting, authority = batch.arbitrate(0.0, proposals)
    for run, row in enumerate(values):
        alone = switch(specs[run], channels=IDS)
        (found,) = ticks(alone, [(OK, OK, OK)], [[(value, 0.0) for value in row]])
        assert (found.channel, found.reason) == (authority.channel[run], authority.reason[run])
        assert found.acceleration == acting[run, 0]
    # The switch works on copies: what the channels gave stays as it was.
    assert all((p.acceleration == columns[:, k]).all() for k, p in enumerate(proposals))
