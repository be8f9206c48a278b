"""The safety channel: monitors and a safe stop, in lane or planned."""

from adeye.channels.safety.channel import SafetyChannel
from adeye.channels.safety.planned import PlannedSafetyChannel

__all__ = ["PlannedSafetyChannel", "SafetyChannel"]
