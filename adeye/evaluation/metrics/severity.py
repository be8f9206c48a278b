"""Metrics of how grave a collision is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.metrics.criticality import contacts_of
from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.metrics.scans import NO_CONFLICT, VALUE
from adeye.kernel.margins import fatality_probability, speed_change
from adeye.signals import OBJECT_CLASSES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.evaluation.series import TraceSeries
    from adeye.ports import MetricColumn
    from adeye.signals import Floats, Ints

MASSES: Final = {
    "car": 1500.0,
    "van": 2500.0,
    "truck": 15000.0,
    "bus": 12000.0,
    "motorcycle": 300.0,
    "cyclist": 90.0,
    "pedestrian": 75.0,
    "parked_truck": 15000.0,
    "parked_car": 1500.0,
    "barrier": np.inf,
    "building": np.inf,
}
"""Mass that each kind of object is taken to have, riders included [kg]; what stands fast has no
end. The ego's is that of its vehicle."""

_MASS_OF_CLASS: Final = np.array([MASSES[name] for name in OBJECT_CLASSES])
_SHELBY: Final = "Shelby (2011), Delta-V as a measure of traffic conflict severity"


@metric_entry(
    "adeye:severity.delta_v@1", "delta_v_mps", "m/s", "higher", _SHELBY, scale=10.0
)  # fmt: skip
def delta_v(series: TraceSeries) -> MetricColumn:
    """Change of the ego's speed by its collision, both going on as one; masses by kind."""
    return _reported(series, 0)


@metric_entry(
    "adeye:severity.other_delta_v@1", "other_delta_v_mps", "m/s", "higher", _SHELBY, scale=10.0
)
def other_delta_v(series: TraceSeries) -> MetricColumn:
    """Change of the speed of what the ego collides with; masses by kind, 0 of what stands fast."""
    return _reported(series, 1)


@metric_entry(
    "adeye:severity.fatality_probability@1", "fatality_probability", "1", "higher",
    "Joksch (1993), Velocity change and fatality risk in a crash: a rule of thumb", scale=0.1,
    least=0.0, most=1.0,
)  # fmt: skip
def fatality(series: TraceSeries) -> MetricColumn:
    """Probability that somebody dies of the larger change of speed, by the rule for car occupants.

    0 without a collision.
    """
    return _reported(series, 2)


def _reported(series: TraceSeries, what: int) -> MetricColumn:
    found, row, has_contact, touched = _changes(series)
    if what == 2:
        codes = np.full(len(row), VALUE)
        column = column_of(series, codes, row, np.where(has_contact, found[2], 0.0), touched)
        time = np.where(has_contact, column.time, np.nan)
        return type(column)(column.value, column.status, time, column.actor)
    return column_of(series, np.where(has_contact, VALUE, NO_CONFLICT), row, found[what], touched)


def _changes(series: TraceSeries) -> tuple[Floats, Ints, NDArray[np.bool_], Ints]:
    """Give changes of both speeds and probability (3, B), and rows, whether and what is touched."""
    if "severity" not in series.kept:
        row, has_contact, touched = contacts_of(series)
        layout = series.trace.layout
        found = np.zeros((3, len(row)))
        for run in np.flatnonzero(has_contact).tolist():
            own = layout.architectures[run].vehicle.mass
            other = float(_MASS_OF_CLASS[layout.context.object_classes[touched[run]]])
            speed = float(series.column("impact_speed")[run, row[run]])
            found[0, run] = speed_change(own, other, speed)
            found[1, run] = 0.0 if np.isinf(other) else speed_change(other, own, speed)
            # NaN stays one: an unknown speed is no harmless one.
            larger = max(found[0, run], found[1, run]) if np.isfinite(speed) else np.nan
            found[2, run] = fatality_probability(larger)
        series.kept["severity"] = found, row, has_contact, touched
    kept: tuple[Floats, Ints, NDArray[np.bool_], Ints] = series.kept["severity"]
    return kept
