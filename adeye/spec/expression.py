"""The one safe expression language: formulas over parameters, relations, triggers.

Numbers with units, names with dots, arithmetic, comparison, ``and or not``, a fixed list of
functions; evaluated over whole columns, or compiled to a postfix program for one run's variables.
Python's ``eval`` is never involved.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from adeye.errors import ExpressionError, SourceLocation, suggest
from adeye.kernel.postfix import FUNCTION_CODES, OPERATOR_CODES, PUSH_NUMBER, PUSH_VARIABLE
from adeye.units import UNITS, Dimension, convert

MAX_LENGTH: Final = 2_000
MAX_DEPTH: Final = 60

Exponents = tuple[int, int, int]
Value = Any
"""A column, a scalar or text; numpy broadcasts between them."""

_FUNCTIONS: Final[dict[str, tuple[int, int, Callable[..., Any]]]] = {
    "abs": (1, 1, np.abs),
    "min": (2, 8, lambda *a: _reduce(np.minimum, a)),
    "max": (2, 8, lambda *a: _reduce(np.maximum, a)),
    "sqrt": (1, 1, np.sqrt),
    "floor": (1, 1, np.floor),
    "ceil": (1, 1, np.ceil),
    "sin": (1, 1, np.sin),
    "cos": (1, 1, np.cos),
    "exp": (1, 1, np.exp),
    "log": (1, 1, np.log),
    "clip": (3, 3, lambda x, low, high: np.minimum(np.maximum(x, low), high)),
    "if_": (3, 3, np.where),
}
"""Fewest and most arguments, and the meaning over columns."""

_COMPARISONS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "==": np.equal,
    "!=": np.not_equal,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}
_ARITHMETIC: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "**": np.power,
}

_UNIT_WORDS: Final = sorted((u for u in UNITS), key=len, reverse=True)
_TOKEN: Final = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"
    rf"(?:\s*(?P<unit>{'|'.join(re.escape(u) for u in _UNIT_WORDS)})(?![A-Za-z0-9_.^²³/]))?"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z0-9_]+)*)"
    r"|(?P<text>'[^']*'|\"[^\"]*\")"
    r"|(?P<symbol>\*\*|[-+*/()\[\],]|==|!=|<=|>=|<|>))"
)


def _reduce(function: Callable[[Any, Any], Any], items: Sequence[Any]) -> Any:
    result = items[0]
    for item in items[1:]:
        result = function(result, item)
    return result


@dataclass(frozen=True, slots=True)
class Node:
    """One node of a parsed expression.

    Attributes:
        kind: ``number``, ``name``, ``text``, ``call``, ``unary``, ``binary``, ``in``.
        value: The number, name, text or operator.
        exponents: Dimension of a number; None for a bare zero, which fits anything.
        children: Operands.
    """

    kind: str
    value: Any
    exponents: Exponents | None = (0, 0, 0)
    children: tuple[Node, ...] = ()


@dataclass(frozen=True, slots=True)
class Program:
    """A postfix program over one run's variables, see ``adeye.kernel.postfix``."""

    ops: NDArray[np.int64]
    args: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed expression; equal text is an equal expression.

    Attributes:
        text: As written.
        root: Its tree.
    """

    text: str
    root: Node

    @property
    def names(self) -> frozenset[str]:
        """Every name that it uses."""
        return frozenset(_names(self.root))

    @property
    def is_constant(self) -> bool:
        """Whether it uses no name."""
        return not self.names

    def evaluate(self, columns: Mapping[str, Value]) -> Any:
        """Evaluate over whole columns.

        Args:
            columns: Scalars, text or (N,) columns by name.

        Raises:
            ExpressionError: A name is unknown, text meets a number, or a result is not finite.
        """
        for name in sorted(self.names):
            if name not in columns:
                raise ExpressionError(
                    f"'{self.text}' uses {name!r}, which does not exist here",
                    remedy=suggest(name, sorted(columns)),
                )
        try:
            with np.errstate(all="ignore"):
                result = _evaluate(self.root, columns)
        except (TypeError, ValueError) as error:
            raise ExpressionError(f"'{self.text}' mixes text and numbers") from error
        if np.asarray(result).dtype.kind == "f" and not np.isfinite(result).all():
            raise ExpressionError(f"'{self.text}' is not finite for some values")
        return result

    def dimension(self, dims: Mapping[str, Dimension | None]) -> Dimension | None:
        """Infer what it measures; None if that is open (a bare 0, or names of open dimension).

        Raises:
            ExpressionError: Lengths are added to speeds, or the like.
        """
        exponents = _exponents(self.root, dims, self.text)
        if exponents is None:
            return None
        for dimension in Dimension:
            if dimension.exponents == exponents:
                return dimension
        raise ExpressionError(
            f"'{self.text}' measures length^{exponents[0]} time^{exponents[1]} "
            f"angle^{exponents[2]}, which nothing here does"
        )


@lru_cache(maxsize=4096)
def _parsed(text: str) -> Node:
    return _Parser(text).parse()


def parse(text: str, where: SourceLocation | None = None) -> Expression:
    """Read an expression.

    Args:
        text: At most 2,000 characters.
        where: Its place, for messages.

    Raises:
        ExpressionError: It does not follow the grammar; the message has the position.

    >>> float(parse("2 * gap + 10 m").evaluate({"gap": 5.0}))
    20.0
    """
    try:
        return Expression(text, _parsed(text))
    except ExpressionError as error:
        if where is None:
            raise
        raise ExpressionError(error.message, where=where, remedy=error.remedy) from error


def to_program(expression: Expression, index: Mapping[str, int]) -> Program:
    """Compile an expression to a postfix program for ``adeye.kernel.postfix.run_program``.

    Args:
        expression: Numeric or truth-valued; truth is 1.0 and 0.0.
        index: Position of each name in the variable vector.

    Raises:
        ExpressionError: A name is not in the index, or text is compared.
    """
    ops: list[int] = []
    args: list[float] = []
    _emit(expression, expression.root, index, (ops, args))
    return Program(np.array(ops, dtype=np.int64), np.array(args, dtype=np.float64))


class _Parser:
    def __init__(self, text: str) -> None:
        if len(text) > MAX_LENGTH:
            raise ExpressionError(
                f"an expression of {len(text):,} characters, at most {MAX_LENGTH:,} are read"
            )
        self._text = text
        self._tokens = self._scan()
        self._at = 0
        self._depth = 0

    def parse(self) -> Node:
        if not self._tokens:
            raise ExpressionError("an empty expression", remedy="Write a number or a formula.")
        node = self._either()
        if self._at < len(self._tokens):
            raise self._error("something follows the end of the expression")
        return node

    def _scan(self) -> list[tuple[str, Any, int]]:
        tokens: list[tuple[str, Any, int]] = []
        position = 0
        end = len(self._text.rstrip())
        while position < end:
            match = _TOKEN.match(self._text, position)
            if match is None:
                character = self._text[position:].lstrip()[:1]
                raise ExpressionError(f"'{self._text}': {character!r} cannot be read here")
            kind = str(match.lastgroup)
            if match["number"]:
                tokens.append(("number", (match["number"], match["unit"]), match.start("number")))
            else:
                tokens.append((kind, match[kind], match.start(kind)))
            position = match.end()
        return tokens

    def _peek(self) -> tuple[str, Any]:
        if self._at < len(self._tokens):
            kind, value, _ = self._tokens[self._at]
            return kind, value
        return "end", ""

    def _take(self, *values: str) -> str | None:
        kind, value = self._peek()
        if kind in {"symbol", "name"} and value in values:
            self._at += 1
            return str(value)
        return None

    def _error(self, what: str) -> ExpressionError:
        place = self._tokens[self._at][2] if self._at < len(self._tokens) else len(self._text)
        return ExpressionError(f"'{self._text}', character {place + 1}: {what}")

    def _either(self) -> Node:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise self._error(f"nested more than {MAX_DEPTH} deep")
        node = self._both()
        while self._take("or"):
            node = Node("binary", "or", children=(node, self._both()))
        self._depth -= 1
        return node

    def _both(self) -> Node:
        node = self._negated()
        while self._take("and"):
            node = Node("binary", "and", children=(node, self._negated()))
        return node

    def _negated(self) -> Node:
        count = 0
        while self._take("not"):
            count += 1
        node = self._compared()
        for _ in range(count % 2 if count < MAX_DEPTH else self._too_deep()):
            node = Node("unary", "not", children=(node,))
        return node

    def _too_deep(self) -> int:
        raise self._error(f"nested more than {MAX_DEPTH} deep")

    def _compared(self) -> Node:
        node = self._sum()
        operator = self._take(*_COMPARISONS)
        if operator:
            node = Node("binary", operator, children=(node, self._sum()))
            if self._peek()[1] in _COMPARISONS:
                raise self._error("comparisons cannot be chained; join them with 'and'")
            return node
        if self._take("in"):
            return self._membership(node)
        return node

    def _membership(self, node: Node) -> Node:
        if not self._take("["):
            raise self._error("'in' needs a list like [1, 2]")
        items = [self._sum()]
        while self._take(","):
            items.append(self._sum())
        if not self._take("]"):
            raise self._error("']' is missing")
        return Node("in", "in", children=(node, *items))

    def _sum(self) -> Node:
        node = self._product()
        while operator := self._take("+", "-"):
            node = Node("binary", operator, children=(node, self._product()))
        return node

    def _product(self) -> Node:
        node = self._signed()
        while operator := self._take("*", "/"):
            node = Node("binary", operator, children=(node, self._signed()))
        return node

    def _signed(self) -> Node:
        sign = 1
        count = 0
        while operator := self._take("-", "+"):
            sign = -sign if operator == "-" else sign
            count += 1
            if count > MAX_DEPTH:
                raise self._error(f"nested more than {MAX_DEPTH} deep")
        node = self._power()
        return Node("unary", "-", children=(node,)) if sign < 0 else node

    def _power(self) -> Node:
        node = self._atom()
        if self._take("**"):
            return Node("binary", "**", children=(node, self._signed()))
        return node

    def _atom(self) -> Node:
        kind, value = self._peek()
        if kind == "number":
            self._at += 1
            return _number(*value)
        if kind == "text":
            self._at += 1
            return Node("text", value[1:-1])
        if kind == "name" and value not in {"and", "or", "not", "in"}:
            self._at += 1
            if self._take("("):
                return self._call(value)
            if value in {"true", "false"}:
                return Node("number", 1.0 if value == "true" else 0.0)
            return Node("name", value)
        if self._take("("):
            node = self._either()
            if not self._take(")"):
                raise self._error("')' is missing")
            return node
        raise self._error("a number, a name or '(' is missing")

    def _call(self, name: str) -> Node:
        if name not in _FUNCTIONS:
            raise ExpressionError(
                f"'{self._text}': there is no function {name!r}", remedy=suggest(name, _FUNCTIONS)
            )
        items = [self._either()]
        while self._take(","):
            items.append(self._either())
        if not self._take(")"):
            raise self._error("')' is missing")
        low, high, _ = _FUNCTIONS[name]
        if not low <= len(items) <= high:
            wanted = str(low) if low == high else f"{low} to {high}"
            raise self._error(f"{name} takes {wanted} arguments, not {len(items)}")
        return Node("call", name, children=tuple(items))


def _number(text: str, unit: str | None) -> Node:
    value = float(text)
    if not np.isfinite(value):
        raise ExpressionError(f"{text} is not a finite number")
    if unit is None:
        return Node("number", value, None if value == 0.0 else (0, 0, 0))
    return Node("number", convert(value, UNITS[unit]), UNITS[unit].exponents)


def _names(node: Node) -> list[str]:
    if node.kind == "name":
        return [node.value]
    return [name for child in node.children for name in _names(child)]


def _evaluate(node: Node, columns: Mapping[str, Value]) -> Any:
    if node.kind in {"number", "text"}:
        return node.value
    if node.kind == "name":
        return columns[node.value]
    values = [_evaluate(child, columns) for child in node.children]
    if node.kind == "call":
        return _FUNCTIONS[node.value][2](*values)
    if node.kind == "unary":
        return np.negative(values[0]) if node.value == "-" else np.logical_not(values[0])
    if node.kind == "in":
        return _reduce(np.logical_or, [np.equal(values[0], item) for item in values[1:]])
    if node.value == "and":
        return np.logical_and(*values)
    if node.value == "or":
        return np.logical_or(*values)
    table = _COMPARISONS if node.value in _COMPARISONS else _ARITHMETIC
    return table[node.value](*values)


def _exponents(
    node: Node, dims: Mapping[str, Dimension | None], text: str
) -> Exponents | None:
    if node.kind == "number":
        return node.exponents
    if node.kind == "text":
        return None
    if node.kind == "name":
        dimension = dims.get(node.value)
        return dimension.exponents if dimension is not None else None
    parts = [_exponents(child, dims, text) for child in node.children]
    if node.kind == "call":
        return _call_exponents(node.value, parts, text)
    if node.kind == "unary":
        return parts[0] if node.value == "-" else (0, 0, 0)
    if node.value in {"and", "or"}:
        return (0, 0, 0)
    if node.value in {"*", "/"}:
        left, right = parts
        if left is None or right is None:
            return left if right == (0, 0, 0) else None
        sign = 1 if node.value == "*" else -1
        return (
            left[0] + sign * right[0],
            left[1] + sign * right[1],
            left[2] + sign * right[2],
        )
    if node.value == "**":
        return _power_exponents(node, parts[0], text)
    same = _same(parts, text)
    return same if node.value in {"+", "-"} else (0, 0, 0)


def _power_exponents(node: Node, base: Exponents | None, text: str) -> Exponents | None:
    power = node.children[1]
    if base is None or base == (0, 0, 0):
        return base
    if power.kind != "number" or power.value != int(power.value):
        raise ExpressionError(f"'{text}': a quantity is raised to whole numbers only")
    k = int(power.value)
    return (base[0] * k, base[1] * k, base[2] * k)


def _call_exponents(
    name: str, parts: Sequence[Exponents | None], text: str
) -> Exponents | None:
    if name == "if_":
        return _same(parts[1:], text)
    if name == "sqrt":
        base = parts[0]
        if base is None:
            return None
        if any(part % 2 for part in base):
            raise ExpressionError(f"'{text}': sqrt of a quantity that is no square")
        return (base[0] // 2, base[1] // 2, base[2] // 2)
    if name in {"sin", "cos", "exp", "log"}:
        return (0, 0, 0)
    return _same(parts, text)


def _same(parts: Sequence[Exponents | None], text: str) -> Exponents | None:
    known = [part for part in parts if part is not None]
    for part in known[1:]:
        if part != known[0]:
            left, right = _label(known[0]), _label(part)
            raise ExpressionError(
                f"'{text}' puts {left} and {right} together", remedy="Check the units."
            )
    return known[0] if known else None


def _label(exponents: Exponents) -> str:
    for dimension in Dimension:
        if dimension.exponents == exponents:
            return dimension.label
    return "another dimension"


def _emit(
    expression: Expression,
    node: Node,
    index: Mapping[str, int],
    out: tuple[list[int], list[float]],
) -> None:
    ops, args = out

    def put(code: int, arg: float = 0.0) -> None:
        ops.append(code)
        args.append(arg)

    if node.kind == "number":
        put(PUSH_NUMBER, node.value)
    elif node.kind == "name":
        if node.value not in index:
            raise ExpressionError(
                f"'{expression.text}' uses {node.value!r}, which does not exist here",
                remedy=suggest(node.value, sorted(index)),
            )
        put(PUSH_VARIABLE, float(index[node.value]))
    elif node.kind == "text":
        raise ExpressionError(f"'{expression.text}' uses text, which is not known during a run")
    else:
        _emit_operation(expression, node, index, out)


def _emit_operation(
    expression: Expression,
    node: Node,
    index: Mapping[str, int],
    out: tuple[list[int], list[float]],
) -> None:
    ops, args = out
    first, *rest = node.children
    _emit(expression, first, index, out)
    if node.kind == "in":
        for number, item in enumerate(rest):
            if number:
                _emit(expression, first, index, out)
            _emit(expression, item, index, out)
            ops.append(OPERATOR_CODES["=="])
            args.append(0.0)
            if number:
                ops.append(OPERATOR_CODES["or"])
                args.append(0.0)
        return
    if node.value in {"min", "max"}:
        for item in rest:
            _emit(expression, item, index, out)
            ops.append(FUNCTION_CODES[node.value])
            args.append(0.0)
        return
    for item in rest:
        _emit(expression, item, index, out)
    code = (
        FUNCTION_CODES[node.value]
        if node.kind == "call"
        else OPERATOR_CODES["negative" if node.kind == "unary" and node.value == "-" else node.value]
    )
    ops.append(code)
    args.append(0.0)
