"""Rate and latency in whole ticks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.sensors.delivery import Delivery, clear, insert, no_measurement, sample_at

if TYPE_CHECKING:
    from adeye.signals import Measurement


def sample(time: float) -> Measurement:
    made = no_measurement(1, 1, with_estimate=False)
    made.stamp[:] = time
    return made


def stamps(every: int, latency: int, ticks: int) -> list[tuple[float, bool]]:
    delivery = Delivery(every, latency, no_measurement(1, 1, with_estimate=False))
    seen = []
    for tick in range(ticks):
        if delivery.is_due(tick):
            delivery.push(tick, sample(float(tick)))
        newest = delivery.newest(tick)
        seen.append((float(newest.stamp[0]), bool(newest.fresh[0])))
    return seen


def test_without_latency_a_sample_is_there_at_once() -> None:
    assert stamps(1, 0, 3) == [(0.0, True), (1.0, True), (2.0, True)]


def test_latency_delays_the_first_sample() -> None:
    assert stamps(1, 2, 4) == [(-1.0, False), (-1.0, False), (0.0, True), (1.0, True)]


def test_slow_sensor_holds_its_sample_between_ticks() -> None:
    assert stamps(3, 1, 6) == [
        (-1.0, False),
        (0.0, True),
        (0.0, False),
        (0.0, False),
        (3.0, True),
        (3.0, False),
    ]


def test_latency_longer_than_the_period_keeps_the_order() -> None:
    assert [stamp for stamp, _ in stamps(2, 5, 10)] == [-1, -1, -1, -1, -1, 0, 0, 2, 2, 4]


def test_objects_are_listed_by_distance_and_equal_ones_in_their_order() -> None:
    places = np.array([[3.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, 0.5]])
    order = np.zeros(4, dtype=np.int64)
    for thing, (x, y) in enumerate(places):
        insert(order, places, thing, thing, x * x + y * y)
    assert order.tolist() == [3, 1, 2, 0]


def test_cleared_rows_are_those_from_the_first_on() -> None:
    made = sample_at(0.5, 1, 3)
    made.mask[:], made.detections[:], made.source[:] = True, 7.0, 2
    clear(made.mask[0], made.detections[0], made.source[0], 1)
    assert made.stamp.tolist() == [0.5]
    assert made.mask.tolist() == [[True, False, False]]
    assert made.source.tolist() == [[2, -1, -1]]
    assert made.detections[0].sum(axis=1).tolist() == [49.0, 0.0, 0.0]
