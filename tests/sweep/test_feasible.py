"""What can be completed to a whole point: by hand, and where relations hang together."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
import pytest

from adeye.errors import SourceLocation, SweepError
from adeye.spec.expression import parse
from adeye.sweep import covering as feasible
from adeye.sweep.axes import Axis
from adeye.sweep.covering import FREE, Feasibility
from adeye.sweep.design import Relation

if TYPE_CHECKING:
    from collections.abc import Sequence

WHERE = SourceLocation("odd.yaml", 9, 7)


def feasibility(sizes: Sequence[int], *relations: str) -> Feasibility:
    axes = []
    for number, size in enumerate(sizes):
        levels = tuple(float(level) for level in range(size))
        axes.append(Axis(f"a{number}", "parameter", (), levels, levels, WHERE))
    return Feasibility(axes, [Relation(parse(text), WHERE) for text in relations], {}, WHERE)


def test_without_relations_everything_is_feasible() -> None:
    found = feasibility([2, 3])
    assert found.completes(np.array([1, FREE]))
    assert found.levels(np.array([FREE, 2]), 0).all()
    assert found.tuples([0, 1]).all()


def test_level_that_no_level_of_another_axis_fits_is_excluded() -> None:
    found = feasibility([3, 3], "a0 < a1")
    assert found.levels(np.array([FREE, FREE]), 0).tolist() == [True, True, False]
    assert found.levels(np.array([1, FREE]), 1).tolist() == [False, False, True]


@pytest.mark.parametrize("most", [0, 2_000])
def test_search_and_list_of_solutions_agree_with_brute_force(
    monkeypatch: pytest.MonkeyPatch, most: int
) -> None:
    monkeypatch.setattr(feasible, "MAX_SOLUTIONS", most)
    sizes = [3, 2, 4, 3]
    found = feasibility(sizes, "a0 + a1 > 0", "a1 != a2", "a0 + a1 + a2 < 5")
    rows = [
        row
        for row in itertools.product(*map(range, sizes))
        if row[0] + row[1] > 0 and row[1] != row[2] and sum(row[:3]) < 5
    ]
    for partial in itertools.product(*(range(-1, size) for size in sizes)):
        fits = any(
            all(want in {FREE, have} for want, have in zip(partial, row, strict=True))
            for row in rows
        )
        assert found.completes(np.array(partial)) == fits, partial


def test_relations_that_exclude_each_other_are_refused() -> None:
    with pytest.raises(SweepError, match="none of 9 combinations fulfils a0 < a1 and a1 < a0"):
        feasibility([3, 3], "a0 < a1", "a1 < a0")


def test_question_that_takes_too_long_is_refused_and_not_guessed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(feasible, "MAX_STEPS", 50)
    # Five pigeons in four holes: no relation alone sees it.
    texts = [f"a{j} != a{k}" for j, k in itertools.combinations(range(5), 2)]
    with pytest.raises(SweepError, match="10 relations tie 5 axes together") as caught:
        feasibility([4] * 5, *texts)
    assert caught.value.where == WHERE
