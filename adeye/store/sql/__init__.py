"""The SQL of the views, each in a file of its name; other files are what several views share.

``views`` fills in what begins with ``$``, and ``rules`` its words in capital letters, such as RANK.
No statement of anything else is here. Begin with ``v_verdicts.sql``.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from itertools import dropwhile


@cache
def statement(name: str) -> str:
    """Read a statement, without the comment above it: databases keep views as they are created.

    >>> statement("v_goal_events").splitlines()[0]
    'CREATE VIEW v_goal_events AS'
    """
    lines = (resources.files(__name__) / f"{name}.sql").read_text("utf-8").splitlines()
    return "\n".join(dropwhile(lambda line: line.startswith("--"), lines))
