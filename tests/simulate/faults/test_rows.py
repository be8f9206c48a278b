"""Rows of things of one tick in those of another, and the queue that hands them on late."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.signals import NO_CHANNEL, SILENT, Authority, ControlCommand, Floats, Measurement
from adeye.simulate.channels.links import no_command
from adeye.simulate.faults import injector
from adeye.simulate.faults import sensor_faults as subject
from adeye.simulate.faults.injector import InjectorContext
from adeye.spec.fault import FAULT
from adeye.spec.sensor_faults import SIGNALS, has_signal
from tests.motorway import fault
from tests.simulate.faults import flows
from tests.simulate.faults.streams import (
    CONTEXT,
    ONSET,
    RUNS,
    SENSORS,
    SUITE,
    check_form,
    same,
    streams,
)

FIRST = np.array([True, False])


def command(number: float) -> ControlCommand:
    made = flows.command(number, channel="a")
    made.plan = np.ones((2, 3, 4))
    return made


def test_copy_does_not_follow() -> None:
    state = Authority(np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.int64))
    other = injector.copied(state)
    state.channel[:] = 1
    assert other.channel.tolist() == [0, 0]


def test_only_the_rows_asked_for_are_taken() -> None:
    target = command(1.0)
    injector.take_rows(target, command(2.0), FIRST)
    assert target.acceleration.tolist() == [2.0, 1.0]


def test_plan_that_the_source_lacks_is_empty() -> None:
    target = command(1.0)
    injector.take_rows(target, no_command("a", 2), FIRST)
    assert target.plan is not None
    assert np.isnan(target.plan[0]).all()
    assert (target.plan[1] == 1.0).all()


def test_nothing_yet_is_silent_without_stamp_and_without_authority() -> None:
    nothing = injector.nothing_yet(command(1.0))
    assert nothing.status.tolist() == [SILENT, SILENT]
    assert nothing.stamp.tolist() == [-1.0, -1.0]
    assert nothing.acceleration.tolist() == [0.0, 0.0]
    state = injector.nothing_yet(Authority(np.ones(2, dtype=np.int64), np.ones(2, dtype=np.int64)))
    assert state.channel.tolist() == [NO_CHANNEL] * 2


def test_past_shows_each_run_its_own_age() -> None:
    past: injector.Past[Floats] = injector.Past(2)
    for tick in range(4):
        past.add(np.full(3, float(tick)))
    target = np.full(3, 9.0)
    past.write(target, np.array([0, 2, 1]), np.array([True, True, False]))
    assert target.tolist() == [3.0, 1.0, 9.0]


def test_queue_lets_what_was_last_stand_and_then_hands_on_in_order() -> None:
    queue: injector.Queue[Floats] = injector.Queue(np.array([3]))
    out = []
    for tick in range(12):
        active = np.array([4 <= tick < 10])
        out.append(float(queue.apply(np.array([float(tick)]), active)[0][0]))
    assert out == [0, 1, 2, 3, 3, 3, 3, 4, 5, 6, 10, 11]


def listed(xs: list[float]) -> Measurement:
    made = flows.sample(0.0, runs=1, things=len(xs))
    made.detections[0, :, 0] = xs
    made.source[0] = np.arange(len(xs))
    return made


ALL = np.ones(1, dtype=np.bool_)
places = st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=1, max_size=6)


@given(places, st.data())
def test_list_is_packed_sorted_and_keeps_what_is_there(
    xs: list[float], data: st.DataObject
) -> None:
    item = listed(xs)
    mask = np.array([data.draw(st.lists(st.booleans(), min_size=len(xs), max_size=len(xs)))])
    made = subject.with_rows(item, mask, item.detections.copy(), item.source.copy(), ALL)
    check_form(made)
    assert set(made.source[made.mask].tolist()) == set(np.flatnonzero(mask[0]).tolist())
    for row, source in zip(made.detections[0], made.source[0], strict=True):
        if source >= 0:
            assert row[0] == xs[source] or np.isnan(row[0])


def test_no_number_comes_last_and_is_still_there() -> None:
    item = listed([np.nan, 3.0, np.inf, 1.0])
    made = subject.with_rows(item, item.mask, item.detections.copy(), item.source.copy(), ALL)
    assert made.source[0].tolist() == [3, 1, 2, 0]
    assert made.mask.all()


def test_runs_that_are_not_named_keep_their_order() -> None:
    item = listed([3.0, 1.0])
    made = subject.with_rows(item, item.mask, item.detections.copy(), item.source.copy(), ~ALL)
    assert made.source[0].tolist() == [0, 1]


def test_nothing_lost_is_the_very_same_list() -> None:
    item = listed([1.0, 2.0])
    assert subject.without(item, np.zeros((1, 2), dtype=np.bool_)) is item


def test_wider_list_has_empty_rows_at_its_end() -> None:
    mask, rows, source = subject.widened(listed([1.0]), 2)
    assert mask[0].tolist() == [True, False, False]
    assert rows.shape == (1, 3, 7)
    assert source[0].tolist() == [0, -1, -1]


def within(bearing: float, right: float, left: float) -> bool:
    one = np.array([[bearing]])
    return bool(subject.is_within(one, np.array([[right]]), np.array([[left]]))[0, 0])


def test_sector_goes_from_right_to_left_through_the_rear_if_need_be() -> None:
    for sector in ((0.0, -0.1, 0.1), (3.1, 3.0, -3.0), (-3.1, 3.0, -3.0)):
        assert within(*sector)
    for sector in (
        (0.2, -0.1, 0.1),
        (0.1, -0.1, 0.1),
        (0.0, 3.0, -3.0),
        (1.0, 1.0, 1.0),
        (np.nan, -1.0, 1.0),
    ):
        assert not within(*sector)


@given(st.floats(-np.pi, np.pi))
def test_whole_turn_has_every_bearing(bearing: float) -> None:
    assert within(bearing, -np.pi, np.pi) or bearing == np.pi


def seat(sensor: str) -> subject.Seat:
    lost = FAULT.validate_python(fault("lost", f"sensors.{sensor}", "drop_out"))
    one = np.uint64(1)
    return subject.Seat(InjectorContext([lost] * RUNS, CONTEXT, 0.05, one, [SUITE] * RUNS))


PAIRS = [
    (sensor, signal)
    for sensor in SENSORS
    for signal in SIGNALS
    if has_signal(signal, SUITE.sensors[sensor])
]


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "signal"), PAIRS)
def test_what_is_written_is_read_again(sensor: str, signal: str) -> None:
    item = streams()[sensor][ONSET]
    place = subject.place_of(item, signal, seat(sensor), len(CONTEXT.object_ids))
    # So little that no detection changes its place in the list.
    new = place.values + 1e-4
    changed = place.there & np.array([[True], [False], [True]])
    written = place.write(item, new, changed, CONTEXT.road)
    again = subject.place_of(written, signal, seat(sensor), len(CONTEXT.object_ids))
    assert changed.any()
    assert again.values[changed] == pytest.approx(new[changed], abs=1e-9)
    assert same(written, item, 1)
    assert np.array_equal(again.there, place.there)


def test_lost_return_has_no_range_and_no_object() -> None:
    item = streams()["beam_lidar"][ONSET]
    assert item.points is not None
    lost = np.zeros(item.points.shape[:2], dtype=np.bool_)
    assert subject.without_points(item, lost) is item
    lost[0] = True
    made = subject.without_points(item, lost)
    assert made.points is not None
    assert made.hits is not None
    assert not made.points[0, :, 0].any()
    assert (made.hits[0] == -1).all()
    assert same(made, item, 1)
