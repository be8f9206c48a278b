"""Sections of a plan: consecutive test cases that differ in parameter values and replicate only."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from adeye.sweep.groups import Group


@dataclass(frozen=True, eq=False)
class Section:
    """Consecutive test cases with one scenario, one architecture and one set of faults.

    Overrides by dotted path are applied once for all of them; a batch never leaves a section
    without need, because its points follow each other in the plan.

    Attributes:
        group: Whose points these are.
        rows: Which points of the design.
        replicates: Test cases of each point.
        first: Ordinal of the first test case.
    """

    group: Group
    rows: NDArray[np.int64]
    replicates: int
    first: int

    def __len__(self) -> int:
        """Number of test cases."""
        return len(self.rows) * self.replicates

    @property
    def end(self) -> int:
        """Ordinal behind the last test case."""
        return self.first + len(self)


def sections_of(groups: Iterable[Group], replicates: int) -> tuple[Section, ...]:
    """Cut groups into sections, in the order of the plan.

    Points that what the sweep writes into files makes alike stand together, in the order of the
    first of them; the other axes vary inside a section as the design says.

    Args:
        groups: In the order of the plan.
        replicates: Test cases of each point.
    """
    sections: list[Section] = []
    first = 0
    for group in groups:
        for rows in _alike(group):
            sections.append(Section(group, rows, replicates, first))
            first = sections[-1].end
    return tuple(sections)


def overlapping(
    sections: Sequence[Section], start: int, stop: int
) -> Iterator[tuple[Section, int, int]]:
    """Find what an ordinal range has of each section, without looking at those before.

    Args:
        sections: All of a plan.
        start: First ordinal.
        stop: Ordinal behind the last.

    Yields:
        A section, and the range counted from its first test case.
    """
    at = bisect_right(sections, start, key=lambda section: section.first) - 1
    while at < len(sections) and sections[at].first < stop:
        section = sections[at]
        low, high = max(start, section.first), min(stop, section.end)
        if low < high:
            yield section, low - section.first, high - section.first
        at += 1


def _alike(group: Group) -> list[NDArray[np.int64]]:
    """Split the points of a group by what they write into files."""
    codes = np.zeros(len(group.rows), dtype=np.int64)
    for axis in group.axes:
        if axis.kind != "parameter":
            known: dict[tuple[type, object], int] = {}
            # 1 and 1.0 are written differently.
            same = [known.setdefault((type(text), text), len(known)) for text in axis.texts]
            levels = group.points.levels[axis.name][group.rows]
            _, codes = np.unique(
                codes * len(known) + np.array(same, dtype=np.int64)[levels], return_inverse=True
            )
    _, first, which = np.unique(codes, return_index=True, return_inverse=True)
    if len(first) == 1:
        return [group.rows]
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    own = rank[which]
    order = np.argsort(own, kind="stable")
    return np.split(group.rows[order], np.flatnonzero(np.diff(own[order])) + 1)
