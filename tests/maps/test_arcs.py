"""Lines of arcs: as near as they say, without a kink, as few as a centimetre needs."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adeye.maps import arcs, lanes
from tests.drawn_roads import cubics, lane, piece, road, section

WIDE = (0.0, 3.5, 0.0, 0.0, 0.0)
TURN = 0, 16.5, 0, -5.5, 0, 0, 16.5, -5.5
SHIFT = 0, 60, 0, 0, 0, 0, 10.5, -7

# Of the reference line, what the design measured.
CURVES: dict[str, tuple[Any, int]] = {
    "ramp": (piece("spiral", 60.0, 0.0, 1 / 50), 6),
    "motorway": (piece("spiral", 120.0, 0.0, 1 / 400), 6),
    "s": (piece("spiral", 80.0, 1 / 60, -1 / 60), 10),
    "sharp": (piece("spiral", 8.0, 0.0, 1 / 8), 4),
    "turn": (piece("paramPoly3", 17.04, *TURN, normalized=True), 6),
    "shift": (piece("paramPoly3", 60.24, *SHIFT, normalized=True), 6),
    "straight": (piece("line", 500.0), 1),
    "bend": (piece("arc", 80.0, 1 / 30), 1),
}


def off(rows: Any, x: Any, y: Any) -> Any:
    """Return how far points are from a line of arcs."""
    nearest = np.full(len(x), np.inf)
    for x0, y0, cosine, sine, _, _, length, bend, _, _ in rows:
        along = (x - x0) * cosine + (y - y0) * sine
        aside = (y - y0) * cosine - (x - x0) * sine
        if bend == 0.0:
            inside, distance = (along > -0.01) & (along < length + 0.01), abs(aside)
        else:
            turned = np.arctan2(along * abs(bend), 1.0 - aside * bend)
            inside = (turned > -0.01 * abs(bend)) & (turned < (length + 0.01) * abs(bend))
            distance = abs(np.hypot(along, aside - 1 / bend) - 1 / abs(bend))
        nearest = np.where(inside, np.minimum(nearest, distance), nearest)
    return nearest


def assert_follows(drawn: lanes.LaidRoad, strip: lanes.Strip, rows: Any) -> None:
    line = lanes.along(drawn, strip.center, np.linspace(strip.start, strip.end, 3001))
    assert off(rows, line.x, line.y).max() <= arcs.TOLERANCE
    for row, following in itertools.pairwise(rows):
        x, y, heading = arcs.arc_end((row[0], row[1], row[4]), (row[7], row[6]))
        assert (x, y) == pytest.approx(tuple(following[:2]), abs=1e-9)
        assert abs(np.angle(np.exp(1j * (heading - following[4])))) < 1e-9
        assert following[5] == row[5] + row[6]
    length = np.hypot(np.diff(line.x), np.diff(line.y)).sum()
    assert rows[-1][5] + rows[-1][6] == pytest.approx(length, abs=0.01)


@pytest.mark.parametrize("name", CURVES)
def test_a_centimetre_needs_few_arcs(name: str) -> None:
    geometry, count = CURVES[name]
    drawn = lanes.laid(road([geometry], section(lane(1, WIDE), lane(0), lane(-1, WIDE))))
    for strip in drawn.strips[0]:
        rows = arcs.lane_arcs(drawn, strip)
        assert_follows(drawn, strip, rows)
        assert len(rows) <= count


def test_lane_against_s_is_the_mirrored_lane_along_it() -> None:
    both = [
        lanes.laid(road([piece("spiral", 60.0, 0.0, 1 / 50)], section(lane(number, WIDE))))
        for number in (1, -1)
    ]
    against = arcs.lane_arcs(both[0], both[0].strips[0][0])
    line = lanes.along(both[0], both[0].strips[0][0].center, np.array([0.0, 60.0]))
    assert tuple(against[0, :2]) == pytest.approx((line.x[1], line.y[1]))
    assert against[0, arcs.FIRST_BEND] == pytest.approx(-line.curvature[1])
    assert against[-1, arcs.LAST_BEND] == pytest.approx(-line.curvature[0])


def test_a_kink_is_rounded_within_the_tolerance() -> None:
    drawn = lanes.laid(
        road([piece("line", 100.0)], section(lane(-1, WIDE, (50.0, 3.5, -0.05, 0, 0))))
    )
    strip = drawn.strips[0][0]
    assert_follows(drawn, strip, arcs.lane_arcs(drawn, strip))


@pytest.mark.parametrize("at", [40.0, 0.5])
def test_a_jump_of_the_line_begins_a_new_line(at: float) -> None:
    drawn = lanes.laid(
        road(
            [piece("line", 100.0)],
            section(lane(-1, WIDE)),
            offsets=cubics((0, 0, 0, 0, 0), (at, 1.0, 0, 0, 0)),
        )
    )
    rows = arcs.lane_arcs(drawn, drawn.strips[0][0])
    assert [(row[1], row[6]) for row in rows] == [(-1.75, at), (-0.75, 100.0 - at)]


def test_a_step_of_curvature_stays_one() -> None:
    pieces = [piece("line", 50.0), piece("arc", 20.0, 0.02, s=50.0, pose=(50.0, 0.0, 0.0))]
    drawn = lanes.laid(road(pieces, section(lane(-1, (0, 0, 0, 0, 0)))))
    rows = arcs.lane_arcs(drawn, drawn.strips[0][0])
    assert rows[:, arcs.BEND] == pytest.approx([0.0, 0.02], abs=1e-12)
    assert rows[:, arcs.LAST_BEND] == pytest.approx([0.0, 0.02])
    assert rows[:, arcs.FIRST_BEND] == pytest.approx([0.0, 0.02])


@pytest.mark.parametrize("number", [1, -1])
def test_steps_of_curvature_stay_where_they_are_in_both_directions(number: int) -> None:
    pieces = [
        piece("line", 50.0),
        piece("arc", 20.0, 0.02, s=50.0, pose=(50.0, 0.0, 0.0)),
        piece("line", 30.0, s=70.0, pose=(50 + 50 * math.sin(0.4), 50 - 50 * math.cos(0.4), 0.4)),
    ]
    drawn = lanes.laid(road(pieces, section(lane(number, (0, 0, 0, 0, 0)))))
    rows = arcs.lane_arcs(drawn, drawn.strips[0][0])
    way = (50.0, 20.0, 30.0)
    assert rows[:, 6] == pytest.approx(way[::-number], abs=1e-9)
    assert rows[:, arcs.BEND] == pytest.approx([0.0, -0.02 * number, 0.0], abs=1e-9)
