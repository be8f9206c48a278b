"""Numerics of the reference drivers: parameters, reactions, scenes.

No channel and no trace is known here. Begin with ``drivers``.
"""
