"""The gate against a baseline: snapshot, what changed, what it decides.

Nothing is executed here. Begin with ``decide``.
"""
