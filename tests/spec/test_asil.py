"""Decomposition of ASIL: the eight schemes, and no other."""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import get_args

import pytest

from adeye.spec.concept import (
    ASIL_ORDER,
    RequirementAsil,
    goal_of,
    own_asil,
    rank,
    scheme_text,
    schemes,
)

TABLE = {
    "D": {("C", "A"), ("B", "B"), ("D", "QM")},
    "C": {("B", "A"), ("C", "QM")},
    "B": {("A", "A"), ("B", "QM")},
    "A": {("A", "QM")},
    "QM": set(),
}
"""ISO 26262-9:2018, clause 5."""


@pytest.mark.parametrize("parent", ASIL_ORDER)
def test_schemes_are_those_of_the_table(parent: str) -> None:
    assert set(schemes(parent)) == TABLE[parent]
    assert len(schemes(parent)) == len(TABLE[parent])


def test_there_are_eight_schemes() -> None:
    assert sum(len(schemes(parent)) for parent in ASIL_ORDER) == 8


@pytest.mark.parametrize("parent", ASIL_ORDER[1:])
def test_children_sum_up_to_the_parent(parent: str) -> None:
    for pair in combinations_with_replacement(reversed(ASIL_ORDER), 2):
        assert (pair in schemes(parent)) == (sum(map(rank, pair)) == rank(parent))


def test_brackets_hold_the_goal_and_do_not_count() -> None:
    assert schemes("C(D)") == schemes("C")
    assert (own_asil("QM(D)"), goal_of("QM(D)"), goal_of("QM")) == ("QM", "D", "")
    assert scheme_text(("B(D)", "B(D)"), "D") == "B(D) + B(D)"


def test_a_requirement_has_no_more_than_its_goal() -> None:
    decomposed = [word for word in get_args(RequirementAsil) if goal_of(word)]
    assert len(decomposed) == 2 + 3 + 4 + 5
    assert all(rank(word) <= rank(goal_of(word)) for word in decomposed)


@pytest.mark.parametrize("word", ["E", "", "b", "d(D)"])
def test_unknown_asil_is_an_error(word: str) -> None:
    with pytest.raises(ValueError, match="not in"):
        rank(word)
