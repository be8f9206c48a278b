"""The channel that plans trajectories: candidates, their cost, the plan and its following.

No detection is read here, only tracks. Begin with ``channel``.
"""
