"""Metrics: one number per run with its status, time and actor of the worst case.

To import this package registers the built-in ones. What an FSR asks for is never here. Begin with
``registry``.
"""

from adeye.judge.metrics import (
    arbitration,
    comfort,
    criticality,
    exposure,
    handling,
    perception,
    severity,
)
from adeye.judge.metrics import comfort as motion
from adeye.judge.metrics import criticality as avoidance
from adeye.judge.metrics import encounters as meeting
from adeye.judge.metrics import handling as stopping
from adeye.judge.metrics import severity as at_fault
from adeye.judge.metrics.registry import (
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
