"""Comparisons of architectures: pairs, tables, statistics of differences.

Nothing is executed here. Begin with ``compare``.
"""
