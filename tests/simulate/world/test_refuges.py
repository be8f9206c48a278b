"""Bays beside the road: in the order of their places, apart from each other, along the road."""

from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.signals import REFUGE_KIND, REFUGE_KINDS, REFUGE_S, RoadMap
from adeye.simulate.world.formulas import Formulas
from adeye.simulate.world.roads import build_roads
from tests.motorway import make_case, make_scenario


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
