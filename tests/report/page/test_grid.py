from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.judge.grid import grid_at
from adeye.report.page.drive import TIMES, grid_of, occupancy, packed, view_of
from adeye.trace import NO_TRACKS
from tests.judge.conftest import HandMade

if TYPE_CHECKING:
    from adeye.trace import Trace


def unpacked(texts: tuple[str, ...], columns: int, rows: int) -> list[Any]:
    """Read back what ``packed`` wrote, as the page does."""
    made: list[Any] = []
    for text in texts:
        codes = [
            ord(letter) - ord("a")
            for letter, count in re.findall(r"([a-p])(\d*)", text)
            for _ in range(int(count or 1))
        ]
        cells = np.bitwise_xor.accumulate(np.array(codes).reshape(rows, columns), axis=0)
        made.append(cells ^ made[-1] if text.startswith("+") else cells)
    return made


def driving(**more: Any) -> Trace:
    """Let a car that the safety channel sees come nearer, on the lane of the ego."""
    made = HandMade(rows=21, **more)
    made.columns["tracks"][0, :, 1, 0] = [14.0, 0.0, 10.0, 0.0, 4.0, 2.0]
    return made.trace()


HELD = np.minimum(np.arange(21), 19)


@pytest.mark.parametrize("shape", [(1, 1), (7, 3), (3, 7), (40, 20)])
def test_packed_maps_read_back(shape: tuple[int, int]) -> None:
    random = np.random.default_rng(5)
    maps = [random.integers(0, 16, shape) for _ in range(4)]
    maps.append(maps[-1])
    again = unpacked(packed(maps), *shape)
    assert all(np.array_equal(one.T, other) for one, other in zip(again, maps, strict=True))


def test_map_equal_to_the_one_before_costs_next_to_nothing() -> None:
    cells = np.random.default_rng(5).integers(0, 9, (150, 70))
    assert packed([cells, cells])[1] == "+a10500"


def test_drawn_maps_are_those_of_the_run() -> None:
    trace = driving()
    view = grid_of(trace, 0, HELD)
    # 0.25 s and 0.1 s, at steps of 0.1 s.
    assert (view.every, len(view.number)) == (3, 7)
    assert (view.occupied_every, len(view.occupied)) == (1, 21)
    number = unpacked(view.number, view.columns, view.rows)
    occupied = unpacked(view.occupied, view.columns, view.rows)
    for row in range(21):
        found = grid_at(trace, 0, row, view="safety")
        assert np.array_equal(occupied[row].T, occupancy(found))
        if row % 3 == 0:
            is_free = found["time_to_occupancy"] > 0.0
            levels = np.array(view.levels)[number[row // 3].T]
            assert np.array_equal(levels[is_free], found["number"][is_free])
    assert (view.x_m, view.y_m, view.cell_m) == (-25.0, -17.5, 0.5)


def test_fewer_maps_are_drawn_where_they_are_large(monkeypatch: pytest.MonkeyPatch) -> None:
    trace = driving()
    whole = grid_of(trace, 0, HELD)
    size = sum(len(text) for text in (*whole.number, *whole.occupied))
    monkeypatch.setattr("adeye.report.page.drive.MOST", size - 1)
    fewer = grid_of(trace, 0, HELD)
    assert fewer.occupied_every == 2
    assert fewer.number == whole.number
    assert len(fewer.occupied) == 11


def test_occupied_now_and_later_are_told_apart() -> None:
    found = grid_at(driving(), 0, 0, view="safety")
    code = occupancy(found)
    assert (code == 1).sum() == 32
    times = found["time_to_occupancy"]
    for index in range(1, len(TIMES)):
        within = (times > TIMES[index - 1]) & (times <= TIMES[index])
        assert np.array_equal(code == index + 1, within)
    assert np.array_equal(code == 0, np.isinf(times))


def test_static_object_is_occupied_now() -> None:
    made = HandMade().object("lead", s=14.0, speed=0.0).ego(s=0.0)
    trace = made.trace()
    context = replace(trace.layout.context, actor_count=0)
    trace = replace(trace, layout=replace(trace.layout, context=context))
    assert (occupancy(grid_at(trace, 0, 0)) == 1).sum() == 32


def test_view_is_the_safety_channel_that_shows_tracks_or_the_truth() -> None:
    made = HandMade()
    assert view_of(made.trace(), 0) == "safety"
    made.columns["false_tracks"][:, :, 1] = NO_TRACKS
    assert view_of(made.trace(), 0) == "truth"
    assert grid_of(made.trace(), 0, HELD).view == "truth"


def test_maps_of_a_run_are_small() -> None:
    trace = driving()
    view = grid_of(trace, 0, HELD)
    # On a straight road, a few bytes for each.
    assert sum(len(text) for text in (*view.number, *view.occupied)) < 100 * len(view.number)
