"""Rows of things of one tick in those of another, the queue that is late, and places."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye import signals as s
from adeye.simulate.channels.links import no_command
from adeye.simulate.faults import injector
from adeye.simulate.faults import rows as subject
from adeye.simulate.faults.injector import InjectorContext
from adeye.simulate.faults.rows import FARTHEST, bearing_of, relocate, shift_points, turned
from adeye.spec.fault import FAULT
from adeye.spec.sensor_faults import SIGNALS, has_signal
from tests.motorway import fault
from tests.simulate.faults import flows
from tests.simulate.faults import streams as sensed

FIRST = np.array([True, False])


def command(number: float) -> s.ControlCommand:
    made = flows.command(number, channel="a")
    made.plan = np.ones((2, 3, 4))
    return made


def test_copy_does_not_follow() -> None:
    state = s.Authority(np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.int64))
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
    assert nothing.status.tolist() == [s.SILENT, s.SILENT]
    assert nothing.stamp.tolist() == [-1.0, -1.0]
    assert nothing.acceleration.tolist() == [0.0, 0.0]
    state = injector.nothing_yet(
        s.Authority(np.ones(2, dtype=np.int64), np.ones(2, dtype=np.int64))
    )
    assert state.channel.tolist() == [s.NO_CHANNEL] * 2


def test_past_shows_each_run_its_own_age() -> None:
    past: injector.Past[s.Floats] = injector.Past(2)
    for tick in range(4):
        past.add(np.full(3, float(tick)))
    target = np.full(3, 9.0)
    past.write(target, np.array([0, 2, 1]), np.array([True, True, False]))
    assert target.tolist() == [3.0, 1.0, 9.0]


def test_queue_lets_what_was_last_stand_and_then_hands_on_in_order() -> None:
    queue: injector.Queue[s.Floats] = injector.Queue(np.array([3]))
    out = []
    for tick in range(12):
        active = np.array([4 <= tick < 10])
        out.append(float(queue.apply(np.array([float(tick)]), active)[0][0]))
    assert out == [0, 1, 2, 3, 3, 3, 3, 4, 5, 6, 10, 11]


def listed(xs: list[float]) -> s.Measurement:
    made = flows.sample(0.0, runs=1, things=len(xs))
    made.detections[0, :, 0] = xs
    made.source[0] = np.arange(len(xs))
    return made


ALL = np.ones(1, dtype=np.bool_)
places = st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=1, max_size=6)


@given(places, st.data())
def test_list_is_packed_sorted_and_keeps_what_is(xs: list[float], data: st.DataObject) -> None:
    item = listed(xs)
    mask = np.array([data.draw(st.lists(st.booleans(), min_size=len(xs), max_size=len(xs)))])
    made = subject.with_rows(item, mask, item.detections.copy(), item.source.copy(), ALL)
    sensed.check_form(made)
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
    return subject.Seat(
        InjectorContext(
            [lost] * sensed.RUNS, sensed.CONTEXT, 0.05, one, [sensed.SUITE] * sensed.RUNS
        )
    )


PAIRS = [
    (sensor, signal)
    for sensor in sensed.SENSORS
    for signal in SIGNALS
    if has_signal(signal, sensed.SUITE.sensors[sensor])
]


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "signal"), PAIRS)
def test_what_is_written_is_read_again(sensor: str, signal: str) -> None:
    item = sensed.streams()[sensor][sensed.ONSET]
    place = subject.place_of(item, signal, seat(sensor), len(sensed.CONTEXT.object_ids))
    # So little that no detection changes its place in the list.
    new = place.values + 1e-4
    changed = place.there & np.array([[True], [False], [True]])
    written = place.write(item, new, changed, sensed.CONTEXT.road)
    again = subject.place_of(written, signal, seat(sensor), len(sensed.CONTEXT.object_ids))
    assert changed.any()
    assert again.values[changed] == pytest.approx(new[changed], abs=1e-9)
    assert sensed.same(written, item, 1)
    assert np.array_equal(again.there, place.there)


def test_lost_return_has_no_range_and_no_object() -> None:
    item = sensed.streams()["beam_lidar"][sensed.ONSET]
    assert item.points is not None
    lost = np.zeros(item.points.shape[:2], dtype=np.bool_)
    assert subject.without_points(item, lost) is item
    lost[0] = True
    made = subject.without_points(item, lost)
    assert made.points is not None
    assert made.hits is not None
    assert not made.points[0, :, 0].any()
    assert (made.hits[0] == -1).all()
    assert sensed.same(made, item, 1)


# --- Where faults move things: bearings, turned frames, places on the road, rigid returns ---------


def test_bearing_is_counter_clockwise_and_that_of_no_number_is_none() -> None:
    x, y = np.array([[1.0, 0.0, -1.0, np.inf, np.nan]]), np.array([[0.0, 2.0, 0.0, 1.0, 1.0]])
    found = bearing_of(x, y)[0]
    assert found[:3] == pytest.approx([0.0, math.pi / 2, math.pi])
    assert np.isnan(found[3:]).all()


def test_turned_there_and_back_is_where_it_was() -> None:
    x, y = np.array([[3.0, -1.0]]), np.array([[4.0, 2.0]])
    there = turned(x, y, np.array([[0.7]]))
    assert np.hypot(*there) == pytest.approx(np.hypot(x, y))
    back = turned(*there, np.array([[-0.7]]))
    assert back[0] == pytest.approx(x)
    assert back[1] == pytest.approx(y)


def test_what_is_nowhere_has_no_place_on_the_road() -> None:
    for far in (np.nan, np.inf, -np.inf, 2.0 * FARTHEST, 1e300):
        estimate = np.zeros((sensed.RUNS, 13))
        estimate[:, s.EGO_X], estimate[:, s.EGO_Y] = 50.0, 1.75
        estimate[0, s.EGO_X] = far
        relocate(sensed.CONTEXT.road, np.array([True, True, False]), estimate)
        place = estimate[:, s.ESTIMATE_PLACE :]
        assert np.isnan(place[0, [s.PLACE_S, s.PLACE_D]]).all(), far
        assert place[0, s.PLACE_LANE] == -1.0
        assert place[1, [s.PLACE_S, s.PLACE_D, s.PLACE_LANE]].tolist() == [50.0, 1.75, 0.0]
        assert not place[2].any()


def test_returns_move_as_a_rigid_body_does() -> None:
    points = np.array([[[10.0, 0.1, 0.05], [20.0, -0.2, -0.05], [0.0, 0.3, 0.0]]])
    moved = points.copy()
    one = np.ones((1, 1))
    shift_points(moved, np.ones(1, dtype=np.bool_), 0.2 * one, 1.0 * one, -0.5 * one)
    for before, after in zip(points[0, :2], moved[0, :2], strict=True):
        assert after[0] * math.sin(after[2]) == pytest.approx(before[0] * math.sin(before[2]))
        x = before[0] * math.cos(before[2]) * math.cos(before[1]) - 1.0
        y = before[0] * math.cos(before[2]) * math.sin(before[1]) + 0.5
        way = after[0] * math.cos(after[2])
        assert way * math.cos(after[1] + 0.2) == pytest.approx(x)
        assert way * math.sin(after[1] + 0.2) == pytest.approx(y)
    assert moved[0, 2].tolist() == points[0, 2].tolist()
