"""The database: plans, results and verdicts in SQL, reached through ``repository`` only."""
