"""Rows in the ring and in the columns: what is written, what is left alone."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.recorder.rows import add_reading, clear, move_column, place_detections
from adeye.signals import EGO_HEADING, EGO_X, EGO_Y

RUNS, RING, ROWS = 3, 4, 10


@pytest.mark.parametrize("kind", [np.float64, np.int8, np.int16, np.bool_])
def test_column_gets_its_part_of_the_ring_in_its_own_type(kind: type[np.generic]) -> None:
    ring = np.arange(RUNS * RING * 5, dtype=np.float64).reshape(RUNS, RING, 5) % 3.0
    column = np.zeros((RUNS, ROWS, 2), dtype=kind)
    move_column(ring, 1, 4, 7, 3, column)
    assert np.array_equal(column[1, 4:7], ring[1, :3, 3:5].astype(kind))
    column[1, 4:7] = 0
    assert not column.any()


def test_only_rows_beyond_the_end_of_a_run_are_cleared() -> None:
    column = np.ones((RUNS, ROWS, 2))
    clear(column, np.array([10, 4, 0]), 8)
    assert column.sum(axis=(1, 2)).tolist() == [20.0, 2.0 * (4 + 2), 2.0 * 2]
    assert column[1, :4].all()
    assert not column[1, 4:8].any()


def test_reading_marks_true_objects_in_the_place_of_its_sensor() -> None:
    # Two sensors and two objects: stamps, alive and detected in a row of the ring.
    at = np.zeros(21, dtype=np.int64)
    at[8:13] = 0, 2, 4, 8, 8
    out = np.zeros((2, 8))
    add_reading(
        np.array([True, False]),
        1,
        2,
        np.array([0.4, 0.5]),
        np.array([True, True]),
        np.array([[True, True], [True, True]]),
        np.array([[1, -1], [0, 1]]),
        at,
        out,
    )
    assert out[0].tolist() == [0.0, 0.4, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    # The other run has ended; a detection without an object leaves no mark.
    assert not out[1].any()


def test_detection_is_placed_from_the_pose_at_the_time_of_its_sample() -> None:
    ego = np.zeros((1, 3, 7))
    ego[0, 1, [EGO_X, EGO_Y, EGO_HEADING]] = 10.0, 5.0, np.pi / 2
    detections = np.zeros((1, 1, 7))
    detections[0, 0, :2] = 20.0, 1.0
    places = np.zeros((1, 2, 2))
    place_detections(
        np.array([True]),
        np.array([[True]]),
        detections,
        np.array([[1]]),
        np.array([0.05]),
        0.05,
        ego,
        places,
    )
    assert places[0, 1].tolist() == pytest.approx([9.0, 25.0])
    assert not places[0, 0].any()
