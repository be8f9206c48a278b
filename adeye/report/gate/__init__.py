"""The gate against a baseline, what it decides, and what changed between two campaigns.

Nothing is executed here. Begin with ``decide``.
"""
