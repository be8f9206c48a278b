"""What reads the database: campaigns, bulk columns, totals, exports, queries.

Nothing here writes. Begin with ``campaigns``.
"""
