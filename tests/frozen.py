"""Texts that are as they were: pages, pictures, tables, exports; in ``tests/content/frozen``.

They are pinned whole and readable, so that a change of what people see is seen in review, too.
``FROZEN=write`` in the environment writes them anew.
"""

import os
from pathlib import Path

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
