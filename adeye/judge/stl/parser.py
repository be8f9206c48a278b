"""Parser of signal temporal logic: text to abstract syntax, by recursive descent.

From loose to tight: ``implies`` (to the right), ``or``, ``and``, ``until`` and ``since``; ``not``,
``always``, ``eventually``, ``once`` and ``historically``; comparison; ``+ -``; ``* /``; sign.
``always a and b`` could be read in two ways and is refused: a temporal operator on the left of a
connective needs parentheses round its operand or round itself.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Literal, NoReturn, TypeAlias, cast

from adeye.errors import ExpressionError, SourceLocation
from adeye.judge.stl import syntax
from adeye.units import FEWER_DIGITS, ROUNDED, UNITS, Dimension, convert, is_rounded

# --- Tokens of a formula: words, symbols, and numbers with their units ----------------------------

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
    span: syntax.Span
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
    digits = float(number.group())
    if is_rounded(number.group(), digits):
        raise ExpressionError(
            f"formula '{cut(text)}', character {number.start() + 1}: {number.group()[:40]} "
            f"{ROUNDED}",
            where=where,
            remedy=FEWER_DIGITS,
        )
    unit = _UNIT.match(text, number.end())
    if unit is None or unit.group(1) in _CONNECTIVES:
        value = _finite(digits, text, number, where)
        return Token("number", number.group(), number.span(), value)
    # The longest reading first: 10 m/s is a speed, 10 m/speed a length divided by a signal.
    for word in (unit.group(1), unit.group(1).partition("/")[0]):
        end = unit.start(1) + len(word)
        known = UNITS.get(word)
        if known is not None and not re.match(r"\w", text[end : end + 1]):
            value = _finite(convert(digits, known), text, number, where)
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


# --- Parser of signal temporal logic: text to abstract syntax, by recursive descent ---------------

MAX_DEPTH: Final = 30
MAX_TOKENS: Final = 400
"""A chain of n connectives is a tree of depth n, so its length is limited, too."""
_COMPARISONS: Final = frozenset({"<", "<=", ">", ">="})
_ON_CONDITIONS: Final = frozenset({"rise", "fall", "previous"})
_FUNCTIONS: Final = frozenset({"abs", "min", "max"} | _ON_CONDITIONS)

Parameters: TypeAlias = Mapping[str, tuple[float, tuple[int, int, int]]]
"""Values in SI with their exponents of length, time and angle, by name."""


def parse_with(
    parameters: Parameters, text: str, where: SourceLocation | None = None
) -> tuple[syntax.Condition, frozenset[str]]:
    """Parse a formula with parameters.

    Args:
        parameters: Words that stand for a constant.
        text: The formula.
        where: Place of the text in a file, for messages.

    Returns:
        Its abstract syntax, and the parameters that it names.

    Raises:
        ExpressionError: The text is no formula; the message gives the position in it.
    """
    parser = _Parser(text, where, parameters)
    return parser.read(), frozenset(parser.used)


class _Parser:
    """One pass over the tokens of a formula."""

    def __init__(self, text: str, where: SourceLocation | None, parameters: Parameters) -> None:
        self._text = text
        self._where = where
        self._parameters = parameters
        self.used: set[str] = set()
        self._tokens = scan(text, where)
        self._next = 0
        self._depth = 0

    def read(self) -> syntax.Condition:
        if len(self._tokens) > MAX_TOKENS:
            self._refuse(f"longer than {MAX_TOKENS} words", "Split the formula into FSRs.")
        root = self._condition(self._implication())
        if self._token.kind != "end":
            self._refuse(f"'{self._token.text}' is not expected here", "Remove it or connect it.")
        return root

    # --- tokens

    @property
    def _token(self) -> Token:
        return self._tokens[self._next]

    def _take(self) -> Token:
        token = self._token
        self._next += 1
        return token

    def _accept(self, *texts: str) -> Token | None:
        if self._token.kind in {"word", "symbol"} and self._token.text in texts:
            return self._take()
        return None

    def _expect(self, text: str) -> Token:
        token = self._accept(text)
        if token is None:
            found = self._token.text or "the end"
            self._refuse(f"'{text}' is expected before {found!r}", "Close or complete the part.")
        return token

    def _refuse(self, what: str, remedy: str, at: int | None = None) -> NoReturn:
        column = (self._token.span[0] if at is None else at) + 1
        raise ExpressionError(
            f"formula '{cut(self._text)}', character {column}: {what}",
            where=self._where,
            remedy=remedy,
        )

    def _span(self, first: int) -> syntax.Span:
        return (first, self._tokens[self._next - 1].span[1])

    # --- conditions

    def _condition(self, node: syntax.Node) -> syntax.Condition:
        if isinstance(node, syntax.Signal):
            return syntax.Assertion(node.span, node.name)
        if isinstance(node, syntax.TERMS):
            self._refuse(
                f"'{self._quote(node)}' is a number where a condition is needed",
                "Compare it with a threshold.",
                node.span[0],
            )
        return node

    def _quote(self, node: syntax.Node) -> str:
        return self._text[slice(*node.span)]

    def _deeper(self) -> None:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            self._refuse(f"nested more than {MAX_DEPTH} deep", "Split the formula into FSRs.")

    def _implication(self) -> syntax.Node:
        self._deeper()
        first = self._token.span[0]
        node = self._joined("or", lambda: self._joined("and", self._until))
        if self._accept("implies"):
            left, right = self._condition(node), self._condition(self._implication())
            node = syntax.Connective(self._span(first), "implies", left, right)
        self._depth -= 1
        return node

    def _joined(self, word: Literal["or", "and"], part: Callable[[], syntax.Node]) -> syntax.Node:
        first = self._token.span[0]
        node = part()
        while self._accept(word):
            left, right = self._condition(node), self._condition(part())
            node = syntax.Connective(self._span(first), word, left, right)
        return node

    def _until(self) -> syntax.Node:
        first = self._token.span[0]
        node = self._unary()
        operator = self._accept("until", "since")
        if operator is not None:
            window = self._window()
            left, right = self._condition(node), self._condition(self._unary())
            kind = syntax.Until if operator.text == "until" else syntax.Since
            node = kind(self._span(first), window, left, right)
            if self._token.text in {"until", "since"}:
                self._refuse(
                    f"'{self._token.text}' after '{operator.text}' can be read in two ways",
                    "Write parentheses.",
                )
        return node

    def _unary(self) -> syntax.Node:
        token = self._token
        if self._accept("not"):
            operand = self._nested_unary()
            return syntax.Not(self._span(token.span[0]), operand)
        if self._accept("always", "eventually", "once", "historically"):
            return self._temporal(token)
        return self._comparison()

    def _nested_unary(self) -> syntax.Condition:
        self._deeper()
        operand = self._condition(self._unary())
        self._depth -= 1
        return operand

    def _temporal(self, keyword: Token) -> syntax.Node:
        window = self._window()
        start = self._next
        operand = self._nested_unary()
        span = self._span(keyword.span[0])
        node: syntax.Node
        if keyword.text in {"once", "historically"}:
            past = cast("Literal['once', 'historically']", keyword.text)
            node = syntax.Past(span, past, window, operand)
        else:
            future = cast("Literal['always', 'eventually']", keyword.text)
            node = syntax.Temporal(span, future, window, operand)
        if self._token.text in _CONNECTIVES and not self._is_enclosed(start):
            following = self._token.text
            self._refuse(
                f"'{keyword.text} … {following} …' can be read in two ways",
                f"Write '{keyword.text} (… {following} …)' or '{keyword.text} (…) {following} …'.",
                keyword.span[0],
            )
        return node

    def _is_enclosed(self, start: int) -> bool:
        """Tell whether one pair of parentheses holds all tokens read since ``start``."""
        steps = [{"(": 1, ")": -1}.get(t.text, 0) for t in self._tokens[start : self._next]]
        depths = list(itertools.accumulate(steps))
        return depths.index(0) == len(depths) - 1 and steps[0] == 1

    def _window(self) -> syntax.Window | None:
        opening = self._accept("[")
        if opening is None:
            return None
        first = self._time()
        self._expect(",")
        last = self._time()
        self._expect("]")
        if not 0.0 <= first <= last:
            self._refuse(
                f"the window from {first:g} s to {last:g} s is empty or begins below 0 s",
                "Give 0 s <= first <= last; once, historically and since look back.",
                opening.span[0],
            )
        return syntax.Window(first, last)

    def _time(self) -> float:
        token = self._token
        constant = self._parameter(token)
        if constant is None and token.kind == "number":
            constant = syntax.Constant(token.span, token.value, token.exponents, token.has_unit)
        if constant is None:
            self._refuse("a window needs two times", "Write for example [0 s, 2 s].")
        if constant.has_unit and constant.exponents != Dimension.TIME.exponents:
            self._refuse(f"'{token.text}' is not a time", "Write for example [0 s, 2 s].")
        self._take()
        return constant.value

    def _parameter(self, token: Token) -> syntax.Constant | None:
        """Give the constant that a word stands for; None if it is no parameter."""
        if token.kind != "word" or token.text not in self._parameters:
            return None
        self.used.add(token.text)
        value, exponents = self._parameters[token.text]
        return syntax.Constant(token.span, value, exponents, any(exponents))

    # --- predicates and terms

    def _comparison(self) -> syntax.Node:
        first = self._token.span[0]
        node: syntax.Node = self._sum()
        operator = self._accept("==", "!=", *_COMPARISONS)
        if operator is None:
            return node
        left, right = node, self._sum()
        relation = self._relate(operator, left, right, self._span(first))
        while operator.text in _COMPARISONS and self._token.text in _COMPARISONS:
            operator = self._take()
            left, right = right, self._sum()
            link = self._relate(operator, left, right, self._span(left.span[0]))
            relation = syntax.Connective(self._span(first), "and", relation, link)
        return relation

    def _relate(
        self, operator: Token, left: syntax.Node, right: syntax.Node, span: syntax.Span
    ) -> syntax.Condition:
        for side in (left, right):
            if not isinstance(side, syntax.TERMS):
                self._refuse(
                    f"'{self._quote(side)}' is a condition and cannot be compared",
                    "Compare numbers; combine conditions with and, or, implies.",
                    operator.span[0],
                )
        if not syntax.names_in(left) + syntax.names_in(right):
            self._refuse("only constants are compared", "Compare with a signal.", operator.span[0])
        terms = cast("syntax.Term", left), cast("syntax.Term", right)
        if operator.text in _COMPARISONS:
            order = cast("Literal['<', '<=', '>', '>=']", operator.text)
            return syntax.Comparison(span, order, *terms)
        return syntax.Equality(span, *terms, is_negated=operator.text == "!=")

    def _sum(self) -> syntax.Node:
        return self._calculation(("+", "-"), lambda: self._calculation(("*", "/"), self._sign))

    def _calculation(self, signs: tuple[str, str], part: Callable[[], syntax.Node]) -> syntax.Node:
        first = self._token.span[0]
        node = part()
        while (operator := self._accept(*signs)) is not None:
            right = part()
            terms = (self._term(node), self._term(right))
            sign = cast("Literal['+', '-', '*', '/']", operator.text)
            node = syntax.Arithmetic(self._span(first), sign, terms)
        return node

    def _term(self, node: syntax.Node) -> syntax.Term:
        if not isinstance(node, syntax.TERMS):
            self._refuse(
                f"'{self._quote(node)}' is a condition where a number is needed",
                "Calculate with signals and quantities only.",
                node.span[0],
            )
        return node

    def _sign(self) -> syntax.Node:
        sign = self._accept("-")
        if sign is None:
            return self._primary()
        operand = self._term(self._primary())
        span = self._span(sign.span[0])
        if isinstance(operand, syntax.Constant):
            return syntax.Constant(span, -operand.value, operand.exponents, operand.has_unit)
        return syntax.Arithmetic(span, "negate", (operand,))

    def _primary(self) -> syntax.Node:
        token = self._token
        if token.kind == "number":
            self._take()
            return syntax.Constant(token.span, token.value, token.exponents, token.has_unit)
        if self._accept("("):
            node = self._implication()
            self._expect(")")
            return node
        if token.kind == "word" and token.text in _FUNCTIONS:
            return self._call()
        if token.kind != "word" or token.text in KEYWORDS:
            found = f"'{token.text}'" if token.text else "the end"
            self._refuse(f"a signal, number or '(' is expected before {found}", "Complete it.")
        self._take()
        return self._parameter(token) or syntax.Signal(token.span, token.text)

    def _call(self) -> syntax.Node:
        keyword = self._take()
        self._expect("(")
        arguments = [self._implication()]
        while self._accept(","):
            arguments.append(self._implication())
        self._expect(")")
        return self._function(keyword, arguments, self._span(keyword.span[0]))

    def _function(
        self, keyword: Token, arguments: list[syntax.Node], span: syntax.Span
    ) -> syntax.Node:
        name = keyword.text
        wanted = 1 if name == "abs" or name in _ON_CONDITIONS else 2
        if (len(arguments) != wanted) if wanted == 1 else (len(arguments) < wanted):
            what = "one argument" if wanted == 1 else "two arguments or more"
            self._refuse(f"{name} takes {what}, not {len(arguments)}", "", keyword.span[0])
        if name in {"rise", "fall"}:
            edge = cast("Literal['rise', 'fall']", name)
            return syntax.Edge(span, edge, self._condition(arguments[0]))
        if name == "previous":
            return syntax.Previous(span, self._condition(arguments[0]))
        function = cast("Literal['min', 'max', 'abs']", name)
        terms = tuple(self._term(argument) for argument in arguments)
        return syntax.Arithmetic(span, function, terms)
