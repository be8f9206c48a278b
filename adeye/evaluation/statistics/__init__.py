"""Statistics: exact tests, intervals and bounds, and draws that are the same everywhere.

None of them knows where its numbers come from. Whoever calls them must have a random sample: for a
grid of chosen points there is no distribution that a probability could be about.
"""

from adeye.evaluation.statistics.interval import Interval
from adeye.evaluation.statistics.paired import holm, mcnemar_p, paired_difference
from adeye.evaluation.statistics.proportions import (
    clopper_pearson,
    jeffreys,
    runs_for_proportion,
    runs_without_failure,
    upper_bound,
    wilson,
)
from adeye.evaluation.statistics.rates import poisson_rate
from adeye.evaluation.statistics.resampling import (
    DRAWS,
    MIN_UNITS,
    RESOLUTION,
    SEED,
    bca,
    clustered_share,
    design_effect,
    median_low,
    resampled_sums,
)
from adeye.evaluation.statistics.strata import (
    Estimate,
    Stratum,
    scaled_bounds,
    stratified_bound,
    stratified_estimate,
    zero_failure_bound,
)
from adeye.evaluation.statistics.weighted import Weighted, importance_estimate

__all__ = [
    "DRAWS",
    "MIN_UNITS",
    "RESOLUTION",
    "SEED",
    "Estimate",
    "Interval",
    "Stratum",
    "Weighted",
    "bca",
    "clopper_pearson",
    "clustered_share",
    "design_effect",
    "holm",
    "importance_estimate",
    "jeffreys",
    "mcnemar_p",
    "median_low",
    "paired_difference",
    "poisson_rate",
    "resampled_sums",
    "runs_for_proportion",
    "runs_without_failure",
    "scaled_bounds",
    "stratified_bound",
    "stratified_estimate",
    "upper_bound",
    "wilson",
    "zero_failure_bound",
]
