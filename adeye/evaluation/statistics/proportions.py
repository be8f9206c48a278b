"""Intervals, bounds and sample sizes of one proportion.

Clopper and Pearson's is the one for claims: it covers at least as often as it says. Wilson's
is the one for displays. The Bayesian one needs a prior that somebody has stated.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Final

from adeye.evaluation.statistics.interval import Interval, normal_quantile

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


def runs_for_proportion(
    half_width: float, confidence: float, *, share: float = 0.5, population: int | None = None
) -> int:
    """Count the runs that estimate a proportion within a half width.

    Args:
        half_width: Of the interval.
        confidence: Its nominal coverage.
        share: What is expected; 0.5 needs most.
        population: Size of a finite population that is drawn from without replacement.

    Source:
        Normal approximation with the finite-population correction of Leveugle, Calvez, Maistri,
        Vanhauwaert (2009), "Statistical fault injection: quantified error and confidence".

    >>> runs_for_proportion(0.05, 0.95), runs_for_proportion(0.01, 0.95)
    (385, 9604)
    """
    _check_level(confidence)
    if not (half_width > 0.0 and 0.0 < share < 1.0):
        msg = f"a half width above 0 and a share between 0 and 1, not {half_width} and {share}"
        raise ValueError(msg)
    z = _central_quantile(confidence)
    variance = z * z * share * (1.0 - share)
    if population is None:
        return math.ceil(variance / half_width**2)
    return math.ceil(population / (1.0 + half_width**2 * (population - 1) / variance))


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
