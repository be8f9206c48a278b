"""What puts rows into the database: plans, content, the queue, results, studies, merging.

How anything is shown is not decided here, though studies are read where they are saved. Begin with
``results``.
"""
