"""Cells of a radar: what falls together, what is folded, how many false alarms there are."""

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from adeye.signals import Floats, parameter_record
from adeye.simulate.sensors.radar import (
    ECHO_BEARING,
    ECHO_RANGE,
    ECHO_RATE,
    ECHO_SIGNAL,
    ECHO_WIDTH,
    count_events,
    detect,
    folded,
    most_events,
    same_cell,
)

STRONG = 1e9
"""Signal at which errors are at their floor and no echo is missed."""


def record(**changes: float) -> Any:
    fields = {
        "x": 0.0,
        "y": 0.0,
        "yaw": 0.0,
        "threshold": 13.8,
        "range_resolution": 0.5,
        "bearing_resolution": 0.03,
        "range_rate_resolution": 0.2,
        "max_range_rate": 80.0,
        **changes,
    }
    return parameter_record({name: np.full(1, value) for name, value in fields.items()})[0]


def echo(
    distance: float, bearing: float = 0.0, rate: float = 0.0, signal: float = STRONG
) -> Floats:
    row = np.zeros(ECHO_WIDTH)
    row[ECHO_SIGNAL], row[ECHO_RANGE], row[ECHO_BEARING] = signal, distance, bearing
    row[ECHO_RATE] = rate
    return row


@pytest.mark.parametrize(
    ("other", "together"),
    [
        ((50.49, 0.0, 0.0), True),
        ((50.51, 0.0, 0.0), False),
        ((50.0, 0.029, 0.0), True),
        ((50.0, -0.031, 0.0), False),
        ((50.0, 0.0, 0.19), True),
        ((50.0, 0.0, -0.21), False),
        ((50.49, 0.029, 0.21), False),
        ((math.nan, 0.0, 0.0), False),
    ],
)
def test_cell_is_left_by_any_of_range_bearing_and_rate(
    other: tuple[float, float, float], *, together: bool
) -> None:
    one = echo(50.0)
    assert same_cell(record(), one, echo(*other)) is together
    assert same_cell(record(), echo(*other), one) is together


def test_cell_reaches_across_the_direction_behind_the_sensor() -> None:
    assert same_cell(record(), echo(20.0, math.pi - 0.01), echo(20.0, -math.pi + 0.01))


def found(echoes: Sequence[Floats], number: int = 0) -> list[Floats]:
    """What is detected of these echoes, nearest first."""
    rows = np.array(echoes)
    order = np.zeros(len(rows), dtype=np.int64)
    count = detect(record(), np.uint64(1), np.uint64(2), number, rows, order)
    return [rows[thing] for thing in order[:count]]


@pytest.mark.slow
def test_two_equal_echoes_of_one_cell_are_detected_midway() -> None:
    places = [found([echo(50.0), echo(50.4, 0.02)], number) for number in range(200)]
    assert {len(rows) for rows in places} == {1}
    distances = np.array([rows[0][ECHO_RANGE] for rows in places])
    bearings = np.array([rows[0][ECHO_BEARING] for rows in places])
    assert distances.mean() == pytest.approx(50.2, abs=4.0 * 0.025 / math.sqrt(200.0))
    assert bearings.mean() == pytest.approx(0.01, abs=4.0 * 0.0015 / math.sqrt(200.0))


def test_strong_echo_swallows_the_weak_one_beside_it() -> None:
    rows = found([echo(50.3, signal=1e6), echo(50.0)])
    assert len(rows) == 1
    assert rows[0][ECHO_RANGE] == pytest.approx(50.0, abs=0.15)


def test_two_echoes_apart_are_two_detections_in_order_of_distance() -> None:
    rows = found([echo(60.0), echo(50.0)])
    assert [round(row[ECHO_RANGE]) for row in rows] == [50, 60]


@pytest.mark.slow
def test_chain_is_cut_around_the_strongest_whatever_the_order() -> None:
    chain = [(50.0, 2e9), (50.4, 4e9), (50.8, 2e9), (51.2, 1e9)]
    for order in itertools.permutations(chain):
        rows = found([echo(distance, signal=signal) for distance, signal in order])
        assert [row[ECHO_RANGE] for row in rows] == pytest.approx([50.4, 51.2], abs=0.12)


@pytest.mark.parametrize(
    ("rate", "shown"), [(0.0, 0.0), (79.9, 79.9), (80.0, -80.0), (90.0, -70.0), (-81.0, 79.0)]
)
def test_range_rate_beyond_the_span_comes_in_at_the_other_end(rate: float, shown: float) -> None:
    assert folded(rate, 80.0) == pytest.approx(shown)


def test_number_of_events_is_poisson_distributed() -> None:
    mean, draws = 1.7, 40_000
    chances = (np.arange(draws) + 0.5) / draws
    counts = np.array([count_events(mean, math.exp(-mean), 20.0, chance) for chance in chances])
    for number in range(6):
        expected = math.exp(-mean) * mean**number / math.factorial(number)
        assert (counts == number).mean() == pytest.approx(expected, abs=2.0 / draws)


def test_number_of_events_is_bounded() -> None:
    assert count_events(3.0, math.exp(-3.0), 5.0, 1.0 - 1e-16) == 5
    assert most_events(0.0) == 0


@pytest.mark.parametrize("mean", [0.01, 0.24, 1.0, 10.0, 50.0])
def test_bound_is_exceeded_less_than_once_in_ten_million_times(mean: float) -> None:
    inside = sum(
        math.exp(number * math.log(mean) - mean - math.lgamma(number + 1))
        for number in range(most_events(mean) + 1)
    )
    assert 1.0 - inside < 1e-7
