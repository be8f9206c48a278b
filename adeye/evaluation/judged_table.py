"""A formula on a table: the verdict, what it comes from, and the robustness at every row."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from adeye.errors import InputError, suggest
from adeye.evaluation.rulings import Frame
from adeye.evaluation.stl.check import TRUTH_LABELS
from adeye.evaluation.stl.columns import HELD, NEEDED, evaluate_columns
from adeye.evaluation.stl.formula import parse_formula
from adeye.evaluation.stl.lexer import KEYWORDS
from adeye.evaluation.stl.profile import evaluate_rows
from adeye.evaluation.stl.syntax import last_row, nested_implications
from adeye.evaluation.stl.table import TableSignals, sampling, time_column
from adeye.evaluation.verdict import Verdict
from adeye.kernel.clock import tick_time
from adeye.units import Dimension, parse_quantity, read_quantity, shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.evaluation.judgement import Judgement
    from adeye.evaluation.stl.formula import Formula
    from adeye.evaluation.stl.parser import Parameters
    from adeye.evaluation.stl.table import Table
    from adeye.signals import Floats


@dataclass(frozen=True)
class Reading:
    """How a table is read.

    Attributes:
        time: Column of the times; None: ``time``, ``time_s`` or ``t``.
        units: Unit of a column's numbers, by column; of the time, seconds by default.
        words: Words that a column may have, by column; by default those that occur.
        parameters: Values of what the formula names beside columns: text with a unit, or numbers.
        horizon: Time after the first row until which obligations begin; None: to the last row.
    """

    time: str | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, Sequence[str]] = field(default_factory=dict)
    parameters: Mapping[str, str | float] = field(default_factory=dict)
    horizon: str | None = None


@dataclass(frozen=True)
class JudgedTable:
    """What a formula is on a table.

    Attributes:
        formula: Its text.
        judgement: Verdict, robustness and binding predicate; the time is that of the table.
        step_s: Time between rows [s].
        horizon_s: Time after the first row until which obligations begin [s].
        parameters: Values of the parameters in SI.
        time_s: (T,) times of the table [s].
        robustness_low: (T,) lower bound of the robustness of the formula at each row; NaN behind
            the horizon, and everywhere in error.
        robustness_high: (T,) upper bound.
    """

    formula: str
    judgement: Judgement
    step_s: float
    horizon_s: float
    parameters: Mapping[str, float]
    time_s: Floats
    robustness_low: Floats
    robustness_high: Floats

    @property
    def verdict(self) -> Verdict:
        """PASS, FAIL, INCONCLUSIVE, VACUOUS or ERROR."""
        return self.judgement.verdict

    def __bool__(self) -> bool:
        """Be true if the formula holds, and nothing less."""
        return self.verdict is Verdict.PASS


def judge_table(text: str, table: Table, reading: Reading) -> JudgedTable:
    """Evaluate a formula on a table.

    Args:
        text: The formula; it names columns and parameters.
        table: The table, one row a sample.
        reading: How it is read.

    Raises:
        InputError: The formula, the table or what is told of it cannot be used.
    """
    column = time_column(table, reading.time)
    times, step, row_slack = sampling(table, column, reading.units.get(column, "s"))
    signals = TableSignals(table, reading.units, reading.words, column)
    parameters = _parameters(reading.parameters, table)
    formula = parse_formula(text, parameters=parameters)
    _check_names(formula, table, parameters)
    horizon, row = _horizon(reading.horizon, (step, row_slack), len(times))
    length, complete = np.array([len(times)]), np.array([row < len(times)])
    result = evaluate_columns(
        formula,
        signals,
        step_s=step,
        row_slack=row_slack,
        length=length,
        horizon=np.array([row]),
        complete=complete,
        chosen=np.array([True]),
    )
    low, high = evaluate_rows(
        formula,
        signals,
        step_s=step,
        row_slack=row_slack,
        length=length,
        horizon=np.array([row]),
        complete=complete,
    )
    frame = Frame(step, (), np.array([False]), (None,))
    judgement = frame.judge_formula(result, text).of_run(0)
    assert judgement is not None
    judgement = _named(judgement, formula, result.nested[0].tolist())
    return JudgedTable(
        formula=text,
        judgement=_placed(judgement, signals, formula, times, step),
        step_s=step,
        horizon_s=horizon,
        parameters=dict(formula.parameters),
        time_s=times,
        robustness_low=low[0],
        robustness_high=high[0],
    )


def _parameters(given: Mapping[str, str | float], table: Table) -> Parameters:
    for name in given:
        if name in KEYWORDS or name in TRUTH_LABELS or name in table.columns:
            kind = "a column" if name in table.columns else "a word of the language"
            raise InputError(
                f"parameter {shown(name)} is {kind}, too", remedy="Give it another name."
            )
    return {name: read_quantity(str(value)) for name, value in given.items()}


def _check_names(formula: Formula, table: Table, parameters: Parameters) -> None:
    named = {name for name, _ in formula.parameters}
    for name in parameters:
        if name not in named:
            raise InputError(
                f"the formula does not name parameter {shown(name)}", remedy="Remove it or name it."
            )
    for name in formula.names:
        if name not in table.columns:
            raise InputError(
                f"{table.name} has no column {shown(name)}, which the formula names",
                remedy=suggest(name, table.columns),
            )


def _horizon(text: str | None, grid: tuple[float, float], rows: int) -> tuple[float, int]:
    """Give the horizon and its row; the grid is the step and its slack."""
    if text is None:
        return tick_time(rows - 1, grid[0]), rows - 1
    horizon = parse_quantity(text, Dimension.TIME)
    if horizon < 0.0:
        raise InputError(f"the horizon {shown(text)} is below 0", remedy="Write 0 s or more.")
    return horizon, min(last_row(horizon, *grid), rows)


def _named(judgement: Judgement, formula: Formula, nested: Sequence[int]) -> Judgement:
    """Name the nested implications that this one run never asked for; they may be all there is."""
    detail = judgement.detail
    for node, (at, kind) in zip(
        nested_implications(formula.root), enumerate(nested, start=1), strict=True
    ):
        if kind != HELD and detail is not None:
            detail = detail.replace(
                f"nested implication {at} ",
                f"nested implication {at} ({formula.quote(node.left)}) ",
            )
    if NEEDED not in nested:
        return replace(judgement, detail=detail)
    return replace(
        judgement, verdict=Verdict.VACUOUS, is_exercised=False, margin=None, detail=detail
    )


def _placed(
    judgement: Judgement, signals: TableSignals, formula: Formula, times: Floats, step: float
) -> Judgement:
    """Tell times as the table does, and where a value is missing."""
    if judgement.verdict is Verdict.ERROR:
        missing = signals.missing(formula.names)
        reason = "a calculation in the formula has no finite result, such as a division by 0"
        return replace(judgement, detail=missing or reason)
    if judgement.time_s is None:
        return judgement
    return replace(judgement, time_s=float(times[round(judgement.time_s / step)]))
