"""How the faults of many runs are handled, read from their traces alone, without twins.

An alarm that has been on since before the fault, without a break, is no detection here. Against a
fault-free twin (``evaluation.timeline``) it is none either, but there also an alarm is none that
begins later and that the twin has as well; so a detection by chance counts here and not there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.evaluation.intervals import (
    Intervals,
    alarms,
    any_of,
    degradation,
    first_from,
    held_since_before,
    intervals,
    operates_in_emergency,
    others_act,
)
from adeye.evaluation.metrics.scans import as_flags, first_faults, safe_from
from adeye.evaluation.road import on_road
from adeye.evaluation.source import STANDSTILL_SPEED
from adeye.signals import EGO_SPEED, PLACE_D

if TYPE_CHECKING:
    from adeye.signals import Bools, Ints
    from adeye.trace import Trace


@dataclass(frozen=True, slots=True)
class Handled:
    """Rows and intervals of fault handling in B runs.

    Attributes:
        fault: (B,) first row with a fault, -1 for none; so also below.
        detect: (B,) an alarm is on that has not been since before the fault.
        emergency: (B,) emergency operation.
        safe: (B,) from here to the end the ego is in a safe state, the fault's row at the earliest.
        is_unknown: (B,) whether the safe state cannot be told, because a number is not finite.
        intervals: Each (B,), NaN where it did not come to its end.
    """

    fault: Ints
    detect: Ints
    emergency: Ints
    safe: Ints
    is_unknown: Bools
    intervals: Intervals


def handled(trace: Trace) -> Handled:
    """Read how the first fault of each run is handled."""
    fault = np.asarray(first_faults(trace.length, as_flags(trace["fault_active"])))
    rows = np.full((3, trace.runs), -1, dtype=np.int64)
    is_unknown = np.zeros(trace.runs, dtype=np.bool_)
    chosen = np.flatnonzero(fault >= 0)
    if len(chosen):
        columns = dict[str, Any](trace.columns)
        onset = fault[chosen]
        places = columns["ego_place"][chosen]
        speed = columns["ego"][chosen, :, EGO_SPEED]
        found = safe_from(
            trace.length[chosen],
            speed,
            places[..., PLACE_D],
            columns["contact"][chosen],
            on_road(trace.layout.context.road.of(chosen), places),
            STANDSTILL_SPEED,
        )
        is_unknown[chosen] = found < 0
        is_safe = (found >= 0) & (found < trace.length[chosen])
        decided = decided_rows(trace)[chosen]
        on = alarms(trace["monitors"][chosen], trace["reason"][chosen], trace.layout.monitors)
        fresh = any_of(on & ~held_since_before(on, onset))
        acts = others_act(trace["authority"][chosen], default_channel(trace))
        degraded = degradation(trace["monitors"][chosen], trace.layout.monitors)
        braking = columns["command"][chosen, :, 0]
        emergency = operates_in_emergency(acts, braking, speed, degraded)
        rows[0, chosen] = first_from(fresh & decided, onset)
        rows[1, chosen] = first_from(emergency & decided, onset)
        rows[2, chosen] = np.where(is_safe, np.maximum(found, onset), -1)
    detect, emergency_from, safe = rows
    times = [np.where(row >= 0, trace.time[row], np.nan) for row in (fault, *rows)]
    return Handled(fault, detect, emergency_from, safe, is_unknown, intervals(*times))


def decided_rows(trace: Trace) -> Bools:
    """Tell at which rows (B, T) something was decided: all of a run but its last."""
    rows = np.arange(trace.time.shape[0])
    return np.asarray(rows < trace.length[:, np.newaxis] - 1)


def default_channel(trace: Trace) -> int:
    """Give the index of the channel that acts without a request."""
    return trace.layout.channels.index(trace.layout.architecture.switch.default)
