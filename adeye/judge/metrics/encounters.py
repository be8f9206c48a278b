"""Metrics of encounters in the plane and of crossings, with all objects.

Bounds that cost little leave out what cannot be the worst; nothing that they leave out changes a
result.

An actor *crosses* where it moves faster across the road than along it. Its *conflict area* is the
ego's corridor (d of the ego's centre when it passes there, plus and minus half of its extent),
along the road from the least to the largest place that the actor takes up while it is in the
corridor. Times of entry and exit lie between two rows where the motion between them, taken as even,
has them: they are not those of rows, and nobody passes through the corridor unseen.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye import signals as columns
from adeye.judge.conflict import (
    ACROSS,
    ALONG,
    HALF_LENGTH,
    HALF_WIDTH,
    Body,
    D,
    S,
    on_road,
    reach_of,
    turn,
)
from adeye.judge.metrics.registry import object_entry
from adeye.judge.metrics.scans import (
    ERROR,
    INCOMPLETE,
    NO_CONFLICT,
    NOT_APPLICABLE,
    UNDEFINED,
    VALUE,
    Found,
    found_column,
)
from adeye.kernel.boxes import box_distance
from adeye.kernel.encounter import closest_encounter, passing_line, worst_time_to_collision
from adeye.kernel.jit import allocating, inlined
from adeye.kernel.road import lane_way
from adeye.signals import Floats

if TYPE_CHECKING:
    from adeye.judge.conflict import Scene
    from adeye.judge.series import TraceSeries
    from adeye.ports import MetricColumn

# --- Compiled: encounters in the plane with all objects, ahead, beside and behind, in each run ----

PLANAR_TTC, WTTC, DCE, TTCE = range(4)
ENCOUNTERS: Final = 4
"""Number of the quantities, all worse when smaller."""

ENCOUNTER_DISTANCE: Final = 1.0
"""Predicted distance up to which two bodies encounter each other, for the time to closest encounter
[m]. Our choice: about half of what separates cars in neighbouring lanes."""

ENCOUNTER_HORIZON: Final = 10.0
"""How far ahead a constant velocity predicts an encounter [s]. Our choice."""

_TOUCHING: Final = 1e-9
"""Distance at which two bodies pass below which it is looked whether they touch [m]."""


@allocating
def worst_encounters(
    scene: Scene, gaps: Floats, actor_count: int, grip: Floats, worst: Found
) -> None:
    """Find the worst encounters of B runs, the earliest among equals.

    Args:
        scene: The runs.
        gaps: (B, T) gap of ``conflict``: NaN at a row with an input that is not finite.
        actor_count: How many of the objects are actors; the others cannot accelerate.
        grip: (B,) largest acceleration of ego and actors in any direction [m/s²].
        worst: (4, B) out: times to collision in the plane and in the worst case [s], distance of
            closest encounter [m], time to it while it is no more than ``ENCOUNTER_DISTANCE`` [s].
    """
    length, _, _, ego_size, objects, _, sizes, contact = scene
    values, rows, actors, codes = worst
    turns = np.zeros((objects.shape[2] + 1, 3))
    reach = np.zeros(objects.shape[2])
    for run in range(length.shape[0]):
        turns[:] = math.nan
        own_reach = reach_of(ego_size[run, 0], ego_size[run, 1])
        for thing in range(objects.shape[2]):
            reach[thing] = own_reach + reach_of(sizes[run, thing, 0], sizes[run, thing, 1])
        for quantity in range(ENCOUNTERS):
            values[quantity, run] = math.inf
            rows[quantity, run], actors[quantity, run] = 0, -1
            codes[quantity, run] = NO_CONFLICT if length[run] else UNDEFINED
        for row in range(length[run]):
            if math.isnan(gaps[run, row]):
                codes[:, run] = ERROR
                break
            touched = contact[run, row]
            if touched >= 0:
                for quantity in range(ENCOUNTERS):
                    _keep(quantity, 0.0, touched, run, row, worst)
                continue
            _measure_row(run, row, scene, actor_count, grip[run], turns, reach, worst)
        for quantity in range(ENCOUNTERS):
            if actors[quantity, run] >= 0 and codes[quantity, run] != ERROR:
                codes[quantity, run] = VALUE


@inlined
def _keep(quantity: int, value: float, thing: int, run: int, row: int, worst: Found) -> None:
    if value < worst.values[quantity, run]:
        worst.values[quantity, run] = value
        worst.rows[quantity, run], worst.actors[quantity, run] = row, thing


@inlined
def _measure_row(  # noqa: C901, PLR0912, PLR0913, PLR0917 - a part of the kernel
    run: int,
    row: int,
    scene: Scene,
    actor_count: int,
    grip: float,
    turns: Floats,
    reach: Floats,
    worst: Found,
) -> None:
    _, ego, _, ego_size, objects, _, sizes, _ = scene
    values = worst.values
    x, y = ego[run, row, columns.EGO_X], ego[run, row, columns.EGO_Y]
    heading, speed = ego[run, row, columns.EGO_HEADING], ego[run, row, columns.EGO_SPEED]
    length, width = ego_size[run, 0], ego_size[run, 1]
    is_turned = False
    for thing in range(objects.shape[2]):
        o_heading = objects[run, row, thing, columns.OBJECT_HEADING]
        o_speed = objects[run, row, thing, columns.OBJECT_SPEED]
        dx = objects[run, row, thing, columns.OBJECT_X] - x
        dy = objects[run, row, thing, columns.OBJECT_Y] - y
        square = dx * dx + dy * dy
        # Each bound is a little on the safe side. The first one needs no trigonometry: one minus a
        # cosine is at most half of its angle squared.
        most = 2.0 * grip if thing < actor_count else grip
        angle, slower = o_heading - heading, o_speed - speed
        rate = math.sqrt(slower * slower + abs(speed * o_speed) * angle * angle)
        within = max(values[DCE, run], ENCOUNTER_DISTANCE) + ENCOUNTER_HORIZON * rate
        within = 1.0000001 * (reach[thing] + max(within, values[PLANAR_TTC, run] * rate))
        soon = values[WTTC, run]
        bound = 1.0000001 * (reach[thing] + soon * (rate + 0.5 * most * soon))
        if square > within * within and square > bound * bound:
            continue
        o_length, o_width = sizes[run, thing, 0], sizes[run, thing, 1]
        if not is_turned:
            turn(turns, 0, heading)
            is_turned = True
        turn(turns, thing + 1, o_heading)
        rate_x = o_speed * turns[thing + 1, 2] - speed * turns[0, 2]
        rate_y = o_speed * turns[thing + 1, 1] - speed * turns[0, 1]
        rate = math.sqrt(rate_x * rate_x + rate_y * rate_y)
        opening = dx * rate_x + dy * rate_y
        bound = 1.0000001 * (reach[thing] + soon * (rate + 0.5 * most * soon))
        if square <= bound * bound:
            soonest = worst_time_to_collision(dx, dy, rate_x, rate_y, reach[thing], most)
            _keep(WTTC, soonest, thing, run, row, worst)
        enough = 1.0000001 * (reach[thing] + values[DCE, run])
        near = reach[thing] + ENCOUNTER_DISTANCE
        # Whether it could matter how far apart they are now.
        is_near = square <= enough * enough or (values[TTCE, run] > 0.0 and square <= near * near)
        if square > reach[thing] * reach[thing]:
            if opening >= 0.0:
                if not is_near:
                    continue
            else:
                line, first, last = passing_line(
                    (dx, dy), (rate_x, rate_y), (turns[0, 1], turns[0, 2]), (length, width),
                    (turns[thing + 1, 1], turns[thing + 1, 2]), (o_length, o_width),
                )  # fmt: skip
                if line > _TOUCHING:
                    if last >= 0.0 and first <= ENCOUNTER_HORIZON:
                        _keep(DCE, line, thing, run, row, worst)
                        if line <= ENCOUNTER_DISTANCE:
                            time = max(first, 0.0)
                            _keep(TTCE, time, thing, run, row, worst)
                        continue
                    if not is_near:
                        continue
                else:
                    bound = 1.0000001 * (reach[thing] + values[PLANAR_TTC, run] * rate)
                    if square > bound * bound and values[DCE, run] <= 0.0:
                        continue
        own, other = (heading, length, width), (o_heading, o_length, o_width)
        time, distance = closest_encounter((dx, dy), (rate_x, rate_y), own, other)
        if distance <= 0.0:
            _keep(PLANAR_TTC, time, thing, run, row, worst)
        if time > ENCOUNTER_HORIZON:
            time = 0.0
            distance = box_distance((x, y, *own), (x + dx, y + dy, *other))
        _keep(DCE, distance, thing, run, row, worst)
        if distance <= ENCOUNTER_DISTANCE:
            _keep(TTCE, time, thing, run, row, worst)


# --- Compiled: who crosses the ego's way, and by how much time both miss each other there ---------

PET, OVERLAP, ENCROACHMENT, PREDICTED_PET = range(4)
CROSSINGS: Final = 4
"""Number of the quantities; the times of overlap and encroachment are worse when larger."""

_NO_CROSSING: Final = 0.7
"""Angle to the road below which nobody moves faster across it than along [rad]."""


@allocating
def worst_crossings(  # noqa: C901, PLR0912, PLR0915 - a kernel over the scene
    scene: Scene, step: float, gaps: Floats, actor_count: int, worst: Found
) -> None:
    """Find the worst crossings of B runs, the earliest actor among equals.

    Args:
        scene: The runs.
        step: Time between rows [s].
        gaps: (B, T) gap of ``conflict``: NaN at a row with an input that is not finite.
        actor_count: How many of the objects are actors.
        worst: (4, B) out [s], with the row at or before which the second one enters; of a
            prediction, its row. The post-encroachment time is ``undefined`` where an actor and the
            ego are in the conflict area at once or touch, and ``incomplete`` where the run ends
            before the second one enters. Where nobody crosses, all of them are ``not_applicable``.
    """
    length, ego, ego_place, ego_size, objects, places, sizes, contact = scene
    values, rows, actors, codes = worst
    turns = np.zeros((2, 3))
    crossing = np.zeros(actor_count, dtype=np.bool_)
    for run in range(length.shape[0]):
        values[PET, run] = values[PREDICTED_PET, run] = math.inf
        values[OVERLAP, run] = values[ENCROACHMENT, run] = -math.inf
        rows[:, run], actors[:, run] = 0, -1
        is_error = False
        for row in range(length[run]):
            is_error |= math.isnan(gaps[run, row])
        if is_error or length[run] == 0:
            codes[:, run] = ERROR if is_error else UNDEFINED
            continue
        codes[:, run] = NOT_APPLICABLE
        last = length[run] - 1
        touched = contact[run, last]
        is_together, is_open, is_cut = False, False, False
        crossing[:] = False
        for row in range(length[run]):
            for thing in range(actor_count):
                angle = objects[run, row, thing, columns.OBJECT_HEADING]
                angle -= places[run, row, thing, columns.PLACE_HEADING]
                if abs(angle) > _NO_CROSSING:
                    crossing[thing] = True
        for thing in range(actor_count):
            if not crossing[thing]:
                continue
            turns[:] = math.nan
            nearest, is_crossing = -1, False
            least = math.inf
            for row in range(length[run]):
                other = _body(objects[run, row, thing], places[run, row, thing], sizes[run, thing],
                              columns.OBJECT_HEADING, columns.OBJECT_SPEED, turns, 1)  # fmt: skip
                if not abs(other[ACROSS]) > abs(other[ALONG]):
                    continue
                if not is_crossing and codes[ENCROACHMENT, run] == NOT_APPLICABLE:
                    codes[:, run] = NO_CONFLICT
                is_crossing = True
                own = _body(ego[run, row], ego_place[run, row], ego_size[run],
                            columns.EGO_HEADING, columns.EGO_SPEED, turns, 0)  # fmt: skip
                apart = lane_way(
                    own[S], ego_place[run, row, columns.PLACE_HEADING], own[D],
                    other[S], places[run, row, thing, columns.PLACE_HEADING],
                )  # fmt: skip
                predicted = _predicted(own, other, apart, 0.5 * ego_size[run, 1])
                if predicted < values[PREDICTED_PET, run]:
                    values[PREDICTED_PET, run] = predicted
                    rows[PREDICTED_PET, run], actors[PREDICTED_PET, run] = row, thing
                    codes[PREDICTED_PET, run] = VALUE
                beside = abs(other[D] - own[D])
                if beside < least:
                    least, nearest = beside, row
            if not is_crossing:
                continue
            # Where the ego is when it gets to where the actor crosses.
            place = places[run, nearest, thing, columns.PLACE_S]
            passing, least = 0, math.inf
            for row in range(length[run]):
                apart = abs(ego_place[run, row, columns.PLACE_S] - place)
                if apart < least:
                    least, passing = apart, row
            own = _body(ego[run, passing], ego_place[run, passing], ego_size[run],
                        columns.EGO_HEADING, columns.EGO_SPEED, turns, 0)  # fmt: skip
            enter, leave, low, high = _stay(
                length[run], own[D], own[HALF_WIDTH], objects[run, :, thing],
                places[run, :, thing], sizes[run, thing], turns,
            )  # fmt: skip
            if enter == math.inf:
                continue
            first, gone = _passage(
                length[run], low, high, ego[run], ego_place[run], ego_size[run], turns
            )
            if gone == -math.inf and touched != thing:
                # The ego was past it before the run began.
                continue
            if leave < math.inf and enter >= 0.0:
                stay = (leave - enter) * step
                if stay > values[ENCROACHMENT, run]:
                    values[ENCROACHMENT, run] = stay
                    rows[ENCROACHMENT, run], actors[ENCROACHMENT, run] = int(enter), thing
            else:
                is_cut = True
            second = max(enter, first, 0.0)
            miss = max(first - leave, enter - gone)
            if touched == thing or (second < math.inf and miss < 0.0):
                is_together = True
                ends = min(leave, gone, float(last))
                together = max(0.0, ends - min(second, float(last))) * step
                if together > values[OVERLAP, run]:
                    values[OVERLAP, run] = together
                    rows[OVERLAP, run] = min(last, int(min(second, float(last))))
                    actors[OVERLAP, run] = thing
            elif second == math.inf:
                is_open = True
            elif miss * step < values[PET, run]:
                values[PET, run] = miss * step
                rows[PET, run], actors[PET, run] = int(second), thing
        for quantity in (OVERLAP, ENCROACHMENT, PET):
            if actors[quantity, run] >= 0:
                codes[quantity, run] = VALUE
        if is_cut:
            codes[ENCROACHMENT, run] = INCOMPLETE
        if is_open:
            codes[PET, run] = INCOMPLETE
        if is_together:
            codes[PET, run] = UNDEFINED


@inlined
def _body(  # noqa: PLR0913, PLR0917 - where it is read
    state: Floats,
    place: Floats,
    size: Floats,
    heading: int,
    speed: int,
    turns: Floats,
    which: int,
) -> Body:
    """Read a body on the road from its columns."""
    turn(turns, which, state[heading] - place[columns.PLACE_HEADING])
    sine, cosine = turns[which, 1], turns[which, 2]
    return on_road(
        place[columns.PLACE_S], place[columns.PLACE_D], state[speed], size[0], size[1], sine, cosine
    )


@inlined
def _reach(body: Body, place: Floats) -> float:
    """Half of what a body takes of the reference line [m]: more than its extent inside a bend."""
    return float(body[HALF_LENGTH] / max(1e-3, 1.0 - place[columns.PLACE_CURVATURE] * body[D]))


@inlined
def _predicted(own: Body, other: Body, apart: float, corridor: float) -> float:
    """Return the post-encroachment time at constant speeds [s].

    Args:
        own: Ego on the road.
        other: Actor on the road.
        apart: From the ego's centre to the actor's along the ego's lane [m].
        corridor: Half of the ego's width [m].

    Returns:
        0 where both would be in the conflict area at once, infinity for an actor that has left the
        corridor or is not ahead, for an ego that will be past, and for one that stands.
    """
    gap = apart - own[HALF_LENGTH] - other[HALF_LENGTH]
    speed, across = own[ALONG], other[ACROSS]
    if gap <= 0.0 or speed <= 0.0:
        return math.inf
    beside, reach = other[D] - own[D], corridor + other[HALF_WIDTH]
    enter = (-math.copysign(reach, across) - beside) / across
    leave = (math.copysign(reach, across) - beside) / across
    if leave < 0.0:
        return math.inf
    # Along the road it goes on while it crosses.
    begin, end = other[ALONG] * max(enter, 0.0), other[ALONG] * leave
    first = (gap + min(begin, end)) / speed
    way = 2.0 * (own[HALF_LENGTH] + other[HALF_LENGTH])
    gone = (gap + max(begin, end) + way) / speed
    if gone <= 0.0:
        return math.inf
    return max(0.0, max(first, 0.0) - leave, enter - gone)


@inlined
def _share(before: float, after: float) -> float:
    """Return at which share of a step a clearance that changes its sign is 0."""
    return before / (before - after) if before != after else 0.0


@inlined
def _stay(  # noqa: PLR0913, PLR0917 - a part of the kernel
    rows: int,
    middle: float,
    corridor: float,
    states: Floats,
    places: Floats,
    size: Floats,
    turns: Floats,
) -> tuple[float, float, float, float]:
    """Find when an actor is in the corridor first, and where along the road.

    Returns:
        Entry and exit in rows with their shares, infinity for what does not happen and minus
        infinity for an entry before the run; least and largest place that it takes up [m].
    """
    enter, leave, low, high = math.inf, math.inf, math.inf, -math.inf
    other = _body(
        states[0], places[0], size, columns.OBJECT_HEADING, columns.OBJECT_SPEED, turns, 1
    )
    beside, reach = other[D] - middle, corridor + other[HALF_WIDTH]
    if abs(beside) < reach:
        enter = -math.inf
        low, high = other[S] - _reach(other, places[0]), other[S] + _reach(other, places[0])
    for row in range(1, rows):
        before = other
        side = math.copysign(1.0, beside)
        is_inside = abs(beside) < reach
        clear = side * beside - reach
        past = -side * beside - reach
        other = _body(
            states[row], places[row], size, columns.OBJECT_HEADING, columns.OBJECT_SPEED, turns, 1
        )
        beside, reach = other[D] - middle, corridor + other[HALF_WIDTH]
        begin, end = (0.0 if is_inside else math.inf), math.inf
        if not is_inside and side * beside - reach < 0.0:
            begin = _share(clear, side * beside - reach)
            enter = row - 1 + begin
        if begin < math.inf and abs(beside) >= reach:
            # It leaves on the other side, or on that from which it came.
            end = _share(past, -side * beside - reach)
            if side * beside > 0.0:
                end = _share(clear, side * beside - reach)
            leave = row - 1 + end
        if begin < math.inf:
            for share in (begin, min(end, 1.0)):
                center = before[S] + share * (other[S] - before[S])
                extent = max(_reach(before, places[row - 1]), _reach(other, places[row]))
                low, high = min(low, center - extent), max(high, center + extent)
        if leave < math.inf:
            break
    return enter, leave, low, high


@inlined
def _passage(  # noqa: PLR0913, PLR0917 - a part of the kernel
    rows: int,
    low: float,
    high: float,
    states: Floats,
    places: Floats,
    size: Floats,
    turns: Floats,
) -> tuple[float, float]:
    """Find when the ego enters and leaves a stretch of the road.

    Returns:
        Entry and exit in rows with their shares, infinity for what does not happen and minus
        infinity for what happened before the run.
    """
    own = _body(states[0], places[0], size, columns.EGO_HEADING, columns.EGO_SPEED, turns, 0)
    reach = _reach(own, places[0])
    front, rear = own[S] + reach, own[S] - reach
    first = -math.inf if front >= low else math.inf
    gone = -math.inf if rear >= high else math.inf
    for row in range(1, rows):
        front_before, rear_before = front, rear
        own = _body(
            states[row], places[row], size, columns.EGO_HEADING, columns.EGO_SPEED, turns, 0
        )
        reach = _reach(own, places[row])
        front, rear = own[S] + reach, own[S] - reach
        if first == math.inf and front >= low:
            first = row - 1 + _share(low - front_before, low - front)
        if gone == math.inf and rear >= high:
            gone = row - 1 + _share(high - rear_before, high - rear)
            break
    return first, gone


# --- Metrics of encounters in the plane and of crossings, with all objects ------------------------


@object_entry("adeye:criticality.min_ttc_2d@1", "s", "lower", cap=10.0)
def min_ttc_2d(series: TraceSeries) -> MetricColumn:
    """Least time until the bodies of ego and any object touch at constant velocity and heading."""
    return _encounter(series, PLANAR_TTC)


@object_entry("adeye:criticality.min_wttc@1", "s", "lower", cap=10.0)
def min_wttc(series: TraceSeries) -> MetricColumn:
    """Least time in which ego and any object can touch, whatever both do up to friction."""
    return _encounter(series, WTTC)


@object_entry("adeye:criticality.min_dce@1", "m", "lower", scale=10.0, cap=100.0)
def min_dce(series: TraceSeries) -> MetricColumn:
    """Least distance of closest encounter with any object within 10 s of constant velocity."""
    return _encounter(series, DCE)


@object_entry("adeye:criticality.min_ttce@1", "s", "lower", cap=10.0)
def min_ttce(series: TraceSeries) -> MetricColumn:
    """Least time to a closest encounter of at most 1 m with any object, at constant velocity."""
    return _encounter(series, TTCE)


@object_entry("adeye:criticality.min_pet@1", "s", "lower", cap=10.0)
def min_pet(series: TraceSeries) -> MetricColumn:
    """Least time from the first one's exit of a conflict area to the second one's entry.

    Undefined where both are inside at once.
    """
    return _crossing(series, PET)


@object_entry("adeye:criticality.pet_overlap@1", "s", "higher")
def pet_overlap(series: TraceSeries) -> MetricColumn:
    """Longest time in which ego and a crossing actor are both in their conflict area."""
    return _crossing(series, OVERLAP)


@object_entry("adeye:criticality.max_encroachment_time@1", "s", "higher")
def max_encroachment_time(series: TraceSeries) -> MetricColumn:
    """Longest time for which an actor that crosses takes up the ego's corridor."""
    return _crossing(series, ENCROACHMENT)


@object_entry("adeye:criticality.min_predicted_pet@1", "s", "lower", cap=10.0)
def min_predicted_pet(series: TraceSeries) -> MetricColumn:
    """Least post-encroachment time predicted at constant speeds; 0 where both would be inside."""
    return _crossing(series, PREDICTED_PET)


def _encounter(series: TraceSeries, quantity: int) -> MetricColumn:
    def scan(worst: Found) -> None:
        grip = np.ascontiguousarray(series.abilities[:, 1])
        worst_encounters(series.scene, series.nearest[0], _actor_count(series), grip, worst)

    return found_column(series, "encounters", ENCOUNTERS, scan, quantity)


def _crossing(series: TraceSeries, quantity: int) -> MetricColumn:
    def scan(worst: Found) -> None:
        worst_crossings(series.scene, series.step, series.nearest[0], _actor_count(series), worst)

    return found_column(series, "crossings", CROSSINGS, scan, quantity)


def _actor_count(series: TraceSeries) -> int:
    return series.trace.layout.context.actor_count
