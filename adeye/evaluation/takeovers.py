"""Takeovers as decisions of a classifier: the fork with the other decision tells the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping

TakeoverClass = Literal["needed_and_done", "late", "spurious", "missed", "not_needed"]
TAKEOVER_CLASSES: Final[tuple[TakeoverClass, ...]] = (
    "needed_and_done",
    "late",
    "spurious",
    "missed",
    "not_needed",
)
"""What a takeover, or doing without, was in hindsight."""

TAKEOVERS_VERSION: Final = 1
"""Raised whenever a class can change although the traces do not."""


@dataclass(frozen=True, slots=True)
class Takeover:
    """A run and its fork with the other decision.

    Attributes:
        took_over: Whether another channel than the default acted in the run.
        violates: Whether the run violates: contact, or off the road.
        fork_violates: Whether its fork does; None where there is no other decision to take.
    """

    took_over: bool
    violates: bool
    fork_violates: bool | None


def classify_takeover(takeover: Takeover) -> TakeoverClass:
    """Say what a decision was in hindsight.

    With a takeover the fork goes on without: it was needed if the fork violates, and came late if
    the run violates nevertheless. Without a takeover the run itself is what happens without.

    Raises:
        ValueError: A run with a takeover has no fork: its truth is not known.

    >>> classify_takeover(Takeover(True, False, True))
    'needed_and_done'
    >>> classify_takeover(Takeover(False, True, False))
    'missed'
    """
    if not takeover.took_over:
        return "missed" if takeover.violates else "not_needed"
    if takeover.fork_violates is None:
        msg = "a takeover without its fork cannot be classified"
        raise ValueError(msg)
    if not takeover.fork_violates:
        return "spurious"
    return "late" if takeover.violates else "needed_and_done"


def precision_of(counts: Mapping[TakeoverClass, int]) -> tuple[int, int]:
    """Give the takeovers that were needed, in time or late, and all of them.

    >>> counts = {"needed_and_done": 6, "late": 1, "spurious": 3, "missed": 2, "not_needed": 9}
    >>> precision_of(counts), recall_of(counts, avoidable=1)
    ((7, 10), (6, 8))
    """
    needed = counts["needed_and_done"] + counts["late"]
    return needed, needed + counts["spurious"]


def recall_of(counts: Mapping[TakeoverClass, int], avoidable: int) -> tuple[int, int]:
    """Give the takeovers that were needed and in time, and the runs that needed one.

    Args:
        counts: Runs by class.
        avoidable: Missed ones that a takeover would have helped; the others needed none.
    """
    done = counts["needed_and_done"]
    return done, done + counts["late"] + avoidable
