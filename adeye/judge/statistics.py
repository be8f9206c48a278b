"""Statistics: exact tests, intervals and bounds, and draws that are the same everywhere.

None of them knows where its numbers come from. Whoever calls them must have a random sample: for a
grid of chosen points there is no distribution that a probability could be about.

Clopper and Pearson's is the one for claims: it covers at least as often as it says. Wilson's
is the one for displays. The Bayesian one needs a prior that somebody has stated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np

from adeye.kernel.jit import compiled
from adeye.kernel.random import owner_id, uniform
from adeye.signals import Floats

# --- An interval, and the normal distribution that several need -----------------------------------


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


def normal_quantile(share: float) -> float:
    """Give the value below which a share of the standard normal distribution lies."""
    from scipy.special import ndtri

    return float(ndtri(share))


def normal_share(quantile: float) -> float:
    """Give the share of the standard normal distribution below a value."""
    from scipy.special import ndtr

    return float(ndtr(quantile))


# --- Intervals, bounds and sample sizes of one proportion -----------------------------------------

JEFFREYS_PRIOR: Final = (0.5, 0.5)
"""Parameters of the beta distribution that weighs every share by its information."""


def clopper_pearson(failures: int, runs: int, confidence: float) -> Interval:
    """Exact two-sided interval of a proportion.

    Args:
        failures: How many failed.
        runs: Of how many independent ones, at least 1.
        confidence: Least coverage.

    Source:
        Clopper and Pearson (1934), "The use of confidence or fiducial limits illustrated in the
        case of the binomial"; the ends as quantiles of beta distributions.

    >>> interval = clopper_pearson(5, 2000, 0.95)
    >>> round(interval.low, 6), round(interval.high, 6)
    (0.000812, 0.005824)
    """
    _check(failures, runs, confidence)
    from scipy.special import betaincinv

    tail = 0.5 * (1.0 - confidence)
    low = float(betaincinv(failures, runs - failures + 1, tail)) if failures else 0.0
    high = 1.0 if failures == runs else _upper(failures, runs, tail)
    return Interval(low, high, confidence)


def upper_bound(failures: int, runs: int, confidence: float) -> float:
    """Exact one-sided upper bound of a proportion.

    Args:
        failures: How many failed.
        runs: Of how many independent ones; 0 says nothing, so the bound is 1.
        confidence: Least coverage.

    Source:
        Clopper and Pearson (1934). Without a failure it is ``1 - (1 - confidence) ** (1 / runs)``,
        about ``3 / runs`` at 95 %.

    >>> round(upper_bound(0, 2000, 0.95), 6), round(upper_bound(5, 2000, 0.95), 6)
    (0.001497, 0.005249)
    """
    if failures == runs == 0:
        return 1.0
    _check(failures, runs, confidence)
    return 1.0 if failures == runs else _upper(failures, runs, 1.0 - confidence)


def jeffreys(
    failures: int,
    runs: int,
    confidence: float,
    prior: tuple[float, float] = JEFFREYS_PRIOR,
) -> Interval:
    """Bayesian interval of a proportion with equal tails.

    Args:
        failures: How many failed.
        runs: Of how many independent ones.
        confidence: Posterior probability.
        prior: Parameters of the beta distribution before the runs; state it with the result.

    Returns:
        The quantiles of the posterior; the lower end is 0 without a failure and the upper end 1
        without a success, so that what was seen is never outside.

    Source:
        Brown, Cai, DasGupta (2001), "Interval estimation for a binomial proportion".

    >>> interval = jeffreys(0, 2000, 0.95)
    >>> interval.low, round(interval.high, 6)
    (0.0, 0.001255)
    """
    _check(failures, runs, confidence)
    if not min(prior) > 0.0:
        msg = f"a prior has two parameters above 0, not {prior}"
        raise ValueError(msg)
    from scipy.special import betaincinv

    a, b = failures + prior[0], runs - failures + prior[1]
    tail = 0.5 * (1.0 - confidence)
    low = float(betaincinv(a, b, tail)) if failures else 0.0
    high = float(betaincinv(a, b, 1.0 - tail)) if failures < runs else 1.0
    return Interval(low, high, confidence)


def wilson(failures: int, runs: int, confidence: float) -> Interval:
    """Score interval of a proportion.

    Source:
        Wilson (1927), "Probable inference, the law of succession, and statistical inference".

    >>> interval = wilson(5, 2000, 0.95)
    >>> round(interval.low, 6), round(interval.high, 6)
    (0.001068, 0.005839)
    """
    _check(failures, runs, confidence)
    z = _central_quantile(confidence)
    share = failures / runs
    spread = z * math.sqrt(share * (1.0 - share) / runs + z * z / (4.0 * runs * runs))
    middle = share + z * z / (2.0 * runs)
    scale = 1.0 + z * z / runs
    # The formula gives the ends exactly; rounding would miss them by a last bit.
    low = 0.0 if failures == 0 else (middle - spread) / scale
    high = 1.0 if failures == runs else (middle + spread) / scale
    return Interval(low, high, confidence)


def runs_without_failure(share: float, confidence: float) -> int:
    """Count the independent runs that must all hold to show that a share is below a bound.

    Args:
        share: The bound, above 0 and below 1.
        confidence: Of the statement.

    Returns:
        The least n with ``(1 - share) ** n <= 1 - confidence``.

    >>> [runs_without_failure(10.0**-k, 0.95) for k in (1, 2, 3, 4)]
    [29, 299, 2995, 29956]
    """
    _check_level(confidence)
    if not 0.0 < share < 1.0:
        msg = f"a share between 0 and 1 is wanted, not {share}"
        raise ValueError(msg)
    needed = math.log1p(-confidence) / math.log1p(-share)
    if math.isfinite(needed):
        return max(1, math.ceil(needed))
    # More than a double holds; a whole number has no end.
    return math.ceil(Fraction(math.log1p(-confidence)) / Fraction(math.log1p(-share)))


def _central_quantile(confidence: float) -> float:
    """Give how many standard deviations on each side hold a share of the normal distribution."""
    share = 0.5 + 0.5 * confidence
    return normal_quantile(share) if share < 1.0 else -normal_quantile(0.5 * (1.0 - confidence))


def _upper(failures: int, runs: int, tail: float) -> float:
    from scipy.special import betaincinv

    if failures == 0:
        return -math.expm1(math.log(tail) / runs)
    return float(betaincinv(failures + 1, runs - failures, 1.0 - tail))


def _check(failures: int, runs: int, confidence: float) -> None:
    if not 0 <= failures <= runs or runs < 1:
        msg = f"{failures} of {runs} is no proportion"
        raise ValueError(msg)
    _check_level(confidence)


def _check_level(confidence: float) -> None:
    if not 0.0 < confidence < 1.0:
        msg = f"a confidence lies between 0 and 1, not {confidence}"
        raise ValueError(msg)


# --- Tests and intervals of paired results --------------------------------------------------------


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


# --- Rates of events over an exposure, such as a distance or a time -------------------------------


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


# --- Bootstraps whose draws are the same everywhere -----------------------------------------------

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
    bias = normal_quantile(share)
    ends = []
    for tail in (0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence):
        z = bias + normal_quantile(tail)
        level = normal_share(bias + z / max(1e-9, 1.0 - acceleration * z))
        ends.append(float(np.quantile(resampled, level, method="inverted_cdf")))
    return Interval(ends[0], ends[1], confidence)


def median_low(values: Floats) -> float:
    """Median; of an even number of values the lower middle, so that it is one of them."""
    return float(np.sort(values)[(len(values) - 1) // 2])


# --- Shares over strata, such as scenarios with their exposures -----------------------------------


@dataclass(frozen=True, slots=True)
class Stratum:
    """Independent runs of one stratum.

    Attributes:
        weight: Its share of the population, from 0 to 1. The weights of all strata sum up to 1.
        failures: How many runs failed.
        runs: How many there are.
    """

    weight: float
    failures: int
    runs: int


@dataclass(frozen=True, slots=True)
class Estimate:
    """A point estimate with its variance.

    Attributes:
        share: Weighted share of failures.
        variance: Of the share; 0 where nothing or everything failed in every stratum, which says
            nothing about how sure it is.
    """

    share: float
    variance: float


def stratified_estimate(strata: Sequence[Stratum]) -> Estimate:
    """Weigh the shares of strata.

    Raises:
        ValueError: A stratum with a weight has no runs, or the weights do not sum up to 1.

    >>> stratified_estimate([Stratum(0.9, 1, 100), Stratum(0.1, 10, 100)])
    Estimate(share=0.019000000000000003, variance=8.919000000000002e-05)
    """
    _check_strata(strata)
    if any(item.runs == 0 for item in strata if item.weight > 0.0):
        msg = "a stratum without runs has no share"
        raise ValueError(msg)
    shares = [(item, item.failures / item.runs) for item in strata if item.runs]
    return Estimate(
        math.fsum(item.weight * share for item, share in shares),
        math.fsum(item.weight**2 * share * (1.0 - share) / item.runs for item, share in shares),
    )


def zero_failure_bound(strata: Sequence[Stratum], confidence: float) -> float:
    """Bound the weighted share of failures where no run of any stratum failed.

    The largest ``sum(w p)`` among all shares p under which seeing no failure is not rarer than
    ``1 - confidence``. A stratum without runs can be anything: its whole weight counts.

    Raises:
        ValueError: A run failed, or the weights do not sum up to 1.

    Source:
        Test inversion with ``prod((1 - p) ** n) = 1 - confidence``; the maximum has
        ``p = max(0, 1 - t n / w)`` with one t for all strata (Karush, Kuhn, Tucker).

    >>> one = [Stratum(0.9, 0, 1000), Stratum(0.09, 0, 1000), Stratum(0.01, 0, 1000)]
    >>> round(zero_failure_bound(one, 0.95), 6)
    0.002692
    >>> alike = [Stratum(0.9, 0, 2700), Stratum(0.09, 0, 270), Stratum(0.01, 0, 30)]
    >>> round(zero_failure_bound(alike, 0.95), 6), round(upper_bound(0, 3000, 0.95), 6)
    (0.000998, 0.000998)
    """
    _check_strata(strata)
    if any(item.failures for item in strata):
        msg = "this bound is about strata without a failure"
        raise ValueError(msg)
    bound = math.fsum(item.weight for item in strata if item.runs == 0)
    # Those with few runs for their weight give way first.
    ranked = sorted(
        (item for item in strata if item.runs and item.weight > 0.0),
        key=lambda item: item.runs / item.weight,
    )
    rest = math.log1p(-confidence)
    runs = 0
    chosen: list[Stratum] = []
    multiplier = 0.0
    for item in ranked:
        ratio = item.runs / item.weight
        if chosen and multiplier * ratio >= 1.0:
            break
        chosen.append(item)
        runs += item.runs
        rest -= item.runs * math.log(ratio)
        multiplier = math.exp(rest / runs)
    return min(
        1.0, bound + math.fsum(max(0.0, item.weight - multiplier * item.runs) for item in chosen)
    )


def stratified_bound(strata: Sequence[Stratum], confidence: float) -> float:
    """Bound the weighted share of failures from above, whatever failed where.

    Without any failure it is ``zero_failure_bound``. With failures every stratum gets an exact
    bound of its own at an equal part of the error (Bonferroni): conservative, and valid for any
    number of runs.

    Raises:
        ValueError: The weights do not sum up to 1.
    """
    _check_strata(strata)
    if not any(item.failures for item in strata):
        return zero_failure_bound(strata, confidence)
    parts = [item for item in strata if item.weight > 0.0]
    level = 1.0 - (1.0 - confidence) / len(parts)
    return min(
        1.0,
        math.fsum(item.weight * upper_bound(item.failures, item.runs, level) for item in parts),
    )


def scaled_bounds(
    strata: Sequence[Stratum], confidence: float, factor: float = 3.0
) -> list[tuple[float, float]]:
    """Bound again with each weight in turn divided and multiplied by a factor.

    Weights from exposures are orders of magnitude. The others keep their proportions; all of them
    sum up to 1 again.

    Returns:
        For each stratum the bound with its weight divided, and with it multiplied.
    """
    return [
        (
            stratified_bound(_scaled(strata, number, 1.0 / factor), confidence),
            stratified_bound(_scaled(strata, number, factor), confidence),
        )
        for number in range(len(strata))
    ]


def _scaled(strata: Sequence[Stratum], number: int, factor: float) -> list[Stratum]:
    weights = [
        item.weight * (factor if place == number else 1.0) for place, item in enumerate(strata)
    ]
    total = math.fsum(weights)
    return [
        Stratum(weight / total, item.failures, item.runs)
        for weight, item in zip(weights, strata, strict=True)
    ]


def _check_strata(strata: Sequence[Stratum]) -> None:
    if not strata or any(not 0.0 <= item.weight <= 1.0 for item in strata):
        msg = "there is at least one stratum, and every weight lies between 0 and 1"
        raise ValueError(msg)
    total = math.fsum(item.weight for item in strata)
    if abs(total - 1.0) > 1e-9:
        msg = f"the weights sum up to {total}, not to 1"
        raise ValueError(msg)
    if any(not 0 <= item.failures <= item.runs for item in strata):
        msg = "a stratum has more failures than runs"
        raise ValueError(msg)
