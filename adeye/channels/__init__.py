"""Independent controllers of the ego, built in or from outside, behind one interface."""

from adeye.channels.factory import make_channel
from adeye.channels.rack import ChannelRack

__all__ = ["ChannelRack", "make_channel"]
