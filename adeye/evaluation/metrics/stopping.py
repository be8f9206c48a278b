"""Metrics of where the ego stands at the end of a run, against what was reachable at the fault.

Vehicle, decelerations and ratings are those of each run's own architecture. Two architectures that
rate places differently are each measured by their own ratings.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.metrics.scans import (
    ERROR,
    NOT_APPLICABLE,
    VALUE,
    as_flags,
    first_faults,
)
from adeye.evaluation.safe_stop import achieved_rating, best_rating, rules_of
from adeye.evaluation.source import STANDSTILL_SPEED
from adeye.signals import EGO_SPEED

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.evaluation.series import TraceSeries
    from adeye.ports import MetricColumn
    from adeye.signals import Floats
    from adeye.trace import Trace

    Ends = tuple[NDArray[np.int8], Floats]


@metric_entry(
    "adeye:stopping.stop_rating@1",
    "stop_rating",
    "1",
    "higher",
    "own definition: rating of the place, kernel.stop_rating",
    scale=1.0,
    least=0.0,
    most=8.0,
)
def stop_rating(series: TraceSeries) -> MetricColumn:
    """Rating of the place where the ego stands at the end, from 0 for a refuge to 8 for contact.

    It does not apply to an ego that does not stand at the end.
    """
    codes, values = _ends(series)
    return column_of(series, codes, series.trace.length - 1, values, _touched(series.trace))


@metric_entry(
    "adeye:stopping.stop_regret@1",
    "stop_regret",
    "1",
    "higher",
    "own definition: achieved rating minus the best that was reachable",
    scale=1.0,
)
def stop_regret(series: TraceSeries) -> MetricColumn:
    """Rating of the place where the ego stands, minus the best reachable when the fault began.

    It is negative where the ego went on to a better place than was within reach. It does not apply
    without a fault, or to an ego that does not stand at the end.
    """
    trace = series.trace
    ends, ratings = _ends(series)
    fault = np.asarray(first_faults(trace.length, as_flags(series.column("fault_active"))))
    codes = np.where(fault < 0, np.int8(NOT_APPLICABLE), ends)
    values = np.full(trace.runs, np.nan)
    for run in np.flatnonzero(codes == VALUE).tolist():
        row = int(fault[run])
        if not _is_known(trace, run, row):
            codes[run] = ERROR
            continue
        best = best_rating(trace, run, row, rules_of(trace.layout.architectures[run]))
        values[run] = ratings[run] - best
    return column_of(series, codes, trace.length - 1, values, _touched(trace))


def _ends(series: TraceSeries) -> Ends:
    """Give status and rating (B,) of the places where the runs end, once for both metrics."""
    if "stops" not in series.kept:
        trace = series.trace
        last = trace.length - 1
        every = np.arange(trace.runs)
        touched = _touched(trace) >= 0
        ego, place = series.column("ego")[every, last], series.column("ego_place")[every, last]
        is_known = np.isfinite(ego).all(axis=1) & np.isfinite(place).all(axis=1)
        stands = touched | (np.abs(ego[:, EGO_SPEED]) <= STANDSTILL_SPEED)
        codes = np.select(
            [~is_known & ~touched, stands],
            [np.int8(ERROR), np.int8(VALUE)],
            np.int8(NOT_APPLICABLE),
        )
        values = np.full(trace.runs, np.nan)
        for run in np.flatnonzero(codes == VALUE).tolist():
            rules = rules_of(trace.layout.architectures[run])
            values[run] = achieved_rating(trace, run, rules)
        series.kept["stops"] = codes, values
    found: Ends = series.kept["stops"]
    return found


def _touched(trace: Trace) -> NDArray[np.int64]:
    """Give what the ego touches (B,) in the last row of each run, -1 for nothing."""
    last = trace["contact"][np.arange(trace.runs), trace.length - 1]
    return np.asarray(last, dtype=np.int64)


def _is_known(trace: Trace, run: int, row: int) -> bool:
    """Tell whether all that says what was reachable at a row is finite."""
    places = (trace[name][run, row] for name in ("ego", "ego_place", "object_places"))
    objects = trace["objects"][run, row : trace.length[run]]
    return all(np.isfinite(values).all() for values in (*places, objects))
