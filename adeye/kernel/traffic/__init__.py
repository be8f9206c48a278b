"""Numerics of traffic: lanes, the network, drivers and their steering.

Begin with ``drivers``.
"""
