"""A second implementation of how long evading may wait: the last moment is searched for.

TTM(m) is the largest tau at which manoeuvre m, begun then, avoids the collision. The motion after
tau says whether it does; nothing of the product is used.
"""

import math
from collections.abc import Callable

INF = math.inf


def last_moment(avoids: Callable[[float], bool], latest: float) -> float:
    """Largest tau up to the latest at which a manoeuvre that had better begin early avoids."""
    if avoids(latest):
        return latest
    reach = 1.0
    while not avoids(latest - reach):
        reach *= 2.0
        if reach > 1e12:
            return -INF
    low, high = latest - reach, latest
    for _ in range(100):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if avoids(middle) else (low, middle)
    return low


def ttc(gap: float, closing: float) -> float:
    if gap <= 0.0:
        return 0.0
    return gap / closing if closing > 0.0 else INF


def braking_avoids(
    tau: float, gap: float, closing: float, speed: float, leave: float, braking: float
) -> bool:
    """Whether the gap is never used up before the body leaves, if the ego brakes from tau on."""
    body = speed - closing

    def left(time: float) -> float:
        braked = min(max(time - tau, 0.0), speed / braking)
        held = max(time - tau, 0.0) - braked
        # The ego's own way: even, then braked, then standing.
        way = speed * (time - held) - 0.5 * braking * braked * braked
        return gap + body * time - way

    equal = tau + closing / braking
    stands = tau + speed / braking
    times = [time for time in (equal, stands) if time <= leave]
    if leave < INF:
        times.append(leave)
    elif body < 0.0:
        return False
    return all(left(time) >= 0.0 for time in times if time >= tau)


def time_to_brake(gap: float, closing: float, speed: float, leave: float, braking: float) -> float:
    arrival = ttc(gap, closing)
    if arrival == INF or leave < arrival:
        return INF
    if gap <= 0.0 or braking <= 0.0:
        return -INF
    return last_moment(
        lambda tau: braking_avoids(tau, gap, closing, speed, leave, braking), arrival
    )


def time_to_kickdown(
    gap: float, closing: float, way: float, enter: float, acceleration: float
) -> float:
    """The ego is past a body, by both lengths, when that gets into its corridor."""
    if ttc(gap, closing) == INF:
        return INF
    if enter > 0.0 and closing * enter >= gap + way:
        return INF
    if gap <= 0.0 or enter <= 0.0 or acceleration <= 0.0:
        return -INF
    return last_moment(
        lambda tau: closing * enter + 0.5 * acceleration * (enter - tau) ** 2 >= gap + way,
        enter,
    )


def evasive_offset(beside: float, drift: float, reach: float) -> float:
    """The way to the nearer end of what the body takes up, widened by half of both widths."""
    low, high = sorted((beside, beside + drift))
    if not low - reach < 0.0 < high + reach:
        return 0.0
    return min(high + reach, -(low - reach))


def time_to_steer(arrival: float, offset: float, lateral: float) -> float:
    if arrival == INF or offset <= 0.0:
        return INF
    if lateral <= 0.0:
        return -INF
    return last_moment(lambda tau: 0.5 * lateral * (arrival - tau) ** 2 >= offset, arrival)


def time_to_react(brake: float, steer: float, kickdown: float) -> float:
    return sorted((brake, steer, kickdown))[-1]


def steer_threat(arrival: float, offset: float, available: float) -> float:
    """Half of the needed acceleration times the time squared is the way."""
    if arrival == INF or offset <= 0.0:
        return 0.0
    if arrival <= 0.0 or available <= 0.0:
        return INF
    needed = offset / (0.5 * arrival * arrival)
    return needed / available
