"""The search over boxes: nothing smaller or truer is there, and what it says holds."""

import itertools

import numpy as np
import pytest

from adeye.report.where.boxes import Box, Scale, separate
from adeye.signals import Bools, Ints
from tests.frozen import assert_frozen
from tests.report.where.exhaustive import search

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


def random_table(seed: int) -> tuple[Ints, Ints, Ints, list[Scale]]:
    """Give test cases at random levels, with failures that hang on one of them or on none."""
    draw = np.random.default_rng(seed)
    # Few levels; more than an axis is told apart by at first; one alone.
    most = (4, 9, 16, 40)[seed % 4]
    axes = [
        Scale(int(draw.integers(1, most if ordered else min(most, 9))), bool(ordered), bool(joint))
        for ordered, joint in zip(draw.random(4) < 0.6, draw.random(4) < 0.8, strict=True)
    ]
    scales = axes[: int(draw.integers(1, 5))]
    count = int(draw.integers(2, 90))
    codes = np.stack([draw.integers(0, scale.levels, count) for scale in scales], axis=1)
    fails = draw.random(count) < draw.choice([0.05, 0.4, 0.8])
    if seed % 3:
        fails = (codes[:, -1] * 2 > scales[-1].levels) ^ (draw.random(count) < 0.1)
    # Several test cases at one place, and some that are neither.
    weights = draw.integers(0, 4, count)
    return codes, fails * weights, ~fails * weights, scales


@pytest.mark.parametrize("seed", range(120))
def test_box_is_the_one_that_is_found_where_every_box_is_written_out(seed: int) -> None:
    table = random_table(seed)
    box, meant = separate(*table), search(*table)
    assert (box.is_inverse, box.is_exact) == (meant.is_inverse, meant.is_exact)
    assert {axis: levels.tolist() for axis, levels in box.chosen.items()} == {
        axis: levels.tolist() for axis, levels in meant.chosen.items()
    }
    assert list(box.chosen) == list(meant.chosen)


def test_boxes_of_random_tables_are_frozen() -> None:
    """Of each table what is inside, on which axes, and whether nothing better is there."""
    lines = []
    for seed in range(60):
        codes, fails, passes, scales = random_table(seed)
        box = separate(codes, fails, passes, scales)
        axes = "; ".join(
            f"{axis} in {np.flatnonzero(levels).tolist()} of {len(levels)}"
            for axis, levels in sorted(box.chosen.items())
        )
        inside = box.holds(codes)
        lines.append(
            f"{seed}: {'outside' if box.is_inverse else 'inside'} {axes or 'everything'}, "
            f"{'exact' if box.is_exact else 'searched'}; {fails[inside].sum()} fail and "
            f"{passes[inside].sum()} pass there, {fails[~inside].sum()} and "
            f"{passes[~inside].sum()} elsewhere"
        )
    assert_frozen("boxes.txt", "\n".join([*lines, ""]))
