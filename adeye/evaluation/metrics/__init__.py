"""Metrics: one number per run with its status, time and actor of the worst case."""

from adeye.evaluation.metrics import (
    arbitration,
    at_fault,
    avoidance,
    comfort,
    criticality,
    exposure,
    handling,
    meeting,
    motion,
    perception,
    severity,
    stopping,
)
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
    "arbitration",
    "at_fault",
    "avoidance",
    "comfort",
    "compute_metrics",
    "criticality",
    "exposure",
    "handling",
    "meeting",
    "metric_entry",
    "motion",
    "perception",
    "register_metric",
    "severity",
    "stopping",
]
