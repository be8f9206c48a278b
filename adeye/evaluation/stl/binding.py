"""The binding predicate: where the robustness of one run comes from.

Robustness is a maximum of minima over predicates and rows, so one predicate at one row carries it.
The search goes down the formula, at each operator to the part that decided; ties go to the
earliest row and the leftmost part.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from adeye.evaluation.stl.predicates import predicate_margins, term_values
from adeye.evaluation.stl.semantics import (
    TRUTH_HIGH,
    TRUTH_LOW,
    UNKNOWN,
    Batch,
    Semantics,
    window_rows,
)
from adeye.evaluation.stl.syntax import (
    PREDICATES,
    Arithmetic,
    Assertion,
    Comparison,
    Condition,
    Connective,
    Constant,
    Edge,
    Equality,
    Not,
    Operator,
    Predicate,
    Signal,
    Temporal,
    Term,
    Until,
    label_of,
    names_in,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.evaluation.stl.formula import Formula
    from adeye.evaluation.stl.series import Series

BindingStatus = Literal["value", "no_conflict", "not_applicable", "beyond_trace"]
Value: TypeAlias = float | str | bool | None
Key: TypeAlias = tuple[float, float]
"""What a minimum or maximum compares: truth (-2 false, 0 open, 2 true), then robustness.

Truth and robustness order alike, except where robustness is 0 or where a part is open: then the
parts that leave the formula open are the ones to show.
"""


@dataclass(frozen=True, slots=True)
class BindingPredicate:
    """One predicate at one row of one run.

    Attributes:
        text: The predicate as it was written.
        signal: Its signal, or the first of several.
        row: Row of the trace; None beyond its end.
        time_s: Time of the row [s].
        obligation_row: Row at which the obligation began that it decides.
        obligation_time_s: Its time [s].
        actor: Index of the actor that the sample is about; None if it is about none.
        value: Left side in SI, a truth value or a label; None without a value.
        threshold: Right side, the same way.
        difference: Distance of value and threshold in their unit, positive where it speaks for
            the formula; the cap for "no conflict"; None where nothing is measured.
        unit: Unit of the numbers.
        status: A value, "no conflict", none that applies, or the trace ended before.
    """

    text: str
    signal: str
    row: int | None
    time_s: float | None
    obligation_row: int
    obligation_time_s: float
    actor: int | None
    value: Value
    threshold: Value
    difference: float | None
    unit: str
    status: BindingStatus


@dataclass(frozen=True, slots=True)
class _Place:
    """A condition, a row, which bound of its robustness, and the obligation it belongs to."""

    node: Condition
    row: int
    bound: int
    obligation: int = 0


def find_binding(formula: Formula, batch: Batch, bound: int) -> BindingPredicate:
    """Find the predicate that one run's robustness comes from.

    Args:
        formula: The formula.
        batch: The run, B = 1.
        bound: ``LOW`` or ``HIGH``: which bound of the robustness to explain.

    Returns:
        The binding predicate.
    """
    return _Search(formula, batch).find(bound)


class _Search:
    """Go down a formula on one run."""

    def __init__(self, formula: Formula, batch: Batch) -> None:
        self._formula = formula
        self._batch = batch
        self._semantics = Semantics(batch)
        self._length = int(batch.length[0])

    def find(self, bound: int) -> BindingPredicate:
        place = _Place(self._formula.root, 0, bound)
        is_start = True
        while place.row < self._length and not isinstance(place.node, PREDICATES):
            deeper, is_start = self._step(place.node, place, is_start=is_start)
            if deeper is None:
                break
            place = deeper
        return self._record(place, bound)

    def _key(self, place: _Place, *, is_start: bool = False) -> Key:
        """Rank a place; beyond the trace its bounds are as wide as can be."""
        if is_start:
            state = self._semantics.at_start(place.node)[:, 0]
        elif place.row >= self._length:
            state = UNKNOWN
        else:
            state = self._semantics.at_every_row(place.node)[:, 0, place.row]
        return float(state[TRUTH_LOW] + state[TRUTH_HIGH]), float(state[place.bound])

    def _step(self, node: Operator, place: _Place, *, is_start: bool) -> tuple[_Place | None, bool]:
        """Go to the part that decides; tell whether it is still evaluated as a whole formula."""
        if isinstance(node, Not):
            return _Place(node.operand, place.row, 1 - place.bound, place.obligation), is_start
        if isinstance(node, Connective):
            return self._connective(node, place, is_start=is_start), is_start
        if isinstance(node, Temporal):
            return self._temporal(node, place, is_start=is_start), False
        if isinstance(node, Until):
            return self._until(node, place, is_start=is_start), False
        return self._edge(node, place), False

    def _connective(self, node: Connective, place: _Place, *, is_start: bool) -> _Place:
        right = _Place(node.right, place.row, place.bound, place.obligation)
        left = _Place(node.left, place.row, place.bound, place.obligation)
        right_key = self._key(right, is_start=is_start)
        if node.operator == "implies":
            left = _Place(node.left, place.row, 1 - place.bound, place.obligation)
            left_key = _opposite(self._key(left, is_start=is_start))
            # In a tie, what should have followed says more than what it should have followed.
            return left if left_key > right_key else right
        left_key = self._key(left, is_start=is_start)
        if node.operator == "and":
            return left if left_key <= right_key else right
        return left if left_key >= right_key else right

    def _rows(self, node: Temporal | Until, place: _Place, *, is_start: bool) -> range:
        """List the rows of a window; the first row beyond the trace stands for all of them."""
        if node.window is not None:
            first, last = window_rows(node.window, self._batch.step_s)
        elif is_start:
            is_open = bool(self._batch.is_cut_short[0])
            first, last = 0, self._length if is_open else int(self._batch.last_obligation[0])
        else:
            first, last = 0, self._length
        first, last = place.row + first, place.row + last
        return range(min(first, self._length), min(last, self._length) + 1)

    def _temporal(self, node: Temporal, place: _Place, *, is_start: bool) -> _Place:
        rows = self._rows(node, place, is_start=is_start)
        # One look at all rows: a key per row would evaluate the operand as often.
        state = self._semantics.at_every_row(node.operand)[:, 0]
        known = slice(rows.start, min(rows.stop, self._length))
        truth = (state[TRUTH_LOW] + state[TRUTH_HIGH])[known]
        value = state[place.bound][known]
        if rows.stop > self._length:
            truth = np.append(truth, UNKNOWN[TRUTH_LOW] + UNKNOWN[TRUTH_HIGH])
            value = np.append(value, UNKNOWN[place.bound])
        sign = 1.0 if node.operator == "always" else -1.0
        truth, value = sign * truth, sign * value
        decisive = np.flatnonzero(truth == truth.min())
        row = rows.start + int(decisive[value[decisive].argmin()])
        obligation = row if is_start and node.window is None else place.obligation
        return _Place(node.operand, row, place.bound, obligation)

    def _until(self, node: Until, place: _Place, *, is_start: bool) -> _Place:
        rows = self._rows(node, place, is_start=is_start)
        candidates: list[tuple[Key, _Place]] = []
        held: tuple[Key, _Place] | None = None
        for row in range(place.row, rows.stop):
            right = self._ranked(_Place(node.right, row, place.bound, place.obligation))
            if row in rows:
                candidates.append(_lesser(held, right))
            left = self._ranked(_Place(node.left, row, place.bound, place.obligation))
            held = _lesser(held, left)
        # In a tie, a row that was too late shows what had been broken before it.
        best = max(key for key, _ in candidates)
        ties = [place for key, place in candidates if key == best]
        return ties[0] if best[0] > 0.0 else ties[-1]

    def _ranked(self, place: _Place) -> tuple[Key, _Place]:
        return self._key(place), place

    def _edge(self, node: Edge, place: _Place) -> _Place | None:
        if place.row == 0:
            return None
        is_fall = node.operator == "fall"
        bound = 1 - place.bound if is_fall else place.bound
        now = _Place(node.operand, place.row, bound, place.obligation)
        before = _Place(node.operand, place.row - 1, 1 - bound, place.obligation)
        now_key, before_key = self._key(now), self._key(before)
        if is_fall:
            now_key = _opposite(now_key)
        else:
            before_key = _opposite(before_key)
        return now if now_key <= before_key else before

    def _record(self, place: _Place, bound: int) -> BindingPredicate:
        node, row, step_s = place.node, place.row, self._batch.step_s
        names = names_in(node)
        is_beyond = row >= self._length
        reading = _Reading(status="beyond_trace")
        if not is_beyond:
            reading = read_predicate(node, self._batch, row)
        # A condition under a negation speaks for the formula where it does not hold; its bounds
        # have changed places on the way down exactly then.
        difference = reading.difference
        if difference is not None and place.bound != bound:
            difference = -difference
        return BindingPredicate(
            text=self._formula.quote(node),
            signal=names[0],
            row=None if is_beyond else row,
            time_s=None if is_beyond else row * step_s,
            obligation_row=place.obligation,
            obligation_time_s=place.obligation * step_s,
            actor=None if is_beyond else _actor(names, self._batch.inputs, row),
            value=reading.value,
            threshold=reading.threshold,
            difference=difference,
            unit=reading.unit,
            status=reading.status,
        )


def _opposite(key: Key) -> Key:
    return -key[0], -key[1]


def _lesser(held: tuple[Key, _Place] | None, other: tuple[Key, _Place]) -> tuple[Key, _Place]:
    return other if held is None or other[0] < held[0] else held


@dataclass(frozen=True, slots=True)
class _Reading:
    """What a predicate says at one row."""

    value: Value = None
    threshold: Value = None
    difference: float | None = None
    unit: str = ""
    status: BindingStatus = "value"


def read_predicate(node: Condition, batch: Batch, row: int) -> _Reading:
    """Read the sides of a predicate and their difference at one row of a run, B = 1."""
    inputs = batch.inputs
    if not isinstance(node, PREDICATES):
        # An edge at row 0 is false by definition: nothing is measured.
        return _Reading()
    margins = predicate_margins(node, inputs, (1, batch.rows))
    if margins.is_unknown[0, row]:
        return _Reading(unit=_unit(node, inputs), status="not_applicable")
    if isinstance(node, Assertion):
        return _Reading(value=_word(inputs[node.name], row), threshold=True)
    if isinstance(node, Equality) and inputs[names_in(node)[0]].kind != "number":
        return _read_words(node, inputs, row)
    left, right = node.left, node.right
    if isinstance(left, Constant):
        left, right = right, left
    value, threshold = (
        float(term_values(side, inputs, (1, batch.rows)).values[0, row]) for side in (left, right)
    )
    margin = float(margins.margin[0, row])
    unit = _unit(node, inputs)
    if math.isfinite(value) and math.isfinite(threshold):
        # The margin may have been limited by a cap; people see the whole difference.
        difference = math.copysign(value - threshold, margin)
        return _Reading(value, threshold, difference, unit)
    return _Reading(_finite(value), _finite(threshold), margin, unit, "no_conflict")


def _read_words(node: Equality, inputs: Mapping[str, Series], row: int) -> _Reading:
    names = names_in(node)
    label = label_of(node)
    threshold: Value = _word(inputs[names[-1]], row) if label is None else label
    return _Reading(_word(inputs[names[0]], row), threshold)


def _word(series: Series, row: int) -> bool | str:
    sample = series.values[0, row]
    return bool(sample) if series.kind == "boolean" else series.labels[int(sample)]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _unit(node: Predicate, inputs: Mapping[str, Series]) -> str:
    """Give the unit in which both sides are compared; of a product of signals, it is SI."""
    if isinstance(node, Comparison | Equality):
        for side in (node.left, node.right):
            unit = _term_unit(side, inputs)
            if unit is not None:
                return unit
        return "SI"
    return inputs[node.name].unit


def _term_unit(term: Term, inputs: Mapping[str, Series]) -> str | None:
    """Give the unit of a term that its operations leave as it is; None where they do not."""
    if isinstance(term, Signal):
        return inputs[term.name].unit if term.name in inputs else None
    if isinstance(term, Arithmetic) and term.operator not in {"*", "/"}:
        for operand in term.operands:
            unit = _term_unit(operand, inputs)
            if unit is not None:
                return unit
    return None


def _actor(names: tuple[str, ...], inputs: Mapping[str, Series], row: int) -> int | None:
    """Give the actor of the first signal that is about one."""
    for name in names:
        actors = inputs[name].actor
        if actors is not None and actors[0, row] >= 0:
            return int(actors[0, row])
    return None
