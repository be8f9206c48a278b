"""Metrics: one number per run with its status, time and actor of the worst case.

To import this package registers the built-in ones. What an FSR asks for is never here. Begin with
``registry``.
"""

# Imported to be registered, in the order in which they are listed.
from adeye.judge.metrics import arbitration as arbitration
from adeye.judge.metrics import comfort as comfort
from adeye.judge.metrics import criticality as criticality
from adeye.judge.metrics import exposure as exposure
from adeye.judge.metrics import handling as handling
from adeye.judge.metrics import perception as perception
from adeye.judge.metrics import severity as severity
from adeye.judge.metrics.registry import METRICS as METRICS
from adeye.judge.metrics.registry import MetricDefinition as MetricDefinition
from adeye.judge.metrics.registry import compute_metrics as compute_metrics
from adeye.judge.metrics.registry import register_metric as register_metric

# isort: split

# They are listed behind the others.
from adeye.judge.metrics import encounters as encounters
