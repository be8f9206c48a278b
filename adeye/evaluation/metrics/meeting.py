"""Metrics of encounters in the plane and of crossings, with all objects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.conflict import GAP
from adeye.evaluation.metrics.crossings import (
    CROSSINGS,
    ENCROACHMENT,
    OVERLAP,
    PET,
    PREDICTED_PET,
    worst_crossings,
)
from adeye.evaluation.metrics.encounters import (
    DCE,
    ENCOUNTERS,
    PLANAR_TTC,
    TTCE,
    WTTC,
    worst_encounters,
)
from adeye.evaluation.metrics.registry import column_of, metric_entry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.evaluation.series import TraceSeries
    from adeye.ports import MetricColumn
    from adeye.signals import Floats, Ints

    Found = tuple[Floats, Ints, Ints, NDArray[np.int8]]

_EGGERT: Final = "Eggert (2014), Predictive risk estimation for intelligent ADAS functions"
_ALLEN: Final = "Allen, Shin, Cooper (1978), Analysis of traffic conflicts and collisions"


@metric_entry(
    "adeye:criticality.min_ttc_2d@1", "min_ttc_2d_s", "s", "lower",
    "Westhofen et al. (2023), Criticality metrics for automated driving; by separating axes",
    scale=1.0, cap=10.0, least=0.0,
)  # fmt: skip
def min_ttc_2d(series: TraceSeries) -> MetricColumn:
    """Least time until the bodies of ego and any object touch at constant velocity and heading."""
    return _encounter(series, PLANAR_TTC)


@metric_entry(
    "adeye:criticality.min_wttc@1", "min_wttc_s", "s", "lower",
    "Wachenfeld et al. (2016), The worst-time-to-collision metric for situation identification",
    scale=1.0, cap=10.0, least=0.0,
)  # fmt: skip
def min_wttc(series: TraceSeries) -> MetricColumn:
    """Least time in which ego and any object can touch, whatever both do up to friction."""
    return _encounter(series, WTTC)


@metric_entry(
    "adeye:criticality.min_dce@1",
    "min_dce_m",
    "m",
    "lower",
    _EGGERT,
    scale=10.0,
    cap=100.0,
    least=0.0,
)
def min_dce(series: TraceSeries) -> MetricColumn:
    """Least distance of closest encounter with any object within 10 s of constant velocity."""
    return _encounter(series, DCE)


@metric_entry(
    "adeye:criticality.min_ttce@1",
    "min_ttce_s",
    "s",
    "lower",
    _EGGERT,
    scale=1.0,
    cap=10.0,
    least=0.0,
)
def min_ttce(series: TraceSeries) -> MetricColumn:
    """Least time to a closest encounter of at most 1 m with any object, at constant velocity."""
    return _encounter(series, TTCE)


@metric_entry(
    "adeye:criticality.min_pet@1", "min_pet_s", "s", "lower", _ALLEN, scale=1.0, cap=10.0, least=0.0
)
def min_pet(series: TraceSeries) -> MetricColumn:
    """Least time from the first one's exit of a conflict area to the second one's entry.

    Undefined where both are inside at once.
    """
    return _crossing(series, PET)


@metric_entry("adeye:criticality.pet_overlap@1", "pet_overlap_s", "s", "higher", _ALLEN, scale=1.0)
def pet_overlap(series: TraceSeries) -> MetricColumn:
    """Longest time in which ego and a crossing actor are both in their conflict area."""
    return _crossing(series, OVERLAP)


@metric_entry(
    "adeye:criticality.max_encroachment_time@1", "max_encroachment_time_s", "s", "higher", _ALLEN,
    scale=1.0,
)  # fmt: skip
def max_encroachment_time(series: TraceSeries) -> MetricColumn:
    """Longest time for which an actor that crosses takes up the ego's corridor."""
    return _crossing(series, ENCROACHMENT)


@metric_entry(
    "adeye:criticality.min_predicted_pet@1", "min_predicted_pet_s", "s", "lower",
    f"{_ALLEN}; initially attempted post-encroachment time", scale=1.0, cap=10.0, least=0.0,
)  # fmt: skip
def min_predicted_pet(series: TraceSeries) -> MetricColumn:
    """Least post-encroachment time predicted at constant speeds; 0 where both would be inside."""
    return _crossing(series, PREDICTED_PET)


def _encounter(series: TraceSeries, quantity: int) -> MetricColumn:
    if "encounters" not in series.kept:
        context, runs = series.trace.layout.context, series.trace.runs
        found = _empty(ENCOUNTERS, runs)
        worst_encounters(
            series.trace.length,
            series.column("ego"),
            context.ego_size,
            series.column("objects"),
            context.object_sizes,
            series.column("contact"),
            series.worst_conflicts[0][GAP],
            context.actor_count,
            np.ascontiguousarray(series.abilities[:, 1]),
            *found,
        )
        series.kept["encounters"] = found
    return _reported(series, series.kept["encounters"], quantity)


def _crossing(series: TraceSeries, quantity: int) -> MetricColumn:
    if "crossings" not in series.kept:
        context, runs = series.trace.layout.context, series.trace.runs
        found = _empty(CROSSINGS, runs)
        worst_crossings(
            series.trace.length,
            series.step,
            series.column("ego"),
            series.column("ego_place"),
            context.ego_size,
            series.column("objects"),
            series.column("object_places"),
            context.object_sizes,
            series.column("contact"),
            series.worst_conflicts[0][GAP],
            context.actor_count,
            *found,
        )
        series.kept["crossings"] = found
    return _reported(series, series.kept["crossings"], quantity)


def _empty(quantities: int, runs: int) -> Found:
    shape = (quantities, runs)
    whole = np.zeros(shape, dtype=np.int64)
    return np.zeros(shape), whole, whole.copy(), np.zeros(shape, dtype=np.int8)


def _reported(series: TraceSeries, found: Found, quantity: int) -> MetricColumn:
    values, rows, actors, codes = (part[quantity] for part in found)
    return column_of(series, codes, rows, values, actors)
