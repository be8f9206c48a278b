"""The grammar of the expression language: text to a flat postfix list of steps.

The list needs no recursion to be walked, so a long chain of operators is as harmless as a short
one; only brackets, calls and ``**`` nest, and their depth is capped.
"""

from __future__ import annotations

import math
import re
from typing import Final, NamedTuple

from adeye.errors import ExpressionError, suggest
from adeye.units import UNITS, convert, shown

MAX_LENGTH: Final = 2_000
MAX_DEPTH: Final = 40

Exponents = tuple[int, int, int]
"""Powers of length, time and angle."""

PLAIN: Final[Exponents] = (0, 0, 0)

FUNCTIONS: Final[dict[str, tuple[int, int]]] = {
    "abs": (1, 1),
    "min": (2, 8),
    "max": (2, 8),
    "sqrt": (1, 1),
    "floor": (1, 1),
    "ceil": (1, 1),
    "sin": (1, 1),
    "cos": (1, 1),
    "exp": (1, 1),
    "log": (1, 1),
    "clip": (3, 3),
    "if_": (3, 3),
}
"""Fewest and most arguments of every function."""

COMPARISONS: Final = ("==", "!=", "<=", ">=", "<", ">")

EVENT_FUNCTIONS: Final = ("since", "ended")
"""What may be asked of an event by its name: ``since(brake)`` is the variable ``brake.since``."""

POPS: Final[dict[str, int]] = {
    "number": 0,
    "name": 0,
    "text": 0,
    "negative": 1,
    "not": 1,
    **dict.fromkeys(("+", "-", "*", "/", "**", "and", "or", *COMPARISONS), 2),
    **{name: max(1, min(3, low)) for name, (low, _) in FUNCTIONS.items()},
    "member": 2,
    "found": 2,
}
"""How many values a step takes from the stack; each leaves one.

``min`` and ``max`` of many are steps of two. ``value in [a, b]`` is the value, a zero for "not yet
found", then for each item the item and ``member``, which notes whether the value below both equals
it, and at the end ``found``, which drops the value.
"""

KEYWORDS: Final = frozenset({"and", "or", "not", "in"})


class Step(NamedTuple):
    """One step of the postfix list.

    Attributes:
        word: ``number``, ``name``, ``text``, or an operation of ``POPS``.
        number: Value of a number in SI.
        text: The name or the text.
        exponents: Dimension of a number; None for a bare zero, which fits anything.
    """

    word: str
    number: float = 0.0
    text: str = ""
    exponents: Exponents | None = PLAIN


class _Token(NamedTuple):
    kind: str
    text: str
    at: int
    unit: str | None = None


_UNITS: Final = "|".join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))
# A unit ends where nothing follows that could belong to it; `10 m/2` divides, `10 m/sec` is a typo.
_TOKEN: Final = re.compile(
    r"(?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"
    rf"(?:\s*(?P<unit>{_UNITS})(?![A-Za-z0-9_.^²³]|/\s*[A-Za-z]))?"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z0-9_]+)*)"
    r"|(?P<text>'[^']*'|\"[^\"]*\")"
    r"|(?P<symbol>\*\*|==|!=|<=|>=|[-+*/()\[\],<>])"
)
_BLANK: Final = re.compile(r"\s*")


def read_steps(text: str) -> tuple[Step, ...]:
    """Read an expression as postfix steps.

    Args:
        text: At most 2,000 characters.

    Raises:
        ExpressionError: It does not follow the grammar; the message has the position.
    """
    if len(text) > MAX_LENGTH:
        raise ExpressionError(
            f"an expression of {len(text):,} characters, at most {MAX_LENGTH:,} are read",
            remedy="Split it.",
        )
    return _Parser(text).read()


def _tokens(text: str) -> list[_Token]:
    tokens: list[_Token] = []
    at = _skip(text, 0)
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise expression_error(text, at, f"{text[at]!r} cannot be read here")
        # The group before `unit` says what a number with a unit is.
        kind = "number" if match["number"] else str(match.lastgroup)
        tokens.append(_Token(kind, match[kind], at, match["unit"]))
        at = _skip(text, match.end())
    return tokens


def _skip(text: str, at: int) -> int:
    blank = _BLANK.match(text, at)
    return blank.end() if blank is not None else at


def expression_error(text: str, at: int, what: str, remedy: str = "") -> ExpressionError:
    """Say what is wrong at a character of an expression, counted from 0."""
    return ExpressionError(f"{shown(text)}, character {at + 1}: {what}", remedy=remedy)


class _Parser:
    """Recursive descent; every rule appends its steps after those of its operands."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = _tokens(text)
        self._at = 0
        self._depth = 0
        self._steps: list[Step] = []

    def read(self) -> tuple[Step, ...]:
        if not self._tokens:
            raise ExpressionError("an empty expression", remedy="Write a number or a formula.")
        self._either()
        if self._at < len(self._tokens):
            raise self._trailing()
        return tuple(self._steps)

    def _trailing(self) -> ExpressionError:
        token = self._tokens[self._at]
        before = self._tokens[self._at - 1]
        if before.kind == "number" and before.unit is None and token.kind == "name":
            return self._error(
                f"there is no unit {shown(token.text)}", suggest(token.text, sorted(UNITS))
            )
        return self._error("something follows the end of the expression")

    def _peek(self) -> _Token:
        if self._at < len(self._tokens):
            return self._tokens[self._at]
        return _Token("end", "", len(self._text))

    def _take(self, *words: str) -> str:
        token = self._peek()
        if token.kind in {"symbol", "name"} and token.text in words:
            self._at += 1
            return token.text
        return ""

    def _require(self, word: str) -> None:
        if not self._take(word):
            raise self._error(f"{word!r} is missing")

    def _error(self, what: str, remedy: str = "") -> ExpressionError:
        return expression_error(self._text, self._peek().at, what, remedy)

    def _emit(self, word: str) -> None:
        self._steps.append(Step(word))

    def _deeper(self) -> None:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise self._error(f"nested more than {MAX_DEPTH} deep")

    def _either(self) -> None:
        self._deeper()
        self._both()
        while self._take("or"):
            self._both()
            self._emit("or")
        self._depth -= 1

    def _both(self) -> None:
        self._negated()
        while self._take("and"):
            self._negated()
            self._emit("and")

    def _negated(self) -> None:
        count = 0
        while self._take("not"):
            count += 1
        self._compared()
        for _ in range(count):
            self._emit("not")

    def _compared(self) -> None:
        self._sum()
        operator = self._take(*COMPARISONS)
        if operator:
            self._sum()
            self._emit(operator)
        elif self._take("in"):
            self._membership()
        token = self._peek()
        if token.kind == "symbol" and token.text in COMPARISONS:
            raise self._error("comparisons cannot be chained", "Join them with 'and'.")

    def _membership(self) -> None:
        if not self._take("["):
            raise self._error("'in' needs a list like [1, 2]")
        self._steps.append(Step("number", exponents=None))
        self._sum()
        self._emit("member")
        while self._take(","):
            self._sum()
            self._emit("member")
        self._require("]")
        self._emit("found")

    def _sum(self) -> None:
        self._product()
        while operator := self._take("+", "-"):
            self._product()
            self._emit(operator)

    def _product(self) -> None:
        self._signed()
        while operator := self._take("*", "/"):
            self._signed()
            self._emit(operator)

    def _signed(self) -> None:
        minus = 0
        while sign := self._take("-", "+"):
            minus += sign == "-"
        self._power()
        if minus % 2:
            self._emit("negative")

    def _power(self) -> None:
        self._atom()
        if self._take("**"):
            self._deeper()
            self._signed()
            self._depth -= 1
            self._emit("**")

    def _atom(self) -> None:
        token = self._peek()
        if token.kind == "number":
            self._steps.append(self._number(token))
            self._at += 1
        elif token.kind == "text":
            self._at += 1
            self._steps.append(Step("text", text=token.text[1:-1]))
        elif token.kind == "name" and token.text not in KEYWORDS:
            self._at += 1
            self._named(token.text)
        elif self._take("("):
            self._either()
            self._require(")")
        else:
            raise self._error("a number, a name or '(' is missing")

    def _number(self, token: _Token) -> Step:
        value = float(token.text)
        exponents: Exponents | None = None if value == 0.0 else PLAIN
        if token.unit is not None:
            value = convert(value, UNITS[token.unit])
            exponents = UNITS[token.unit].exponents
        if not math.isfinite(value):
            raise self._error(f"{shown(token.text)} is not a finite number")
        return Step("number", value, exponents=exponents)

    def _named(self, name: str) -> None:
        if self._take("("):
            self._call(name)
        elif name in {"true", "false"}:
            self._steps.append(Step("number", 1.0 if name == "true" else 0.0))
        else:
            self._steps.append(Step("name", text=name))

    def _call(self, name: str) -> None:
        token = self._peek()
        if name in EVENT_FUNCTIONS and token.kind == "name" and token.text not in KEYWORDS:
            self._at += 1
            self._require(")")
            self._steps.append(Step("name", text=f"{token.text}.{name}"))
            return
        if name not in FUNCTIONS:
            self._at -= 2
            raise self._error(
                f"there is no function {shown(name)}", suggest(name, [*FUNCTIONS, *EVENT_FUNCTIONS])
            )
        count = 1
        self._either()
        while self._take(","):
            self._either()
            count += 1
            if name in {"min", "max"}:
                self._emit(name)
        self._require(")")
        low, high = FUNCTIONS[name]
        if not low <= count <= high:
            wanted = str(low) if low == high else f"{low} to {high}"
            raise self._error(f"{name} takes {wanted} arguments, not {count}")
        if name not in {"min", "max"}:
            self._emit(name)
