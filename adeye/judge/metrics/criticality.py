"""Metrics of how near a run came to a collision: contact, distance, times, decelerations, RSS."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from adeye.judge import following
from adeye.judge.conflict import (
    ALONG,
    DISTANCE,
    DRAC,
    GAP,
    HALF_LENGTH,
    HALF_WIDTH,
    REQUIRED,
    RSS_MARGIN,
    TIME_HEADWAY,
    TTC,
    D,
    limited_demand,
    on_road,
    turn,
)
from adeye.judge.metrics.registry import StatusColumn, column_at, column_of, object_entry
from adeye.judge.metrics.scans import (
    ERROR,
    NO_CONFLICT,
    UNDEFINED,
    VALUE,
    Found,
    first_contacts,
    found_column,
    worst_at_standstill,
    worst_conflicts,
    worst_violations,
)
from adeye.judge.series import SERIES, TraceSeries, is_demand
from adeye.judge.trace_signals import STANDSTILL_SPEED
from adeye.kernel.criticality import required_deceleration, time_to_collision
from adeye.kernel.jit import allocating
from adeye.kernel.relation import tick_times
from adeye.kernel.road import lane_way
from adeye.ports import MetricColumn
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    OBJECT_HEADING,
    OBJECT_SPEED,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
    Floats,
    Ints,
)

if TYPE_CHECKING:
    from adeye.judge.conflict import Scene
    from adeye.signals import Bools, Shorts

# --- Metrics of how near a run came to a collision: contact, distance, times, decelerations, RSS --


@object_entry("adeye:criticality.contact@1", "1", "higher", most=1.0)
def contact(series: TraceSeries) -> MetricColumn:
    """1 if the ego touches an object, else 0."""
    row, has_contact, touched = contacts_of(series)
    codes = np.full(row.shape, VALUE)
    value = has_contact.astype(np.float64)
    return column_of(series, codes, row, value, touched, is_found=has_contact)


@object_entry("adeye:criticality.impact_speed@1", "m/s", "higher", scale=10.0)
def impact_speed(series: TraceSeries) -> MetricColumn:
    """Relative speed at the first contact; no conflict without contact."""
    row, has_contact, touched = contacts_of(series)
    codes = np.where(has_contact, VALUE, NO_CONFLICT)
    speed = series.column("impact_speed")[np.arange(len(row)), row]
    return column_of(series, codes, row, speed, touched)


@object_entry("adeye:criticality.min_distance@1", "m", "lower", SERIES["distance"], scale=10.0)
def min_distance(series: TraceSeries) -> MetricColumn:
    """Least distance between the bodies of the ego and any object; 0 at contact."""
    return worst_of(series, DISTANCE)


@object_entry("adeye:criticality.min_ttc@1", "s", "lower", SERIES["ttc"])
def min_ttc(series: TraceSeries) -> MetricColumn:
    """Least time to collision at constant speeds with an object in the path; 0 at contact."""
    return worst_of(series, TTC)


@object_entry("adeye:criticality.min_time_headway@1", "s", "lower", SERIES["time_headway"])
def min_time_headway(series: TraceSeries) -> MetricColumn:
    """Least time between the front bumpers of ego and object in the path passing one place."""
    return worst_of(series, TIME_HEADWAY)


@object_entry("adeye:criticality.max_drac@1", "m/s²", "higher", SERIES["drac"])
def max_drac(series: TraceSeries) -> MetricColumn:
    """Largest deceleration to avoid a crash, before contact, with who keeps its speed."""
    return worst_of(series, DRAC)


@object_entry(
    "adeye:criticality.max_required_deceleration@1",
    "m/s²",
    "higher",
    SERIES["required_deceleration"],
)
def max_required_deceleration(series: TraceSeries) -> MetricColumn:
    """Largest constant deceleration needed, before contact, against who goes on braking."""
    return worst_of(series, REQUIRED)


@object_entry("adeye:criticality.rss_violation@2", "s", "higher", SERIES["rss_violation"])
def rss_violation(series: TraceSeries) -> MetricColumn:
    """Time with an RSS violation, each row counting one step; when and who was the worst."""
    row, count, is_error = worst_violations(
        series.trace.length, series.worst_conflicts[0][RSS_MARGIN]
    )
    worst = column_at(series, np.where(count > 0, VALUE, UNDEFINED), row, RSS_MARGIN)
    seconds = np.where(is_error, np.nan, tick_times(count, series.step))
    status = StatusColumn(np.where(is_error, ERROR, VALUE))
    return MetricColumn(seconds, status, worst.time, worst.actor)


@object_entry("adeye:criticality.standstill_gap@1", "m", "lower", SERIES["gap"], scale=10.0)
def standstill_gap(series: TraceSeries) -> MetricColumn:
    """Least gap to an object in the path while the ego stands; not applicable if it never does."""
    gaps, speed = series.nearest[0], series.column("ego")[..., EGO_SPEED]
    row, codes = worst_at_standstill(series.trace.length, gaps, speed, STANDSTILL_SPEED)
    return column_at(series, codes, row, GAP)


def worst_of(series: TraceSeries, quantity: int) -> MetricColumn:
    """Reduce a quantity of ``conflict`` to the worst of each run."""
    values, actors = (part[quantity] for part in series.worst_conflicts)
    row, codes = worst_conflicts(
        series.trace.length, values, actors, series.column("contact"), is_demand(quantity)
    )
    return column_at(series, codes, row, quantity)


def contacts_of(series: TraceSeries) -> tuple[Ints, Bools, Ints]:
    """Give the row (B,) of the first contact, 0 for none, whether there is one, and with whom."""
    touched = series.column("contact")
    row = first_contacts(series.trace.length, touched)
    has_contact = row >= 0
    row = np.where(has_contact, row, 0)
    return row, has_contact, np.where(has_contact, touched[np.arange(len(row)), row], -1)


# --- Compiled: the worst of what is left against objects in the path, run by run ------------------


@allocating
def worst_following(  # noqa: C901 - a kernel over the whole scene
    scene: Scene, gaps: Floats, ahead: Shorts, limits: Floats, worst: Found
) -> None:
    """Find the worst of each quantity in B runs, the earliest among equals.

    Args:
        scene: The runs.
        gaps: (B, T) gap of ``conflict``: NaN at a row with an input that is not finite.
        ahead: (B, T) its object, -1 where nobody is in the path.
        limits: (B, 3) largest braking, lateral acceleration and acceleration of the ego [m/s²].
        worst: (10, B) out. A deceleration to safety time is ``undefined`` if at any row the safety
            time is lost already.
    """
    length, contact = scene.length, scene.contact
    values, rows, actors, codes = worst
    found, who = np.zeros(following.FOLLOWING), np.zeros(following.FOLLOWING, dtype=np.int64)
    turns = np.zeros((scene.objects.shape[2] + 1, 3))
    for run in range(length.shape[0]):
        turns[:] = math.nan
        for quantity in range(following.FOLLOWING):
            values[quantity, run] = (
                -math.inf if following.is_worse_when_larger(quantity) else math.inf
            )
            rows[quantity, run], actors[quantity, run] = 0, -1
            codes[quantity, run] = UNDEFINED
        is_free, is_lost = False, False
        for row in range(length[run]):
            if math.isnan(gaps[run, row]):
                codes[:, run] = ERROR
                break
            if ahead[run, row] < 0 and contact[run, row] < 0:
                is_free = True
                continue
            following.measure_following(run, row, scene, limits, turns, found, who)
            for quantity in range(following.FOLLOWING):
                if who[quantity] < 0:
                    is_free |= contact[run, row] < 0
                    continue
                value = found[quantity]
                if quantity == following.DST and value == math.inf:
                    is_lost = True
                sign = -1.0 if following.is_worse_when_larger(quantity) else 1.0
                if sign * value < sign * values[quantity, run]:
                    values[quantity, run] = value
                    rows[quantity, run], actors[quantity, run] = row, who[quantity]
                    codes[quantity, run] = VALUE
        for quantity in range(following.FOLLOWING):
            if is_free and codes[quantity, run] == UNDEFINED:
                codes[quantity, run] = NO_CONFLICT
        if is_lost and codes[following.DST, run] != ERROR:
            codes[following.DST, run] = UNDEFINED


# --- Compiled: what the ego demands of who follows it in its path ---------------------------------

REAR_TTC, REAR_DEMAND = range(2)


@allocating
def worst_followers(  # noqa: C901 - a kernel over the whole scene
    scene: Scene, gaps: Floats, worst: Found
) -> None:
    """Find the worst of who follows the ego in B runs, the earliest among equals.

    Somebody follows who is behind the ego along the road, whose extent across it overlaps the
    ego's, with a gap, and who drives the same way.

    Args:
        scene: The runs.
        gaps: (B, T) gap of ``conflict``: NaN at a row with an input that is not finite.
        worst: (2, B) out: time to collision [s], required deceleration [m/s²].
    """
    length, ego, ego_place, ego_size, objects, places, sizes, contact = scene
    values, rows, actors, codes = worst
    turns = np.zeros((objects.shape[2] + 1, 3))
    for run in range(length.shape[0]):
        turns[:] = math.nan
        values[REAR_TTC, run], values[REAR_DEMAND, run] = math.inf, -math.inf
        rows[:, run], actors[:, run] = 0, -1
        codes[:, run] = UNDEFINED
        for row in range(length[run]):
            if math.isnan(gaps[run, row]):
                codes[:, run] = ERROR
                break
            if contact[run, row] >= 0:
                continue
            if codes[REAR_TTC, run] == UNDEFINED:
                codes[:, run] = NO_CONFLICT
            s, d = ego_place[run, row, PLACE_S], ego_place[run, row, PLACE_D]
            most = 0.5 * (ego_size[run, 0] + ego_size[run, 1])
            for thing in range(objects.shape[2]):
                behind = s - places[run, row, thing, PLACE_S]
                beside = places[run, row, thing, PLACE_D] - d
                wide = most + 0.5 * (sizes[run, thing, 0] + sizes[run, thing, 1])
                if behind <= 0.0 or abs(beside) >= wide:
                    continue
                turn(turns, 0, ego[run, row, EGO_HEADING] - ego_place[run, row, PLACE_HEADING])
                turned = objects[run, row, thing, OBJECT_HEADING]
                turn(turns, thing + 1, turned - places[run, row, thing, PLACE_HEADING])
                own = on_road(
                    s, d, ego[run, row, EGO_SPEED], ego_size[run, 0], ego_size[run, 1],
                    turns[0, 1], turns[0, 2],
                )  # fmt: skip
                other = on_road(
                    s - behind, d + beside, objects[run, row, thing, OBJECT_SPEED],
                    sizes[run, thing, 0], sizes[run, thing, 1], turns[thing + 1, 1],
                    turns[thing + 1, 2],
                )  # fmt: skip
                # The follower drives the gap, so that it is as long as on the follower's lane.
                there = places[run, row, thing]
                apart = lane_way(
                    there[PLACE_S], there[PLACE_HEADING], there[PLACE_D],
                    s, ego_place[run, row, PLACE_HEADING],
                )  # fmt: skip
                gap = apart - own[HALF_LENGTH] - other[HALF_LENGTH]
                apart = abs(other[D] - own[D]) - own[HALF_WIDTH] - other[HALF_WIDTH]
                if gap <= 0.0 or apart >= 0.0 or other[ALONG] <= 0.0:
                    continue
                ttc = time_to_collision(gap, other[ALONG] - own[ALONG])
                if ttc < values[REAR_TTC, run]:
                    values[REAR_TTC, run] = ttc
                    rows[REAR_TTC, run], actors[REAR_TTC, run] = row, thing
                    codes[REAR_TTC, run] = VALUE
                slowing = ego[run, row, EGO_ACCELERATION] * turns[0, 2]
                ahead = max(own[ALONG], 0.0)
                demand = limited_demand(required_deceleration(gap, other[ALONG], ahead, slowing))
                if demand > values[REAR_DEMAND, run]:
                    values[REAR_DEMAND, run] = demand
                    rows[REAR_DEMAND, run], actors[REAR_DEMAND, run] = row, thing
                    codes[REAR_DEMAND, run] = VALUE


# --- Metrics of what is left against objects in the path: times, decelerations, moments to evade --


@object_entry("adeye:criticality.min_mttc@1", "s", "lower", cap=10.0)
def min_mttc(series: TraceSeries) -> MetricColumn:
    """Least time to collision at constant accelerations; who brakes to a stop stays there."""
    return _column(series, following.MTTC)


@object_entry("adeye:criticality.min_ettc@1", "s", "lower", cap=10.0)
def min_ettc(series: TraceSeries) -> MetricColumn:
    """Least time to collision while the relative acceleration stays; nobody stops."""
    return _column(series, following.ETTC)


@object_entry("adeye:criticality.max_mdrac@1", "m/s²", "higher")
def max_mdrac(series: TraceSeries) -> MetricColumn:
    """Largest deceleration to avoid a crash that begins 1 s late; 100 m/s² where that is too late.

    An object in the path keeps its speed.
    """
    return _column(series, following.MDRAC)


@object_entry("adeye:criticality.max_dst@1", "m/s²", "higher")
def max_dst(series: TraceSeries) -> MetricColumn:
    """Largest deceleration that keeps 1 s behind who is ahead; undefined once that is lost."""
    return _column(series, following.DST)


@object_entry("adeye:criticality.min_mtc@1", "1", "lower", cap=10.0)
def min_mtc(series: TraceSeries) -> MetricColumn:
    """Least room over the way to standstill if both brake now with 0.7 g; below 1 they collide."""
    return _column(series, following.MTC)


@object_entry("adeye:criticality.max_btn@1", "1", "higher", scale=0.1)
def max_btn(series: TraceSeries) -> MetricColumn:
    """Largest required deceleration over what vehicle and friction allow; from 1 on too late."""
    needed = max_required_deceleration(series)
    number = np.asarray(needed.value) / series.abilities[:, 0]
    return MetricColumn(number, needed.status, needed.time, needed.actor)


@object_entry("adeye:criticality.max_stn@1", "1", "higher", scale=0.1, most=100.0)
def max_stn(series: TraceSeries) -> MetricColumn:
    """Largest lateral acceleration to pass an object in the path over friction; from 1 too late."""
    return _column(series, following.STN)


@object_entry("adeye:criticality.min_ttb@1", "s", "lower", cap=10.0, least=-10.0)
def min_ttb(series: TraceSeries) -> MetricColumn:
    """Least time to brake: how long full braking may wait; negative when late, at least -10 s."""
    return _column(series, following.TTB)


@object_entry("adeye:criticality.min_tts@1", "s", "lower", cap=10.0, least=-10.0)
def min_tts(series: TraceSeries) -> MetricColumn:
    """Least time to steer: how long passing at the limit of friction may wait; at least -10 s."""
    return _column(series, following.TTS)


@object_entry("adeye:criticality.min_ttk@1", "s", "lower", cap=10.0, least=-10.0)
def min_ttk(series: TraceSeries) -> MetricColumn:
    """Least time to kickdown: how long full acceleration may wait; -10 s where it never helps."""
    return _column(series, following.TTK)


@object_entry("adeye:criticality.min_ttr@1", "s", "lower", cap=10.0, least=-10.0)
def min_ttr(series: TraceSeries) -> MetricColumn:
    """Least time to react: how long the best of braking, steering and kickdown may wait."""
    return _column(series, following.TTR)


@object_entry("adeye:criticality.min_rear_ttc@1", "s", "lower", cap=10.0)
def min_rear_ttc(series: TraceSeries) -> MetricColumn:
    """Least time to collision of somebody who follows the ego in its path."""
    return _of_followers(series, REAR_TTC)


@object_entry("adeye:criticality.max_follower_deceleration@1", "m/s²", "higher")
def max_follower_deceleration(series: TraceSeries) -> MetricColumn:
    """Largest constant deceleration that the ego's braking demands of who follows it."""
    return _of_followers(series, REAR_DEMAND)


def _column(series: TraceSeries, quantity: int) -> MetricColumn:
    def scan(worst: Found) -> None:
        worst_following(series.scene, *series.nearest, series.abilities, worst)

    return found_column(series, "following", following.FOLLOWING, scan, quantity)


def _of_followers(series: TraceSeries, quantity: int) -> MetricColumn:
    def scan(worst: Found) -> None:
        worst_followers(series.scene, series.nearest[0], worst)

    return found_column(series, "followers", 2, scan, quantity)
