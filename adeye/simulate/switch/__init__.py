"""The switch: whose command acts, by which policy, and why.

No sensor and no scene is looked at here, only commands. Begin with ``arbiter``.
"""

from adeye.simulate.switch.arbiter import Arbiter, make_switch

__all__ = ["Arbiter", "make_switch"]
