"""Tokens: units are read to SI, the longest reading first."""

from __future__ import annotations

import pytest

from adeye.errors import ExpressionError, SourceLocation
from adeye.judge.stl.parser import scan


@pytest.mark.parametrize(
    ("text", "value", "exponents"),
    [
        ("2 s", 2.0, (0, 1, 0)),
        ("250ms", 0.25, (0, 1, 0)),
        ("2 min", 120.0, (0, 1, 0)),
        ("36 km/h", 10.0, (1, -1, 0)),
        ("4 m/s^2", 4.0, (1, -2, 0)),
        ("4 m/s2", 4.0, (1, -2, 0)),
        ("4 m/s²", 4.0, (1, -2, 0)),
        ("180 deg", 3.141592653589793, (0, 0, 1)),
    ],
)
def test_a_quantity_is_one_token_in_si(
    text: str, value: float, exponents: tuple[int, int, int]
) -> None:
    token, end = scan(text)
    assert (token.kind, token.text) == ("number", text)
    assert token.value == pytest.approx(value, rel=1e-15)
    assert (token.exponents, token.has_unit) == (exponents, True)
    assert (end.kind, end.text, end.span) == ("end", "", (len(text), len(text)))


@pytest.mark.parametrize("text", ["2", "2.5", ".5", "1e-3", "3."])
def test_a_bare_number_has_no_unit(text: str) -> None:
    token = scan(text)[0]
    assert (token.value, token.has_unit, token.exponents) == (float(text), False, (0, 0, 0))


def test_a_length_divided_by_a_signal_is_no_speed() -> None:
    assert [token.text for token in scan("10 m/speed")] == ["10 m", "/", "speed", ""]


def test_a_connective_after_a_number_is_no_unit() -> None:
    assert [token.text for token in scan("2 and x")] == ["2", "and", "x", ""]


def test_names_have_dots_and_symbols_are_longest_first() -> None:
    tokens = scan("channel.nominal.status!=ok<=a")
    assert [token.text for token in tokens] == ["channel.nominal.status", "!=", "ok", "<=", "a", ""]
    assert [token.kind for token in tokens[:3]] == ["word", "symbol", "word"]


@pytest.mark.parametrize(
    ("text", "column", "remedy"),
    [
        ("gap = 2", 5, "=="),
        ("a & b", 3, "and"),
        ("gap > {limit}", 7, "value"),
        ("gap # 2", 5, "Remove"),
        ("gap > 2 parsec", 9, "m, s"),
        ("gap > 1e999 m", 7, "finite"),
    ],
)
def test_what_is_not_the_language_is_refused_at_its_place(
    text: str, column: int, remedy: str
) -> None:
    where = SourceLocation("concept.yaml", 7, 3)
    with pytest.raises(ExpressionError) as caught:
        scan(text, where)
    assert f"character {column}:" in caught.value.message
    assert remedy in caught.value.remedy
    assert caught.value.where == where
