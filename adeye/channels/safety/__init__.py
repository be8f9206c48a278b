"""The safety channel: monitors and an in-lane safe stop."""

from adeye.channels.safety.channel import SafetyChannel

__all__ = ["SafetyChannel"]
