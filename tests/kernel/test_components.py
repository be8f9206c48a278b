"""Connected parts of small images that are written down as text."""

from typing import TYPE_CHECKING

import numpy as np
import pytest

from adeye.kernel.raster import (
    EDGE,
    GHOST,
    NOTHING,
    PART_CONTACT,
    PART_FIRST,
    PART_LAST,
    PART_PIXELS,
    PART_STOP,
    PART_TOP,
    RUN_CLASS,
    RUN_PARENT,
    RUN_WIDTH,
    find_parts,
    main_owner,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

CLASSES = np.array([0, 0, 6, 0], dtype=np.int64)
"""Objects 0, 1 and 3 are of one class, 2 of another."""
DEPTHS = {0: 10.0, 1: 20.0, 2: 15.0, 3: 10.5}


class Parts:
    """The parts of an image: '.' shows nothing, '?' a ghost, digits are objects."""

    def __init__(self, *lines: str) -> None:
        signs = {".": NOTHING, "?": GHOST}
        rows = [[signs[sign] if sign in signs else int(sign) for sign in line] for line in lines]
        self.owner: NDArray[np.int64] = np.array(rows, dtype=np.int64).T.copy()
        columns, height = self.owner.shape
        nearness = np.zeros(self.owner.shape)
        for thing, depth in DEPTHS.items():
            nearness[self.owner == thing] = 1.0 / depth
        span = np.tile(np.array([0, height], dtype=np.int64), (columns, 1))
        self.runs: NDArray[np.int64] = np.zeros((self.owner.size, RUN_WIDTH), dtype=np.int64)
        self.count = find_parts(0, columns, span, self.owner, nearness, CLASSES, self.runs)
        self.numbers = [k for k in range(self.count) if self.runs[k, RUN_PARENT] == k]

    def column(self, column: int) -> list[int]:
        return [int(self.runs[part, column]) for part in self.numbers]

    def owners(self) -> list[int]:
        votes = np.zeros(len(CLASSES), dtype=np.int64)
        return [main_owner(part, self.count, self.owner, self.runs, votes) for part in self.numbers]


def test_empty_image_has_no_part() -> None:
    assert Parts("....", "....").numbers == []


def test_box_is_one_part_with_its_extent() -> None:
    parts = Parts("....", ".00.", ".00.", "....")
    assert len(parts.numbers) == 1
    assert parts.column(PART_FIRST) + parts.column(PART_LAST) == [1, 2]
    assert parts.column(PART_TOP) + parts.column(PART_STOP) == [1, 3]
    assert (parts.column(PART_PIXELS), parts.column(PART_CONTACT)) == ([4], [2])
    assert parts.owners() == [0]


def test_pixels_that_meet_at_a_corner_only_are_two_parts() -> None:
    assert len(Parts("0..", ".0.", "...").numbers) == 2


def test_u_is_one_part_though_it_begins_as_two() -> None:
    parts = Parts("0.0", "0.0", "000", "...")
    assert parts.column(PART_PIXELS) == [7]
    assert parts.column(PART_FIRST) + parts.column(PART_LAST) == [0, 2]


def test_comb_is_one_part() -> None:
    assert Parts("00000", "0.0.0", "0.0.0", ".....").column(PART_PIXELS) == [11]
    assert Parts("0.0.0", "0.0.0", "00000", ".....").column(PART_PIXELS) == [11]


def test_hole_belongs_to_nobody() -> None:
    parts = Parts("000", "0.0", "000", "...")
    assert (parts.column(PART_PIXELS), parts.column(PART_CONTACT)) == ([8], [2])


@pytest.mark.slow
def test_classes_that_touch_are_two_parts() -> None:
    parts = Parts("0022", "0022", "....")
    assert parts.column(RUN_CLASS) == [0, 6]
    assert parts.owners() == [0, 2]


def test_jump_of_depth_parts_objects_of_one_class() -> None:
    assert 1.0 - DEPTHS[0] / DEPTHS[1] > EDGE
    beside = Parts("0011", "0011", "....")
    assert beside.owners() == [0, 1]
    above = Parts("1111", "1001", ".00.", "....")
    assert sorted(above.owners()) == [0, 1]


def test_objects_of_one_class_at_one_depth_melt_together() -> None:
    assert 1.0 - DEPTHS[0] / DEPTHS[3] < EDGE
    parts = Parts("0033", "0033", "...3")
    assert parts.column(PART_PIXELS) == [9]
    assert parts.owners() == [3]
    assert Parts("333", "333", "000", "...").owners() == [3]


def test_equal_shares_name_the_first_object() -> None:
    assert Parts("0033", "0033", "....").owners() == [0]


def test_ghosts_have_no_class_and_no_owner() -> None:
    parts = Parts("??00", "??00", "....")
    assert (parts.column(RUN_CLASS), parts.owners()) == ([-1, 0], [-1, 0])


def test_contact_is_hidden_behind_what_is_below() -> None:
    parts = Parts("1111", "2222", "....")
    assert parts.column(PART_CONTACT) == [-1, 1]


def test_contact_is_that_of_the_columns_in_which_it_is_free() -> None:
    parts = Parts("1111", "1122", "..22", "....")
    assert parts.column(PART_CONTACT) == [1, 2]


def test_contact_below_the_image_is_not_seen() -> None:
    assert Parts("....", "0000").column(PART_CONTACT) == [-1]


def test_missing_pixels_do_not_lift_the_contact() -> None:
    assert Parts("000", "0.0", "000", "...").column(PART_CONTACT) == [2]


def test_mirrored_image_has_mirrored_parts() -> None:
    draw = np.random.default_rng(5)
    signs = np.array(list("...0123?"))
    for _ in range(40):
        lines = ["".join(signs[draw.integers(0, 8, 9)]) for _ in range(6)] + ["." * 9]
        one, other = Parts(*lines), Parts(*(line[::-1] for line in lines))
        for column in (PART_PIXELS, PART_TOP, PART_STOP, PART_CONTACT):
            assert sorted(one.column(column)) == sorted(other.column(column))
        assert sum(one.column(PART_PIXELS)) == sum(9 - line.count(".") for line in lines)
