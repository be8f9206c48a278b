"""Quantities: SI values, refusals, and that what is written reads back."""

import math
import re
import time
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye import units
from adeye.errors import AdeyeError, UnitError
from adeye.units import UNITS, Dimension, convert, format_quantity, parse_quantity, shown, units_of
from tests.frozen import assert_frozen
from tests.refusals import refused

SI: dict[Dimension, dict[str | float, float]] = {
    Dimension.SPEED: {
        "60 km/h": 60 / 3.6, "130 km/h": 130 / 3.6, "25 m/s": 25.0, "  60  km / h ": 60 / 3.6
    },
    Dimension.LENGTH: {
        "15 m": 15.0, "2 km": 2000.0, "1e-3 m": 0.001, ".5 m": 0.5, "5. m": 5.0, "+5m": 5.0
    },
    Dimension.RAIN_RATE: {"7.5 mm/h": 7.5 / 3_600_000},
    Dimension.ANGLE: {"180 deg": math.pi, "-3 deg": -3 * math.pi / 180, "0.1 rad": 0.1},
    Dimension.TIME: {"0.05 s": 0.05, "50 ms": 0.05, "2 min": 120.0},
    Dimension.FREQUENCY: {"0.6 /h": 0.6 / 3600, "0.6 1/h": 0.6 / 3600, "10 Hz": 10.0},
    Dimension.ACCELERATION: {
        **dict.fromkeys(("3 m/s^2", "3 m/s2", "3 m/s²"), 3.0), "0.1 g": 0.1 * 9.80665
    },
    Dimension.JERK: {"12 m/s^3": 12.0},
    Dimension.ANGULAR_RATE: {"90 deg/s": math.pi / 2},
    Dimension.CURVATURE: {"0.01 1/m": 0.01, "0.01 /m": 0.01},
    Dimension.NONE: {"0.5": 0.5, 0.5: 0.5, 3: 3.0},
}  # fmt: skip


def test_quantity_becomes_si() -> None:
    for dimension, quantities in SI.items():
        for text, value in quantities.items():
            assert parse_quantity(text, dimension) == value


OTHERS: dict[Dimension, list[str | float]] = {
    Dimension.LENGTH: [
        *("15", 15, 0, "15 s", "15 M", "5 m m", "m", "", "1,5 m", "1_000 m", "0x10 m"),
        *("\u0661 m", "1 2 m", True, "nan m", "inf m", ".inf m", "-inf m"),
    ],
    Dimension.SPEED: ["0", "60 k m/h"],
    Dimension.TIME: [0.0, "5 m in"],
    Dimension.NONE: ["15 m", "", "true", True],
}


def test_what_is_no_such_quantity_is_refused() -> None:
    for dimension, texts in OTHERS.items():
        for text in texts:
            refused(UnitError, parse_quantity, text, dimension)


def test_another_type_is_refused() -> None:
    other_types: list[object] = [None, [], {}, b"1 m", 1j]
    for value in other_types:
        refused(UnitError, parse_quantity, value, Dimension.LENGTH, says="is not a quantity")


@pytest.mark.parametrize(
    "value",
    [math.nan, math.inf, -math.inf, "1e400", "-1e400", 10**400, pytest.param(10**5000, id="long")],
)
def test_number_that_is_not_finite_is_refused(value: str | float) -> None:
    refused(UnitError, parse_quantity, value, Dimension.NONE, says="not a finite number")


def test_refusal_names_the_allowed_units_and_what_is_wrong() -> None:
    for value, dimension, said in (
        ("60 kmh", Dimension.SPEED, "UnitError: '60 kmh' is not a speed. "
         "Write a speed like '60 km/h' (units: m/s, km/h, mm/h)."),
        (15, Dimension.LENGTH, "15 has no unit. Write a length like '15 m'"),
        ("1e308 km", Dimension.LENGTH, "not a finite number"),
    ):  # fmt: skip
        refused(UnitError, parse_quantity, value, dimension, says=re.escape(said))


def test_hostile_text_is_refused_at_once() -> None:
    begin = time.process_time()
    for text in ("1 a" + " " * 500_000 + "b", "1" * 500_000 + "x", " " * 500_000):
        caught = refused(UnitError, parse_quantity, text, Dimension.TIME)
        assert len(str(caught)) < 300
    assert time.process_time() - begin < 0.2


def test_message_stays_on_one_line() -> None:
    caught = refused(UnitError, parse_quantity, "5 m\n\x1b[31m", Dimension.LENGTH)
    assert str(caught).isprintable()


def test_quantity_is_written_in_the_unit_of_the_field() -> None:
    for value, dimension, text in (
        (25.0, Dimension.SPEED, "90 km/h"),
        (130 / 3.6, Dimension.SPEED, "130 km/h"),
        (1.5, Dimension.LENGTH, "1.5 m"),
        (-0.0, Dimension.LENGTH, "0 m"),
        (math.pi / 2, Dimension.ANGLE, "90 deg"),
        (7.5 / 3_600_000, Dimension.RAIN_RATE, "7.5 mm/h"),
        (0.05, Dimension.TIME, "0.05 s"),
        (10.0, Dimension.FREQUENCY, "10 Hz"),
        (0.5, Dimension.FREQUENCY, "0.5 Hz"),
        (0.6 / 3600, Dimension.FREQUENCY, "0.6 /h"),
        (3.0, Dimension.ACCELERATION, "3 m/s²"),
        (0.5, Dimension.NONE, "0.5"),
        (1e15, Dimension.LENGTH, "1e+15 m"),
    ):
        assert format_quantity(value, dimension) == text


@pytest.mark.parametrize("dimension", Dimension)
@given(thousandths=st.integers(-1_000_000, 1_000_000))
def test_table_value_reads_back_exactly(dimension: Dimension, thousandths: int) -> None:
    written = f"{thousandths / 1000} {dimension.unit}".strip()
    value = parse_quantity(written, dimension)
    assert parse_quantity(format_quantity(value, dimension), dimension) == value


@given(thousandths=st.integers(0, 100_000))
def test_hourly_rate_reads_back_exactly(thousandths: int) -> None:
    value = parse_quantity(f"{thousandths / 1000} /h", Dimension.FREQUENCY)
    text = format_quantity(value, Dimension.FREQUENCY)
    assert parse_quantity(text, Dimension.FREQUENCY) == value


@given(
    value=st.floats(allow_nan=False, allow_infinity=False, width=32),
    dimension=st.sampled_from(Dimension),
)
def test_what_is_written_reads_back_to_ten_digits(value: float, dimension: Dimension) -> None:
    again = parse_quantity(format_quantity(value, dimension), dimension)
    assert again == pytest.approx(value, rel=1e-9, abs=1e-300)


@pytest.mark.slow
@given(text=st.text(max_size=30), dimension=st.sampled_from(Dimension))
def test_any_text_is_a_finite_number_or_a_unit_error(text: str, dimension: Dimension) -> None:
    try:
        value = parse_quantity(text, dimension)
    except UnitError:
        return
    assert math.isfinite(value)


@pytest.mark.parametrize("name", UNITS)
def test_every_unit_is_read_where_its_dimension_is_wanted(name: str) -> None:
    dimensions = [d for d in Dimension if d.exponents == UNITS[name].exponents]
    assert dimensions
    for dimension in dimensions:
        assert parse_quantity(f"2 {name}", dimension) == convert(2.0, UNITS[name])
        assert name in units_of(dimension)


@pytest.mark.parametrize("dimension", Dimension)
def test_example_of_every_dimension_can_be_read(dimension: Dimension) -> None:
    assert math.isfinite(parse_quantity(dimension.example, dimension))


def test_shown_is_short() -> None:
    assert shown("x" * 500) == repr("x" * 77 + "...")
    assert shown(10**500) == "a number of more than 60 digits"
    assert len(shown(list(range(500)))) == 80
    assert shown(5) == "5"


TEXTS = (
    "30 m", "-30 m", "+30 m", "30m", " 30 m ", "3e1 m", "0.03 km", "3000 cm", "30 000 mm",
    "100 km/h",
    "27.8 m/s", "60 mph", "2 s", "50 ms", "2 min", "1 h", "10 Hz", "0.6 /h", "7.5 mm/h", "3 m/s^2",
    "3 m/s²", "0.5 g", "30 deg", "0.1 rad", "5 deg/s", "12", "1.5", "1e400", "1e-400", "nan m",
    "inf m", "m", "30", "30 parsec", "30 m m", "", "\uff13\uff10 m", "1_0 m", "0x10 m", "1e308 km",
    "5 %", "1/m",
    "0.01 1/m", "-0 m", "00030 m", "30. m", ".5 m", "5 lx", "3 m/s^3", "1,5 m",
)  # fmt: skip


def asked(call: Any, *given: Any) -> str:
    try:
        answer = call(*given)
    except (AdeyeError, ValueError) as error:
        return str(error)
    return f"{answer:.12g}" if isinstance(answer, float) else str(answer)


def test_quantities_are_frozen() -> None:
    """What each text is in each dimension, what is wrong with others, and how they are written."""
    lines = []
    for text in TEXTS:
        lines.append(f"{text!r}: {asked(units.read_quantity, text)}")
        lines += [
            f"  {dimension.name}: {asked(units.parse_quantity, text, dimension)}"
            for dimension in (Dimension.LENGTH, Dimension.SPEED, Dimension.TIME, Dimension.NONE)
        ]
    for dimension in Dimension:
        lines.append(f"{dimension.name} in {units.units_of(dimension)}")
        lines.append(f"  {asked(units.si_unit, dimension.exponents)}")
        lines += [
            f"  {value!r}: {asked(units.format_quantity, value, dimension)}"
            for value in (0.0, 1.0, -2.5, 0.001, 1234.5678, 27.777777777777779, 1e-9, 1e9)
        ]
    for thing in ("x" * 79, "x" * 80, "x" * 81, "x" * 300, 5, None, ["a"] * 60, {"k": "v" * 99}):
        found = units.shown(thing)
        lines.append(f"shown, {len(found)} letters: {found[:24]} to {found[-9:]}")
    for text, number in (("0.1", 0.1), ("0.3", 0.1 + 0.2), ("1e23", 1e23), ("1" * 30, 1.0)):
        lines.append(f"{text} as {number!r}: {asked(units.is_rounded, text, number)}")
    lines += [
        f"decimal {text!r}: {asked(units.decimal, text)}"
        for text in ("1.5", "-3", "1e5", "abc", "", "\uff11", "1_0", "inf", "nan", "0x1")
    ]
    assert_frozen("quantities.txt", "\n".join([*lines, ""]))
