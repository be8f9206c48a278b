"""Signal temporal logic over recorded signals: parse, check, evaluate, explain.

What a signal means is never here: a formula sees samples with a status. Begin with ``formula``.
"""
