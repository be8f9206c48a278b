"""Recall the runs of a campaign part by part, and say how many are done.

A recalled run holds its whole architecture and scenario. Only one part of the runs is recalled at a
time, so memory does not grow with the campaign.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Final, TypeVar

from adeye.campaign.reproduce import recall
from adeye.campaign.runner import Progress
from adeye.sweep.structure import structure_key

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from adeye.campaign.reproduce import Recalled
    from adeye.store.repository import Repository
    from adeye.store.stored import RunRef

    Report = Callable[[Progress], None]

PART_RUNS: Final = 512
"""Runs that are recalled at a time."""
MOST_TOGETHER: Final = 128
"""Runs that are executed together with their twins or forks."""

T = TypeVar("T")


def recalled_parts(repository: Repository, runs: Sequence[RunRef]) -> Iterator[list[Recalled]]:
    """Make stored runs ready to be executed again, a part at a time.

    Args:
        repository: The database.
        runs: In any order.

    Yields:
        Parts in the order of the plan, in which runs of one structure stand together.

    Raises:
        InputError: A run was planned, but not executed yet.
        IntegrityError: A test case does not come out of the database as it went in.
    """
    ordered = sorted(runs, key=lambda run: (run.campaign, run.ordinal))
    for first in range(0, len(ordered), PART_RUNS):
        yield [recall(repository, run) for run in ordered[first : first + PART_RUNS]]


def together(items: Iterable[T], recalled_of: Callable[[T], Recalled]) -> Iterator[list[T]]:
    """Group what can be executed in one batch, in groups of ``MOST_TOGETHER`` at most.

    Args:
        items: Recalled runs, or what holds one each.
        recalled_of: Gives the run of an item.
    """
    groups: dict[object, list[T]] = defaultdict(list)
    for item in items:
        run = recalled_of(item)
        context = (run.run.campaign, run.folder, run.backend, run.variant)
        groups[structure_key(run.case), context].append(item)
    for group in groups.values():
        for first in range(0, len(group), MOST_TOGETHER):
            yield group[first : first + MOST_TOGETHER]


class Counter:
    """Counts runs that are done, and reports each time.

    Attributes:
        done: Runs so far.
    """

    def __init__(self, phase: str, total: int, report: Report | None) -> None:
        """Report that nothing is done yet.

        Args:
            phase: What is being done.
            total: Runs that there are.
            report: Who is told; None for nobody.
        """
        self.done = 0
        self._phase, self._total, self._report = phase, total, report
        self.add(0)

    def add(self, runs: int) -> None:
        """Count more runs."""
        self.done += runs
        if self._report is not None:
            self._report(Progress(self._phase, self.done, self._total, 0))
