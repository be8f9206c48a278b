"""Interval semantics: the robustness of every part of a formula at every row of B runs.

A state is an array (4, B, T): lower and upper bound of robustness, lower and upper bound of truth
(-1 false, +1 true). The truth planes decide where robustness is exactly 0, as in ``gap > 0 m`` at
contact. Rows beyond a run's length are unknown: the bounds are as wide as they can be.

Source:
    Donze and Maler (2010), "Robust satisfaction of temporal logic over real-valued signals";
    Deshmukh et al. (2017), "Robust online monitoring of signal temporal logic" (intervals);
    Donze, Ferrere and Maler (2013), "Efficient robust monitoring for STL" (until, lemma 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import ExpressionError
from adeye.evaluation.stl.kernels import sliding_maxima, untils_without_end
from adeye.evaluation.stl.predicates import predicate_margins
from adeye.evaluation.stl.syntax import (
    Condition,
    Connective,
    Edge,
    Not,
    Predicate,
    Temporal,
    Until,
    Window,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.evaluation.stl.series import Series
    from adeye.signals import Bools, Floats, Ints

LOW, HIGH, TRUTH_LOW, TRUTH_HIGH = range(4)
UNKNOWN: Final[Floats] = np.array([-np.inf, np.inf, -1.0, 1.0])
"""State of a row about which nothing is known."""

_NEGATED: Final = [HIGH, LOW, TRUTH_HIGH, TRUTH_LOW]
_ROW_SLACK = 1e-6
"""Part of a step by which a window bound may miss a row, for bounds such as 0.3 s at 0.1 s."""


def window_rows(window: Window, step_s: float) -> tuple[int, int]:
    """Give the first and last row of a window after its start.

    Raises:
        ExpressionError: The window lies between two rows and contains none.
    """
    first = math.ceil(window.first_s / step_s - _ROW_SLACK)
    last = math.floor(window.last_s / step_s + _ROW_SLACK)
    if first > last:
        raise ExpressionError(
            f"the window from {window.first_s:g} s to {window.last_s:g} s contains no row at a "
            f"step of {step_s:g} s",
            remedy="Widen the window or reduce the step.",
        )
    return first, last


def negate(state: Floats) -> Floats:
    """Negate a state; the bounds change places."""
    return np.asarray(-state[_NEGATED])


def implication(left: Floats, right: Floats) -> Floats:
    """Combine the states of ``left implies right``."""
    return np.asarray(np.maximum(negate(left), right))


@dataclass(frozen=True, slots=True)
class Batch:
    """The runs that a formula is evaluated on.

    Attributes:
        inputs: Series by name, arrays (B, T).
        step_s: Time between rows [s].
        length: (B,) known rows, at least 1.
        horizon: (B,) last row at which an obligation of an outermost operator may start.
        is_complete: (B,) whether the trace ended because the scenario was over.
        rows: T.
    """

    inputs: Mapping[str, Series]
    step_s: float
    length: Ints
    horizon: Ints
    is_complete: Bools
    rows: int

    @property
    def runs(self) -> int:
        """B."""
        return int(self.length.shape[0])

    @property
    def is_known(self) -> Bools:
        """(B, T) whether a row lies within its run."""
        return np.asarray(np.arange(self.rows) < self.length[:, None])

    @property
    def last_obligation(self) -> Ints:
        """(B,) last known row at which an outermost obligation starts."""
        return np.minimum(self.horizon, self.length - 1)

    @property
    def is_cut_short(self) -> Bools:
        """(B,) whether obligations that should have started lie beyond the trace."""
        return np.asarray(~self.is_complete & (self.horizon > self.length - 1))


class Semantics:
    """Evaluate the parts of formulas on one batch.

    Attributes:
        error: (B,) whether a predicate met a sample that is neither a value nor declared.
    """

    def __init__(self, batch: Batch, keep: frozenset[Condition] | None = None) -> None:
        """Prepare an evaluation that remembers the states of ``keep``, or of every part."""
        self.batch = batch
        self.error: Bools = np.zeros(batch.runs, dtype=bool)
        self._keep = keep
        self._kept: dict[Condition, Floats] = {}
        self._lengths = np.tile(batch.length.astype(np.int64), 4)
        self._beyond = np.repeat(UNKNOWN, batch.runs)

    def at_every_row(self, node: Condition) -> Floats:
        """Give the state (4, B, T) of a condition at every row.

        Operators without a window reach to the end of time, of which the trace shows a part.
        """
        if node in self._kept:
            return self._kept[node]
        state = self._evaluate(node)
        if self._keep is None or node in self._keep:
            self._kept[node] = state
        return state

    def at_start(self, node: Condition) -> Floats:
        """Give the state (4, B) of a whole formula.

        Operators without a window that no temporal operator encloses range over the rows
        0 to ``horizon``; everything else is evaluated at row 0.
        """
        match node:
            case Not():
                return negate(self.at_start(node.operand))
            case Connective():
                left, right = self.at_start(node.left), self.at_start(node.right)
                return _connect(node.operator, left, right)
            case Temporal(window=None):
                return self._over_obligations(node)
            case Until(window=None):
                return self._until_horizon(node)
            case _:
                return np.asarray(self.at_every_row(node)[..., 0])

    def held(self, nodes: tuple[Condition, ...], first: int, last: Ints) -> Bools:
        """Tell for each run whether conditions certainly hold together at a row of first to last.

        Args:
            nodes: The conditions.
            first: First row.
            last: (B,) last row.
        """
        row = np.arange(self.batch.rows)
        chosen = (row >= first) & (row <= last[:, None]) & self.batch.is_known
        for node in nodes:
            chosen = chosen & (self.at_every_row(node)[TRUTH_LOW] > 0.0)
        return np.asarray(chosen.any(axis=1))

    def _evaluate(self, node: Condition) -> Floats:
        match node:
            case Not():
                return negate(self.at_every_row(node.operand))
            case Connective():
                left, right = self.at_every_row(node.left), self.at_every_row(node.right)
                return _connect(node.operator, left, right)
            case Edge():
                operand = self.at_every_row(node.operand)
                return self._rise(operand if node.operator == "rise" else negate(operand))
            case Temporal():
                return self._temporal(node)
            case Until():
                return self._until(node)
            case _:
                return self._predicate(node)

    def _predicate(self, node: Predicate) -> Floats:
        batch = self.batch
        margins = predicate_margins(node, batch.inputs, (batch.runs, batch.rows))
        self.error |= (margins.is_error & batch.is_known).any(axis=1)
        truth = np.where(margins.is_true, 1.0, -1.0)
        state = np.stack([margins.robustness, margins.robustness, truth, truth])
        is_open = margins.is_unknown | margins.is_error | ~batch.is_known
        return np.asarray(np.where(is_open, UNKNOWN[:, None, None], state))

    def _rise(self, state: Floats) -> Floats:
        """Hold where a condition holds and did not at the row before; never at row 0."""
        result = np.full_like(state, -1.0)
        result[..., 1:] = np.minimum(state[..., 1:], negate(state[..., :-1]))
        return np.asarray(np.where(self.batch.is_known, result, UNKNOWN[:, None, None]))

    def _temporal(self, node: Temporal) -> Floats:
        operand = self.at_every_row(node.operand)
        # always = not eventually not
        is_always = node.operator == "always"
        state = self._eventually(negate(operand) if is_always else operand, node.window)
        return negate(state) if is_always else state

    def _eventually(self, state: Floats, window: Window | None) -> Floats:
        first, last = (
            (0, self.batch.rows) if window is None else window_rows(window, self.batch.step_s)
        )
        return self._maximum(state, first, last)

    def _maximum(self, state: Floats, first: int, last: int) -> Floats:
        flat = np.ascontiguousarray(state).reshape(-1, self.batch.rows)
        result = np.empty_like(flat)
        sliding_maxima(flat, self._lengths, first, last, self._beyond, result)
        return result.reshape(state.shape)

    def _until(self, node: Until) -> Floats:
        left, right = self.at_every_row(node.left), self.at_every_row(node.right)
        endless = self._until_rows(left, right, self._lengths, self._beyond)
        if node.window is None:
            return endless
        first, last = window_rows(node.window, self.batch.step_s)
        state = np.minimum(self._maximum(right, first, last), self._shifted(endless, first))
        if first > 0:
            before = negate(self._maximum(negate(left), 0, first - 1))
            state = np.minimum(state, before)
        return np.asarray(state)

    def _shifted(self, state: Floats, rows: int) -> Floats:
        result = np.empty_like(state)
        result[:] = UNKNOWN[:, None, None]
        if rows < self.batch.rows:
            result[..., : self.batch.rows - rows] = state[..., rows:]
        return result

    def _until_rows(self, left: Floats, right: Floats, lengths: Ints, beyond: Floats) -> Floats:
        shape = (-1, self.batch.rows)
        before = np.ascontiguousarray(left).reshape(shape)
        after = np.ascontiguousarray(right).reshape(shape)
        result = np.empty_like(before)
        untils_without_end(before, after, lengths, beyond, result)
        return result.reshape(left.shape)

    def _over_obligations(self, node: Temporal) -> Floats:
        operand = self.at_every_row(node.operand)
        is_always = node.operator == "always"
        state = negate(operand) if is_always else operand
        row = np.arange(self.batch.rows)
        is_obligation = row <= self.batch.last_obligation[:, None]
        most = np.where(is_obligation, state, -np.inf).max(axis=2)
        most = np.maximum(most, self._beyond_horizon())
        return negate(most) if is_always else np.asarray(most)

    def _beyond_horizon(self) -> Floats:
        """Give the largest state (4, B) of the obligations that lie beyond the trace."""
        nothing = np.array([-np.inf, -np.inf, -1.0, -1.0])[:, None]
        return np.where(self.batch.is_cut_short, UNKNOWN[:, None], nothing)

    def _until_horizon(self, node: Until) -> Floats:
        left, right = self.at_every_row(node.left), self.at_every_row(node.right)
        lengths = np.tile(self.batch.last_obligation + 1, 4)
        beyond = self._beyond_horizon().reshape(-1)
        return np.asarray(self._until_rows(left, right, lengths, beyond)[..., 0])


def _connect(operator: str, left: Floats, right: Floats) -> Floats:
    if operator == "implies":
        return implication(left, right)
    return np.asarray(np.minimum(left, right) if operator == "and" else np.maximum(left, right))
