"""Coverage of hand-made situations: what is covered, what is not, and what cannot be."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.spec.load import load_scenario, shipped
from adeye.spec.odd import Attributes, CoverageBins
from adeye.spec.quantity import SI
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.axes import default_values
from adeye.sweep.coverage import Coverage, Situations, coverage_of

if TYPE_CHECKING:
    from collections.abc import Sequence

ODD = Attributes.model_validate(
    {
        "scenery": {"road_type": ["motorway", "rural"], "lanes": {"min": 3, "max": 3}},
        "environment": {"illumination": ["day"], "rain": {"max": "7.5 mm/h"}},
        "dynamic_elements": {"ego_speed": {"max": "130 km/h"}},
    }
)
BINS = CoverageBins.model_validate({"ego_speed": ["20 km/h", "80 km/h", "130 km/h"]})


def cut_in() -> LogicalScenario:
    return load_scenario(shipped("scenarios_db") / "motorway" / "cut_in.yaml").spec


def coverage(scenario: LogicalScenario, speeds: Sequence[float], strength: int = 2) -> Coverage:
    columns: dict[str, Any] = {**default_values(scenario), "ego_speed": np.array(speeds) / 3.6}
    return coverage_of(ODD, BINS, strength, [Situations(scenario, columns, len(speeds))])


def of(found: Coverage, *names: str) -> Any:
    (item,) = [item for item in found.combinations if set(item.attributes) == set(names)]
    return item


def test_bin_without_a_situation_is_uncovered() -> None:
    found = of(coverage(cut_in(), [90.0, 100.0]), "ego_speed")
    assert (found.total, found.feasible, found.covered) == (2, 2, 1)
    assert found.uncovered == (("20 to 80 km/h",),)
    assert found.counts == ((("80 to 130 km/h",), 2),)


def test_bin_that_no_scenario_has_is_no_gap_of_the_plan() -> None:
    found = of(coverage(cut_in(), [90.0]), "road_type")
    assert (found.total, found.feasible, found.covered) == (2, 1, 1)
    assert found.impossible == (("rural",),)
    assert found.uncovered == ()


def test_pair_is_covered_by_one_situation_and_not_by_two() -> None:
    scenario = cut_in()
    columns: dict[str, Any] = {
        **default_values(scenario),
        "ego_speed": np.array([60.0, 100.0]) / 3.6,
        "rain": np.array([0.0, 5.0]) / 3.6e6,
    }
    found = coverage_of(ODD, BINS, 2, [Situations(scenario, columns, 2)])
    assert of(found, "ego_speed").covered == 2
    pair = of(found, "ego_speed", "rain")
    assert (pair.total, pair.feasible, pair.covered) == (6, 6, 2)
    assert ("20 to 80 km/h", "2.5 to 7.5 mm/h") in pair.uncovered


def test_every_combination_is_counted_once() -> None:
    found = coverage(cut_in(), [60.0, 90.0, 130.0], strength=3)
    assert len(found.combinations) == 7 + 21 + 35
    for item in found.combinations:
        assert item.total == item.feasible + len(item.impossible)
        assert item.feasible == item.covered + len(item.uncovered)
        assert sum(count for _, count in item.counts) == 3


def test_situation_in_no_bin_of_one_attribute_counts_for_the_others() -> None:
    found = coverage(cut_in(), [10.0, 90.0])
    assert (found.situations, found.outside) == (2, 1)
    assert of(found, "ego_speed").counts == ((("80 to 130 km/h",), 1),)
    assert of(found, "lanes").counts == ((("3",), 2),)


def test_without_situations_nothing_is_covered() -> None:
    found = coverage_of(ODD, BINS, 1, [Situations(cut_in(), {}, 0)])
    assert all(item.covered == 0 for item in found.combinations)
    assert of(found, "ego_speed").feasible == 2


def test_kinds_of_actor_are_counted_for_each_and_paired_with_the_rest() -> None:
    kinds = CoverageBins.model_validate({"actors": ["truck", "car", "bus"]})
    scenario = cut_in()
    (actor,) = {item.kind for item in scenario.actors.values()}
    assert actor == "car"
    content = scenario.model_dump(mode="json")
    content["actors"]["slow"] = {
        "kind": "truck",
        "start": {"lane": "0", "s": "200 m", "speed": "20 m/s"},
    }
    mixed = LogicalScenario.model_validate(content, context=SI)
    columns: dict[str, Any] = {**default_values(mixed), "ego_speed": np.array([60.0, 100.0]) / 3.6}
    found = coverage_of(ODD, kinds, 2, [Situations(mixed, columns, 2)])
    alone = of(found, "actors")
    assert alone.counts == ((("truck",), 2), (("car",), 2))
    assert alone.impossible == (("none",), ("bus",))
    assert alone.uncovered == ()
    pair = of(found, "ego_speed", "actors")
    assert pair.covered == 4
    # What has one of the kinds is in a bin; every other pair counts a situation once.
    assert found.outside == 0
    assert sum(count for _, count in of(found, "lanes", "rain").counts) == 2


def test_situation_with_none_of_the_kinds_is_in_no_bin() -> None:
    kinds = CoverageBins.model_validate({"actors": ["pedestrian"]})
    scenario = cut_in()
    found = coverage_of(ODD, kinds, 1, [Situations(scenario, default_values(scenario), 3)])
    assert found.outside == 3
    assert of(found, "actors").covered == 0


def test_curve_of_any_direction_covers_its_radius_and_leaves_straight_roads_open() -> None:
    path = shipped("scenarios_db") / "motorway" / "free_driving_curve.yaml"
    bends = load_scenario(path).spec
    radii = CoverageBins.model_validate({"radius": ["500 m", "700 m", "900 m", "2000 m"]})
    columns: dict[str, Any] = {**default_values(bends), "radius": np.array([600.0, 800.0])}
    found = coverage_of(ODD, radii, 1, [Situations(bends, columns, 2), Situations(cut_in(), {}, 0)])
    radius = of(found, "radius")
    assert radius.counts == ((("500 to 700 m",), 1), (("700 to 900 m",), 1))
    # Its parameter goes to 1000 m, the cut-in is on a straight road.
    assert radius.uncovered == (("straight",), ("900 to 2000 m",))
