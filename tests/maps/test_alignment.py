"""Pieces of roads: spirals against quadrature, headings and lengths by their meaning."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from adeye.maps import alignment, lanes
from tests.drawn_roads import cubics, lane, piece, road, section

Floats = NDArray[np.float64]

TURN = 0, 16.5, 0, -5.5, 0, 0, 16.5, -5.5
KINDS: dict[str, tuple[Any, ...]] = {
    "line": ("line", 40.0),
    "arc": ("arc", 40.0, -1 / 35),
    "spiral": ("spiral", 40.0, 1 / 60, -1 / 25),
    "poly3": ("poly3", 40.0, 0.0, 0.1, 0.01, -3e-4),
    "paramPoly3": ("paramPoly3", 17.04, *TURN),
}


def laid(kind: str, *lanes_of: Any, **changed: Any) -> lanes.LaidRoad:
    geometry = piece(*KINDS[kind], pose=(3.0, -2.0, 2.9), normalized=True)
    return lanes.laid(road([geometry], section(*lanes_of), **changed))


@pytest.mark.parametrize(
    ("start", "end", "length"),
    [
        (0.0, 1 / 50, 60.0),
        (1 / 400, 0.0, 120.0),
        (0.0, 1 / 8, 8.0),
        (1 / 60, -1 / 60, 80.0),
        (0.0, 1e-6, 2000.0),
        (-1 / 300, 1 / 500, 2000.0),
        (0.0, 1 / 8, 300.0),
        (1 / 5, -1 / 4, 100.0),
    ],
)
def test_spiral_is_the_quadrature(start: float, end: float, length: float) -> None:
    slope = (end - start) / length
    for t in (0.1 * length, 0.5 * length, length):
        x, y = alignment.spiral_end(start, slope, t)
        parts = np.linspace(0.0, t, 40)
        for found, function in ((x, math.cos), (y, math.sin)):
            wanted = math.fsum(
                quad(lambda u, f=function: f((start + 0.5 * slope * u) * u), a, b, epsabs=1e-13)[0]
                for a, b in itertools.pairwise(parts)
            )
            assert found == pytest.approx(wanted, abs=1e-9, rel=0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_heading_and_curvature_are_those_of_the_line_beside(kind: str) -> None:
    drawn = laid(
        kind,
        lane(1, (0, 3, 0, 0, 0)),
        lane(-1, (0, 3.5, -0.1, 0.01, -1e-4)),
        offsets=cubics((0, 0.5, 0, 0, 0), (9, 0.5, 0.02, 0, 0)),
    )
    length = drawn.road.length
    s, h = np.array([0.1, 0.4, 0.63, 0.9]) * length, 1e-4
    for strip in drawn.strips[0]:
        here, after, before = (lanes.along(drawn, strip.center, s + h * k) for k in (0, 1, -1))
        dx, dy = (after.x - before.x) / (2 * h), (after.y - before.y) / (2 * h)
        turn = np.angle(np.exp(1j * (after.heading - before.heading))) / (2 * h)
        assert np.hypot(dx, dy) == pytest.approx(here.rate, abs=1e-8)
        away = np.angle(np.exp(1j * (np.arctan2(dy, dx) - here.heading)))
        assert away == pytest.approx(np.zeros(4), abs=1e-8)
        assert turn / here.rate == pytest.approx(here.curvature, abs=1e-8)


@pytest.mark.parametrize("kind", ["poly3", "paramPoly3"])
def test_place_on_a_polynomial_is_its_length_of_arc(kind: str) -> None:
    drawn = laid(kind)
    length = drawn.road.length
    line = lanes.along(drawn, lanes.REFERENCE, np.linspace(0.0, length, 20_001))
    steps = np.hypot(np.diff(line.x), np.diff(line.y))
    assert steps.max() - steps.min() < 1e-9
    # What the file says to be its length is rounded.
    assert steps.sum() == pytest.approx(length, rel=0.0 if kind == "poly3" else 1e-3, abs=1e-6)


def test_param_poly3_ends_where_its_parameter_does() -> None:
    end = lanes.along(
        lanes.laid(road([piece(*KINDS["paramPoly3"], normalized=True)], section())),
        lanes.REFERENCE,
        np.array([17.04]),
    )
    assert (end.x[0], end.y[0]) == pytest.approx((11.0, 11.0), abs=1e-9)


def test_param_poly3_by_length_is_the_normalized_one_stretched() -> None:
    length = 17.04
    stretched = [c / length ** (k % 4) for k, c in enumerate(TURN)]
    places = np.linspace(0.0, length, 9)
    one, other = (
        lanes.along(lanes.laid(road([drawn], section())), lanes.REFERENCE, places)
        for drawn in (
            piece("paramPoly3", length, *TURN, normalized=True),
            piece("paramPoly3", length, *stretched),
        )
    )
    for a, b in zip(one, other, strict=True):
        assert a == pytest.approx(b, abs=1e-9)
