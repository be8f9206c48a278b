"""Independent controllers of the ego, built in or from outside, behind one interface."""

from adeye.channels.factory import make_channel

__all__ = ["make_channel"]
