"""Zones: area of polygons, disjoint, and nothing under the ego."""

import itertools

import numpy as np
import pytest

from adeye.analysis.suite.geometry import Zone, cells_of, within, zones_of
from tests.analysis.suite.rigs import FRONT, LENGTH, WIDTH

ZONES = {zone.id: zone for zone in zones_of(LENGTH, WIDTH)}


def test_area_of_a_rectangle_is_exact() -> None:
    assert cells_of(ZONES["front_near"], LENGTH, WIDTH).area == pytest.approx(46.0 * 3.5)
    assert cells_of(ZONES["rear_left"], LENGTH, WIDTH).area == pytest.approx(55.0 * 3.5)


def test_near_field_is_a_ring_around_the_body() -> None:
    cells = cells_of(ZONES["near_field"], LENGTH, WIDTH)
    ring = (LENGTH + 4.0) * (WIDTH + 4.0) - LENGTH * WIDTH
    assert cells.area == pytest.approx(ring, rel=0.02)
    x, y = cells.points
    assert not ((np.abs(x) < 0.5 * LENGTH) & (np.abs(y) < 0.5 * WIDTH)).any()


def test_area_of_a_triangle_is_half_of_its_box() -> None:
    triangle = Zone("t", "t", "car", ((10.0, 0.0), (40.0, 0.0), (10.0, 20.0)))
    assert cells_of(triangle, LENGTH, WIDTH).area == pytest.approx(300.0, rel=0.02)


def test_lanes_do_not_overlap() -> None:
    lanes = [zone for name, zone in ZONES.items() if name != "near_field"]
    for one, other in itertools.combinations(lanes, 2):
        x, y = cells_of(one, LENGTH, WIDTH).points
        assert not within(np.array(other.outline_m), x, y).any(), (one.id, other.id)


def test_zones_ahead_end_at_the_ranges_of_the_regulation() -> None:
    ends = [max(x for x, _ in ZONES[f"front_{name}"].outline_m) for name in ("near", "mid", "far")]
    assert [end - FRONT for end in ends] == pytest.approx([46.0, 90.0, 150.0])


def test_left_and_right_mirror_each_other() -> None:
    for name, zone in ZONES.items():
        if name.endswith("_left"):
            other = ZONES[name.replace("_left", "_right")]
            assert {(x, -y) for x, y in zone.outline_m} == set(other.outline_m)
