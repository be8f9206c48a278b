"""Quantities and formulas as fields of the spec models."""

import pytest
from pydantic import ValidationError

from adeye.errors import ExpressionError, SpecError
from adeye.simulate.world.clock import period_ticks, ticks
from adeye.spec.expression import parse
from adeye.spec.quantity import (
    SI,
    Condition,
    LengthFormula,
    Many,
    Pairs,
    Record,
    Speed,
    require_dimension,
)
from adeye.units import Dimension
from tests.refusals import refused


class Example(Record):
    """A record with one field of each sort."""

    speed: Speed = 0.0
    gap: LengthFormula = parse("0 m")
    when: Condition = parse("true")
    items: Many[int] = ()
    line: Pairs = ()


def test_quantity_becomes_si() -> None:
    assert Example.model_validate({"speed": "90 km/h"}).speed == pytest.approx(25.0)


def test_quantity_without_its_unit_is_refused() -> None:
    for value in ("15", "15 m", "fast", 15, 15.0, True, None, "1e999 m/s", [1]):
        refused(ValidationError, Example.model_validate, {"speed": value})


def test_stored_content_is_in_si() -> None:
    stored = Example.model_validate({"speed": "90 km/h"}).model_dump(mode="json")
    assert stored["speed"] == pytest.approx(25.0)
    assert Example.model_validate(stored, context=SI).speed == stored["speed"]


def test_formula_keeps_its_text() -> None:
    record = Example.model_validate({"gap": "2 * lead + 5 m"})
    assert record.gap.names == {"lead"}
    assert record.model_dump(mode="json")["gap"] == "2 * lead + 5 m"


def test_constant_formula_of_another_dimension_is_refused() -> None:
    for value in ("5", 5, "5 s", "5 m +", True, None):
        refused(ValidationError, Example.model_validate, {"gap": value})


def test_condition_must_be_text() -> None:
    assert Example.model_validate({"when": "time >= 2 s"}).when.names == {"time"}
    refused(ValidationError, Example.model_validate, {"when": 1})


def test_list_becomes_tuple_and_scalars_stay_strict() -> None:
    assert Example.model_validate({"items": [1, 2]}).items == (1, 2)
    refused(ValidationError, Example.model_validate, {"items": ["1"]})


def test_equal_rows_are_one_object_and_keep_their_bits() -> None:
    rows = [[1.0, -0.0], [2.0, 3.0]]
    first, second, other = (
        Example.model_validate({"line": line}).line for line in (rows, rows, [[1.0, 0.0], rows[1]])
    )
    assert first is second
    assert repr(first) == "((1.0, -0.0), (2.0, 3.0))"
    assert repr(other) == "((1.0, 0.0), (2.0, 3.0))"


def test_require_dimension_names_both() -> None:
    with pytest.raises(ExpressionError, match="a speed, not a length"):
        require_dimension(parse("v"), Dimension.LENGTH, {"v": Dimension.SPEED})
    require_dimension(parse("0"), Dimension.LENGTH, {})


def test_unknown_key_is_refused() -> None:
    refused(ValidationError, Example.model_validate, {"sped": "1 m/s"})


# --- Durations and rates in ticks of the master clock ---------------------------------------------


def test_whole_numbers_of_steps() -> None:
    assert ticks(0.15, 0.05, "latency") == 3
    assert ticks(0.0, 0.05, "latency") == 0
    assert ticks(25.0, 0.05, "horizon") == 500
    assert period_ticks(20.0, 0.05, "rate") == 1
    assert period_ticks(2.5, 0.05, "rate") == 8


def test_other_durations_name_the_nearest() -> None:
    refused(SpecError, ticks, 0.12, 0.05, "latency", says=r"latency: 0.12 s .* 0.1 s and 0.15 s")


def test_other_rates_name_the_nearest() -> None:
    for rate, nearest in ((15.0, "10 Hz and 20 Hz"), (40.0, "10 Hz and 20 Hz")):
        refused(SpecError, period_ticks, rate, 0.05, "rate", says=nearest)
