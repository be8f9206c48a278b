"""Metrics of how grave a collision is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye import signals as columns
from adeye.judge.metrics.criticality import contacts_of
from adeye.judge.metrics.registry import column_of, object_entry
from adeye.judge.metrics.scans import ERROR, NO_CONFLICT, VALUE
from adeye.judge.outcome import on_road
from adeye.judge.trace_signals import STANDSTILL_SPEED
from adeye.kernel.boxes import boxes_overlap
from adeye.kernel.criticality import fatality_probability, speed_change
from adeye.kernel.road import lane_width
from adeye.ports import MetricColumn

if TYPE_CHECKING:
    from adeye.judge.series import TraceSeries
    from adeye.signals import Floats

# --- Metrics of how grave a collision is ----------------------------------------------------------

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

_MASS_OF_CLASS: Final = np.array([MASSES[name] for name in columns.OBJECT_CLASSES])


@object_entry("adeye:severity.delta_v@1", "m/s", "higher", scale=10.0)
def delta_v(series: TraceSeries) -> MetricColumn:
    """Change of the ego's speed by its collision, both going on as one; masses by kind."""
    return _reported(series, 0)


@object_entry("adeye:severity.other_delta_v@1", "m/s", "higher", scale=10.0)
def other_delta_v(series: TraceSeries) -> MetricColumn:
    """Change of the speed of what the ego collides with; masses by kind, 0 of what stands fast."""
    return _reported(series, 1)


@object_entry("adeye:severity.fatality_probability@1", "1", "higher", scale=0.1, most=1.0)
def fatality(series: TraceSeries) -> MetricColumn:
    """Probability that somebody dies of the larger change of speed, by the rule for car occupants.

    0 without a collision.
    """
    return _reported(series, 2)


def _reported(series: TraceSeries, what: int) -> MetricColumn:
    row, has_contact, touched = contacts_of(series)
    found = series.once("severity", lambda: _changes(series))[what]
    # Nobody dies without a contact; a change of speed there is none.
    codes = np.where(has_contact | (what == 2), VALUE, NO_CONFLICT)
    return column_of(series, codes, row, found, touched, is_found=has_contact)


def _changes(series: TraceSeries) -> Floats:
    """Give changes of both speeds and the probability (3, B), 0 without a contact."""
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
    return found


# --- Whether a collision is the ego's fault: a label beside it, for it counts in any case ---------

BEHIND: Final = math.radians(150.0)
"""Bearing from which an object is behind the ego [rad]."""


@object_entry("adeye:at_fault.contact@1", "1", "higher", column="contact_at_fault", most=1.0)
def contact_at_fault(series: TraceSeries) -> MetricColumn:
    """1 if the ego touches an object and is at fault, else 0.

    It is if it moves, and the object stands, or its front touches the object, or its side does
    while it is not within one lane. It is not if it stands, or is hit from behind.
    """
    row, has_contact, touched = contacts_of(series)
    found = np.zeros(len(row))
    for run in np.flatnonzero(has_contact).tolist():
        found[run] = _is_at_fault(series, run, int(row[run]), int(touched[run]))
    codes = np.where(np.isnan(found), ERROR, VALUE)
    return column_of(series, codes, row, found, touched, is_found=has_contact)


def _is_at_fault(series: TraceSeries, run: int, row: int, other: int) -> float:
    """Judge one contact: 1 or 0, NaN where a number is not finite."""
    ego, place = series.column("ego")[run, row], series.column("ego_place")[run, row]
    state, context = series.column("objects")[run, row, other], series.trace.layout.context
    if not (np.isfinite(ego).all() and np.isfinite(place).all() and np.isfinite(state).all()):
        return math.nan
    if abs(ego[columns.EGO_SPEED]) <= STANDSTILL_SPEED:
        return 0.0
    if abs(state[columns.OBJECT_SPEED]) <= STANDSTILL_SPEED:
        return 1.0
    length, width = context.ego_size[run, :2]
    heading = ego[columns.EGO_HEADING]
    away_x, away_y = (
        state[columns.OBJECT_X] - ego[columns.EGO_X],
        state[columns.OBJECT_Y] - ego[columns.EGO_Y],
    )
    along = away_x * math.cos(heading) + away_y * math.sin(heading)
    across = away_y * math.cos(heading) - away_x * math.sin(heading)
    if abs(math.atan2(across, along)) > BEHIND:
        return 0.0
    half = 0.5 * length
    bumper = (
        ego[columns.EGO_X] + half * math.cos(heading),
        ego[columns.EGO_Y] + half * math.sin(heading),
    )
    other_box = (*state[:3], *context.object_sizes[run, other, :2])
    # Where the step ends beyond the contact, the bodies may have parted again.
    is_ahead = along >= half and abs(across) <= 0.5 * width
    if is_ahead or boxes_overlap((*bumper, heading, 0.0, width), other_box):
        return 1.0
    return float(not _is_within_lane(series, run, row, 0.5 * width, half))


def _is_within_lane(
    series: TraceSeries, run: int, row: int, half_width: float, half_length: float
) -> bool:
    """Tell whether the body of the ego is on the road and within the lane of its centre."""
    place = series.column("ego_place")[run, row]
    road = series.trace.layout.context.road
    if not on_road(road.of(np.array([run])), place[np.newaxis, np.newaxis])[0, 0]:
        return False
    turned = series.column("ego")[run, row, columns.EGO_HEADING] - place[columns.PLACE_HEADING]
    extent = half_width * abs(math.cos(turned)) + half_length * abs(math.sin(turned))
    width = lane_width(road.ground(run), place[columns.PLACE_S], place[columns.PLACE_D])
    return bool(abs(place[columns.PLACE_OFFSET]) + extent <= 0.5 * width)
