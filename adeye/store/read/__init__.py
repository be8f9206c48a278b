"""What reads the database: campaigns, bulk columns, totals, exports, queries.

Nothing here writes, but for ``rejudging``, which takes back the verdicts that were missing. Begin
with ``campaigns``.
"""
