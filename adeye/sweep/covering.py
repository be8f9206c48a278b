"""Covering designs: few points in which all feasible combinations of some axes at a time occur.

Greedy growth: a point begins with a combination that no point has yet, and gets the other axes in
random order, each at the level that covers most of what is open. Of several such points the best
is taken, and of several such designs the smallest. The random numbers are fixed, so that the same
axes and relations always give the same points.

Source:
    Cohen, Dalal, Fredman, Patton (1997), "The AETG system: an approach to testing based on
    combinatorial design", IEEE TSE 23(7); coverage as in NIST SP 800-142.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import SweepError
from adeye.kernel.random import owner_id
from adeye.sweep.design import Points, Tuples, draws, points_of, small
from adeye.sweep.feasible import FREE, Feasibility

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.errors import SourceLocation
    from adeye.sweep.axes import Axis
    from adeye.sweep.design import Relation

MAX_TUPLES: Final = 1_000_000
"""Combinations above which a covering design is refused."""
CANDIDATES: Final = 20
"""Points of which the best is taken."""
DESIGNS: Final = 8
"""Designs of which the smallest is taken."""
WORK: Final = 1_500_000
"""Combinations that may be looked at for more than one candidate and one design."""

_SEED: Final = np.uint64(0)
_OWNER: Final = np.uint64(owner_id("sweep/covering"))


def covering(
    axes: Sequence[Axis],
    strength: int,
    relations: Sequence[Relation],
    fixed: Mapping[str, float],
    where: SourceLocation,
) -> Points:
    """Find points that cover every feasible combination of levels of ``strength`` axes.

    Feasible is what some whole point has that fulfils every relation; so what excludes a
    combination only together with other relations counts, too.

    Args:
        axes: The varied quantities.
        strength: How many at a time.
        relations: What a point must fulfil.
        fixed: Values of the names that do not vary.
        where: Place of the sweep, for messages.

    Raises:
        SweepError: Fewer axes than the strength, too many combinations, or no feasible point.
    """
    sizes = [len(axis) for axis in axes]
    if len(axes) < strength:
        raise SweepError(
            f"strength {strength} takes combinations of {strength} axes, and there are {len(axes)}",
            where=where,
            remedy="Vary more, lower the strength, or take design: full_factorial.",
        )
    total = _count(sizes, strength)
    if total > MAX_TUPLES:
        raise SweepError(
            f"there are {total:,} combinations of {strength} axes; at most {MAX_TUPLES:,} are "
            "covered",
            where=where,
            remedy="Lower the strength or take fewer levels.",
        )
    feasibility = Feasibility(axes, relations, fixed, where)
    layout = _Layout.of(sizes, strength)
    wanted = np.concatenate(
        [feasibility.tuples(list(chosen)).ravel() for chosen in layout.chosen.tolist()]
    )
    table = _smallest(layout, wanted, feasibility)
    levels = [small(table[:, at], size) for at, size in enumerate(sizes)]
    found = Tuples(strength, int(wanted.sum()), total)
    return points_of(axes, levels, math.prod(sizes), len(table), found)


def _count(sizes: Sequence[int], strength: int) -> int:
    """Count the combinations: the elementary symmetric polynomial of the sizes."""
    counts = [1] + [0] * strength
    for size in sizes:
        for at in range(strength, 0, -1):
            counts[at] += counts[at - 1] * size
    return counts[strength]


@dataclass(frozen=True)
class _Layout:
    """Where each combination of levels stands in one long array.

    Attributes:
        sizes: (A,) levels of each axis.
        chosen: (C, t) axes that are combined.
        strides: (C, t) how far the next level of each is.
        first: (C,) where the combinations of each choice begin.
        having: Choices that have an axis, by the axis.
    """

    sizes: NDArray[np.int64]
    chosen: NDArray[np.int64]
    strides: NDArray[np.int64]
    first: NDArray[np.int64]
    having: list[NDArray[np.int64]]

    @classmethod
    def of(cls, sizes: Sequence[int], strength: int) -> _Layout:
        own = np.array(sizes, dtype=np.int64)
        chosen = np.array(list(combinations(range(len(sizes)), strength)), dtype=np.int64)
        levels = own[chosen]
        strides = np.ones_like(chosen)
        for at in range(strength - 2, -1, -1):
            strides[:, at] = strides[:, at + 1] * levels[:, at + 1]
        counts = levels.prod(axis=1)
        first = np.cumsum(counts) - counts
        having = [np.flatnonzero((chosen == axis).any(axis=1)) for axis in range(len(sizes))]
        return cls(own, chosen, strides, first, having)

    def places(self, row: NDArray[np.int64]) -> NDArray[np.int64]:
        """Find the combinations that a whole point has: (C,)."""
        found: NDArray[np.int64] = self.first + (row[self.chosen] * self.strides).sum(axis=1)
        return found

    def beginning(self, place: int) -> NDArray[np.int64]:
        """Make a point of one combination with every other axis free: (A,)."""
        choice = int(np.searchsorted(self.first, place, side="right")) - 1
        row = np.full(len(self.sizes), FREE, dtype=np.int64)
        rest = place - int(self.first[choice])
        for axis, stride in zip(self.chosen[choice], self.strides[choice], strict=True):
            row[axis], rest = divmod(rest, int(stride))
        return row

    def gains(
        self, row: NDArray[np.int64], axis: int, is_open: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """Count the open combinations that each level of an axis would complete: (L,)."""
        mine = self.having[axis]
        chosen, strides = self.chosen[mine], self.strides[mine]
        is_mine = chosen == axis
        levels = np.where(is_mine, 0, row[chosen])
        complete = (levels != FREE).all(axis=1)
        base = (self.first[mine] + (levels * strides).sum(axis=1))[complete]
        step = strides[is_mine][complete]
        counts: NDArray[np.int64] = is_open[
            base + np.arange(self.sizes[axis])[:, np.newaxis] * step
        ].sum(axis=1)
        return counts


def _smallest(
    layout: _Layout, wanted: NDArray[np.bool_], feasibility: Feasibility
) -> NDArray[np.int64]:
    """Grow as many designs as the work allows and take the first smallest: (N, A)."""
    largest = np.sort(layout.sizes)[-layout.chosen.shape[1] :].prod()
    # More than the least number of points, with a guess of how many more.
    work = int(1.5 * largest) * layout.chosen.size
    candidates = max(1, min(CANDIDATES, WORK // work))
    designs = max(1, min(DESIGNS, WORK // (work * candidates)))
    grown = [
        _Growth(layout, feasibility, candidates, number).design(wanted) for number in range(designs)
    ]
    return min(grown, key=len)


@dataclass(frozen=True)
class _Growth:
    """Grows one design."""

    layout: _Layout
    feasibility: Feasibility
    candidates: int
    number: int

    def design(self, wanted: NDArray[np.bool_]) -> NDArray[np.int64]:
        is_open = wanted.copy()
        rows: list[NDArray[np.int64]] = []
        while is_open.any():
            opened = np.flatnonzero(is_open)
            best, most = opened, 0
            for candidate in range(self.candidates):
                row = self._point(is_open, opened, len(rows) * self.candidates + candidate)
                gain = int(is_open[self.layout.places(row)].sum())
                if gain > most:
                    best, most = row, gain
            is_open[self.layout.places(best)] = False
            rows.append(best)
        return np.array(rows, dtype=np.int64)

    def _point(
        self, is_open: NDArray[np.bool_], opened: NDArray[np.int64], number: int
    ) -> NDArray[np.int64]:
        """Grow a whole feasible point that has at least one open combination."""
        sizes = self.layout.sizes
        chance = draws(_SEED, _OWNER, self.number, number, 1 + len(sizes) + int(sizes.sum()))
        row = self.layout.beginning(int(opened[int(chance[0] * len(opened))]))
        free = np.flatnonzero(row == FREE)
        ties = np.split(chance[1 + len(sizes) :], np.cumsum(sizes)[:-1])
        for axis in free[np.argsort(chance[1 : 1 + len(free)], kind="stable")].tolist():
            gains = self.layout.gains(row, axis, is_open)
            # Between levels of one gain a number below 1 decides.
            rated = np.where(self.feasibility.levels(row, axis), gains + ties[axis], -1.0)
            row[axis] = int(np.argmax(rated))
        return row
