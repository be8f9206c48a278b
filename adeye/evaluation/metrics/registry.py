"""The registry of metrics and the one place where they are computed and checked."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar

import numpy as np

from adeye.errors import ASKED_TO_END, UsageError
from adeye.evaluation.metrics.statuses import (
    CODES,
    ERROR,
    STATUSES,
    VALUE,
    StatusColumn,
    status_codes,
)
from adeye.evaluation.series import TraceSeries
from adeye.ports import MetricColumn

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Floats, Ints
    from adeye.trace import Trace

__all__ = [
    "METRICS",
    "STATUSES",
    "MetricDefinition",
    "column_of",
    "compute_metrics",
    "joined",
    "metric_entry",
    "register_metric",
]

Worse = Literal["lower", "higher"]
Measure = Callable[[TraceSeries], MetricColumn]
M = TypeVar("M", bound=type)

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
        least: No value is below it; None where that is not known.
        most: No value is above it.
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
    least: float | None = None
    most: float | None = None

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
    least: float | None = None,
    most: float | None = None,
) -> Callable[[Measure], Measure]:
    """Register a function over the series of a trace as a metric; its docstring is the text."""

    def register(measure: Measure) -> Measure:
        text = (measure.__doc__ or "").partition("\n")[0]
        _add(
            MetricDefinition(
                *(uid, column, unit, worse, source, text, scale, measure, cap, settles, least, most)
            )
        )
        return measure

    return register


def register_metric(metric: M) -> M:
    """Register a class as a metric, as a plug-in does; usable as a decorator.

    The class takes no arguments and has, beside what ``ports.Metric`` asks for (``uid``, ``unit``,
    ``worse``, ``source``, ``compute(trace)``), the ``column`` that it is stored under. ``scale``
    (default 1), ``cap``, ``settles``, ``least`` and ``most`` are optional, see
    ``MetricDefinition``.

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
            least=getattr(built, "least", None),
            most=getattr(built, "most", None),
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
        codes = np.array(status_codes(column.status))
        actor = np.array(column.actor, dtype=np.int64)
        shapes = {values.shape, times.shape, codes.shape, actor.shape}
        is_formed = shapes == {(runs,)}
    except ASKED_TO_END:
        raise
    except BaseException:  # noqa: BLE001 - whatever a plug-in raises is an error of its run
        _LOG.exception("metric %s", metric.uid)
        is_formed = False
    if not is_formed:
        return _one_by_one(metric, series)
    codes[(codes < 0) | ((codes == 0) & ~np.isfinite(values))] = CODES[ERROR]
    values[codes != 0] = np.nan
    return MetricColumn(values, StatusColumn(codes), times, actor)


def _one_by_one(metric: MetricDefinition, series: TraceSeries) -> MetricColumn:
    """Compute each run alone, so that one run's failure stays its own."""
    runs = series.trace.runs
    if runs == 1:
        failed = StatusColumn(np.array([CODES[ERROR]]))
        return MetricColumn(np.array([np.nan]), failed, np.array([np.nan]), np.array([-1]))
    return joined(
        [_checked(metric, TraceSeries(series.trace.select([run]))) for run in range(runs)]
    )


def joined(parts: Sequence[MetricColumn]) -> MetricColumn:
    """Join the columns of a metric for several batches."""
    if len(parts) == 1:
        return parts[0]
    return MetricColumn(
        np.concatenate([part.value for part in parts]),
        StatusColumn(np.concatenate([status_codes(part.status) for part in parts])),
        np.concatenate([part.time for part in parts]),
        np.concatenate([part.actor for part in parts]),
    )


def column_of(
    series: TraceSeries,
    codes: NDArray[np.integer[Any]],
    row: Ints,
    value: Floats,
    actor: NDArray[np.integer[Any]] | None = None,
) -> MetricColumn:
    """Make a column of what was found in each run.

    Args:
        series: Series of the trace.
        codes: (B,) index into ``STATUSES``.
        row: (B,) where it was found; not read where the status is not ``value``.
        value: (B,) the same.
        actor: (B,) object; default none.
    """
    has_value = codes == CODES[VALUE]
    nobody = np.full(len(codes), -1)
    return MetricColumn(
        np.where(has_value, value, np.nan),
        StatusColumn(codes),
        np.where(has_value, series.trace.time[np.where(has_value, row, 0)], np.nan),
        nobody if actor is None else np.where(has_value, actor, -1),
    )
