"""Tokens of a formula: words, symbols, and numbers with their units."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from adeye.errors import ExpressionError
from adeye.units import UNITS, convert

if TYPE_CHECKING:
    from adeye.errors import SourceLocation
    from adeye.evaluation.stl.syntax import Span

KEYWORDS: Final = frozenset(
    {"always", "eventually", "until", "implies", "and", "or", "not"}
    | {"once", "historically", "since", "previous"}
    | {"abs", "min", "max", "rise", "fall"}
)
"""Words that cannot be the name of a signal."""

MAX_SHOWN: Final = 200
"""Longest formula that a message repeats whole, in characters."""

_SPACE = re.compile(r"\s+")
_NUMBER = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_WORD = re.compile(r"[^\W\d]\w*(?:\.\w+)*")
_SYMBOL = re.compile(r"[<>=!]=|[-+*/()\[\],<>]")
_UNIT = re.compile(r"\s*([^\W\d_]+(?:/[^\W\d_]+(?:[²³]|\^?\d)?)?)")
_CONNECTIVES: Final = frozenset({"and", "or", "implies", "until", "since"})
_MISTAKES: Final = {
    "=": "Write == for equality.",
    "&": "Write and.",
    "|": "Write or.",
    "!": "Write not.",
    "{": "Write a value, or a parameter's name without braces.",
}


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of the text.

    Attributes:
        kind: What it is; the last token of a text is ``end``, with empty text.
        text: As it was written.
        span: First character and the one after the last.
        value: Of a number, in SI.
        exponents: Of a number: length, time and angle.
        has_unit: Whether a number was written with a unit.
    """

    kind: Literal["number", "word", "symbol", "end"]
    text: str
    span: Span
    value: float = 0.0
    exponents: tuple[int, int, int] = (0, 0, 0)
    has_unit: bool = False


def cut(text: str) -> str:
    """Shorten a formula for a message, which gives a place in it anyway.

    >>> cut("a > 1")
    'a > 1'
    """
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 3]}..."


def scan(text: str, where: SourceLocation | None = None) -> list[Token]:
    """Split a formula into tokens.

    Raises:
        ExpressionError: A character or unit is not part of the language.
    """
    tokens: list[Token] = []
    position = 0
    while position < len(text):
        if space := _SPACE.match(text, position):
            position = space.end()
            continue
        token = _token_at(text, position, where)
        tokens.append(token)
        position = token.span[1]
    return [*tokens, Token("end", "", (len(text), len(text)))]


def _token_at(text: str, position: int, where: SourceLocation | None) -> Token:
    if number := _NUMBER.match(text, position):
        return _number(text, number, where)
    if word := _WORD.match(text, position):
        return Token("word", word.group(), word.span())
    if symbol := _SYMBOL.match(text, position):
        return Token("symbol", symbol.group(), symbol.span())
    character = text[position]
    raise ExpressionError(
        f"formula '{cut(text)}', character {position + 1}: '{character}' is not part of the "
        "language",
        where=where,
        remedy=_MISTAKES.get(character, "Remove it."),
    )


def _number(text: str, number: re.Match[str], where: SourceLocation | None) -> Token:
    unit = _UNIT.match(text, number.end())
    if unit is None or unit.group(1) in _CONNECTIVES:
        value = _finite(float(number.group()), text, number, where)
        return Token("number", number.group(), number.span(), value)
    # The longest reading first: 10 m/s is a speed, 10 m/speed a length divided by a signal.
    for word in (unit.group(1), unit.group(1).partition("/")[0]):
        end = unit.start(1) + len(word)
        known = UNITS.get(word)
        if known is not None and not re.match(r"\w", text[end : end + 1]):
            value = _finite(convert(float(number.group()), known), text, number, where)
            span = (number.start(), end)
            return Token("number", text[slice(*span)], span, value, known.exponents, has_unit=True)
    raise ExpressionError(
        f"formula '{cut(text)}', character {unit.start(1) + 1}: '{unit.group(1)}' is not a unit",
        where=where,
        remedy="Write a unit such as m, s, m/s, km/h, m/s^2, deg, or none.",
    )


def _finite(value: float, text: str, number: re.Match[str], where: SourceLocation | None) -> float:
    if not math.isfinite(value):
        raise ExpressionError(
            f"formula '{cut(text)}', character {number.start() + 1}: '{number.group()}' is too "
            "large",
            where=where,
            remedy="Write a finite number.",
        )
    return value
