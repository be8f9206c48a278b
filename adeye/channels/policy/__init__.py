"""The policy channel: any ``policy(observation) -> action`` as a channel."""

from adeye.channels.policy.channel import PolicyChannel

__all__ = ["PolicyChannel"]
