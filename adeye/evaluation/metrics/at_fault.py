"""Whether a collision is the ego's fault: a label beside it, for it counts in any case."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.metrics.criticality import contacts_of
from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.metrics.scans import ERROR, VALUE
from adeye.evaluation.road import on_road
from adeye.evaluation.source import STANDSTILL_SPEED
from adeye.kernel.geometry import boxes_overlap
from adeye.ports import MetricColumn
from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    PLACE_HEADING,
    PLACE_OFFSET,
)

if TYPE_CHECKING:
    from adeye.evaluation.series import TraceSeries

BEHIND: Final = math.radians(150.0)
"""Bearing from which an object is behind the ego [rad]."""


@metric_entry(
    "adeye:at_fault.contact@1",
    "contact_at_fault",
    "1",
    "higher",
    "after the classes of collisions of nuPlan (Karnchanachari et al. 2024), own geometry",
    scale=1.0,
    least=0.0,
    most=1.0,
)
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
    column = column_of(series, codes, row, found, touched)
    time = np.where(has_contact, column.time, np.nan)
    return MetricColumn(column.value, column.status, time, column.actor)


def _is_at_fault(series: TraceSeries, run: int, row: int, other: int) -> float:
    """Judge one contact: 1 or 0, NaN where a number is not finite."""
    ego, place = series.column("ego")[run, row], series.column("ego_place")[run, row]
    state, context = series.column("objects")[run, row, other], series.trace.layout.context
    if not (np.isfinite(ego).all() and np.isfinite(place).all() and np.isfinite(state).all()):
        return math.nan
    if abs(ego[EGO_SPEED]) <= STANDSTILL_SPEED:
        return 0.0
    if abs(state[OBJECT_SPEED]) <= STANDSTILL_SPEED:
        return 1.0
    length, width = context.ego_size[run, :2]
    heading = ego[EGO_HEADING]
    away_x, away_y = state[OBJECT_X] - ego[EGO_X], state[OBJECT_Y] - ego[EGO_Y]
    along = away_x * math.cos(heading) + away_y * math.sin(heading)
    across = away_y * math.cos(heading) - away_x * math.sin(heading)
    if abs(math.atan2(across, along)) > BEHIND:
        return 0.0
    half = 0.5 * length
    bumper = (ego[EGO_X] + half * math.cos(heading), ego[EGO_Y] + half * math.sin(heading))
    other_box = (state[OBJECT_X], state[OBJECT_Y], state[OBJECT_HEADING])
    size = context.object_sizes[run, other, :2]
    # Where the step ends beyond the contact, the bodies may have parted again.
    is_ahead = along >= half and abs(across) <= 0.5 * width
    if is_ahead or boxes_overlap(*bumper, heading, 0.0, width, *other_box, *size):
        return 1.0
    return float(not _is_within_lane(series, run, row, 0.5 * width, half))


def _is_within_lane(
    series: TraceSeries, run: int, row: int, half_width: float, half_length: float
) -> bool:
    """Tell whether the body of the ego is on the road and within the lane of its centre."""
    place = series.column("ego_place")[run, row]
    road = series.trace.layout.context.road.of(np.array([run]))
    if not on_road(road, place[np.newaxis, np.newaxis])[0, 0]:
        return False
    turned = series.column("ego")[run, row, EGO_HEADING] - place[PLACE_HEADING]
    extent = half_width * abs(math.cos(turned)) + half_length * abs(math.sin(turned))
    return bool(abs(place[PLACE_OFFSET]) + extent <= 0.5 * road.lane_width[0])
