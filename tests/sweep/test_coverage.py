"""Coverage: cells, bins and what a scenario can reach."""

from collections.abc import Sequence
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
    Bins,
    Coverage,
    Situations,
    Witnesses,
    bins_of,
    codes_of,
    codes_of_values,
    coverage_of,
    tuples_of,
)
from tests.stored import stored

TABLES = stored("sweeps")


# --- Coverage of hand-made situations: what is covered, what is not, and what cannot be -----------

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
    columns: dict[str, Any] = default_values(scenario)
    columns["ego_speed"] = np.array([60.0, 100.0]) / 3.6
    columns["rain"] = np.array([0.0, 5.0]) / 3.6e6
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
    start = {"lane": "0", "s": "200 m", "speed": "20 m/s"}
    content["actors"]["slow"] = {"kind": "truck", "start": start}
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


# --- Bins of attributes: cut off at the limits of the ODD, each value in exactly one --------------


def labels(attributes: dict[str, Any], declared: dict[str, Any] | None, name: str) -> list[str]:
    own = None if declared is None else CoverageBins.model_validate(declared)
    return [item.label for item in bins_of(Attributes.model_validate(attributes), own)[name]]


SPEED = {"dynamic_elements": {"ego_speed": {"max": "100 km/h"}}}


def test_bins_end_at_the_limits_of_the_odd() -> None:
    fast = {"dynamic_elements": {"ego_speed": {"max": "160 km/h"}}}
    halves = {"ego_speed": ["0 km/h", "60 km/h", "100 km/h", "130 km/h"]}
    rough = {"environment": {"friction": {"min": 0.6}}}
    for attributes, declared, name, expected in (
        (SPEED, None, "ego_speed", "0 to 30 km/h, 30 to 60 km/h, 60 to 90 km/h, 90 to 100 km/h"),
        (SPEED, halves, "ego_speed", "0 to 60 km/h, 60 to 100 km/h"),
        (SPEED, {"ego_speed": ["110 km/h", "130 km/h"]}, "ego_speed", ""),
        (rough, None, "friction", "0.6 to 0.7, 0.7 to 1.2"),
        (CURVES, {"radius": ["100 m", "200 m"]}, "radius", ""),
    ):
        assert ", ".join(labels(attributes, declared, name)) == expected
    # One that goes beyond the default bins has one more.
    assert labels(fast, None, "ego_speed")[-1] == "130 to 160 km/h"


def test_limit_that_leaves_one_value_is_one_bin() -> None:
    dry = {"environment": {"rain": {"max": "0 mm/h"}}}
    assert labels(dry, None, "rain") == ["0 mm/h"]
    (only,) = bins_of(Attributes.model_validate(dry), None)["rain"]
    assert codes_of_values(np.array([0.0, 1e-7]), [only]).tolist() == [0, NO_BIN]


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
    rain = np.array([0.0, 5.0]) / 3.6e6
    found = codes_of(
        scenario, {**default_values(scenario), "rain": rain}, 2, bins_of(Attributes(), None)
    )
    assert found["rain"].tolist() == [0, 2]
    assert codes(scenario, {}, "lanes", rain=rain) == [str(scenario.world.road.lanes)] * 2


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
    asked = {"radius", "sun_elevation", "sun_azimuth", "actors"}
    assert asked.isdisjoint(bins_of(Attributes(), None))


def test_radius_of_the_odd_cuts_off_narrow_curves_and_keeps_straight_roads() -> None:
    assert labels(CURVES, None, "radius")[:3] == ["straight", "300 to 500 m", "500 to 1000 m"]
    assert labels({}, {"radius": ["100 m", "900 m"]}, "radius") == ["straight", "100 to 900 m"]


def test_curve_to_the_right_is_as_narrow_as_one_to_the_left() -> None:
    bends = changed("world", kind="curve", radius="gap * 20")
    found = codes(bends, CURVES, "radius", gap=np.array([20.0, -20.0, 60.0, 2.0]))
    assert found == ["300 to 500 m", "300 to 500 m", "1000 to 2000 m", "no bin"]
    assert codes(cut_in(), CURVES, "radius") == ["straight"]


def test_sun_below_the_horizon_is_no_sun_and_below_the_odd_in_no_bin() -> None:
    height = "lateral_speed / 1 m/s * 1 deg"
    rises = changed("environment", sun_elevation=height, sun_azimuth="0 deg")
    degrees = np.array([-3.0, 2.0, 5.0, 20.0, 90.0])
    found = codes(rises, SUNNY, "sun_elevation", lateral_speed=degrees)
    assert found == ["no sun", "no bin", "5 to 10 deg", "10 to 30 deg", "60 to 90 deg"]
    assert codes(rises, SUNNY, "sun_azimuth", lateral_speed=degrees)[:2] == ["no sun", "ahead"]
    # On the horizon it is one.
    on_horizon = np.array([-1e-9, 0.0])
    assert codes(rises, SUNNY, "sun_azimuth", lateral_speed=on_horizon) == ["no sun", "ahead"]
    assert codes(cut_in(), SUNNY, "sun_elevation") == ["no sun"]
    assert codes(cut_in(), SUNNY, "sun_azimuth") == ["no sun"]


@pytest.mark.parametrize(
    ("degrees", "side"), TABLES["sun stands in a quarter whatever turns its azimuth has"]
)
def test_sun_stands_in_a_quarter_whatever_turns_its_azimuth_has(degrees: float, side: str) -> None:
    shines = changed("environment", sun_elevation="20 deg", sun_azimuth=f"{degrees} deg")
    assert codes(shines, SUNNY, "sun_azimuth") == [side]


def test_situation_has_each_kind_of_its_actors_once() -> None:
    start = {"lane": "0", "s": "50 m", "speed": "20 m/s"}
    kinds = {"one": "truck", "two": "car", "three": "car"}
    written = {name: {"kind": kind, "start": start} for name, kind in kinds.items()}
    mixed = changed("actors", **written).model_copy(update={"storyboard": {}})
    alone = mixed.model_copy(update={"actors": {}})
    for scenario, actors, expected in (
        (mixed, ["car", "truck", "bus"], [["car"], ["truck"]]),
        (alone, ["car", "truck", "bus"], [["none"]]),
        (mixed, ["car"], [["car"], ["no bin"]]),
    ):
        assert codes(scenario, {"dynamic_elements": {"actors": actors}}, "actors") == expected


def test_default_edges_ascend() -> None:
    for edges in (*DEFAULT_EDGES.values(), *ASKED_EDGES.values()):
        assert list(edges) == sorted(set(edges))


# --- Feasible combinations of bins, against an even grid that shares no code with the search ------

SPEEDS = [0.0, 60.0, 100.0, 130.0]
FRICTIONS = [0.0, 0.5, 0.8, 1.2]


def bins() -> Bins:
    content: dict[str, Any] = {"ego_speed": [f"{v} km/h" for v in SPEEDS], "friction": FRICTIONS}
    every = bins_of(Attributes(), CoverageBins.model_validate(content))
    return {name: every[name] for name in content}


def limited(scenario: LogicalScenario, *constraints: str) -> LogicalScenario:
    content = scenario.model_dump(mode="json")
    return LogicalScenario.model_validate({**content, "constraints": list(constraints)}, context=SI)


@pytest.mark.parametrize(
    ("constraint", "holds"),
    [
        ("ego_speed >= 0 km/h", lambda v, _: v >= 0),
        ("ego_speed <= 90 km/h or friction >= 0.6", lambda v, f: (v <= 90) | (f >= 0.6)),
        ("ego_speed / 100 km/h <= friction", lambda v, f: v / 100 <= f),
        ("ego_speed > 129.9 km/h or friction > 0.81", lambda v, f: (v > 129.9) | (f > 0.81)),
    ],
)
def test_feasible_pairs_are_those_that_a_fine_grid_has(constraint: str, holds: Any) -> None:
    scenario = limited(cut_in(), constraint)
    # The cut-in has ego_speed from 20 to 130 km/h and friction from 0.3 to 1.
    speed, friction = np.meshgrid(np.linspace(20, 130, 2201), np.linspace(0.3, 1.0, 141))
    at = np.searchsorted(SPEEDS, speed, side="right") - 1
    of = np.searchsorted(FRICTIONS, friction + 1e-12, side="right") - 1
    inside = holds(speed, friction)
    pairs = np.unique(np.minimum([at[inside], of[inside]], 2), axis=1).T.tolist()
    expected = {(("ego_speed", "friction"), tuple(pair)) for pair in pairs}
    assert Witnesses([scenario], bins(), 2).found == expected


def test_no_point_that_fulfils_the_constraints_means_nothing_is_feasible() -> None:
    scenario = limited(cut_in(), "friction > 2")
    assert Witnesses([scenario], bins(), 1).found == set()


def test_scenarios_add_up() -> None:
    slow = limited(cut_in(), "ego_speed < 50 km/h")
    fast = limited(cut_in(), "ego_speed > 110 km/h")
    both = Witnesses([slow, fast], bins(), 2).found
    assert both == Witnesses([slow], bins(), 2).found | Witnesses([fast], bins(), 2).found


def test_combination_with_a_missing_bin_counts_nowhere() -> None:
    codes = {"a": np.array([0, 0, -1]), "b": np.array([1, 1, 1]), "c": np.array([-1, 0, 0])}
    counted = {(("a", "b"), (0, 1)): 2, (("a", "c"), (0, 0)): 1, (("b", "c"), (1, 0)): 2}
    assert tuples_of(codes, 2) == counted


def test_attribute_with_several_values_counts_for_each_of_them() -> None:
    codes, a, b = {"a": np.array([0, 1]), "b": np.array([[0, 0], [2, -1]])}, ("a",), ("b",)
    assert tuples_of(codes, 1) == {(a, (0,)): 1, (a, (1,)): 1, (b, (0,)): 2, (b, (2,)): 1}
    pairs = {((*a, *b), bins): 1 for bins in ((0, 0), (0, 2), (1, 0))}
    assert tuples_of(codes, 2) == pairs
