"""Rate and latency in whole ticks."""

from dataclasses import replace
from typing import Any

import numpy as np

from adeye import delivery as subject
from adeye.kernel.random import owner_id
from adeye.signals import Floats, Measurement
from adeye.simulate.sensors.ranging import RangingSensor
from tests.refusals import refused
from tests.simulate.sensors.scenes import (
    CAR,
    scene,
    scene_context,
    sensor_context,
    sensor_spec,
)


def test_sample_is_there_after_the_latency_until_the_next_one() -> None:
    for every, latency, newest, fresh in (
        (1, 0, [0, 1, 2], "111"),
        (1, 2, [-1, -1, 0, 1], "0011"),
        (3, 1, [-1, 0, 0, 0, 3, 3], "010010"),
        # A latency longer than the period keeps the order.
        (2, 5, [-1, -1, -1, -1, -1, 0, 0, 2, 2, 4], "0000010101"),
    ):
        delivery = subject.Delivery(every, latency, made(-1.0))
        for tick, expected in enumerate(newest):
            if delivery.is_due(tick):
                delivery.push(tick, made(tick))
            found = delivery.newest(tick)
            assert (found.stamp[0], f"{found.fresh[0]:d}") == (expected, fresh[tick]), tick


def test_objects_are_listed_by_distance_and_equal_ones_in_their_order() -> None:
    places = np.array([[3.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, 0.5]])
    order = np.zeros(4, dtype=np.int64)
    for thing, (x, y) in enumerate(places):
        subject.insert(order, places, thing, thing, x * x + y * y)
    assert order.tolist() == [3, 1, 2, 0]


OWNER = owner_id("sensor/front")


def made(tick: float, runs: int = 1) -> Measurement:
    """Return a sample of every run that tells the tick at which it was taken."""
    sample = subject.no_measurement(runs, 1, with_estimate=False)
    sample.stamp[:] = sample.detections[:] = tick
    return sample


def delays(runs: int, jitter: int) -> subject.Delays:
    return subject.Delays(np.arange(1, runs + 1, dtype=np.uint64), OWNER, jitter)


def late(runs: int, jitter: int, ticks: int, *, every: int = 1, latency: int = 1) -> Floats:
    """Return the stamps (T, B) of the newest samples of a jittery sensor, in ticks."""
    delivery = subject.Delivery(every, latency, made(-1.0, runs), delays(runs, jitter))
    rows = []
    for tick in range(ticks):
        if delivery.is_due(tick):
            delivery.push(tick, made(tick, runs))
        rows.append(delivery.newest(tick).stamp.copy())
    return np.array(rows)


def test_delays_are_uniform_from_nothing_to_the_jitter_and_independent() -> None:
    drawing = delays(500, 3)
    counts = np.bincount(np.concatenate([drawing.draw() for _ in range(40)]), minlength=4)
    assert counts.size == 4
    # Chi-squared with 3 degrees of freedom: above 16.3 once in a thousand.
    assert ((counts - 5000.0) ** 2 / 5000.0).sum() < 16.3
    drawing = delays(400, 9)
    drawn = np.array([drawing.draw() for _ in range(50)], dtype=np.float64) - 4.5
    least = 5.0 * (drawn * drawn).mean() / np.sqrt(drawn.size)
    assert abs((drawn[1:] * drawn[:-1]).mean()) < least
    assert abs((drawn[:, 1:] * drawn[:, :-1]).mean()) < least


def test_held_up_sample_holds_up_those_behind_it() -> None:
    drawing = delays(1, 6)
    draws = [int(drawing.draw()[0]) for _ in range(40)]
    due = np.maximum.accumulate(np.arange(40) + 1 + np.array(draws))
    expected = [int(np.flatnonzero(due <= tick).max(initial=-1)) for tick in range(40)]
    assert late(1, 6, 40)[:, 0].tolist() == expected
    # Some come together, because one held up the others.
    assert max(np.diff(expected)) > 1


def test_measurement_that_was_handed_out_stays_as_it_was() -> None:
    delivery = subject.Delivery(1, 0, made(-1.0, 2), delays(2, 2))
    shown, copies = [], []
    for tick in range(12):
        delivery.push(tick, made(tick, 2))
        newest = delivery.newest(tick)
        shown.append(newest)
        copies.append(newest.copy())
    for one, other in zip(shown, copies, strict=True):
        assert np.array_equal(one.stamp, other.stamp)
        assert np.array_equal(one.detections, other.detections)


def test_tick_that_nobody_looked_at_loses_no_sample() -> None:
    for looks in ([0, 9], range(10)):
        delivery = subject.Delivery(1, 0, made(-1.0), delays(1, 2))
        for tick in range(10):
            if tick < 5:
                delivery.push(tick, made(tick))
            if tick in looks:
                newest = delivery.newest(tick)
        assert float(newest.stamp[0]) == 4.0, looks


def test_samples_with_more_than_the_first_measurement_are_refused() -> None:
    delivery = subject.Delivery(1, 0, made(-1.0), delays(1, 1))
    delivery.push(0, subject.no_measurement(1, 1, with_estimate=True))
    refused(ValueError, delivery.newest, 1, says="estimate is in only one")


def radar(jitter: int) -> list[Measurement]:
    """Return what a noisy radar delivers over 30 ticks."""
    spec = sensor_spec("radar", field_of_view="90 deg", range="200 m", range_noise="1 m")
    context = scene_context([CAR], runs=3)
    sensor: Any = RangingSensor(replace(sensor_context(spec, context), jitter=jitter))
    return [sensor.sense(scene(context, [(50.0, 0.0)], tick=tick)).copy() for tick in range(30)]


def test_jitter_changes_when_a_sample_comes_and_not_what_is_in_it() -> None:
    exact, jittery = radar(0), radar(3)
    places = {
        (run, float(item.stamp[run])): item.detections[run] for item in exact for run in range(3)
    }
    stamps = np.array([item.stamp for item in jittery])
    assert (stamps < np.array([item.stamp for item in exact])).any()
    for item in jittery:
        for run in range(3):
            if item.stamp[run] >= 0.0:
                assert np.array_equal(item.detections[run], places[run, float(item.stamp[run])])
