"""Bins of attributes: cut off at the limits of the ODD, each value in exactly one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.spec.load import load_scenario, shipped
from adeye.spec.odd import Attributes, CoverageBins
from adeye.spec.quantity import SI
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.axes import default_values
from adeye.sweep.coverage import (
    ASKED_EDGES,
    DEFAULT_EDGES,
    NO_BIN,
    bins_of,
    codes_of,
    codes_of_values,
)


def cut_in() -> LogicalScenario:
    return load_scenario(shipped("scenarios_db") / "motorway" / "cut_in.yaml").spec


def labels(attributes: dict[str, Any], declared: dict[str, Any] | None, name: str) -> list[str]:
    own = None if declared is None else CoverageBins.model_validate(declared)
    return [item.label for item in bins_of(Attributes.model_validate(attributes), own)[name]]


SPEED = {"dynamic_elements": {"ego_speed": {"max": "100 km/h"}}}


def test_default_bins_end_at_the_limit_of_the_odd() -> None:
    assert labels(SPEED, None, "ego_speed") == [
        "0 to 30 km/h",
        "30 to 60 km/h",
        "60 to 90 km/h",
        "90 to 100 km/h",
    ]


def test_odd_beyond_the_default_bins_has_one_more() -> None:
    fast = {"dynamic_elements": {"ego_speed": {"max": "160 km/h"}}}
    assert labels(fast, None, "ego_speed")[-1] == "130 to 160 km/h"


def test_declared_bins_replace_the_default_ones() -> None:
    declared = {"ego_speed": ["0 km/h", "60 km/h", "100 km/h", "130 km/h"]}
    assert labels(SPEED, declared, "ego_speed") == ["0 to 60 km/h", "60 to 100 km/h"]


def test_lower_limit_cuts_off_from_below() -> None:
    assert labels({"environment": {"friction": {"min": 0.6}}}, None, "friction") == [
        "0.6 to 0.7",
        "0.7 to 1.2",
    ]


def test_limit_that_leaves_one_value_is_one_bin() -> None:
    dry = {"environment": {"rain": {"max": "0 mm/h"}}}
    assert labels(dry, None, "rain") == ["0 mm/h"]
    (only,) = bins_of(Attributes.model_validate(dry), None)["rain"]
    assert codes_of_values(np.array([0.0, 1e-7]), [only]).tolist() == [0, NO_BIN]


def test_declared_bins_beyond_the_limit_are_none() -> None:
    assert labels(SPEED, {"ego_speed": ["110 km/h", "130 km/h"]}, "ego_speed") == []


def test_labels_are_those_of_the_odd() -> None:
    scenery = {"road_type": ["motorway"], "lanes": {"min": 2, "max": 4}}
    assert labels({"scenery": scenery}, None, "lanes") == ["2", "3", "4"]
    assert labels({"scenery": scenery}, None, "road_type") == ["motorway"]


@given(share=st.floats(0.0, 1.0), name=st.sampled_from(sorted(DEFAULT_EDGES)))
def test_every_value_between_the_ends_is_in_one_bin(share: float, name: str) -> None:
    bins = bins_of(Attributes(), None)[name]
    edges = DEFAULT_EDGES[name]
    value = edges[0] + share * (edges[-1] - edges[0])
    (code,) = codes_of_values(np.array([value]), bins)
    assert code != NO_BIN
    assert bins[code].low - 1e-9 * edges[-1] <= value <= bins[code].high * (1 + 1e-9)


def test_edge_belongs_to_the_bin_above_and_the_last_edge_to_the_last() -> None:
    bins = bins_of(Attributes.model_validate(SPEED), None)["ego_speed"]
    speeds = np.array([0.0, 30.0, 100.0, 100.1]) / 3.6
    assert codes_of_values(speeds, bins).tolist() == [0, 1, 3, NO_BIN]


def test_points_get_the_bins_of_their_formulas() -> None:
    scenario = cut_in()
    bins = bins_of(Attributes(), None)
    columns: dict[str, Any] = {**default_values(scenario), "rain": np.array([0.0, 5.0]) / 3.6e6}
    codes = codes_of(scenario, columns, 2, bins)
    assert codes["rain"].tolist() == [0, 2]
    assert [bins["lanes"][code].label for code in codes["lanes"]] == [
        str(scenario.world.road.lanes)
    ] * 2


@pytest.mark.parametrize("name", sorted(DEFAULT_EDGES))
def test_default_edges_ascend(name: str) -> None:
    assert list(DEFAULT_EDGES[name]) == sorted(set(DEFAULT_EDGES[name]))


def changed(part: str, **content: Any) -> LogicalScenario:
    """Cut-in with another road, environment or set of actors."""
    written = cut_in().model_dump(mode="json")
    own = content if part == "actors" else {**written[part], **content}
    if part == "world":
        own = {"road": {**written["world"]["road"], **content}}
    return LogicalScenario.model_validate({**written, part: own}, context=SI)


def codes(scenario: LogicalScenario, attributes: dict[str, Any], name: str, **values: Any) -> Any:
    """Labels of the bins of points of a scenario, by row where it has several at once."""
    bins = bins_of(Attributes.model_validate(attributes), None)
    columns: dict[str, Any] = {**default_values(scenario), **values}
    count = max((np.size(value) for value in values.values()), default=1)
    found = codes_of(scenario, columns, count, bins)[name]
    words = [*(item.label for item in bins[name]), "no bin"]
    return np.array(words)[found].tolist()


CURVES = {"scenery": {"min_radius": "300 m"}}
SUNNY = {"environment": {"sun_elevation": {"min": "5 deg"}}}


def test_odd_that_does_not_speak_of_radius_sun_or_actors_has_no_bins_of_them() -> None:
    assert (
        not {"radius", "sun_elevation", "sun_azimuth", "actors"}
        & bins_of(Attributes(), None).keys()
    )


def test_radius_of_the_odd_cuts_off_narrow_curves_and_keeps_straight_roads() -> None:
    assert labels(CURVES, None, "radius")[:3] == ["straight", "300 to 500 m", "500 to 1000 m"]
    assert labels({}, {"radius": ["100 m", "900 m"]}, "radius") == ["straight", "100 to 900 m"]


def test_declared_radii_below_the_limit_are_no_bins() -> None:
    assert labels(CURVES, {"radius": ["100 m", "200 m"]}, "radius") == []


def test_curve_to_the_right_is_as_narrow_as_one_to_the_left() -> None:
    bends = changed("world", kind="curve", radius="gap * 20")
    gaps = np.array([20.0, -20.0, 60.0, 2.0])
    assert codes(bends, CURVES, "radius", gap=gaps) == [
        "300 to 500 m",
        "300 to 500 m",
        "1000 to 2000 m",
        "no bin",
    ]
    assert codes(cut_in(), CURVES, "radius") == ["straight"]


def test_sun_below_the_horizon_is_no_sun_and_below_the_odd_in_no_bin() -> None:
    rises = changed(
        "environment", sun_elevation="lateral_speed / 1 m/s * 1 deg", sun_azimuth="0 deg"
    )
    degrees = np.array([-3.0, 2.0, 5.0, 20.0, 90.0])
    assert codes(rises, SUNNY, "sun_elevation", lateral_speed=degrees) == [
        "no sun",
        "no bin",
        "5 to 10 deg",
        "10 to 30 deg",
        "60 to 90 deg",
    ]
    assert codes(rises, SUNNY, "sun_azimuth", lateral_speed=degrees)[:2] == ["no sun", "ahead"]
    assert codes(cut_in(), SUNNY, "sun_elevation") == ["no sun"]
    assert codes(cut_in(), SUNNY, "sun_azimuth") == ["no sun"]


@pytest.mark.parametrize(
    ("degrees", "side"),
    [
        (0.0, "ahead"),
        (44.9, "ahead"),
        (-45.0, "ahead"),
        (315.0, "ahead"),
        (45.0, "left"),
        (-225.1, "left"),
        (180.0, "behind"),
        (-180.0, "behind"),
        (270.0, "right"),
        (-45.1, "right"),
        (720.0, "ahead"),
    ],
)
def test_sun_stands_in_a_quarter_whatever_turns_its_azimuth_has(degrees: float, side: str) -> None:
    shines = changed("environment", sun_elevation="20 deg", sun_azimuth=f"{degrees} deg")
    assert codes(shines, SUNNY, "sun_azimuth") == [side]


def test_situation_has_each_kind_of_its_actors_once() -> None:
    start = {"lane": "0", "s": "50 m", "speed": "20 m/s"}
    kinds = {"actors": ["car", "truck", "bus"]}
    odd = {"dynamic_elements": kinds}
    written = {
        name: {"kind": kind, "start": start}
        for name, kind in {"one": "truck", "two": "car", "three": "car"}.items()
    }
    mixed = changed("actors", **written).model_copy(update={"storyboard": {}})
    assert codes(mixed, odd, "actors") == [["car"], ["truck"]]
    alone = mixed.model_copy(update={"actors": {}})
    assert codes(alone, odd, "actors") == [["none"]]
    assert codes(mixed, {"dynamic_elements": {"actors": ["car"]}}, "actors") == [
        ["car"],
        ["no bin"],
    ]


def test_default_edges_of_what_is_asked_for_ascend() -> None:
    for edges in ASKED_EDGES.values():
        assert list(edges) == sorted(set(edges))
