"""Points of a scenario: the design is followed and relations are checked before they are used."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from adeye.errors import ExpressionError, SweepError
from adeye.sweep.expand import read_points

if TYPE_CHECKING:
    from adeye.spec.load import OddFiles

Load = Callable[..., "OddFiles"]


def test_axes_are_in_the_order_of_the_file(load: Load) -> None:
    sweep = {"parameters": {"rain": ["0 mm/h"], "gap": ["30 m", "40 m"]}}
    axes, points = read_points(load(sweep), 0)
    assert {axis.name for axis in axes} == {"rain", "gap"}
    assert points.columns["gap"].tolist() == [30.0, 40.0]


def test_scenario_without_a_sweep_has_one_point(load: Load) -> None:
    axes, points = read_points(load({}), 0)
    assert axes == ()
    assert (points.raw, points.count) == (1, 1)


def test_fixed_values_replace_the_defaults_in_relations(load: Load) -> None:
    sweep = {
        "parameters": {"gap": ["30 m", "50 m"]},
        "where": ["gap > cutter_acceleration * 5 s * 3 s"],
    }
    use = {"parameters": {"cutter_acceleration": "3 m/s^2"}}
    assert read_points(load(sweep), 0)[1].count == 2
    _, points = read_points(load(sweep, use=use), 0)
    assert points.columns["gap"].tolist() == [50.0]


def test_relation_may_name_an_axis_by_path(load: Load) -> None:
    axis = "architecture.sensors.front_camera.range"
    sweep = {"parameters": {axis: ["80 m", "120 m"], "gap": ["30 m"]}, "where": [f"{axis} > 100 m"]}
    _, points = read_points(load(sweep), 0)
    assert points.columns[axis].tolist() == [120.0]


@pytest.mark.parametrize(
    ("relation", "said"),
    [
        ("gap > 30", "puts a length and a plain number together"),
        ("gap > 30 s", "puts a length and a time together"),
        ("gap > ego_speed", "puts a length and a speed together"),
        ("gapp > 30 m", "Did you mean 'gap'?"),
        ("gap < 1 m", "none of 6 combinations fulfils gap < 1 m"),
    ],
)
def test_wrong_relation_is_refused_at_its_place(load: Load, relation: str, said: str) -> None:
    parameters = {"ego_speed": ["80 km/h", "120 km/h"], "gap": ["30 m", "45 m", "60 m"]}
    with pytest.raises(SweepError) as caught:
        read_points(load({"parameters": parameters, "where": [relation]}), 0)
    assert said in str(caught.value)
    assert "example.yaml:" in str(caught.value)


def test_constraint_of_the_scenario_holds_in_every_sweep(load: Load) -> None:
    sweep = {"parameters": {"ego_speed": ["20 km/h"], "relative_speed": ["-30 km/h", "-10 km/h"]}}
    _, points = read_points(load(sweep), 0)
    assert points.columns["relative_speed"].tolist() == pytest.approx([-10 / 3.6])


@pytest.mark.parametrize(
    ("points", "missing"),
    [
        ([{"gap": "30 m"}, {"ego_speed": "80 km/h"}], "point 1 has no ego_speed"),
        ([{"gap": "30 m", "ego_speed": "80 km/h"}, {"gap": "30 m"}], "point 2 has no ego_speed"),
    ],
)
def test_ragged_list_is_refused(load: Load, points: list[dict[str, Any]], missing: str) -> None:
    with pytest.raises(SweepError, match=missing):
        read_points(load({"design": "list", "points": points}), 0)


def test_list_may_repeat_a_value(load: Load) -> None:
    rows = [{"gap": "30 m", "rain": "0 mm/h"}, {"gap": "30 m", "rain": "5 mm/h"}]
    _, points = read_points(load({"design": "list", "points": rows}), 0)
    assert points.columns["gap"].tolist() == [30.0, 30.0]


def test_more_samples_than_test_cases_are_refused(load: Load) -> None:
    sweep = {"design": "random", "samples": 12, "parameters": {"gap": ["30 m", "60 m"]}}
    assert read_points(load(sweep, max_test_cases=12), 0)[1].count == 12
    with pytest.raises(SweepError, match="12 samples are above the limit of 11"):
        read_points(load(sweep, max_test_cases=11), 0)


def test_stream_of_a_random_design_is_the_scenarios_own(load: Load) -> None:
    sweep = {"design": "random", "samples": 3, "parameters": {"gap": ["30 m", "60 m"]}}
    one = read_points(load(sweep), 0)[1].columns["gap"].tolist()
    other = read_points(load(sweep, use={"as": "again"}), 0)[1].columns["gap"].tolist()
    assert one != other


@pytest.mark.parametrize(
    "sweep",
    [
        {"design": "list", "points": [{"gap": "30 m"}, {"gap": "40 m"}, {"gap": "3000 cm"}]},
        {"design": "zip", "parameters": {"gap": ["30 m", "40 m", "3000 cm"]}},
    ],
)
def test_equal_points_are_refused(load: Load, sweep: dict[str, Any]) -> None:
    with pytest.raises(SweepError, match="points 1 and 3 are the same: gap = 3000 cm"):
        read_points(load(sweep), 0)


@pytest.mark.parametrize(
    "sweep",
    [
        {"design": "list", "points": [{"gap": "30.2 m"}, {"gap": "30.1 m + 0.1 m"}]},
        {"design": "zip", "parameters": {"gap": ["30.2 m", "30.1 m + 0.1 m"]}},
    ],
)
def test_points_that_only_rounding_parts_are_refused(load: Load, sweep: dict[str, Any]) -> None:
    assert 30.2 != 30.1 + 0.1
    with pytest.raises(SweepError, match=r"points 1 and 2 are the same: gap = 30\.1 m \+ 0\.1 m"):
        read_points(load(sweep), 0)


@pytest.mark.parametrize("parameters", [{"gap": ["40 m"]}, {}])
def test_a_sample_that_is_one_point_is_refused(load: Load, parameters: dict[str, Any]) -> None:
    sweep = {"design": "random", "samples": 5, "parameters": parameters}
    with pytest.raises(SweepError, match="5 samples have 1 different points"):
        read_points(load(sweep), 0)


@pytest.mark.parametrize("design", ["full_factorial", "pairwise"])
def test_levels_that_no_point_has_are_named(load: Load, design: str) -> None:
    axes = {"gap": ["30 m", "40 m", "50 m"], "rain": ["0 mm/h", "5 mm/h"]}
    sweep = {"design": design, "parameters": axes, "where": ["gap < 50 m"]}
    assert read_points(load(sweep), 0)[1].absent == {"gap": ("50 m",)}
    assert read_points(load({"design": design, "parameters": axes}), 0)[1].absent == {}


@pytest.mark.parametrize("path", ["gap", "scenario.environment.illumination"])
def test_what_is_fixed_is_not_swept(load: Load, path: str) -> None:
    levels = ["10 m", "20 m"] if path == "gap" else ["day", "night"]
    use = {"parameters": {path: levels[0]}}
    with pytest.raises(SweepError, match=rf"{path} is fixed for this use, and {path} is swept at"):
        read_points(load({"parameters": {path: levels}}, use=use), 0)


def test_points_on_a_limit_are_points(load: Load) -> None:
    sweep = {
        "parameters": {"ego_speed": ["80 km/h", "100 km/h"], "gap": ["30 m"]},
        "where": ["ego_speed + 30 km/h <= 110 km/h"],
    }
    assert read_points(load(sweep), 0)[1].count == 1


def test_a_relation_that_divides_by_zero_is_refused(load: Load) -> None:
    sweep = {"parameters": {"gap": ["30 m", "40 m"]}, "where": ["1 m / (gap - 30 m) < 2"]}
    with pytest.raises(ExpressionError, match="divides by zero or is not finite where gap = 30"):
        read_points(load(sweep), 0)
