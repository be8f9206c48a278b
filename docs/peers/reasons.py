"""What each other tool was asked, what adeye says of it, and why the two differ where they do.

A reason is a formula: it says what the other tool answers. A difference counts as understood where
its formula gives the other tool's answer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.kernel.criticality import (
    deceleration_rate_to_avoid_crash,
    deceleration_to_safety_time,
    enhanced_time_to_collision,
    modified_deceleration_rate,
    required_deceleration,
    rss_lateral_distance,
    rss_longitudinal_distance,
    rss_opposite_distance,
    speed_change,
    time_gap,
    time_to_collision,
)
from adeye.kernel.encounter import (
    closest_encounter,
    planar_time_to_collision,
    steer_threat_number,
    time_to_brake,
    time_to_kickdown,
    worst_time_to_collision,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.kernel.boxes import Extent, Vector

    Form = Callable[..., float]
    Answer = Callable[..., float | None]

INF: Final = math.inf


@dataclass(frozen=True)
class Reason:
    """Why a tool differs.

    Attributes:
        text: For the page.
        answer: What the tool answers, from the state; None for nothing.
        within: How far from that its answer may be.
    """

    text: str
    answer: Answer
    within: float = 1e-6


@dataclass(frozen=True)
class Comparison:
    """One metric of one tool.

    Attributes:
        name: Of the metric.
        unit: Of it.
        theirs: What the tool calls it.
        ours: What adeye says, from the state.
        reasons: In the order in which they are tried.
        free: What adeye says where the tool answers nothing because there is no conflict.
    """

    name: str
    unit: str
    theirs: str
    ours: Form
    reasons: tuple[Reason, ...] = ()
    free: float = INF


# --- ad-rss ---------------------------------------------------------------------------------------


AD_RSS: Final = {
    "rss_same": Comparison(
        "RSS distance, same direction",
        "m",
        "calculateSafeLongitudinalDistanceSameDirection",
        rss_longitudinal_distance,
    ),
    "rss_opposite": Comparison(
        "RSS distance, opposite direction",
        "m",
        "calculateSafeLongitudinalDistanceOppositeDirection",
        rss_opposite_distance,
    ),
    "rss_lateral": Comparison(
        "RSS lateral distance",
        "m",
        "calculateSafeLateralDistance",
        rss_lateral_distance,
    ),
}

# --- SUMO -----------------------------------------------------------------------------------------


def _uncut_mdrac(gap: float, rear: float, front: float, _: float) -> float:
    closing = rear - front
    return closing / (2.0 * (gap / closing - 1.0))


SUMO: Final = {
    "gap": Comparison(
        "gap",
        "m",
        "SGAP",
        lambda gap, *_: gap,
        (
            Reason(
                "It gives no gap of vehicles that overlap; adeye calls that contact.",
                lambda *_: None,
            ),
        ),
    ),
    "time_gap": Comparison(
        "time gap",
        "s",
        "TGAP",
        lambda gap, rear, *_: time_gap(gap, rear),
        (Reason("It gives none of vehicles that overlap; adeye gives 0.", lambda *_: None),),
    ),
    "ttc": Comparison(
        "TTC", "s", "TTC", lambda gap, rear, front, _: time_to_collision(gap, rear - front)
    ),
    "drac": Comparison(
        "DRAC",
        "m/s²",
        "DRAC",
        lambda gap, rear, front, _: deceleration_rate_to_avoid_crash(gap, rear - front),
        (Reason("It gives none in contact; adeye gives infinity.", lambda *_: None),),
        0.0,
    ),
    "mdrac": Comparison(
        "MDRAC, 1 s",
        "m/s²",
        "MDRAC",
        lambda gap, rear, front, _: modified_deceleration_rate(gap, rear - front, 1.0),
        (
            Reason(
                "Where the gap is used up before the braking begins, its formula goes through "
                "infinity and comes back negative, which looks harmless. adeye gives infinity.",
                _uncut_mdrac,
            ),
            Reason("It gives none in contact; adeye gives infinity.", lambda *_: None),
        ),
        0.0,
    ),
}

# --- CommonRoad-CriMe -----------------------------------------------------------------------------

STEP: Final = 0.1
HORIZON: Final = 6.0
"""What CriMe was given: 60 steps of a trajectory [s]."""

BRAKING: Final = 11.5
LATERAL: Final = 8.0
"""Abilities that CriMe assumes [m/s²]."""

BODY: Final = (0.0, 4.0, 2.0)


def _closing(gap: float, rear: float, front: float, _: float) -> float:
    return time_to_collision(gap, rear - front)


def _bodies(
    gap: float, rear: float, front: float, length: float
) -> tuple[Vector, Vector, Extent, Extent]:
    place, rate = (2.0 + gap + 0.5 * length, 0.0), (front - rear, 0.0)
    return place, rate, BODY, (0.0, length, 2.0)


def _stepped(time: float) -> float:
    """First step after a time, before the horizon."""
    if time <= 0.0:
        return 0.0
    steps = math.floor(time / STEP + 1e-9) + 1.0
    return steps * STEP if steps * STEP < HORIZON - 1e-9 else INF


def _passed(gap: float, rear: float, *_: float) -> float:
    """First step at which the gap is driven and more."""
    steps = math.floor(gap / rear / STEP + 1e-9) + 1
    return steps * STEP if steps * STEP <= HORIZON + 1e-9 else INF


def _dst(gap: float, rear: float, front: float, _: float) -> float:
    room = gap - 2.0 * front
    return 3.0 * (rear - front) ** 2 / (2.0 * room) if room != 0.0 else INF


def _blind_required(gap: float, rear: float, front: float, *_: float) -> float:
    return (rear - front) ** 2 / (2.0 * gap)


def _unsigned_required(gap: float, rear: float, front: float, _: float, a_front: float) -> float:
    return max(0.0, (rear - front) ** 2 / (2.0 * gap) - abs(a_front))


def _radius(length: float) -> float:
    """Of one of three disks that cover a body 2 m wide [m]."""
    return math.hypot(length / 6.0, 1.0)


def _worst(reach: float, gap: float, rear: float, front: float, length: float) -> float:
    apart = 2.0 + gap + 0.5 * length
    return worst_time_to_collision(apart, 0.0, front - rear, 0.0, reach, 2.0 * BRAKING)


def _last_meeting(gap: float, rear: float, front: float, length: float) -> float:
    """Last time at which the disks touch, when the ego has gone through the other."""
    apart, closing = 2.0 + gap + 0.5 * length, rear - front
    reach = _radius(4.0) + _radius(length)
    inside = closing * closing - 4.0 * BRAKING * (reach + apart)
    return (closing + math.sqrt(inside)) / (2.0 * BRAKING) if inside >= 0.0 else math.nan


def _last_step(time: float, arrival: float) -> float:
    """Last step at which a manoeuvre still helps; nothing below 0 or beyond the horizon is seen."""
    if _stepped(arrival) == INF:
        return INF
    return -INF if time < 0.0 else math.floor(time / STEP) * STEP


def _ttb(gap: float, rear: float, front: float, _: float) -> float:
    return time_to_brake(gap, rear - front, rear, INF, BRAKING)


def _braked(start: int, speed: float) -> list[float]:
    """Places of the ego at all steps, if it brakes from one on: harder by 2.5 m/s² a step, to 8."""
    places, braking = [0.0], 0.0
    for step in range(round(HORIZON / STEP)):
        if step >= start:
            braking = min(braking + 25.0 * STEP, 8.0)
        time = min(STEP, speed / braking) if braking > 0.0 else STEP
        places.append(places[-1] + time * (speed - 0.5 * braking * time))
        speed -= braking * time
    return places


def _simulated(gap: float, rear: float, front: float, length: float) -> float:
    """Last step at which the simulated braking avoids a collision with the ego one step late."""
    arrival = _stepped(_closing(gap, rear, front, length))
    if arrival == INF:
        return INF
    # Without its rounding the quotient may be a step less.
    for start in range(int(arrival / STEP) - 1, -1, -1):
        late = _braked(start, rear)[:-1]
        if all(gap + front * STEP * (k + 1) > place for k, place in enumerate(late)):
            return start * STEP
    return -INF


def _ttk(gap: float, rear: float, front: float, length: float) -> float:
    return time_to_kickdown(gap, rear - front, 4.0 + length, -INF, BRAKING)


def _unsigned_closing(
    gap: float, rear: float, front: float, a_rear: float, a_front: float
) -> float:
    relative = a_rear - abs(a_front)
    is_none = rear > front and abs(relative) <= 0.1
    return enhanced_time_to_collision(gap, rear - front, 0.0 if is_none else relative)


def _other_branch(gap: float, rear: float, front: float, a_rear: float, a_front: float) -> float:
    relative = a_rear - abs(a_front)
    if abs(abs(relative) - 0.1) > 1e-9:
        return math.nan
    is_none = rear > front and abs(relative) <= 0.1
    return enhanced_time_to_collision(gap, rear - front, relative if is_none else 0.0)


_STEPPED: Final = (
    "It looks at every step of 0.1 s of its 6 s: what lies between is the next step, and what "
    "comes later is infinite."
)
_LAST: Final = (
    "It tries the steps of 0.1 s from now on: the last moment is that of a step, one that is past "
    "is minus infinity, and a collision after its 6 s is none."
)

CRIME: Final = {
    "gap": Comparison("gap", "m", "HW", lambda gap, *_: gap),
    "time_gap": Comparison(
        "time gap",
        "s",
        "THW",
        lambda gap, rear, *_: time_gap(gap, rear),
        (Reason(_STEPPED, _passed),),
    ),
    "ttc": Comparison("TTC", "s", "TTC", _closing),
    "planar_ttc": Comparison(
        "TTC in the plane",
        "s",
        "TTCStar",
        lambda *state: planar_time_to_collision(*_bodies(*state)),
        (Reason(_STEPPED, lambda *state: _stepped(_closing(*state))),),
    ),
    "dst": Comparison(
        "DST, 2 s",
        "m/s²",
        "DST",
        lambda gap, rear, front, _: deceleration_to_safety_time(gap, rear - front, front, 2.0),
        (
            Reason(
                "It gives three times the deceleration, after Schubert et al. (2010), whether the "
                "gap closes or opens, and a negative one where the safety time is lost. adeye "
                "gives Hupfer's, 0 and infinity.",
                _dst,
            ),
            Reason(
                "Where the safety time is just lost it divides by what rounding leaves.",
                lambda gap, _, front, __: -1e16 if abs(gap - 2.0 * front) < 1e-9 else math.nan,
                10.0,
            ),
        ),
    ),
    "required": Comparison(
        "required deceleration, steady lead",
        "m/s²",
        "ALongReq",
        lambda gap, rear, front, _: -required_deceleration(gap, rear, front, 0.0),
        (
            Reason(
                "It squares the closing speed without its sign: it asks for braking behind who is "
                "faster.",
                lambda *state: -_blind_required(*state),
            ),
        ),
    ),
    "required_along_x": Comparison(
        "the same, road along x",
        "m/s²",
        "ALongReq",
        lambda gap, rear, front, _: -required_deceleration(gap, rear, front, 0.0),
        (
            Reason(
                "It takes a heading of exactly 0 for a missing one: 0 on every road along x.",
                lambda *_: 0.0,
            ),
        ),
    ),
    "btn": Comparison(
        "BTN",
        "",
        "BTN",
        lambda gap, rear, front, _: required_deceleration(gap, rear, front, 0.0) / BRAKING,
        (
            Reason(
                "Its required deceleration has no sign of the closing speed, see above.",
                lambda *state: _blind_required(*state) / BRAKING,
            ),
        ),
    ),
    "stn": Comparison(
        "STN",
        "",
        "STN",
        lambda *state: steer_threat_number(_closing(*state), 2.0, LATERAL),
    ),
    "wttc": Comparison(
        "WTTC",
        "s",
        "WTTC",
        lambda *state: _worst(0.5 * (math.hypot(4.0, 2.0) + math.hypot(state[3], 2.0)), *state),
        (
            Reason(
                "Its disk is one of three that cover the body together, so that the ends of both "
                "bodies stick out; adeye takes the circle around the whole body.",
                lambda *state: _worst(_radius(4.0) + _radius(state[3]), *state),
            ),
            Reason(
                "Where the disks meet, part and meet again on the other side, it takes the last of "
                "the times.",
                _last_meeting,
            ),
        ),
    ),
    "dce": Comparison(
        "DCE",
        "m",
        "DCE",
        lambda *state: closest_encounter(*_bodies(*state))[1],
        (
            Reason(
                "It looks no farther ahead than its last step, 5.9 s.",
                lambda gap, rear, front, _: gap - (rear - front) * (HORIZON - STEP),
            ),
        ),
    ),
    "ttce": Comparison(
        "TTCE",
        "s",
        "TTCE",
        lambda *state: closest_encounter(*_bodies(*state))[0],
        (
            Reason(_STEPPED, lambda *state: _stepped(closest_encounter(*_bodies(*state))[0])),
            Reason(
                "Who comes nearer after its last step is nearest at that.",
                lambda _, rear, front, __: HORIZON - STEP if rear > front else math.nan,
            ),
        ),
    ),
    "ttb": Comparison(
        "TTB",
        "s",
        "TTB",
        _ttb,
        (
            Reason(
                f"{_LAST} Its braking gets stronger by 2.5 m/s² a step and ends at 8 m/s², "
                "whatever the vehicle is able to do; and it looks for contact with the ego one "
                "step late, so that bodies that overlap by the way of a step do not touch.",
                _simulated,
            ),
        ),
    ),
    "ttk": Comparison(
        "TTK",
        "s",
        "TTK",
        _ttk,
        (Reason(_LAST, lambda *s: _last_step(_ttk(*s), _closing(*s)), STEP),),
    ),
    "delta_v": Comparison(
        "Δv of equal masses",
        "m/s",
        "DeltaV",
        lambda _, rear, front, __: speed_change(1500.0, 1500.0, abs(rear - front)),
        (
            Reason(
                "It adds the speeds of two that drive the same way, as for a frontal collision.",
                lambda _, rear, front, __: 0.5 * (rear + front),
            ),
        ),
    ),
    "ettc": Comparison(
        "ETTC, accelerating",
        "s",
        "TTC",
        lambda gap, rear, front, a_rear, a_front: enhanced_time_to_collision(
            gap, rear - front, a_rear - a_front
        ),
        (
            Reason(
                "It loses the sign of the lead's acceleration, so that a braking lead flees, and "
                "takes relative accelerations up to 0.1 m/s² for none.",
                _unsigned_closing,
            ),
            Reason("At 0.1 m/s² itself its rounding decides.", _other_branch),
        ),
    ),
    "required_braking": Comparison(
        "required deceleration, accelerating lead",
        "m/s²",
        "ALongReq",
        lambda gap, rear, front, _, a_front: -required_deceleration(gap, rear, front, a_front),
        (
            Reason(
                "It loses the signs of the lead's acceleration and of the closing speed, and the "
                "lead never stops: a braking lead makes it ask for less.",
                lambda *state: -_unsigned_required(*state),
            ),
        ),
    ),
}
