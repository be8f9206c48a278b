"""Rates of events over an exposure, such as a distance or a time."""

from __future__ import annotations

import math

from adeye.evaluation.statistics.interval import Interval


def poisson_rate(events: int, exposure: float, confidence: float) -> Interval:
    """Exact interval of a rate of events that come independently of each other.

    Args:
        events: How many there were.
        exposure: How long was looked, in any unit; above 0.
        confidence: Least coverage.

    Source:
        Garwood (1936), "Fiducial limits for the Poisson distribution".

    >>> interval = poisson_rate(0, 10.0, 0.95)
    >>> interval.low, round(interval.high, 6)
    (0.0, 0.368888)
    """
    if events < 0 or not 0.0 < exposure < math.inf:
        msg = f"{events} events in {exposure} is no rate"
        raise ValueError(msg)
    from scipy.special import gammaincinv

    tail = 0.5 * (1.0 - confidence)
    low = float(gammaincinv(events, tail)) if events else 0.0
    return Interval(
        low / exposure, float(gammaincinv(events + 1, 1.0 - tail)) / exposure, confidence
    )
