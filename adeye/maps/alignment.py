"""Curves of a road: points, headings and curvatures along its pieces, and along a line beside them.

A road's reference line is an array (G, 15), one row per piece, in order of where it begins; columns
below. A line beside it is at ``d`` to its left, where d is a cubic of the place in each of the
rows ``(s, a, b, c, d)`` of an array (M, 5): ``a + b t + c t² + d t³`` at ``t = place - s`` from s
to the next row's, and zero before the first.

Source:
    ASAM OpenDRIVE 1.8, chapter 8. Spirals and lengths of arc by Gauss and Legendre's formula.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import STRAIGHTEST

Floats = NDArray[np.float64]

#: Columns of a piece: place on the road, point and heading of its start, length, kind, eight
#: parameters as in the file, and the largest parameter of a polynomial (of a poly3: the length).
START, START_X, START_Y, START_HEADING, LENGTH, KIND, FIRST, RANGE = 0, 1, 2, 3, 4, 5, 6, 14
PIECE_WIDTH = 15
#: Kinds of pieces.
LINE, ARC, SPIRAL, POLY3, PARAM_POLY3 = 0, 1, 2, 3, 4

#: Columns of a place on a line: point [m], heading in (-pi, pi] [rad], curvature [1/m], and how far
#: one goes on the line for each metre of the reference line.
X, Y, HEADING, CURVATURE, RATE = 0, 1, 2, 3, 4
PLACE_WIDTH = 5

#: Sides of a place.
BEHIND, BEFORE = 0, 1

#: Panels into which the length of a polynomial is divided, and what ``place_beside`` keeps of them.
PANELS = 32
SCRATCH = PANELS + 2

_NODES = np.array(
    [0.1834346424956498049, 0.5255324099163289858, 0.7966664774136267396, 0.9602898564975362317]
)
_WEIGHTS = np.array(
    [0.3626837833783619830, 0.3137066458778872873, 0.2223810344533744705, 0.1012285362903762592]
)
_NEWTON_STEPS = 30
# Of the range: the error after a step is about its square.
_NEWTON_TOLERANCE = 1e-8

Place = tuple[float, float, float, float, float, float]
"""x, y [m], heading [rad], curvature [1/m], its change per metre [1/m²], and metres for each metre
of the length in the file."""


# --- Functions of the place -----------------------------------------------------------------------


@inlined
def row_at(rows: Floats, place: float, side: int) -> int:
    """Return the row that holds at a place: the last that begins there or earlier; -1 if none.

    Args:
        rows: (N, ...), the first column ascends.
        place: Where.
        side: Of the place: whether, where a row begins, it holds already (``BEHIND``).
    """
    low, high = 0, rows.shape[0]
    while low < high:
        middle = (low + high) // 2
        start = rows[middle, 0]
        if start < place or (start == place and side == BEHIND):
            low = middle + 1
        else:
            high = middle
    return low - 1


@inlined
def next_row(rows: Floats, place: float) -> float:
    """Return where the next row begins behind a place; infinite behind the last."""
    n = row_at(rows, place, BEHIND) + 1
    return rows[n, 0] if n < rows.shape[0] else math.inf


@inlined
def cubic_at(cubics: Floats, place: float, side: int) -> tuple[float, float, float]:
    """Return a function of the place, its slope and the slope's slope; zeros before its first row.

    Args:
        cubics: (M, 5), see the module.
        place: Where.
        side: Of the place, as in ``row_at``.
    """
    m = row_at(cubics, place, side)
    if m < 0:
        return 0.0, 0.0, 0.0
    t = place - cubics[m, 0]
    a, b, c, d = cubics[m, 1], cubics[m, 2], cubics[m, 3], cubics[m, 4]
    return a + t * (b + t * (c + t * d)), b + t * (2.0 * c + t * 3.0 * d), 2.0 * c + 6.0 * d * t


@compiled
def fill_cubics(cubics: Floats, places: Floats, values: Floats) -> None:
    """Write a function of the place (N, 2): its value and its slope.

    Args:
        cubics: (M, 5), see the module.
        places: (N,).
        values: (N, 2), filled.
    """
    for i in range(places.shape[0]):
        values[i, 0], values[i, 1], _ = cubic_at(cubics, places[i], BEHIND)


@compiled
def add_cubics(cubics: Floats, shift: float, factor: float, sums: Floats) -> None:
    """Add a multiple of a function to another one, whose rows begin wherever this one's do.

    Args:
        cubics: (M, 5), see the module.
        shift: Added to the places of ``cubics``.
        factor: By which it is multiplied.
        sums: (N, 5), changed. Only what lies behind the first row's place is asked of ``cubics``.
    """
    for i in range(sums.shape[0]):
        m = row_at(cubics, sums[i, 0] - shift, BEHIND)
        if m < 0:
            continue
        t = sums[i, 0] - shift - cubics[m, 0]
        a, b, c, d = cubics[m, 1], cubics[m, 2], cubics[m, 3], cubics[m, 4]
        sums[i, 1] += factor * (a + t * (b + t * (c + t * d)))
        sums[i, 2] += factor * (b + t * (2.0 * c + t * 3.0 * d))
        sums[i, 3] += factor * (c + t * 3.0 * d)
        sums[i, 4] += factor * d


# --- Pieces ---------------------------------------------------------------------------------------


@compiled
def spiral_end(curvature: float, slope: float, length: float) -> tuple[float, float]:
    """Return where a spiral that begins at the origin along x ends [m].

    Args:
        curvature: At its start [1/m].
        slope: Change of the curvature [1/m²].
        length: Along it [m].
    """
    sharpest = max(abs(curvature), abs(curvature + slope * length))
    # At most a radian each, which eight nodes meet to the last bits.
    panels = int(min(sharpest * abs(length), 1e5)) + 1
    half = 0.5 * length / panels
    x = y = 0.0
    for panel in range(panels):
        middle = (2 * panel + 1) * half
        for node in range(4):
            for side in range(2):
                t = middle + half * _NODES[node] * (2 * side - 1)
                sine, cosine = sin_cos((curvature + 0.5 * slope * t) * t)
                x += half * _WEIGHTS[node] * cosine
                y += half * _WEIGHTS[node] * sine
    return x, y


@inlined
def _bend(piece: Floats, t: float) -> Place:
    """Return the place on a line, arc or spiral from its start along x."""
    curvature = piece[FIRST] if piece[KIND] != LINE else 0.0
    if piece[KIND] == SPIRAL and piece[FIRST] != piece[FIRST + 1] and piece[LENGTH] > 0.0:
        slope = (piece[FIRST + 1] - curvature) / piece[LENGTH]
        x, y = spiral_end(curvature, slope, t)
        return x, y, (curvature + 0.5 * slope * t) * t, curvature + slope * t, slope, 1.0
    half_turn = 0.5 * curvature * t
    sine, cosine = sin_cos(half_turn)
    # The chord of an arc points half-way between the headings of its ends.
    chord = 2.0 * sine / curvature if abs(curvature) > STRAIGHTEST else t
    return chord * cosine, chord * sine, 2.0 * half_turn, curvature, 0.0, 1.0


@inlined
def _velocity(piece: Floats, p: float) -> tuple[float, float]:
    """Return the change of a polynomial's point with its parameter."""
    if piece[KIND] == POLY3:
        return 1.0, piece[FIRST + 1] + p * (2.0 * piece[FIRST + 2] + p * 3.0 * piece[FIRST + 3])
    return (
        piece[FIRST + 1] + p * (2.0 * piece[FIRST + 2] + p * 3.0 * piece[FIRST + 3]),
        piece[FIRST + 5] + p * (2.0 * piece[FIRST + 6] + p * 3.0 * piece[FIRST + 7]),
    )


@compiled
def _length_of(piece: Floats, start: float, end: float) -> float:
    """Return the length of a polynomial between two parameters [m]."""
    half, middle = 0.5 * (end - start), 0.5 * (start + end)
    length = 0.0
    for node in range(4):
        for side in range(2):
            u, v = _velocity(piece, middle + half * _NODES[node] * (2 * side - 1))
            length += half * _WEIGHTS[node] * math.sqrt(u * u + v * v)
    return length


@compiled
def _parameter(piece: Floats, t: float, scratch: Floats, number: int) -> float:
    """Return the parameter of a polynomial at a length of arc.

    The whole of a paramPoly3 is as long as the file says: who rounded its length has still named
    its end. Of a poly3 the file says no end but by the length.
    """
    span = float(piece[RANGE])
    if scratch[PANELS + 1] != number:
        scratch[0] = 0.0
        for panel in range(PANELS):
            ends = span * panel / PANELS, span * (panel + 1) / PANELS
            scratch[panel + 1] = scratch[panel] + _length_of(piece, ends[0], ends[1])
        scratch[PANELS + 1] = number
    if not scratch[PANELS] > 0.0:
        return span * t / float(piece[LENGTH])
    target = t
    if piece[KIND] == PARAM_POLY3:
        target *= scratch[PANELS] / piece[LENGTH]
    panel = 0
    while panel < PANELS - 1 and scratch[panel + 1] <= target:
        panel += 1
    begin = span * panel / PANELS
    share = (target - scratch[panel]) / (scratch[panel + 1] - scratch[panel])
    p = begin + share * span / PANELS
    for _ in range(_NEWTON_STEPS):
        u, v = _velocity(piece, p)
        speed = math.sqrt(u * u + v * v)
        if not speed > 0.0:
            break
        step = (target - scratch[panel] - _length_of(piece, begin, p)) / speed
        p += step
        if abs(step) <= _NEWTON_TOLERANCE * span:
            break
    return float(p)


@inlined
def _polynomial(piece: Floats, t: float, scratch: Floats, number: int) -> Place:
    """Return the place on a polynomial in the frame of its start."""
    p = _parameter(piece, t, scratch, number)
    u1, v1 = _velocity(piece, p)
    if piece[KIND] == POLY3:
        u, v = (
            p,
            piece[FIRST] + p * (piece[FIRST + 1] + p * (piece[FIRST + 2] + p * piece[FIRST + 3])),
        )
        u2, u3 = 0.0, 0.0
        v2, v3 = 2.0 * piece[FIRST + 2] + 6.0 * piece[FIRST + 3] * p, 6.0 * piece[FIRST + 3]
    else:
        u = piece[FIRST] + p * (piece[FIRST + 1] + p * (piece[FIRST + 2] + p * piece[FIRST + 3]))
        v = piece[FIRST + 4] + p * (
            piece[FIRST + 5] + p * (piece[FIRST + 6] + p * piece[FIRST + 7])
        )
        u2, u3 = 2.0 * piece[FIRST + 2] + 6.0 * piece[FIRST + 3] * p, 6.0 * piece[FIRST + 3]
        v2, v3 = 2.0 * piece[FIRST + 6] + 6.0 * piece[FIRST + 7] * p, 6.0 * piece[FIRST + 7]
    square = u1 * u1 + v1 * v1
    if not square > 0.0:
        return u, v, 0.0, 0.0, 0.0, 0.0
    speed = math.sqrt(square)
    cross = u1 * v2 - v1 * u2
    curvature = cross / (square * speed)
    change = (u1 * v3 - v1 * u3 - 3.0 * cross * (u1 * u2 + v1 * v2) / square) / (square * square)
    stretch = scratch[PANELS] / piece[LENGTH] if piece[KIND] == PARAM_POLY3 else 1.0
    return u, v, atan2(v1, u1), curvature, change, stretch


@inlined
def _on_reference(pieces: Floats, s: float, side: int, scratch: Floats) -> Place:
    """Return the place on the reference line; past its ends the pieces there go on."""
    number = max(row_at(pieces, s, side), 0)
    piece = pieces[number]
    t = s - piece[START]
    if piece[KIND] < POLY3:
        x, y, turn, curvature, slope, stretch = _bend(piece, t)
    else:
        x, y, turn, curvature, slope, stretch = _polynomial(piece, t, scratch, number)
    sine, cosine = sin_cos(piece[START_HEADING])
    return (
        piece[START_X] + x * cosine - y * sine,
        piece[START_Y] + x * sine + y * cosine,
        piece[START_HEADING] + turn,
        curvature,
        slope,
        stretch,
    )


# --- Lines ----------------------------------------------------------------------------------------


@compiled
def place_beside(
    pieces: Floats,
    cubics: Floats,
    s: float,
    side: int,
    scratch: Floats,
) -> tuple[float, float, float, float, float]:
    """Return the place on a line beside the reference line.

    With the unit vectors t along and n to the left of the reference line of curvature k, the line
    ``r + d n`` has the velocity ``(1 - k d) t + d' n``, and its curvature follows from that.

    Args:
        pieces: (G, 15), G >= 1, see the module.
        cubics: (M, 5), see the module: d.
        s: On the road [m].
        side: Of the place, as in ``row_at``.
        scratch: (``SCRATCH``,), for one array of pieces only; -1 at its end says that it is new.

    Returns:
        The columns of a place.
    """
    x, y, heading, curvature, slope, stretch = _on_reference(pieces, s, side, scratch)
    d, d1, d2 = cubic_at(cubics, s, side)
    sine, cosine = sin_cos(heading)
    turning = stretch * curvature
    along = stretch - turning * d
    square = along * along + d1 * d1
    rate = math.sqrt(square)
    bend = 0.0
    if square > 0.0:
        change = stretch * stretch * slope * d + 2.0 * turning * d1
        bend = (along * (turning * along + d2) + d1 * change) / (square * rate)
    return (
        x - d * sine,
        y + d * cosine,
        wrap_to_pi(heading + atan2(d1, along)),
        bend,
        rate,
    )


@compiled
def fill_line(
    pieces: Floats, cubics: Floats, places: Floats, scratch: Floats, line: Floats
) -> None:
    """Write the places on a line beside the reference line.

    Args:
        pieces: (G, 15), see the module.
        cubics: (M, 5), see the module.
        places: (N,) on the road [m].
        scratch: As for ``place_beside``.
        line: (N, 5), filled.
    """
    for i in range(places.shape[0]):
        place = place_beside(pieces, cubics, places[i], BEHIND, scratch)
        for column in range(PLACE_WIDTH):
            line[i, column] = place[column]
