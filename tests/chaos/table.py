"""Write the page that lists every way: ``python -m tests.chaos.table``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from tests.chaos import inputs, missing, platform, stored
from tests.chaos.ways import Way

PAGE: Final = Path(__file__).resolve().parents[2] / "docs" / "reference" / "lost-evidence.md"
GROUPS: Final[Mapping[str, Sequence[Way]]] = {
    "Files that ask for nothing, or for what cannot be judged": inputs.WAYS,
    "Evidence that is not there, or says nothing": missing.WAYS,
    "Stored evidence that was altered or taken away": stored.WAYS,
    "A machine that does not do its part": platform.WAYS,
}
HEAD: Final = """<!-- Made by tests/chaos/table.py; do not edit. -->

# Lost and false evidence

What was tried to make `adeye run` and `adeye gate` say yes without evidence. Each line is a test
that spoils a green campaign through the command line and checks the exit code and that the output
names the cause. None may end with 0.
"""


def page() -> str:
    """Write the page."""
    parts = [HEAD]
    for title, ways in GROUPS.items():
        parts.append(f"## {title}\n\n| What | Exit code | The output names |\n| --- | --- | --- |")
        parts[-1] += "".join(f"\n| {way.what} | {way.code} | `{way.said}` |" for way in ways) + "\n"
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
