"""Shared compiled numerics: plain numbers and arrays in, plain numbers and arrays out.

Nothing is imported here but numpy and numba. Begin with ``jit``, the door to the compiler.
"""
