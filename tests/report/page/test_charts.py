"""Charts of the page: bars, fronts and labels that stand where the numbers say."""

import itertools
import math

import numpy as np
import pytest

from adeye.kernel.random import uniform
from adeye.report.comparison.records import Cost
from adeye.report.page import charts
from tests.frozen import assert_frozen
from tests.report.parts import candidate, comparison
from tests.stored import known


def drawn(*points: tuple[str, float, int]) -> charts.Front:
    candidates = [
        candidate(
            name, cost=Cost(total=cost, declared=cost, parts={}), failing=failing, cases=10_000
        )
        for name, cost, failing in points
    ]
    return known(charts.draw_front(comparison(candidates=candidates, pairs=(), cheapest=())))


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


def test_one_without_a_cost_and_nothing_executed_are_no_picture() -> None:
    nothing = {"cases": 0, "fault_free": 0}
    for candidates in (
        (candidate("a", cost=None), candidate("b")),
        (candidate("a", **nothing), candidate("b", **nothing)),
    ):
        assert charts.draw_front(comparison(candidates=candidates, pairs=(), cheapest=())) is None


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
        assert 0.0 <= dot.x <= charts.WIDTH
        assert 0.0 <= dot.y <= charts.HEIGHT
        assert dot.label is not None
        assert 0.0 <= dot.label.box.left < dot.label.box.right <= charts.WIDTH
        assert 0.0 <= dot.label.box.top < dot.label.box.bottom <= charts.HEIGHT
    for tick in (*front.rows, *front.columns):
        assert 0.0 <= tick.at <= charts.WIDTH


def test_ticks_enclose_and_are_few_and_those_of_test_cases_whole() -> None:
    for low, high in ((0.0, 1.0), (100.0, 270.0), (0.0, 8000.0), (99.0, 99.5), (3.0, 3.0)):
        found = charts.ticks(low, high)
        assert found[0] <= low <= high <= found[-1]
        assert 2 <= len(found) <= 7
    assert charts.ticks(0.0, 2.0, whole=True) == [0.0, 1.0, 2.0]
    assert charts.ticks(0.0, 0.0, whole=True) == [0.0, 1.0]


AREA = charts.Box(68.0, 2.0, 558.0, 254.0)


def square(dot: tuple[float, float]) -> charts.Box:
    x, y = dot
    return charts.Box(x - charts.RADIUS, y - charts.RADIUS, x + charts.RADIUS, y + charts.RADIUS)


def shares(one: charts.Box, other: charts.Box) -> bool:
    """Tell whether two boxes share more than a side."""
    return (
        min(one.right, other.right) - max(one.left, other.left) > 1e-9
        and min(one.bottom, other.bottom) - max(one.top, other.top) > 1e-9
    )


def check(labels: list[charts.Label], dots: list[tuple[float, float]]) -> None:
    for one, other in itertools.combinations(labels, 2):
        assert not shares(one.box, other.box), (one, other)
    for label in labels:
        assert AREA.left <= label.box.left < label.box.right <= AREA.right
        assert AREA.top <= label.box.top < label.box.bottom <= AREA.bottom
        assert not any(shares(label.box, square(dot)) for dot in dots)


def cloud(number: int, size: int, width: float) -> list[tuple[float, float]]:
    """Draw dots around the middle, the same for everybody."""
    draws = [float(uniform(np.uint64(5), np.uint64(number), 0, at)) for at in range(2 * size)]
    return [
        (300.0 + width * (a - 0.5), 128.0 + 0.45 * width * (b - 0.5))
        for a, b in zip(draws[::2], draws[1::2], strict=True)
    ]


def test_labels_of_clouds_are_frozen() -> None:
    """Each name with its box and leader, where a line is in the way, and what finds no room."""
    names = [f"suite_{'long_' * (at % 9)}{at}" for at in range(12)]
    lines = (charts.Box(250.0, 100.0, 350.0, 101.0), charts.Box(300.0, 40.0, 301.0, 200.0))
    told = []
    for width, area in (
        (0.0, AREA),
        (60.0, AREA),
        (300.0, AREA),
        (60.0, charts.Box(250, 90, 400, 170)),
    ):
        told.append(f"{width:g} wide in {area}")
        for item in charts.place_labels(names, cloud(3, 12, width), area, lines):
            if item is None:
                told.append("  none")
                continue
            leader = "" if item.leader is None else " to ".join(f"{at:.2f}" for at in item.leader)
            told.append(f"  {item.text}: {' '.join(f'{at:.2f}' for at in item.box.row)}; {leader}")
    assert_frozen("labels.txt", "\n".join([*told, ""]))


@pytest.mark.parametrize("width", [0.0, 20.0, 100.0, 440.0])
def test_labels_of_a_cloud_cover_nothing(width: float) -> None:
    for number in range(5):
        dots = cloud(number, 12, width)
        labels = charts.place_labels([f"study_suite_{at}" for at in range(12)], dots, AREA)
        found = [item for item in labels if item is not None]
        assert len(found) == 12
        check(found, dots)


def test_label_at_a_corner_stays_inside() -> None:
    for dot in ((64.0, 24.0), (536.0, 24.0), (64.0, 254.0), (536.0, 254.0)):
        (label,) = charts.place_labels(["a_rather_long_name_of_a_suite"], [dot], AREA)
        check([known(label)], [dot])


def test_alone_it_stands_beside_its_dot_without_a_line() -> None:
    (label,) = charts.place_labels(["lidar"], [(300.0, 100.0)], AREA)
    assert label is not None
    assert label.leader is None
    assert math.hypot(label.box.left - 300.0, label.box.bottom - 100.0) < 2.0 * charts.RADIUS


def test_label_that_stands_off_is_tied_to_its_own_dot() -> None:
    labels = charts.place_labels([f"copy_{at}" for at in range(10)], [(300.0, 100.0)] * 10, AREA)
    leaders = [(item.box, item.leader) for item in labels if item is not None and item.leader]
    assert leaders
    for box, (x1, y1, x2, y2) in leaders:
        assert (x1, y1) == (300.0, 100.0)
        assert box.left <= x2 <= box.right
        assert box.top <= y2 <= box.bottom


def test_line_of_one_label_crosses_no_other_while_there_is_a_way() -> None:
    names = [f"study_suite_{at}" for at in range(6)]
    dots = [(300.0 + 12.0 * (at % 3), 100.0 + 9.0 * (at % 2)) for at in range(6)]
    found = [item for item in charts.place_labels(names, dots, AREA) if item is not None]
    tied = [(item, item.leader) for item in found if item.leader is not None]
    assert tied
    for label, (x1, y1, x2, y2) in tied:
        places = [(x1 + (x2 - x1) * at / 200.0, y1 + (y2 - y1) * at / 200.0) for at in range(201)]
        for box in (other.box for other in found if other is not label):
            assert not any(box.left < x < box.right and box.top < y < box.bottom for x, y in places)


def test_label_leaves_a_drawn_line_free_if_it_can() -> None:
    dot = (300.0, 100.0)
    line = charts.Box(300.0, 100.0, 500.0, 100.0)
    free, moved = (charts.place_labels(["lidar"], [dot], AREA, lines)[0] for lines in ((), (line,)))
    assert free is not None
    assert moved is not None
    assert free.box.top < line.top < free.box.bottom
    assert free.box.right > line.left
    assert moved.box.bottom <= line.top or moved.box.right <= line.left


def test_no_room_is_no_label_rather_than_one_on_another() -> None:
    dots = [(300.0, 100.0)] * 200
    labels = charts.place_labels([f"a_rather_long_name_{at}" for at in range(200)], dots, AREA)
    found = [item for item in labels if item is not None]
    assert 20 < len(found) < 200
    check(found, dots)


def test_very_long_name_is_cut() -> None:
    (label,) = charts.place_labels(["m" * 90], [(300.0, 100.0)], AREA)
    assert label is not None
    assert label.text.endswith("m\N{HORIZONTAL ELLIPSIS}")
    assert charts.width_of(label.text) == pytest.approx(label.width)
    assert label.width <= 240.0


def test_same_dots_have_the_same_labels() -> None:
    dots = cloud(1, 20, 60.0)
    names = [f"suite_{at}" for at in range(20)]
    assert charts.place_labels(names, dots, AREA) == charts.place_labels(names, dots, AREA)
