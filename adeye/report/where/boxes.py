"""The smallest box over the axes of a sweep that holds failures apart from passes.

A box is an interval of levels on an axis with an order, a set of levels on one without. All boxes
over at most ``MOST_AXES`` axes at a time are looked at, inside out too. What counts is first how
many test cases are on the wrong side, then how many comparisons it takes to write.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import Any, Final

import numpy as np

from adeye.signals import Bools, Floats, Ints

MOST_AXES: Final = 3
"""Axes that a box bounds; with more, nobody would read it."""
LISTED: Final = 12
"""Levels up to which an axis is a list of values, of which one may be named alone."""
_CLASSES: Final = (0, 128, 32, LISTED)
"""Levels of an axis that are told apart, by how many axes a box bounds."""
_MOST_SETS: Final = 6
"""Levels up to which every set of them is looked at; of more, one alone and all but one."""
_WEIGHT: Final = 16
"""What one test case on the wrong side weighs, in comparisons."""


@dataclass(frozen=True, slots=True)
class Scale:
    """What an axis is to the search.

    Attributes:
        levels: How many different ones there are.
        is_ordered: Whether it has intervals.
        is_condition: Whether its condition can be negated together with those of others.
    """

    levels: int
    is_ordered: bool
    is_condition: bool = True


@dataclass(frozen=True, slots=True)
class Box:
    """Levels that hold failures apart.

    Attributes:
        chosen: (L,) which levels, by the place of each axis that is bounded.
        is_inverse: Whether the failures are outside.
        is_exact: Whether every box was looked at, or neighbouring levels were taken together.
    """

    chosen: Mapping[int, Bools]
    is_inverse: bool
    is_exact: bool

    def holds(self, codes: Ints) -> Bools:
        """Tell which test cases (N,) it says to fail, by their levels (N, A)."""
        found = _inside(self.chosen, codes)
        return ~found if self.is_inverse else found


def _inside(box: Mapping[int, Bools], codes: Ints) -> Bools:
    found: Bools = np.ones(len(codes), dtype=np.bool_)
    for axis, levels in box.items():
        found &= levels[codes[:, axis]]
    return found


def separate(codes: Ints, fails: Ints, passes: Ints, scales: Sequence[Scale]) -> Box:
    """Find the box with the fewest test cases on the wrong side, then the fewest comparisons.

    Args:
        codes: (N, A) level on each axis, of a test case or of several.
        fails: (N,) how many fail there.
        passes: (N,) how many pass there.
        scales: The axes.
    """
    best, least = Box({}, is_inverse=False, is_exact=True), int(passes.sum()) * _WEIGHT
    cells = _Cells(codes, fails, passes, scales)
    is_exact = True
    for size in range(1, min(MOST_AXES, len(scales)) + 1):
        # One comparison an axis is the least.
        if least <= size - 1:
            break
        for axes in combinations(range(len(scales)), size):
            sums = cells.sums(axes)
            for is_inverse in (False, True):
                if is_inverse and not all(scales[axis].is_condition for axis in axes):
                    continue
                box, cost, is_whole = cells.best(axes, sums, is_inverse=is_inverse)
                is_exact &= is_whole
                if cost + is_inverse < least:
                    best, least = Box(box, is_inverse, is_whole), cost + is_inverse
    return Box(best.chosen, best.is_inverse, is_exact)


class _Cells:
    """What fails and what passes, by cells of the axes; inside out, a box shall hold the passes."""

    def __init__(self, codes: Ints, fails: Ints, passes: Ints, scales: Sequence[Scale]) -> None:
        # Column after column: every box reads a few of them, whole.
        self._columns = np.ascontiguousarray(codes.T)
        self._gain = (fails - passes).astype(np.float64)
        self._wanted = int(fails.sum()), int(passes.sum())
        self._scales = scales
        self._classed: dict[tuple[int, int], tuple[Ints, Ints]] = {}

    def _classes_of(self, axis: int, most: int) -> tuple[Ints, Ints]:
        """Give the class of each level (L,) of an axis, and of each cell (N,)."""
        if (axis, most) not in self._classed:
            classes = _classes(self._scales[axis], most)
            self._classed[axis, most] = classes, classes[self._columns[axis]]
        return self._classed[axis, most]

    def _classes(self, axes: Sequence[int]) -> list[Ints]:
        return [self._classes_of(axis, _CLASSES[len(axes)])[0] for axis in axes]

    def sums(self, axes: Sequence[int]) -> Floats:
        """Sum what fails less what passes by the classes of the levels of some axes."""
        shape = tuple(int(item.max()) + 1 for item in self._classes(axes))
        flat: Ints = np.zeros(len(self._gain), dtype=np.int64)
        for axis, size in zip(axes, shape, strict=True):
            flat = flat * size + self._classes_of(axis, _CLASSES[len(axes)])[1]
        sums: Any = np.bincount(flat, self._gain, minlength=int(np.prod(shape)))
        found: Floats = sums.reshape(shape)
        return found

    def best(
        self, axes: Sequence[int], sums: Floats, *, is_inverse: bool
    ) -> tuple[dict[int, Bools], int, bool]:
        """Find the best box over some axes; give it, its cost, and whether that is exact.

        Args:
            axes: Their places.
            sums: Of them.
            is_inverse: Whether it shall hold the passes.
        """
        classes = self._classes(axes)
        scales = [
            replace(self._scales[axis], levels=size)
            for axis, size in zip(axes, sums.shape, strict=True)
        ]
        chosen, score = _best(-sums if is_inverse else sums, scales)
        box = {axis: chosen[at][classes[at]] for at, axis in enumerate(axes)}
        is_whole = all(
            self._scales[axis].levels == scale.levels
            and (scale.is_ordered or scale.levels <= _MOST_SETS)
            for axis, scale in zip(axes, scales, strict=True)
        )
        if is_whole:
            return box, self._wanted[is_inverse] * _WEIGHT - score, is_whole
        return box, self._refine(box, is_inverse=is_inverse), is_whole

    def _refine(self, box: dict[int, Bools], *, is_inverse: bool) -> int:
        """Choose the levels of one axis after the other as is best, until none moves.

        Returns:
            What the box costs at the end.
        """
        sign, wanted = -1.0 if is_inverse else 1.0, self._wanted[is_inverse]

        def cost_of(held: float, costs: Mapping[int, int]) -> int:
            return (wanted - int(sign * held)) * _WEIGHT + sum(costs.values())

        inside = {axis: levels[self._columns[axis]] for axis, levels in box.items()}
        costs = {
            axis: _comparisons(levels, is_ordered=self._scales[axis].is_ordered)
            for axis, levels in box.items()
        }
        cost = cost_of(self._gain[np.logical_and.reduce(list(inside.values()))].sum(), costs)
        is_moving = True
        while is_moving:
            is_moving = False
            for axis in box:
                others = [mask for at, mask in inside.items() if at != axis]
                rows = np.flatnonzero(np.logical_and.reduce(others)) if others else slice(None)
                scale, column = self._scales[axis], self._columns[axis]
                sums: Any = np.bincount(column[rows], self._gain[rows], scale.levels)
                found = _interval(sign * sums) if scale.is_ordered else sign * sums > 0
                own = {**costs, axis: _comparisons(found, is_ordered=scale.is_ordered)}
                less = cost_of(sums[found].sum(), own)
                if less < cost:
                    box[axis], inside[axis] = found, found[column]
                    costs, cost, is_moving = own, less, True
        return cost


def _best(sums: Floats, scales: Sequence[Scale]) -> tuple[list[Bools], int]:
    """Find the first of the boxes with the highest score among all that the axes have.

    Of the last axis the best part is found without a look at each: it takes sums along it.

    Args:
        sums: (L, …) what a box gains, by the levels of all axes.
        scales: Of the axes.

    Returns:
        (L,) levels of the box on each axis, and its score.
    """
    *others, last = scales
    # What is added up for every box of the other axes is one row.
    rows = np.ascontiguousarray(np.moveaxis(sums, -1, 0))
    options = [_options(scale) for scale in others]
    for axis, option in enumerate(options):
        rows = option.sums(rows, axis + 1)
    score = _most(rows, last)
    for axis, option in enumerate(options):
        score = score - option.costs.reshape(
            [-1 if at == axis else 1 for at in range(len(options))]
        )
    place = int(score.argmax())
    best = np.unravel_index(place, score.shape)
    own = _options(last)
    along = own.sums(rows.reshape(len(rows), -1)[:, place], 0) * _WEIGHT - own.costs
    masks = [option.mask(int(at)) for option, at in zip(options, best, strict=True)]
    return [*masks, own.mask(int(along.argmax()))], int(score.flat[place])


def _most(sums: Floats, scale: Scale) -> Floats:
    """Give the highest score (…) that a part of an axis has, less its comparisons.

    Args:
        sums: (L, …) what its levels gain.
        scale: Of the axis.
    """
    found: Floats
    if not scale.is_ordered:
        everything = sums.sum(axis=0)
        if scale.levels <= _MOST_SETS:
            # All levels that gain; if none does, one has to be there.
            gaining = np.maximum(sums, 0.0).sum(axis=0)
            best = np.where(gaining > 0.0, gaining, sums.max(axis=0))
        else:
            best = np.maximum(sums.max(axis=0), everything - sums.min(axis=0))
        found = np.maximum(everything * _WEIGHT, best * _WEIGHT - 1.0)
        return found
    before = np.zeros(sums.shape[1:])
    least, found = before, np.full(sums.shape[1:], -np.inf)
    for place, level in enumerate(sums):
        gain = level * _WEIGHT
        if place:
            least = np.minimum(least, before + 1.0)
        before = before + gain
        end = before if place == len(sums) - 1 else before - 1.0
        found = np.maximum(found, end - least)
        if len(sums) <= LISTED:
            # One level alone is named by one comparison, wherever it is.
            found = np.maximum(found, gain - 1.0)
    return found


def _classes(scale: Scale, most: int) -> Ints:
    """Give the class of each level (L,); levels without an order are never taken together."""
    levels: Ints = np.arange(scale.levels)
    if scale.levels <= most or not scale.is_ordered:
        return levels
    found: Ints = levels * most // scale.levels
    return found


@dataclass(frozen=True, slots=True)
class _Intervals:
    """The intervals of an axis of L levels, O of them, by their ends (O,) and comparisons (O,)."""

    size: int
    first: Ints
    last: Ints
    costs: Ints

    @classmethod
    def of(cls, size: int) -> _Intervals:
        first, last = np.triu_indices(size)
        costs = (first > 0).astype(np.int64) + (last < size - 1)
        if 1 < size <= LISTED:
            costs[first == last] = 1
        return cls(size, first, last, costs)

    def sums(self, values: Floats, axis: int) -> Floats:
        """Add up values (…, L, …) within each, along an axis of them."""
        nothing = np.zeros([1 if at == axis else size for at, size in enumerate(values.shape)])
        before = np.concatenate((nothing, values.cumsum(axis=axis)), axis=axis)
        found: Floats = before.take(self.last + 1, axis=axis) - before.take(self.first, axis=axis)
        return found

    def mask(self, place: int) -> Bools:
        """Give the levels (L,) of one."""
        places = np.arange(self.size)
        found: Bools = (places >= self.first[place]) & (places <= self.last[place])
        return found


@dataclass(frozen=True, slots=True)
class _Sets:
    """The sets of levels of an axis of L, O of them: masks (O, L) and comparisons (O,)."""

    masks: Floats
    costs: Ints

    @classmethod
    def of(cls, size: int) -> _Sets:
        masks = list(_sets(size))
        costs = [_comparisons(mask, is_ordered=False) for mask in masks]
        return cls(np.array(masks, dtype=np.float64), np.array(costs, dtype=np.int64))

    def sums(self, values: Floats, axis: int) -> Floats:
        """Add up values (…, L, …) within each, along an axis of them."""
        found: Floats = np.moveaxis(np.tensordot(values, self.masks, axes=(axis, 1)), -1, axis)
        return found

    def mask(self, place: int) -> Bools:
        """Give the levels (L,) of one."""
        found: Bools = self.masks[place] > 0
        return found


@lru_cache(maxsize=64)
def _options(scale: Scale) -> _Intervals | _Sets:
    """List what a box may have of an axis."""
    return (_Intervals if scale.is_ordered else _Sets).of(scale.levels)


def _sets(size: int) -> Iterator[Bools]:
    places = np.arange(size)
    yield places >= 0
    if size <= _MOST_SETS:
        for number in range(1, 2**size - 1):
            yield (number >> places & 1) == 1
        return
    for place in range(size):
        yield places == place
        yield places != place


def _comparisons(mask: Bools, *, is_ordered: bool) -> int:
    """Count the comparisons that a condition on one axis takes."""
    if mask.all():
        return 0
    if not is_ordered or (mask.sum() == 1 and len(mask) <= LISTED):
        return 1
    return int(not mask[0]) + int(not mask[-1])


def _interval(sums: Floats) -> Bools:
    """Find the interval of levels with the largest sum; an end at the edge costs no comparison."""
    before = np.concatenate(([0.0], np.cumsum(sums))) * _WEIGHT
    starts = before[:-1] + (np.arange(len(sums)) > 0)
    ends = before[1:] - (np.arange(len(sums)) < len(sums) - 1)
    least = np.minimum.accumulate(starts)
    last = int((ends - least).argmax())
    first = int(starts[: last + 1].argmin())
    places = np.arange(len(sums))
    found: Bools = (places >= first) & (places <= last)
    return found
