"""The exact interval of a proportion."""

from __future__ import annotations

from adeye.evaluation.statistics import Interval


def clopper_pearson(successes: int, trials: int, confidence: float) -> Interval:
    """Interval of a proportion that covers at least as often as it says.

    Source:
        Clopper and Pearson (1934), "The use of confidence or fiducial limits illustrated in the
        case of the binomial".

    >>> interval = clopper_pearson(34, 34, 0.95)
    >>> round(interval.low, 4), interval.high
    (0.8972, 1.0)
    """
    from scipy.special import betaincinv

    if not 0 <= successes <= trials or trials < 1:
        msg = f"{successes} of {trials} is no proportion"
        raise ValueError(msg)
    tail = 0.5 * (1.0 - confidence)
    others = trials - successes
    low = float(betaincinv(successes, others + 1, tail)) if successes else 0.0
    high = float(betaincinv(successes + 1, others, 1.0 - tail)) if others else 1.0
    return Interval(low, high, confidence)
