"""Tracks against the truth at the time of the observation, on hand-made scenes."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel.encounter import reachable_distance
from adeye.simulate.recorder import GATE, GATE_GROWTH, compare_tracks, show_nothing
from adeye.trace import NO_TRACKS

STEP = 0.1
CAR = (4.0, 2.0, 1.5)
EGO = (0.0, 0.0, 0.0, 20.0)


def compare(  # noqa: PLR0913 - what a test may say about its scene
    tracks: list[tuple[float, ...]],
    objects: list[tuple[float, ...]],
    *,
    ego: tuple[float, ...] = EGO,
    stamp: float = 0.3,
    rows: int = 8,
    first: int = 0,
    running: bool = True,
    friction: float = 1.0,
) -> tuple[Any, int]:
    """Errors of each object (M, 2) and number of false tracks; objects and ego stand still.

    Rows before ``first`` are in the columns, the others in the ring; rows of no use are NaN.
    """
    count = len(objects)
    shown = np.full((1, 8, 6), np.nan)
    for place, track in enumerate(tracks):
        shown[0, place] = (*track, 0.0, 0.0, 4.0, 2.0)[:6] if len(track) == 2 else track
    row = round(stamp / STEP)
    states, places = np.full((rows, 1, 7), np.nan), np.full((rows, 1, 6), np.nan)
    others = np.full((rows, 1, count, 5), np.nan)
    if row >= 0:
        states[row], places[row], others[row] = 0.0, 0.0, 0.0
        states[row, 0, :4] = ego
        places[row, 0, :2] = ego[:2]
        for thing, state in enumerate(objects):
            others[row, 0, thing, : len(state)] = state
    error, false = np.zeros((1, count, 2)), np.full(1, 99, dtype=np.int8)
    segments = np.zeros((1, 1, 5))
    segments[0, 0, 3] = 1000.0

    def columns(ring: Any) -> Any:
        return np.ascontiguousarray(np.swapaxes(ring, 0, 1))

    def recent(ring: Any) -> Any:
        return np.ascontiguousarray(ring[first:])

    compare_tracks(
        np.array([running]), shown, np.array([stamp]), STEP, rows - 1, first,
        (recent(states), recent(places), recent(others)),
        columns(states), columns(places), columns(others), np.tile(CAR, (1, count, 1)),
        np.array([CAR]), np.array([friction]), segments, error, false,
    )  # fmt: skip
    return error[0], int(false[0])


@pytest.mark.parametrize("first", [0, 3, 4, 8])
def test_error_is_told_along_and_across_the_line_of_sight(first: int) -> None:
    error, false = compare([(41.0, 0.5)], [(40.0, 0.0)], first=first)
    assert error[0].tolist() == pytest.approx([1.0, 0.5])
    assert false == 0


def test_tracks_are_in_the_vehicle_frame_of_the_observation() -> None:
    ego = (100.0, 50.0, math.pi / 2.0, 20.0)
    error, _ = compare([(30.0, 2.0)], [(100.0, 79.0)], ego=ego)
    assert error[0].tolist() == pytest.approx([1.0, 2.0])


def test_object_without_a_track_has_no_error() -> None:
    error, false = compare([(40.0, 0.0)], [(40.0, 0.0), (40.0, 3.5)])
    assert np.isfinite(error).tolist() == [[True, True], [False, False]]
    assert false == 0


def test_track_belongs_to_the_nearest_body() -> None:
    error, _ = compare([(40.0, 2.0)], [(40.0, 0.0), (40.0, 3.5)])
    assert np.isnan(error[0, 0])
    assert error[1, 1] == pytest.approx(-1.5, abs=0.2)


def test_nearest_of_two_tracks_counts_and_the_other_is_not_false() -> None:
    error, false = compare([(42.0, 0.0), (40.5, 0.0)], [(40.0, 0.0)])
    assert error[0, 0] == pytest.approx(0.5)
    assert false == 0


def test_gate_ends_beside_the_body() -> None:
    distance = 40.0
    outside = distance + 2.0 + GATE
    # The gate grows with the distance of the track itself.
    outside = (outside) / (1.0 - GATE_GROWTH)
    for track, is_its in ((outside - 0.01, True), (outside + 0.01, False)):
        error, _ = compare([(track, 0.0)], [(distance, 0.0)])
        assert bool(np.isfinite(error[0, 0])) is is_its


def test_track_of_nothing_in_the_corridor_is_false() -> None:
    assert compare([(30.0, 0.0)], [(30.0, 9.0)])[1] == 1


@pytest.mark.parametrize("track", [(30.0, 2.1), (30.0, -2.1), (-10.0, 0.0)])
def test_track_of_nothing_beside_or_behind_does_not_count(track: tuple[float, float]) -> None:
    assert compare([track], [(90.0, 9.0)])[1] == 0


def test_track_of_nothing_beyond_the_reach_does_not_count() -> None:
    reach = reachable_distance(20.0, 1.0) + 4.0
    assert compare([(reach + 0.1, 0.0)], [(500.0, 9.0)])[1] == 0
    assert compare([(reach - 0.1, 0.0)], [(500.0, 9.0)])[1] == 1
    assert compare([(reach + 0.1, 0.0)], [(500.0, 9.0)], friction=0.3)[1] == 1


def test_before_the_first_observation_nothing_is_believed() -> None:
    error, false = compare([(40.0, 0.0)], [(40.0, 0.0)], stamp=-1.0)
    assert np.isnan(error).all()
    assert false == 0


def test_ended_run_believes_nothing() -> None:
    error, false = compare([(30.0, 0.0)], [(40.0, 9.0)], running=False)
    assert np.isnan(error).all()
    assert false == 0


def test_channel_without_tracks_is_told_apart_from_one_that_sees_nothing() -> None:
    error, false = np.zeros((2, 3, 2)), np.zeros(2, dtype=np.int8)
    show_nothing(error, false)
    assert np.isnan(error).all()
    assert false.tolist() == [NO_TRACKS] * 2
    assert compare([], [(40.0, 0.0)])[1] == 0
