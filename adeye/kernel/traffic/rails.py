"""Drivers on rails: vehicles that keep to the lanes of one line, whatever its bends and strips.

A vehicle's state is its place (s, d) beside the line, its lane and its speed; x, y and heading
follow from these. A lane is a chain of strips that go on into each other, see ``kernel.strips``,
driven with the line (way 1) or against it (-1). Where a lane drives, ``u = way * s`` grows. A
change of lanes is a quintic of the way, so that its path stays when the driver brakes; until its
end the vehicle stands in both lanes. The ego and everything else that others move stand in every
lane that their body covers. So nobody is projected, and one sort along the line tells who drives
ahead of whom. Gaps run from bumper to bumper along the driver's own place beside the line, as
``road.lane_way``.

In a tick all see the state at its beginning; only changes of lanes are decided one after the
other, by the numbers (keys) of the vehicles, whatever the order of their rows.

Source:
    Treiber, Hennecke, Helbing (2000) for IDM, with gaps between bumpers as there; Kesting, Treiber,
    Helbing (2007) for MOBIL, with politeness zero. Parameters are those of ``drivers``.
    Not validated: how drivers make room where a lane ends.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.kernel import strips as st
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan2, power, sin_cos
from adeye.kernel.jit import allocating, compiled, inlined
from adeye.kernel.motion import clip
from adeye.kernel.traffic import drivers
from adeye.kernel.traffic import network as n

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LATERAL_COMFORT: Final = 3.0
"""Lateral acceleration that drivers accept in bends [m/s²]."""

EASY_BRAKING: Final = 2.0
"""With which they slow down for bends and limits ahead, and for one who needs their lane [m/s²]."""

HARD_BRAKING: Final = 5.0
"""Braking that a change may ask for at the end of a lane; also of who is too fast for a bend."""

CHANGE_TIME: Final = 4.0
"""A change of lanes takes the way of this time [s], if the lane is long enough."""

LEAST_WAY: Final = 15.0
"""Shortest way of a change of lanes [m]; a long vehicle takes more, or it would sweep aside."""

WAY_OF_LENGTHS: Final = 3.3
"""Its lengths that it takes at least."""

NEEDED: Final = 300.0
"""So far before the end of their lane drivers want to leave it [m]."""

MORE_CHANGES: Final = 100.0
"""A lane that several changes lead out of counts as shorter, for each beyond the first [m]."""

MOST_LANES: Final = 62
"""A vehicle's lanes are the bits of one number."""

# Columns of what lies along a line, in the order of s: pieces of the line and rows of its lanes.
# Squares of the speed that is allowed [m²/s²]: in it, and where it is left, with the line and
# against it.
BEGIN, END, CAP, AFTER, CAP_BACK, AFTER_BACK = range(6)
# Of a piece of the line, straight or an arc: its start, the heading there, never wrapped.
LINE_X, LINE_Y, LINE_TURN, LINE_SINUS, LINE_COSINE, LINE_CURVATURE = range(6, 12)
LINE_WIDTH: Final = 12
# Of a row of a lane: d of its edges where it begins, each with its slope; the lanes of the same way
# that touch it, -1 for none; its number among the lanes of the ego's way, -1 for one of the other.
RIGHT, RIGHT_SLOPE, LEFT, LEFT_SLOPE, BESIDE_RIGHT, BESIDE_LEFT, NUMBER = range(6, 13)
ROW_WIDTH: Final = 13

# Columns of a lane: its rows, its way, from which to which u one may drive in it, and the number of
# the slab that its first row lies in with s where that begins, which is never before that of the
# lane in front of it in the table.
FIRST, COUNT, WAY, FROM, TO, SLAB, START = range(7)
LANE_WIDTH: Final = 7

# Columns of a vehicle behind those of ``network``: its place beside the line; heading (never
# wrapped) and curvature of the line there; speed along the line; half its extent along and across
# it; and of a change of lanes: how far aside it began, at which u, and the way that it takes.
D, TURN, CURVATURE, ALONG, HALF, HALF_ACROSS, OFFSET, BEGUN, EXTENT = range(
    n.VEHICLE_WIDTH, n.VEHICLE_WIDTH + 9
)
VEHICLE_WIDTH: Final = n.VEHICLE_WIDTH + 9

# Columns of its marks behind those of ``network``: the piece of the line and the row of its target
# lane that it is in, of what others move the slab; its lanes as bits; its key. Line k of the last
# names the one with the k-th.
PIECE, ROW, LANES, KEY, BY_KEY = range(n.MARK_WIDTH, n.MARK_WIDTH + 5)
MARK_WIDTH: Final = n.MARK_WIDTH + 5


class Rails(NamedTuple):
    """The line of a run, the lanes along it, and what is on them.

    Attributes:
        line: (K, LINE_WIDTH).
        lanes: (C, LANE_WIDTH); those without rows are not there.
        rows: (R, ROW_WIDTH), lane by lane.
        vehicles: (N, VEHICLE_WIDTH).
        marks: (N, MARK_WIDTH).
    """

    line: Floats
    lanes: Floats
    rows: Floats
    vehicles: Floats
    marks: Ints


# --- The line and its lanes -----------------------------------------------------------------------


@compiled
def lay_line(segments: Floats, lead: float, line: Floats) -> None:
    """Write the pieces of a line, the first of them straight before its beginning.

    Args:
        segments: (K, 5), see ``kernel.road``.
        lead: Length of the first piece [m].
        line: (K + 1, LINE_WIDTH) out, speeds without bounds.
    """
    line[:, CAP : AFTER_BACK + 1] = math.inf
    s, turn = 0.0, segments[0, 2]
    for k in range(line.shape[0]):
        row, segment = line[k], segments[max(0, k - 1)]
        length = segment[3] if k else lead
        row[LINE_SINUS], row[LINE_COSINE] = sin_cos(wrap_to_pi(turn))
        row[BEGIN], row[END], row[LINE_TURN] = s, s + length, turn
        row[LINE_X], row[LINE_Y] = segment[0], segment[1]
        if k:
            row[LINE_CURVATURE] = segment[4]
            turn += segment[4] * length
            s += length
        else:
            row[BEGIN], row[END], row[LINE_CURVATURE] = -lead, 0.0, 0.0
            row[LINE_X] -= lead * row[LINE_COSINE]
            row[LINE_Y] -= lead * row[LINE_SINUS]


@inlined
def _is_driven(strip: Floats) -> bool:
    return strip[st.STRIP_KIND] == st.DRIVING and strip[st.STRIP_WAY] != 0.0


@compiled
def _link(slabs: Floats, strips: Floats, goes_on: Ints, comes_from: Ints, apart: Floats) -> None:
    """Find the strip of the next slab that each lane goes on in: the nearest, one for each."""
    goes_on[:] = comes_from[:] = -1
    for slab in range(1, slabs.shape[0]):
        way = slabs[slab, st.SLAB_BEGIN] - slabs[slab - 1, st.SLAB_BEGIN]
        first, other = int(slabs[slab, st.SLAB_FIRST]), int(slabs[slab - 1, st.SLAB_FIRST])
        for old in range(other, other + int(slabs[slab - 1, st.SLAB_STRIPS])):
            right = strips[old, st.STRIP_RIGHT] + way * strips[old, st.STRIP_RIGHT_SLOPE]
            left = strips[old, st.STRIP_LEFT] + way * strips[old, st.STRIP_LEFT_SLOPE]
            best, nearest = -1, math.inf
            for new in range(first, first + int(slabs[slab, st.SLAB_STRIPS])):
                width = max(left - right, strips[new, st.STRIP_LEFT] - strips[new, st.STRIP_RIGHT])
                middle = 0.5 * (strips[new, st.STRIP_LEFT] + strips[new, st.STRIP_RIGHT])
                distance = abs(middle - 0.5 * (left + right))
                fits = _is_driven(strips[old]) and _is_driven(strips[new])
                fits = fits and strips[old, st.STRIP_WAY] == strips[new, st.STRIP_WAY]
                if fits and distance < min(nearest, 0.5 * width):
                    best, nearest = new, distance
            if best >= 0 and (comes_from[best] < 0 or nearest < apart[best]):
                if comes_from[best] >= 0:
                    goes_on[comes_from[best]] = -1
                goes_on[old], comes_from[best], apart[best] = best, old, nearest


@inlined
def _usable_end(rows: Floats, row: int, last: int, side: int) -> float:
    """Return s where a lane becomes too narrow towards its end, from its row there to its last.

    ``side`` is 1 for its end along the line, -1 for its beginning.
    """
    while True:
        begin, end = rows[row, BEGIN], rows[row, END]
        slope = rows[row, LEFT_SLOPE] - rows[row, RIGHT_SLOPE]
        here = rows[row, LEFT] - rows[row, RIGHT]
        there = here + slope * (end - begin)
        outer, inner = (there, here) if side > 0 else (here, there)
        if outer >= st.LEAST_LANE or side * slope >= 0.0:
            return end if side > 0 else begin
        if inner >= st.LEAST_LANE:
            return begin + (st.LEAST_LANE - here) / slope
        if row == last:
            return begin if side > 0 else end
        row -= side


@allocating
def lay_lanes(
    slabs: Floats, strips: Floats, length: float, line: Floats, lanes: Floats, rows: Floats
) -> int:
    """Write the lanes along a line, and the speeds that lanes and bends allow.

    Args:
        slabs: (n.S, 4), see ``kernel.strips``; the first reaches back and the last ahead for ever.
        strips: (J, 8).
        length: Where the last slab ends and strips go on as they are [m].
        line: (K, LINE_WIDTH) in and out, see ``lay_line``.
        lanes: (J, LANE_WIDTH) out.
        rows: (J, ROW_WIDTH) out.

    Returns:
        How many lanes there are.
    """
    count = strips.shape[0]
    goes_on, comes_from = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    lane_of, apart = np.full(count, -1), np.zeros(count)
    slab_of, row_of = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    lanes[:], rows[:] = 0.0, 0.0
    _link(slabs, strips, goes_on, comes_from, apart)
    for slab in range(slabs.shape[0]):
        first = int(slabs[slab, st.SLAB_FIRST])
        slab_of[first : first + int(slabs[slab, st.SLAB_STRIPS])] = slab
    found = written = 0
    for strip in range(count):
        if not _is_driven(strips[strip]) or comes_from[strip] >= 0:
            continue
        at, first = strip, written
        while at >= 0:
            lane_of[at], row_of[at] = found, written
            row, slab = rows[written], slab_of[at]
            row[BEGIN] = slabs[slab, st.SLAB_BEGIN]
            row[END] = slabs[slab + 1, st.SLAB_BEGIN] if slab + 1 < slabs.shape[0] else length
            row[CAP] = row[CAP_BACK] = strips[at, st.STRIP_LIMIT] * strips[at, st.STRIP_LIMIT]
            # A copy in one piece compiles for seconds: numba prepares to tell why it does not fit.
            for edge in range(LEFT_SLOPE + 1 - RIGHT):
                row[RIGHT + edge] = strips[at, st.STRIP_RIGHT + edge]
            row[NUMBER] = strips[at, st.STRIP_LANE]
            written, at = written + 1, goes_on[at]
        _look_ahead(rows[first:written])
        low = _usable_end(rows, first, written - 1, -1) if slab_of[strip] > 0 else -math.inf
        high = math.inf
        if rows[written - 1, END] < length:
            high = _usable_end(rows, written - 1, first, 1)
        way = strips[strip, st.STRIP_WAY]
        lanes[found, FIRST], lanes[found, COUNT], lanes[found, WAY] = first, written - first, way
        lanes[found, FROM], lanes[found, TO] = (low, high) if way > 0.0 else (-high, -low)
        lanes[found, SLAB] = slab_of[strip]
        lanes[found, START] = rows[first, BEGIN] if slab_of[strip] > 0 else -math.inf
        found += 1
    for strip in range(count):
        if lane_of[strip] >= 0:
            rows[row_of[strip], BESIDE_RIGHT] = _beside(strips, slab_of, lane_of, strip, -1)
            rows[row_of[strip], BESIDE_LEFT] = _beside(strips, slab_of, lane_of, strip, 1)
    _shorten(lanes[:found], rows, lanes[:found, TO].copy())
    _bound_bends(line, lanes[:found], rows)
    return found


@inlined
def _beside(strips: Floats, slab_of: Ints, lane_of: Ints, strip: int, side: int) -> int:
    """Return the lane of the same way that touches a strip on a side, -1 for none."""
    other = strip + side
    if not 0 <= other < strips.shape[0] or slab_of[other] != slab_of[strip]:
        return -1
    if strips[other, st.STRIP_WAY] != strips[strip, st.STRIP_WAY]:
        return -1
    return int(lane_of[other])


@inlined
def _shorten(lanes: Floats, rows: Floats, ends: Floats) -> None:
    """Let lanes (C, ...) that several changes lead out of end sooner, given where they do."""
    for number in range(ends.shape[0]):
        fewest = ends.shape[0] if ends[number] < math.inf else 1
        for side in range(BESIDE_RIGHT, BESIDE_LEFT + 1):
            at, changes = number, 0
            while at >= 0 and changes < fewest and ends[at] < ends[number] + LEAST_WAY:
                s = lanes[number, WAY] * ends[number]
                at, changes = int(rows[find_row(lanes, rows, at, s), side]), changes + 1
            fewest = min(fewest, changes) if at >= 0 else fewest
        if 1 < fewest < ends.shape[0]:
            lanes[number, TO] -= MORE_CHANGES * (fewest - 1)


@compiled
def _look_ahead(rows: Floats) -> None:
    """Write the speeds (R, ...) with which each may be left, from those that come after it."""
    last = rows.shape[0] - 1
    rows[last, AFTER] = rows[0, AFTER_BACK] = math.inf
    for k in range(last - 1, -1, -1):
        after = rows[k + 1]
        way = 2.0 * EASY_BRAKING * (after[END] - after[BEGIN])
        rows[k, AFTER] = min(after[CAP], after[AFTER] + way)
    for k in range(1, last + 1):
        after = rows[k - 1]
        way = 2.0 * EASY_BRAKING * (after[END] - after[BEGIN])
        rows[k, AFTER_BACK] = min(after[CAP_BACK], after[AFTER_BACK] + way)


@compiled
def _bound_bends(line: Floats, lanes: Floats, rows: Floats) -> None:
    """Write the speeds that bends allow in their narrowest lane, each way."""
    for k in range(line.shape[0]):
        piece = line[k]
        bend = piece[LINE_CURVATURE]
        if bend == 0.0:
            continue
        for number in range(lanes.shape[0]):
            cap = CAP if lanes[number, WAY] > 0.0 else CAP_BACK
            first = int(lanes[number, FIRST])
            for row in range(first, first + int(lanes[number, COUNT])):
                low, high = max(rows[row, BEGIN], piece[BEGIN]), min(rows[row, END], piece[END])
                if low < high:
                    d = _middle(rows[row], low)[0], _middle(rows[row], high)[0]
                    scale = max(0.0, 1.0 - max(bend * d[0], bend * d[1]))
                    piece[cap] = min(piece[cap], LATERAL_COMFORT * scale / abs(bend))
    _look_ahead(line)


@inlined
def _walk(rows: Floats, row: int, first: int, last: int, s: float) -> int:
    """Return the row that a place is in, from one nearby; the first and the last have no bounds."""
    while row < last and s >= rows[row, END]:
        row += 1
    while row > first and s < rows[row, BEGIN]:
        row -= 1
    return row


@inlined
def find_row(lanes: Floats, rows: Floats, lane: int, s: float) -> int:
    """Return the row of a lane at a place; its first before, its last behind it."""
    low = int(lanes[lane, FIRST])
    high = low + int(lanes[lane, COUNT])
    while high - low > 1:
        middle = (low + high) // 2
        if rows[middle, BEGIN] <= s:
            low = middle
        else:
            high = middle
    return low


@inlined
def _middle(row: Floats, s: float) -> tuple[float, float]:
    """Return d of the middle of a lane's row at a place [m], and its slope."""
    slope, within = 0.5 * (row[RIGHT_SLOPE] + row[LEFT_SLOPE]), clip(s, row[BEGIN], row[END])
    middle = 0.5 * (row[RIGHT] + row[LEFT]) + slope * (within - row[BEGIN])
    return middle, slope if within == s else 0.0


@inlined
def _allowed(rails: Rails, who: int, s: float, way: float) -> float:
    """Return the square of the speed that bends and limits allow a driver at a place [m²/s²]."""
    piece, row = rails.line[rails.marks[who, PIECE]], rails.rows[rails.marks[who, ROW]]
    if way > 0.0:
        of_piece = min(piece[CAP], piece[AFTER] + 2.0 * EASY_BRAKING * (piece[END] - s))
        return min(of_piece, row[CAP], row[AFTER] + 2.0 * EASY_BRAKING * (row[END] - s))
    of_piece = min(piece[CAP_BACK], piece[AFTER_BACK] + 2.0 * EASY_BRAKING * (s - piece[BEGIN]))
    return min(of_piece, row[CAP_BACK], row[AFTER_BACK] + 2.0 * EASY_BRAKING * (s - row[BEGIN]))


# --- Where everything is --------------------------------------------------------------------------


@inlined
def _least_way(vehicle: Floats) -> float:
    """Return the shortest way of a change of lanes [m]."""
    return max(LEAST_WAY, WAY_OF_LENGTHS * vehicle[n.LENGTH])


@inlined
def _find_on_line(rails: Rails, who: int) -> None:
    """Write the heading and the curvature of the line beside somebody."""
    vehicle, marks = rails.vehicles[who], rails.marks[who]
    k = _walk(rails.line, marks[PIECE], 0, rails.line.shape[0] - 1, vehicle[n.S])
    marks[PIECE] = k
    vehicle[CURVATURE] = rails.line[k, LINE_CURVATURE]
    vehicle[TURN] = rails.line[k, LINE_TURN] + vehicle[CURVATURE] * (
        vehicle[n.S] - rails.line[k, BEGIN]
    )


@compiled
def show_thing(rails: Rails, who: int, s: float, d: float, aslant: float, speed: float) -> None:
    """Put what others move into every lane that its body covers.

    Args:
        rails: In and out; length and width of it given.
        who: Its row.
        s: Of its centre along the line [m].
        d: [m].
        aslant: Its heading against that of the line [rad].
        speed: [m/s].
    """
    vehicle, marks = rails.vehicles[who], rails.marks[who]
    vehicle[n.S], vehicle[D], vehicle[n.SPEED] = s, d, speed
    _find_on_line(rails, who)
    sine, cosine = sin_cos(aslant)
    vehicle[ALONG] = speed * cosine
    length, width = 0.5 * vehicle[n.LENGTH], vehicle[HALF_ACROSS]
    vehicle[HALF] = abs(cosine) * length + abs(sine) * width
    across = abs(sine) * length + abs(cosine) * width
    bits = 0
    for lane in range(rails.lanes.shape[0]):
        if rails.lanes[lane, COUNT] == 0.0 or rails.lanes[lane, START] > s + vehicle[HALF]:
            break
        u = rails.lanes[lane, WAY] * s
        # Of all lanes along the road few are where a body is: only those are searched.
        if u < rails.lanes[lane, FROM] - vehicle[HALF] or u > rails.lanes[lane, TO] + vehicle[HALF]:
            continue
        first, slab = int(rails.lanes[lane, FIRST]), int(rails.lanes[lane, SLAB])
        last = first + int(rails.lanes[lane, COUNT]) - 1
        near = min(max(first + marks[ROW] - slab, first), last)
        near = _walk(rails.rows, near, first, last, s)
        marks[ROW] = near - first + slab
        row = rails.rows[near]
        beyond = clip(s - row[BEGIN], 0.0, row[END] - row[BEGIN])
        if (
            d + across > row[RIGHT] + row[RIGHT_SLOPE] * beyond
            and d - across < row[LEFT] + row[LEFT_SLOPE] * beyond
        ):
            bits |= 1 << lane
    marks[LANES] = bits


@compiled
def begin_driver(rails: Rails, who: int, s: float, d: float, way: float) -> bool:
    """Put a driver into the nearest lane of a way; tell whether there is one.

    Args:
        rails: In and out; its speed given.
        who: Its row.
        s: Of its centre along the line [m].
        d: [m]; from beside the middle of its lane it drives there as if it changed lanes.
        way: 1 along the line, -1 against it.
    """
    vehicle, marks = rails.vehicles[who], rails.marks[who]
    nearest = math.inf
    for lane in range(rails.lanes.shape[0]):
        fits = rails.lanes[lane, COUNT] > 0.0 and rails.lanes[lane, WAY] == way
        if fits and rails.lanes[lane, FROM] <= way * s <= rails.lanes[lane, TO]:
            row = find_row(rails.lanes, rails.rows, lane, s)
            offset = d - _middle(rails.rows[row], s)[0]
            if abs(offset) < nearest:
                nearest = abs(offset)
                marks[n.LANE], vehicle[OFFSET] = lane, offset
    marks[n.TARGET], marks[LANES] = marks[n.LANE], 1 << marks[n.LANE]
    vehicle[n.S] = s
    vehicle[HALF] = 0.5 * vehicle[n.LENGTH]
    vehicle[BEGUN] = way * s
    vehicle[EXTENT] = (
        max(_least_way(vehicle), CHANGE_TIME * vehicle[n.SPEED]) if vehicle[OFFSET] else 0.0
    )
    if nearest < math.inf:
        marks[ROW] = find_row(rails.lanes, rails.rows, marks[n.LANE], s)
        _place(rails, who)
    return nearest < math.inf


@inlined
def _place(rails: Rails, who: int) -> None:
    """Write where a driver's vehicle is, from its s and its lanes."""
    vehicle, marks = rails.vehicles[who], rails.marks[who]
    lane = rails.lanes[marks[n.TARGET]]
    way, s, first = lane[WAY], vehicle[n.S], int(lane[FIRST])
    _find_on_line(rails, who)
    row = marks[ROW] = _walk(rails.rows, marks[ROW], first, first + int(lane[COUNT]) - 1, s)
    d, slope = _middle(rails.rows[row], s)
    if vehicle[EXTENT] > 0.0:
        share = (way * s - vehicle[BEGUN]) / vehicle[EXTENT]
        if share < 1.0:
            rest = 1.0 - share
            square = share * share
            d += vehicle[OFFSET] * (1.0 - square * share * (10.0 - 15.0 * share + 6.0 * square))
            steep = 30.0 * square * rest * rest / vehicle[EXTENT]
            slope -= way * vehicle[OFFSET] * steep
        else:
            vehicle[EXTENT] = 0.0
            marks[n.LANE], marks[LANES] = marks[n.TARGET], 1 << marks[n.TARGET]
    vehicle[D] = d
    piece, curvature = rails.line[marks[PIECE]], vehicle[CURVATURE]
    way_on = s - piece[BEGIN]
    end_sine, end_cosine = half_sine, half_cosine = piece[LINE_SINUS], piece[LINE_COSINE]
    chord = way_on
    if curvature != 0.0:
        # The chord of an arc points half-way between the headings of its ends.
        sine, cosine = sin_cos(0.5 * curvature * way_on)
        chord = 2.0 * sine / curvature
        half_sine = piece[LINE_SINUS] * cosine + piece[LINE_COSINE] * sine
        half_cosine = piece[LINE_COSINE] * cosine - piece[LINE_SINUS] * sine
        end_sine = half_sine * cosine + half_cosine * sine
        end_cosine = half_cosine * cosine - half_sine * sine
    vehicle[n.X] = piece[LINE_X] + chord * half_cosine - d * end_sine
    vehicle[n.Y] = piece[LINE_Y] + chord * half_sine + d * end_cosine
    heading = vehicle[TURN] if way > 0.0 else vehicle[TURN] + math.pi
    vehicle[n.COSINE] = 1.0
    scale = 1.0 - curvature * d
    if slope != 0.0:
        vehicle[n.COSINE] = scale / math.sqrt(scale * scale + slope * slope)
        heading += atan2(slope, scale)
    vehicle[n.HEADING] = wrap_to_pi(heading)
    vehicle[ALONG] = way * vehicle[n.SPEED] * vehicle[n.COSINE]


@inlined
def write_place(rails: Rails, who: int, place: Floats) -> None:
    """Write the place of a driver, see ``signals.PLACE_COLUMNS``.

    NaN as s stands for one before the beginning of the line, where the road goes on backwards as it
    begins and these rails as a straight; as lane for one who is in no lane of the ego's way, or not
    in the one that it changes to. Both are to be searched.
    """
    vehicle, row = rails.vehicles[who], rails.rows[rails.marks[who, ROW]]
    s, d = vehicle[n.S], vehicle[D]
    place[0] = s if rails.marks[who, PIECE] > 0 else math.nan
    place[1], place[2] = d, wrap_to_pi(vehicle[TURN])
    place[3] = vehicle[CURVATURE]
    beyond = s - row[BEGIN]
    # As `strips.lane_and_center` has them, to the bit.
    right, left = row[RIGHT] + row[RIGHT_SLOPE] * beyond, row[LEFT] + row[LEFT_SLOPE] * beyond
    is_in = row[BEGIN] <= s < row[END] and right <= d < left and row[NUMBER] >= 0.0
    place[4], place[5] = row[NUMBER] if is_in else math.nan, d - 0.5 * (right + left)


# --- Who drives ahead of whom, and what drivers make of it ----------------------------------------


@inlined
def _sort(vehicles: Floats, marks: Ints) -> None:
    """Order everything along the line, those at one place by their keys; mostly it is already."""
    for k in range(marks.shape[0]):
        who, at = marks[k, n.ORDER], k
        s, key = vehicles[who, n.S], marks[who, KEY]
        while at > 0:
            other = marks[at - 1, n.ORDER]
            if vehicles[other, n.S] < s or (vehicles[other, n.S] == s and marks[other, KEY] < key):
                break
            marks[at, n.ORDER], marks[other, n.RANK] = other, at
            at -= 1
        marks[at, n.ORDER], marks[who, n.RANK] = who, at


@inlined
def _find(marks: Ints, who: int, lane: int, side: int) -> int:
    """Return the next in a lane from somebody, to larger (1) or smaller s (-1); -1 for none."""
    at, bit = marks[who, n.RANK] + side, 1 << lane
    while 0 <= at < marks.shape[0]:
        other = int(marks[at, n.ORDER])
        if marks[other, LANES] & bit:
            return other
        at += side
    return -1


@inlined
def _gap(vehicles: Floats, rear: int, front: int, way: float) -> float:
    """Return the gap between bumpers [m] along the place of the one behind beside the line."""
    along = vehicles[front, n.S] - vehicles[rear, n.S]
    along -= vehicles[rear, D] * (vehicles[front, TURN] - vehicles[rear, TURN])
    return way * along - vehicles[rear, HALF] - vehicles[front, HALF]


@inlined
def _interaction(vehicles: Floats, who: int, gap: float, front_speed: float) -> float:
    """Return what IDM takes off for something ahead [m/s²]."""
    vehicle = vehicles[who]
    speed = vehicle[n.SPEED]
    wanted = speed * (vehicle[n.TIME_GAP] + (speed - front_speed) / vehicle[n.BRAKING])
    share = (vehicle[n.JAM_DISTANCE] - vehicle[n.LENGTH] + max(0.0, wanted)) / max(gap, 0.01)
    return vehicle[n.GAIN] * (share * share)


@inlined
def _free(rails: Rails, who: int) -> float:
    """Return IDM's acceleration on an empty lane [m/s²]."""
    vehicle = rails.vehicles[who]
    desired = vehicle[n.DESIRED_SPEED]
    if rails.marks[who, n.ROLE] >= n.FOLLOWING:
        way = rails.lanes[rails.marks[who, n.TARGET], WAY]
        allowed = _allowed(rails, who, vehicle[n.S], way)
        if desired * desired > allowed:
            desired = math.sqrt(max(0.0, allowed))
    ratio = vehicle[n.SPEED] / max(desired, 0.01)
    square = ratio * ratio
    raised = square * square if vehicle[n.EXPONENT] == 4.0 else power(ratio, vehicle[n.EXPONENT])
    return vehicle[n.GAIN] * (1.0 - raised)


@inlined
def _taken(rails: Rails, who: int, lane: int) -> float:
    """Return what the lane ahead takes off [m/s²]: who is in it, and its end."""
    way = rails.lanes[lane, WAY]
    front = _find(rails.marks, who, lane, int(way))
    taken = 0.0
    if front >= 0:
        gap = _gap(rails.vehicles, who, front, way)
        taken = _interaction(rails.vehicles, who, gap, way * rails.vehicles[front, ALONG])
    end = rails.lanes[lane, TO]
    # Who has begun to leave a lane no longer stops before its end.
    if end < math.inf and (lane == rails.marks[who, n.TARGET] or lane != rails.marks[who, n.LANE]):
        vehicle = rails.vehicles[who]
        # One who stands with the jam gap can still change lanes.
        jam = vehicle[n.JAM_DISTANCE] - vehicle[n.LENGTH]
        gap = end - _least_way(vehicle) + jam - way * vehicle[n.S] - vehicle[HALF]
        taken = max(taken, _interaction(rails.vehicles, who, gap, 0.0))
    return taken


@inlined
def _left_of_lane(rails: Rails, who: int) -> float:
    """Return how much there is left of a driver's lane [m]."""
    lane = rails.lanes[rails.marks[who, n.LANE]]
    return float(lane[TO] - lane[WAY] * rails.vehicles[who, n.S])


@inlined
def _bearable(left: float) -> float:
    """Return the braking that a change may ask for [m/s²], more of it as the lane ends."""
    urgency = clip(1.0 - left / NEEDED, 0.0, 1.0)
    return drivers.IMPOSED_BRAKING + (HARD_BRAKING - drivers.IMPOSED_BRAKING) * urgency


@inlined
def _is_open(rails: Rails, who: int, lane: int) -> bool:
    """Tell whether a lane beside has begun where somebody is, and does not end soon."""
    if lane < 0:
        return False
    u = rails.lanes[lane, WAY] * rails.vehicles[who, n.S]
    half, way = rails.vehicles[who, HALF], _least_way(rails.vehicles[who])
    return rails.lanes[lane, FROM] + half <= u <= rails.lanes[lane, TO] - way - half


@inlined
def _has_room(rails: Rails, who: int, lane: int, bearable: float) -> bool:
    """Tell whether the next behind in a lane can let somebody in."""
    way = rails.lanes[lane, WAY]
    rear = _find(rails.marks, who, lane, -int(way))
    if rear < 0:
        return True
    gap = _gap(rails.vehicles, rear, who, way)
    if gap <= 0.0 or rails.marks[rear, n.ROLE] == n.FIXED:
        return gap > 0.0
    taken = _interaction(rails.vehicles, rear, gap, way * rails.vehicles[who, ALONG])
    return _free(rails, rear) - taken >= -bearable


@compiled
def _choose_lane(rails: Rails, who: int) -> None:
    """Think of a change of lanes, and begin one."""
    vehicle, marks = rails.vehicles[who], rails.marks[who]
    left = _left_of_lane(rails, who)
    must = left < NEEDED
    if not must and (marks[n.ROLE] != n.CHANGING or vehicle[n.SPEED] < drivers.LEAST_SPEED):
        return
    vehicle[n.TIMER] = 0.0
    free, bearable = _free(rails, who), _bearable(left)
    here = free - _taken(rails, who, marks[n.LANE])
    chosen, best = -1, -math.inf
    for side in range(BESIDE_RIGHT, BESIDE_LEFT + 1):
        lane = int(rails.rows[marks[ROW], side])
        if not _is_open(rails, who, lane):
            continue
        is_longer = rails.lanes[lane, TO] > rails.lanes[marks[n.LANE], TO]
        there = free - _taken(rails, who, lane)
        is_wanted = is_longer
        if not must:
            # Nobody changes to a lane that it would want to leave at once.
            stays = rails.lanes[lane, TO] - rails.lanes[lane, WAY] * vehicle[n.S] >= NEEDED
            is_wanted = stays and there - here >= drivers.LEAST_GAIN
        # The cheaper half of the question first.
        if is_wanted and there >= max(best, -bearable) and _has_room(rails, who, lane, bearable):
            chosen, best = lane, there
    if chosen < 0:
        return
    marks[n.TARGET] = chosen
    marks[LANES] |= 1 << chosen
    marks[ROW] = find_row(rails.lanes, rails.rows, chosen, vehicle[n.S])
    vehicle[OFFSET] = vehicle[D] - _middle(rails.rows[marks[ROW]], vehicle[n.S])[0]
    vehicle[BEGUN] = rails.lanes[chosen, WAY] * vehicle[n.S]
    vehicle[EXTENT] = max(_least_way(vehicle), min(CHANGE_TIME * vehicle[n.SPEED], left))


@inlined
def _accelerate(rails: Rails, who: int, step: float) -> None:
    """Choose an acceleration: IDM in all lanes that one is in, within what is allowed ahead."""
    vehicle, marks = rails.vehicles[who], rails.marks[who]
    way = rails.lanes[marks[n.TARGET], WAY]
    taken = _taken(rails, who, marks[n.LANE])
    if marks[n.TARGET] != marks[n.LANE]:
        taken = max(taken, _taken(rails, who, marks[n.TARGET]))
    acceleration = _free(rails, who) - taken
    s = vehicle[n.S] + way * vehicle[n.SPEED] * step
    allowed = _allowed(rails, who, s, way)
    speed = max(0.0, vehicle[n.SPEED] + acceleration * step)
    if speed * speed > allowed:
        slower = (math.sqrt(max(0.0, allowed)) - vehicle[n.SPEED]) / step
        acceleration = min(acceleration, max(slower, -HARD_BRAKING))
    most = drivers.MAX_ACCELERATION
    vehicle[n.ACCELERATION] = clip(acceleration, -most, most)


@compiled
def _make_room(rails: Rails, who: int) -> None:
    """Let one whose lane ends and the next behind in the lane beside fit themselves together.

    Who is too near to let it in drives on, so that nobody waits for each other.
    """
    vehicles, own = rails.vehicles, rails.lanes[rails.marks[who, n.LANE], TO]
    for side in range(BESIDE_RIGHT, BESIDE_LEFT + 1):
        lane = int(rails.rows[rails.marks[who, ROW], side])
        if not _is_open(rails, who, lane) or rails.lanes[lane, TO] <= own:
            continue
        way = rails.lanes[lane, WAY]
        for behind in range(2):
            other = _find(rails.marks, who, lane, -int(way) if behind else int(way))
            rear, front = (other, who) if behind else (who, other)
            if other < 0 or rails.marks[rear, n.ROLE] < n.FOLLOWING:
                continue
            gap = _gap(vehicles, rear, front, way)
            jam = vehicles[rear, n.JAM_DISTANCE] - vehicles[rear, n.LENGTH]
            if gap > 0.7 * jam:
                eased = _free(rails, rear)
                eased -= _interaction(vehicles, rear, gap, way * vehicles[front, ALONG])
                least = max(eased, -EASY_BRAKING)
                vehicles[rear, n.ACCELERATION] = min(vehicles[rear, n.ACCELERATION], least)


@inlined
def _move(rails: Rails, who: int, step: float) -> None:
    """Drive a tick."""
    vehicle = rails.vehicles[who]
    speed, acceleration = vehicle[n.SPEED], vehicle[n.ACCELERATION]
    then = speed + acceleration * step
    driven = 0.5 * (speed + then) * step
    if then <= 0.0:
        driven = 0.5 * speed * speed / -acceleration if speed > 0.0 else 0.0
        then, vehicle[n.ACCELERATION] = 0.0, -speed / step
    vehicle[n.SPEED] = then
    vehicle[n.TIMER] += step
    way = rails.lanes[rails.marks[who, n.TARGET], WAY]
    scale = 1.0 - vehicle[CURVATURE] * vehicle[D]
    vehicle[n.S] += way * driven * vehicle[n.COSINE] / max(scale, 0.1)
    _place(rails, who)


@compiled
def advance_rails(rails: Rails, step: float) -> None:
    """Advance the vehicles of one run that drivers steer by one tick.

    Args:
        rails: In and out; what others move as it is now.
        step: [s].
    """
    vehicles, marks = rails.vehicles, rails.marks
    _sort(vehicles, marks)
    for k in range(marks.shape[0]):
        who = marks[k, BY_KEY]
        if (
            marks[who, n.ROLE] >= n.FOLLOWING
            and vehicles[who, n.TIMER] > drivers.CHANGE_PERIOD
            and vehicles[who, EXTENT] == 0.0
        ):
            _choose_lane(rails, who)
    for who in range(marks.shape[0]):
        if marks[who, n.ROLE] >= n.FOLLOWING:
            _accelerate(rails, who, step)
    for who in range(marks.shape[0]):
        if (
            marks[who, n.ROLE] >= n.FOLLOWING
            and marks[who, n.LANE] == marks[who, n.TARGET]
            and _left_of_lane(rails, who) < NEEDED
        ):
            _make_room(rails, who)
    for who in range(marks.shape[0]):
        if marks[who, n.ROLE] >= n.FOLLOWING:
            _move(rails, who, step)
