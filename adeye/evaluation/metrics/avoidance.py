"""Metrics of what is left against objects in the path: times, decelerations, moments to evade."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.following import (
    DST,
    ETTC,
    FOLLOWING,
    MDRAC,
    MTC,
    MTTC,
    STN,
    TTB,
    TTK,
    TTR,
    TTS,
    scene_of,
)
from adeye.evaluation.metrics.criticality import max_required_deceleration
from adeye.evaluation.metrics.followers import REAR_DEMAND, REAR_TTC, worst_followers
from adeye.evaluation.metrics.pursuit import worst_following
from adeye.evaluation.metrics.registry import column_of, metric_entry
from adeye.evaluation.metrics.statuses import CODES
from adeye.ports import MetricColumn

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.evaluation.series import TraceSeries
    from adeye.signals import Floats, Ints

    Found = tuple[Floats, Ints, Ints, NDArray[np.int8]]

_HILLENBRAND: Final = (
    "Hillenbrand et al. (2006), A multilevel collision mitigation approach; "
    "Tamke et al. (2011), A flexible method for criticality assessment"
)
_BRANNSTROM: Final = "Brännström et al. (2008), A situation and threat assessment algorithm"


@metric_entry(
    "adeye:criticality.min_mttc@1", "min_mttc_s", "s", "lower",
    "Ozbay et al. (2008), Derivation and validation of new simulation-based surrogate safety"
    " measure",
    scale=1.0, cap=10.0, least=0.0,
)  # fmt: skip
def min_mttc(series: TraceSeries) -> MetricColumn:
    """Least time to collision at constant accelerations; who brakes to a stop stays there."""
    return _column(series, MTTC)


@metric_entry(
    "adeye:criticality.min_ettc@1", "min_ettc_s", "s", "lower",
    "ISO 15623, enhanced time to collision", scale=1.0, cap=10.0,
    least=0.0,
)  # fmt: skip
def min_ettc(series: TraceSeries) -> MetricColumn:
    """Least time to collision while the relative acceleration stays; nobody stops."""
    return _column(series, ETTC)


@metric_entry(
    "adeye:criticality.max_mdrac@1", "max_mdrac_mps2", "m/s²", "higher",
    "Fu and Sayed (2021), Comparison of threshold determination methods for the DRAC", scale=1.0,
)  # fmt: skip
def max_mdrac(series: TraceSeries) -> MetricColumn:
    """Largest deceleration to avoid a crash that begins 1 s late; 100 m/s² where that is too late.

    An object in the path keeps its speed.
    """
    return _column(series, MDRAC)


@metric_entry(
    "adeye:criticality.max_dst@1", "max_dst_mps2", "m/s²", "higher",
    "Hupfer (1997), Deceleration to safety time (DST)", scale=1.0,
)  # fmt: skip
def max_dst(series: TraceSeries) -> MetricColumn:
    """Largest deceleration that keeps 1 s behind who is ahead; undefined once that is lost."""
    return _column(series, DST)


@metric_entry(
    "adeye:criticality.min_mtc@1", "min_mtc", "1", "lower",
    "Kitajima et al. (2009), Comparison of evaluation indices concerning estimation of driver's "
    "risk perception",
    scale=1.0, cap=10.0,
)  # fmt: skip
def min_mtc(series: TraceSeries) -> MetricColumn:
    """Least room over the way to standstill if both brake now with 0.7 g; below 1 they collide."""
    return _column(series, MTC)


@metric_entry(
    "adeye:criticality.max_btn@1", "max_btn", "1", "higher", _BRANNSTROM, scale=0.1
)  # fmt: skip
def max_btn(series: TraceSeries) -> MetricColumn:
    """Largest required deceleration over what vehicle and friction allow; from 1 on too late."""
    needed = max_required_deceleration(series)
    number = np.asarray(needed.value) / series.abilities[:, 0]
    return MetricColumn(number, needed.status, needed.time, needed.actor)


@metric_entry("adeye:criticality.max_stn@1", "max_stn", "1", "higher", _BRANNSTROM, scale=0.1)
def max_stn(series: TraceSeries) -> MetricColumn:
    """Largest lateral acceleration to pass an object in the path over friction; from 1 too late."""
    return _column(series, STN)


@metric_entry(
    "adeye:criticality.min_ttb@1", "min_ttb_s", "s", "lower", _HILLENBRAND, scale=1.0, cap=10.0,
    least=-10.0,
)  # fmt: skip
def min_ttb(series: TraceSeries) -> MetricColumn:
    """Least time to brake: how long full braking may wait; negative when late, at least -10 s."""
    return _column(series, TTB)


@metric_entry(
    "adeye:criticality.min_tts@1", "min_tts_s", "s", "lower", _HILLENBRAND, scale=1.0, cap=10.0,
    least=-10.0,
)  # fmt: skip
def min_tts(series: TraceSeries) -> MetricColumn:
    """Least time to steer: how long passing at the limit of friction may wait; at least -10 s."""
    return _column(series, TTS)


@metric_entry(
    "adeye:criticality.min_ttk@1", "min_ttk_s", "s", "lower", _HILLENBRAND, scale=1.0, cap=10.0,
    least=-10.0,
)  # fmt: skip
def min_ttk(series: TraceSeries) -> MetricColumn:
    """Least time to kickdown: how long full acceleration may wait; -10 s where it never helps."""
    return _column(series, TTK)


@metric_entry(
    "adeye:criticality.min_ttr@1", "min_ttr_s", "s", "lower", _HILLENBRAND, scale=1.0, cap=10.0,
    least=-10.0,
)  # fmt: skip
def min_ttr(series: TraceSeries) -> MetricColumn:
    """Least time to react: how long the best of braking, steering and kickdown may wait."""
    return _column(series, TTR)


@metric_entry(
    "adeye:criticality.min_rear_ttc@1", "min_rear_ttc_s", "s", "lower",
    "Hayward (1972), Near-miss determination through use of a scale of danger", scale=1.0,
    cap=10.0, least=0.0,
)  # fmt: skip
def min_rear_ttc(series: TraceSeries) -> MetricColumn:
    """Least time to collision of somebody who follows the ego in its path."""
    return _of_followers(series, REAR_TTC)


@metric_entry(
    "adeye:criticality.max_follower_deceleration@1", "max_follower_deceleration_mps2", "m/s²",
    "higher", "Jansson (2005), Collision avoidance theory, 4.2", scale=1.0,
)  # fmt: skip
def max_follower_deceleration(series: TraceSeries) -> MetricColumn:
    """Largest constant deceleration that the ego's braking demands of who follows it."""
    return _of_followers(series, REAR_DEMAND)


def _column(series: TraceSeries, quantity: int) -> MetricColumn:
    if "following" not in series.kept:
        found = _empty(FOLLOWING, series.trace.runs)
        scene = scene_of(series.trace, *series.worst_conflicts)
        worst_following(*scene, series.abilities, *found)
        series.kept["following"] = found
    return _reported(series, series.kept["following"], quantity)


def _of_followers(series: TraceSeries, quantity: int) -> MetricColumn:
    if "followers" not in series.kept:
        found = _empty(2, series.trace.runs)
        scene = scene_of(series.trace, *series.worst_conflicts)
        worst_followers(*scene[:-1], *found)
        series.kept["followers"] = found
    return _reported(series, series.kept["followers"], quantity)


def _empty(quantities: int, runs: int) -> Found:
    shape = (quantities, runs)
    whole = np.zeros(shape, dtype=np.int64)
    return np.zeros(shape), whole, whole.copy(), np.zeros(shape, dtype=np.int8)


def _reported(series: TraceSeries, found: Found, quantity: int) -> MetricColumn:
    values, rows, actors, codes = (part[quantity] for part in found)
    # A least time of infinity was found with nobody to blame: there is no conflict.
    codes = np.where(
        (codes == CODES["value"]) & np.isinf(values), np.int8(CODES["no_conflict"]), codes
    )
    return column_of(series, codes, rows, values, actors)
