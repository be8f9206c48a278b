"""Faults injected while a run goes on: when they are present, and what they do."""

from adeye.simulate.faults.schedule import FaultPlan

__all__ = ["FaultPlan"]
