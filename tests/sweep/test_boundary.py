"""Planned attributes against the ODD: limits are inclusive in any unit, and NaN is outside."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.spec.load import load_scenario
from adeye.spec.odd import Attributes
from adeye.spec.quantity import SI
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.axes import default_values
from adeye.sweep.boundary import Breach, breaches
from tests.stored import stored

TABLES = stored("sweeps")


SCENARIO = load_scenario(
    Path(__file__).parents[2] / "scenarios_db" / "motorway" / "cut_in.yaml"
).spec


def found(
    attributes: dict[str, Any], scenario: LogicalScenario = SCENARIO, **columns: Any
) -> list[Breach]:
    count = max((len(column) for column in columns.values()), default=1)
    values: dict[str, Any] = {**default_values(scenario), **columns}
    return breaches(scenario, values, count, Attributes.model_validate(attributes))


def test_no_attribute_admits_everything() -> None:
    assert found({}, ego_speed=np.array([1e9])) == []


def test_limit_is_inside_and_the_first_breach_is_told() -> None:
    kmh, mmh = 1 / 3.6, 1e-3 / 3600
    for part, name, limit, values, outside, text in (
        ("dynamic_elements", "ego_speed", {"max": "100 km/h"},
         [90 * kmh, 100 * kmh, 101 * kmh], [False, False, True],
         "ego_speed: 101 km/h is above the ODD's maximum 100 km/h"),
        ("environment", "rain", {"max": "7.5 mm/h"},
         [0.0, 7.5 * mmh, 8 * mmh], [False, False, True],
         "rain: 8 mm/h is above the ODD's maximum 7.5 mm/h"),
        ("environment", "friction", {"min": 0.5}, [0.5, 0.4, 0.3], [False, True, True],
         "friction: 0.4 is below the ODD's minimum 0.5"),
    ):  # fmt: skip
        told = {
            breach.attribute: (breach.outside.tolist(), breach.text)
            for breach in found({part: {name: limit}}, SCENARIO, **{name: np.array(values)})
        }
        assert told[name] == (outside, text)
    (breach,) = found({"environment": {"fog": {"min_visibility": "20 km"}}})
    assert (breach.attribute, breach.outside.tolist()) == ("fog visibility", [True])
    assert breach.text == "fog visibility: 10000 m is below the ODD's minimum 20000 m"
    fast = {"dynamic_elements": {"ego_speed": {"max": "130 km/h"}}}
    assert found(fast, ego_speed=np.array([130 / 3.6])) == []


@pytest.mark.parametrize(
    ("attributes", "attribute", "text"), TABLES["word outside holds for every point"]
)
def test_word_outside_holds_for_every_point(
    attributes: dict[str, Any], attribute: str, text: str
) -> None:
    (breach,) = found(attributes, gap=np.array([20.0, 30.0]))
    assert breach.attribute == attribute
    assert breach.outside.tolist() == [True, True]
    assert text in breach.text


def test_curve_to_the_right_is_as_narrow_as_one_to_the_left() -> None:
    for radius in ("300 m", "-300 m"):
        content = SCENARIO.model_dump(mode="json")
        content["world"]["road"] |= {"kind": "curve", "radius": radius}
        curve = LogicalScenario.model_validate(content, context=SI)
        assert found({"scenery": {"min_radius": "300 m"}}, curve) == []
        (breach,) = found({"scenery": {"min_radius": "400 m"}}, curve)
        assert breach.text == "radius: 300 m is below the ODD's minimum 400 m"
    assert found({"scenery": {"min_radius": "400 m"}}) == []


def test_sun_above_the_horizon_must_be_as_high_as_the_odd_has_it() -> None:
    content = SCENARIO.model_dump(mode="json")
    content["parameters"]["sun"] = {"default": "30 deg"}
    content["environment"]["sun_elevation"] = "sun"
    sunny = LogicalScenario.model_validate(content, context=SI)
    attributes = {"environment": {"sun_elevation": {"min": "10 deg"}}}
    heights = np.radians([30.0, 10.0, 9.0, 0.0, -1.0])
    (breach,) = found(attributes, sunny, sun=heights)
    assert breach.attribute == "sun elevation"
    assert breach.outside.tolist() == [False, False, True, True, False]
    assert breach.text == "sun elevation: 9 deg is below the ODD's minimum 10 deg"
    assert found(attributes, sunny, sun=heights[:2]) == []
    assert found(attributes) == []
    assert found({}, sunny, sun=heights) == []


def test_every_lane_count_along_the_road_is_in_the_odd() -> None:
    road = SCENARIO.world.road
    text = SCENARIO.model_dump(mode="json")
    text["world"]["road"]["lane_ends"] = {"works": {"side": "left", "s": "300 m", "taper": "90 m"}}
    ending = LogicalScenario.model_validate(text, context=SI)
    scenery = {"scenery": {"lanes": {"min": road.lanes, "max": 8}}}
    assert [item.attribute for item in found(scenery)] == []
    (breach,) = found(scenery, ending)
    assert breach.text.startswith(f"{road.lanes - 1} to {road.lanes} lanes, the ODD has")
