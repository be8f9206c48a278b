"""A formula must not give more time than the requirement says that detection and reaction take."""

from collections import Counter
from typing import Any

import pytest

from adeye.store.read.checking import check_plan
from adeye.store.rules import BUDGET_RULES

LATE = "always(contact implies eventually[0 s, 2 s](gap > 1))"
NESTED = "always(contact implies eventually[0 s, 1 s](eventually[0 s, 1 s](gap > 1)))"


def found(example: Any, **changes: Any) -> list[str]:
    first, *others = example.requirements
    example.requirements = (first.model_copy(update=changes), *others)
    violations = check_plan(example.record(), Counter({("new", "cut_in", True): 1}))
    return [item.detail for item in violations if item.rule == BUDGET_RULES[0].name]


@pytest.mark.parametrize(
    ("formula", "fdti", "frti", "said"),
    [
        (LATE, 0.5, 1.0, "the formula gives 2.0 s to respond, fdti and frti give 1.5 s"),
        (LATE, 1.5, None, "the formula gives 2.0 s to respond, fdti and frti give 1.5 s"),
        (LATE, None, 1.0, "the formula gives 2.0 s to respond, fdti and frti give 1.0 s"),
        (NESTED, 1.0, None, "the formula gives 2.0 s to respond, fdti and frti give 1.0 s"),
        (
            "always(contact implies (gap > 1 or eventually(gap > 1)))",
            1.0,
            None,
            "the formula gives unbounded time to respond, fdti and frti give 1.0 s",
        ),
    ],
)
def test_formula_that_gives_more_time_is_found(
    example: Any, formula: str, fdti: float | None, frti: float | None, said: str
) -> None:
    assert found(example, formula=formula, fdti=fdti, frti=frti) == [said]


@pytest.mark.parametrize(
    ("formula", "fdti", "frti"),
    [
        (LATE, 1.0, 1.0),
        (LATE, None, None),
        ("eventually[0 s, 9 s](gap > 1)", 1.0, None),
        ("always(eventually[0 s, 9 s](gap > 1) implies contact)", 1.0, None),
        ("always(contact implies always[0 s, 9 s](gap > 1))", 1.0, None),
    ],
)
def test_formula_within_the_budget_or_that_asks_for_no_response_is_not(
    example: Any, formula: str, fdti: float | None, frti: float | None
) -> None:
    assert found(example, formula=formula, fdti=fdti, frti=frti) == []
