"""What tells whether evidence is whole: roots, verification, the ledger against the tables.

Nothing here makes results. Begin with ``verification``.
"""
