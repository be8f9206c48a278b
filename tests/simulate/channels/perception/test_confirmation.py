"""m of n: which detections confirm a track."""

import numpy as np
import pytest

from adeye.signals import Floats
from adeye.simulate.channels.perception.tracks import (
    TRACK_BEGUN_BY,
    TRACK_HITS,
    TRACK_STATE,
    TRACKS,
    count_hit,
    count_misses,
)


def hits_after(pattern: str, *, hits: int = 3, window: int = 5, sensor: float = 0.0) -> float:
    """Hits of a track after samples that show it (x) or not (.), all of one sensor."""
    tracks = np.zeros((TRACKS, TRACK_STATE))
    confirm = (float(hits), float(window), sensor)
    for sample in pattern:
        _sample(tracks, confirm, is_hit=sample == "x")
    return float(tracks[0, TRACK_HITS])


def _sample(tracks: Floats, confirm: tuple[float, float, float], *, is_hit: bool) -> None:
    if is_hit:
        count_hit(tracks[0], confirm)
    count_misses(tracks, 1, confirm)


@pytest.mark.parametrize(
    ("pattern", "confirmed"),
    [
        ("xxx", True),
        ("x.x.x", True),
        ("x..x.x", False),
        ("x...xxx", True),
        ("xx...x", False),
        ("x.x..x.x", False),
        ("xxx........", True),
    ],
)
def test_three_of_five_confirm(pattern: str, *, confirmed: bool) -> None:
    assert (hits_after(pattern) >= 3.0) is confirmed


def test_without_a_window_every_detection_counts() -> None:
    assert hits_after("x....................xx", window=0) == 3.0


def test_track_is_free_when_its_last_hit_is_forgotten() -> None:
    assert hits_after("x....") == 1.0
    assert hits_after("x.....") == 0.0


def test_hits_of_a_confirmed_track_go_on_counting() -> None:
    assert hits_after("xxx..x") == 4.0


def test_another_sensor_can_hit_a_track_but_not_miss_it() -> None:
    tracks = np.zeros((TRACKS, TRACK_STATE))
    tracks[0, TRACK_BEGUN_BY] = 1.0
    first, other = (3.0, 3.0, 1.0), (3.0, 3.0, 0.0)
    _sample(tracks, first, is_hit=True)
    for _ in range(10):
        _sample(tracks, other, is_hit=False)
    assert tracks[0, TRACK_HITS] == 1.0
    _sample(tracks, other, is_hit=True)
    _sample(tracks, first, is_hit=True)
    assert tracks[0, TRACK_HITS] == 3.0
