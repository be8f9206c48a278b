"""The registry of metrics and the one place where they are computed and checked."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar

import numpy as np

from adeye.errors import UsageError
from adeye.evaluation.series import Samples, TraceSeries
from adeye.evaluation.stl.series import SampleStatus
from adeye.kernel.jit import allocating
from adeye.ports import MetricColumn

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats, Ints
    from adeye.trace import Trace

Worse = Literal["lower", "higher"]
Measure = Callable[[TraceSeries], MetricColumn]
M = TypeVar("M", bound=type)

STATUSES: Final = ("value", "no_conflict", "not_applicable", "undefined", "incomplete", "error")
VALUE, NO_CONFLICT, NOT_APPLICABLE, UNDEFINED, INCOMPLETE, ERROR = STATUSES
_CODES: Final = {word: code for code, word in enumerate(STATUSES)}

_SAMPLE_VALUE = int(SampleStatus.VALUE)
_SAMPLE_FREE = int(SampleStatus.NO_CONFLICT)
_SAMPLE_ERROR = int(SampleStatus.ERROR)

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class MetricDefinition:
    """A metric of a run, over all of its rows: the horizon and the tail.

    Attributes:
        uid: Changes whenever the definition does, for example ``adeye:criticality.min_ttc@1``.
        column: Id in tables and bounds, with the suffix of its unit.
        unit: SI unit, ``1`` for none.
        worse: ``lower`` or ``higher``: direction of danger.
        source: Publication or standard.
        text: What it means.
        scale: Size of one unit of robustness in the metric's unit.
        cap: Margin that "no conflict" counts with where it stands for +inf; None where "no
            conflict" stands for 0.
        settles: Whether a value is final once it is there; the others may get worse as long as the
            run lasts, so that a contact leaves a bound that still holds open.
        measure: Computes it from the series of a trace.
    """

    uid: str
    column: str
    unit: str
    worse: Worse
    source: str
    text: str
    scale: float
    measure: Measure
    cap: float | None = None
    settles: bool = False

    def compute(self, trace: Trace) -> MetricColumn:
        """Return one value per run, with the time and the actor of the worst case."""
        return self.measure(TraceSeries(trace))


METRICS: Final[dict[str, MetricDefinition]] = {}
"""Registered metrics by column."""


def metric_entry(  # noqa: PLR0913 - what a metric declares
    uid: str,
    column: str,
    unit: str,
    worse: Worse,
    source: str,
    *,
    scale: float,
    cap: float | None = None,
    settles: bool = False,
) -> Callable[[Measure], Measure]:
    """Register a function over the series of a trace as a metric; its docstring is the text."""

    def register(measure: Measure) -> Measure:
        text = (measure.__doc__ or "").partition("\n")[0]
        _add(
            MetricDefinition(
                uid, column, unit, worse, source, text, scale, measure, cap=cap, settles=settles
            )
        )
        return measure

    return register


def register_metric(metric: M) -> M:
    """Register a class as a metric, as a plug-in does; usable as a decorator.

    The class takes no arguments and has, beside what ``ports.Metric`` asks for (``uid``, ``unit``,
    ``worse``, ``source``, ``compute(trace)``), the ``column`` that it is stored under. ``scale``
    (default 1), ``cap`` and ``settles`` are optional, see ``MetricDefinition``.

    Raises:
        UsageError: Something is missing or not of its kind, or the column is taken.
    """
    attributes = ("uid", "column", "unit", "worse", "source", "compute")
    missing = [name for name in attributes if not hasattr(metric, name)]
    if missing:
        raise UsageError(
            f"metric {metric.__name__} has no {', '.join(missing)}",
            remedy=f"A metric has {', '.join(attributes)}.",
        )
    built: Any = metric()
    if built.worse not in {"lower", "higher"}:
        raise UsageError(
            f"metric {built.uid}: worse is {built.worse!r}", remedy="Allowed: lower, higher."
        )
    _add(
        MetricDefinition(
            uid=built.uid,
            column=built.column,
            unit=built.unit,
            worse=built.worse,
            source=built.source,
            text=(metric.__doc__ or "").partition("\n")[0],
            scale=float(getattr(built, "scale", 1.0)),
            measure=lambda series: built.compute(series.trace),
            cap=getattr(built, "cap", None),
            settles=bool(getattr(built, "settles", False)),
        )
    )
    return metric


def _add(definition: MetricDefinition) -> None:
    known = METRICS.get(definition.column)
    if known is not None:
        raise UsageError(
            f"metric {definition.uid}: column {definition.column!r} belongs to {known.uid}",
            remedy="Give it a column of its own.",
        )
    for name, size in (("scale", definition.scale), ("cap", definition.cap)):
        if size is not None and not 0.0 < size < np.inf:
            raise UsageError(
                f"metric {definition.uid}: {name} is {size}", remedy="It is finite and above 0."
            )
    METRICS[definition.column] = definition


def compute_metrics(
    trace: Trace,
    series: TraceSeries | None = None,
    metrics: Mapping[str, MetricDefinition] = METRICS,
) -> dict[str, MetricColumn]:
    """Compute metrics of B runs.

    Where a metric raises, or gives a number that is not finite or a status that does not exist,
    the run's status is ``error``; each run by itself.

    Args:
        trace: The runs.
        series: Their metric series, if they are measured already.
        metrics: Which metrics, by column.

    Returns:
        Metrics by column.
    """
    measured = series or TraceSeries(trace)
    return {name: _checked(metric, measured) for name, metric in metrics.items()}


def _checked(metric: MetricDefinition, series: TraceSeries) -> MetricColumn:
    runs = series.trace.runs
    try:
        column = metric.measure(series)
        values = np.array(column.value, dtype=np.float64)
        times = np.array(column.time, dtype=np.float64)
        status, actor = list(column.status), [int(index) for index in column.actor]
        is_formed = values.shape == times.shape == (runs,) and len(status) == len(actor) == runs
    except Exception:  # noqa: BLE001 - whatever a plug-in raises is an error of its run
        _LOG.exception("metric %s", metric.uid)
        is_formed = False
    if not is_formed:
        return _one_by_one(metric, series)
    code = np.array([_CODES.get(word, -1) for word in status])
    is_value = code == 0
    for run in np.flatnonzero((code < 0) | (is_value & ~np.isfinite(values))):
        status[run] = ERROR
        is_value[run] = False
    values[~is_value] = np.nan
    return MetricColumn(values, tuple(status), times, tuple(actor))


def _one_by_one(metric: MetricDefinition, series: TraceSeries) -> MetricColumn:
    """Compute each run alone, so that one run's failure stays its own."""
    runs = series.trace.runs
    if runs == 1:
        return MetricColumn(np.array([np.nan]), (ERROR,), np.array([np.nan]), (-1,))
    alone = [_checked(metric, TraceSeries(series.trace.select([run]))) for run in range(runs)]
    return MetricColumn(
        np.concatenate([column.value for column in alone]),
        tuple(column.status[0] for column in alone),
        np.concatenate([column.time for column in alone]),
        tuple(column.actor[0] for column in alone),
    )


def extreme(
    series: TraceSeries, samples: Samples, worse: Worse, *, among: Bools | None = None
) -> MetricColumn:
    """Reduce samples to the worst of each run, the earliest among equals.

    Args:
        series: Series of the trace.
        samples: What is reduced; an error at any row makes the run an error.
        worse: ``lower`` takes the least, ``higher`` the greatest.
        among: (B, T) rows that count; default: every row of the run.

    Returns:
        The worst value; ``no_conflict`` where no row has a value but one is free of conflict,
        ``undefined`` where there is neither.
    """
    nothing = np.ones((series.trace.runs, 0), dtype=np.bool_)
    row, kind = worst_rows(
        series.trace.length,
        samples.values,
        samples.status,
        nothing if among is None else among,
        1.0 if worse == "lower" else -1.0,
    )
    status = np.array(_EXTREMES)[kind]
    return at_rows(series, samples.values, row, status, samples.actor)


_EXTREMES: Final = (UNDEFINED, NO_CONFLICT, VALUE, ERROR)
"""Status of an extreme by the code that ``worst_rows`` gives."""


@allocating
def worst_rows(
    length: Ints,
    values: Floats,
    status: NDArray[np.int8],
    among: Bools,
    sign: float,
) -> tuple[Ints, Ints]:
    """Find the row with the least value of each run, with sign -1 the greatest.

    Args:
        length: (B,) rows that a run has.
        values: (B, T).
        status: (B, T) ``SampleStatus``.
        among: (B, T) rows that count; (B, 0): all.
        sign: 1 or -1.

    Returns:
        Rows (B,), the earliest among equals, and codes (B,) of ``_EXTREMES``.
    """
    rows = np.zeros(length.shape[0], dtype=np.int64)
    kinds = np.zeros(length.shape[0], dtype=np.int64)
    for run in range(length.shape[0]):
        least = np.inf
        for row in range(length[run]):
            if among.shape[1] and not among[run, row]:
                continue
            what = status[run, row]
            if what == _SAMPLE_VALUE:
                kinds[run] = max(kinds[run], 2)
                value = sign * values[run, row]
                if value < least:
                    least = value
                    rows[run] = row
            elif what == _SAMPLE_FREE:
                kinds[run] = max(kinds[run], 1)
            elif what == _SAMPLE_ERROR:
                kinds[run] = 3
    return rows, kinds


def at_rows(
    series: TraceSeries,
    values: Floats,
    row: Ints,
    status: np.ndarray[tuple[int, ...], np.dtype[np.str_]],
    actor: NDArray[np.integer[Any]] | None = None,
) -> MetricColumn:
    """Pick one row of each run.

    Args:
        series: Series of the trace.
        values: (B, T).
        row: (B,) which row; not read where the status is not ``value``.
        status: (B,) words.
        actor: (B, T) object of each sample; default none.
    """
    runs = np.arange(series.trace.runs)
    has_value = status == VALUE
    who = np.full(runs.shape, -1) if actor is None else actor[runs, row]
    return MetricColumn(
        np.where(has_value, values[runs, row], np.nan),
        tuple(status.tolist()),
        np.where(has_value, series.trace.time[row], np.nan),
        tuple(np.where(has_value, who, -1).tolist()),
    )
