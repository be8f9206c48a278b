"""The gate against a baseline: snapshot, what changed, what it decides.

Begin with ``decide``.
"""
