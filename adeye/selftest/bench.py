"""A folder with the files of the bench, edited, and what the production path makes of it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from adeye import api
from adeye.errors import AdeyeError
from adeye.selftest import parts
from adeye.selftest.project import DRIVING, FILES, PARTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.campaign.summary import CampaignSummary

DB: Final = "selftest.db"


@dataclass(frozen=True, slots=True)
class Edit:
    """A part of a file that is replaced, once.

    Attributes:
        file: Path in the bench.
        old: What is replaced; must be there exactly once.
        new: By what.
    """

    file: str
    old: str
    new: str


@dataclass(frozen=True, slots=True)
class Seen:
    """What came of something that was tried.

    Attributes:
        exit_code: That the command would end with.
        text: Verdicts, findings or the error, as people read them.
    """

    exit_code: int
    text: str


class Bench:
    """A folder of its own; nothing outside of it is read or written."""

    def __init__(self, folder: Path) -> None:
        """Take an empty folder."""
        self.folder = folder
        self._seen: dict[tuple[str, str], Seen] = {}

    def settle(self, edits: Sequence[Edit]) -> Path:
        """Write the files with the edits.

        Args:
            edits: Applied in their order.

        Returns:
            The folder; the same for the same edits.

        Raises:
            ValueError: What an edit replaces is not there exactly once.
        """
        contents = dict(FILES)
        for edit in edits:
            text = contents[edit.file]
            if text.count(edit.old) != 1:
                msg = f"{edit.file} has {edit.old!r} {text.count(edit.old)} times, not once"
                raise ValueError(msg)
            contents[edit.file] = text.replace(edit.old, edit.new)
        digest = hashlib.sha256(repr(sorted(contents.items())).encode()).hexdigest()[:12]
        folder = self.folder / digest
        source = Path(parts.__file__).read_text("utf-8")
        for name, text in {**contents, **dict.fromkeys(PARTS, source)}.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        return folder

    def run(self, edits: Sequence[Edit], odd: str = DRIVING) -> Seen:
        """Plan, run, judge and store the edited bench, and say what ``adeye run`` would say."""
        folder = self.settle(edits)
        key = (folder.name, odd)
        if key not in self._seen:
            try:
                summary = api.run(folder / odd, db=folder / DB)
            except AdeyeError as error:
                self._seen[key] = Seen(error.exit_code, str(error))
            else:
                self._seen[key] = Seen(int(summary.exit_code), told(summary))
        return self._seen[key]


def told(summary: CampaignSummary) -> str:
    """Write the verdicts of a campaign and its message."""
    lines = [f"{line.fsr} {line.verdict or 'not applicable'}" for line in summary.verdicts]
    return "\n".join([*lines, summary.message])
