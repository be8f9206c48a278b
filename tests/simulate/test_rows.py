"""Rows in the ring and in the columns: what is written, what is left alone."""

import numpy as np
import pytest

from adeye.simulate.recorder import clear, mark_detected, move

RUNS, RING, ROWS = 3, 4, 10


@pytest.mark.parametrize("kind", [np.float64, np.int8, np.int16, np.bool_])
def test_run_gets_its_rows_of_the_ring_as_far_as_it_has_come(kind: type[np.generic]) -> None:
    ring = (np.arange(RING * RUNS * 2).reshape(RING, RUNS, 2) % 3 + 1).astype(kind)
    column = np.zeros((RUNS, ROWS, 2), dtype=kind)
    # The first run has ended before the ring, the second within it, the third goes on.
    move(ring, 4, np.array([3, 6, 8]), column)
    assert not column[0].any()
    assert np.array_equal(column[1, 4:6], ring[:2, 1])
    assert np.array_equal(column[2, 4:8], ring[:, 2])
    column[1, 4:6] = column[2, 4:8] = 0
    assert not column.any()


def test_only_rows_beyond_the_end_of_a_run_are_cleared() -> None:
    column = np.ones((RUNS, ROWS, 2))
    clear(column, np.array([10, 4, 0]), 8)
    assert column.sum(axis=(1, 2)).tolist() == [20.0, 2.0 * (4 + 2), 2.0 * 2]
    assert column[1, :4].all()
    assert not column[1, 4:8].any()


def test_reading_marks_the_objects_behind_its_detections() -> None:
    detected = np.ones((2, 3), dtype=np.bool_)
    mask = np.array([[True, True, False], [False, True, True]])
    # A detection without an object leaves no mark, and what was marked before is forgotten.
    mark_detected(mask, np.array([[1, -1, 0], [0, 2, 1]]), detected)
    assert detected.tolist() == [[False, True, False], [False, True, True]]
