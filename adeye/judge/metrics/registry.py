"""The registry of metrics and the one place where they are computed and checked."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import partial, wraps
from inspect import unwrap
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar, overload

import numpy as np

from adeye.errors import UsageError
from adeye.judge.series import TraceSeries
from adeye.judge.stl.formula import unit_exponents
from adeye.judge.verdict import STATUSES
from adeye.packaged import packaged_yaml
from adeye.ports import MetricColumn
from adeye.supervision import is_asked, told
from adeye.units import UNITS, shown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from adeye.judge.series import SeriesDefinition
    from adeye.signals import Bools, Floats, Ints
    from adeye.trace import Trace

# --- Status words of metrics, and a column of them held as codes ----------------------------------

VALUE, NO_CONFLICT, NOT_APPLICABLE, UNDEFINED, INCOMPLETE, ERROR = STATUSES
CODES: Final = {word: code for code, word in enumerate(STATUSES)}
"""Code of each status; what is not among them has -1."""


class StatusColumn(Sequence[str]):
    """The statuses of B runs: words to read, codes to calculate with.

    Attributes:
        codes: (B,) index into ``STATUSES``.

    >>> column = StatusColumn(np.array([0, 5]))
    >>> column[1], column == ("value", "error")
    ('error', True)
    """

    __slots__ = ("codes",)

    def __init__(self, codes: NDArray[Any]) -> None:
        """Hold codes (B,)."""
        self.codes: NDArray[np.int8] = np.asarray(codes, dtype=np.int8)

    @overload
    def __getitem__(self, index: int) -> str: ...

    @overload
    def __getitem__(self, index: slice) -> StatusColumn: ...

    def __getitem__(self, index: int | slice) -> str | StatusColumn:
        """Give the word of a run, or those of several."""
        if isinstance(index, slice):
            return StatusColumn(self.codes[index])
        return STATUSES[self.codes[index]]

    def __len__(self) -> int:
        """Give the number of runs."""
        return len(self.codes)

    def __iter__(self) -> Iterator[str]:
        """Give the words, run by run."""
        return map(STATUSES.__getitem__, self.codes.tolist())

    def __eq__(self, other: object) -> bool:
        """Compare the words with those of another sequence."""
        return isinstance(other, Sequence) and tuple(self) == tuple(other)

    def __hash__(self) -> int:
        """Hash the words, as a tuple of them would."""
        return hash(tuple(self))

    def __repr__(self) -> str:
        """Show the words."""
        return repr(tuple(self))


def status_codes(words: Sequence[str]) -> NDArray[np.int8]:
    """Give the codes (B,) of statuses; -1 for a word that is none."""
    if isinstance(words, StatusColumn):
        return words.codes
    return np.array([CODES.get(word, -1) for word in words], dtype=np.int8)


# --- The registry of metrics and the one place where they are computed and checked ----------------

Worse = Literal["lower", "higher"]
Measure = Callable[[TraceSeries], MetricColumn]
M = TypeVar("M", bound=type)

_ROUNDING: Final = 1e-6
"""How far a time may lie beyond the last row of its run [s]: it may be calculated."""
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
        plugin: Class from outside the package that it is; empty for one of the package.
        least: No value is below it; None where that is not known.
        most: No value is above it.
        most_per: What ``most`` is of: empty for the run, ``s`` for each second that it lasts,
            ``row`` for each of its rows.
        since_fault: Whether it counts from a fault on, so that a bound on it is about faults.
        of_objects: Whether it is measured of objects, so that a run without any says nothing of it.
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
    plugin: str = ""
    least: float | None = None
    most: float | None = None
    most_per: str = ""
    since_fault: bool = False
    of_objects: bool = False

    def compute(self, trace: Trace) -> MetricColumn:
        """Return one value per run, with the time and the actor of the worst case."""
        return self.measure(TraceSeries(trace))


LONGEST_COLUMN: Final = 56
"""Characters of a column: with the endings of those beside it, as many as PostgreSQL keeps."""
_SOURCES: Final[dict[str, str]] = packaged_yaml("adeye.judge.metrics", "sources.yaml")
METRICS: Final[dict[str, MetricDefinition]] = {}
"""Registered metrics by column."""


def metric_entry(  # noqa: PLR0913 - what a metric declares
    uid: str,
    unit: str,
    worse: Worse,
    series: SeriesDefinition | None = None,
    *,
    column: str | None = None,
    scale: float = 1.0,
    cap: float | None = None,
    settles: bool = False,
    least: float | None = 0.0,
    most: float | None = None,
    most_per: str = "",
    since_fault: bool = False,
    of_objects: bool = False,
) -> Callable[[Measure], Measure]:
    """Register a function over the series of a trace as a metric; its docstring is the text.

    Args:
        uid: See ``MetricDefinition``, as all that is not said here.
        unit: SI unit.
        worse: Direction of danger.
        series: The series whose worst it is, with its source and cap; without, ``sources.yaml`` has
            the source.
        column: By default the name in the uid with the unit: ``min_ttc_s``.
        scale: Size of one unit of robustness.
        cap: Of "no conflict".
        settles: Whether a value is final.
        least: No value is below it.
        most: No value is above it; by default a time that is worse when it is longer is one within
            the run.
        most_per: What ``most`` is of.
        since_fault: Whether it counts from a fault on.
        of_objects: Whether it is measured of objects.
    """
    key = uid.partition(":")[2].partition("@")[0]
    if column is None:
        name = key.partition(".")[2]
        ending = unit.replace("/", "p").replace("²", "2").replace("³", "3")
        column = name if unit == "1" else f"{name}_{ending}"
    publication = _SOURCES[key] if series is None else series.source
    if series is not None:
        cap = series.type.cap
    if most is None and (unit, worse) == ("s", "higher"):
        most, most_per = 1.0, "s"

    def register(measure: Measure) -> Measure:
        text = (measure.__doc__ or "").partition("\n")[0]
        words = (uid, column, unit, worse, publication, text)
        ends = (least, most, most_per, since_fault, of_objects)
        _add(MetricDefinition(*words, scale, measure, cap, settles, "", *ends))
        return measure

    return register


object_entry = partial(metric_entry, of_objects=True)
"""Registers a metric that is measured of objects."""


def register_metric(metric: M) -> M:
    """Register a class as a metric, as a plug-in does; usable as a decorator.

    The class takes no arguments and has, beside what ``ports.Metric`` asks for (``uid``, ``unit``,
    ``worse``, ``source``, ``compute(trace)``), the ``column`` that it is stored under. ``scale``
    (default 1), ``cap``, ``settles``, ``least``, ``most``, ``most_per`` and ``of_objects`` are
    optional, see ``MetricDefinition``.

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
    try:
        built: Any = metric()
        sizes = [getattr(built, name, None) for name in ("scale", "cap", "least", "most")]
        scale, cap, least, most = (None if size is None else float(size) for size in sizes)
    except BaseException as error:
        if is_asked(error):
            raise
        raise UsageError(
            f"metric {metric.__name__} cannot be made: {told(error)}",
            remedy="It takes no arguments; scale, cap, least and most are numbers.",
        ) from error
    # Read once: what is used is what was looked at.
    said = {name: getattr(built, name) for name in _ALLOWED}
    for name, (is_allowed, allowed) in _ALLOWED.items():
        value = said[name]
        if not (type(value) is str and is_allowed(value)):
            raise UsageError(
                f"metric {metric.__name__}: {name} is {shown(value)}",
                remedy=f"Allowed: {allowed}.",
            )

    @wraps(built.compute)
    def measure(series: TraceSeries) -> MetricColumn:
        # It may write into the copy that it is shown, and into nobody else's.
        return built.compute(deepcopy(series.trace))  # type: ignore[no-any-return]  # looked at

    _add(
        MetricDefinition(
            **said,
            text=(metric.__doc__ or "").partition("\n")[0],
            scale=1.0 if scale is None else scale,
            measure=measure,
            cap=cap,
            settles=bool(getattr(built, "settles", False)),
            plugin=f"{metric.__module__}:{metric.__qualname__}",
            least=least,
            most=most,
            most_per=str(getattr(built, "most_per", "")),
            of_objects=bool(getattr(built, "of_objects", False)),
        )
    )
    return metric


_ALLOWED: Final[Mapping[str, tuple[Callable[[str], object], str]]] = {
    "uid": (
        lambda text: (
            re.fullmatch(r"(?!adeye:)[\w.:@/+-]{1,200}", text, re.ASCII)
            and text not in {known.uid for known in METRICS.values()}
        ),
        "letters, digits and _ . : @ / + -, not of another metric, not beginning with adeye:",
    ),
    "column": (
        re.compile(rf"[a-z][a-z0-9_]{{0,{LONGEST_COLUMN - 1}}}").fullmatch,
        f"up to {LONGEST_COLUMN} lower case letters, digits and underscores after a letter",
    ),
    "unit": (
        lambda text: text and unit_exponents(text) is not None,
        f"1 for none, {', '.join(UNITS)}, and their powers and quotients",
    ),
    "worse": (("lower", "higher").__contains__, "lower, higher"),
    "source": (str.strip, "a text"),
}
"""What a class must say of itself: the test of each attribute, and what it allows."""


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
    ends, per = (definition.least, definition.most), definition.most_per
    low, high = (0.0 if end is None else end for end in ends)
    is_known = per in {"", "s", "row"} and np.isfinite((low, high)).all()
    if not (is_known and (None in ends or low < high)):
        raise UsageError(
            f"metric {definition.uid}: least is {ends[0]}, most is {ends[1]}, per {shown(per)}",
            remedy="Both are finite, and least is the smaller one; leave out what is not known. "
            "most_per is s or row, or left out.",
        )
    METRICS[definition.column] = definition


def compute_metrics(
    trace: Trace,
    series: TraceSeries | None = None,
    metrics: Mapping[str, MetricDefinition] = METRICS,
) -> dict[str, MetricColumn]:
    """Compute metrics of B runs.

    Where a metric raises, or gives a number that is not finite or beyond the ends that it declares,
    or a status that does not exist, the run's status is ``error``; each run by itself.

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
        values = _numbers("value", column.value, runs, np.float64)
        times = _numbers("time", column.time, runs, np.float64)
        codes = _numbers("status", status_codes(column.status), runs, np.int8)
        actor = _numbers("actor", column.actor, runs, np.int64)
        _require_known(actor, times, series.trace)
        is_formed = True
    except BaseException as error:
        if is_asked(error):
            raise
        _LOG.error("metric %s raised %s", metric.uid, told(error, unwrap(metric.measure)))
        is_formed = False
    if not is_formed:
        return _one_by_one(metric, series)
    # What is not complete may tell how bad it is at least.
    is_told = np.isin(codes, (CODES[VALUE], CODES[INCOMPLETE]))
    is_wrong = (codes < 0) | ((codes == 0) & ~np.isfinite(values))
    codes[is_wrong | (is_told & _is_beyond(metric, values, series.trace))] = CODES[ERROR]
    values[~np.isfinite(values) | ~np.isin(codes, (CODES[VALUE], CODES[INCOMPLETE]))] = np.nan
    return MetricColumn(values, StatusColumn(codes), times, actor)


def _is_beyond(metric: MetricDefinition, values: Floats, trace: Trace) -> Bools:
    """Tell which values (B,) are none that the metric says it can have, by more than rounding."""
    low = -np.inf if metric.least is None else metric.least
    high: Any = np.inf if metric.most is None else metric.most
    if metric.most is not None and metric.most_per:
        # What counts rows for time counts the last one, too.
        step = trace.time[1] if len(trace.time) > 1 else np.inf
        high = high * trace.length * (step if metric.most_per == "s" else 1.0)
    slack = _ROUNDING * np.maximum(1.0, np.abs(values))
    return np.asarray((values < low - slack) | (values > high + slack))


def _numbers(
    name: str, given: Any, runs: int, kind: type[np.float64 | np.int64 | np.int8]
) -> NDArray[Any]:
    """Copy what a metric gave, one number per run; texts, truths and the like are no numbers."""
    array = np.asarray(given)
    hidden = np.ma.getmaskarray(given) if isinstance(given, np.ma.MaskedArray) else None
    allowed = "iuf" if kind is np.float64 else "iu"
    if array.shape != (runs,) or (runs and array.dtype.kind not in allowed):
        msg = f"{name} is {array.dtype} of shape {array.shape}, not a number for each of {runs}"
        raise TypeError(msg)
    numbers = np.array(array, dtype=kind)
    if hidden is not None and hidden.any():
        if kind is not np.float64:
            msg = f"{name} is masked in {hidden.sum()} of {runs}"
            raise TypeError(msg)
        # Below a mask lies anything; what the metric does not tell is no value.
        numbers[hidden] = np.nan
    return numbers


def _require_known(actor: Ints, times: Floats, trace: Trace) -> None:
    """Refuse objects that are not there, which would be looked up, and times outside of a run."""
    outside = times[(times < 0.0) | (times > trace.time[trace.length - 1] + _ROUNDING)]
    if outside.size:
        msg = f"time is {outside[0]:g} s, which is not in the run"
        raise ValueError(msg)
    unknown = actor[(actor < -1) | (actor >= len(trace.layout.context.object_ids))]
    if unknown.size:
        msg = f"actor names object {unknown[0]}, which is not there"
        raise ValueError(msg)


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
    *,
    is_found: Bools | None = None,
) -> MetricColumn:
    """Make a column of what was found in each run.

    Args:
        series: Series of the trace.
        codes: (B,) index into ``STATUSES``.
        row: (B,) where it was found; not read where the status is not ``value``.
        value: (B,) the same.
        actor: (B,) object; default none.
        is_found: (B,) whether a row and an object belong to the value; default all.
    """
    has_value = codes == CODES[VALUE]
    has_row = has_value if is_found is None else has_value & is_found
    return MetricColumn(
        np.where(has_value, value, np.nan),
        StatusColumn(codes),
        np.where(has_row, series.trace.time[np.where(has_row, row, 0)], np.nan),
        np.where(has_row, -1 if actor is None else actor, -1),
    )


def column_at(
    series: TraceSeries, codes: NDArray[np.integer[Any]], row: Ints, quantity: int
) -> MetricColumn:
    """Make a column of a quantity of ``conflict`` at a row (B,) of each run."""
    runs = np.arange(len(row))
    values, actors = (part[quantity][runs, row] for part in series.worst_conflicts)
    return column_of(series, codes, row, values, actors)
