"""Faults injected while a run goes on: when they are present, and what they do.

What people write of a fault is not here but in ``spec``. Begin with ``schedule``.
"""

from adeye.simulate.faults.schedule import FaultPlan

__all__ = ["FaultPlan"]
