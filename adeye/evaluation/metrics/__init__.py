"""Metrics: one number per run with its status, time and actor of the worst case."""

from adeye.evaluation.metrics import criticality, handling, motion, perception, stopping
from adeye.evaluation.metrics.registry import (
    METRICS,
    MetricDefinition,
    compute_metrics,
    metric_entry,
    register_metric,
)

__all__ = [
    "METRICS",
    "MetricDefinition",
    "compute_metrics",
    "criticality",
    "handling",
    "metric_entry",
    "motion",
    "perception",
    "register_metric",
    "stopping",
]
