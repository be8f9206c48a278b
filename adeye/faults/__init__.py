"""Faults injected while a run goes on: when they are present, and what they do."""

from adeye.faults.plan import FaultPlan

__all__ = ["FaultPlan"]
