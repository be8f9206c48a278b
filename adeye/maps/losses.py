"""What an import did not take as it was written: a report by line of the source."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

LossKind = Literal["approximated", "repaired", "guessed", "ignored"]


@dataclass(frozen=True, slots=True)
class Loss:
    """One thing of a map that was not taken as it was written.

    Attributes:
        kind: What became of it.
        line: In the file.
        element: Path of the element, such as ``road[3].lanes.laneSection[1].lane[-2].access``.
        message: What stood there and what was made of it.
    """

    kind: LossKind
    line: int
    element: str
    message: str
