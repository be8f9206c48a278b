"""Quantities and formulas as fields of the spec models."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from adeye.errors import ExpressionError
from adeye.spec.expression import parse
from adeye.spec.quantity import SI, Condition, LengthFormula, Many, Record, Speed, require_dimension
from adeye.units import Dimension


class Example(Record):
    """A record with one field of each sort."""

    speed: Speed = 0.0
    gap: LengthFormula = parse("0 m")
    when: Condition = parse("true")
    items: Many[int] = ()


def test_quantity_becomes_si() -> None:
    assert Example.model_validate({"speed": "90 km/h"}).speed == pytest.approx(25.0)


@pytest.mark.parametrize("value", ["15", "15 m", "fast", 15, 15.0, True, None, "1e999 m/s", [1]])
def test_quantity_without_its_unit_is_refused(value: object) -> None:
    with pytest.raises(ValidationError):
        Example.model_validate({"speed": value})


def test_stored_content_is_in_si() -> None:
    stored = Example.model_validate({"speed": "90 km/h"}).model_dump(mode="json")
    assert stored["speed"] == pytest.approx(25.0)
    assert Example.model_validate(stored, context=SI).speed == stored["speed"]


def test_formula_keeps_its_text() -> None:
    record = Example.model_validate({"gap": "2 * lead + 5 m"})
    assert record.gap.names == {"lead"}
    assert record.model_dump(mode="json")["gap"] == "2 * lead + 5 m"


@pytest.mark.parametrize("value", ["5", 5, "5 s", "5 m +", True, None])
def test_constant_formula_of_another_dimension_is_refused(value: object) -> None:
    with pytest.raises(ValidationError):
        Example.model_validate({"gap": value})


def test_condition_must_be_text() -> None:
    assert Example.model_validate({"when": "time >= 2 s"}).when.names == {"time"}
    with pytest.raises(ValidationError):
        Example.model_validate({"when": 1})


def test_list_becomes_tuple_and_scalars_stay_strict() -> None:
    assert Example.model_validate({"items": [1, 2]}).items == (1, 2)
    with pytest.raises(ValidationError):
        Example.model_validate({"items": ["1"]})


def test_require_dimension_names_both() -> None:
    with pytest.raises(ExpressionError, match="a speed, not a length"):
        require_dimension(parse("v"), Dimension.LENGTH, {"v": Dimension.SPEED})
    require_dimension(parse("0"), Dimension.LENGTH, {})


def test_unknown_key_is_refused() -> None:
    with pytest.raises(ValidationError):
        Example.model_validate({"sped": "1 m/s"})
