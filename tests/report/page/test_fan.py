"""The fan of a channel, from a trace to what is drawn."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from adeye.report.page.drive import desirability, fan_of
from adeye.trace import Trace

ROWS, CANDIDATES, POINTS = 25, 4, 3


def trace(costs: list[float], chosen: int, places: Any = None) -> Trace:
    """Make what is read of a trace of one run with two channels, of which the first has a fan."""
    shape = (1, ROWS, 2, CANDIDATES)
    fan = np.full((*shape, POINTS, 2), np.nan)
    fan[:, :, 0] = np.arange(POINTS * 2.0).reshape(POINTS, 2) * 10.04 if places is None else places
    each = np.full(shape, np.nan)
    each[:, :, 0] = costs
    columns = {
        "candidates": fan.astype(np.float32),
        "candidate_costs": each.astype(np.float32),
        "chosen": np.full((1, ROWS, 2), chosen, dtype=np.int16),
    }
    context = SimpleNamespace(step=0.05)

    class Made(SimpleNamespace):
        def __getitem__(self, name: str) -> Any:
            return columns[name]

    return cast("Trace", Made(layout=SimpleNamespace(context=context)))


def drawn(costs: list[float], chosen: int = 0, **more: Any) -> Any:
    held = np.minimum(np.arange(ROWS), ROWS - 2)
    return fan_of(trace(costs, chosen, **more), 0, 0, held)


def test_fan_is_drawn_twice_a_second() -> None:
    view = drawn([1.0, 2.0, 3.0, 4.0])
    assert view.every == 10
    assert len(view.fans) == 3


def test_best_is_drawn_last_and_shaded_most_but_for_the_chosen_one() -> None:
    fan = drawn([5.0, 1.0, 90.0, math.inf], chosen=1).fans[0]
    shades = [candidate.desirability for candidate in fan]
    assert shades == sorted(shades)
    assert (shades[0], shades[-1]) == (0.0, 1.0)
    assert [candidate.is_chosen for candidate in fan] == [False, False, False, True]
    fan = drawn([5.0, 1.0, 90.0, 95.0], chosen=0).fans[0]
    assert fan[-1].is_chosen
    assert fan[-1].desirability < 1.0


def test_candidate_and_fan_that_do_not_exist_are_not_drawn() -> None:
    assert len(drawn([1.0, 2.0, math.nan, 3.0]).fans[0]) == 3
    assert fan_of(trace([1.0] * CANDIDATES, 0), 0, 1, np.arange(ROWS)) is None


def test_place_of_the_ego_is_left_out_and_the_others_are_in_decimetres() -> None:
    (first, *_) = drawn([1.0, 2.0, 3.0, 4.0]).fans[0]
    assert first.points == ((20.1, 30.1), (40.2, 50.2))


def test_dearer_is_less_desirable() -> None:
    for cost in (1.0, 3.0, 50.0, 999.0):
        assert 1.0 > desirability(cost + 1.0, 1.0) > desirability(cost + 2.0, 1.0) >= 0.0
