"""Compiled: the robustness of a formula at every row at which an obligation may start.

At row k, what no temporal operator encloses is evaluated at k, and its operators without a window
range over the rows k to the horizon. At row 0 this is what ``evaluate_columns`` finds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.stl.columns import checked_inputs, stacked
from adeye.evaluation.stl.measures import OPEN, fill_predicate, fill_term
from adeye.evaluation.stl.operators import fill_operator, is_open_ended
from adeye.evaluation.stl.program import (
    ALWAYS,
    FIRST_PART,
    KIND,
    SECOND_PART,
    UNTIL,
    WORD,
    compile_formula,
)
from adeye.evaluation.stl.syntax import ROW_SLACK
from adeye.kernel.jit import allocating, compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.evaluation.stl.formula import Formula
    from adeye.evaluation.stl.series import SignalSource
    from adeye.signals import Bools, Floats, Ints

    Bytes = NDArray[np.int8]


def evaluate_rows(  # noqa: PLR0913 - what a formula is evaluated on
    formula: Formula,
    source: SignalSource,
    *,
    step_s: float,
    row_slack: float = ROW_SLACK,
    length: Ints,
    horizon: Ints,
    complete: Bools,
) -> tuple[Floats, Floats]:
    """Evaluate a formula at every row of B runs of up to T rows.

    Args:
        formula: The formula.
        source: Its signals, arrays (B, T).
        step_s: Time between rows [s].
        row_slack: Part of a step by which the end of a window may miss a row.
        length: (B,) valid rows of each run, 1 to T.
        horizon: (B,) last row at which an obligation of an outermost operator may start, >= 0.
        complete: (B,) whether the trace ended because the scenario was over.

    Returns:
        Lower and upper bound of the robustness (B, T); NaN behind the horizon, from ``length`` on,
        and everywhere in a run with an error.

    Raises:
        ExpressionError: A signal has the wrong kind or dimension, or a window contains no row.
        KeyError: The source lacks a signal.
        ValueError: The arrays do not fit together.
    """
    inputs = checked_inputs(formula, source, step_s, (length, horizon, complete))
    program = compile_formula(formula, inputs, step_s, row_slack)
    samples, statuses = stacked(inputs)
    out = np.full((2, *samples.shape[1:]), np.nan)
    _fill_rows(
        np.asarray(length, dtype=np.int64),
        np.asarray(horizon, dtype=np.int64),
        np.asarray(complete, dtype=np.bool_),
        samples,
        statuses,
        program.signals,
        program.terms,
        program.constants,
        program.nodes,
        program.limits,
        out,
    )
    return out[0], out[1]


@allocating
def _fill_rows(  # noqa: PLR0913, PLR0917 - a kernel over a whole program
    length: Ints,
    horizon: Ints,
    complete: Bools,
    samples: Floats,
    statuses: Bytes,
    signals: Ints,
    terms: Ints,
    constants: Floats,
    nodes: Ints,
    limits: Floats,
    out: Floats,
) -> None:
    """Write the bounds (2, B, T) of the last condition; see ``machine.evaluate_runs``."""
    rows = samples.shape[2]
    values = np.zeros((terms.shape[0], rows))
    flags = np.zeros((terms.shape[0], rows), dtype=np.int8)
    bounds = np.zeros((nodes.shape[0], 2, rows))
    truth = np.zeros((nodes.shape[0], 2, rows), dtype=np.int8)
    exact = np.zeros(nodes.shape[0], dtype=np.int8)
    scratch = np.zeros((3, rows))
    queue = np.zeros(rows, dtype=np.int64)
    root = nodes.shape[0] - 1
    for run in range(length.shape[0]):
        known = length[run]
        last = min(horizon[run], known - 1)
        is_cut = not complete[run] and horizon[run] > known - 1
        for term in range(terms.shape[0]):
            fill_term(term, terms, constants, samples[:, run], statuses[:, run], signals, known,
                       values, flags)  # fmt: skip
        is_error = False
        for node in range(nodes.shape[0]):
            if nodes[node, KIND] <= WORD:
                is_error |= fill_predicate(
                    node, nodes, limits, values, flags, known, bounds[node], truth[node], exact
                )
            elif is_open_ended(nodes[node]):
                _fill_to_horizon(nodes[node], known, last, is_cut, bounds, bounds[node])
                exact[node] = OPEN
            else:
                fill_operator(node, nodes, known, rows, bounds, truth, exact, scratch, queue)
        if not is_error:
            for k in range(last + 1):
                out[0, run, k], out[1, run, k] = bounds[root, 0, k], bounds[root, 1, k]


@compiled
def _fill_to_horizon(
    node: Ints,
    known: int,
    last: int,
    is_cut: bool,  # noqa: FBT001 - compiled
    bounds: Floats,
    out: Floats,
) -> None:
    """Write the bounds of an outermost operator without a window: from each row to ``last``."""
    kind, first, second = node[KIND], node[FIRST_PART], node[SECOND_PART]
    for plane in range(2):
        most = math.inf if kind == ALWAYS else -math.inf
        if is_cut and plane == (0 if kind == ALWAYS else 1):
            most = -most
        for k in range(last + 1, known):
            out[plane, k] = -math.inf if plane == 0 else math.inf
        for k in range(last, -1, -1):
            here = bounds[first, plane, k]
            if kind == ALWAYS:
                most = min(most, here)
            elif kind == UNTIL:
                most = max(bounds[second, plane, k], min(here, most))
            else:
                most = max(most, here)
            out[plane, k] = most
