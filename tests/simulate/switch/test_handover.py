"""How authority passes: latency in ticks, what acts meanwhile, limited rates, a switch at fault."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye import signals as s
from tests.simulate.switch.rig import NOMINAL, SAFETY, STEP, Tick, hands, spec, switch, ticks

BRAKES = [(1.0, 0.1), (-6.0, -0.2)]


@pytest.mark.parametrize("latency", range(5))
def test_command_of_the_new_channel_acts_so_many_ticks_after_the_decision(latency: int) -> None:
    made = switch(spec(handover=f"{latency * 50} ms"))
    found = ticks(made, "oo*2 or*8", [BRAKES] * 10)
    assert hands(found) == "n" * (2 + latency) + "s" * (8 - latency)
    assert [tick.acceleration for tick in found] == [1.0] * (2 + latency) + [-6.0] * (8 - latency)
    assert [tick.reason for tick in found] == (
        [s.REASON_DEFAULT] * 2 + [s.REASON_HANDOVER] * latency + [s.REASON_REQUEST] * (8 - latency)
    )


def test_reason_of_the_decision_is_told_when_it_takes_effect() -> None:
    found = ticks(switch(spec(handover="0.1 s")), "oo or oo*3")
    assert [tick.reason for tick in found[1:]] == [
        s.REASON_HANDOVER,
        s.REASON_HANDOVER,
        s.REASON_REQUEST,
        s.REASON_LATCHED,
    ]


def test_ego_can_coast_meanwhile_with_its_steering_held() -> None:
    made = switch(spec(handover="0.1 s", meanwhile="coast"))
    found = ticks(made, "oo or*3", [BRAKES] * 4)
    assert found[1:3] == [Tick(s.NO_CHANNEL, s.REASON_HANDOVER, 0.0, 0.1)] * 2
    assert found[3] == Tick(SAFETY, s.REASON_REQUEST, -6.0, -0.2)


RETURNING: dict[str, object] = {"latch": False, "handover": "0.1 s"}
HANDS: dict[str, tuple[dict[str, object], str, str, str]] = {
    "the old channel fails meanwhile": ({"handover": "0.15 s"}, "oo or fo or*2", "", "nn.ns"),
    "withdrawn, the next waits in full": (RETURNING, "oo or*2 oo or*4", "", "nnnnnnss"),
    "nobody left, the next waits in full": (
        {"latch": False, "handover": "0.15 s"},
        "oo or*2 ff or*4",
        "",
        "nnn.nnns",
    ),
    "the first acts at once": ({"handover": "1 s"}, "-o oo*2", "", ".nn"),
    "nobody acts at once": ({"handover": "1 s"}, "oo ff oo", "", "n.n"),
    "the return takes its time": (RETURNING, "oo or*4 oo*4", "", "nnnssssnn"),
    "stuck with the present holder": ({"latch": False}, "oo or*2 oo*5", "...xxx..", "nsssssnn"),
    "stuck in a handover, begun again": ({"handover": "0.1 s"}, "oo or*6", "..xx...", "nnnnnns"),
}
"""Changes of the switch, states tick by tick, when it is stuck, and who has authority."""


def test_who_has_authority_on_the_way() -> None:
    for name, (changes, states, stuck, expected) in HANDS.items():
        found = ticks(switch(spec(**changes)), states, stuck=[tick == "x" for tick in stuck])
        assert hands(found) == expected, name


def test_who_fails_meanwhile_does_not_act_and_what_is_withdrawn_leaves_no_reason() -> None:
    found = ticks(switch(spec(handover="0.15 s")), "oo or fo", [BRAKES] * 3)
    assert found[2].acceleration == 0.0
    assert ticks(switch(spec(**RETURNING)), "oo or*2 oo")[3].reason == s.REASON_DEFAULT
    found = ticks(switch(spec(handover="1 s")), "-o oo*2")
    reasons = [s.REASON_NO_CHANNEL, s.REASON_DEFAULT, s.REASON_DEFAULT]
    assert [tick.reason for tick in found] == reasons


JERK, RATE = 20.0, 0.5


def test_acting_command_moves_to_the_new_one_at_its_limits() -> None:
    made = switch(spec(bumpless={"jerk": "20 m/s^3", "steering_rate": "2 rad/s"}))
    found = ticks(made, "oo or*9", [BRAKES] * 10)
    assert hands(found) == "nsssssssss"
    assert [tick.acceleration for tick in found] == pytest.approx(
        [1.0, 0.0, -1.0, -2.0, -3.0, -4.0, -5.0, -6.0, -6.0, -6.0]
    )
    assert [tick.steering for tick in found] == pytest.approx(
        [0.1, 0.0, -0.1, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2]
    )


def test_without_a_handover_the_command_is_not_limited() -> None:
    made = switch(spec(bumpless={"jerk": "1 m/s^3", "steering_rate": "1 deg/s"}))
    rows = [[(value, 0.1 * value), (0.0, 0.0)] for value in (0.0, 3.0, -9.0)]
    assert [tick.acceleration for tick in ticks(made, "oo*3", rows)] == [0.0, 3.0, -9.0]


def test_once_arrived_the_command_follows_its_channel_as_it_is() -> None:
    made = switch(spec(bumpless={"jerk": "100 m/s^3", "steering_rate": "10 rad/s"}))
    rows = [BRAKES, BRAKES, BRAKES, [(1.0, 0.1), (5.0, 0.6)]]
    found = ticks(made, "oo or*3", rows)
    assert [tick.acceleration for tick in found] == [1.0, -4.0, -6.0, 5.0]


def test_ego_coasts_at_once_and_the_next_channel_begins_from_there() -> None:
    made = switch(spec(bumpless={"jerk": "20 m/s^3", "steering_rate": "2 rad/s"}))
    found = ticks(made, "oo ff fo*2", [BRAKES] * 4)
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
    found = ticks(made, f"oo*{asked_at} or*{len(rows) - asked_at}", rows)
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


def test_stuck_switch_is_told_ignores_requests_and_coasts_with_a_holder_that_cannot_act() -> None:
    stuck = [False] * 3 + [True] * 3 + [False] * 2
    found = ticks(switch(spec(latch=False)), "oo or*2 oo*5", stuck=stuck)
    assert [tick.reason for tick in found[3:6]] == [s.REASON_STUCK] * 3
    assert found[6].reason == s.REASON_DEFAULT
    stuck = [False, True, True, True]
    found = ticks(switch(spec()), "oo or fr or", [BRAKES] * 4, stuck=stuck)
    assert hands(found) == "nnnn"
    assert [tick.acceleration for tick in found] == [1.0, 1.0, 0.0, 1.0]
    # Stuck from the start it lies at the default.
    found = ticks(switch(spec()), "or*2", stuck=[True, True])
    assert [(tick.channel, tick.reason) for tick in found] == [(NOMINAL, s.REASON_STUCK)] * 2


@pytest.mark.parametrize("late", [0, 1, 3])
def test_late_switch_takes_so_much_longer(late: int) -> None:
    made = switch(spec(handover="0.05 s"))
    found = ticks(made, "oo or*8", delay=[late * STEP] * 9)
    assert hands(found) == "n" * (2 + late) + "s" * (7 - late)


def test_only_a_change_that_is_decided_while_the_switch_is_late_is_late() -> None:
    before = ticks(switch(spec()), "oo or*6", delay=[0.0, 0.0, *[0.2] * 5])
    assert hands(before) == "nssssss"
    during = ticks(switch(spec()), "oo or*6", delay=[0.0, 0.2, *[0.0] * 5])
    assert hands(during) == "nnnnnss"


STATES = st.sampled_from([s.OK, s.REQUESTS_AUTHORITY, s.FAULT, s.SILENT])


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(
    rows=st.lists(st.tuples(STATES, STATES), min_size=1, max_size=20),
    onset=st.integers(0, 20),
    latch=st.booleans(),
)
def test_stuck_switch_never_changes_hands_and_before_it_nothing_differs(
    rows: list[tuple[int, int]], onset: int, latch: object
) -> None:
    sound = ticks(switch(spec(latch=latch)), rows)
    stuck = [tick >= onset for tick in range(len(rows))]
    found = ticks(switch(spec(latch=latch)), rows, stuck=stuck)
    assert found[:onset] == sound[:onset]
    held = [tick.channel for tick in sound[:onset] if tick.channel != s.NO_CHANNEL]
    assert {tick.channel for tick in found[onset:]} <= {held[-1] if held else NOMINAL}
