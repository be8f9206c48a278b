"""Drawings of suites: to scale, one frame for all, nothing outside of what sensors see."""

import math
import re
from typing import Any

import pytest

from adeye.analysis.suite.analyse import analyse
from adeye.analysis.suite.records import Suite
from adeye.report.page.suites import WIDTH, Drawing, Frame, draw, far_frame, near_frame
from tests.analysis.suite.rigs import BUMPER, FRONT, LENGTH, all_around, architecture, radar

Points = list[tuple[float, float]]


def suite(**sensors: Any) -> Suite:
    return analyse(architecture(sensors))


def far(found: Suite) -> tuple[Drawing, Frame]:
    frame = far_frame([found])
    return draw(found, "dry_day", frame, is_near=False), frame


def places(path: str, frame: Frame) -> list[Points]:
    """Read the outlines of a path back into the vehicle frame."""
    outlines = []
    for part in path.split("M")[1:]:
        numbers = [float(text) for text in re.findall(r"-?[\d.]+", part)]
        outlines.append(
            [
                (x / frame.scale - frame.rear, frame.aside - y / frame.scale)
                for x, y in zip(numbers[::2], numbers[1::2], strict=True)
            ]
        )
    return outlines


def test_field_of_view_is_drawn_to_scale_the_same_every_time() -> None:
    drawing, frame = far(suite(eye=radar(range=120.0)))
    assert (drawing, frame) == far(suite(eye=radar(range=120.0)))
    (outline,) = places(drawing.fields[0].path, frame)
    *arc, mount = outline
    assert mount == pytest.approx((FRONT, 0.0), abs=0.1)
    for x, y in arc:
        assert math.hypot(x - FRONT, y) == pytest.approx(120.0, abs=0.1)
    angles = [math.atan2(y, x - FRONT) for x, y in arc]
    assert (min(angles), max(angles)) == pytest.approx((-0.35, 0.35), abs=0.002)


def test_left_is_up_and_ahead_is_right() -> None:
    frame = Frame(60.0, 160.0, 40.0)
    assert frame.place(160.0, 40.0) == pytest.approx((WIDTH, 0.0))
    assert frame.place(-60.0, -40.0) == pytest.approx((0.0, frame.height))


def test_what_the_body_hides_is_not_drawn() -> None:
    drawing, frame = far(suite(eye=radar(range=50.0, field_of_view=2.0 * math.pi)))
    for outline in places(drawing.fields[0].path, frame):
        assert min(x for x, _ in outline) >= FRONT - 0.2


def test_blind_zone_of_an_all_around_sensor_is_a_hole() -> None:
    turn, mount = 2.0 * math.pi, {"x": 0.0, "y": 0.0, "z": 2.0}
    ring = {"kind": "lidar", "fidelity": "physical", "mount": mount, "range": 100.0, "rate": 10.0}
    seen = {"field_of_view": turn, "beams": 2000, "layers": 16, "vertical_field_of_view": 0.3}
    drawing, frame = far(suite(eye={**ring, **seen}))
    outer, inner = places(drawing.fields[0].path, frame)
    assert max(math.hypot(*point) for point in inner) < min(math.hypot(*point) for point in outer)


def test_sensor_that_sees_nothing_is_not_drawn() -> None:
    camera = {
        "kind": "camera", "mount": BUMPER, "field_of_view": 0.7, "range": 80.0, "rate": 20.0,
        "night_range": 0.0,
    }  # fmt: skip
    found = suite(eye=camera)
    frame = far_frame([found])
    assert len(draw(found, "dry_day", frame, is_near=False).fields) == 1
    assert draw(found, "night", frame, is_near=False).fields == ()


def test_arcs_stand_at_what_braking_needs_and_the_regulation_asks() -> None:
    found = suite(eye=radar())
    drawing, frame = far(found)
    arcs = {mark.label: places(mark.path, frame)[0] for mark in drawing.marks}
    speeds = [label for label in arcs if label[-1:].isdigit()]
    assert speeds == ["50", "80", "100", "130", "R157 60", "R157 100", "R157 130"]
    for x, y in arcs["R157 130"]:
        assert math.hypot(x - FRONT, y) == pytest.approx(150.0, abs=0.1)
        assert y <= 0.06
    need = next(
        item.need_m for item in found.slacks
        if (item.condition, item.case, round(item.speed_mps * 3.6))
        == ("dry_day", "stopped_car", 100)
    )  # fmt: skip
    for x, y in arcs["100"]:
        assert math.hypot(x - FRONT, y) == pytest.approx(need, abs=0.1)
        assert y >= -0.06


def test_near_drawing_shows_the_ego_to_scale_and_the_zones() -> None:
    found = suite(roof=all_around())
    frame = near_frame([found])
    drawing = draw(found, "dry_day", frame, is_near=True)
    (body,) = places(drawing.ego, frame)
    assert max(x for x, _ in body) - min(x for x, _ in body) == pytest.approx(LENGTH, abs=0.02)
    assert drawing.zones.count("M") == len(found.zones)
    assert {mark.kind for mark in drawing.marks} == {"range"}


def test_one_frame_holds_all_suites_within_bounds() -> None:
    small, large = suite(eye=radar(range=30.0)), suite(roof=all_around(range=100.0))
    frame = far_frame([small, large])
    assert frame == far_frame([large])
    assert frame.rear >= 100.0
    huge = far_frame([suite(roof=all_around(range=2000.0))])
    assert huge.rear + huge.ahead < 400.0


def test_arc_beyond_the_drawing_is_left_out() -> None:
    parameters = {"emergency_deceleration": 2.0}
    slow = {"nominal": {"kind": "nominal", "links": ["eye"], "parameters": parameters}}
    found = analyse(architecture({"eye": radar()}, channels=slow))
    labels = [mark.label for mark in far(found)[0].marks if mark.kind == "braking"]
    assert "50" in labels
    assert "130" not in labels
