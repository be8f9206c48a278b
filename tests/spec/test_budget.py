"""Timing budgets of a safety goal."""

from types import SimpleNamespace
from typing import Any

from adeye.spec.concept import Budget, budgets_of


def fsr(name: str, fdti: float | None = None, frti: float | None = None, goal: str = "G") -> Any:
    return SimpleNamespace(id=name, goals=(goal,), fdti=fdti, frti=frti)


def test_fsr_with_both_parts_is_a_budget_of_its_own() -> None:
    [found] = budgets_of([fsr("A", 0.5, 0.3)], "G")
    assert found == Budget(("A",), 0.5, 0.3)
    assert (found.total, found.is_complete) == (0.8, True)


def test_largest_single_parts_are_one_budget_together() -> None:
    [found] = budgets_of(
        [fsr("A", 0.2), fsr("B", 0.5), fsr("C", frti=0.1), fsr("D", frti=0.4)], "G"
    )
    assert found == Budget(("B", "D"), 0.5, 0.4)


def test_part_that_nobody_states_is_none_and_not_zero() -> None:
    [found] = budgets_of([fsr("A", frti=0.4)], "G")
    assert found == Budget(("A",), None, 0.4)
    assert not found.is_complete


def test_other_goals_and_fsrs_without_a_budget_do_not_count() -> None:
    assert budgets_of([fsr("A"), fsr("B", 0.5, 0.5, goal="H")], "G") == []


def test_budget_as_long_as_the_ftti_does_not_exceed_it() -> None:
    budget = Budget(("A",), 0.1, 0.2)
    assert not budget.exceeds(0.3)
    assert budget.exceeds(0.29)
