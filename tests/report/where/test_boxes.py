"""The search over boxes: nothing smaller or truer is there, and what it says holds."""

import itertools

import numpy as np
import pytest

from adeye.report.where.boxes import Box, Scale, separate
from adeye.signals import Bools, Ints

GRID: Ints = np.array(list(itertools.product(range(4), range(3), range(3))))
SCALES = (Scale(4, is_ordered=True), Scale(3, is_ordered=True), Scale(3, is_ordered=False))


def found(fails: Bools, scales: tuple[Scale, ...] = SCALES, codes: Ints = GRID) -> Box:
    return separate(codes, fails.astype(int), (~fails).astype(int), scales)


def wrong(box: Box, fails: Bools, codes: Ints = GRID) -> int:
    return int((box.holds(codes) != fails).sum())


def every_box() -> list[Bools]:
    """Every box of the grid, written out the slow way."""
    intervals = [
        [[low <= value <= high for value in range(size)] for low in range(size) for high in
         range(low, size)] for size in (4, 3)
    ]  # fmt: skip
    sets = [[bool(number >> place & 1) for place in range(3)] for number in range(1, 8)]
    masks = itertools.product(*intervals, sets)
    boxes = [np.array([a[x] and b[y] and c[z] for x, y, z in GRID.tolist()]) for a, b, c in masks]
    return [*boxes, *(~box for box in boxes)]


@pytest.mark.parametrize("seed", range(12))
def test_no_box_has_fewer_on_the_wrong_side(seed: int) -> None:
    fails = np.random.default_rng(seed).random(len(GRID)) < (0.15, 0.5, 0.85)[seed % 3]
    least = min(int((box != fails).sum()) for box in every_box())
    box = found(fails)
    assert box.is_exact
    assert wrong(box, fails) == least


def test_box_that_is_there_is_found_with_the_axes_that_it_takes() -> None:
    for fails, axes in (
        (GRID[:, 0] >= 2, [0]),
        ((GRID[:, 0] <= 1) & (GRID[:, 2] == 1), [0, 2]),
        ((GRID[:, 0] == 1) & (GRID[:, 1] >= 1) & (GRID[:, 2] != 0), [0, 1, 2]),
    ):
        box = found(fails)
        assert wrong(box, fails) == 0
        assert [axis for axis, levels in box.chosen.items() if not levels.all()] == axes


def test_failures_around_a_box_are_outside_of_it() -> None:
    fails = ~((GRID[:, 0] >= 1) & (GRID[:, 0] <= 2))
    box = found(fails)
    assert box.is_inverse
    assert wrong(box, fails) == 0
    # Of an axis whose condition cannot be negated there is no outside.
    scales = (Scale(4, is_ordered=True, is_condition=False), *SCALES[1:])
    assert not found(fails, scales).is_inverse


def test_what_is_neither_counts_on_no_side() -> None:
    box = separate(GRID, (GRID[:, 0] == 0).astype(int), (GRID[:, 0] >= 2).astype(int), SCALES)
    assert box.holds(GRID)[GRID[:, 0] == 0].all()
    assert not box.holds(GRID)[GRID[:, 0] >= 2].any()
    assert len(box.chosen) == 1


def test_many_names_are_held_by_a_set_of_them() -> None:
    codes = np.array(list(itertools.product(range(10), range(4))))
    fails = (codes[:, 0] % 3 == 0) & (codes[:, 1] >= 2)
    box = found(fails, (Scale(10, is_ordered=False), Scale(4, is_ordered=True)), codes)
    assert wrong(box, fails, codes) == 0
    assert not box.is_exact


def test_ends_between_many_values_are_found_where_they_are() -> None:
    draw = np.random.default_rng(3).random((900, 3))
    codes = np.argsort(np.argsort(draw, axis=0), axis=0)
    fails = (draw[:, 0] < 0.313) & (draw[:, 2] > 0.7)
    box = found(fails, (Scale(900, is_ordered=True),) * 3, codes)
    assert not box.is_exact
    assert wrong(box, fails, codes) == 0
    assert sorted(box.chosen) == [0, 2]
