"""The search over boxes as it is meant: every box of every choice of axes is written out."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from adeye.report.where.boxes import Box, Scale
from adeye.signals import Bools, Floats, Ints

CLASSES = (0, 128, 32, 12)
"""Levels that are told apart at first, by how many axes a box bounds."""
WRONG = 16
"""What a test case on the wrong side costs, in comparisons."""


def search(codes: Ints, fails: Ints, passes: Ints, scales: Sequence[Scale]) -> Box:
    """Find what ``boxes.separate`` has to find, the first of several that cost the same."""
    best, least, is_exact = Box({}, is_inverse=False, is_exact=True), passes.sum() * WRONG, True
    for size in range(1, min(3, len(scales)) + 1):
        if least <= size - 1:
            break
        for axes in combinations(range(len(scales)), size):
            for is_inverse in (False, True):
                if is_inverse and not all(scales[axis].is_condition for axis in axes):
                    continue
                sides = (passes, fails) if is_inverse else (fails, passes)
                box, is_whole = _over(axes, codes, *sides, scales)
                cost = _cost(box, codes, *sides, scales) + is_inverse
                is_exact &= is_whole
                if cost < least:
                    best, least = Box(box, is_inverse, is_whole), cost
    return Box(best.chosen, best.is_inverse, is_exact)


def _over(
    axes: Sequence[int], codes: Ints, wanted: Ints, others: Ints, scales: Sequence[Scale]
) -> tuple[dict[int, Bools], bool]:
    groups = [_groups(scales[axis], CLASSES[len(axes)]) for axis in axes]
    options = [
        list(_options(int(group.max()) + 1, is_ordered=scales[axis].is_ordered))
        for axis, group in zip(axes, groups, strict=True)
    ]
    gain: Any = (wanted - others).astype(float) * WRONG
    # (O, …, N): which test cases each box holds.
    for place, (axis, group, masks) in enumerate(zip(axes, groups, options, strict=True)):
        held = np.array(masks)[:, group[codes[:, axis]]].astype(float)
        gain = held * gain if not place else gain[..., np.newaxis, :] * held
    score = gain.sum(axis=-1)
    for place, (axis, masks) in enumerate(zip(axes, options, strict=True)):
        costs = [comparisons(mask, is_ordered=scales[axis].is_ordered) for mask in masks]
        score = score - np.reshape(costs, [-1 if at == place else 1 for at in range(len(axes))])
    chosen = np.unravel_index(int(score.argmax()), score.shape)
    box = {
        axis: masks[at][group]
        for axis, masks, at, group in zip(axes, options, chosen, groups, strict=True)
    }
    is_whole = all(
        len(group) == group.max() + 1 and (scales[axis].is_ordered or len(group) <= 6)
        for axis, group in zip(axes, groups, strict=True)
    )
    if not is_whole:
        _move(box, codes, wanted, others, scales)
    return box, is_whole


def _move(
    box: dict[int, Bools], codes: Ints, wanted: Ints, others: Ints, scales: Sequence[Scale]
) -> None:
    is_moving = True
    while is_moving:
        is_moving = False
        for axis in box:
            rows = _inside({at: box[at] for at in box if at != axis}, codes)
            sums = np.zeros(scales[axis].levels)
            np.add.at(sums, codes[rows, axis], (wanted - others)[rows].astype(float))
            found = _interval(sums) if scales[axis].is_ordered else sums > 0
            moved = {**box, axis: found}
            sides = codes, wanted, others, scales
            if _cost(moved, *sides) < _cost(box, *sides):
                box[axis], is_moving = found, True


def _interval(sums: Floats) -> Bools:
    size = len(sums)
    found = {
        (first, last): sums[first : last + 1].sum() * WRONG - (first > 0) - (last < size - 1)
        for last in range(size)
        for first in range(last + 1)
    }
    return _between(size, *max(found, key=found.__getitem__))  # the first of several


def _cost(
    box: dict[int, Bools], codes: Ints, wanted: Ints, others: Ints, scales: Sequence[Scale]
) -> int:
    inside = _inside(box, codes)
    return int(wanted[~inside].sum() + others[inside].sum()) * WRONG + sum(
        comparisons(levels, is_ordered=scales[axis].is_ordered) for axis, levels in box.items()
    )


def _inside(box: dict[int, Bools], codes: Ints) -> Bools:
    found: Bools = np.ones(len(codes), dtype=np.bool_)
    for axis, levels in box.items():
        found &= levels[codes[:, axis]]
    return found


def _groups(scale: Scale, most: int) -> Ints:
    places: Ints = np.arange(scale.levels)
    return places * most // scale.levels if scale.is_ordered and scale.levels > most else places


def _options(size: int, *, is_ordered: bool) -> Iterator[Bools]:
    if is_ordered:
        for first in range(size):
            for last in range(first, size):
                yield _between(size, first, last)
        return
    places = np.arange(size)
    yield places >= 0
    if size <= 6:
        for number in range(1, 2**size - 1):
            yield (number >> places & 1) == 1
        return
    for place in range(size):
        yield places == place
        yield places != place


def _between(size: int, first: int, last: int) -> Bools:
    places = np.arange(size)
    found: Bools = (places >= first) & (places <= last)
    return found


def comparisons(mask: Bools, *, is_ordered: bool) -> int:
    """Count what it takes to write a condition on one axis."""
    if mask.all():
        return 0
    if not is_ordered or (mask.sum() == 1 and len(mask) <= 12):
        return 1
    return int(not mask[0]) + int(not mask[-1])
