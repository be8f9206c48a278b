"""The channel that plans trajectories: candidates, their cost, the plan and its following.

Begin with ``channel``.
"""
