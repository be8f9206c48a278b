"""Numerics of the reference drivers: parameters, reactions, scenes.

Begin with ``drivers``.
"""
