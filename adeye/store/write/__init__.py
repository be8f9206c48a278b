"""What puts rows into the database: plans, content, the queue, results, studies, merging.

Nothing here is read for people. Begin with ``results``.
"""
