"""The HTML page: views of the record, charts, the replay.

Nothing here reads a database. Begin with ``html``.
"""
