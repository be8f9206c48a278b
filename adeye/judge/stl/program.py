"""A formula as tables of numbers, which compiled code evaluates run by run.

Terms are numbered so that operands come before what uses them, conditions the same way. What does
not depend on a sample (scales, caps, units, texts) is settled here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.judge.stl import syntax
from adeye.judge.stl.series import Scale, combined, label_code, unit_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.judge.stl.formula import Formula
    from adeye.judge.stl.series import Series
    from adeye.signals import Bytes, Floats, Ints


SIGNAL, CONSTANT, ADD, SUBTRACT, LEAST, GREATEST, MULTIPLY, DIVIDE, NEGATE, SIZE = range(10)
"""Operations of a term."""
COMPARE, EQUAL, WORD, NOT, AND, OR, IMPLIES, RISE, FALL, EVENTUALLY, ALWAYS, UNTIL = range(12)
PREVIOUS, ONCE, HISTORICALLY, SINCE = range(12, 16)
"""Kinds of a condition; the first three are predicates, the last four look back."""
NUMBER, BOOLEAN, ENUMERATION = range(3)
"""Kinds of a signal."""

KIND, FIRST_PART, SECOND_PART, FROM_ROW, TO_ROW, HAS_WINDOW, IS_START, FLAG, VALUE, THRESHOLD = (
    range(10)
)
"""Columns of ``Program.nodes``. ``FLAG`` is strict of a comparison, negated of an equality; the
last two are the terms that people see as value and threshold."""
LOWER_CAP, UPPER_CAP, SCALE, CODE, SLACK = range(5)
"""Columns of ``Program.limits``."""

_OPERATIONS: Final = {
    "+": ADD, "-": SUBTRACT, "min": LEAST, "max": GREATEST, "*": MULTIPLY, "/": DIVIDE,
}  # fmt: skip
_KINDS: Final = {"number": NUMBER, "boolean": BOOLEAN, "enumeration": ENUMERATION}
_CONDITIONS: Final = {
    "not": NOT, "and": AND, "or": OR, "implies": IMPLIES, "rise": RISE, "fall": FALL,
    "eventually": EVENTUALLY, "always": ALWAYS, "until": UNTIL, "previous": PREVIOUS, "once": ONCE,
    "historically": HISTORICALLY, "since": SINCE,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Words:
    """What people see of one condition.

    Attributes:
        text: As it was written.
        signal: Its signal, or the first of several.
        names: Every signal that it reads.
        unit: Of value and threshold; empty where they are words.
        empty_unit: The same where a sample does not apply.
        values: Words of the value by code; empty for numbers.
        is_value_shown: Whether the value is shown as a number: numbers and truth values.
        is_threshold_shown: Whether the threshold is.
    """

    text: str
    signal: str
    names: tuple[str, ...]
    unit: str = ""
    empty_unit: str = ""
    values: tuple[str, ...] = ()
    is_value_shown: bool = True
    is_threshold_shown: bool = True


class Tables(NamedTuple):
    """A formula as compiled code reads it.

    Attributes:
        signals: (S, 3) whether a cap is declared, kind, number of labels.
        terms: (K, 3) operation, operands (of a signal its index).
        constants: (K,) value of a constant.
        nodes: (N, 10) conditions, children first; the last is the formula.
        limits: (N, 5) caps, scale, code of a word, difference up to which numbers are equal.
        implied: (I, 5) implications: first antecedent, their number, 1 if they are judged row by
            row, first row at which all antecedents can be met by what was there, last row (-1: of
            the obligations).
        antecedents: Conditions of the implications.
        decided: Those of them that the margin takes as true or false, without a degree: they say
            at which rows the consequent counts.
        nested: (J, 2) implications below the top level, by their conditions, and the first row as
            above.
    """

    signals: Ints
    terms: Ints
    constants: Floats
    nodes: Ints
    limits: Floats
    implied: Ints
    antecedents: Ints
    decided: Ints
    nested: Ints


class State(NamedTuple):
    """What is known of the parts of a formula at the T rows of one run, and room to find it.

    Attributes:
        values: (K, T) of the terms.
        flags: (K, T) of the terms.
        bounds: (N, 2, T) of the robustness of the conditions.
        truth: (N, 2, T) of their truth.
        start: (N, 4) both of them as whole formulas.
        exact: (N,) what is known of a condition at every row before the last, see ``measures``.
        scratch: (3, T).
        queue: (T,) scratch.
    """

    values: Floats
    flags: Bytes
    bounds: Floats
    truth: Bytes
    start: Floats
    exact: Bytes
    scratch: Floats
    queue: Ints


class Extent(NamedTuple):
    """How far a run goes.

    Attributes:
        known: Its rows.
        last: Last known row at which an outermost obligation starts.
        is_cut: Whether obligations lie beyond the trace.
    """

    known: int
    last: int
    is_cut: bool


@dataclass(frozen=True, slots=True)
class Program:
    """A formula for given signals and a given step.

    Attributes:
        names: S signals in the order of ``Tables.signals``.
        tables: Its parts in numbers.
        words: N, what people see.
        conditions: N, as they were read.
    """

    names: tuple[str, ...]
    tables: Tables
    words: tuple[Words, ...]
    conditions: tuple[syntax.Condition, ...]


@dataclass(frozen=True, slots=True)
class _Term:
    """A numbered term with what is known about it beforehand."""

    index: int
    scale: Scale


_PROGRAMS: Final[dict[tuple[Any, ...], Program]] = {}
_MOST_PROGRAMS: Final = 1024


def compile_formula(
    formula: Formula,
    inputs: Mapping[str, Series],
    step_s: float,
    row_slack: float = syntax.ROW_SLACK,
) -> Program:
    """Number the parts of a formula; the same again is remembered.

    Raises:
        ExpressionError: A signal has the wrong kind or dimension, or a window contains no row.
    """
    declared = tuple(
        (
            *(name, series.scale, series.unit, series.kind, series.labels, series.cap),
            *(series.slack, series.is_scaled),
        )
        for name, series in inputs.items()
    )
    key = (formula.text, formula.parameters, declared, step_s, row_slack)
    if key not in _PROGRAMS:
        formula.check(inputs)
        if len(_PROGRAMS) >= _MOST_PROGRAMS:
            _PROGRAMS.clear()
        _PROGRAMS[key] = _Compiler(formula, inputs, step_s, row_slack).program()
    return _PROGRAMS[key]


@dataclass
class _Compiler:
    formula: Formula
    inputs: Mapping[str, Series]
    step_s: float
    row_slack: float
    terms: list[tuple[int, int, int]] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    nodes: list[list[int]] = field(default_factory=list)
    limits: list[tuple[float, ...]] = field(default_factory=list)
    words: list[Words] = field(default_factory=list)
    conditions: list[syntax.Condition] = field(default_factory=list)
    numbers: dict[int, int] = field(default_factory=dict)

    @property
    def is_scaled(self) -> bool:
        """Whether robustness is divided by the scales of the signals."""
        return all(series.is_scaled for series in self.inputs.values())

    def program(self) -> Program:
        self._condition(self.formula.root, is_start=True)
        implied, antecedents, decided = self._implied()
        nested = syntax.nested_implications(self.formula.root)
        signals = [
            (int(series.cap is not None), _KINDS[series.kind], len(series.labels))
            for series in self.inputs.values()
        ]
        tables = Tables(
            signals=np.array(signals, dtype=np.int64).reshape(-1, 3),
            terms=np.array(self.terms, dtype=np.int64).reshape(-1, 3),
            constants=np.array(self.constants, dtype=np.float64),
            nodes=np.array(self.nodes, dtype=np.int64),
            limits=np.array(self.limits, dtype=np.float64),
            implied=np.array(implied, dtype=np.int64).reshape(-1, 5),
            antecedents=np.array(antecedents, dtype=np.int64),
            decided=np.array(decided, dtype=np.int64),
            nested=np.array(
                [(self.numbers[id(node)], self._told_from(node.left)) for node in nested],
                dtype=np.int64,
            ).reshape(-1, 2),
        )
        return Program(tuple(self.inputs), tables, tuple(self.words), tuple(self.conditions))

    def _told_from(self, part: syntax.Condition) -> int:
        def first(window: syntax.Window) -> int:
            return syntax.window_rows(window, self.step_s, self.row_slack)[0]

        return int(syntax.told_from(part, first))

    def _implied(self) -> tuple[list[tuple[int, ...]], list[int], list[int]]:
        implied: list[tuple[int, ...]] = []
        antecedents: list[int] = []
        decided: list[int] = []
        for parts, operator in syntax.find_implications(self.formula.root):
            first, last = 0, -1
            if operator is not None and operator.window is not None:
                first, last = syntax.window_rows(operator.window, self.step_s, self.row_slack)
            first = max(first, *map(self._told_from, parts))
            implied.append((len(antecedents), len(parts), int(operator is not None), first, last))
            numbers = [self.numbers[id(part)] for part in parts]
            antecedents += numbers
            # Of an ``eventually`` any row is enough, also one at which nothing is asked for.
            if operator is None or operator.operator == "always":
                decided += numbers
        return implied, antecedents, decided

    def _condition(self, node: syntax.Condition, *, is_start: bool) -> int:
        row = [0] * 10
        limits: tuple[float, ...] = (0.0, 0.0, 1.0, 0.0, 0.0)
        words = Words(self.formula.quote(node), syntax.names_in(node)[0], syntax.names_in(node))
        if isinstance(node, syntax.PREDICATES):
            row, limits, words = self._predicate(node)
        else:
            goes_on = is_start and isinstance(node, syntax.Not | syntax.Connective)
            parts = [self._condition(child, is_start=goes_on) for child in _conditions(node)]
            row[FIRST_PART], row[SECOND_PART] = parts[0], parts[-1]
            row[KIND] = _CONDITIONS[syntax.head_of(node)]
            window = syntax.window_of(node)
            if window is not None:
                row[FROM_ROW], row[TO_ROW] = syntax.window_rows(window, self.step_s, self.row_slack)
                row[HAS_WINDOW] = 1
        row[IS_START] = int(is_start)
        self.nodes.append(row)
        self.limits.append(limits)
        self.words.append(words)
        self.conditions.append(node)
        self.numbers[id(node)] = len(self.nodes) - 1
        return len(self.nodes) - 1

    def _predicate(self, node: syntax.Predicate) -> tuple[list[int], tuple[float, ...], Words]:
        if isinstance(node, syntax.Assertion):
            return self._word(node, node.name, None, is_negated=False)
        if (
            isinstance(node, syntax.Equality)
            and self.inputs[syntax.names_in(node)[0]].kind != "number"
        ):
            return self._word(node, syntax.names_in(node)[0], node, is_negated=node.is_negated)
        left, right = self._term(node.left), self._term(node.right)
        value, threshold = left.index, right.index
        if isinstance(node.left, syntax.Constant):
            value, threshold = threshold, value
        row = [0] * 10
        row[KIND], row[VALUE], row[THRESHOLD] = COMPARE, value, threshold
        is_comparison = isinstance(node, syntax.Comparison)
        if isinstance(node, syntax.Equality):
            row[KIND], row[FLAG] = EQUAL, int(node.is_negated)
        else:
            row[FLAG] = int(node.operator in {">", "<"})
            if node.operator in {"<", "<="}:
                left, right = right, left
        row[FIRST_PART], row[SECOND_PART] = left.index, right.index
        difference = combined("-", left.scale, right.scale)
        upper, lower = difference.caps
        limits = (
            -np.inf if lower is None or not is_comparison else -lower,
            np.inf if upper is None or not is_comparison else upper,
            difference.divisor if self.is_scaled else 1.0,
            0.0,
            max(self.inputs[name].slack for name in syntax.names_in(node)),
        )
        names, unit = syntax.names_in(node), unit_of(node, self.inputs)
        return row, limits, Words(self.formula.quote(node), names[0], names, unit, unit)

    def _word(
        self,
        node: syntax.Predicate,
        name: str,
        equality: syntax.Equality | None,
        *,
        is_negated: bool,
    ) -> tuple[list[int], tuple[float, ...], Words]:
        row, code = [0] * 10, 1.0
        label = None if equality is None else syntax.label_of(equality)
        first = second = self._load(name).index
        names = syntax.names_in(node)
        if label is not None:
            code = float(label_code(self.inputs[name], label))
        elif equality is not None:
            second, code = self._load(names[-1]).index, -1.0
        row[KIND], row[FLAG] = WORD, int(is_negated)
        row[FIRST_PART], row[SECOND_PART] = first, second
        row[VALUE], row[THRESHOLD] = first, second
        is_truth = self.inputs[name].kind == "boolean"
        seen = Words(
            self.formula.quote(node),
            names[0],
            names,
            empty_unit=unit_of(node, self.inputs),
            values=("false", "true") if is_truth else self.inputs[name].labels,
            is_value_shown=is_truth,
            is_threshold_shown=is_truth and label is None,
        )
        return row, (0.0, 0.0, 1.0, code, 0.0), seen

    def _load(self, name: str) -> _Term:
        series = self.inputs[name]
        load = (SIGNAL, list(self.inputs).index(name), 0)
        # What is read twice is the same term.
        index = self.terms.index(load) if load in self.terms else self._add(*load)
        return _Term(index, Scale(series.scale, caps=(series.cap, None)))

    def _add(self, operation: int, first: int = 0, second: int = 0, value: float = 0.0) -> int:
        self.terms.append((operation, first, second))
        self.constants.append(value)
        return len(self.terms) - 1

    def _term(self, term: syntax.Term) -> _Term:
        if isinstance(term, syntax.Constant):
            index = self._add(CONSTANT, value=term.value)
            return _Term(index, Scale(1.0, term.value))
        if isinstance(term, syntax.Signal):
            return self._load(term.name)
        parts = [self._term(operand) for operand in term.operands]
        result = parts[0]
        if term.operator == "negate":
            return _Term(self._add(NEGATE, result.index), result.scale.opposite)
        if term.operator == "abs":
            return _Term(self._add(SIZE, result.index), result.scale.magnitude)
        for part in parts[1:]:
            index = self._add(_OPERATIONS[term.operator], result.index, part.index)
            result = _Term(index, combined(term.operator, result.scale, part.scale))
        return result


def _conditions(node: syntax.Operator) -> list[syntax.Condition]:
    return [
        part
        for part in syntax.children(node)
        if not isinstance(part, syntax.Constant | syntax.Signal | syntax.Arithmetic)
    ]
