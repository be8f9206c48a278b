"""The SQL of views, each in a file of its name, of accounts and long questions, and of a server.

Others are what several share.

Who reads a statement fills in what begins with ``$``, and ``rules`` its words in capital letters,
such as RANK. Above that of a rule stand what is wrong and what to do about it.
No statement that changes anything is here. Begin with ``v_verdicts.sql``.
"""

from __future__ import annotations

from functools import cache
from itertools import dropwhile
from string import Template

from adeye.packaged import packaged_text


@cache
def statement(name: str) -> str:
    """Read a statement, without the comment above it: databases keep views as they are created.

    >>> statement("v_goal_events").splitlines()[0]
    'CREATE VIEW v_goal_events AS'
    """
    return "\n".join(dropwhile(_is_comment, _lines(name)))


def filled(name: str, **words: object) -> str:
    """Read a statement and put words in the places of ``$``."""
    return Template(statement(name)).substitute(words)


def heading(name: str) -> tuple[str, str]:
    """Read the first two lines of the comment above a statement.

    >>> heading("v_check_not_run")[0]
    'Planned test cases, or twins with half the step, have no result that counts.'
    """
    first, second, *_ = _lines(name)
    return first.removeprefix("-- "), second.removeprefix("-- ")


def _lines(name: str) -> list[str]:
    return packaged_text(__name__, f"{name}.sql").splitlines()


def _is_comment(line: str) -> bool:
    return line.startswith("--")
