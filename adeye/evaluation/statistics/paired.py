"""Tests and intervals of paired results."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from adeye.evaluation.statistics.interval import Interval
from adeye.evaluation.statistics.proportions import wilson

if TYPE_CHECKING:
    from collections.abc import Sequence


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
