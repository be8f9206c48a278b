"""The verbs that read results: each parses, calls one function and prints what it returns.

Nothing is computed here. Begin with ``where``.
"""
