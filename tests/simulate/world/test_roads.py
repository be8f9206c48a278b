"""Roads: lengths, tangents and the geometry of curves, positive to the left."""

from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.kernel.road import position
from adeye.signals import RoadMap
from adeye.simulate.world.formulas import Formulas
from adeye.simulate.world.roads import LEAD_IN, RUN_OUT, build_roads
from tests.motorway import make_case, make_scenario


def build(*, gaps: tuple[float, ...] = (40.0,), **changes: Any) -> RoadMap:
    scenario = make_scenario(world={"road": changes})
    return build_roads(Formulas.of([make_case(scenario, {"gap": gap}) for gap in gaps]))


def test_a_straight_road_goes_along_x_and_on_past_its_end() -> None:
    road = build(length="500 m")
    assert road.segments.tolist() == [[[0.0, 0.0, 0.0, 500.0 + RUN_OUT, 0.0]]]
    assert road.lanes == 3
    assert road.lane_width.tolist() == [3.5]


def test_a_left_curve_has_its_centre_one_radius_to_the_left_and_a_right_one_mirrors_it() -> None:
    segments = build(kind="curve", length="700 m", radius="400 m").segments[0]
    mirrored = build(kind="curve", length="700 m", radius="-400 m").segments[0]
    for s in (LEAD_IN, 250.0, 500.0, 700.0):
        x, y, heading = position(segments, s, 0.0)
        assert np.hypot(x - LEAD_IN, y - 400.0) == pytest.approx(400.0, abs=1e-9)
        assert heading == pytest.approx((s - LEAD_IN) / 400.0, abs=1e-12)
        assert position(mirrored, s, 0.0) == (x, -y, -heading)


def test_an_s_curve_ends_with_the_heading_that_it_began_with() -> None:
    segments = build(kind="s_curve", length="900 m", radius="-500 m").segments[0]
    assert segments[:, 4].tolist() == [0.0, -1 / 500, 1 / 500, 0.0]
    assert segments[:, 3].tolist() == [LEAD_IN, 400.0, 400.0, RUN_OUT]
    assert segments[3, 2] == pytest.approx(0.0, abs=1e-15)
    # Two equal arcs of 0.8 rad to the right, then to the left.
    assert segments[3, 1] == pytest.approx(-2 * 500.0 * (1 - np.cos(0.8)), abs=1e-9)


@pytest.mark.parametrize("kind", ["curve", "s_curve"])
def test_segments_join_without_a_step_or_a_kink(kind: str) -> None:
    segments = build(kind=kind, length="900 m", radius="450 m").segments[0]
    for k, end in enumerate(np.cumsum(segments[:-1, 3])):
        before = position(segments[: k + 1], float(end), 0.0)
        np.testing.assert_allclose(before, segments[k + 1, :3], atol=1e-9)


def test_lane_width_and_radius_vary_from_run_to_run() -> None:
    bend = {"kind": "curve", "length": "700 m", "radius": "10 * gap"}
    road = build(**bend, lane_width="gap / 10", gaps=(30.0, 40.0))
    np.testing.assert_allclose(road.segments[:, 1, 4], [1 / 300, 1 / 400])
    np.testing.assert_allclose(road.lane_width, [3.0, 4.0])


def test_an_impossible_road_is_an_error_with_its_value() -> None:
    impossible: list[tuple[dict[str, Any], str]] = [
        ({"kind": "curve", "length": "90 m", "radius": "400 m"}, "nothing is left"),
        ({"kind": "curve", "length": "300 m", "radius": "9 m"}, "not larger than the 10.5 m"),
        ({"kind": "curve", "length": "900 m", "radius": "200 m"}, "turns by 229 deg"),
        ({"kind": "curve", "length": "900 m", "radius": "gap - 40 m"}, "0 m is not larger"),
        ({"lane_width": "0 m"}, "lane_width: 0 m is not above 0 m"),
        ({"length": "-5 m"}, "length: -5 m"),
    ]
    for changes, message in impossible:
        with pytest.raises(SpecError, match=message):
            build(**changes)
