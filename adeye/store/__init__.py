"""The database: plans, results and verdicts in SQL, reached through ``repository`` only.

Nothing here drives a run, and nothing elsewhere imports SQLAlchemy. Begin with ``repository``.
"""
