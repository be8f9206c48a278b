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
    cells = _Cells(codes, fails, passes, scales), _Cells(codes, passes, fails, scales)
    is_exact = True
    for size in range(1, min(MOST_AXES, len(scales)) + 1):
        # One comparison an axis is the least.
        if least <= size - 1:
            break
        for axes in combinations(range(len(scales)), size):
            for is_inverse in (False, True):
                if is_inverse and not all(scales[axis].is_condition for axis in axes):
                    continue
                box, cost, is_whole = cells[is_inverse].best(axes)
                is_exact &= is_whole
                if cost + is_inverse < least:
                    best, least = Box(box, is_inverse, is_whole), cost + is_inverse
    return Box(best.chosen, best.is_inverse, is_exact)


@dataclass(frozen=True, slots=True)
class _Cells:
    """What a box shall hold, and what not, by cells of the axes."""

    codes: Ints
    wanted: Ints
    others: Ints
    scales: Sequence[Scale]

    def best(self, axes: Sequence[int]) -> tuple[dict[int, Bools], int, bool]:
        """Find the best box over some axes; give it, its cost, and whether that is exact."""
        scales = [self.scales[axis] for axis in axes]
        classes = [_classes(scale, _CLASSES[len(axes)]) for scale in scales]
        shape = tuple(int(item.max()) + 1 for item in classes)
        flat = np.ravel_multi_index(
            tuple(item[self.codes[:, axis]] for axis, item in zip(axes, classes, strict=True)),
            shape,
        )
        gain = (self.wanted - self.others).astype(float)
        sums: Any = np.bincount(flat, gain, minlength=int(np.prod(shape))).reshape(shape)
        options = [
            _options(replace(scale, levels=size)) for scale, size in zip(scales, shape, strict=True)
        ]
        for masks, _ in options:
            # The first axis becomes the last one, so that at the end their order is as it was.
            sums = np.tensordot(sums, masks, axes=(0, 1))
        score = sums * _WEIGHT
        for place, (_, costs) in enumerate(options):
            score -= costs.reshape([-1 if at == place else 1 for at in range(len(axes))])
        chosen = np.unravel_index(int(score.argmax()), score.shape)
        box = {axis: (options[at][0][chosen[at]] > 0)[classes[at]] for at, axis in enumerate(axes)}
        is_whole = all(
            scale.levels == size and (scale.is_ordered or size <= _MOST_SETS)
            for scale, size in zip(scales, shape, strict=True)
        )
        if not is_whole:
            self._refine(box)
        return box, self._cost(box), is_whole

    def _cost(self, box: Mapping[int, Bools]) -> int:
        inside = _inside(box, self.codes)
        wrong = int(self.wanted[~inside].sum() + self.others[inside].sum())
        return wrong * _WEIGHT + sum(
            _comparisons(levels, is_ordered=self.scales[axis].is_ordered)
            for axis, levels in box.items()
        )

    def _refine(self, box: dict[int, Bools]) -> None:
        """Choose the levels of one axis after the other as is best, until none moves."""
        cost, is_moving = self._cost(box), True
        while is_moving:
            is_moving = False
            for axis in list(box):
                rows = _inside({at: box[at] for at in box if at != axis}, self.codes)
                gain = (self.wanted[rows] - self.others[rows]).astype(float)
                scale = self.scales[axis]
                sums: Any = np.bincount(self.codes[rows, axis], gain, scale.levels)
                found = _interval(sums) if scale.is_ordered else sums > 0
                less = self._cost({**box, axis: found})
                if less < cost:
                    box[axis], cost, is_moving = found, less, True


def _classes(scale: Scale, most: int) -> Ints:
    """Give the class of each level (L,); levels without an order are never taken together."""
    levels: Ints = np.arange(scale.levels)
    if scale.levels <= most or not scale.is_ordered:
        return levels
    found: Ints = levels * most // scale.levels
    return found


@lru_cache(maxsize=64)
def _options(scale: Scale) -> tuple[Floats, Ints]:
    """List what a box may have of an axis: masks (O, L) and how many comparisons each takes."""
    masks = list((_intervals if scale.is_ordered else _sets)(scale.levels))
    costs = [_comparisons(mask, is_ordered=scale.is_ordered) for mask in masks]
    return np.array(masks, dtype=np.float64), np.array(costs, dtype=np.int64)


def _intervals(size: int) -> Iterator[Bools]:
    places = np.arange(size)
    for first in range(size):
        for last in range(first, size):
            yield (places >= first) & (places <= last)


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
