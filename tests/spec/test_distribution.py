"""Distributions as a sweep writes them: one kind each, complete, and written without the rest."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.odd import Distribution


@pytest.mark.parametrize(
    "content",
    [
        {"uniform": ["1 m", "2 m"]},
        {"normal": {"mean": "1 m", "sd": "2 m", "min": "0 m"}},
        {"lognormal": {"median": "1 m", "sigma": 0.5}},
        {"empirical": "gaps.csv", "column": "gap", "unit": "m"},
        {"choice": {"day": 0.75, "night": 0.25}},
    ],
)
def test_what_is_written_is_what_is_stored(content: dict[str, Any]) -> None:
    made = Distribution.model_validate(content)
    assert made.kind == next(iter(content))
    assert made.model_dump(mode="json") == content


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({}, "exactly one of uniform, normal, lognormal, empirical, choice, not none"),
        ({"uniform": ["1 m", "2 m"], "choice": {"1 m": 1.0}}, "not uniform, choice"),
        ({"empirical": "gaps.csv"}, "empirical and column go together"),
        ({"uniform": ["1 m", "2 m"], "unit": "m"}, "unit belongs to empirical"),
        ({"choice": {"day": 0.75, "night": 0.2}}, "the weights sum up to 0.95, not to 1"),
        ({"choice": {"day": 1.0, "night": 0.0}}, "greater than 0"),
        ({"lognormal": {"median": "1 m", "sigma": 0.0}}, "greater than 0"),
        ({"uniform": ["1 m"]}, "at least 2 items"),
    ],
)
def test_what_is_no_distribution_is_refused(content: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        Distribution.model_validate(content)
