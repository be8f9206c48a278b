"""Texts that are as they were: pages, pictures, tables, exports; in ``tests/content/frozen``.

They are pinned whole and readable, so that a change of what people see is seen in review, too.
``FROZEN=write`` in the environment writes them anew.
"""

import json
import os
import re
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

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


_WIDEST = 120
_INNER = re.compile(r"([\[{])\s+([^\[\]{}]{0,400}?)\s+([\]}])")


def as_json(content: Any, *folders: Path) -> str:
    """Lay out JSON, a list and a short record that hold no other on a line of their own.

    It is ``masked`` before lines are folded: folders differ in length.
    """

    def folded(found: re.Match[str]) -> str:
        line = " ".join(found[2].split())
        is_folded = found[1] == "[" or len(line) <= _WIDEST
        return f"{found[1]}{line}{found[3]}" if is_folded else found[0]

    text = masked(json.dumps(content, indent=1, ensure_ascii=False), *folders)
    return _INNER.sub(folded, text)


def described(thing: Any, name: str = "", indent: str = "") -> list[str]:
    """Write what an object holds, a line a value: of an array its shape, sum and first numbers."""
    head = f"{indent}{name}: " if name else indent
    if isinstance(thing, np.ndarray):
        if thing.dtype.kind not in "biuf":
            return [f"{head}{thing.tolist()}"]
        numbers = [f"{float(value):.9g}" for value in thing.ravel()[:8]]
        with np.errstate(all="ignore"):
            total = float(np.nansum(np.where(np.isfinite(thing), thing, 0.0)))
        return [f"{head}{thing.shape} sum {total:.9g}: {' '.join(numbers)}"]
    if is_dataclass(thing) and not isinstance(thing, type):
        parts = {field.name: getattr(thing, field.name) for field in fields(thing)}
    elif isinstance(thing, tuple) and hasattr(thing, "_asdict"):
        parts = thing._asdict()
    elif isinstance(thing, dict):
        parts = {str(key): item for key, item in thing.items()}
    elif isinstance(thing, list | tuple) and any(not isinstance(i, int | str) for i in thing):
        parts = {str(at): item for at, item in enumerate(thing)}
    elif isinstance(thing, float):
        return [f"{head}{thing:.9g}"]
    elif thing is None or isinstance(
        thing, int | str | list | tuple | set | frozenset | np.generic
    ):
        return [f"{head}{sorted(thing) if isinstance(thing, set | frozenset) else thing}"]
    else:
        return [f"{head}a {type(thing).__name__}"]
    found = [part for key, item in parts.items() for part in described(item, key, f"{indent}  ")]
    return [head.rstrip() or f"{indent}{type(thing).__name__}", *found]
