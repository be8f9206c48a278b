"""Covering designs against a counter that shares no code with them: brute force over points."""

import itertools
import math
from collections.abc import Callable, Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.errors import SourceLocation, SweepError
from adeye.spec.expression import parse
from adeye.sweep.axes import Axis
from adeye.sweep.covering import covering
from adeye.sweep.design import Points, Relation, Space
from tests.refusals import refused

Row = tuple[int, ...]

WHERE = SourceLocation("odd.yaml", 9, 7)


def axes_of(sizes: Sequence[int]) -> list[Axis]:
    made = []
    for number, size in enumerate(sizes):
        levels = tuple(float(level) for level in range(size))
        made.append(Axis(f"a{number}", "parameter", (), levels, levels, WHERE))
    return made


def covered(sizes: Sequence[int], strength: int, *relations: str) -> Points:
    wanted = [Relation(parse(text), WHERE) for text in relations]
    return covering(Space(axes_of(sizes), wanted, {"limit": 1.0}, WHERE), strength)


def rows_of(points: Points, sizes: Sequence[int]) -> list[Row]:
    columns = [points.columns[f"a{k}"].astype(int).tolist() for k in range(len(sizes))]
    return list(zip(*columns, strict=True))


def tuples_of(rows: list[Row], strength: int) -> set[tuple[Row, Row]]:
    """Collect every combination of levels that occurs in some row, with the axes it is of."""
    return {
        (chosen, tuple(row[axis] for axis in chosen))
        for row in rows
        for chosen in itertools.combinations(range(len(row)), strength)
    }


def feasible_rows(sizes: Sequence[int], holds: Callable[[Row], bool]) -> list[Row]:
    return [row for row in itertools.product(*map(range, sizes)) if holds(row)]


# --- laws -----------------------------------------------------------------------------------------

Term = tuple[int, int, int, int]


def written(term: Term) -> str:
    first, second, kind, number = term
    return (
        f"a{first} + a{second} > {number}",
        f"a{first} != a{second} or a{first} == {number}",
        f"not (a{first} == {number} and a{second} >= 1)",
        f"a{first} <= a{second} + {number}",
    )[kind]


def true_of(term: Term, row: Row) -> bool:
    """Say the same in Python, which the expression language has no part in."""
    first, second, kind, number = term
    a, b = row[first], row[second]
    return (
        a + b > number,
        a != b or a == number,
        not (a == number and b >= 1),
        a <= b + number,
    )[kind]


@st.composite
def models(draw: st.DrawFn) -> tuple[list[int], int, list[Term]]:
    sizes = draw(st.lists(st.integers(1, 4), min_size=2, max_size=6))
    strength = draw(st.integers(1, min(3, len(sizes))))
    axis = st.integers(0, len(sizes) - 1)
    terms = draw(st.lists(st.tuples(axis, axis, st.integers(0, 3), st.integers(0, 2)), max_size=5))
    return sizes, strength, terms


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(model=models())
def test_every_feasible_tuple_is_covered_by_feasible_points(
    model: tuple[list[int], int, list[Term]],
) -> None:
    sizes, strength, terms = model
    allowed = feasible_rows(sizes, lambda row: all(true_of(term, row) for term in terms))
    texts = [written(term) for term in terms]
    if not allowed:
        refused(SweepError, covered, sizes, strength, *texts, says="none of")
        return
    points = covered(sizes, strength, *texts)
    rows = rows_of(points, sizes)
    assert set(rows) <= set(allowed)
    wanted = tuples_of(allowed, strength)
    assert tuples_of(rows, strength) == wanted
    assert points.tuples is not None
    every = tuples_of(list(itertools.product(*map(range, sizes))), strength)
    assert (points.tuples.feasible, points.tuples.total) == (len(wanted), len(every))
    assert points.raw == math.prod(sizes)


@pytest.mark.slow
def test_same_axes_give_the_same_points_and_every_one_covers_something_new() -> None:
    sizes = [3, 2, 4, 3, 2]
    for strength in (3, 2):
        rows, again = (rows_of(covered(sizes, strength), sizes) for _ in range(2))
        assert rows == again
    for number in range(1, len(rows)):
        assert not tuples_of(rows[number : number + 1], 2) <= tuples_of(rows[:number], 2)


# --- sizes that others publish --------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sizes", "strength", "most"),
    [
        ([3] * 13, 2, 19),
        ([3] * 4, 2, 10),
        ([2] * 10, 2, 9),
        ([2] * 20, 2, 12),
        ([5, 4, 3, 2, 2, 2], 2, 23),
        ([2] * 6, 3, 16),
        ([4, 3, 2], 3, 24),
    ],
)
def test_design_is_small_and_complete(sizes: list[int], strength: int, most: int) -> None:
    points = covered(sizes, strength)
    assert points.count <= most
    # Without relations every combination is feasible, so that their number is a product.
    expected = sum(
        math.prod(sizes[axis] for axis in chosen)
        for chosen in itertools.combinations(range(len(sizes)), strength)
    )
    assert len(tuples_of(rows_of(points, sizes), strength)) == expected


def test_full_strength_is_the_full_factorial() -> None:
    sizes = [2, 3, 2]
    assert sorted(rows_of(covered(sizes, 3), sizes)) == feasible_rows(sizes, lambda _: True)


# --- relations ------------------------------------------------------------------------------------


def test_tuple_that_only_several_relations_exclude_together_is_infeasible() -> None:
    # a0 < a1 < a2 of three levels each leaves one point; no relation alone names a0 and a2.
    points = covered([3, 3, 3], 2, "a0 < a1", "a1 < a2")
    assert rows_of(points, [3, 3, 3]) == [(0, 1, 2)]
    assert points.tuples is not None
    assert (points.tuples.feasible, points.tuples.total) == (3, 27)


@pytest.mark.slow
def test_long_chain_of_relations_is_decided_exactly() -> None:
    sizes = [3] * 9
    texts = [f"a{k} <= a{k + 1}" for k in range(8)]
    points = covered(sizes, 2, *texts)
    rows = rows_of(points, sizes)
    assert all(list(row) == sorted(row) for row in rows)
    # Of a non-decreasing row two axes are (x, y) with x <= y: six of nine.
    assert len(tuples_of(rows, 2)) == 6 * math.comb(9, 2)


@pytest.mark.slow
def test_component_with_too_many_solutions_to_list_is_searched() -> None:
    sizes = [3] * 9
    texts = [f"a{k} != a{k + 1}" for k in range(8)]
    rows = rows_of(covered(sizes, 2, *texts), sizes)
    assert all(a != b for row in rows for a, b in itertools.pairwise(row))
    # Neighbours have 6 pairs, all others 9.
    assert len(tuples_of(rows, 2)) == 8 * 6 + (math.comb(9, 2) - 8) * 9


def test_relation_may_name_what_does_not_vary() -> None:
    assert {row[0] for row in rows_of(covered([3, 2], 2, "a0 <= limit"), [3, 2])} == {0, 1}
    with pytest.raises(SweepError, match="none of 6 combinations fulfils limit > 1"):
        covered([3, 2], 2, "limit > 1")


def test_design_that_cannot_be_is_refused() -> None:
    for sizes, strength, said in (
        ([3], 2, "strength 2 takes combinations of 2 axes, and there are 1"),
        ([100] * 20, 3, "there are 1,140,000,000 combinations of 3 axes"),
    ):
        caught = refused(SweepError, covered, sizes, strength, says=said)
        assert caught.where == WHERE
        assert caught.remedy


def test_relation_of_too_many_combinations_is_refused_with_its_place() -> None:
    names = " + ".join(f"a{k}" for k in range(7))
    with pytest.raises(SweepError, match="joins 10,000,000 combinations") as caught:
        covered([10] * 7, 2, f"{names} > 3")
    assert caught.value.where == WHERE
