"""Shares from runs that were drawn from another distribution than the one that is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.statistics.interval import Interval

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats

MIN_EFFECTIVE: Final = 30.0
"""Effective sample size below which there is no bound."""
MOST_OF_ONE: Final = 0.2
"""Share of the weight that one run may carry."""


@dataclass(frozen=True, slots=True)
class Weighted:
    """A self-normalised importance estimate.

    Attributes:
        share: Weighted share of failures.
        effective: Effective sample size, ``sum(w)**2 / sum(w**2)``.
        largest: Share of the weight that the heaviest run carries.
        interval: Of the share; None where the weights do not allow one.
        refusal: Why there is none; empty where there is.
    """

    share: float
    effective: float
    largest: float
    interval: Interval | None
    refusal: str


def importance_estimate(weights: Floats, failed: Bools, confidence: float) -> Weighted:
    """Estimate a share from weighted runs.

    Args:
        weights: (N,) density asked for over density drawn from, up to a common factor; >= 0.
        failed: (N,) whether the run failed.
        confidence: Nominal coverage of the interval.

    Returns:
        The estimate. Its interval is exact for equal weights and approximate for others: Clopper
        and Pearson's for as many runs as the weights are worth.

    Raises:
        ValueError: A weight is negative or no number, or all of them are 0.

    Source:
        Kish (1965), "Survey Sampling", section 11.2 C, for the effective sample size; Korn and
        Graubard (1998), "Confidence intervals for proportions with small expected number of
        positive counts estimated from survey data", for the interval.
    """
    if not (np.isfinite(weights).all() and (weights >= 0.0).all() and weights.sum() > 0.0):
        msg = "weights are finite, not negative and not all 0"
        raise ValueError(msg)
    shares = weights / weights.sum()
    effective = float(1.0 / np.sum(shares**2))
    largest = float(shares.max())
    share = float(shares[failed].sum())
    refusal = ""
    if effective < MIN_EFFECTIVE:
        refusal = f"the weights leave {effective:.3g} effective runs, fewer than {MIN_EFFECTIVE:g}"
    elif largest > MOST_OF_ONE:
        refusal = f"one run carries {largest:.0%} of the weight, more than {MOST_OF_ONE:.0%}"
    interval = None if refusal else _interval(share, effective, confidence)
    return Weighted(share, effective, largest, interval, refusal)


def _interval(share: float, runs: float, confidence: float) -> Interval:
    from scipy.special import betaincinv

    tail = 0.5 * (1.0 - confidence)
    failures = share * runs
    low = float(betaincinv(failures, runs - failures + 1.0, tail)) if failures > 0.0 else 0.0
    is_all = failures >= runs
    high = 1.0 if is_all else float(betaincinv(failures + 1.0, runs - failures, 1.0 - tail))
    return Interval(low, high, confidence)
