"""What a design lets one say: a population for independent draws, none for chosen points."""

from __future__ import annotations

from typing import Any

import pytest

from adeye.sweep.design import design_statement


def stored(sweep: dict[str, Any], *constraints: str, name: str = "cut_in") -> dict[str, Any]:
    whole = {"parameters": {}, "points": [], "samples": None, "where": [], **sweep}
    uses = [{"use": name, "as": None, "sweep": whole}]
    return {"odd": {"scenarios": uses}, "scenarios": {name: {"constraints": list(constraints)}}}


RANDOM = {"design": "random", "samples": 10, "parameters": {"gap": ["30 m", "50 m", "20 m"]}}


def test_chosen_points_are_no_sample_of_anything() -> None:
    grid = {"design": "full_factorial", "parameters": {"gap": ["30 m", "50 m"]}}
    found = design_statement(stored(grid, "gap > 1 m"), "cut_in")
    assert not found.is_random_sample
    assert (found.distributions, found.drawn, found.excluded_share) == ({}, None, None)
    assert "no probability" in found.population


def test_axis_without_a_distribution_is_uniform_between_its_ends() -> None:
    found = design_statement(stored(RANDOM), "cut_in")
    assert found.is_random_sample
    assert not found.is_declared
    assert found.distributions == {"gap": "uniform from 20 m to 50 m"}
    assert (found.is_conditional, found.excluded_share) == (False, 0.0)


def test_relation_on_an_axis_makes_the_population_conditional() -> None:
    factors = [{"scenario": "cut_in", "drawn": 40, "kept": 10}]
    found = design_statement(stored(RANDOM, "gap > ego_speed * 1 s"), "cut_in", factors)
    assert found.is_conditional
    assert (found.drawn, found.excluded_share) == (40, 0.75)
    assert "given gap > ego_speed * 1 s, which excluded 75.0% of the draws" in found.population


def test_relation_that_names_no_axis_cuts_nothing_off() -> None:
    assert not design_statement(stored(RANDOM, "ego_speed > 1 m/s"), "cut_in").is_conditional


def test_excluded_share_that_was_not_recorded_is_unknown_and_not_zero() -> None:
    found = design_statement(stored(RANDOM, "gap > 25 m"), "cut_in", [{"scenario": "cut_in"}])
    assert found.excluded_share is None


@pytest.mark.parametrize("design", ["lhs", "sobol"])
def test_space_filling_design_is_no_independent_sample(design: str) -> None:
    found = design_statement(stored({**RANDOM, "design": design}), "cut_in")
    assert not found.is_random_sample
    assert "depend on each other" in found.population


def test_declared_distribution_is_told_as_it_was_written() -> None:
    axes = {"gap": {"lognormal": {"median": "30 m", "sigma": 0.5, "max": "90 m"}}}
    found = design_statement(stored({**RANDOM, "parameters": axes}), "cut_in")
    assert found.is_declared
    assert found.distributions == {
        "gap": "lognormal with median 30 m and sigma 0.5, not above 90 m"
    }


def test_scenario_is_found_under_its_other_id() -> None:
    odd = stored(RANDOM)
    odd["odd"]["scenarios"][0]["as"] = "again"
    odd["scenarios"]["again"] = {}
    assert design_statement(odd, "again").kind == "random"
    with pytest.raises(KeyError):
        design_statement(odd, "cut_in")
