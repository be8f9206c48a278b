"""What a recorded run means: metrics, signal temporal logic, verdicts.

Nothing here drives a run or knows a database. Begin with ``evaluate``.
"""
