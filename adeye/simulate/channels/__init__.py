"""Independent controllers of the ego, built in or from outside, behind one interface.

A channel sees what is linked to it and nothing else; who acts is not decided here. Begin with
``rack``.
"""

from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.rack import ChannelRack

__all__ = ["ChannelRack", "make_channel"]
