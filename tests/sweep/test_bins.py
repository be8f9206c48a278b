"""Bins of attributes: cut off at the limits of the ODD, each value in exactly one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.spec.bins import CoverageBins
from adeye.spec.load import load_scenario, shipped
from adeye.spec.odd import Attributes
from adeye.sweep.axes import default_values
from adeye.sweep.bins import DEFAULT_EDGES, NO_BIN, bins_of, codes_of, codes_of_values

if TYPE_CHECKING:
    from adeye.spec.scenario import LogicalScenario


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
