"""Distributions: their quantiles, and axes made of them."""

import hashlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import InputError, SweepError
from adeye.sweep.distributions import Law, data_digests, require_mass
from adeye.sweep.expand import read_points
from tests.refusals import refused
from tests.stored import known, stored
from tests.sweep.conftest import Load

TABLES = stored("sweeps")


# --- Quantiles of declared distributions: their own laws, closed forms, and what the ends leave ---

SHARES = np.linspace(0.001, 0.999, 999)


def normal_cdf(z: float) -> float:
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


def test_uniform_quantile_is_linear() -> None:
    assert Law("uniform", 2.0, 6.0).quantile(np.array([0.25, 0.5])).tolist() == [3.0, 4.0]


@given(
    low=st.floats(-4.0, 3.0),
    width=st.floats(0.5, 6.0),
    mean=st.floats(-50, 50),
    sd=st.floats(0.1, 20),
)
def test_cut_off_normal_has_the_distribution_it_says(
    low: float, width: float, mean: float, sd: float
) -> None:
    law = Law("normal", mean + low * sd, mean + (low + width) * sd, mean, sd)
    values = law.quantile(SHARES)
    assert (np.diff(values) >= 0.0).all()
    assert (values >= law.low).all()
    assert (values <= law.high).all()
    below, above = normal_cdf(low), normal_cdf(low + width)
    for share, value in zip(SHARES[::111], values[::111], strict=True):
        reached = (normal_cdf((value - mean) / sd) - below) / (above - below)
        assert reached == pytest.approx(share, abs=1e-7)


def test_normal_is_symmetric() -> None:
    law = Law("normal", centre=10.0, spread=3.0)
    assert law.quantile(SHARES) + law.quantile(1.0 - SHARES) == pytest.approx(20.0)
    assert law.quantile(np.array([normal_cdf(1.0)])) == pytest.approx([13.0])


def test_far_tail_is_as_fine_above_the_mean_as_below() -> None:
    above = Law("normal", 6.0, 7.0).quantile(SHARES)
    below = Law("normal", -7.0, -6.0).quantile(SHARES)
    assert above == pytest.approx(-below[::-1], rel=1e-12)
    assert len(set(above.tolist())) == len(SHARES)


def test_lognormal_is_the_exponential_of_the_normal() -> None:
    law = Law("lognormal", 0.0, math.inf, math.log(30.0), 0.5)
    expected = 30.0 * np.exp(0.5 * Law("normal").quantile(SHARES))
    assert law.quantile(SHARES) == pytest.approx(expected)


def test_empirical_values_are_equally_likely() -> None:
    law = Law("empirical", 1.0, 4.0, values=np.array([1.0, 2.0, 2.0, 4.0]))
    assert law.quantile(np.array([0.1, 0.26, 0.6, 0.9])).tolist() == [1.0, 2.0, 2.0, 4.0]


def test_choice_gives_levels_as_often_as_they_weigh() -> None:
    levels = Law("choice", weights=(0.2, 0.7, 0.1)).quantile((np.arange(1000) + 0.5) / 1000)
    assert np.bincount(levels.astype(int)).tolist() == [200, 700, 100]


def test_weights_that_round_below_one_leave_no_share_without_a_level() -> None:
    law = Law("choice", weights=(1 / 3, 1 / 3, 1 / 3 - 1e-12))
    assert law.quantile(np.array([1.0 - 2.0**-53])).tolist() == [2.0]


def test_law_of_which_nothing_is_left_is_refused() -> None:
    refused(SweepError, require_mass, Law("uniform", 2.0, 2.0), says="nothing is left")
    for law in (Law("normal", 20.0, 30.0), Law("lognormal", 1e9, math.inf, 0.0, 0.5)):
        refused(SweepError, require_mass, law, says="lies between its ends")


def test_mass_is_what_lies_between_the_ends() -> None:
    assert Law("normal", -1.0, 1.0).mass() == pytest.approx(0.6826894921370859)
    assert Law("lognormal", 1.0, math.inf, 0.0, 2.0).mass() == pytest.approx(0.5)


# --- Distributions in an ODD: read with their units, their files and their places in the ODD ------


def sweep(samples: int = 20, /, **parameters: Any) -> dict[str, Any]:
    return {"design": "random", "samples": samples, "parameters": parameters}


def data(project: Path, text: str) -> None:
    (project / "odd" / "speeds.csv").write_text(text, encoding="utf-8")


def test_quantities_are_read_in_their_units(load: Load) -> None:
    law = {"normal": {"mean": "90 km/h", "sd": "1.8 km/h", "min": "72 km/h", "max": "108 km/h"}}
    axes, points = read_points(load(sweep(ego_speed=law)), 0)
    found = known(axes[0].law)
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


@pytest.mark.parametrize(("text", "law", "said"), TABLES["unusable data is refused at the axis"])
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


def test_unusable_distribution_is_refused_at_the_axis(load: Load) -> None:
    for name, law, said in TABLES["unusable distribution is refused at the axis"]:
        caught = refused(InputError, read_points, load(sweep(20, **{name: law})), 0, says=said)
        assert "example.yaml:" in str(caught)


def test_distribution_of_a_grid_is_refused_with_its_line(load: Load) -> None:
    grid = {"parameters": {"gap": {"uniform": ["10 m", "50 m"]}}}
    refused(InputError, load, grid, says="a distribution belongs to design: random, lhs, sobol")
