"""What files alone say, without a run: dependence of channels, reference cases, sensor suites.

No trace is judged here. Begin with ``dependence``; sensor suites have a room of their own.
"""
