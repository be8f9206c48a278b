"""The signals of a run that a report plots: what every run has, and what its verdicts are about."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.metrics import METRICS
from adeye.evaluation.stl.formula import parse_formula
from adeye.evaluation.stl.series import SampleStatus, Series
from adeye.report.replay import SignalPlot, ThresholdLine

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from adeye.evaluation.source import TraceSignals
    from adeye.spec.concept import Requirement
    from adeye.store.rows import VerdictRecord

ALWAYS = (
    "ego.speed",
    "ego.acceleration",
    "any_actor.distance",
    "ttc",
    "time_headway",
    "required_deceleration",
    "ego.lane_offset",
)
"""Signals that are plotted for every run, where it has them."""

MAX_PLOTS = 14
DECIMALS = 3
NUMBER = "number"


def plots_of(
    signals: TraceSignals,
    run: int,
    requirements: Iterable[Requirement],
    verdicts: Mapping[str, VerdictRecord],
) -> tuple[SignalPlot, ...]:
    """Choose and cut the signals of one run.

    Args:
        signals: Of the trace that the run is in.
        run: Its row.
        requirements: FSRs that were judged on it.
        verdicts: Their verdicts, by FSR.
    """
    lines: dict[str, list[ThresholdLine]] = {}
    names = dict.fromkeys(name for name in ALWAYS if name in signals.dictionary)
    for item in requirements:
        record = verdicts.get(item.id)
        if record is None:
            continue
        for name in _signals(item):
            if name in signals.dictionary:
                names[name] = None
        if record.signal is not None and record.threshold is not None:
            line = _line(item, record)
            if line is not None:
                lines.setdefault(_plotted(item, record.signal), []).append(line)
    chosen = list(names)[:MAX_PLOTS]
    return tuple(_plot(signals.series(name), name, signals, run, lines) for name in chosen)


def _signals(item: Requirement) -> Iterator[str]:
    if item.formula is not None:
        yield from sorted(parse_formula(item.formula, parameters=item.constants).names)
    elif item.bound is not None:
        series = _series_of(item.bound.metric)
        if series is not None:
            yield series


def _series_of(metric: str) -> str | None:
    """Name the series that a metric is the extreme of, if it is one.

    >>> _series_of("max_required_deceleration_mps2")
    'required_deceleration'
    """
    if metric not in METRICS:
        return None
    stem = metric.removeprefix("min_").removeprefix("max_").rpartition("_")[0]
    known = {
        "ttc": "ttc",
        "time_headway": "time_headway",
        "drac": "drac",
        "required_deceleration": "required_deceleration",
        "distance": "any_actor.distance",
        "jerk": "jerk",
        "lane_offset": "ego.lane_offset",
    }
    return known.get(stem)


def _plotted(item: Requirement, signal: str) -> str:
    if item.bound is not None:
        return _series_of(item.bound.metric) or signal
    return signal


def _line(item: Requirement, record: VerdictRecord) -> ThresholdLine | None:
    assert record.threshold is not None
    if item.bound is not None:
        side = "at_least" if item.bound.at_least is not None else "at_most"
    elif record.predicate and ">" in record.predicate:
        side = "at_least"
    elif record.predicate and "<" in record.predicate:
        side = "at_most"
    else:
        return None
    return ThresholdLine.model_validate({"fsr": item.id, "value": record.threshold, "side": side})


def _plot(
    series: Series,
    name: str,
    signals: TraceSignals,
    run: int,
    lines: Mapping[str, list[ThresholdLine]],
) -> SignalPlot:
    rows = int(signals.trace.length[run])
    values = np.asarray(series.values[run, :rows], dtype=np.float64)
    known = np.isfinite(values)
    if series.status is not None:
        known &= series.status[run, :rows] == SampleStatus.VALUE
    rounded = np.round(values, DECIMALS) + 0.0
    kind = signals.dictionary[name]
    labels = kind.labels if kind.kind != NUMBER else ()
    if kind.kind == "boolean":
        labels = ("false", "true")
    return SignalPlot(
        name=name,
        unit="" if kind.unit == "1" else kind.unit,
        values=tuple(
            float(value) if is_known else None
            for value, is_known in zip(rounded, known, strict=True)
        ),
        labels=labels,
        thresholds=tuple(lines.get(name, ())) if kind.kind == NUMBER else (),
        cap=kind.cap,
    )
