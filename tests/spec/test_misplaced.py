"""Errors of a record's validator keep the place that they are about."""

from __future__ import annotations

from typing import Self

import pytest
from pydantic import BaseModel, ValidationError, model_validator

from adeye.spec.document import misplaced, repeated


class Inner(BaseModel):
    """Refuses negative numbers, each at its place."""

    numbers: list[int]

    @model_validator(mode="after")
    def _positive(self) -> Self:
        found = [(("numbers", k), f"{{{n}}} is low") for k, n in enumerate(self.numbers) if n < 0]
        if found:
            raise misplaced(found)
        return self


class Outer(BaseModel):
    """Holds inner records."""

    inner: dict[str, Inner]


def test_places_are_below_the_place_of_the_record() -> None:
    with pytest.raises(ValidationError) as caught:
        Outer.model_validate({"inner": {"a": {"numbers": [1, -2, -3]}, "b": {"numbers": [-4]}}})
    found = [(item["loc"], item["msg"]) for item in caught.value.errors()]
    assert found == [
        (("inner", "a", "numbers", 1), "{-2} is low"),
        (("inner", "a", "numbers", 2), "{-3} is low"),
        (("inner", "b", "numbers", 0), "{-4} is low"),
    ]


def test_what_is_right_is_not_refused() -> None:
    assert Outer.model_validate({"inner": {"a": {"numbers": [1]}}}).inner["a"].numbers == [1]


@pytest.mark.parametrize(
    ("names", "again"),
    [([], []), (["a"], []), (["a", "a", "a"], [1, 2]), (["a", "b", "b", "a"], [2, 3])],
)
def test_repeated_names_every_occurrence_but_the_first(names: list[str], again: list[int]) -> None:
    assert repeated(names) == again
