"""Evaluate a formula on a batch of traces: robustness, satisfaction, vacuity, binding predicate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.stl.binding import BindingPredicate, find_binding
from adeye.evaluation.stl.semantics import (
    HIGH,
    LOW,
    TRUTH_HIGH,
    TRUTH_LOW,
    Batch,
    Semantics,
    window_rows,
)
from adeye.evaluation.stl.syntax import Condition, Connective, Temporal
from adeye.evaluation.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from adeye.evaluation.stl.formula import Formula
    from adeye.evaluation.stl.series import SignalSource
    from adeye.signals import Bools, Floats, Ints

SATISFIED: Final = 1
VIOLATED: Final = -1
UNDECIDED: Final = 0


@dataclass(frozen=True, slots=True)
class StlResult:
    """What a formula is worth on each of B runs.

    Attributes:
        robustness_low: (B,) lower bound of robustness, NaN where ``error``.
        robustness_high: (B,) upper bound; equal to the lower unless the trace leaves it open.
        verdict: (B,) int8: SATISFIED (1), VIOLATED (-1), UNDECIDED (0), which an error is, too.
            The sign of the robustness decides; at exactly 0 the boolean semantics does.
        vacuous: (B,) whether a top-level implication was never exercised: its antecedent held at
            no obligation.
        error: (B,) whether a sample was neither a value nor declared.
        formula: The formula.
        batch: The runs.
    """

    robustness_low: Floats
    robustness_high: Floats
    verdict: NDArray[np.int8]
    vacuous: Bools
    error: Bools
    formula: Formula
    batch: Batch

    def verdict_of(self, b: int) -> Verdict:
        """Give the verdict of run b, before any rule about contact or numeric uncertainty."""
        if self.error[b]:
            return Verdict.ERROR
        if self.verdict[b] == VIOLATED:
            return Verdict.FAIL
        if self.verdict[b] == UNDECIDED:
            return Verdict.INCONCLUSIVE
        return Verdict.VACUOUS if self.vacuous[b] else Verdict.PASS

    def binding(self, b: int) -> BindingPredicate | None:
        """Find the predicate, row and actor that the robustness of run b comes from.

        Returns:
            The binding predicate; None for a run with an error.
        """
        if self.error[b]:
            return None
        bound = HIGH if self.verdict[b] == VIOLATED else LOW
        return find_binding(self.formula, _one_run(self.batch, b), bound)


def evaluate(
    formula: Formula,
    source: SignalSource,
    *,
    step_s: float,
    length: Ints,
    horizon: Ints,
    complete: Bools,
) -> StlResult:
    """Evaluate a formula on B runs of up to T rows.

    An ``always`` or ``eventually`` without a window that no temporal operator encloses ranges over
    the rows 0 to ``horizon``; everything else is evaluated at row 0. Rows from ``length`` on are
    unknown, bounds [-inf, +inf]. If the scenario was over (``complete``), obligations that would
    have started there do not exist; if the trace was cut short, they are open.

    Args:
        formula: The formula.
        source: Its signals, arrays (B, T).
        step_s: Time between rows [s].
        length: (B,) valid rows of each run, 1 to T.
        horizon: (B,) last row at which an obligation of an outermost operator may start, >= 0.
        complete: (B,) whether the trace ended because the scenario was over.

    Returns:
        The result; each run's does not depend on the others.

    Raises:
        ExpressionError: A signal has the wrong kind or dimension, or a window contains no row.
        KeyError: The source lacks a signal.
        ValueError: The arrays do not fit together.
    """
    inputs = {name: source.series(name) for name in formula.names}
    formula.check(inputs)
    shapes = {series.values.shape for series in inputs.values()}
    batch = Batch(
        inputs,
        step_s,
        np.asarray(length, dtype=np.int64),
        np.asarray(horizon, dtype=np.int64),
        np.asarray(complete, dtype=bool),
        rows=next(iter(shapes))[1],
    )
    _check_batch(batch, shapes)
    return _evaluate(formula, batch)


def _check_batch(batch: Batch, shapes: set[tuple[int, ...]]) -> None:
    runs = {batch.horizon.shape, batch.is_complete.shape, batch.length.shape}
    if shapes != {(batch.runs, batch.rows)} or runs != {(batch.runs,)}:
        msg = f"series of shapes {sorted(shapes)} do not fit lengths of shapes {sorted(runs)}"
        raise ValueError(msg)
    if not batch.step_s > 0.0:
        msg = f"step_s is {batch.step_s}, not above 0"
        raise ValueError(msg)
    if np.any(batch.length < 1) or np.any(batch.length > batch.rows) or np.any(batch.horizon < 0):
        msg = "a run needs at least one row, no more than the arrays have, and a horizon >= 0"
        raise ValueError(msg)


def _evaluate(formula: Formula, batch: Batch) -> StlResult:
    implications = list(_implications(formula.root))
    semantics = Semantics(batch, frozenset(c for parts, _ in implications for c in parts))
    state = semantics.at_start(formula.root)
    vacuous = np.zeros(batch.runs, dtype=bool)
    for antecedents, operator in implications:
        vacuous |= ~_is_exercised(semantics, antecedents, operator)
    error = semantics.error
    verdict = np.where(
        state[TRUTH_LOW] > 0.0, SATISFIED, np.where(state[TRUTH_HIGH] < 0.0, VIOLATED, UNDECIDED)
    )
    return StlResult(
        robustness_low=np.where(error, np.nan, state[LOW]),
        robustness_high=np.where(error, np.nan, state[HIGH]),
        verdict=np.where(error, UNDECIDED, verdict).astype(np.int8),
        vacuous=vacuous & ~error,
        error=error,
        formula=formula,
        batch=batch,
    )


Implication = tuple[tuple[Condition, ...], Temporal | None]
"""Antecedents that must hold at one row together, and the operator whose obligations they are."""


def _implications(root: Condition, operator: Temporal | None = None) -> Iterator[Implication]:
    """Find the implications at the top level, joined by ``and``, of the formula and its always."""
    match root:
        case Connective(operator="and"):
            yield from _implications(root.left, operator)
            yield from _implications(root.right, operator)
        case Connective(operator="implies"):
            antecedents = [root.left]
            consequent = root.right
            while isinstance(consequent, Connective) and consequent.operator == "implies":
                antecedents.append(consequent.left)
                consequent = consequent.right
            yield tuple(antecedents), operator
        case Temporal() if operator is None:
            yield from _implications(root.operand, root)


def _is_exercised(
    semantics: Semantics, antecedents: tuple[Condition, ...], operator: Temporal | None
) -> Bools:
    batch = semantics.batch
    if operator is None:
        truths = [semantics.at_start(node)[TRUTH_LOW] > 0.0 for node in antecedents]
        return np.asarray(np.all(truths, axis=0))
    first, last = 0, batch.last_obligation
    if operator.window is not None:
        first, end = window_rows(operator.window, batch.step_s)
        last = np.full_like(last, end)
    return semantics.held(antecedents, first, last)


def _one_run(batch: Batch, b: int) -> Batch:
    one = slice(b, b + 1)
    inputs = {name: series.run(b) for name, series in batch.inputs.items()}
    return Batch(
        inputs,
        batch.step_s,
        batch.length[one],
        batch.horizon[one],
        batch.is_complete[one],
        batch.rows,
    )
