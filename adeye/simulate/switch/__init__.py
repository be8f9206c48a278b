"""The switch: whose command acts, by which policy, and why."""

from adeye.simulate.switch.arbiter import Arbiter, make_switch

__all__ = ["Arbiter", "make_switch"]
