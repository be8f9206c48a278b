"""Quantities: SI values, refusals, and that what is written reads back."""

from __future__ import annotations

import math
import time
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import UnitError
from adeye.units import UNITS, Dimension, convert, format_quantity, parse_quantity, shown, units_of


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("60 km/h", Dimension.SPEED, 60 / 3.6),
        ("130 km/h", Dimension.SPEED, 130 / 3.6),
        ("25 m/s", Dimension.SPEED, 25.0),
        ("15 m", Dimension.LENGTH, 15.0),
        ("2 km", Dimension.LENGTH, 2000.0),
        ("7.5 mm/h", Dimension.RAIN_RATE, 7.5 / 3_600_000),
        ("180 deg", Dimension.ANGLE, math.pi),
        ("-3 deg", Dimension.ANGLE, -3 * math.pi / 180),
        ("0.1 rad", Dimension.ANGLE, 0.1),
        ("0.05 s", Dimension.TIME, 0.05),
        ("50 ms", Dimension.TIME, 0.05),
        ("2 min", Dimension.TIME, 120.0),
        ("0.6 /h", Dimension.FREQUENCY, 0.6 / 3600),
        ("0.6 1/h", Dimension.FREQUENCY, 0.6 / 3600),
        ("10 Hz", Dimension.FREQUENCY, 10.0),
        ("3 m/s^2", Dimension.ACCELERATION, 3.0),
        ("3 m/s2", Dimension.ACCELERATION, 3.0),
        ("3 m/s²", Dimension.ACCELERATION, 3.0),
        ("0.1 g", Dimension.ACCELERATION, 0.1 * 9.80665),
        ("12 m/s^3", Dimension.JERK, 12.0),
        ("90 deg/s", Dimension.ANGULAR_RATE, math.pi / 2),
        ("0.01 1/m", Dimension.CURVATURE, 0.01),
        ("0.01 /m", Dimension.CURVATURE, 0.01),
        ("0.5", Dimension.NONE, 0.5),
        (0.5, Dimension.NONE, 0.5),
        (3, Dimension.NONE, 3.0),
        ("1e-3 m", Dimension.LENGTH, 0.001),
        (".5 m", Dimension.LENGTH, 0.5),
        ("5. m", Dimension.LENGTH, 5.0),
        ("+5m", Dimension.LENGTH, 5.0),
        ("  60  km / h ", Dimension.SPEED, 60 / 3.6),
    ],
)
def test_quantity_becomes_si(text: str | float, dimension: Dimension, value: float) -> None:
    assert parse_quantity(text, dimension) == value


@pytest.mark.parametrize(
    ("text", "dimension"),
    [
        ("15", Dimension.LENGTH),
        (15, Dimension.LENGTH),
        (0, Dimension.LENGTH),
        ("0", Dimension.SPEED),
        (0.0, Dimension.TIME),
        ("15 s", Dimension.LENGTH),
        ("15 m", Dimension.NONE),
        ("15 M", Dimension.LENGTH),
        ("5 m in", Dimension.TIME),
        ("60 k m/h", Dimension.SPEED),
        ("5 m m", Dimension.LENGTH),
        ("m", Dimension.LENGTH),
        ("", Dimension.LENGTH),
        ("", Dimension.NONE),
        ("1,5 m", Dimension.LENGTH),
        ("1_000 m", Dimension.LENGTH),
        ("0x10 m", Dimension.LENGTH),
        ("\u0661 m", Dimension.LENGTH),
        ("1 2 m", Dimension.LENGTH),
        ("true", Dimension.NONE),
        (True, Dimension.NONE),
        (True, Dimension.LENGTH),
    ],
)
def test_what_is_no_such_quantity_is_refused(text: str | float, dimension: Dimension) -> None:
    with pytest.raises(UnitError):
        parse_quantity(text, dimension)


@pytest.mark.parametrize("value", [None, [], {}, b"1 m", 1j])
def test_another_type_is_refused(value: Any) -> None:
    with pytest.raises(UnitError, match="is not a quantity"):
        parse_quantity(value, Dimension.LENGTH)


@pytest.mark.parametrize(
    "value",
    [math.nan, math.inf, -math.inf, "1e400", "-1e400", 10**400, pytest.param(10**5000, id="long")],
)
def test_number_that_is_not_finite_is_refused(value: str | float) -> None:
    with pytest.raises(UnitError, match="not a finite number"):
        parse_quantity(value, Dimension.NONE)


def test_conversion_that_overflows_is_refused() -> None:
    with pytest.raises(UnitError, match="not a finite number"):
        parse_quantity("1e308 km", Dimension.LENGTH)


@pytest.mark.parametrize("text", ["nan m", "inf m", ".inf m", "-inf m"])
def test_words_for_what_is_not_finite_are_no_numbers(text: str) -> None:
    with pytest.raises(UnitError):
        parse_quantity(text, Dimension.LENGTH)


def test_refusal_names_the_allowed_units() -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity("60 kmh", Dimension.SPEED)
    assert str(caught.value) == (
        "UnitError: '60 kmh' is not a speed. Write a speed like '60 km/h' (units: m/s, km/h, mm/h)."
    )


def test_refusal_of_a_bare_number_shows_how_to_write_it() -> None:
    with pytest.raises(UnitError, match=r"15 has no unit\. Write a length like '15 m'"):
        parse_quantity(15, Dimension.LENGTH)


def test_hostile_text_is_refused_at_once() -> None:
    begin = time.process_time()
    for text in ("1 a" + " " * 500_000 + "b", "1" * 500_000 + "x", " " * 500_000):
        with pytest.raises(UnitError) as caught:
            parse_quantity(text, Dimension.TIME)
        assert len(str(caught.value)) < 300
    assert time.process_time() - begin < 0.2


def test_message_stays_on_one_line() -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity("5 m\n\x1b[31m", Dimension.LENGTH)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("value", "dimension", "text"),
    [
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
    ],
)
def test_quantity_is_written_in_the_unit_of_the_field(
    value: float, dimension: Dimension, text: str
) -> None:
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
