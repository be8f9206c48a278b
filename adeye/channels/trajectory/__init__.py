"""The trajectory channel: prediction, a fan of candidates, scoring, and control along the best."""

from adeye.channels.trajectory.channel import TrajectoryChannel

__all__ = ["TrajectoryChannel"]
