"""Compiled: evaluate a numbered formula run by run, all of its conditions at every row.

The states of one run fit into the cache: for each condition lower and upper bound of robustness
and of truth (-1 false, +1 true) at every row. Truth decides where robustness is exactly 0, as in
``gap > 0 m`` at contact. Rows beyond a run's length are unknown: the bounds are as wide as they
can be.

Source:
    Donze and Maler (2010), "Robust satisfaction of temporal logic over real-valued signals";
    Deshmukh et al. (2017), "Robust online monitoring of signal temporal logic" (intervals).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.stl.descent import find_binding_row
from adeye.evaluation.stl.implications import find_held
from adeye.evaluation.stl.measures import fill_predicate, fill_term
from adeye.evaluation.stl.operators import (
    fill_decided,
    fill_operator,
    fill_start,
    is_vacuous,
    needs_rows,
)
from adeye.evaluation.stl.program import (
    IS_START,
    KIND,
    WORD,
)
from adeye.kernel.jit import allocating

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats, Ints

    Bytes = NDArray[np.int8]


@allocating
def evaluate_runs(  # noqa: C901, PLR0913, PLR0917 - a kernel over a whole program
    chosen: Bools,
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
    implied: Ints,
    antecedents: Ints,
    decided: Ints,
    nested: Ints,
    numbers: Floats,
    facts: Ints,
    held: Bytes,
) -> None:
    """Evaluate a formula on B runs and find what each robustness comes from.

    Args:
        chosen: (B,) runs to evaluate; the others are left as they are.
        length: (B,) rows of each run.
        horizon: (B,) last row at which an outermost obligation may start.
        complete: (B,) whether the scenario was over.
        samples: (S, B, T) of the signals.
        statuses: (S, B, T) ``SampleStatus``, or ``NO_STATUS``.
        signals: Like the following, of the ``Program``.
        terms: (K, 3).
        constants: (K,).
        nodes: (N, 10).
        limits: (N, 5).
        implied: (I, 5).
        antecedents: Conditions of the implications.
        decided: Those of them that the binding predicate is none of, unless they never held.
        nested: (J,) implications below the top level.
        numbers: (B, 5) out: bounds of the robustness; value, threshold and difference of the
            binding predicate, NaN for none.
        facts: (B, 7) out: error, verdict (1 satisfied, -1 violated, 0 open), vacuous, and of the
            binding predicate node, row (-1 beyond the trace), obligation, status.
        held: (B, J) out: whether the antecedent held where a nested implication was asked for.
    """
    rows = samples.shape[2]
    values = np.zeros((terms.shape[0], rows))
    flags = np.zeros((terms.shape[0], rows), dtype=np.int8)
    bounds = np.zeros((nodes.shape[0], 2, rows))
    truth = np.zeros((nodes.shape[0], 2, rows), dtype=np.int8)
    start = np.zeros((nodes.shape[0], 4))
    exact = np.zeros(nodes.shape[0], dtype=np.int8)
    scratch = np.zeros((3, rows))
    queue = np.zeros(rows, dtype=np.int64)
    is_changed = np.zeros(nodes.shape[0], dtype=np.bool_)
    scope = np.zeros((nodes.shape[0] if nested.shape[0] else 0, rows), dtype=np.int8)
    root = nodes.shape[0] - 1
    for run in range(length.shape[0]):
        if not chosen[run]:
            continue
        known = length[run]
        last = min(horizon[run], known - 1)
        is_cut = not complete[run] and horizon[run] > known - 1
        for term in range(terms.shape[0]):
            fill_term(term, terms, constants, samples[:, run], statuses[:, run], signals, known,
                       values, flags)  # fmt: skip
        is_error = False
        for node in range(nodes.shape[0]):
            kind = nodes[node, KIND]
            if kind <= WORD:
                is_error |= fill_predicate(
                    node, nodes, limits, values, flags, known, bounds[node], truth[node], exact
                )
            elif needs_rows(nodes[node]):
                fill_operator(node, nodes, known, rows, bounds, truth, exact, scratch, queue)
            if nodes[node, IS_START]:
                fill_start(node, nodes, last, is_cut, bounds, truth, start)
        facts[run, 0] = is_error
        if is_error:
            facts[run, 1] = 0
            facts[run, 2] = 0
            numbers[run, 0] = numbers[run, 1] = math.nan
            continue
        verdict = 0
        if start[root, 2] > 0.0:
            verdict = 1
        elif start[root, 3] < 0.0:
            verdict = -1
        facts[run, 1] = verdict
        facts[run, 2] = is_vacuous(implied, antecedents, known, last, truth, start)
        if nested.shape[0]:
            find_held(nodes, nested, known, last, truth, start, scope, held[run])
        numbers[run, 0] = start[root, 0]
        numbers[run, 1] = start[root, 1]
        if decided.shape[0] and not (facts[run, 2] and verdict > 0):
            fill_decided(nodes, decided, known, rows, last, is_cut, bounds, truth, start, exact,
                         scratch, queue, is_changed)  # fmt: skip
        find_binding_row(
            1 if verdict < 0 else 0, nodes, limits, known, last, is_cut, values, flags, bounds,
            truth, start, numbers[run], facts[run],
        )  # fmt: skip
