"""Distributions in an ODD: read with their units, their files and their places in the ODD."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from adeye.errors import InputError
from adeye.sweep.distributions import data_digests
from adeye.sweep.expand import read_points

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.spec.load import OddFiles

Load = Callable[..., "OddFiles"]


def sweep(samples: int = 20, /, **parameters: Any) -> dict[str, Any]:
    return {"design": "random", "samples": samples, "parameters": parameters}


def data(project: Path, text: str) -> None:
    (project / "odd" / "speeds.csv").write_text(text, encoding="utf-8")


def test_quantities_are_read_in_their_units(load: Load) -> None:
    law = {"normal": {"mean": "90 km/h", "sd": "1.8 km/h", "min": "72 km/h", "max": "108 km/h"}}
    axes, points = read_points(load(sweep(ego_speed=law)), 0)
    found = axes[0].law
    assert found is not None
    assert (found.centre, found.low, found.high) == pytest.approx((25.0, 20.0, 30.0))
    assert found.spread == pytest.approx(0.5)
    assert abs(points.columns["ego_speed"].mean() - 25.0) < 0.5


def test_data_file_is_read_in_its_unit_and_identified(load: Load, project: Path) -> None:
    text = "n,dv\n1,-18\n2,-36\n\n3,-27\n"
    data(project, text)
    law = {"empirical": "speeds.csv", "column": "dv", "unit": "km/h"}
    files = load(sweep(relative_speed=law, gap=["10 m", "50 m"]))
    _, points = read_points(files, 0)
    assert set(points.columns["relative_speed"].tolist()) == {-5.0, -7.5, -10.0}
    assert data_digests(files) == {"speeds.csv": hashlib.sha256(text.encode()).hexdigest()}


def test_choice_of_a_path_takes_what_a_list_would(load: Load) -> None:
    name = "scenario.environment.illumination"
    law = {"choice": {"day": 0.75, "night": 0.25}}
    axes, points = read_points(load(sweep(200, **{name: law, "gap": ["10 m", "50 m"]})), 0)
    found = points.columns[name].tolist()
    (light,) = [axis for axis in axes if axis.name == name]
    assert light.texts == ("day", "night")
    assert 120 < found.count("day") < 180


@pytest.mark.parametrize(
    ("text", "law", "said"),
    [
        ("", {"column": "dv"}, "has no column 'dv'"),
        ("n,dv\n", {"column": "dv"}, "has no values"),
        ("n,dv\n1,fast\n", {"column": "dv"}, "speeds.csv:2: 'fast' is not a finite number"),
        ("n,dv\n1,-20\n2\n", {"column": "dv"}, "speeds.csv:3: '' is not a finite number"),
        ("n,dv\n1,nan\n", {"column": "dv"}, "'nan' is not a finite number"),
        ("n,dv\n1,\uff16\uff10\n", {"column": "dv"}, "is not a finite number"),
        ("n,dv\n1,6_0\n", {"column": "dv"}, "'6_0' is not a finite number"),
        ("n,dv\n1,-20\n", {"column": "dw"}, "Allowed: n, dv."),
        ("n,dv\n1,-20\n", {"column": "dv", "unit": "kmh"}, "'kmh' is no unit"),
        ("n,dv\n1,-20\n", {"column": "dv", "unit": "m"}, "is a length, not a speed"),
        ("n,dv\n1,-20\n", {"column": "dv"}, "is a plain number, not a speed"),
        ("n,dv\n1,-90\n2,-30\n", {"column": "dv", "unit": "km/h"}, "leaves the scenario's range"),
        (None, {"column": "dv"}, "'speeds.csv' cannot be read"),
    ],
)
def test_unusable_data_is_refused_at_the_axis(
    load: Load, project: Path, text: str | None, law: dict[str, Any], said: str
) -> None:
    if text is not None:
        data(project, text)
    whole = {"empirical": "speeds.csv", **law}
    with pytest.raises(InputError) as caught:
        read_points(load(sweep(gap=["10 m", "50 m"], relative_speed=whole)), 0)
    assert said in str(caught.value)
    assert "example.yaml:" in str(caught.value)


@pytest.mark.parametrize(
    ("name", "law", "said"),
    [
        ("gap", {"normal": {"mean": "30 m", "sd": "5 m"}}, "leaves the scenario's range"),
        ("gap", {"normal": {"mean": "30 m", "sd": "0 m"}}, "of 0 m is not positive"),
        ("gap", {"normal": {"mean": "30 m", "sd": "5 s"}}, "is a time, not a length"),
        ("gap", {"lognormal": {"median": "0 m", "sigma": 0.5}}, "of 0 m is not positive"),
        ("gap", {"uniform": ["40 m", "20 m"]}, "nothing is left"),
        ("gap", {"choice": {"30 m": 0.5, "300 m": 0.5}}, "outside the scenario's range"),
        ("gap", {"choice": {"1 m": 0.5, "100 cm": 0.5}}, "a value occurs twice, as '1 m' and"),
        ("scenario.horizon", {"uniform": ["8 s", "9 s"]}, "for scenario parameters only"),
    ],
)
def test_unusable_distribution_is_refused_at_the_axis(
    load: Load, name: str, law: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError) as caught:
        read_points(load(sweep(20, **{name: law})), 0)
    assert said in str(caught.value)
    assert "example.yaml:" in str(caught.value)


def test_distribution_of_a_grid_is_refused_with_its_line(load: Load) -> None:
    grid = {"parameters": {"gap": {"uniform": ["10 m", "50 m"]}}}
    with pytest.raises(InputError, match="a distribution belongs to design: random, lhs, sobol"):
        load(grid)
