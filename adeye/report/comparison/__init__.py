"""Comparisons of architectures: pairs, tables, statistics of differences.

Begin with ``compare``.
"""
