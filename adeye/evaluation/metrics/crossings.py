"""Compiled: who crosses the ego's way, and by how much time both miss each other there.

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

from adeye.evaluation.bodies import (
    ACROSS,
    ALONG,
    HALF_LENGTH,
    HALF_WIDTH,
    Body,
    D,
    S,
    on_road,
    turn,
)
from adeye.evaluation.metrics.statuses import CODES
from adeye.kernel.jit import allocating, inlined
from adeye.kernel.road import lane_way
from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    OBJECT_HEADING,
    OBJECT_SPEED,
    PLACE_CURVATURE,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
    Floats,
    Ints,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Codes = NDArray[np.int8]

PET, OVERLAP, ENCROACHMENT, PREDICTED_PET = range(4)
CROSSINGS: Final = 4
"""Number of the quantities; the times of overlap and encroachment are worse when larger."""

_NO_CROSSING: Final = 0.7
"""Angle to the road below which nobody moves faster across it than along [rad]."""

_VALUE: Final = CODES["value"]
_FREE: Final = CODES["no_conflict"]
_NOT_APPLICABLE: Final = CODES["not_applicable"]
_UNDEFINED: Final = CODES["undefined"]
_INCOMPLETE: Final = CODES["incomplete"]
_ERROR: Final = CODES["error"]


@allocating
def worst_crossings(  # noqa: C901, PLR0912, PLR0913, PLR0915, PLR0917 - a kernel over the scene
    length: Ints,
    step: float,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    objects: Floats,
    places: Floats,
    sizes: Floats,
    contact: Ints,
    gaps: Floats,
    actor_count: int,
    values: Floats,
    rows: Ints,
    actors: Ints,
    codes: Codes,
) -> None:
    """Find the worst crossings of B runs, the earliest actor among equals.

    Args:
        length: (B,) rows that a run has.
        step: Time between rows [s].
        ego: (B, T, 7).
        ego_place: (B, T, 6).
        ego_size: (B, 3).
        objects: (B, T, M, 5).
        places: (B, T, M, 6).
        sizes: (B, M, 3).
        contact: (B, T) object that the ego touches, -1 for none.
        gaps: (B, T) gap of ``conflict``: NaN at a row with an input that is not finite.
        actor_count: How many of the objects are actors.
        values: (4, B) out [s].
        rows: (4, B) out: row at or before which the second one enters; of a prediction, its row.
        actors: (4, B) out.
        codes: (4, B) out: index into the statuses of metrics. The post-encroachment time is
            ``undefined`` where an actor and the ego are in the conflict area at once or touch, and
            ``incomplete`` where the run ends before the second one enters. Where nobody crosses,
            all of them are ``not_applicable``.
    """
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
            codes[:, run] = _ERROR if is_error else _UNDEFINED
            continue
        codes[:, run] = _NOT_APPLICABLE
        last = length[run] - 1
        touched = contact[run, last]
        is_together, is_open, is_cut = False, False, False
        crossing[:] = False
        for row in range(length[run]):
            for thing in range(actor_count):
                angle = objects[run, row, thing, OBJECT_HEADING]
                angle -= places[run, row, thing, PLACE_HEADING]
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
                              OBJECT_HEADING, OBJECT_SPEED, turns, 1)  # fmt: skip
                if not abs(other[ACROSS]) > abs(other[ALONG]):
                    continue
                if not is_crossing and codes[ENCROACHMENT, run] == _NOT_APPLICABLE:
                    codes[:, run] = _FREE
                is_crossing = True
                own = _body(ego[run, row], ego_place[run, row], ego_size[run],
                            EGO_HEADING, EGO_SPEED, turns, 0)  # fmt: skip
                apart = lane_way(
                    own[S], ego_place[run, row, PLACE_HEADING], own[D],
                    other[S], places[run, row, thing, PLACE_HEADING],
                )  # fmt: skip
                predicted = _predicted(own, other, apart, 0.5 * ego_size[run, 1])
                if predicted < values[PREDICTED_PET, run]:
                    values[PREDICTED_PET, run] = predicted
                    rows[PREDICTED_PET, run], actors[PREDICTED_PET, run] = row, thing
                    codes[PREDICTED_PET, run] = _VALUE
                beside = abs(other[D] - own[D])
                if beside < least:
                    least, nearest = beside, row
            if not is_crossing:
                continue
            # Where the ego is when it gets to where the actor crosses.
            place = places[run, nearest, thing, PLACE_S]
            passing, least = 0, math.inf
            for row in range(length[run]):
                apart = abs(ego_place[run, row, PLACE_S] - place)
                if apart < least:
                    least, passing = apart, row
            own = _body(ego[run, passing], ego_place[run, passing], ego_size[run],
                        EGO_HEADING, EGO_SPEED, turns, 0)  # fmt: skip
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
        if actors[OVERLAP, run] >= 0:
            codes[OVERLAP, run] = _VALUE
        if actors[ENCROACHMENT, run] >= 0:
            codes[ENCROACHMENT, run] = _VALUE
        if is_cut:
            codes[ENCROACHMENT, run] = _INCOMPLETE
        if actors[PET, run] >= 0:
            codes[PET, run] = _VALUE
        if is_open:
            codes[PET, run] = _INCOMPLETE
        if is_together:
            codes[PET, run] = _UNDEFINED


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
    turn(turns, which, state[heading] - place[PLACE_HEADING])
    sine, cosine = turns[which, 1], turns[which, 2]
    return on_road(place[PLACE_S], place[PLACE_D], state[speed], size[0], size[1], sine, cosine)


@inlined
def _reach(body: Body, place: Floats) -> float:
    """Half of what a body takes of the reference line [m]: more than its extent inside a bend."""
    return float(body[HALF_LENGTH] / max(1e-3, 1.0 - place[PLACE_CURVATURE] * body[D]))


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
    other = _body(states[0], places[0], size, OBJECT_HEADING, OBJECT_SPEED, turns, 1)
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
        other = _body(states[row], places[row], size, OBJECT_HEADING, OBJECT_SPEED, turns, 1)
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
    own = _body(states[0], places[0], size, EGO_HEADING, EGO_SPEED, turns, 0)
    reach = _reach(own, places[0])
    front, rear = own[S] + reach, own[S] - reach
    first = -math.inf if front >= low else math.inf
    gone = -math.inf if rear >= high else math.inf
    for row in range(1, rows):
        front_before, rear_before = front, rear
        own = _body(states[row], places[row], size, EGO_HEADING, EGO_SPEED, turns, 0)
        reach = _reach(own, places[row])
        front, rear = own[S] + reach, own[S] - reach
        if first == math.inf and front >= low:
            first = row - 1 + _share(low - front_before, low - front)
        if gone == math.inf and rear >= high:
            gone = row - 1 + _share(high - rear_before, high - rear)
            break
    return first, gone
