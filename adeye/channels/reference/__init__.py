"""The reference channel: a reference driver of UN R157 in closed loop, on ground truth."""

from adeye.channels.reference.channel import ReferenceChannel

__all__ = ["ReferenceChannel"]
