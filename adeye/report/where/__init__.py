"""Where among the swept values an FSR fails: counts by value, and what holds failures apart.

Nothing is executed here. Begin with ``tell``.
"""
