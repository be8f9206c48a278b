"""Bootstraps whose draws are the same everywhere."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.statistics.interval import Interval, normal_quantile, normal_share
from adeye.kernel.jit import compiled
from adeye.kernel.random import owner_id, uniform

if TYPE_CHECKING:
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


def design_effect(failures: Floats, sizes: Floats) -> float:
    """Tell how much the runs of clusters are worth less than as many independent ones.

    Args:
        failures: (C,) failures in each cluster, such as the runs of one drawn point.
        sizes: (C,) runs in each cluster, at least 1.

    Returns:
        Variance of the share over that of independent runs: 1 for clusters of one run, up to the
        size of the clusters where all runs of a cluster end alike. 1 where nothing or everything
        failed, because then nothing tells; the number of clusters is the honest count there.

    Source:
        Kish (1965), "Survey Sampling", section 5.4; ratio estimator over clusters.

    >>> design_effect(np.array([4.0, 0.0, 4.0, 0.0]), np.full(4, 4.0))
    5.333333333333333
    """
    runs, clusters = float(sizes.sum()), len(sizes)
    share = float(failures.sum()) / runs
    if clusters < 2 or not 0.0 < share < 1.0:
        return 1.0
    rest = failures - share * sizes
    variance = clusters / (clusters - 1.0) * float(np.sum(rest**2)) / runs**2
    return variance / (share * (1.0 - share) / runs)


def clustered_share(
    failures: Floats, sizes: Floats, name: str, confidence: float
) -> Interval | None:
    """Bootstrap the share of failures over clusters of runs that are not independent.

    Args:
        failures: (C,) failures in each cluster.
        sizes: (C,) runs in each cluster, at least 1.
        name: Of the clusters, which is the owner of the draws.
        confidence: Nominal coverage.

    Returns:
        The interval; None for fewer than ``MIN_UNITS`` clusters, or where nothing or everything
        failed: resamples of that cannot differ.
    """
    share = float(failures.sum() / sizes.sum()) if len(sizes) else 0.0
    if len(sizes) < MIN_UNITS or not 0.0 < share < 1.0:
        return None
    sums = resampled_sums(np.stack([failures, sizes], axis=1), name)
    return bca(share, sums[:, 0] / sums[:, 1], failures - share * sizes, confidence)
