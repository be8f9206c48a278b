"""Texts that are as they were: pages, pictures, tables, exports; in ``tests/content/frozen``.

They are pinned whole and readable, so that a change of what people see is seen in review, too.
``FROZEN=write`` in the environment writes them anew.
"""

import json
import os
import re
from pathlib import Path
from typing import Any

from adeye.version import __version__

FOLDER = Path(__file__).parent / "content" / "frozen"


def assert_frozen(name: str, text: str) -> None:
    """Compare a text with the one that is kept under a name.

    Args:
        name: File in the folder.
        text: What was drawn, written or printed; nothing of this machine in it.
    """
    file = FOLDER / name
    if os.environ.get("FROZEN") == "write":
        file.write_bytes(text.encode())
    kept = file.read_bytes().decode()
    assert text.split("\n") == kept.split("\n"), f"{file.name} is not what it was"


LONG = 40
"""Of a longer list, about so many items are kept."""


def thinned(content: Any, long: int = LONG) -> Any:
    """Keep so many items of what is longer, evenly, the first among them."""
    if isinstance(content, dict):
        return {key: thinned(item, long) for key, item in content.items()}
    if isinstance(content, list):
        return [thinned(item, long) for item in content[:: -(-len(content) // long) or 1]]
    return content


_DIGEST = r"(?<![\w.])(?=[0-9a-f]*[a-f])(?=[0-9a-f]*\d)[0-9a-f]{7,}(?:\N{HORIZONTAL ELLIPSIS})?"
_DATE = r"\b\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z| UTC|\+00:00)?)?"
_CHANGING = (
    (re.compile(_DIGEST), "#"),
    (re.compile(_DATE), "DATE"),
    (re.compile(rf"\b{re.escape(__version__)}\b"), "VERSION"),
)


def masked(text: str, *folders: Path) -> str:
    """Put words in the place of digests, dates, the version, and folders of this machine."""
    for number, folder in enumerate(folders):
        text = text.replace(str(folder), f"FOLDER{number or ''}")
    for pattern, word in _CHANGING:
        text = pattern.sub(word, text)
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


def as_json(content: Any) -> str:
    """Lay out JSON, short lists on a line of their own."""
    text = json.dumps(content, indent=1, ensure_ascii=False)
    inner = re.compile(r"\[\s+([^\[\]{}]{0,400}?)\s+\]")
    return inner.sub(lambda found: f"[{' '.join(found[1].split())}]", text) + "\n"
