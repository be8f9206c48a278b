"""Rate and latency in whole ticks."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.delivery import (
    JITTER_DRAW,
    Delays,
    Delivery,
    insert,
    no_measurement,
    sample_at,
)
from adeye.kernel.random import owner_id, uniform
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.spec.sensors import Radar
from tests.simulate.sensors.scenes import CAR, scene, scene_context, sensor_context

if TYPE_CHECKING:
    from adeye.ports import SensorContext
    from adeye.signals import Floats, Measurement


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


def test_sample_is_empty_until_something_is_detected() -> None:
    made = sample_at(0.5, 1, 3)
    assert made.stamp.tolist() == [0.5]
    assert not made.mask.any()
    assert made.source.tolist() == [[-1, -1, -1]]
    assert not made.detections.any()


OWNER = owner_id("sensor/front")


def late(seeds: int, jitter: int, ticks: int, *, every: int = 1, latency: int = 1) -> Floats:
    """Return the stamps (T, B) of the newest samples of a jittery sensor, in ticks."""
    first = no_measurement(seeds, 0, with_estimate=False)
    numbers = np.arange(1, seeds + 1, dtype=np.uint64)
    delivery = Delivery(every, latency, first, Delays(numbers, OWNER, jitter))
    rows = []
    for tick in range(ticks):
        if delivery.is_due(tick):
            made = no_measurement(seeds, 0, with_estimate=False)
            made.stamp[:] = tick
            delivery.push(tick, made)
        rows.append(delivery.newest(tick).stamp.copy())
    return np.array(rows)


def arrivals(stamps: Floats, every: int) -> Floats:
    """Return the tick (N, B) at which each sample, or a later one, was there first."""
    made = np.arange(0, stamps.shape[0], every)
    return np.array([(stamps >= tick).argmax(axis=0) for tick in made])


def test_delays_are_uniform_from_nothing_to_the_jitter() -> None:
    delays = Delays(np.arange(1, 501, dtype=np.uint64), OWNER, 3)
    draws = np.concatenate([delays.draw() for _ in range(40)])
    counts = np.bincount(draws, minlength=4)
    assert counts.size == 4
    expected = draws.size / 4
    # Chi-squared with 3 degrees of freedom: above 16.3 once in a thousand.
    assert ((counts - expected) ** 2 / expected).sum() < 16.3


def test_delays_of_runs_and_samples_are_independent() -> None:
    delays = Delays(np.arange(1, 401, dtype=np.uint64), OWNER, 9)
    drawn = np.array([delays.draw() for _ in range(50)], dtype=np.float64) - 4.5
    variance = (drawn * drawn).mean()
    assert abs((drawn[1:] * drawn[:-1]).mean()) < 5.0 * variance / np.sqrt(drawn.size)
    assert abs((drawn[:, 1:] * drawn[:, :-1]).mean()) < 5.0 * variance / np.sqrt(drawn.size)


def test_rare_samples_come_within_latency_and_jitter() -> None:
    stamps = late(200, 3, 103, every=5, latency=2)
    waited = arrivals(stamps[:100], 5)[:-1] - np.arange(0, 95, 5)[:, None]
    assert sorted(set(waited.ravel().tolist())) == [2, 3, 4, 5]


def test_samples_never_overtake() -> None:
    stamps = late(100, 6, 80)
    assert (np.diff(stamps, axis=0) >= 0.0).all()
    # Some come together, because one held up the others.
    assert (np.diff(stamps, axis=0) > 1.0).any()


def test_held_up_sample_holds_up_those_behind_it() -> None:
    seeds = np.array([1], dtype=np.uint64)
    delays = Delays(seeds, OWNER, 6)
    draws = [int(delays.draw()[0]) for _ in range(40)]
    due = np.maximum.accumulate(np.arange(40) + 1 + np.array(draws))
    expected = [max(np.flatnonzero(due <= tick), default=-1) for tick in range(40)]
    assert late(1, 6, 40)[:, 0].tolist() == expected


def test_delay_of_a_run_does_not_depend_on_its_batch() -> None:
    assert np.array_equal(late(5, 4, 40)[:, :2], late(2, 4, 40))


def test_delays_are_drawn_far_from_the_draws_of_the_models() -> None:
    delays = Delays(np.array([7], dtype=np.uint64), OWNER, 9)
    for number in range(5):
        share = uniform(np.uint64(7), np.uint64(OWNER), number, JITTER_DRAW)
        assert int(delays.draw()[0]) == int(10.0 * share)
    assert JITTER_DRAW > 2**31


def test_measurement_that_was_handed_out_stays_as_it_was() -> None:
    delivery = Delivery(
        1,
        0,
        no_measurement(2, 1, with_estimate=False),
        Delays(np.array([1, 2], dtype=np.uint64), OWNER, 2),
    )
    shown, copies = [], []
    for tick in range(12):
        made = no_measurement(2, 1, with_estimate=False)
        made.stamp[:] = made.detections[:] = tick
        delivery.push(tick, made)
        newest = delivery.newest(tick)
        shown.append(newest)
        copies.append(newest.copy())
    for one, other in zip(shown, copies, strict=True):
        assert np.array_equal(one.stamp, other.stamp)
        assert np.array_equal(one.detections, other.detections)


def test_tick_that_nobody_looked_at_loses_no_sample() -> None:
    def stamp(looks: list[int]) -> float:
        first = no_measurement(1, 0, with_estimate=False)
        delivery = Delivery(1, 0, first, Delays(np.array([3], dtype=np.uint64), OWNER, 2))
        for tick in range(10):
            if tick < 5:
                made = no_measurement(1, 0, with_estimate=False)
                made.stamp[:] = tick
                delivery.push(tick, made)
            if tick in looks:
                newest = delivery.newest(tick)
        return float(newest.stamp[0])

    assert stamp([0, 9]) == stamp(list(range(10))) == 4.0


def test_samples_with_more_than_the_first_measurement_are_refused() -> None:
    delivery = Delivery(
        1,
        0,
        no_measurement(1, 1, with_estimate=False),
        Delays(np.array([1], dtype=np.uint64), OWNER, 1),
    )
    delivery.push(0, no_measurement(1, 1, with_estimate=True))
    with pytest.raises(ValueError, match="estimate is in only one"):
        delivery.newest(1)


def radar(jitter: int) -> list[Measurement]:
    """Return what a noisy radar delivers over 30 ticks."""
    spec = Radar.model_validate(
        {
            "kind": "radar",
            "rate": "20 Hz",
            "mount": {},
            "field_of_view": "90 deg",
            "range": "200 m",
            "range_noise": "1 m",
        }
    )
    context = scene_context([CAR], runs=3)
    made: SensorContext = replace(sensor_context(spec, context), jitter=jitter)
    sensor: Any = RangingSensor(made)
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
