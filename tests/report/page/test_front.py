"""The picture of a comparison: places, ticks, labels."""

from __future__ import annotations

import itertools

import pytest

from adeye.report.comparison.records import Cost
from adeye.report.page.charts import HEIGHT, WIDTH, Front, draw_front, ticks
from tests.report.comparison.test_comparison import candidate, comparison


def drawn(*points: tuple[str, float, int]) -> Front:
    candidates = [
        candidate(
            name, cost=Cost(total=cost, declared=cost, parts={}), failing=failing, cases=10_000
        )
        for name, cost, failing in points
    ]
    front = draw_front(comparison(candidates=candidates, pairs=(), cheapest=()))
    assert front is not None
    return front


def test_dearer_is_further_right_and_more_failures_are_higher() -> None:
    front = drawn(("cheap", 100.0, 30), ("dear", 300.0, 0))
    cheap, dear = front.dots
    assert cheap.x < dear.x
    assert cheap.y < dear.y


def test_steps_leave_out_what_another_beats() -> None:
    front = drawn(("a", 100.0, 30), ("worse", 200.0, 40), ("b", 300.0, 5))
    assert len(front.steps.split()) == 3
    a, worse, b = front.dots
    assert front.steps == f"{a.x:.1f},{a.y:.1f} {b.x:.1f},{a.y:.1f} {b.x:.1f},{b.y:.1f}"
    assert worse.y < a.y


def test_one_without_a_cost_has_no_place() -> None:
    assert draw_front(comparison(candidates=(candidate("a", cost=None), candidate("b")),
                                 pairs=(), cheapest=())) is None  # fmt: skip


def test_nothing_executed_is_no_picture() -> None:
    candidates = (candidate("a", cases=0, fault_free=0), candidate("b", cases=0, fault_free=0))
    assert draw_front(comparison(candidates=candidates, pairs=(), cheapest=())) is None


def test_all_in_one_place_keep_their_labels_apart() -> None:
    front = drawn(*((f"architecture_{number}", 100.0, 3) for number in range(6)))
    assert front.unnamed == 0
    boxes = [dot.label.box for dot in front.dots if dot.label is not None]
    for one, other in itertools.combinations(boxes, 2):
        beside = one.right <= other.left or other.right <= one.left
        assert beside or one.bottom <= other.top or other.bottom <= one.top


def test_everything_lies_in_the_box() -> None:
    front = drawn(("a_rather_long_name_of_a_suite", 1.0, 0), ("b", 99_999.0, 8_000))
    for dot in front.dots:
        assert 0.0 <= dot.x <= WIDTH
        assert 0.0 <= dot.y <= HEIGHT
        assert dot.label is not None
        assert 0.0 <= dot.label.box.left < dot.label.box.right <= WIDTH
        assert 0.0 <= dot.label.box.top < dot.label.box.bottom <= HEIGHT
    for tick in (*front.rows, *front.columns):
        assert 0.0 <= tick.at <= WIDTH


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 1.0), (100.0, 270.0), (0.0, 8000.0), (99.0, 99.5), (3.0, 3.0)]
)
def test_ticks_enclose_and_are_few(low: float, high: float) -> None:
    found = ticks(low, high)
    assert found[0] <= low <= high <= found[-1]
    assert 2 <= len(found) <= 7


def test_numbers_of_test_cases_are_whole() -> None:
    assert ticks(0.0, 2.0, whole=True) == [0.0, 1.0, 2.0]
    assert ticks(0.0, 0.0, whole=True) == [0.0, 1.0]
