"""Statistics of paired results: exact tests, intervals, and draws that are the same everywhere.

None of them knows where its numbers come from. Whoever calls them must have a random sample: for a
grid of chosen points there is no distribution that a probability could be about.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.jit import compiled
from adeye.kernel.random import owner_id, uniform

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.signals import Floats

DRAWS: Final = 2_000
"""Resamples of a bootstrap."""
SEED: Final = 20_260_101
"""Seed of the resamples; declared once, so that an interval is the same for everybody."""
MIN_UNITS: Final = 10
"""Units below which a bootstrap says nothing: it cannot draw what was never seen."""
RESOLUTION: Final = 2.0**-20
"""Step that resampled values are rounded to. Sums of its multiples are exact below 2**33, so they
are the same in whatever order a library adds them up."""
_BLOCK: Final = 2**22
"""Counts of resamples that are held at once."""


@dataclass(frozen=True, slots=True)
class Interval:
    """Two ends and what lies between them.

    Attributes:
        low: Lower end.
        high: Upper end.
        confidence: Nominal coverage.
    """

    low: float
    high: float
    confidence: float


def mcnemar_p(only_a: int, only_b: int) -> float:
    """Exact two-sided McNemar test: are the discordant pairs a fair coin?

    Args:
        only_a: Pairs in which only A failed.
        only_b: Pairs in which only B failed.

    Returns:
        The p-value; 1 without discordant pairs.

    Source:
        McNemar (1947), "Note on the sampling error of the difference between correlated
        proportions or percentages"; exact form: binomial with probability 1/2, twice the smaller
        tail, at most 1.

    >>> round(mcnemar_p(8, 1), 4)
    0.0391
    """
    if min(only_a, only_b) < 0:
        msg = f"counts of pairs cannot be negative: {only_a}, {only_b}"
        raise ValueError(msg)
    from scipy.special import bdtr

    tail = float(bdtr(float(min(only_a, only_b)), only_a + only_b, 0.5))
    return min(1.0, 2.0 * tail)


def holm(p_values: Sequence[float]) -> list[float]:
    """Adjust p-values so that the chance of any false finding among them stays bounded.

    Args:
        p_values: Of every test of the family.

    Returns:
        Adjusted values in the order given; never below the original, never above 1.

    Source:
        Holm (1979), "A simple sequentially rejective multiple test procedure".

    >>> holm([0.01, 0.04, 0.03])
    [0.03, 0.06, 0.06]
    """
    adjusted = [0.0] * len(p_values)
    reached = 0.0
    for rank, place in enumerate(sorted(range(len(p_values)), key=lambda at: p_values[at])):
        reached = max(reached, min(1.0, (len(p_values) - rank) * p_values[place]))
        adjusted[place] = reached
    return adjusted


def wilson(failures: int, runs: int, confidence: float) -> Interval:
    """Score interval of a proportion.

    Source:
        Wilson (1927), "Probable inference, the law of succession, and statistical inference".

    >>> interval = wilson(5, 2000, 0.95)
    >>> round(interval.low, 6), round(interval.high, 6)
    (0.001068, 0.005839)
    """
    if not 0 <= failures <= runs or runs < 1:
        msg = f"{failures} of {runs} is no proportion"
        raise ValueError(msg)
    z = _normal_quantile(0.5 + 0.5 * confidence)
    share = failures / runs
    spread = z * math.sqrt(share * (1.0 - share) / runs + z * z / (4.0 * runs * runs))
    middle = share + z * z / (2.0 * runs)
    scale = 1.0 + z * z / runs
    # The formula gives the ends exactly; rounding would miss them by a last bit.
    low = 0.0 if failures == 0 else (middle - spread) / scale
    high = 1.0 if failures == runs else (middle + spread) / scale
    return Interval(low, high, confidence)


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


def paired_difference(
    both: int, only_a: int, only_b: int, neither: int, confidence: float
) -> Interval:
    """Interval of the difference of two paired shares, B minus A.

    Args:
        both: Pairs in which both failed.
        only_a: Pairs in which only A failed.
        only_b: Pairs in which only B failed.
        neither: Pairs in which neither failed.
        confidence: Nominal coverage.

    Source:
        Newcombe (1998), "Improved confidence intervals for the difference between binomial
        proportions based on paired data", method 10: score intervals of both shares, put together
        with the correlation of the pairs, which is taken with a continuity correction.
    """
    pairs = both + only_a + only_b + neither
    share_a, share_b = (both + only_a) / pairs, (both + only_b) / pairs
    of_a, of_b = wilson(both + only_a, pairs, confidence), wilson(both + only_b, pairs, confidence)
    correlation = _correlation(both, only_a, only_b, neither)
    difference = share_b - share_a

    def reach(b_end: float, a_end: float) -> float:
        b, a = share_b - b_end, a_end - share_a
        return math.sqrt(max(0.0, b * b - 2.0 * correlation * b * a + a * a))

    return Interval(
        max(-1.0, difference - reach(of_b.low, of_a.high)),
        min(1.0, difference + reach(of_b.high, of_a.low)),
        confidence,
    )


def _correlation(both: int, only_a: int, only_b: int, neither: int) -> float:
    """Correlation of the pairs, drawn half a pair towards 0 where it is positive."""
    margins = (both + only_a) * (only_b + neither) * (both + only_b) * (only_a + neither)
    if margins == 0:
        return 0.0
    pairs = both + only_a + only_b + neither
    covariance = float(both * neither - only_a * only_b)
    if covariance > 0.0:
        covariance = max(0.0, covariance - pairs / 2.0)
    return covariance / math.sqrt(margins)


@compiled
def _count_draws(seed: np.uint64, owner: np.uint64, first: int, counts: Floats) -> None:
    for draw in range(counts.shape[0]):
        counts[draw] = 0.0
        for place in range(counts.shape[1]):
            picked = int(uniform(seed, owner, first + draw, place) * counts.shape[1])
            counts[draw, picked] += 1.0


def resampled_sums(values: Floats, name: str, draws: int = DRAWS) -> Floats:
    """Sum the rows of bootstrap resamples.

    Args:
        values: (N, C), one row a unit; rounded to ``RESOLUTION``.
        name: Of the units, which is the owner of the draws.
        draws: Number of resamples D.

    Returns:
        (D, C) sums of N rows drawn with replacement; all columns share the draws.
    """
    units = values.shape[0]
    exact = np.round(values / RESOLUTION) * RESOLUTION
    sums = np.zeros((draws, values.shape[1]))
    if units == 0:
        return sums
    owner = np.uint64(owner_id(f"bootstrap/{name}"))
    block = max(1, _BLOCK // units)
    for first in range(0, draws, block):
        counts = np.empty((min(block, draws - first), units))
        _count_draws(np.uint64(SEED), owner, first, counts)
        sums[first : first + len(counts)] = counts @ exact
    return sums


def bca(observed: float, resampled: Floats, influence: Floats, confidence: float) -> Interval:
    """Bias-corrected and accelerated bootstrap interval.

    Args:
        observed: The statistic of the sample.
        resampled: (D,) the same of its resamples.
        influence: (N,) empirical influence of each unit on the statistic; for a mean, the unit's
            value minus the mean.
        confidence: Nominal coverage.

    Source:
        Efron (1987), "Better bootstrap confidence intervals"; acceleration by eq. 6.6 from the
        influence values. Resamples equal to what was observed count half, because differences of
        pairs are often exactly 0.
    """
    if not np.isfinite(resampled).all() or not math.isfinite(observed):
        msg = "a bootstrap of what is no number"
        raise ValueError(msg)
    squares = float(np.sum(influence**2))
    if squares == 0.0:
        return Interval(observed, observed, confidence)
    acceleration = float(np.sum(influence**3)) / (6.0 * squares**1.5)
    below = np.count_nonzero(resampled < observed) + 0.5 * np.count_nonzero(resampled == observed)
    share = min(max(below / len(resampled), 0.5 / len(resampled)), 1.0 - 0.5 / len(resampled))
    bias = _normal_quantile(share)
    ends = []
    for tail in (0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence):
        z = bias + _normal_quantile(tail)
        level = _normal_share(bias + z / max(1e-9, 1.0 - acceleration * z))
        ends.append(float(np.quantile(resampled, level, method="inverted_cdf")))
    return Interval(ends[0], ends[1], confidence)


def median_low(values: Floats) -> float:
    """Median; of an even number of values the lower middle, so that it is one of them."""
    return float(np.sort(values)[(len(values) - 1) // 2])


def _normal_quantile(share: float) -> float:
    from scipy.special import ndtri

    return float(ndtri(share))


def _normal_share(quantile: float) -> float:
    from scipy.special import ndtr

    return float(ndtr(quantile))
