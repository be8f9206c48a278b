"""The safety channel: monitors and a safe stop, in lane or planned; or a supervisor's own ones."""

from adeye.channels.safety.channel import SafetyChannel
from adeye.channels.safety.planned import PlannedSafetyChannel
from adeye.channels.safety.supervised import SupervisedSafetyChannel

__all__ = ["PlannedSafetyChannel", "SafetyChannel", "SupervisedSafetyChannel"]
