"""A known-bad master: what is wrong, what has to find it, how that shows; and its good twin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from adeye.selftest.bench import Bench, Edit, Seen
from adeye.selftest.project import DRIVING

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
