"""The nominal channel: tracking, car following, lane keeping and emergency braking."""

from adeye.channels.nominal.channel import NominalChannel

__all__ = ["NominalChannel"]
