"""The right edge of the road: shoulder, free verge, and the parking bays and rest areas in it.

Whatever asks whether a place is on the road calls these functions: the stop library, the ratings,
the evaluation of a trace and its pictures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import allocating, compiled, inlined

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Bools = NDArray[np.bool_]

# Columns of a refuge, as `signals.REFUGE_COLUMNS`.
_KIND, _S, _LENGTH, _DEPTH, _TAPER = range(5)

PARKING_BAY, REST_AREA = 0, 1
"""Kinds of refuges, indices into ``signals.REFUGE_KINDS``."""

NO_REFUGE: Final = -1


@inlined
def depth_at(refuge: Floats, s: float) -> float:
    """Return how far a refuge reaches beyond the shoulder [m].

    Linear over the tapers, with a step where a taper has no length; 0 before and behind.

    Args:
        refuge: (5,), see ``signals.REFUGE_COLUMNS``.
        s: Along the road [m].
    """
    outside = max(refuge[_S] - s, s - refuge[_S] - refuge[_LENGTH])
    if outside <= 0.0:
        return float(refuge[_DEPTH])
    if outside >= refuge[_TAPER]:
        return 0.0
    return float(refuge[_DEPTH] * (1.0 - outside / refuge[_TAPER]))


@compiled
def refuge_depth(refuges: Floats, s: float) -> float:
    """Return how far the refuge at a place reaches beyond the shoulder [m]; 0 where none is.

    Args:
        refuges: (R, 5), see ``signals.REFUGE_COLUMNS``.
        s: Along the road [m].
    """
    depth = 0.0
    for row in range(refuges.shape[0]):
        depth = max(depth, depth_at(refuges[row], s))
    return depth


@inlined
def right_edge(refuges: Floats, s: float, shoulder: float, verge: float) -> float:
    """Return the least d that carries a vehicle [m]: of shoulder, refuge or verge.

    Args:
        refuges: (R, 5), see ``signals.REFUGE_COLUMNS``.
        s: Along the road [m].
        shoulder: Width beside the right edge of lane 0 [m].
        verge: Width of free ground beside that [m].
    """
    return -shoulder - max(refuge_depth(refuges, s), verge)


@inlined
def body_edge(
    refuges: Floats,
    s: float,
    slope: float,
    length: float,
    width: float,
    shoulder: float,
    verge: float,
) -> float:
    """Return the least d of the centre of a body whose corners all keep to the road [m].

    Two corners are enough: tapers make the road wider and narrower, never both within a body.

    Args:
        refuges: (R, 5), see ``signals.REFUGE_COLUMNS``.
        s: Of its centre along the road [m].
        slope: Tangent of its heading against the road's.
        length: Of the body [m].
        width: [m].
        shoulder: [m].
        verge: [m].
    """
    tilt, half = 0.5 * length * slope, 0.5 * width
    front = right_edge(refuges, s + 0.5 * length, shoulder, verge)
    rear = right_edge(refuges, s - 0.5 * length, shoulder, verge)
    return max((half - tilt) + front, (half + tilt) + rear)


@inlined
def is_in_refuge(
    refuge: Floats,
    s: float,
    d: float,
    slope: float,
    length: float,
    width: float,
    shoulder: float,
) -> bool:
    """Tell whether a body is wholly inside a refuge, beside the shoulder.

    A refuge is convex in road coordinates, so its corners are enough.

    Args:
        refuge: (5,), see ``signals.REFUGE_COLUMNS``.
        s: Of the centre of the body along the road [m].
        d: From the right edge to the left [m].
        slope: Tangent of its heading against the road's.
        length: Of the body [m].
        width: [m].
        shoulder: [m].
    """
    is_inside = True
    for end in (-0.5, 0.5):
        x = end * length
        for side in (-0.5, 0.5):
            y = d + slope * x + side * width + shoulder
            is_inside = is_inside and -depth_at(refuge, s + x) - 1e-9 <= y <= 1e-9
    return is_inside


@allocating
def mark_on_road(
    refuges: Floats, shoulder: Floats, verge: Floats, left: Floats, s: Floats, d: Floats
) -> Bools:
    """Tell which places (B, T) are on a lane, the shoulder, a refuge or the verge.

    Args:
        refuges: (B, R, 5), see ``signals.REFUGE_COLUMNS``.
        shoulder: (B,) [m].
        verge: (B,) [m].
        left: (B,) d of the left edge [m].
        s: (B, T) along the road [m].
        d: (B, T) from the right edge to the left [m]; what is no number is not on the road.
    """
    marks = np.zeros(d.shape, dtype=np.bool_)
    for run in range(d.shape[0]):
        for row in range(d.shape[1]):
            edge = right_edge(refuges[run], s[run, row], shoulder[run], verge[run])
            marks[run, row] = edge <= d[run, row] <= left[run]
    return marks


@allocating
def mark_in_refuge(
    refuges: Floats, shoulder: Floats, size: Floats, s: Floats, d: Floats, align: Floats
) -> Bools:
    """Tell at which places (B, T) a body is wholly inside a parking bay or rest area.

    Args:
        refuges: (B, R, 5), see ``signals.REFUGE_COLUMNS``.
        shoulder: (B,) [m].
        size: (B, 3) length and width of the body first [m].
        s: (B, T) of its centre along the road [m].
        d: (B, T) from the right edge to the left [m].
        align: (B, T) its heading against the road's [rad].
    """
    marks = np.zeros(d.shape, dtype=np.bool_)
    for run in range(d.shape[0]):
        for row in range(d.shape[1]):
            sine, cosine = sin_cos(align[run, row])
            slope = sine / cosine
            for number in range(refuges.shape[1]):
                marks[run, row] = marks[run, row] or is_in_refuge(
                    refuges[run, number],
                    s[run, row],
                    d[run, row],
                    slope,
                    size[run, 0],
                    size[run, 1],
                    shoulder[run],
                )
    return marks
