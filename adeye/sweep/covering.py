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
from itertools import combinations, islice
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import SweepError
from adeye.kernel.random import owner_id
from adeye.sweep.design import Points, Space, Tuples, axis_values, draws, holds, points_of, small

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from adeye.sweep.design import Relation

# --- Which combinations of levels can be completed to a whole point that fulfils every relation ---

MAX_TABLE: Final = 1_000_000
"""Combinations of the axes of one relation above which it is refused."""
MAX_STEPS: Final = 200_000
"""Levels that are tried for one question before the relations are called too entangled."""
MAX_SOLUTIONS: Final = 2_000
"""Solutions of a component above which they are not listed, but searched for."""
FREE: Final = -1
"""Level of an axis that has none yet."""


@dataclass(frozen=True)
class _Table:
    """Where one relation holds: its axes in ascending order, and a truth per combination."""

    axes: tuple[int, ...]
    truths: NDArray[np.bool_]

    def admits(self, row: NDArray[np.int64]) -> bool:
        """Tell whether the relation can still hold, whatever the free axes become."""
        at = tuple(slice(None) if row[axis] == FREE else int(row[axis]) for axis in self.axes)
        return bool(self.truths[at].any())


@dataclass(frozen=True)
class _Component:
    """Axes that relations tie together, those relations, and the solutions if they are few.

    Attributes:
        axes: In ascending order.
        tables: The relations.
        solutions: (S, A) levels of the axes in every solution; None where there are too many.
    """

    axes: tuple[int, ...]
    tables: tuple[_Table, ...]
    solutions: NDArray[np.int64] | None


class Feasibility:
    """Answers whether levels of some axes leave a level for every other.

    Axes that no relation names are free. The others fall into components that share no relation,
    and each question is answered component by component, by exhaustive search with the answers
    kept: exact, never a guess.
    """

    def __init__(self, space: Space) -> None:
        """Tabulate every relation.

        Args:
            space: Axes and relations.

        Raises:
            SweepError: A relation joins too many combinations, or no point fulfils them all.
        """
        self._sizes = [len(axis) for axis in space.axes]
        self._where = space.where
        self._known: dict[tuple[int, bytes], bool] = {}
        tables = [_tabulated(space, relation) for relation in space.relations]
        self._components = [
            self._component(group) for group in _tied([table for table in tables if table.axes])
        ]
        self._component_of = {
            axis: number
            for number, component in enumerate(self._components)
            for axis in component.axes
        }
        nothing = np.full(len(space.axes), FREE, dtype=np.int64)
        if not all(table.truths.any() for table in tables) or not self.completes(nothing):
            raise SweepError(
                f"none of {math.prod(self._sizes):,} combinations fulfils {space.wanted}",
                where=space.where,
                remedy="Relax the relations or widen the axes.",
            )

    def completes(self, row: NDArray[np.int64]) -> bool:
        """Tell whether a partial point can be completed.

        Args:
            row: (A,) level of each axis, ``FREE`` where it has none.
        """
        return all(self._component_completes(k, row) for k in range(len(self._components)))

    def levels(self, row: NDArray[np.int64], axis: int) -> NDArray[np.bool_]:
        """Tell which levels of a free axis a partial point that can be completed still admits.

        Args:
            row: (A,) level of each axis, ``FREE`` where it has none.
            axis: A free one.

        Returns:
            (L,) truths, at least one of them.
        """
        number = self._component_of.get(axis)
        if number is None:
            return np.ones(self._sizes[axis], dtype=np.bool_)
        tried = row.copy()
        found = np.zeros(self._sizes[axis], dtype=np.bool_)
        for level in range(self._sizes[axis]):
            tried[axis] = level
            found[level] = self._component_completes(number, tried)
        return found

    def tuples(self, axes: Sequence[int]) -> NDArray[np.bool_]:
        """Tell which combinations of levels of some axes are feasible.

        Args:
            axes: Their numbers, in ascending order.

        Returns:
            Truths in the shape of the axes' numbers of levels.
        """
        sizes = [self._sizes[axis] for axis in axes]
        found = np.ones(sizes, dtype=np.bool_)
        # Components are independent of each other, so a combination is feasible if each part is.
        parts: dict[int, list[int]] = {}
        for place, axis in enumerate(axes):
            if axis in self._component_of:
                parts.setdefault(self._component_of[axis], []).append(place)
        for number, places in parts.items():
            shape = [sizes[place] if place in places else 1 for place in range(len(axes))]
            found &= self._part(number, [axes[place] for place in places]).reshape(shape)
        return found

    def _part(self, number: int, axes: Sequence[int]) -> NDArray[np.bool_]:
        shape = tuple(self._sizes[axis] for axis in axes)
        row = np.full(len(self._sizes), FREE, dtype=np.int64)
        found = np.empty(shape, dtype=np.bool_)
        for levels in np.ndindex(shape):
            row[list(axes)] = levels
            found[levels] = self._component_completes(number, row)
        return found

    def _component_completes(self, number: int, row: NDArray[np.int64]) -> bool:
        component = self._components[number]
        own = row[list(component.axes)]
        if component.solutions is not None:
            matches = (component.solutions == own) | (own == FREE)
            return bool(matches.all(axis=1).any())
        key = (number, own.tobytes())
        if key not in self._known:
            found = next(self._solutions(component.tables, component.axes, row), None)
            self._known[key] = found is not None
        return self._known[key]

    def _component(self, tables: Sequence[_Table]) -> _Component:
        axes = tuple(sorted({axis for table in tables for axis in table.axes}))
        nothing = np.full(len(self._sizes), FREE, dtype=np.int64)
        listed = list(islice(self._solutions(tables, axes, nothing), MAX_SOLUTIONS + 1))
        few = np.array(listed).reshape(-1, len(axes)) if len(listed) <= MAX_SOLUTIONS else None
        return _Component(axes, tuple(tables), few)

    def _solutions(
        self, tables: Sequence[_Table], axes: tuple[int, ...], partial: NDArray[np.int64]
    ) -> Iterator[NDArray[np.int64]]:
        """Search depth first, with the fewest levels first and every relation looked ahead."""
        row = partial.copy()
        free = sorted((axis for axis in axes if row[axis] == FREE), key=lambda a: self._sizes[a])
        if not all(table.admits(row) for table in tables):
            return
        touching = [[table for table in tables if axis in table.axes] for axis in free]
        depth = steps = 0
        while depth >= 0:
            if depth == len(free):
                yield row[list(axes)]
                steps = 0
                depth -= 1
                continue
            axis = free[depth]
            row[axis] += 1
            steps += 1
            if steps > MAX_STEPS:
                raise SweepError(
                    f"{len(tables)} relations tie {len(axes)} axes together, and {MAX_STEPS:,} "
                    "steps do not tell which combinations are feasible",
                    where=self._where,
                    remedy="Write fewer relations, or take another design.",
                )
            if row[axis] == self._sizes[axis]:
                row[axis] = FREE
                depth -= 1
            elif all(table.admits(row) for table in touching[depth]):
                depth += 1


def _tabulated(space: Space, relation: Relation) -> _Table:
    axes = space.axes
    named = tuple(k for k, axis in enumerate(axes) if axis.name in relation.expression.names)
    sizes = tuple(len(axes[k]) for k in named)
    count = math.prod(sizes)
    if count > MAX_TABLE:
        joined = " × ".join(f"{axes[k].name} ({len(axes[k])})" for k in named)
        raise SweepError(
            f"'{relation.expression.text}' joins {count:,} combinations: {joined}; at most "
            f"{MAX_TABLE:,} are looked at",
            where=relation.where,
            remedy="Take fewer levels, or write a relation of fewer axes.",
        )
    levels = np.unravel_index(np.arange(count), sizes) if named else ()
    columns = {axes[k].name: axis_values(axes[k])[at] for k, at in zip(named, levels, strict=True)}
    return _Table(named, holds(relation, columns, space.fixed, count).reshape(sizes))


def _tied(tables: Sequence[_Table]) -> list[list[_Table]]:
    """Group relations that share axes, directly or through others."""
    groups: list[list[_Table]] = []
    for table in tables:
        apart: list[list[_Table]] = []
        joined = [table]
        for group in groups:
            if any(set(item.axes) & set(table.axes) for item in group):
                joined = [*group, *joined]
            else:
                apart.append(group)
        groups = [*apart, joined]
    return groups


# --- Covering designs: few points in which all feasible combinations of some axes at a time occur -

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


def covering(space: Space, strength: int) -> Points:
    """Find points that cover every feasible combination of levels of ``strength`` axes.

    Feasible is what some whole point has that fulfils every relation; so what excludes a
    combination only together with other relations counts, too.

    Args:
        space: Axes and relations.
        strength: How many axes at a time.

    Raises:
        SweepError: Fewer axes than the strength, too many combinations, or no feasible point.
    """
    axes, where = space.axes, space.where
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
    feasibility = Feasibility(space)
    layout = _Layout.of(sizes, strength)
    wanted = np.concatenate(
        [feasibility.tuples(list(chosen)).ravel() for chosen in layout.chosen.tolist()]
    )
    largest = np.sort(layout.sizes)[-layout.chosen.shape[1] :].prod()
    # More than the least number of points, with a guess of how many more.
    work = int(1.5 * largest) * layout.chosen.size
    candidates = max(1, min(CANDIDATES, WORK // work))
    designs = max(1, min(DESIGNS, WORK // (work * candidates)))
    # As many designs as the work allows, and of them the first smallest: (N, A).
    grown = [
        _Growth(layout, feasibility, candidates, number).design(wanted) for number in range(designs)
    ]
    table = min(grown, key=len)
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
