"""Independent controllers of the ego, built in or from outside, behind one interface."""

from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.rack import ChannelRack

__all__ = ["ChannelRack", "make_channel"]
