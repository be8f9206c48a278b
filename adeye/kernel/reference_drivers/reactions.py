"""What the reference drivers of UN R157 see, by which numbers they act, and what they share."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.criticality import (
    rss_longitudinal_distance,
    time_to_collision,
)
from adeye.kernel.jit import compiled

# --- What reference drivers see, what they remember and by which numbers they act: array columns --

CC, FSM, RSS, REG157 = range(4)

# What a driver sees, one number each.
EGO_SPEED: Final = 0
"""Of the ego along its lane, >= 0 [m/s]."""
EGO_ACCELERATION: Final = 1
"""Of the ego, as it was over the last tick [m/s^2]."""
OTHER_SPEED: Final = 2
"""Of the other along the ego's lane, >= 0 [m/s]."""
OTHER_ACCELERATION: Final = 3
"""Of the other along the ego's lane [m/s^2]."""
GAP: Final = 4
"""From the ego's front to the other's rear along the lane, negative beside each other [m]."""
LENGTHS: Final = 5
"""Length of the ego plus length of the other [m]."""
LATERAL_GAP: Final = 6
"""Sideways from edge to edge [m]; <= 0 where the other is in the ego's path."""
LATERAL_SPEED: Final = 7
"""Of the other towards the ego's path, negative away from it [m/s]."""
CUE: Final = 8
"""How far the vehicle whose change of lane brings the conflict is off its lane's centre [m].

That of the other towards the ego's lane for a cut-in, that of the leaving lead, either way, for a
cut-out; 0 without one."""
INTRUSION: Final = 9
"""How far the other's nearest edge is inside the ego's lane, negative outside [m]."""
OVERLAP: Final = 10
"""Common width of both over the smaller of their widths, 0 to 1."""
VIEW_SIZE: Final = 11

# What a driver remembers.
PERCEIVED: Final = 0
"""For how long it has evaluated the risk [s]."""
DELAYED: Final = 1
"""How much of its delay has passed [s]."""
DECELERATION: Final = 2
"""How much it brakes [m/s^2]."""
REACTING: Final = 3
"""1 from the decision to brake until the conflict is over."""
EMERGENCY: Final = 4
"""How much the automatic emergency braking brakes [m/s^2]."""
CAME_FROM_SIDE: Final = 5
"""1 while the other is a vehicle that cuts in."""
STATE_SIZE: Final = 6

# Parameters that all have at the same place.
BESIDE: Final = 0
"""Up to which share of both lengths the other may be beside the ego and still be ahead."""
DELAY: Final = 1
"""From the decision to the brake [s]."""
COASTING: Final = 2
"""Deceleration during the delay [m/s^2]."""
JERK: Final = 3
"""Growth of the deceleration [m/s^3]."""
MOST: Final = 4
"""Full deceleration [m/s^2]."""

CC_WANDERING: Final = 5
CC_PERCEPTION: Final = 6
CC_CRITICAL_TTC: Final = 7
CC_HEADWAY: Final = 8
CC_LEAD_BRAKING: Final = 9
CC_EMERGENCY_JERK: Final = 10
CC_EMERGENCY_BRAKING: Final = 11
CC_FULL_OVERLAP: Final = 12
CC_PERCEPTION_WAY: Final = 13
"""Sideways way by which a cut-in is perceived, in place of a time [m]; infinity: by the time."""
CC_LEAD_AT_ONCE: Final = 14
"""1 if any lead that closes in is answered at once, to standstill."""

FSM_COMFORTABLE: Final = 5
FSM_LEAD_BRAKING: Final = 6
FSM_MARGIN: Final = 7
FSM_LATERAL_GUARD: Final = 8
FSM_RAW_ACCELERATION: Final = 9

RSS_ACCELERATION: Final = 5
RSS_LEAST_BRAKING: Final = 6
RSS_MOST_BRAKING: Final = 7
RSS_LATERAL_ACCELERATION: Final = 8
RSS_LATERAL_BRAKING: Final = 9
RSS_FLUCTUATION: Final = 10
RSS_OTHER_ONLY: Final = 11
RSS_LEAD_BRAKES: Final = 12
"""For how long a lead may brake before the distance to follow it is the safe one [s]."""

REG157_INTRUSION: Final = 5
REG157_LATERAL_GAP: Final = 6
REG157_GUARD: Final = 7
REG157_LEAD_BRAKING: Final = 8
REG157_LOOKS_AHEAD: Final = 9
REG157_RESERVE: Final = 10
"""In the threshold [s]; as long as the delay of the driver, unless that has none."""
REG157_RELEASES: Final = 11
"""1 if it brakes only as long as the TTC is below the threshold."""
REG157_LEAD_AT_ONCE: Final = 12
"""1 if any lead that closes in is answered at once, to standstill."""
REG157_HEADWAY: Final = 13
"""With which it follows [s]; infinity: at the distances of paragraph 5.2.3.3."""

PARAMETER_SIZE: Final = 15

CUT_IN, CUT_OUT, BRAKING_LEAD = range(3)

EXACT: Final = 0
"""Constant acceleration over the step, standstill within it."""
SEMI_IMPLICIT: Final = 1
"""New speed first, then the way at the new speed, as in the published code."""

# What a scene is, one number each.
S_EGO_SPEED: Final = 0
"""[m/s]."""
S_OTHER_SPEED: Final = 1
"""Of the vehicle that cuts in, cuts out or brakes [m/s]."""
S_GAP: Final = 2
"""From the ego's front to that vehicle's rear [m]; NaN: what the driver keeps when it follows."""
S_LATERAL_SPEED: Final = 3
"""Of the change of lane [m/s]."""
S_LATERAL_OFFSET: Final = 4
"""From the ego's centre line to that of the vehicle that cuts in, at the beginning [m]."""
S_FRONT_GAP: Final = 5
"""From the front of the vehicle that cuts out to the rear of the standing one [m]."""
S_BRAKING: Final = 6
"""Full deceleration of the lead [m/s^2]."""
S_BRAKING_JERK: Final = 7
"""Growth of the lead's deceleration [m/s^3]; infinity: at once."""
S_EGO_LENGTH: Final = 8
S_EGO_WIDTH: Final = 9
S_OTHER_LENGTH: Final = 10
S_OTHER_WIDTH: Final = 11
S_LANE_WIDTH: Final = 12
S_LATERAL_ACCELERATION: Final = 13
"""With which the sideways speed of a cut-in grows before the gap is as given, > 0 [m/s^2];
infinity or 0: it has that speed at once."""
SCENE_SIZE: Final = 14

# What comes out.
R_CONTACT: Final = 0
"""1 with contact, 0 without, NaN if it is undecided after ``LONGEST`` or something is unknown."""
R_IMPACT_SPEED: Final = 1
"""Speed at which the gap closed at the contact [m/s]; NaN without one."""
R_MIN_GAP: Final = 2
"""Least gap to a vehicle in the ego's path [m], 0 with contact, infinity without such a one."""
R_BRAKING_TIME: Final = 3
"""When the ego first slowed down [s]; NaN if it never did."""
RESULT_SIZE: Final = 4


# --- Numbers by which the reference drivers act: by edition of the rules and by named variant -----

GRAVITY: Final = 9.81

MODELS: Final[Mapping[str, int]] = MappingProxyType(
    {"cc": CC, "fsm": FSM, "rss": RSS, "reg157": REG157}
)


class Edition(NamedTuple):
    """What an edition of the rules says that others do not."""

    title: str
    delay: float
    """In the threshold of the cut-in rule [s]."""
    braking: float
    """In the threshold of the cut-in rule [m/s^2]."""
    highest_speed: float
    """For which the edition is written [m/s]."""


EDITIONS: Final[Mapping[str, Edition]] = MappingProxyType(
    {
        "r157": Edition("UN R157, original text", 0.35, 6.0, 60.0 / 3.6),
        "r157-01": Edition("UN R157, 01 series of amendments", 0.35, 6.0, 130.0 / 3.6),
        "eu-2022-1426": Edition("Regulation (EU) 2022/1426", 0.25, 6.0, 130.0 / 3.6),
        "eu-2022-1426-standing": Edition(
            "Regulation (EU) 2022/1426, standing passengers", 0.16, 2.4, 130.0 / 3.6
        ),
    }
)

VARIANTS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "jrc-guard": "reg157 brakes at 0.1 s above the threshold, without a look at the next tick",
        "jrc-lateral": "reg157 takes 0.5 m from edge to edge for the lane intrusion",
        "jrc-release": "reg157 brakes only as long as the TTC is below the threshold",
        "jrc-raw-acceleration": "CFS takes the whole braking of an ego that is soon slow enough",
        "jrc-ttc-end": "a cut-in of cc ends without contact once the TTC at overlap is above 2 s",
        "jrc-coasting": "cc decelerates by 0.4 m/s2 during its delay",
        "jrc-perception": "cc needs no time to evaluate, from overlap or from the first closing",
        "jrc-no-emergency": "cc has no automatic emergency braking",
        "jrc-rss-lateral": "the lateral distance of rss counts the other's movement only",
        "jrc-beside": "an other beside the ego counts while its centre is ahead",
        "jrc-lead": "cc and reg157 brake to standstill for any lead that closes in",
        "jrc-distance": "behind a lead rss begins 0.75 s of its braking further off, reg157 at 2 s",
        "jrc-first-step": "all move a step before the first look, unless a cut-in's speed grows",
        "esmini-gravity": "cc brakes by shares of 9.8 m/s2",
        "esmini-reaction": "reg157 has no delay; its threshold keeps the 0.35 s",
        "esmini-perception": "cc perceives a cut-in by 0.72 m of its way, not by 0.4 s",
    }
)
"""What each variant changes."""

GROUPS: Final[Mapping[str, frozenset[str]]] = MappingProxyType(
    {
        "jrc": frozenset(name for name in VARIANTS if name.startswith("jrc-")),
        "esmini": frozenset(
            {
                *(name for name in VARIANTS if name.startswith("esmini-")),
                *("jrc-guard", "jrc-release", "jrc-raw-acceleration"),
                *("jrc-coasting", "jrc-rss-lateral"),
            }
        ),
    }
)
"""Variants of one program under one name."""

_ESMINI_GRAVITY: Final = 9.8
_JRC_HEADWAY: Final = 2.0


@dataclass(frozen=True, slots=True)
class _Driver:
    """What all drivers have, in the order of the columns; their own fields follow."""

    beside: float = 0.0
    delay: float = 0.75
    coasting: float = 0.0
    jerk: float = 12.65
    braking: float = 0.774 * GRAVITY


@dataclass(frozen=True, slots=True)
class CarefulDriver(_Driver):
    """Careful and competent driver; fields in the order of the columns."""

    wandering: float = 0.375
    perception: float = 0.4
    critical_ttc: float = 2.0
    headway: float = 2.0
    lead_braking: float = 5.0
    emergency_jerk: float = 0.85 * GRAVITY / 0.6
    emergency_braking: float = 0.85 * GRAVITY
    # Centres are never exactly in line in a closed loop: our reading of "full wrap".
    full_overlap: float = 0.95
    perception_way: float = math.inf
    lead_at_once: float = 0.0


@dataclass(frozen=True, slots=True)
class FuzzyDriver(_Driver):
    """Fuzzy safety model; fields in the order of the columns."""

    braking: float = 6.0
    comfortable: float = 4.0
    lead_braking: float = 7.0
    margin: float = 2.0
    lateral_guard: float = 0.1
    raw_acceleration: float = 0.0


@dataclass(frozen=True, slots=True)
class ResponsibleDriver(_Driver):
    """Responsibility-sensitive safety with the numbers of JRC-FSM; fields as the columns."""

    acceleration: float = 3.0
    least_braking: float = 6.0
    most_braking: float = 6.0
    lateral_acceleration: float = 1.0
    lateral_braking: float = 1.0
    fluctuation: float = 0.3
    other_only: float = 0.0
    lead_brakes: float = 0.0


@dataclass(frozen=True, slots=True)
class CutInRule(_Driver):
    """Cut-in rule of paragraph 5.2.5.2; fields in the order of the columns."""

    delay: float = 0.35
    jerk: float = math.inf
    braking: float = 6.0
    intrusion: float = 0.3
    lateral_gap: float = 0.0
    guard: float = 0.0
    lead_braking: float = 5.0
    looks_ahead: float = 1.0
    reserve: float = 0.35
    releases: float = 0.0
    lead_at_once: float = 0.0
    headway: float = math.inf


Parameters = CarefulDriver | FuzzyDriver | ResponsibleDriver | CutInRule


def parameters_of(model: str, edition: str = "r157-01", variant: Sequence[str] = ()) -> Parameters:
    """Return the parameters of a model.

    Args:
        model: One of ``MODELS``.
        edition: One of ``EDITIONS``; it changes ``reg157`` only.
        variant: Names out of ``VARIANTS`` or ``GROUPS``.

    Raises:
        KeyError: If a name is unknown.
    """
    rules = EDITIONS[edition]
    names = named(variant)
    beside = 0.5 if "jrc-beside" in names else 0.0
    if model == "cc":
        return replace(_careful(names), beside=beside)
    if model == "fsm":
        raw = 1.0 if "jrc-raw-acceleration" in names else 0.0
        return FuzzyDriver(beside=beside, raw_acceleration=raw)
    if model == "rss":
        rss = ResponsibleDriver(beside=beside)
        if "jrc-rss-lateral" in names:
            rss = replace(rss, other_only=1.0)
        return replace(rss, lead_brakes=rss.delay) if "jrc-distance" in names else rss
    if model != "reg157":
        raise KeyError(model)
    return replace(_rule(rules, names), beside=beside)


def named(variant: Collection[str]) -> frozenset[str]:
    """Return the single variants that some names mean.

    Raises:
        KeyError: If a name is unknown.

    >>> named(("jrc-guard",)) < named(("jrc",))
    True
    """
    names: set[str] = set()
    for name in variant:
        if name not in VARIANTS and name not in GROUPS:
            raise KeyError(name)
        names |= GROUPS.get(name, {name})
    return frozenset(names)


def _careful(names: frozenset[str]) -> CarefulDriver:
    driver = CarefulDriver()
    if "esmini-gravity" in names:
        share = _ESMINI_GRAVITY / GRAVITY
        driver = replace(
            driver,
            braking=driver.braking * share,
            jerk=0.774 * _ESMINI_GRAVITY / 0.6,
            emergency_braking=driver.emergency_braking * share,
            emergency_jerk=driver.emergency_jerk * share,
        )
    if "esmini-perception" in names:
        driver = replace(driver, perception_way=0.72)
    if "jrc-coasting" in names:
        driver = replace(driver, coasting=0.4)
    if "jrc-perception" in names:
        driver = replace(driver, wandering=math.inf, perception=0.0, headway=math.inf)
    if "jrc-no-emergency" in names:
        driver = replace(driver, emergency_jerk=0.0, emergency_braking=0.0)
    return replace(driver, lead_at_once=1.0) if "jrc-lead" in names else driver


def _rule(rules: Edition, names: frozenset[str]) -> CutInRule:
    rule = CutInRule(delay=rules.delay, reserve=rules.delay, braking=rules.braking)
    if "esmini-reaction" in names:
        rule = replace(rule, delay=0.0)
    if "jrc-guard" in names:
        rule = replace(rule, guard=0.1, looks_ahead=0.0)
    if "jrc-lateral" in names:
        rule = replace(rule, intrusion=math.inf, lateral_gap=0.5)
    if "jrc-release" in names:
        rule = replace(rule, releases=1.0)
    if "jrc-lead" in names:
        rule = replace(rule, lead_at_once=1.0)
    return replace(rule, headway=_JRC_HEADWAY) if "jrc-distance" in names else rule


def vector(parameters: Parameters) -> NDArray[np.float64]:
    """Return parameters as a row for the kernels, shape (PARAMETER_SIZE,)."""
    row = np.zeros(PARAMETER_SIZE)
    values = astuple(parameters)
    row[: len(values)] = values
    return row


# --- What the reference drivers share: what is ahead, the delay, the ramp, the end of a danger ----

Floats = NDArray[np.float64]

# Sums of steps may miss a time by their rounding, differences a deceleration or nothing.
ROUNDING: Final = 1e-9


@compiled
def is_unknown(view: Floats) -> bool:
    """Tell whether something that is seen is no number."""
    total = 0.0
    for column in range(VIEW_SIZE):
        total += 0.0 * view[column]
    return math.isnan(total)


@compiled
def is_ahead(view: Floats, parameters: Floats) -> bool:
    """Tell whether the other is ahead of the ego, or as far beside it as counts."""
    return view[GAP] >= -parameters[BESIDE] * view[LENGTHS]


@compiled
def note_side(view: Floats, state: Floats) -> None:
    """Note whether the other is one that cuts in; who is no longer nearer is a lead."""
    if view[LATERAL_GAP] > 0.0:
        state[CAME_FROM_SIDE] = 1.0
    elif view[EGO_SPEED] <= view[OTHER_SPEED]:
        state[CAME_FROM_SIDE] = 0.0


@compiled
def is_lead_at_once(view: Floats, parameters: Floats, state: Floats) -> bool:
    """Tell whether a lead brakes or closes in, or did so since: the answer goes to standstill."""
    if view[LATERAL_GAP] > 0.0 or state[CAME_FROM_SIDE] > 0.0 or not is_ahead(view, parameters):
        return False
    closes = view[EGO_SPEED] - view[OTHER_SPEED] > ROUNDING
    return closes or view[OTHER_ACCELERATION] < -ROUNDING or state[REACTING] > 0.0


@compiled
def respond(parameters: Floats, state: Floats, most: float, step: float) -> float:
    """Return the acceleration of one tick of a driver who has decided to brake [m/s^2]."""
    if state[DELAYED] < parameters[DELAY] - ROUNDING:
        state[DELAYED] += step
        state[DECELERATION] = parameters[COASTING]
    else:
        state[DECELERATION] = min(state[DECELERATION] + parameters[JERK] * step, most)
    return 0.0 - state[DECELERATION]


@compiled
def react(
    parameters: Floats,
    state: Floats,
    is_dangerous: bool,  # noqa: FBT001 - compiled
    most: float,
    step: float,
) -> float:
    """Return the limit of a driver who brakes as long as there is danger, and no longer.

    How hard it braked is remembered: a danger that flickers is no new ramp each time.
    """
    if is_dangerous:
        state[REACTING] = 1.0
        return respond(parameters, state, most, step)
    state[REACTING] = 0.0
    return math.inf


# --- Distances that reference drivers keep, and the cut-ins that UN R157 asks to master -----------

VISIBLE: Final = 0.72
"""For how long the lateral movement must have been visible before the lane intrusion [s]."""

# UN R157, paragraph 5.2.3.3: speed [km/h] and minimum time gap [s] for M1 and N1.
_SPEEDS: Final = (7.2, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0)
_TIME_GAPS: Final = (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6)
_STANDSTILL: Final = 2.0


@compiled
def r157_following_distance(speed: float) -> float:
    """Return the least following distance of a car [m].

    Args:
        speed: >= 0 [m/s].

    Returns:
        The distance of the interpolated time gap; 2 m at least; the time gap of 60 km/h above it.

    Source:
        UN R157, paragraph 5.2.3.3, M1 and N1.
    """
    if math.isnan(speed):
        return math.nan
    gap = _TIME_GAPS[6]
    for k in range(6, 0, -1):
        high = _SPEEDS[k] / 3.6
        low = _SPEEDS[k - 1] / 3.6
        if speed <= high:
            share = max(speed - low, 0.0) / (high - low)
            gap = _TIME_GAPS[k - 1] + share * (_TIME_GAPS[k] - _TIME_GAPS[k - 1])
    return max(speed * gap, _STANDSTILL)


@compiled
def following_distance(model: int, parameters: Floats, speed: float) -> float:
    """Return the gap with which a driver follows a vehicle as fast as itself [m].

    Args:
        model: CC, FSM, RSS or REG157.
        parameters: Of that model.
        speed: >= 0 [m/s].
    """
    if model == CC:
        headway = parameters[CC_HEADWAY]
        return speed * (headway if headway < math.inf else 2.0)
    if model == FSM:
        distance = speed * parameters[DELAY] + 2.0 * parameters[FSM_MARGIN]
        distance += speed * speed / (2.0 * parameters[FSM_COMFORTABLE])
        return distance - speed * speed / (2.0 * parameters[FSM_LEAD_BRAKING])
    if model == RSS:
        # Where the lead is by then, and how fast.
        time, braking = parameters[RSS_LEAD_BRAKES], parameters[RSS_MOST_BRAKING]
        return 0.5 * braking * time * time + rss_longitudinal_distance(
            speed,
            max(speed - braking * time, 0.0),
            parameters[DELAY],
            parameters[RSS_ACCELERATION],
            parameters[RSS_LEAST_BRAKING],
            parameters[RSS_MOST_BRAKING],
        )
    if parameters[REG157_HEADWAY] < math.inf:
        return speed * parameters[REG157_HEADWAY]
    return r157_following_distance(speed)


@compiled
def cut_in_threshold(closing_speed: float, delay: float, braking: float) -> float:
    """Return the TTC at the lane intrusion above which a cut-in must not end in contact [s].

    Args:
        closing_speed: Ego's minus the other's [m/s].
        delay: [s].
        braking: > 0 [m/s^2].

    Source:
        UN R157, paragraph 5.2.5.2: 0.35 s and 6 m/s^2.

    >>> round(cut_in_threshold(60.0 / 3.6, 0.35, 6.0), 3)
    1.739
    """
    return closing_speed / (2.0 * braking) + delay


@compiled
def must_be_avoided(scene: Floats, delay: float, braking: float, intrusion: float) -> float:
    """Tell whether paragraph 5.2.5.2 forbids a contact in a cut-in: 1, or 0 if it does not.

    Args:
        scene: Shape (SCENE_SIZE,).
        delay: Of the threshold [s].
        braking: Of the threshold [m/s^2].
        intrusion: Into the lane, at which the TTC is taken [m].

    Returns:
        NaN if a number is unknown, and where the other has intruded before the scene begins: the
        rule is about the moment at which it does.
    """
    closing = scene[S_EGO_SPEED] - scene[S_OTHER_SPEED]
    lateral = scene[S_LATERAL_SPEED]
    place = 0.5 * (scene[S_LANE_WIDTH] + scene[S_OTHER_WIDTH]) - intrusion
    if math.isnan(closing + lateral + place + scene[S_LATERAL_OFFSET] + scene[S_GAP]):
        return math.nan
    way = abs(scene[S_LATERAL_OFFSET]) - place
    growing, growth = scene[S_LATERAL_ACCELERATION], 0.0
    if 0.0 < growing < math.inf and lateral > 0.0:
        growth = lateral / growing
    if way + 0.5 * lateral * growth < 0.0:
        return math.nan
    if closing <= 0.0 or lateral <= 0.0:
        return 0.0
    # From the end of the growth on; the intrusion may be before it.
    moment = way / lateral
    if way < 0.0:
        moment = math.sqrt(2.0 * (way + 0.5 * lateral * growth) / growing) - growth
    if moment + growth < VISIBLE:
        return 0.0
    ttc = time_to_collision(scene[S_GAP] - moment * closing, closing)
    return 1.0 if ttc > cut_in_threshold(closing, delay, braking) else 0.0


# --- Fuzzy surrogate safety metrics of following: how unsafe a distance is, from 0 to 1 -----------


@compiled
def proactive_fuzzy_safety(
    gap: float,
    rear_speed: float,
    front_speed: float,
    delay: float,
    comfortable: float,
    most: float,
    lead_braking: float,
    margin: float,
) -> float:
    """Return how unsafe a distance is if the front vehicle should brake, 0 to 1 (PFS).

    Args:
        gap: Bumper-to-bumper distance [m].
        rear_speed: >= 0 [m/s].
        front_speed: >= 0 [m/s].
        delay: Reaction time of the rear vehicle [s].
        comfortable: Comfortable braking of the rear vehicle, > 0 [m/s^2].
        most: Its full braking, > ``comfortable`` [m/s^2].
        lead_braking: Braking of the front vehicle, > 0 [m/s^2].
        margin: Distance at standstill; also what a safe distance has in addition [m].

    Source:
        UN R157, 01 series, annex 4 appendix 3; Mattas et al. (2020), equations 6 to 8.
    """
    if math.isnan(gap + rear_speed + front_speed):
        return math.nan
    way = rear_speed * delay - front_speed * front_speed / (2.0 * lead_braking)
    square = rear_speed * rear_speed
    safe = way + square / (2.0 * comfortable) + margin
    unsafe = way + square / (2.0 * most)
    return _membership(gap - margin, unsafe, safe)


@compiled
def critical_fuzzy_safety(
    gap: float,
    rear_speed: float,
    front_speed: float,
    rear_acceleration: float,
    delay: float,
    comfortable: float,
    most: float,
    is_raw: bool,  # noqa: FBT001 - compiled
) -> float:
    """Return how unsafe a distance is at the present speeds and acceleration, 0 to 1 (CFS).

    Args:
        gap: Bumper-to-bumper distance [m].
        rear_speed: >= 0 [m/s].
        front_speed: >= 0 [m/s].
        rear_acceleration: [m/s^2].
        delay: Reaction time of the rear vehicle [s].
        comfortable: Comfortable braking of the rear vehicle, > 0 [m/s^2].
        most: Its full braking, > ``comfortable`` [m/s^2].
        is_raw: Whether a rear vehicle that is slow enough after its delay is judged by its whole
            braking, as in the published code, instead of at most the comfortable one.

    Source:
        UN R157, 01 series, annex 4 appendix 3; Mattas et al. (2020), equations 9 to 13.
    """
    if math.isnan(gap + rear_speed + front_speed + rear_acceleration):
        return math.nan
    closing = rear_speed - front_speed
    if closing <= 0.0:
        return 0.0
    counted = max(rear_acceleration, -comfortable)
    reached = rear_speed + counted * delay
    if reached <= front_speed:
        braking = abs(rear_acceleration) if is_raw else abs(counted)
        return 1.0 if gap < closing * closing / (2.0 * braking) else 0.0
    way = (0.5 * (rear_speed + reached) - front_speed) * delay
    square = (reached - front_speed) * (reached - front_speed)
    return _membership(gap, way + square / (2.0 * most), way + square / (2.0 * comfortable))


@compiled
def _membership(distance: float, unsafe: float, safe: float) -> float:
    """Return 1 below the unsafe distance, 0 from the safe one on, linear between."""
    if distance >= safe:
        return 0.0
    return 1.0 if distance <= unsafe else (safe - distance) / (safe - unsafe)


# --- The cut-in rule of UN R157 made a driver who brakes as late as it allows ---------------------
