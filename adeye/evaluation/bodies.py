"""Compiled: bodies on the road, their extents and whether one is in the ego's path.

An object ahead of the ego is *in the path* if

- its lateral extent on the road overlaps the ego's corridor: d of the ego's centre plus and minus
  half of the ego's width; or
- it is crossing (it moves faster across the road than along it), there is a gap, and at constant
  velocities its lateral extent overlaps the corridor at some time while the bodies are side by side
  along the road.

Extents are those of the turned bodies on the road's direction.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined

if TYPE_CHECKING:
    from adeye.signals import Floats

Body = tuple[float, float, float, float, float, float]
"""A body's motion on the road."""

S, D, ALONG, ACROSS, HALF_LENGTH, HALF_WIDTH = range(6)
"""Places of a ``Body``: of its centre [m], speeds [m/s] and half extents [m]."""


@compiled
def reach_of(length: float, width: float) -> float:
    """Half of the diagonal of a body [m], a little more than that."""
    return 0.5000001 * math.sqrt(length * length + width * width) + 1e-6


@inlined
def are_finite(  # noqa: PLR0913, PLR0917 - what a body has
    a: float,
    b: float,
    c: float,
    d: float,
    e: float,
    f: float,
    g: float,
    h: float,
    i: float,
    j: float,
) -> bool:
    """Tell whether ten numbers are finite: zero times anything else is no number."""
    return 0.0 * a + 0.0 * b + 0.0 * c + 0.0 * d + 0.0 * e == -(
        0.0 * f + 0.0 * g + 0.0 * h + 0.0 * i + 0.0 * j
    )


@inlined
def turn(turns: Floats, place: int, angle: float) -> None:
    """Keep sine and cosine of an angle to the road, which often is that of the row before."""
    if angle != turns[place, 0]:
        turns[place, 0] = angle
        turns[place, 1], turns[place, 2] = sin_cos(angle)


@inlined
def on_road(  # noqa: PLR0913, PLR0917 - a kernel
    s: float, d: float, speed: float, length: float, width: float, sine: float, cosine: float
) -> Body:
    """Give a body on the road: s, d, speed along and across, half extent along and across."""
    return (
        s,
        d,
        speed * cosine,
        speed * sine,
        0.5 * (length * abs(cosine) + width * abs(sine)),
        0.5 * (length * abs(sine) + width * abs(cosine)),
    )


@inlined
def is_in_path(own: Body, corridor: float, other: Body, gap: float) -> bool:
    """Tell whether an object ahead is in the path, see the module.

    Args:
        own: (6,) ego on the road.
        corridor: Half of the ego's width [m].
        other: (6,) object on the road.
        gap: [m].
    """
    beside = other[D] - own[D]
    reach = corridor + other[HALF_WIDTH]
    if abs(beside) < reach:
        return True
    across = other[ACROSS]
    closing = own[ALONG] - other[ALONG]
    if gap <= 0.0 or closing <= 0.0 or abs(across) <= abs(other[ALONG]):
        return False
    first = gap / closing
    last = first + 2.0 * (own[HALF_LENGTH] + other[HALF_LENGTH]) / closing
    enter = (-math.copysign(reach, across) - beside) / across
    leave = (math.copysign(reach, across) - beside) / across
    return bool(enter <= last and leave >= first)
