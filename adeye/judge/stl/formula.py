"""A parsed formula: what it reads, how far it looks ahead, whether it fits the signals."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, NoReturn, TypeAlias

from adeye.errors import ExpressionError
from adeye.judge.stl import syntax
from adeye.judge.stl.parser import Parameters, cut, parse_with
from adeye.units import UNITS, Dimension

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.errors import SourceLocation
    from adeye.judge.stl.series import SignalEntry

# --- Check of a formula against the signal dictionary: names, kinds, labels and dimensions --------

Exponents: TypeAlias = tuple[int, ...]
TRUTH_LABELS = ("false", "true")


def unit_exponents(text: str) -> Exponents | None:
    """Give the exponents of length, time and angle of a signal's unit; None if it is unknown.

    >>> unit_exponents("m/s²"), unit_exponents("s^2"), unit_exponents("1"), unit_exponents("pint")
    ((1, -2, 0), (0, 2, 0), (0, 0, 0), None)
    """
    if text in {"", "1"}:
        return Dimension.NONE.exponents
    if text in UNITS:
        return UNITS[text].exponents
    power = re.fullmatch(r"([a-z]+)(?:\^?([2-4])|([²³]))", text)
    if power is None or power[1] not in UNITS:
        top, quotient, bottom = text.partition("/")
        above, below = (unit_exponents(part) if quotient else None for part in (top, bottom))
        return None if above is None or below is None else _product(above, below, "/")
    times = int(power[2]) if power[2] else {"²": 2, "³": 3}[power[3]]
    return tuple(times * exponent for exponent in UNITS[power[1]].exponents)


class _Checker:
    def __init__(
        self, dictionary: Mapping[str, SignalEntry], text: str, where: SourceLocation | None
    ) -> None:
        self._dictionary = dictionary
        self._text = text
        self._where = where

    def condition(self, node: syntax.Node) -> None:
        match node:
            case syntax.Comparison():
                self._same(node, node.left, node.right)
            case syntax.Equality():
                self._equality(node)
            case syntax.Assertion():
                if self.entry(node.name, node).kind != "boolean":
                    self._refuse(
                        node, f"'{node.name}' is not a truth value", "Compare it with a value."
                    )
            case _:
                for child in syntax.children(node):
                    self.condition(child)

    def entry(self, name: str, node: syntax.Node) -> SignalEntry:
        if name not in self._dictionary:
            close = difflib.get_close_matches(name, list(self._dictionary), n=3)
            remedy = f"Did you mean {' or '.join(close)}?" if close else "See `adeye signals`."
            self._refuse(node, f"there is no signal '{name}'", remedy)
        return self._dictionary[name]

    def _refuse(self, node: syntax.Node, what: str, remedy: str) -> NoReturn:
        raise ExpressionError(
            f"formula '{cut(self._text)}', character {node.span[0] + 1}: {what}",
            where=self._where,
            remedy=remedy,
        )

    def _quote(self, node: syntax.Node) -> str:
        return self._text[slice(*node.span)]

    def _equality(self, node: syntax.Equality) -> None:
        left = node.left
        if not isinstance(left, syntax.Signal) or self.entry(left.name, left).kind == "number":
            self._numeric_equality(node)
            return
        kind = self._words(left.name, left)
        label = syntax.label_of(node)
        if label is not None:
            if label not in kind:
                self._refuse(
                    node.right,
                    f"'{label}' is not a value of '{left.name}'",
                    f"It is one of {', '.join(kind)}.",
                )
        elif (
            not isinstance(node.right, syntax.Signal)
            or self._words(node.right.name, node.right) != kind
        ):
            self._refuse(
                node.right,
                f"'{self._quote(node.right)}' cannot be compared with '{left.name}'",
                f"Compare with one of {', '.join(kind)}.",
            )

    def _words(self, name: str, node: syntax.Node) -> tuple[str, ...]:
        entry = self.entry(name, node)
        if entry.kind == "boolean":
            return TRUTH_LABELS
        return entry.labels if entry.kind == "enumeration" else ()

    def _numeric_equality(self, node: syntax.Equality) -> None:
        label = syntax.label_of(node)
        if label is not None:
            self._refuse(
                node.right,
                f"'{label}' is not a number",
                "Write a number, or the signal on the left of the comparison.",
            )
        exponents = self._same(node, node.left, node.right)
        is_time = all(self.entry(name, node).slack > 0.0 for name in syntax.names_in(node))
        if any(exponents) and not is_time:
            self._refuse(
                node,
                f"'{self._quote(node)}' compares measured quantities for equality",
                "Write abs(a - b) <= a tolerance with a unit.",
            )

    def _same(self, node: syntax.Node, left: syntax.Term, right: syntax.Term) -> Exponents:
        """Require two terms of one dimension; a zero without unit has every dimension."""
        first, second = self._exponents(left), self._exponents(right)
        if first is None or second is None:
            return first or second or Dimension.NONE.exponents
        if first != second:
            bare = any(
                isinstance(side, syntax.Constant) and not side.has_unit for side in (left, right)
            )
            self._refuse(
                node,
                f"'{self._quote(left)}' is {_label(first)}, "
                f"'{self._quote(right)}' is {_label(second)}",
                "Give the number its unit." if bare else "Compare like with like.",
            )
        return first

    def _exponents(self, term: syntax.Term) -> Exponents | None:
        if isinstance(term, syntax.Signal):
            return self._signal(term)
        if isinstance(term, syntax.Arithmetic):
            return self._arithmetic(term)
        is_any = term.value == 0.0 and not term.has_unit
        return None if is_any else term.exponents

    def _signal(self, term: syntax.Signal) -> Exponents:
        entry = self.entry(term.name, term)
        if entry.kind != "number":
            self._refuse(
                term, f"'{term.name}' is not a number", "Compare it with == or use it on its own."
            )
        exponents = unit_exponents(entry.unit)
        if exponents is None:
            self._refuse(
                term, f"'{term.name}' has the unknown unit '{entry.unit}'", "Use another signal."
            )
        return exponents

    def _arithmetic(self, term: syntax.Arithmetic) -> Exponents | None:
        reference, *others = term.operands
        exponents = self._exponents(reference)
        for other in others:
            if term.operator in {"*", "/"}:
                exponents = _product(exponents, self._exponents(other), term.operator)
            elif exponents is None:
                reference, exponents = other, self._exponents(other)
            else:
                self._same(term, reference, other)
        return exponents


def _product(left: Exponents | None, right: Exponents | None, operator: str) -> Exponents | None:
    if left is None or right is None:
        return None
    sign = 1 if operator == "*" else -1
    return tuple(a + sign * b for a, b in zip(left, right, strict=True))


def _label(exponents: Exponents) -> str:
    known = (dimension for dimension in Dimension if dimension.exponents == exponents)
    return next((dimension.label for dimension in known), "a quantity of another dimension")


# --- A parsed formula: what it reads, how far it looks ahead, whether it fits the signals ---------


@dataclass(frozen=True, slots=True)
class Formula:
    """A formula of signal temporal logic.

    Attributes:
        text: What the user wrote.
        where: Place of the text in a file, if it came from one.
        root: Abstract syntax.
        names: Signals that it reads, in the order of the text.
        reach_s: Time after an obligation's start that its truth may depend on [s]; infinite for an
            operator without a window below another one.
        parameters: Those that it names, with their values in SI.
    """

    text: str
    where: SourceLocation | None
    root: syntax.Condition
    names: tuple[str, ...]
    reach_s: float
    parameters: tuple[tuple[str, float], ...] = ()

    def quote(self, node: syntax.Node) -> str:
        """Give the part of the text that a node was read from, on one line."""
        return " ".join(self.text[slice(*node.span)].split())

    def check(self, dictionary: Mapping[str, SignalEntry]) -> None:
        """Refuse names that do not exist and kinds or dimensions that do not fit.

        Args:
            dictionary: The signals that a formula may name.

        Raises:
            ExpressionError: The first misfit, with a suggestion.
        """
        _Checker(dictionary, self.text, self.where).condition(self.root)


def parse_formula(
    text: str, where: SourceLocation | None = None, parameters: Parameters = MappingProxyType({})
) -> Formula:
    """Parse a formula.

    Args:
        text: The formula, for example ``always (contact == false and gap > 2 m)``.
        where: Place of the text in a file, for messages.
        parameters: Words that stand for a constant.

    Returns:
        The formula.

    Raises:
        ExpressionError: The text is no formula; the message gives the position in it. Or it would
            look back from the first row only, before which there is nothing.
    """
    root, used = parse_with(parameters, text, where)
    looking_back = syntax.first_looking_back(root)
    if looking_back is not None:
        part = " ".join(text[slice(*looking_back.span)].split())
        raise ExpressionError(
            f"formula '{cut(text)}', character {looking_back.span[0] + 1}: '{part}' would look "
            "back from the first row only",
            where=where,
            remedy=f"Say when it is asked for: always(q implies {part}).",
        )
    named = tuple((name, parameters[name][0]) for name in sorted(used))
    return Formula(text, where, root, syntax.names_in(root), syntax.future_reach(root), named)


# --- What is asked of a formula that is only read: its faults and nested antecedents --------------


@lru_cache(maxsize=1024)
def read_formula(
    text: str, constants: tuple[tuple[str, tuple[float, tuple[int, int, int]]], ...]
) -> tuple[str, tuple[str, ...], tuple[str, ...], bool]:
    """Read a formula.

    Returns:
        Its canonical text, the signals that it names, nested antecedents, and whether an antecedent
        may be met by a window that lies before the first row.
    """
    formula = parse_formula(text, parameters=dict(constants))
    nested = syntax.nested_implications(formula.root)
    outer = (part for parts, _ in syntax.find_implications(formula.root) for part in parts)
    asked = (*outer, *(node.left for node in nested))
    quoted = tuple(formula.quote(node.left) for node in nested)
    is_of_the_past = any(map(syntax.may_be_met_by_nothing, asked))
    return syntax.canonical(formula.root), formula.names, quoted, is_of_the_past


def nested_antecedents(formula: str | None, constants: Parameters) -> tuple[str, ...]:
    """Quote the antecedents of the implications below the top level of a formula.

    Args:
        formula: Its text; None for a bound, which has none.
        constants: Parameters in SI with their exponents.

    Raises:
        ExpressionError: The formula cannot be read.
    """
    return () if formula is None else read_formula(formula, tuple(sorted(constants.items())))[2]


ANY_FAULT = "*"
"""Stands for every fault among those that a formula names."""


def named_faults(formula: str | None, constants: Parameters) -> tuple[str, ...]:
    """List the ids of the faults that a formula names; arguments and errors as above."""
    if formula is None:
        return ()
    names = (name.split(".") for name in read_formula(formula, tuple(sorted(constants.items())))[1])
    found = (
        ANY_FAULT if name == ["faulted"] else name[1]
        for name in names
        if name == ["faulted"] or (name[0] == "fault" and len(name) > 2)
    )
    return tuple(dict.fromkeys(found))
