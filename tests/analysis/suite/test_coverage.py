"""Coverage and blind spots against areas that are known."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.analysis.suite import coverage as suite_coverage
from adeye.analysis.suite.conditions import DEFAULTS
from adeye.analysis.suite.geometry import Reach, Zone, zones_of
from adeye.analysis.suite.records import ZoneCoverage
from tests.analysis.suite.rigs import BUMPER, LENGTH, ROOF, WIDTH, view

CONDITION = DEFAULTS[0]
SIZE = (LENGTH, WIDTH)
TURN = 2.0 * math.pi
SQUARE = Zone("square", "square", "car", ((10.0, -10.0), (30.0, -10.0), (30.0, 10.0), (10.0, 10.0)))


def look(
    views: Sequence[Any], zones: Sequence[Zone] = (SQUARE,), kinds: Sequence[str] = ()
) -> suite_coverage.Look:
    named = {str(number): each for number, each in enumerate(views)}
    return suite_coverage.look_of(zones, SIZE, named, kinds or ["radar"] * len(views))


def measured(views: Sequence[Any], reaches: Sequence[Reach], **changes: Any) -> ZoneCoverage:
    found = look(views, **changes)
    return next(iter(suite_coverage.coverage(found, found.seen(reaches), "car", CONDITION)))


def test_sensor_that_reaches_everywhere_covers_all() -> None:
    everywhere = view(field_of_view=TURN, mount=ROOF)
    found = look([everywhere], zones_of(*SIZE))
    seen = found.seen([Reach(0.0, 1000.0)])
    covered = list(suite_coverage.coverage(found, seen, "car", CONDITION))
    assert {item.seen_by_1 for item in covered} == {1.0}
    assert list(suite_coverage.blind_spots(found, seen, "car", CONDITION)) == []


def test_covered_area_is_that_of_the_sector_without_its_blind_zone() -> None:
    # A sector of 1 rad and 20 m inside a square: 0.5 · 20² · 1 = 200 m² of 1600 m².
    zone = Zone("z", "z", "car", ((3.0, -20.0), (43.0, -20.0), (43.0, 20.0), (3.0, 20.0)))
    eye = view(field_of_view=1.0, mount={"x": 3.0, "y": 0.0, "z": 2.0})
    for near, area in ((0.0, 200.0), (10.0, 150.0)):
        found = measured([eye], [Reach(near, 20.0)], zones=[zone])
        assert found.seen_by_1 * found.area_m2 == pytest.approx(area, rel=0.02)


def test_sensors_and_kinds_are_counted_apart() -> None:
    eyes = [view(field_of_view=TURN, mount=ROOF)] * 3
    far = [Reach(0.0, 100.0)] * 3
    alike = measured(eyes, far)
    assert (alike.seen_by_3, alike.seen_by_2_kinds) == (1.0, 0.0)
    mixed = measured(eyes, far, kinds=["radar", "camera", "radar"])
    assert (mixed.seen_by_3, mixed.seen_by_2_kinds) == (1.0, 1.0)
    assert mixed.seen_by_kind == {"camera": 1.0, "radar": 1.0}


def test_kinds_at_a_point_are_at_most_its_sensors() -> None:
    eyes = [view(field_of_view=0.5), view(mount=ROOF), view(mount=ROOF)]
    reaches = [Reach(0.0, 25.0), Reach(0.0, 20.0), Reach(0.0, 40.0)]
    found = measured(eyes, reaches, kinds=["camera", "radar", "radar"])
    assert 0.0 < found.seen_by_2_kinds < found.seen_by_2


@settings(max_examples=30, deadline=None)
@given(
    angle=st.floats(0.05, 6.2), wider=st.floats(0.0, 1.0), far=st.floats(1.0, 60.0),
    further=st.floats(0.0, 40.0), yaw=st.floats(-3.1, 3.1),
)  # fmt: skip
def test_coverage_grows_with_range_and_field_of_view(
    angle: float, wider: float, far: float, further: float, yaw: float
) -> None:
    mount = {**ROOF, "yaw": yaw}
    one = view(field_of_view=angle, mount=mount)
    other = view(field_of_view=min(TURN, angle + wider), mount=mount)
    small = measured([one], [Reach(0.0, far)]).seen_by_1
    assert small <= measured([one], [Reach(0.0, far + further)]).seen_by_1
    assert small <= measured([other], [Reach(0.0, far)]).seen_by_1


def test_without_a_sensor_everything_is_blind() -> None:
    found = look([])
    (spot,) = suite_coverage.blind_spots(found, found.seen([]), "car", CONDITION)
    assert spot.area_m2 == pytest.approx(400.0)
    assert spot.circle_m == pytest.approx(20.0, abs=0.7)
    assert spot.hides == "truck"


def test_strip_that_stays_blind_hides_what_is_no_wider() -> None:
    # The sensor sees all but a strip of 1.0 m at the left edge of the zone.
    strip = Zone("z", "z", "car", ((10.0, -2.0), (20.0, -2.0), (20.0, 2.0), (10.0, 2.0)))
    found = look([view(field_of_view=TURN, mount=ROOF)], [strip])
    _, y = found.cells[0].points
    seen = (y < 1.0)[np.newaxis, :]
    (spot,) = suite_coverage.blind_spots(found, seen, "car", CONDITION)
    assert spot.area_m2 == pytest.approx(10.0, rel=0.05)
    assert spot.circle_m == pytest.approx(1.0, abs=0.15)
    assert spot.hides == "motorcycle"


def test_nearest_blind_place_ahead_is_where_the_range_ends_or_the_blind_zone() -> None:
    eye = view(field_of_view=0.7, mount=BUMPER)
    found = {
        round(math.degrees(item.bearing_rad)): item
        for item in suite_coverage.blind_bearings([eye], [Reach(0.0, 80.0)], SIZE, CONDITION)
    }
    assert found[0].blind_from_m == pytest.approx(80.0, abs=0.11)
    assert found[0].seen_until_m == pytest.approx(80.0, abs=0.11)
    for aside in (90, 180):
        assert (found[aside].blind_from_m, found[aside].seen_until_m) == (0.0, 0.0)
    ahead = next(iter(suite_coverage.blind_bearings([eye], [Reach(0.5, 5.0)], SIZE, CONDITION)))
    assert ahead.blind_from_m == 0.0
    assert ahead.seen_until_m == pytest.approx(5.0, abs=0.11)


def test_nothing_blind_within_the_look_is_none() -> None:
    eye = view(field_of_view=TURN, mount=ROOF)
    found = list(suite_coverage.blind_bearings([eye], [Reach(0.0, 1000.0)], SIZE, CONDITION))
    assert len(found) == 24
    assert {item.blind_from_m for item in found} == {None}
