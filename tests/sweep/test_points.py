"""Points of a scenario: the design is followed and relations are checked before they are used."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from adeye.errors import SweepError
from adeye.sweep.points import read_points

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
