"""Rate and latency in whole ticks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.sensors.delivery import Delivery, no_measurement

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
