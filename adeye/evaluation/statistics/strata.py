"""Shares over strata, such as scenarios with their exposures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from adeye.evaluation.statistics.proportions import upper_bound

if TYPE_CHECKING:
    from collections.abc import Sequence


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
    _check(strata)
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
    _check(strata)
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
    _check(strata)
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


def _check(strata: Sequence[Stratum]) -> None:
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
