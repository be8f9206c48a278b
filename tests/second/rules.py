"""A second implementation of rules for distances, of fuzzy safety and of how grave a crash is.

From the definitions of responsibility-sensitive safety, of UN Regulation 157 and of the sources of
the metrics, without the product.
"""

import math
from fractions import Fraction
from itertools import pairwise

INF = math.inf


def way(speed: float, acceleration: float, time: float) -> float:
    """Mean of the first and last speed, for so long [m]."""
    return 0.5 * (speed + (speed + acceleration * time)) * time


def braking_way(speed: float, braking: float) -> float:
    """Speed and the time to standstill, halved [m]."""
    return 0.5 * speed * (speed / braking)


def response(speed: float, a_max: float, rho: float, fastest: float) -> tuple[float, float]:
    """Way and last speed of who accelerates for so long, but to no more than a speed."""
    if speed >= fastest:
        return speed * rho, speed
    until = rho if speed + a_max * rho <= fastest else (fastest - speed) / a_max
    end = min(speed + a_max * until, fastest)
    return way(speed, a_max, until) + end * (rho - until), end


def rss_same(  # noqa: PLR0913, PLR0917 - as the definition has it
    v_rear: float, v_front: float, rho: float, a_max: float, b_min: float, b_max: float,
    least: float = 0.0, fastest: float = INF,
) -> float:  # fmt: skip
    """Definition 1: v_r rho + a rho^2 / 2 + (v_r + rho a)^2 / 2 b_min - v_f^2 / 2 b_max."""
    driven, reached = response(v_rear, a_max, rho, fastest)
    behind = driven + braking_way(reached, b_min)
    return least + max(0.0, behind - braking_way(v_front, b_max))


def rss_opposite(  # noqa: PLR0913, PLR0917 - as the definition has it
    speed: float, oncoming: float, rho: float, a_max: float, b_correct: float, b_min: float,
    least: float = 0.0, fastest: float = INF,
) -> float:  # fmt: skip
    """Definition 2: the ways of both."""
    ways = 0.0
    for start, braking in ((abs(speed), b_correct), (abs(oncoming), b_min)):
        driven, end = response(start, a_max, rho, fastest)
        ways += driven + end * end / (2.0 * braking)
    return least + max(0.0, ways)


def rss_lateral(  # noqa: PLR0913, PLR0917 - as the definition has it
    v_1: float, v_2: float, rho_1: float, rho_2: float, a_lat: float, b_lat: float, mu: float
) -> float:
    """Definition 6 for who moves towards the other after its response, else its response only."""
    w_1, w_2 = v_1 + rho_1 * a_lat, v_2 - rho_2 * a_lat
    first = (v_1 + w_1) / 2.0 * rho_1 + max(w_1, 0.0) ** 2 / (2.0 * b_lat)
    second = (v_2 + w_2) / 2.0 * rho_2 - min(w_2, 0.0) ** 2 / (2.0 * b_lat)
    return max(0.0, first - second + mu)


def rss_lateral_printed(  # noqa: PLR0913, PLR0917 - as the definition has it
    v_1: float, v_2: float, rho_1: float, rho_2: float, a_lat: float, b_lat: float, mu: float
) -> float:
    """Definition 6, with its signs as printed."""
    w_1, w_2 = v_1 + rho_1 * a_lat, v_2 - rho_2 * a_lat
    first = (v_1 + w_1) / 2.0 * rho_1 + w_1 * w_1 / (2.0 * b_lat)
    second = (v_2 + w_2) / 2.0 * rho_2 - w_2 * w_2 / (2.0 * b_lat)
    return mu + max(0.0, first - second)


def between(x: float, unsafe: float, safe: float) -> float:
    """Membership: 1 up to the unsafe distance, 0 from the safe one, a straight line between."""
    if x >= safe:
        return 0.0
    if x <= unsafe:
        return 1.0
    return (x - safe) / (unsafe - safe)


def pfs(  # noqa: PLR0913, PLR0917 - as the definition has it
    gap: float, u_e: float, u_c: float, tau: float, b_comf: float, b_max: float, b_lead: float,
    d_1: float,
) -> float:  # fmt: skip
    d_safe = u_e * tau + u_e**2 / (2.0 * b_comf) - u_c**2 / (2.0 * b_lead) + d_1
    d_unsafe = u_e * tau + u_e**2 / (2.0 * b_max) - u_c**2 / (2.0 * b_lead)
    return between(gap - d_1, d_unsafe, d_safe)


def cfs(  # noqa: PLR0913, PLR0917 - as the definition has it
    gap: float, u_e: float, u_c: float, a_e: float, tau: float, b_comf: float, b_max: float,
    is_raw: bool,  # noqa: FBT001 - as the product has it
) -> float:  # fmt: skip
    if u_e <= u_c:
        return 0.0
    bounded = -b_comf if a_e < -b_comf else a_e
    u_n = u_e + bounded * tau
    if u_n <= u_c:
        distance = (u_e - u_c) ** 2 / abs(2.0 * (a_e if is_raw else bounded))
        return 0.0 if gap >= distance else 1.0
    d_new = ((u_e + u_n) / 2.0 - u_c) * tau
    return between(
        gap,
        d_new + (u_n - u_c) ** 2 / (2.0 * b_max),
        d_new + (u_n - u_c) ** 2 / (2.0 * b_comf),
    )


TIME_GAPS = {"7.2": "1.0", "10": "1.1", "20": "1.2", "30": "1.3", "40": "1.4", "50": "1.5",
             "60": "1.6"}  # fmt: skip


def r157_following(speed: float) -> float:
    """UN R157, 5.2.3.3: the table, in km/h and s, with straight lines, in fractions."""
    table = [(Fraction(a) * Fraction(5, 18), Fraction(b)) for a, b in TIME_GAPS.items()]
    v = Fraction(speed)
    gap = table[0][1] if v <= table[0][0] else table[-1][1]
    for (v_0, t_0), (v_1, t_1) in pairwise(table):
        if v_0 < v <= v_1:
            gap = t_0 + (t_1 - t_0) * (v - v_0) / (v_1 - v_0)
    return float(max(v * gap, Fraction(2)))


def cut_in_ttc(closing: float, delay: float, braking: float) -> float:
    """TTC at which braking that begins late just takes the closing speed away.

    In the delay the closing speed stays, in the braking it is a half on average.
    """
    used = closing * delay + 0.5 * closing * (closing / braking)
    return used / closing if closing != 0.0 else delay


def normal_share(x: float) -> float:
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


def crash_probability(
    needed: float, mean: float, deviation: float, least: float, most: float
) -> float:
    """Share of a normal distribution between two ends that is below what is needed."""
    below, above = normal_share((least - mean) / deviation), normal_share((most - mean) / deviation)
    held = min(max(needed, least), most)
    return (normal_share((held - mean) / deviation) - below) / (above - below)


def speed_change(own_mass: float, other_mass: float, relative: float) -> float:
    """The own body stands; both go on with the momentum that the other one brings."""
    if math.isinf(other_mass):
        return relative
    return relative * other_mass / (other_mass + own_mass)


def fatality(change: float) -> float:
    if change == 0.0:
        return 0.0
    return min(1.0, math.exp(4.0 * (math.log(change) - math.log(31.74))))


def ratio(gap: float, safe: float) -> float:
    return INF if safe <= 0.0 else gap / safe
