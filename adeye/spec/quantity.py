"""Field types of the spec models: quantities with units and formulas over parameters.

A quantity is text with a unit (``60 km/h``) that becomes an SI float at the boundary. A formula is
text in the expression language over the parameters of its scenario (``ego_speed - 10 km/h``); it
stays an expression until a batch of test cases is compiled.
"""

from __future__ import annotations

import marshal
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import date
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Final, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    PlainSerializer,
    PlainValidator,
    SerializerFunctionWrapHandler,
    Strict,
    StringConstraints,
    ValidationInfo,
    WithJsonSchema,
    model_serializer,
)

from adeye.errors import ExpressionError, InputError
from adeye.identity import canonical
from adeye.spec.expression import Expression, parse
from adeye.units import Dimension, parse_quantity, shown

IDENTIFIER: Final = r"^[a-z][a-z0-9_]*$"
REFERENCE: Final = r"^[A-Za-z][A-Za-z0-9_.-]*$"
TARGET: Final = (
    r"^((sensors|channels|hooks|actuators)\.[a-z][a-z0-9_]*"
    r"|links\.[a-z][a-z0-9_]*\.((channels|health)\.)?[a-z][a-z0-9_]*|tyres|switch)$"
)
PLUGIN: Final = r"^.+:[A-Za-z_][A-Za-z0-9_]*$"
FMU: Final = r"^\./.+\.fmu$"
CHOICE: Final = r"^(all|first [1-9][0-9]{0,6}|sample [1-9][0-9]{0,6} seed [0-9]{1,9})$"
LINE: Final = r"^[^\p{C}\p{Zl}\p{Zp}]*[\p{L}\p{N}][^\p{C}\p{Zl}\p{Zp}]*$"
_DATE: Final = r"[0-9]{4}-[0-9]{2}-[0-9]{2}"
PATTERNS: Final = {
    IDENTIFIER: "must be lower case letters, digits and underscores after a letter",
    REFERENCE: "must be letters, digits, points, hyphens and underscores after a letter",
    TARGET: (
        "must be sensors.<id>, channels.<id>, hooks.<channel>, links.<channel>.<link>, "
        "actuators.<drive, brake or steering>, tyres or switch"
    ),
    PLUGIN: "must be module:Class or ./file.py:Class",
    LINE: "must be one line with a letter or a digit in it",
    FMU: "must be ./file.fmu, a path relative to this file",
    CHOICE: "must be all, first N or sample N seed K, of the places of a map",
}
"""What each pattern of a text asks for, in words."""

Identifier = Annotated[str, StringConstraints(pattern=IDENTIFIER, max_length=64)]
"""A name that users refer to: lower case letters, digits and underscores."""

Reference = Annotated[str, StringConstraints(pattern=REFERENCE, max_length=64)]
"""An id that people gave, such as ``FSR-01``."""


def _require_word(text: str) -> str:
    """Refuse text that says nothing: blanks, marks and what has no width."""
    if not any(letter.isalnum() for letter in text):
        raise ValueError("says nothing. Write words")
    return text


Text = Annotated[
    str, StringConstraints(min_length=1, max_length=4000), AfterValidator(_require_word)
]


Tags = dict[Identifier, Text]
"""What people want to find something by, in names and words of their own. No run, no verdict and no
digest of either depends on it."""


class Record(BaseModel):
    """Base of every spec model: frozen, unknown keys are errors, no silent conversions."""

    model_config = ConfigDict(
        defer_build=True, frozen=True, extra="forbid", strict=True, arbitrary_types_allowed=True
    )


class GrownRecord(Record):
    """Base of a record that got keys later; where they are not used they are no part of it."""

    later: ClassVar[tuple[str, ...]] = ()
    """Keys that came later; they are not used where they have their defaults."""

    @model_serializer(mode="wrap")
    def _leave_out_unused(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what came later where it is not used, for it is no part of the identity."""
        content: dict[str, Any] = write(self)
        fields = type(self).model_fields
        for name in self.later:
            if getattr(self, name) == fields[name].get_default(call_default_factory=True):
                content.pop(name, None)
        return content


class SparseRecord(Record):
    """Base of a record that is written without the keys that it does not use."""

    @model_serializer(mode="wrap")
    def _leave_out_unused(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        content: dict[str, Any] = write(self)
        return {name: value for name, value in content.items() if value is not None}


SI: dict[str, bool] = {"si": True}
"""Validation context of stored content: numbers are in SI already."""


def quantity_reader(dimension: Dimension) -> Callable[[Any, ValidationInfo], float]:
    """Return the validator that reads a quantity of a dimension; stored numbers are in SI."""

    def read(value: Any, info: ValidationInfo) -> float:
        stored = info.context is not None and info.context.get("si", False)
        if stored and isinstance(value, int | float) and not isinstance(value, bool):
            return float(value) + 0.0
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise ValueError(f"{value!r} is not a quantity")
        try:
            return parse_quantity(value, dimension)
        except InputError as error:
            raise ValueError(str(error)) from error

    return read


@dataclass(frozen=True, slots=True)
class Measures:
    """Says in the type of a quantity what it measures."""

    dimension: Dimension


def _quantity(dimension: Dimension, example: str) -> Any:
    schema = {"type": ["string", "number"], "examples": [example]}
    reader = BeforeValidator(quantity_reader(dimension))
    return Annotated[float, reader, WithJsonSchema(schema), Measures(dimension)]


Length = _quantity(Dimension.LENGTH, "15 m")
Duration = _quantity(Dimension.TIME, "0.1 s")
Speed = _quantity(Dimension.SPEED, "60 km/h")
Acceleration = _quantity(Dimension.ACCELERATION, "4 m/s^2")
Jerk = _quantity(Dimension.JERK, "12 m/s^3")
Angle = _quantity(Dimension.ANGLE, "-3 deg")
AngularRate = _quantity(Dimension.ANGULAR_RATE, "20 deg/s")
Frequency = _quantity(Dimension.FREQUENCY, "20 Hz")
RainRate = _quantity(Dimension.RAIN_RATE, "7.5 mm/h")
Number = _quantity(Dimension.NONE, "0.5")


def _read_date(value: Any) -> Any:
    """Refuse what pydantic would take for seconds since 1970."""
    if isinstance(value, date) or (isinstance(value, str) and re.fullmatch(_DATE, value)):
        return value
    raise ValueError(f"{shown(value)} is not a date, like 2027-12-31")


Date = Annotated[date, Strict(strict=False), BeforeValidator(_read_date)]
"""A day, as ISO 8601 writes it."""


def require_dimension(
    expression: Expression, required: Dimension, names: Mapping[str, Dimension | None]
) -> None:
    """Refuse an expression whose dimension is not the required one.

    Args:
        expression: What the user wrote.
        required: The dimension that the field needs.
        names: Dimension of each name that it may use.

    Raises:
        ExpressionError: The dimensions differ; the message names both.
    """
    found = expression.dimension(names)
    if found is not None and found.exponents != required.exponents:
        raise ExpressionError(
            f"'{expression.text}' is {found.label}, not {required.label}",
            remedy=f"Give it a unit of {required.label}.",
        )


_AsText: Final = PlainSerializer(lambda expression: expression.text, return_type=str)


def _formula(dimension: Dimension, example: str) -> Any:
    """Make the type of text or a number that is an expression, which must have one dimension."""

    def read(value: Any) -> Expression:
        if isinstance(value, Expression):
            return value
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise ValueError(f"{value!r} is neither a quantity nor a formula")
        try:
            expression = parse(str(value))
            if expression.is_constant:
                require_dimension(expression, dimension, {})
        except InputError as error:
            raise ValueError(str(error)) from error
        return expression

    schema = {"type": ["string", "number"], "examples": [example]}
    return Annotated[
        Expression, PlainValidator(read), _AsText, WithJsonSchema(schema), Measures(dimension)
    ]


LengthFormula = _formula(Dimension.LENGTH, "ego_gap + 5 m")
DurationFormula = _formula(Dimension.TIME, "2 s")
SpeedFormula = _formula(Dimension.SPEED, "ego_speed - 10 km/h")
AccelerationFormula = _formula(Dimension.ACCELERATION, "6 m/s^2")
JerkFormula = _formula(Dimension.JERK, "12 m/s^3")
AngleFormula = _formula(Dimension.ANGLE, "90 deg")
RainFormula = _formula(Dimension.RAIN_RATE, "rain")
NumberFormula = _formula(Dimension.NONE, "1")


def _read_expression(value: Any) -> Expression:
    if isinstance(value, Expression):
        return value
    if not isinstance(value, str):
        raise ValueError(f"{value!r} is not an expression")
    try:
        expression = parse(value)
    except InputError as error:
        raise ValueError(str(error)) from error
    if not expression.is_truth:
        msg = f"{shown(value)} is neither true nor false. Compare it with something, as in 'a > b'"
        raise ValueError(msg)
    return expression


Condition = Annotated[
    Expression,
    BeforeValidator(_read_expression),
    _AsText,
    WithJsonSchema({"type": "string", "examples": ["time >= 2 s"]}),
]
"""A truth-valued expression: a trigger, a constraint, a fault's onset."""

Free = Annotated[dict[str, Any], AfterValidator(canonical)]
"""What code from outside is told, as that may be: no more than what its identity holds."""

T = TypeVar("T")

Many = Annotated[tuple[T, ...], Strict(strict=False)]
"""A list in YAML, a tuple in the frozen record."""

Pair = Annotated[tuple[float, float], Strict(strict=False)]
"""Two plain numbers, a list in YAML."""


@lru_cache(maxsize=4_096)
def _one_of(packed: bytes) -> Any:
    return marshal.loads(packed)  # noqa: S302 - written by this process


def _shared(rows: tuple[tuple[float, ...], ...]) -> Any:
    """Return rows of which equal ones are one object.

    A road has thousands of numbers, and those of many places are alike. Bits tell which are equal,
    for 0.0 is not -0.0; the second format of the bytes holds values alone.
    """
    return _one_of(marshal.dumps(rows, 2))


Pairs = Annotated[Many[Pair], AfterValidator(_shared)]
"""Pairs of numbers, lists in YAML."""

Slab = Annotated[
    tuple[float, Annotated[Many[Many[float]], AfterValidator(_shared)]], Strict(strict=False)
]
"""A number and rows of numbers, lists in YAML."""


def _in_order(parts: dict[str, T]) -> dict[str, T]:
    return dict(sorted(parts.items()))


ById = Annotated[dict[Identifier, T], AfterValidator(_in_order)]
"""Named parts in the order of their names: what a file lists first must not change a run."""
