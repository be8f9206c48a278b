"""Roads: lengths, tangents and the geometry of curves, positive to the left."""

from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.kernel.road import position
from adeye.kernel.strips import lane_ends, lanes_at, opposite_ends
from adeye.signals import REFUGE_KIND, REFUGE_KINDS, REFUGE_S, RoadMap
from adeye.simulate.world.formulas import Formulas
from adeye.simulate.world.roads import LEAD_IN, RUN_OUT, build_roads
from tests.motorway import make_case, make_scenario


def built(*, gaps: tuple[float, ...] = (40.0,), **changes: Any) -> RoadMap:
    scenario = make_scenario(world={"road": changes})
    return build_roads(Formulas.of([make_case(scenario, {"gap": gap}) for gap in gaps]))


def test_a_straight_road_goes_along_x_and_on_past_its_end() -> None:
    road = built(length="500 m")
    assert road.segments.tolist() == [[[0.0, 0.0, 0.0, 500.0 + RUN_OUT, 0.0]]]
    assert road.lanes == 3
    assert road.lane_width.tolist() == [3.5]


def test_a_left_curve_has_its_centre_one_radius_to_the_left_and_a_right_one_mirrors_it() -> None:
    segments = built(kind="curve", length="700 m", radius="400 m").segments[0]
    mirrored = built(kind="curve", length="700 m", radius="-400 m").segments[0]
    for s in (LEAD_IN, 250.0, 500.0, 700.0):
        x, y, heading = position(segments, s, 0.0)
        assert np.hypot(x - LEAD_IN, y - 400.0) == pytest.approx(400.0, abs=1e-9)
        assert heading == pytest.approx((s - LEAD_IN) / 400.0, abs=1e-12)
        assert position(mirrored, s, 0.0) == (x, -y, -heading)


def test_an_s_curve_ends_with_the_heading_that_it_began_with() -> None:
    segments = built(kind="s_curve", length="900 m", radius="-500 m").segments[0]
    assert segments[:, 4].tolist() == [0.0, -1 / 500, 1 / 500, 0.0]
    assert segments[:, 3].tolist() == [LEAD_IN, 400.0, 400.0, RUN_OUT]
    assert segments[3, 2] == pytest.approx(0.0, abs=1e-15)
    # Two equal arcs of 0.8 rad to the right, then to the left.
    assert segments[3, 1] == pytest.approx(-2 * 500.0 * (1 - np.cos(0.8)), abs=1e-9)


@pytest.mark.parametrize("kind", ["curve", "s_curve"])
def test_segments_join_without_a_step_or_a_kink(kind: str) -> None:
    segments = built(kind=kind, length="900 m", radius="450 m").segments[0]
    for k, end in enumerate(np.cumsum(segments[:-1, 3])):
        before = position(segments[: k + 1], float(end), 0.0)
        np.testing.assert_allclose(before, segments[k + 1, :3], atol=1e-9)


def test_lane_width_and_radius_vary_from_run_to_run() -> None:
    bend = {"kind": "curve", "length": "700 m", "radius": "10 * gap"}
    road = built(**bend, lane_width="gap / 10", gaps=(30.0, 40.0))
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
            built(**changes)


# --- Bays beside the road: in the order of their places, apart from each other, along the road ----


def bay(**changes: Any) -> dict[str, Any]:
    """Return a parking bay from 380 m to 480 m, its tapers included."""
    written = {"kind": "parking_bay", "s": "400 m", "length": "60 m", "depth": "4 m"}
    return written | {"taper": "20 m"} | changes


def build(*, gaps: tuple[float, ...] = (40.0,), **changes: Any) -> RoadMap:
    scenario = make_scenario(world={"road": {"length": "1000 m", **changes}})
    return build_roads(Formulas.of([make_case(scenario, {"gap": gap}) for gap in gaps]))


def test_a_road_has_no_bays_and_no_verge_unless_it_says_so() -> None:
    road = build(gaps=(30.0, 40.0))
    assert road.refuges.shape == (2, 0, 5)
    assert road.verge.tolist() == [0.0, 0.0]


def test_a_bay_is_written_down_as_it_is_given() -> None:
    road = build(bays={"bay": bay()}, verge="1.5 m")
    assert road.refuges.tolist() == [[[0.0, 400.0, 60.0, 4.0, 20.0]]]
    assert road.verge.tolist() == [1.5]


def test_bays_vary_from_run_to_run_and_keep_the_order_of_their_places() -> None:
    bays = {"a": bay(s="10 * gap"), "b": bay(kind="rest_area", s="350 m")}
    road = build(bays=bays, gaps=(20.0, 60.0))
    assert road.refuges[:, :, REFUGE_S].tolist() == [[200.0, 350.0], [350.0, 600.0]]
    kinds = [[REFUGE_KINDS[int(kind)] for kind in run] for run in road.refuges[:, :, REFUGE_KIND]]
    assert kinds == [["parking_bay", "rest_area"], ["rest_area", "parking_bay"]]


def test_one_bay_may_begin_where_another_ends() -> None:
    road = build(bays={"a": bay(), "b": bay(s="500 m")})
    assert road.refuges.shape[1] == 2


def test_an_impossible_bay_or_verge_is_an_error_with_its_values() -> None:
    impossible: list[tuple[dict[str, Any], str]] = [
        ({"a": bay(depth="0 m")}, "bays.a.depth: 0 m is not above 0 m"),
        ({"a": bay(length="gap - 40 m")}, "bays.a.length: 0 m is not above 0 m"),
        ({"a": bay(taper="-1 m")}, "bays.a.taper: -1 m"),
        ({"a": bay(s="10 m")}, "bays.a.s: .* from -10 m to 90 m, but the road from 0 m to 1000 m"),
        ({"a": bay(s="950 m")}, "bays.a.s: .* from 930 m to 1030 m"),
        ({"a": bay(), "b": bay(s="499 m")}, "bays.b.s: .* begins at 479 m, .* a .* to 480 m"),
        ({"a": bay(s="499 m"), "b": bay()}, "bays.a.s: .* begins at 479 m, .* b .* to 480 m"),
    ]
    for bays, message in impossible:
        with pytest.raises(SpecError, match=message):
            build(bays=bays)
    with pytest.raises(SpecError, match="verge: -1 m"):
        build(verge="-1 m")


def test_roads_of_some_runs_keep_their_bays() -> None:
    road = build(bays={"a": bay(s="10 * gap")}, gaps=(20.0, 60.0, 80.0), verge="gap / 20")
    kept = road.of(np.array([2, 0]))
    assert kept.refuges[:, 0, REFUGE_S].tolist() == [800.0, 200.0]
    assert kept.verge.tolist() == [4.0, 1.0]
    assert kept.lanes == road.lanes


def test_scenarios_with_other_kinds_of_bays_are_not_one_batch() -> None:
    kinds = [{"bays": {"a": bay(kind=kind, s="100 m")}} for kind in REFUGE_KINDS]
    cases = [make_case(make_scenario(world={"road": road})) for road in kinds]
    with pytest.raises(SpecError, match="differ in structure"):
        Formulas.of(cases)


# --- Lanes of the other way, and lanes that end ---------------------------------------------------


def edges_at(road: RoadMap, s: float) -> list[tuple[float, float]]:
    """Return the edges of the lanes of the ego's way at a place, from the right."""
    slabs, strips = road.slabs[0], road.strips[0]
    return [lane_ends(slabs, strips, s, lane) for lane in range(lanes_at(slabs, s))]


def test_lanes_of_the_other_way_lie_left_of_the_others() -> None:
    road = built(lanes=1, opposite_lanes=1)
    assert edges_at(road, 50.0) == [(0.0, 3.5)]
    assert opposite_ends(road.slabs[0], road.strips[0], 50.0, 0) == (3.5, 7.0)
    assert road.centers(np.zeros(1), np.full(1, 50.0), oncoming=True).tolist() == [5.25]


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_lane_ends_over_its_taper_on_its_side(side: str) -> None:
    drop = {"side": side, "s": "100 m", "taper": "70 m"}
    road = built(lanes=2, lane_ends={"drop": drop})
    assert edges_at(road, 99.0) == [(0.0, 3.5), (3.5, 7.0)]
    # It narrows by a metre in 20 m, and is none from 2 m on.
    narrowing = [(1.0, 3.5), (3.5, 7.0)] if side == "right" else [(0.0, 3.5), (3.5, 6.0)]
    np.testing.assert_allclose(edges_at(road, 120.0), narrowing)
    rest = [(3.5, 7.0)] if side == "right" else [(0.0, 3.5)]
    assert [edges_at(road, s) for s in (131.0, 300.0)] == [rest, rest]


def test_where_a_lane_ends_varies_from_run_to_run() -> None:
    drop = {"side": "left", "s": "10 * gap", "taper": "70 m"}
    road = built(lanes=2, lane_ends={"drop": drop}, gaps=(10.0, 30.0))
    assert [lanes_at(slabs, 200.0) for slabs in road.slabs] == [1, 2]


def test_a_lane_does_not_end_behind_the_road() -> None:
    drop = {"side": "left", "s": "480 m", "taper": "70 m"}
    with pytest.raises(SpecError, match="ended at 550 m, but the road ends at 500 m"):
        built(length="500 m", lanes=2, lane_ends={"drop": drop})


def test_a_road_keeps_a_lane_and_its_bays() -> None:
    drop = {"side": "right", "s": "100 m", "taper": "70 m"}
    with pytest.raises(ValueError, match="none is left"):
        built(lanes=1, lane_ends={"drop": drop})
    with pytest.raises(ValueError, match="keeps its right lane"):
        built(lanes=2, lane_ends={"drop": drop}, bays={"one": bay()})
