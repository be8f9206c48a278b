"""A formula on a batch of runs as columns: bounds, verdicts and binding predicates of all runs.

The states of one run fit into the cache: for each condition lower and upper bound of robustness
and of truth (-1 false, +1 true) at every row. Truth decides where robustness is exactly 0, as in
``gap > 0 m`` at contact. Rows beyond a run's length are unknown: the bounds are as wide as they
can be.

Source:
    Donze and Maler (2010), "Robust satisfaction of temporal logic over real-valued signals";
    Deshmukh et al. (2017), "Robust online monitoring of signal temporal logic" (intervals).

At row k, what no temporal operator encloses is evaluated at k, and its operators without a window
range over the rows k to the horizon. At row 0 this is what ``evaluate_columns`` finds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

import numpy as np

from adeye.judge.stl import operators
from adeye.judge.stl.descent import find_binding_row
from adeye.judge.stl.measures import NO_STATUS, OPEN, fill_predicate, fill_term
from adeye.judge.stl.program import (
    ALWAYS,
    FIRST_PART,
    IS_START,
    KIND,
    SECOND_PART,
    UNTIL,
    WORD,
    Extent,
    Program,
    State,
    compile_formula,
)
from adeye.judge.stl.syntax import ROW_SLACK, nested_implications, without
from adeye.kernel.jit import allocating, compiled

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from _typeshed import DataclassInstance
    from numpy.typing import NDArray

    from adeye.judge.stl.formula import Formula
    from adeye.judge.stl.program import Tables
    from adeye.judge.stl.series import Series, SignalSource
    from adeye.signals import Bools, Bytes, Floats, Ints


C = TypeVar("C", bound="DataclassInstance")

# --- Compiled: evaluate a numbered formula run by run, all of its conditions at every row ---------


class Runs(NamedTuple):
    """What is known of B runs of up to T rows.

    Attributes:
        length: (B,) rows of each run.
        horizon: (B,) last row at which an outermost obligation may start.
        complete: (B,) whether the scenario was over.
        samples: (S, B, T) of the signals.
        statuses: (S, B, T) ``SampleStatus``, or ``NO_STATUS``.
    """

    length: Ints
    horizon: Ints
    complete: Bools
    samples: Floats
    statuses: Bytes


@allocating
def evaluate_runs(  # noqa: C901 - a kernel over a whole program
    chosen: Bools, runs: Runs, tables: Tables, numbers: Floats, facts: Ints, held: Bytes
) -> None:
    """Evaluate a formula on B runs and find what each robustness comes from.

    Args:
        chosen: (B,) runs to evaluate; the others are left as they are.
        runs: The runs.
        tables: The formula; the binding predicate is none of ``decided``, unless they never held.
        numbers: (B, 5) out: bounds of the robustness; value, threshold and difference of the
            binding predicate, NaN for none.
        facts: (B, 7) out: error, verdict (1 satisfied, -1 violated, 0 open), vacuous, and of the
            binding predicate node, row (-1 beyond the trace), obligation, status.
        held: (B, J) out: whether the antecedent held where a nested implication was asked for.
    """
    nodes, nested, rows = tables.nodes, tables.nested, runs.samples.shape[2]
    state = _empty_state(tables, rows)
    start = state.start
    is_changed = np.zeros(nodes.shape[0], dtype=np.bool_)
    scope = np.zeros((nodes.shape[0] if nested.shape[0] else 0, rows), dtype=np.int8)
    root = nodes.shape[0] - 1
    for run in range(chosen.shape[0]):
        if not chosen[run]:
            continue
        extent = _begin(run, runs, tables, state)
        is_error = False
        for node in range(nodes.shape[0]):
            kind = nodes[node, KIND]
            if kind <= WORD:
                is_error |= fill_predicate(node, tables, extent.known, state)
            elif operators.needs_rows(nodes[node]):
                operators.fill_operator(node, nodes, extent.known, state)
            if nodes[node, IS_START]:
                operators.fill_start(node, nodes, extent, state)
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
        facts[run, 2] = operators.is_vacuous(tables, extent, state)
        if nested.shape[0]:
            operators.find_held(tables, extent, state, scope, held[run])
        numbers[run, 0] = start[root, 0]
        numbers[run, 1] = start[root, 1]
        if tables.decided.shape[0] and not (facts[run, 2] and verdict > 0):
            operators.fill_decided(tables, extent, state, is_changed)
        bound = 1 if verdict < 0 else 0
        find_binding_row(bound, tables, extent, state, numbers[run], facts[run])


@compiled
def _begin(run: int, runs: Runs, tables: Tables, state: State) -> Extent:
    """Calculate the terms at the known rows of a run, and tell how far it goes."""
    known, horizon = runs.length[run], runs.horizon[run]
    for term in range(tables.terms.shape[0]):
        fill_term(term, tables, runs.samples[:, run], runs.statuses[:, run], known, state)
    return Extent(known, min(horizon, known - 1), not runs.complete[run] and horizon > known - 1)


@allocating
def _empty_state(tables: Tables, rows: int) -> State:
    """Make room for what is found out about one run after the other."""
    terms, nodes = tables.terms.shape[0], tables.nodes.shape[0]
    return State(
        np.zeros((terms, rows)),
        np.zeros((terms, rows), dtype=np.int8),
        np.zeros((nodes, 2, rows)),
        np.zeros((nodes, 2, rows), dtype=np.int8),
        np.zeros((nodes, 4)),
        np.zeros(nodes, dtype=np.int8),
        np.zeros((3, rows)),
        np.zeros(rows, dtype=np.int64),
    )


# --- A formula on a batch of runs as columns: bounds, verdicts and binding predicates of all runs -

HELD, NEEDED, SPARE = range(3)
"""What became of an implication below the top level."""
SATISFIED: Final = 1
VIOLATED: Final = -1
UNDECIDED: Final = 0


@dataclass(frozen=True, slots=True)
class StlColumns:
    """What a formula is worth on B runs; NaN stands for no number.

    Attributes:
        robustness_low: (B,) lower bound of robustness, NaN in error.
        robustness_high: (B,) upper bound; equal to the lower unless the trace leaves it open.
        error: (B,) whether a sample was neither a value nor declared.
        verdict: (B,) ``SATISFIED``, ``VIOLATED``, or ``UNDECIDED``, which an error is, too. The
            sign of the robustness decides; at exactly 0 the boolean semantics does.
        vacuous: (B,) whether a top-level implication was never exercised: its antecedent held at
            no obligation.
        nested: (B, J) of the implications below the top level ``HELD``; where the formula is
            satisfied and the antecedent held nowhere that it was asked for, ``NEEDED`` if the
            formula is not satisfied without such implications, else ``SPARE``.
        node: (B,) condition that binds, index into ``program.words``.
        row: (B,) its row, -1 beyond the trace.
        obligation: (B,) row at which the obligation began.
        status: (B,) index into ``descent.BINDING_STATUSES``.
        actor: (B,) index of the object that the sample is about, -1 for none.
        value: (B,) of the binding predicate; a word's code.
        threshold: (B,).
        difference: (B,) of value and threshold, positive where it speaks for the formula; at most
            the cap, beyond which there is no conflict; NaN of what is equal or not.
        program: The formula.
    """

    robustness_low: Floats
    robustness_high: Floats
    error: Bools
    verdict: Ints
    vacuous: Bools
    nested: Ints
    node: Ints
    row: Ints
    obligation: Ints
    status: Ints
    actor: Ints
    value: Floats
    threshold: Floats
    difference: Floats
    program: Program

    def take(self, runs: Ints) -> StlColumns:
        """Choose runs."""
        names = [item.name for item in fields(StlColumns) if item.name != "program"]
        chosen: dict[str, Any] = {name: getattr(self, name)[runs] for name in names}
        return replace(self, **chosen)


def evaluate_columns(  # noqa: PLR0913 - what a formula is evaluated on
    formula: Formula,
    source: SignalSource,
    *,
    step_s: float,
    row_slack: float = ROW_SLACK,
    length: Ints,
    horizon: Ints,
    complete: Bools,
    chosen: Bools,
) -> StlColumns:
    """Evaluate a formula on the chosen ones of B runs of up to T rows.

    An ``always`` or ``eventually`` without a window that no temporal operator encloses ranges over
    the rows 0 to ``horizon``; everything else is evaluated at row 0. Rows from ``length`` on are
    unknown, bounds [-inf, +inf]. If the scenario was over (``complete``), obligations that would
    have started there do not exist; if the trace was cut short, they are open.

    Args:
        formula: The formula.
        source: Its signals, arrays (B, T).
        step_s: Time between rows [s].
        row_slack: Part of a step by which the end of a window may miss a row.
        length: (B,) valid rows of each run, 1 to T.
        horizon: (B,) last row at which an obligation of an outermost operator may start, >= 0.
        complete: (B,) whether the trace ended because the scenario was over.
        chosen: (B,) which runs; the others are open and bind nowhere.

    Returns:
        The result; each run's does not depend on the others.

    Raises:
        ExpressionError: A signal has the wrong kind or dimension, or a window contains no row.
        KeyError: The source lacks a signal.
        ValueError: The arrays do not fit together.
    """
    inputs = checked_inputs(formula, source, step_s, (length, horizon, complete, chosen))
    program = compile_formula(formula, inputs, step_s, row_slack)
    runs = _runs(inputs, length, horizon, complete)

    def run(program: Program, chosen: Bools) -> tuple[Floats, Ints, NDArray[np.int8]]:
        numbers = np.full((len(length), 5), np.nan)
        facts = np.zeros((len(length), 7), dtype=np.int64)
        facts[:, 4] = -1
        held = np.ones((len(length), len(program.tables.nested)), dtype=np.int8)
        chosen = np.asarray(chosen, dtype=np.bool_)
        evaluate_runs(chosen, runs, program.tables, numbers, facts, held)
        return numbers, facts, held

    numbers, facts, held = run(program, chosen)
    nested = np.where(held == 0, NEEDED, HELD)
    nested[(facts[:, 1] != SATISFIED) | (facts[:, 2] != 0)] = HELD
    implications = nested_implications(formula.root)
    for pattern in np.unique(nested[nested.any(axis=1)], axis=0):
        same = (nested == pattern).all(axis=1)
        left_out = {id(implications[place]) for place in np.flatnonzero(pattern)}
        # Programs are known by their text, which quotes are cut from.
        text = f"{formula.text}\n{pattern.tolist()}"
        other = replace(formula, text=text, root=without(formula.root, left_out))
        _, found, _ = run(compile_formula(other, inputs, step_s, row_slack), same)
        nested[same & (found[:, 1] == SATISFIED)] *= SPARE
    return StlColumns(
        robustness_low=numbers[:, 0],
        robustness_high=numbers[:, 1],
        error=facts[:, 0] != 0,
        verdict=facts[:, 1],
        vacuous=facts[:, 2] != 0,
        nested=nested,
        node=facts[:, 3],
        row=facts[:, 4],
        obligation=facts[:, 5],
        status=facts[:, 6],
        actor=_actors(program, inputs, facts[:, 3], facts[:, 4]),
        value=numbers[:, 2],
        threshold=numbers[:, 3],
        difference=numbers[:, 4],
        program=program,
    )


def joined_columns(parts: Sequence[C]) -> C:
    """Join the columns of several batches, each a dataclass of arrays by run."""
    if len(parts) == 1:
        return parts[0]
    names = [item.name for item in fields(parts[0]) if item.name != "program"]
    whole: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in names
    }
    return replace(parts[0], **whole)


def checked_inputs(
    formula: Formula,
    source: SignalSource,
    step_s: float,
    of_runs: tuple[Ints | Bools, ...],
) -> dict[str, Series]:
    """Give the signals of a formula; refuse what compiled code would read beyond.

    Args:
        formula: The formula.
        source: Its signals, arrays (B, T).
        step_s: Time between rows [s].
        of_runs: (B,) length and horizon in rows, and whatever else is told of each run.

    Raises:
        KeyError: The source lacks a signal.
        ValueError: The arrays do not fit together.
    """
    inputs = {name: source.series(name) for name in formula.names}
    if not step_s > 0.0:
        msg = f"step_s is {step_s}, not above 0"
        raise ValueError(msg)
    shapes = {series.values.shape for series in inputs.values()}
    runs = {part.shape for part in of_runs}
    if len(shapes) != 1 or runs != {next(iter(shapes))[:1]}:
        msg = f"series of shapes {sorted(shapes)} do not fit lengths of shapes {sorted(runs)}"
        raise ValueError(msg)
    length, horizon = of_runs[:2]
    rows = next(iter(shapes))[1]
    if np.any(length < 1) or np.any(length > rows) or np.any(horizon < 0):
        msg = "a run needs at least one row, no more than the arrays have, and a horizon >= 0"
        raise ValueError(msg)
    return inputs


def _runs(inputs: Mapping[str, Series], length: Ints, horizon: Ints, complete: Bools) -> Runs:
    """Give runs as compiled code reads them."""
    shape = next(iter(inputs.values())).values.shape
    samples = np.empty((len(inputs), *shape))
    statuses = np.empty(samples.shape, dtype=np.int8)
    for place, series in enumerate(inputs.values()):
        samples[place] = series.values
        statuses[place] = NO_STATUS if series.status is None else series.status
    return Runs(
        np.asarray(length, dtype=np.int64),
        np.asarray(horizon, dtype=np.int64),
        np.asarray(complete, dtype=np.bool_),
        samples,
        statuses,
    )


def _actors(program: Program, inputs: Mapping[str, Series], node: Ints, row: Ints) -> Ints:
    """Give for each run the object of the first signal, at the binding row, that is about one."""
    found = np.full(node.shape, -1, dtype=np.int64)
    if all(series.actor is None for series in inputs.values()):
        return found
    for place in np.unique(node[row >= 0]):
        runs = np.flatnonzero((node == place) & (row >= 0))
        for name in reversed(program.words[place].names):
            actors = inputs[name].actor
            if actors is not None:
                who = actors[runs, row[runs]]
                found[runs[who >= 0]] = who[who >= 0]
    return found


# --- Compiled: the robustness of a formula at every row at which an obligation may start ----------


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
    runs = _runs(inputs, length, horizon, complete)
    out = np.full((2, *runs.samples.shape[1:]), np.nan)
    _fill_rows(runs, program.tables, out)
    return out[0], out[1]


@allocating
def _fill_rows(runs: Runs, tables: Tables, out: Floats) -> None:
    """Write the bounds (2, B, T) of the last condition; see ``evaluate_runs``."""
    nodes = tables.nodes
    state = _empty_state(tables, runs.samples.shape[2])
    bounds = state.bounds
    root = nodes.shape[0] - 1
    for run in range(runs.length.shape[0]):
        extent = _begin(run, runs, tables, state)
        is_error = False
        for node in range(nodes.shape[0]):
            if nodes[node, KIND] <= WORD:
                is_error |= fill_predicate(node, tables, extent.known, state)
            elif operators.is_open_ended(nodes[node]):
                _fill_to_horizon(nodes[node], extent, bounds, bounds[node])
                state.exact[node] = OPEN
            else:
                operators.fill_operator(node, nodes, extent.known, state)
        if not is_error:
            for k in range(extent.last + 1):
                out[0, run, k], out[1, run, k] = bounds[root, 0, k], bounds[root, 1, k]


@compiled
def _fill_to_horizon(node: Ints, extent: Extent, bounds: Floats, out: Floats) -> None:
    """Write the bounds of an outermost operator without a window: from each row to ``last``."""
    kind, first, second = node[KIND], node[FIRST_PART], node[SECOND_PART]
    for plane in range(2):
        most = math.inf if kind == ALWAYS else -math.inf
        if extent.is_cut and plane == (0 if kind == ALWAYS else 1):
            most = -most
        for k in range(extent.last + 1, extent.known):
            out[plane, k] = -math.inf if plane == 0 else math.inf
        for k in range(extent.last, -1, -1):
            here = bounds[first, plane, k]
            if kind == ALWAYS:
                most = min(most, here)
            elif kind == UNTIL:
                most = max(bounds[second, plane, k], min(here, most))
            else:
                most = max(most, here)
            out[plane, k] = most
