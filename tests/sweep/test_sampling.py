"""Samples of a design, and the points that come of them."""

from typing import Any

import numpy as np
import pytest

from adeye.errors import ExpressionError, SweepError
from adeye.sweep.design import Points
from adeye.sweep.expand import read_points
from tests.refusals import refused
from tests.stored import stored
from tests.sweep.conftest import Load

TABLES = stored("sweeps")


# --- Samples: what declared distributions become, and designs that fill the space -----------------

BOX = {"gap": ["10 m", "50 m"], "ego_speed": ["80 km/h", "120 km/h"]}


def column(points: Points, name: str) -> Any:
    """Give a column of numbers; mypy cannot tell them from text."""
    return points.columns[name]


def points_of(load: Load, design: str, samples: int, parameters: Any = None, **more: Any) -> Points:
    seed = more.pop("seed", 7)
    sweep = {"design": design, "samples": samples, "parameters": parameters or BOX, **more}
    return read_points(load(sweep, seed=seed), 0)[1]


# --- independent draws ----------------------------------------------------------------------------


def test_declared_uniform_is_the_same_sample_as_the_ends(load: Load) -> None:
    declared = {name: {"uniform": ends} for name, ends in BOX.items()}
    plain, written = points_of(load, "random", 30), points_of(load, "random", 30, declared)
    for name in BOX:
        assert column(written, name).tolist() == column(plain, name).tolist()


def test_draws_follow_the_declared_distribution(load: Load) -> None:
    law = {"normal": {"mean": "30 m", "sd": "5 m", "min": "0 m", "max": "60 m"}}
    gaps = column(points_of(load, "random", 2000, {"gap": law}), "gap")
    # Four standard errors of mean and standard deviation.
    assert abs(gaps.mean() - 30.0) < 4 * 5.0 / np.sqrt(2000)
    assert abs(gaps.std() - 5.0) < 4 * 5.0 / np.sqrt(4000)


def test_another_axis_leaves_the_draws_of_this_one(load: Load) -> None:
    law = {"lognormal": {"median": "30 m", "sigma": 0.4, "max": "60 m"}}
    alone = points_of(load, "random", 20, {"gap": law})
    beside = points_of(load, "random", 20, {"ego_speed": BOX["ego_speed"], "gap": law})
    assert column(alone, "gap").tolist() == column(beside, "gap").tolist()


def test_draws_that_relations_exclude_are_counted_to_the_last_that_is_kept(load: Load) -> None:
    free = column(points_of(load, "random", 400), "gap")
    kept = points_of(load, "random", 50, where=["gap > 30 m"])
    place = np.flatnonzero(free > 30.0)[49]
    assert (kept.count, kept.drawn) == (50, place + 1)
    assert points_of(load, "random", 50).drawn == 50


def test_sample_with_repeated_points_is_refused(load: Load) -> None:
    law = {"choice": {"0 mm/h": 0.8, "5 mm/h": 0.2}}
    with pytest.raises(SweepError, match="20 samples have 2 different points") as caught:
        points_of(load, "random", 20, {"rain": law})
    assert caught.value.where is not None
    assert "varies continuously" in caught.value.remedy
    assert points_of(load, "random", 20, {"rain": law, "gap": BOX["gap"]}).count == 20


# --- points that fill the space -------------------------------------------------------------------


def test_latin_hypercube_has_one_point_in_every_layer_of_every_axis(load: Load) -> None:
    points = points_of(load, "lhs", 25)
    for name, low, high in (("gap", 10.0, 50.0), ("ego_speed", 80 / 3.6, 120 / 3.6)):
        layers = np.floor((column(points, name) - low) / (high - low) * 25).astype(int)
        assert sorted(layers.tolist()) == list(range(25))


def test_latin_hypercube_has_layers_of_equal_probability(load: Load) -> None:
    law = {"normal": {"mean": "30 m", "sd": "5 m", "min": "0 m", "max": "60 m"}}
    gaps = column(points_of(load, "lhs", 10, {"gap": law}), "gap")
    # Deciles of the standard normal distribution.
    deciles = [-1.2816, -0.8416, -0.5244, -0.2533, 0.0, 0.2533, 0.5244, 0.8416, 1.2816]
    assert sorted(np.searchsorted(deciles, (gaps - 30.0) / 5.0).tolist()) == list(range(10))


def test_sobol_points_balance_every_half_of_every_axis(load: Load) -> None:
    points = points_of(load, "sobol", 64)
    right = column(points, "gap") > 30.0
    fast = column(points, "ego_speed") > 100 / 3.6
    for a in (True, False):
        assert int((right == a).sum()) == 32
        assert [int(((right == a) & (fast == b)).sum()) for b in (True, False)] == [16, 16]


@pytest.mark.parametrize("design", ["lhs", "sobol"])
def test_points_depend_on_the_seed_and_not_on_the_order_of_the_axes(
    load: Load, design: str
) -> None:
    first, again = points_of(load, design, 16), points_of(load, design, 16)
    turned = points_of(load, design, 16, dict(reversed(BOX.items())))
    other = points_of(load, design, 16, seed=8)
    for name in BOX:
        assert column(first, name).tolist() == column(again, name).tolist()
        assert column(first, name).tolist() == column(turned, name).tolist()
        assert column(first, name).tolist() != column(other, name).tolist()


@pytest.mark.parametrize("design", ["lhs", "sobol"])
def test_excluded_points_are_left_out_and_counted_not_replaced(load: Load, design: str) -> None:
    whole = points_of(load, design, 16)
    kept = points_of(load, design, 16, where=["gap > 30 m"])
    gaps = column(whole, "gap")
    assert column(kept, "gap").tolist() == gaps[gaps > 30.0].tolist()
    assert (kept.raw, kept.count, kept.drawn) == (16, 8, 16)


def test_design_that_cannot_be_is_refused(load: Load) -> None:
    for design, samples, more, said in TABLES["design that cannot be is refused"]:
        caught = refused(SweepError, points_of, load, design, samples, **more, says=said)
        assert caught.where is not None
        assert caught.remedy


@pytest.mark.parametrize("design", ["random", "lhs", "sobol"])
def test_values_that_no_draw_knows_of_are_refused(load: Load, design: str) -> None:
    ends = {"gap": ["40 m", "60 m"]}
    for values, said in (
        (["40 m", "50 m", "60 m"], "of 3 values those between, such as 50 m, would not count"),
        ({"from": "40 m", "to": "60 m", "step": "5 m"}, "of 5 values those between, such as 45 m"),
        (["60 m", "40 m"], "60 m is above 40 m"),
        (["60 m", "4000 cm", "50 m"], "of 3 values"),
    ):
        caught = refused(SweepError, points_of, load, design, 4, {"gap": values}, says=said)
        assert caught.message.startswith(f"gap: design: {design} draws evenly between two ends")
        assert caught.where is not None
        assert caught.remedy.startswith("Write [40")
    assert points_of(load, design, 4, ends).count == 4


def test_number_of_sobol_points_that_fits_is_named(load: Load) -> None:
    caught = refused(SweepError, points_of, load, "sobol", 48)
    assert caught.remedy == "Write samples: 32 or 64."


@pytest.mark.parametrize("design", ["random", "lhs", "sobol"])
def test_a_level_of_a_choice_that_relations_forbid_is_named(load: Load, design: str) -> None:
    parameters = {"gap": ["30 m", "60 m"], "rain": {"choice": {"0 mm/h": 0.8, "5 mm/h": 0.2}}}
    assert not points_of(load, design, 64, parameters).absent
    left = points_of(load, design, 64, parameters, where=["rain < 5 mm/h"])
    assert left.absent == {"rain": ("5 mm/h",)}


# --- Points of a scenario: the design is followed and relations are checked before they are used --


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
    relations = ["gap > cutter_acceleration * 5 s * 3 s"]
    sweep = {"parameters": {"gap": ["30 m", "50 m"]}, "where": relations}
    use = {"parameters": {"cutter_acceleration": "3 m/s^2"}}
    assert read_points(load(sweep), 0)[1].count == 2
    assert read_points(load(sweep, use=use), 0)[1].columns["gap"].tolist() == [50.0]


def test_relation_may_name_an_axis_by_path(load: Load) -> None:
    axis = "architecture.sensors.front_camera.range"
    sweep = {"parameters": {axis: ["80 m", "120 m"], "gap": ["30 m"]}, "where": [f"{axis} > 100 m"]}
    _, points = read_points(load(sweep), 0)
    assert points.columns[axis].tolist() == [120.0]


@pytest.mark.parametrize(("relation", "said"), TABLES["wrong relation is refused at its place"])
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


def test_ragged_list_is_refused(load: Load) -> None:
    whole, gap, speed = {"gap": "30 m", "ego_speed": "80 km/h"}, {"gap": "30 m"}, "80 km/h"
    for points, at in (([gap, {"ego_speed": speed}], 1), ([whole, gap], 2)):
        with pytest.raises(SweepError, match=f"point {at} has no ego_speed"):
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


def test_equal_points_and_those_that_only_rounding_parts_are_refused(load: Load) -> None:
    assert 30.2 != 30.1 + 0.1
    for gaps, said in (
        (["30 m", "40 m", "3000 cm"], "1 and 3 are the same: gap = 3000 cm"),
        (["30.2 m", "30.1 m + 0.1 m"], r"1 and 2 are the same: gap = 30\.1 m \+ 0\.1 m"),
    ):
        for sweep in (
            {"design": "list", "points": [{"gap": gap} for gap in gaps]},
            {"design": "zip", "parameters": {"gap": gaps}},
        ):
            refused(SweepError, read_points, load(sweep), 0, says=f"points {said}")


def test_a_sample_that_is_one_point_is_refused(load: Load) -> None:
    for parameters in ({"gap": ["40 m"]}, {}):
        sweep = {"design": "random", "samples": 5, "parameters": parameters}
        refused(SweepError, read_points, load(sweep), 0, says="5 samples have 1 different points")


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
    axes = {"ego_speed": ["80 km/h", "100 km/h"], "gap": ["30 m"]}
    sweep = {"parameters": axes, "where": ["ego_speed + 30 km/h <= 110 km/h"]}
    assert read_points(load(sweep), 0)[1].count == 1


def test_a_relation_that_divides_by_zero_is_refused(load: Load) -> None:
    sweep = {"parameters": {"gap": ["30 m", "40 m"]}, "where": ["1 m / (gap - 30 m) < 2"]}
    with pytest.raises(ExpressionError, match="divides by zero or is not finite where gap = 30"):
        read_points(load(sweep), 0)
