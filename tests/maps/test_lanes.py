"""Where lanes are: hand-made roads with the answer in the name."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.maps import lanes
from tests.drawn_roads import cubics, lane, network, piece, road, section

STRAIGHT = piece("line", 100.0)
WIDE = (0.0, 3.0, 0.0, 0.0, 0.0)


def test_center_is_beside_all_lanes_within() -> None:
    drawn = road(
        [STRAIGHT],
        section(lane(2, (0, 2, 0, 0, 0)), lane(1, WIDE), lane(0), lane(-1, WIDE)),
        offsets=cubics((0, 0.5, 0, 0, 0)),
    )
    rows = [row for row in lanes.lane_rows(network(drawn), 200.0) if row[2] == 0.0]
    assert [(row[1], row[4], row[6]) for row in rows] == [(2, 4.5, 2), (1, 2.0, 3), (-1, -1.0, 3)]


def test_border_is_measured_from_the_lane_offset_and_not_from_the_lane_within() -> None:
    outer = lane(-2, borders=cubics((0, -5, 0, 0, 0)))
    drawn = road([STRAIGHT], section(lane(-1, WIDE), outer), offsets=cubics((0, 0.5, 0, 0, 0)))
    rows = list(lanes.lane_rows(network(drawn), 200.0))
    assert [(row[1], row[4], row[6]) for row in rows[:2]] == [(-1, -1.0, 3), (-2, -3.5, 2)]


def length_of(drawn: lanes.LaidRoad, strip: lanes.Strip) -> float:
    line = lanes.along(drawn, strip.center, np.linspace(strip.start, strip.end, 10_001))
    return float(np.hypot(np.diff(line.x), np.diff(line.y)).sum())


def test_widening_lane_turns_its_center_line() -> None:
    drawn = road([STRAIGHT], section(lane(-1, (0, 3, 0.1, 0, 0))))
    (first, *_) = lanes.lane_rows(network(drawn), 25.0)
    assert first[5] == pytest.approx(-math.atan(0.05), abs=1e-12)
    strip = lanes.laid(drawn).strips[0][0]
    assert length_of(lanes.laid(drawn), strip) == pytest.approx(100 * math.hypot(1, 0.05))


def test_lanes_beside_an_arc_are_as_long_as_their_radii() -> None:
    drawn = lanes.laid(
        road([piece("arc", 50.0, 1 / 40)], section(lane(1, WIDE), lane(0), lane(-1, WIDE)))
    )
    lengths = [length_of(drawn, strip) for strip in drawn.strips[0]]
    assert lengths == pytest.approx([50 * 38.5 / 40, 50 * 41.5 / 40], rel=1e-8)


def test_every_start_step_and_end_has_rows_and_a_border_of_sections_those_behind_it() -> None:
    drawn = road([piece("line", 60.0)], section(lane(-1, WIDE)), section(lane(1, WIDE), s=25.0))
    rows = lanes.lane_rows(network(drawn), 25.0)
    assert [(row[1], row[2]) for row in rows] == [(-1, 0.0), (1, 25.0), (1, 50.0), (1, 60.0)]


def test_widths_begin_with_their_section_and_offsets_with_the_road() -> None:
    drawn = road(
        [STRAIGHT],
        section(lane(-1, WIDE)),
        section(lane(-1, WIDE, (10.0, 3.0, -0.1, 0, 0)), s=50.0),
        offsets=cubics((40.0, 0, 0.1, 0, 0)),
    )
    strip = lanes.laid(drawn).strips[1][0]
    assert lanes.width_at(strip, np.array([55.0, 70.0])) == pytest.approx([3.0, 2.0])
    assert lanes.value_at(strip.inner, np.array([50.0, 70.0]))[0] == pytest.approx([1.0, 3.0])


@pytest.mark.parametrize(
    ("number", "left_hand", "direction", "way"),
    [
        (-1, False, "standard", 1),
        (1, False, "standard", -1),
        (-1, True, "standard", -1),
        (1, True, "standard", 1),
        (-1, False, "reversed", -1),
        (1, True, "reversed", -1),
        (-1, True, "both", 0),
    ],
)
def test_way_of_a_lane(number: int, left_hand: Any, direction: str, way: int) -> None:
    drawn = road([STRAIGHT], section(lane(number, WIDE, direction=direction)), left_hand=left_hand)
    assert lanes.laid(drawn).strips[0][0].way == way


def test_elevation_has_a_gradient() -> None:
    height, gradient = lanes.value_at(cubics((0, 5, 0.04, 0, 0)), np.array([50.0]))
    assert (height[0], gradient[0]) == pytest.approx((7.0, 0.04))
