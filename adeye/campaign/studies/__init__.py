"""What more executions tell: forks, fault timing, preventability, half the step, certificates.

Each looks at runs, skips what is known, executes the rest in parts, saves and tabulates. No stored
result is altered here. Begin with ``forks``.
"""
