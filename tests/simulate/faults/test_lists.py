import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from adeye.signals import Measurement
from adeye.simulate.faults.rows import is_within, widened, with_rows, without
from tests.simulate.faults.streams import check_form


def listed(xs: list[float]) -> Measurement:
    rows = np.zeros((1, len(xs), 7))
    rows[0, :, 0] = xs
    return Measurement(
        np.zeros(1),
        np.ones(1, dtype=np.bool_),
        np.ones(1, dtype=np.bool_),
        np.ones((1, len(xs)), dtype=np.bool_),
        rows,
        np.arange(len(xs))[None],
    )


ALL = np.ones(1, dtype=np.bool_)
places = st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=1, max_size=6)


@given(places, st.data())
def test_list_is_packed_sorted_and_keeps_what_is_there(
    xs: list[float], data: st.DataObject
) -> None:
    item = listed(xs)
    mask = np.array([data.draw(st.lists(st.booleans(), min_size=len(xs), max_size=len(xs)))])
    made = with_rows(item, mask, item.detections.copy(), item.source.copy(), ALL)
    check_form(made)
    assert set(made.source[made.mask].tolist()) == set(np.flatnonzero(mask[0]).tolist())
    for row, source in zip(made.detections[0], made.source[0], strict=True):
        if source >= 0:
            assert row[0] == xs[source] or np.isnan(row[0])


def test_no_number_comes_last_and_is_still_there() -> None:
    item = listed([np.nan, 3.0, np.inf, 1.0])
    made = with_rows(item, item.mask, item.detections.copy(), item.source.copy(), ALL)
    assert made.source[0].tolist() == [3, 1, 2, 0]
    assert made.mask.all()


def test_runs_that_are_not_named_keep_their_order() -> None:
    item = listed([3.0, 1.0])
    made = with_rows(item, item.mask, item.detections.copy(), item.source.copy(), ~ALL)
    assert made.source[0].tolist() == [0, 1]


def test_nothing_lost_is_the_very_same_list() -> None:
    item = listed([1.0, 2.0])
    assert without(item, np.zeros((1, 2), dtype=np.bool_)) is item


def test_wider_list_has_empty_rows_at_its_end() -> None:
    mask, rows, source = widened(listed([1.0]), 2)
    assert mask[0].tolist() == [True, False, False]
    assert rows.shape == (1, 3, 7)
    assert source[0].tolist() == [0, -1, -1]


def within(bearing: float, right: float, left: float) -> bool:
    one = np.array([[bearing]])
    return bool(is_within(one, np.array([[right]]), np.array([[left]]))[0, 0])


def test_sector_goes_from_right_to_left_through_the_rear_if_need_be() -> None:
    assert within(0.0, -0.1, 0.1)
    assert not within(0.2, -0.1, 0.1)
    assert not within(0.1, -0.1, 0.1)
    assert within(3.1, 3.0, -3.0)
    assert within(-3.1, 3.0, -3.0)
    assert not within(0.0, 3.0, -3.0)
    assert not within(1.0, 1.0, 1.0)
    assert not within(np.nan, -1.0, 1.0)


@given(st.floats(-np.pi, np.pi))
def test_whole_turn_has_every_bearing(bearing: float) -> None:
    assert within(bearing, -np.pi, np.pi) or bearing == np.pi
