"""A second implementation of what is measured between a rear and a front vehicle on one road.

Written from the definitions, without the product: one state at a time, and where there is a choice
by another way than the shortest formula. Contact comes from the motion of both vehicles, parted at
their stops, in decimal numbers of fifty digits, so that no care against rounding is needed; a
required deceleration is searched for, and the motion says whether it is enough.
"""

import math
from decimal import Decimal, localcontext
from itertools import pairwise
from typing import NamedTuple

INF = math.inf
DIGITS = 50


class Phase(NamedTuple):
    """Place of a vehicle from a time on, p + q t + r t^2 [m], t from the beginning of all."""

    since: Decimal
    p: Decimal
    q: Decimal
    r: Decimal


def phases(start: Decimal, speed: float, acceleration: float, *, stops: bool) -> list[Phase]:
    """Give the motion of a vehicle that speeds up, or brakes and then stays."""
    v, a = Decimal(speed), Decimal(acceleration)
    moves = Phase(Decimal(0), start, v, a / 2)
    if not stops:
        return [moves]
    if v == 0 and a < 0:
        return [Phase(Decimal(0), start, Decimal(0), Decimal(0))]
    if v * a >= 0:
        return [moves]
    end = -v / a
    return [moves, Phase(end, start + v * end + a * end * end / 2, Decimal(0), Decimal(0))]


def roots(p: Decimal, q: Decimal, r: Decimal) -> list[Decimal]:
    """Solve p + q t + r t^2 = 0 as in a schoolbook."""
    if r == 0:
        return [-p / q] if q != 0 else []
    inside = q * q - 4 * p * r
    if inside < 0:
        return []
    root = inside.sqrt()
    return sorted([(-q - root) / (2 * r), (-q + root) / (2 * r)])


def first_contact(
    gap: float, rear: tuple[float, float], front: tuple[float, float], *, stops: bool
) -> float:
    """Find the first time at which the rear vehicle has used up the gap.

    Args:
        gap: [m].
        rear: Speed [m/s] and acceleration [m/s^2].
        front: The same.
        stops: Whether who brakes to standstill stays there.
    """
    if gap <= 0.0:
        return 0.0
    with localcontext() as context:
        context.prec = DIGITS
        behind = phases(Decimal(0), *rear, stops=stops)
        ahead = phases(Decimal(gap), *front, stops=stops)
        edges = sorted({phase.since for phase in (*behind, *ahead)})
        for number, since in enumerate(edges):
            until = edges[number + 1] if number + 1 < len(edges) else None
            mine = [phase for phase in behind if phase.since <= since][-1]
            other = [phase for phase in ahead if phase.since <= since][-1]
            for time in roots(other.p - mine.p, other.q - mine.q, other.r - mine.r):
                if time >= since and (until is None or time <= until):
                    return float(time)
    return INF


def ttc(gap: float, closing: float) -> float:
    if gap <= 0.0:
        return 0.0
    return INF if closing <= 0.0 else gap / closing


def ettc(gap: float, closing: float, relative: float) -> float:
    return first_contact(gap, (closing, relative), (0.0, 0.0), stops=False)


def mttc(gap: float, v_rear: float, v_front: float, a_rear: float, a_front: float) -> float:
    return first_contact(gap, (v_rear, a_rear), (v_front, a_front), stops=True)


def time_gap(gap: float, speed: float) -> float:
    return ttc(gap, speed)


def headway(gap: float, front_length: float, speed: float) -> float:
    """From the front bumper of the one to that of the other, over the speed."""
    return ttc(front_length + gap, speed)


def drac(gap: float, closing: float) -> float:
    """While the closing speed falls to zero its mean is a half; so much time there is."""
    if closing <= 0.0:
        return 0.0
    if gap <= 0.0:
        return INF
    time = gap / (0.5 * closing)
    return closing / time


def mdrac(gap: float, closing: float, response: float) -> float:
    """What DRAC is once the response time is over."""
    if closing <= 0.0:
        return 0.0
    return drac(max(gap, 0.0) - closing * response, closing)


def dst(gap: float, closing: float, front_speed: float, safety: float) -> float:
    """DRAC of a gap that is shorter by what the front vehicle drives in the safety time."""
    return drac(gap - front_speed * safety, closing)


def place(speed: float, acceleration: float, time: float) -> float:
    """Way of a vehicle that brakes to a stop at most [m]."""
    if acceleration < 0.0 and time > speed / -acceleration:
        time = speed / -acceleration
    return speed * time + 0.5 * acceleration * time * time


def least_gap(gap: float, v_rear: float, braking: float, v_front: float, a_front: float) -> float:
    """Least gap from now on, if the rear vehicle brakes so: at a stop, or at equal speeds."""
    times = [0.0]
    if braking > 0.0:
        times.append(v_rear / braking)
    if a_front < 0.0:
        times.append(v_front / -a_front)
    if braking + a_front != 0.0:
        times.append((v_rear - v_front) / (braking + a_front))
    if braking <= 0.0 and a_front <= 0.0 and v_rear > (0.0 if a_front < 0.0 else v_front):
        return -INF
    return min(
        gap + place(v_front, a_front, time) - place(v_rear, -braking, time)
        for time in times
        if time >= 0.0
    )


def required(gap: float, v_rear: float, v_front: float, a_front: float) -> float:
    """Search for the least constant deceleration that leaves no contact, halving the interval."""
    opens = v_front >= v_rear and a_front >= 0.0
    if gap <= 0.0:
        return 0.0 if opens or v_rear <= 0.0 else INF
    if gap == INF or least_gap(gap, v_rear, 0.0, v_front, a_front) >= 0.0:
        return 0.0
    high = 1.0
    while least_gap(gap, v_rear, high, v_front, a_front) < 0.0:
        high *= 2.0
    low = 0.0 if high == 1.0 else 0.5 * high
    for _ in range(60):
        middle = 0.5 * (low + high)
        if least_gap(gap, v_rear, middle, v_front, a_front) < 0.0:
            low = middle
        else:
            high = middle
    return high


def btn(needed: float, available: float) -> float:
    if needed <= 0.0:
        return 0.0
    return INF if available <= 0.0 else needed / available


def braking_way(speed: float, braking: float) -> float:
    """Half of the speed on average, until standstill."""
    return 0.5 * speed * (speed / braking)


def mtc(gap: float, speed: float, front_speed: float, braking: float) -> float:
    """Room that is left when both have braked, over the way of the rear vehicle."""
    if speed <= 0.0:
        return INF
    front_way = math.copysign(braking_way(front_speed, braking), front_speed)
    return max(0.0, (gap + front_way) / braking_way(speed, braking))


def psd(gap: float, speed: float, braking: float) -> float:
    if gap <= 0.0:
        return 0.0
    return INF if speed <= 0.0 else gap / braking_way(speed, braking)


def stopping(speed: float, delay: float, braking: float) -> float:
    if speed <= 0.0:
        return 0.0
    return INF if braking <= 0.0 else delay * speed + braking_way(speed, braking)


def ramped_stopping(
    speed: float, delay: float, coasting: float, jerk: float, braking: float
) -> float:
    """Integrate the speed over delay, ramp and full braking; where it ends is searched for."""
    if speed <= 0.0:
        return 0.0
    if braking <= 0.0 or jerk <= 0.0:
        return INF
    ramp = max(0.0, (braking - coasting) / jerk)

    def speed_at(time: float) -> float:
        slowed = coasting * min(time, delay)
        if time > delay:
            ramped = min(time - delay, ramp)
            slowed += coasting * ramped + 0.5 * jerk * ramped * ramped
        if time > delay + ramp:
            slowed += braking * (time - delay - ramp)
        return speed - slowed

    low, high = 0.0, delay + ramp + speed / braking + 1.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if speed_at(middle) > 0.0 else (low, middle)
    edges = sorted({0.0, min(delay, low), min(delay + ramp, low), low})
    # Simpson's rule is exact for a speed that is no more than quadratic.
    return sum(
        (b - a) / 6.0 * (speed_at(a) + 4.0 * speed_at(0.5 * (a + b)) + speed_at(b))
        for a, b in pairwise(edges)
    )
