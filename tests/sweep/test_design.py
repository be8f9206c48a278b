"""Designs, and what each allows to say."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import ExpressionError, SourceLocation, SweepError
from adeye.spec.expression import parse
from adeye.sweep import design, sampling
from adeye.sweep.axes import Axis
from adeye.sweep.design import Relation, Space, design_statement, full_factorial, zipped
from adeye.sweep.sampling import random_points
from tests.refusals import refused

# --- Designs on hand-made axes: which combinations are points, in which order, and how many -------

WHERE = SourceLocation("odd.yaml", 9, 7)


def axis(name: str, *values: float | str, kind: Any = "parameter") -> Axis:
    return Axis(name, kind, (), tuple(values), tuple(values), WHERE)


def space(*axes: Axis, where: str = "", fixed: dict[str, Any] | None = None) -> Space:
    """Span a space by axes, with one relation or two that are joined by a semicolon."""
    relations = [Relation(parse(text), WHERE) for text in where.split("; ") if text]
    return Space(list(axes), relations, fixed or {}, WHERE)


def rows(points: design.Points) -> list[tuple[Any, ...]]:
    return list(zip(*(column.tolist() for column in points.columns.values()), strict=True))


# --- full factorial -------------------------------------------------------------------------------


def test_last_axis_varies_fastest() -> None:
    points = full_factorial(space(axis("a", 1.0, 2.0), axis("b", 3.0, 4.0, 5.0)))
    assert rows(points) == [(1, 3), (1, 4), (1, 5), (2, 3), (2, 4), (2, 5)]
    assert (points.raw, points.count) == (6, 6)


@given(sizes=st.lists(st.integers(1, 5), min_size=1, max_size=4))
def test_points_are_all_combinations_once(sizes: list[int]) -> None:
    axes = [axis(f"a{k}", *map(float, range(size))) for k, size in enumerate(sizes)]
    points = full_factorial(space(*axes))
    assert points.count == points.raw == math.prod(sizes) == len(set(rows(points)))


def test_relation_excludes_points_and_keeps_the_count_before() -> None:
    a, b = axis("a", 1.0, 2.0, 3.0), axis("b", 1.0, 2.0, 3.0)
    points = full_factorial(space(a, b, where="a < b"))
    assert rows(points) == [(1, 2), (1, 3), (2, 3)]
    assert (points.raw, points.count) == (9, 3)
    # A relation may name what does not vary; what varies wins over what is fixed.
    for where, fixed in (("a > limit", {"limit": 2.0}), ("a > 2", {"a": 9.0})):
        assert rows(full_factorial(space(a, where=where, fixed=fixed))) == [(3,)]


def test_without_axes_there_is_one_point() -> None:
    points = full_factorial(space(where="limit > 1", fixed={"limit": 2.0}))
    assert (points.raw, points.count, points.columns) == (1, 1, {})
    with pytest.raises(SweepError, match="none of 1 combinations fulfils limit > 3"):
        full_factorial(space(where="limit > 3", fixed={"limit": 2.0}))


def test_text_stays_text() -> None:
    points = full_factorial(space(axis("policy", "stuck", "free", kind="architecture")))
    assert points.columns["policy"].tolist() == ["stuck", "free"]
    assert points.texts("policy") == ['"stuck"', '"free"']


def test_relation_that_no_point_fulfils_or_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(SweepError, match=r"none of 2 combinations fulfils a > 5 and a < 9"):
        full_factorial(space(axis("a", 1.0, 2.0), where="a > 5; a < 9"))
    with pytest.raises(SweepError, match=r"fulfils \(a > 5 or a < 0\) and a < 9"):
        full_factorial(space(axis("a", 1.0, 2.0), where="a > 5 or a < 0; a < 9"))
    with pytest.raises(SweepError, match="names 'c', which the sweep does not have"):
        full_factorial(space(axis("a", 1.0), where="c > 5"))
    with pytest.raises(ExpressionError, match="mixes text and numbers"):
        full_factorial(space(axis("a", "x"), where="a > 5"))


def test_too_many_combinations_are_refused_without_being_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(design, "MAX_RAW_POINTS", 5)
    with pytest.raises(SweepError, match=r"6 combinations: a \(2\) × b \(3\); at most 5"):
        full_factorial(space(axis("a", 1.0, 2.0), axis("b", 1.0, 2.0, 3.0)))


def test_size_of_the_chunks_does_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    wide = space(axis("a", 1.0, 2.0, 3.0), axis("b", 1.0, 2.0, 3.0), where="a != b")
    whole = rows(full_factorial(wide))
    monkeypatch.setattr(design, "CHUNK", 2)
    assert rows(full_factorial(wide)) == whole


# --- zip ------------------------------------------------------------------------------------------


def test_zip_walks_in_step_and_drops_what_is_not_feasible() -> None:
    points = zipped(space(axis("a", 1.0, 2.0), axis("b", 5.0, 6.0)))
    assert (rows(points), points.raw) == ([(1, 5), (2, 6)], 2)
    points = zipped(space(axis("a", 1.0, 2.0), axis("b", 5.0, 1.0), where="a < b"))
    assert (rows(points), points.raw, points.count) == ([(1, 5)], 2, 1)


def test_zip_of_unequal_lengths_is_refused() -> None:
    with pytest.raises(SweepError, match=r"these have a \(1\), b \(2\)"):
        zipped(space(axis("a", 1.0), axis("b", 5.0, 1.0)))


def test_zip_without_a_feasible_point_is_refused() -> None:
    for empty in (
        space(axis("a", 1.0), where="a > 1"),
        space(where="limit > 1", fixed={"limit": 0.0}),
    ):
        refused(SweepError, zipped, empty, says="none of 1 combinations")


# --- random ---------------------------------------------------------------------------------------

AXES = [axis("a", 0.0, 10.0), axis("b", -1.0, 1.0)]


def draw(
    samples: int = 50, seed: int = 7, stream: str = "cut_in", axes: Any = AXES, where: str = ""
) -> Any:
    return random_points(space(*axes, where=where), samples, seed, stream)


def test_draws_lie_between_the_ends_and_fill_the_range() -> None:
    points = draw(400)
    a = points.columns["a"]
    assert points.count == points.raw == 400
    assert (a > 0.0).all()
    assert (a < 10.0).all()
    assert abs(float(a.mean()) - 5.0) < 5.0 * 10.0 / math.sqrt(12.0 * 400)
    assert a.min() < 0.5
    assert a.max() > 9.5


def test_more_samples_begin_with_the_same_points() -> None:
    assert rows(draw(80))[:50] == rows(draw(50))


def test_seed_and_stream_decide_the_points() -> None:
    assert rows(draw()) == rows(draw())
    assert rows(draw()) != rows(draw(seed=8))
    assert rows(draw()) != rows(draw(stream="cut_out"))


def test_another_axis_leaves_the_draws_of_the_first() -> None:
    alone = draw(axes=AXES[:1]).columns["a"]
    assert alone.tolist() == draw().columns["a"].tolist()


def test_feasible_draws_are_those_of_the_free_design() -> None:
    free = rows(draw(200))
    kept = rows(draw(20, where="a > 5 and b < 0"))
    assert kept == [(a, b) for a, b in free if a > 5 and b < 0][:20]


def test_size_of_the_random_chunks_does_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = rows(draw(30, where="a > 5"))
    monkeypatch.setattr(sampling, "DRAWS", 7)
    assert rows(draw(30, where="a > 5")) == whole


def test_values_are_written_so_that_they_read_back() -> None:
    points = draw(20)
    assert [float(text) for text in points.texts("a")] == points.columns["a"].tolist()


def test_texts_of_many_levels_are_those_of_few(monkeypatch: pytest.MonkeyPatch) -> None:
    points = draw(20)
    few = points.texts("a", slice(3, 9))
    monkeypatch.setattr(design, "MOST_TEXTS", 5)
    assert points.texts("a", slice(3, 9)) == few == points.texts("a")[3:9]


def test_a_million_points_take_a_few_bytes_each() -> None:
    axes = [axis(f"a{k}", *map(float, range(10))) for k in range(6)]
    points = full_factorial(space(*axes))
    assert points.count == 1_000_000
    assert sum(level.nbytes for level in points.levels.values()) == 6_000_000


def test_infeasible_random_design_is_refused_and_given_up_early(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    refused(SweepError, draw, 5, where="a > 10", says="only 0 of 5,000 draws fulfil a > 10")
    monkeypatch.setattr(sampling, "HOPELESS", 10_000)
    refused(SweepError, draw, 100_000, where="a > 10", says="only 0 of 12,288 draws")


def test_random_draws_parameters_only() -> None:
    with pytest.raises(SweepError, match="draws scenario parameters only"):
        draw(axes=[axis("architecture.cost", 1.0, 2.0, kind="architecture")])


def test_levels_of_a_point_are_of_one_type() -> None:
    assert full_factorial(space(axis("a", 1.0, 2.0))).columns["a"].dtype == np.float64


# --- What a design lets one say: a population for independent draws, none for chosen points -------


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
    told = "lognormal with median 30 m and sigma 0.5, not above 90 m"
    assert found.distributions == {"gap": told}


def test_scenario_is_found_under_its_other_id() -> None:
    odd = stored(RANDOM)
    odd["odd"]["scenarios"][0]["as"] = "again"
    odd["scenarios"]["again"] = {}
    assert design_statement(odd, "again").kind == "random"
    refused(KeyError, design_statement, odd, "cut_in")
