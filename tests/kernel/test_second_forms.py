"""Closed forms and a second implementation of each agree on a hundred thousand random states."""

from __future__ import annotations

import math
import os
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

from adeye.kernel import boxes as geometry
from adeye.kernel import criticality, encounter
from adeye.kernel.reference_drivers import reactions as reactions
from tests.second import evading, following, plane, rules
from tests.second.agreement import between, disagreements

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.second.agreement import Draw

INF = math.inf

STATES = 100_000
FEW = 100 if os.environ.get("NUMBA_DISABLE_JIT") else 2_000

SEAMS = 2e-3
"""Share of states that may lie on a seam; the draws put some there on purpose."""


class Form(NamedTuple):
    """A form of the product, its second implementation and what its arguments are drawn from."""

    own: Callable[..., Any]
    second: Callable[..., Any]
    draws: tuple[Draw, ...]
    absolute: float = 1e-12
    """Difference up to which two numbers are the same beside a relative 1e-9."""


GAP = between(0.01, 150.0, 0.0, -0.5, INF, 20.0)
ROOM = between(0.01, 150.0, 0.0, -0.5, 20.0)
SPEED = between(0.0, 60.0, 0.0, 10.0, 20.0)
CLOSING = between(-30.0, 60.0, 0.0, 10.0)
FRONT = between(-30.0, 60.0, 0.0, 10.0, 20.0)
CHANGE = between(-9.0, 4.0, 0.0, -2.0, -5.0)
BRAKING = between(0.5, 12.0, 4.0, 8.0)
MAYBE = between(0.1, 12.0, 0.0, -1.0, 4.0, often=0.05)
SHORT = between(0.0, 3.0, 0.0, 1.0)
LIMITED = (between(0.0, 4.0, 0.0), between(5.0, 80.0, INF))
BESIDE = (
    between(-4.0, 4.0, 0.0), between(-4.0, 4.0, 0.0), SHORT, SHORT, between(0.0, 1.0),
    between(0.2, 2.0), between(0.0, 0.5, 0.1),
)  # fmt: skip
LENGTH = between(0.2, 18.0, 4.0)
TURN = between(-math.pi, math.pi, 0.0, 0.25, often=0.2)
PLACE = between(-80.0, 80.0, 0.0)
RATE = between(-40.0, 40.0, 0.0)


def raised_braking(gap: float, u_e: float, u_c: float, *some: float) -> float:
    """The fuzzy forms take braking that is more than the comfortable one; draws are added up."""
    tau, comfortable, more, lead, margin = some
    found: float = reactions.proactive_fuzzy_safety(
        gap, u_e, u_c, tau, comfortable, comfortable + more, lead, margin
    )
    return found


def raised_pfs(gap: float, u_e: float, u_c: float, *some: float) -> float:
    tau, comfortable, more, lead, margin = some
    return rules.pfs(gap, u_e, u_c, tau, comfortable, comfortable + more, lead, margin)


def raw_cfs(*state: float) -> float:
    whole: list[Any] = [*state[:6], state[5] + state[6], state[7] > 0.5]
    found: float = reactions.critical_fuzzy_safety(*whole)
    return found


def second_cfs(*state: float) -> float:
    whole: list[Any] = [*state[:6], state[5] + state[6], state[7] > 0.5]
    return rules.cfs(*whole)


def boxes(dx: float, dy: float, *bodies: float) -> tuple[plane.Box, plane.Box]:
    return plane.Box(0.0, 0.0, *bodies[:3]), plane.Box(dx, dy, *bodies[3:])


def own_planar(dx: float, dy: float, rate_x: float, rate_y: float, *bodies: float) -> float:
    one, other = bodies[:3], bodies[3:]
    found: float = encounter.planar_time_to_collision((dx, dy), (rate_x, rate_y), one, other)  # type: ignore[arg-type]
    return found


def own_closest(
    dx: float, dy: float, rate_x: float, rate_y: float, *bodies: float
) -> tuple[float, float]:
    one, other = bodies[:3], bodies[3:]
    return encounter.closest_encounter((dx, dy), (rate_x, rate_y), one, other)  # type: ignore[arg-type]


def own_distance(*bodies: float) -> float:
    return geometry.box_distance(bodies[:5], bodies[5:])  # type: ignore[arg-type]


def second_planar(dx: float, dy: float, rate_x: float, rate_y: float, *bodies: float) -> float:
    one, other = boxes(dx, dy, *bodies)
    return plane.ttc(one, other, (rate_x, rate_y))


def second_closest(
    dx: float, dy: float, rate_x: float, rate_y: float, *bodies: float
) -> tuple[float, float]:
    one, other = boxes(dx, dy, *bodies)
    return plane.closest(one, other, (rate_x, rate_y))


def second_distance(*bodies: float) -> float:
    return plane.distance(plane.Box(*bodies[:5]), plane.Box(*bodies[5:]))


def second_worst(*state: float) -> float:
    dx, dy, rate_x, rate_y, reach, acceleration = state
    return plane.worst_ttc((dx, dy), (rate_x, rate_y), reach, acceleration)


def added_crash(needed: float, mean: float, deviation: float, less: float, more: float) -> float:
    return criticality.crash_probability(needed, mean, deviation, mean - less, mean + more)


def second_crash(needed: float, mean: float, deviation: float, less: float, more: float) -> float:
    return rules.crash_probability(needed, mean, deviation, mean - less, mean + more)


MOTION = (PLACE, PLACE, RATE, RATE)
BODY = (TURN, LENGTH, LENGTH)

FORMS = {
    "ttc": Form(criticality.time_to_collision, following.ttc, (GAP, CLOSING)),
    "ettc": Form(
        criticality.enhanced_time_to_collision, following.ettc, (ROOM, CLOSING, CHANGE)
    ),
    "mttc": Form(
        criticality.modified_time_to_collision, following.mttc, (ROOM, SPEED, FRONT, CHANGE, CHANGE)
    ),
    "time_gap": Form(criticality.time_gap, following.time_gap, (GAP, SPEED)),
    "time_headway": Form(criticality.time_headway, following.headway, (GAP, LENGTH, SPEED)),
    "drac": Form(criticality.deceleration_rate_to_avoid_crash, following.drac, (GAP, CLOSING)),
    "mdrac": Form(criticality.modified_deceleration_rate, following.mdrac, (ROOM, CLOSING, SHORT)),
    "dst": Form(
        criticality.deceleration_to_safety_time, following.dst, (ROOM, CLOSING, SPEED, SHORT)
    ),
    "required": Form(
        criticality.required_deceleration, following.required, (GAP, SPEED, SPEED, CHANGE)
    ),
    "mtc": Form(criticality.margin_to_collision, following.mtc, (ROOM, SPEED, FRONT, BRAKING)),
    "psd": Form(criticality.proportion_of_stopping_distance, following.psd, (ROOM, SPEED, BRAKING)),
    "stopping": Form(criticality.stopping_distance, following.stopping, (SPEED, SHORT, MAYBE)),
    "ttb": Form(
        encounter.time_to_brake, evading.time_to_brake,
        (ROOM, CLOSING, SPEED, between(0.0, 20.0, INF, often=0.5), MAYBE),
    ),
    "ttk": Form(
        encounter.time_to_kickdown, evading.time_to_kickdown,
        (ROOM, CLOSING, LENGTH, between(-2.0, 10.0, -INF, often=0.2), MAYBE),
    ),
    "evasive_offset": Form(
        encounter.evasive_offset, evading.evasive_offset,
        (between(-4.0, 4.0, 0.0), between(-3.0, 3.0, 0.0), between(0.1, 4.0, 2.0)),
    ),
    "tts": Form(
        encounter.time_to_steer, evading.time_to_steer,
        (between(0.0, 20.0, INF), between(0.0, 5.0, 0.0), MAYBE),
    ),
    "ttr": Form(
        encounter.time_to_react, evading.time_to_react,
        (between(-10.0, 10.0, -INF, INF), between(-10.0, 10.0, -INF), between(-10.0, 10.0, -INF)),
    ),
    "stn": Form(
        encounter.steer_threat_number, evading.steer_threat,
        (between(0.0, 20.0, INF, 0.0), between(0.0, 5.0, 0.0), MAYBE),
    ),
    "planar_ttc": Form(
        own_planar, second_planar, (*MOTION, *BODY, *BODY)
    ),
    # Two polygons: places of corners are known to a rounding of the tens of metres that they are.
    "closest_encounter": Form(
        own_closest, second_closest, (*MOTION, *BODY, *BODY), 1e-10
    ),
    "distance": Form(
        own_distance, second_distance, (PLACE, PLACE, *BODY, PLACE, PLACE, *BODY), 1e-12
    ),
    "wttc": Form(
        encounter.worst_time_to_collision, second_worst,
        (*MOTION, between(1.0, 20.0, 5.0), between(0.0, 20.0, 0.0, 8.0)),
    ),
    "rss_same": Form(
        criticality.rss_longitudinal_distance, rules.rss_same,
        (SPEED, SPEED, SHORT, between(0.0, 5.0, 0.0), BRAKING, BRAKING, *LIMITED),
    ),
    "rss_opposite": Form(
        criticality.rss_opposite_distance, rules.rss_opposite,
        (SPEED, SPEED, SHORT, between(0.0, 5.0, 0.0), BRAKING, BRAKING, *LIMITED),
    ),
    "rss_lateral": Form(
        criticality.rss_lateral_distance, rules.rss_lateral, BESIDE
    ),
    "rss_lateral_printed": Form(
        partial(criticality.rss_lateral_distance, is_printed=True),
        rules.rss_lateral_printed, BESIDE,
    ),
    "rss_ratio": Form(
        criticality.safe_distance_ratio, rules.ratio, (between(-5.0, 150.0, 0.0), ROOM)
    ),
    "pfs": Form(
        raised_braking, raised_pfs,
        (ROOM, SPEED, SPEED, SHORT, BRAKING, BRAKING, BRAKING, between(0.0, 3.0, 2.0)),
    ),
    "cfs": Form(
        raw_cfs, second_cfs,
        (ROOM, SPEED, SPEED, CHANGE, SHORT, BRAKING, BRAKING, between(0.0, 1.0)),
    ),
    "r157_following": Form(reactions.r157_following_distance, rules.r157_following, (SPEED,)),
    "r157_cut_in": Form(
        reactions.cut_in_threshold, rules.cut_in_ttc, (CLOSING, between(0.0, 1.0, 0.35), BRAKING)
    ),
    # A probability is the difference of two that are known to a rounding of 1.
    "crash_probability": Form(
        added_crash, second_crash,
        (between(0.0, 14.0), between(2.0, 9.0), between(0.3, 2.0), between(1.0, 5.0),
         between(1.0, 5.0)),
        1e-13,
    ),
    "speed_change": Form(
        criticality.speed_change, rules.speed_change,
        (between(50.0, 40e3), between(50.0, 40e3, INF), between(0.0, 80.0)),
    ),
    "fatality": Form(
        criticality.fatality_probability, rules.fatality, (between(0.0, 50.0, 0.0, 31.74),)
    ),
}  # fmt: skip


SLOW_FORMS = {"wttc": 60}
"""States that a difference is looked for in, of second implementations that take long."""


def check(name: str, count: int) -> None:
    form = FORMS[name]
    generator = np.random.default_rng([count, *name.encode()])
    states = np.stack([draw(generator, count) for draw in form.draws], axis=1)
    wrong, seams = disagreements(form.own, form.second, states, absolute=form.absolute)
    assert wrong[:3] == [], f"{len(wrong)} of {count} states"
    assert seams <= max(3.0, SEAMS * count)


@pytest.mark.parametrize("name", FORMS)
def test_agrees_with_a_second_implementation(name: str) -> None:
    check(name, FEW)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMS)
def test_agrees_with_a_second_implementation_on_every_state(name: str) -> None:
    check(name, STATES)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMS)
def test_comparison_sees_a_difference_in_the_eighth_digit(name: str) -> None:
    form = FORMS[name]
    generator = np.random.default_rng([7, *name.encode()])
    states = np.stack([draw(generator, SLOW_FORMS.get(name, 300)) for draw in form.draws], axis=1)

    def off(*state: float) -> Any:
        found = form.own(*state)
        return (
            tuple(1.0000001 * x for x in found) if isinstance(found, tuple) else 1.0000001 * found
        )

    wrong, seams = disagreements(off, form.second, states, absolute=form.absolute)
    assert len(wrong) + seams > 10
    assert len(wrong) > 0


OF_A_STATE = {"evasive_offset": 1, "pfs": 3, "cfs": 4}
"""How many numbers are a state's, where the others are parameters that a state may not ask for."""


@pytest.mark.parametrize("name", FORMS)
def test_one_unknown_number_makes_the_answer_unknown(name: str) -> None:
    form = FORMS[name]
    draws = [draw(np.random.default_rng(11), 1).item() for draw in form.draws]
    for place in range(OF_A_STATE.get(name, len(draws))):
        found = form.own(*draws[:place], math.nan, *draws[place + 1 :])
        assert np.isnan(found).any(), place
