"""Numerics of traffic: lanes, the network, drivers and their steering.

No test case and no scene is known here: lanes and vehicles are rows of numbers. Begin with
``drivers``.
"""
