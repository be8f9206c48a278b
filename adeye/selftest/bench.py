"""A folder with the files of the bench, edited, and what the production path makes of it.

Everything is good as it is written in ``project``: both campaigns end with exit code 0. A master is
an edit of these texts.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from adeye import api
from adeye.errors import AdeyeError, code_of
from adeye.packaged import packaged_text, packaged_yaml
from adeye.selftest import parts

if TYPE_CHECKING:
    from adeye.campaign.summary import CampaignSummary

# --- The files of the bench: a lead that brakes, two architectures, their concepts and ODDs -------

SCENARIO: Final = "scenarios_db/closing.yaml"
CURVE: Final = "scenarios_db/closing_curve.yaml"
DRIVING: Final = "odd/driving.yaml"
HANDOVER: Final = "odd/handover.yaml"
BARE: Final = "odd/architectures/bare.yaml"
GUARDED: Final = "odd/architectures/guarded.yaml"
DRIVING_CONCEPT: Final = "odd/concepts/driving.yaml"
HANDOVER_CONCEPT: Final = "odd/concepts/handover.yaml"
PARTS: Final = ("odd/parts.py", "odd/architectures/parts.py")
"""Where the plug-ins are put: metrics beside the ODD, the others beside the architectures."""

FILES: Final[dict[str, str]] = {
    name: packaged_text("adeye.selftest", f"project/{name}")
    for name in (
        *(SCENARIO, CURVE, BARE, GUARDED),
        *(DRIVING_CONCEPT, HANDOVER_CONCEPT, DRIVING, HANDOVER),
    )
}
"""Every file of the bench beside the plug-ins, by its path."""


# --- A folder with the files of the bench, edited, and what the production path makes of it -------

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
                self._seen[key] = Seen(code_of(error), str(error))
            else:
                self._seen[key] = Seen(int(summary.exit_code), told(summary))
        return self._seen[key]


def told(summary: CampaignSummary) -> str:
    """Write the verdicts of a campaign and its message."""
    lines = [f"{line.fsr} {line.verdict or 'not applicable'}" for line in summary.verdicts]
    return "\n".join([*lines, summary.message])


# --- A known-bad master: what is wrong, what has to find it, how that shows; and its good twin ----

Group = Literal[
    "channel", "sensor", "switch", "monitor", "threshold", "file", "metric", "database", "report"
]
GROUPS: Final[tuple[Group, ...]] = (
    *("channel", "sensor", "switch", "monitor"),
    *("threshold", "file", "metric", "database", "report"),
)
Examine = Callable[[Bench], Seen]


@dataclass(frozen=True, slots=True)
class Master:
    """A small deliberate defect that a working tool detects.

    Attributes:
        name: Its name.
        group: Where the defect is.
        wrong: What is wrong.
        finder: The mechanism that must find it.
        exit_code: That it must show by.
        words: What the verdicts, findings or the error must say.
        examine: Takes the defect through the production path.
        twin: The same without the defect, which must end with 0.
    """

    name: str
    group: Group
    wrong: str
    finder: str
    exit_code: int
    words: str
    examine: Examine
    twin: Examine

    def is_detected(self, seen: Seen) -> bool:
        """Tell whether what was seen shows the defect, in the way that it must."""
        return seen.exit_code == self.exit_code and self.words in seen.text


def is_good(seen: Seen) -> bool:
    """Tell whether a twin was taken for what it is."""
    return seen.exit_code == 0


def running(*edits: Edit, odd: str = DRIVING) -> Examine:
    """Take the bench with some edits through plan, run, judge, store and exit code."""
    return lambda bench: bench.run(edits, odd)


# --- The masters as they are written: what is there, and by what it is replaced -------------------

_CHECK: Final = "check of the files, before anything is executed"


def written(group: Group) -> dict[str, dict[str, Any]]:
    """Read the masters of a group, by name, from ``masters.yaml``, which says what keys mean."""
    every = packaged_yaml("adeye.selftest", "masters.yaml")
    return {name: item for name, item in every.items() if item["group"] == group}


def master_of(name: str, item: dict[str, Any], examine: Examine, twin: Examine) -> Master:
    """Make a master of what is written of it, and of what takes it through the production path."""
    code = item.get("exit_code", 2)
    finder = item.get(
        "finder", _CHECK if code == 2 else "judging, on runs that are known to be good"
    )
    return Master(name, item["group"], item["wrong"], finder, code, item["words"], examine, twin)


def edited(name: str, item: dict[str, Any]) -> Master:
    """Make a master that is edits of the bench."""
    bad, good = (_edits(item, key) for key in ("bad", "good"))
    is_handover = not {HANDOVER, HANDOVER_CONCEPT, GUARDED}.isdisjoint(edit.file for edit in bad)
    odd = HANDOVER if is_handover else DRIVING
    return master_of(name, item, running(*bad, odd=odd), running(*good, odd=odd))


def _edits(item: dict[str, Any], key: str) -> list[Edit]:
    new = item.get(key, ())
    edits = [(item["file"], item["old"], new)] if isinstance(new, str) else new
    also = [item["also"]] if "also" in item else []
    return [Edit(*edit) for edit in (*edits, *also)]
