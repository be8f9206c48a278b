"""Elementary functions without a jump, so that loops over many numbers are vectorised."""

from __future__ import annotations

import math

import numpy as np

from adeye.kernel.elementary import (
    LARGEST_ANGLE,
    QUARTERS_PER_RADIAN,
    log_of_parts,
    sin_cos_of_rest,
)
from adeye.kernel.jit import inlined

__all__ = ["log_of_fraction", "sin_cos_of_any", "sin_cos_of_turn"]

_MANTISSA = 0xFFFFFFFFFFFFF
_HALF_BITS = 0x3FE0000000000000
_ROOT_HALF = 0.70710678118654752440


@inlined
def log_of_fraction(x: float) -> float:
    """Return ``elementary.log`` of a number in (0, 1), bit for bit."""
    bits = np.float64(x).view(np.int64)
    mantissa = np.int64((bits & _MANTISSA) | _HALF_BITS).view(np.float64)
    is_low = mantissa < _ROOT_HALF
    power = (bits >> 52) - (1023 if is_low else 1022)
    return log_of_parts(2.0 * mantissa if is_low else mantissa, float(power))


@inlined
def sin_cos_of_turn(angle: float) -> tuple[float, float]:
    """Return ``elementary.sin_cos`` of an angle in (0, 2 pi), bit for bit."""
    turns = int(angle * QUARTERS_PER_RADIAN + 0.5)
    s, c = sin_cos_of_rest(angle, float(turns))
    is_odd = turns & 1 != 0
    # Negative in quadrants 2 and 3, and in 1 and 2.
    sine = (1.0 - float(turns & 2)) * (c if is_odd else s)
    return sine, (1.0 - float((turns + 1) & 2)) * (s if is_odd else c)


@inlined
def sin_cos_of_any(angle: float) -> tuple[float, float]:
    """Return ``elementary.sin_cos`` of an angle [rad], bit for bit."""
    is_known = abs(angle) <= LARGEST_ANGLE
    turned = angle if is_known else 0.0
    turns = np.floor(turned * QUARTERS_PER_RADIAN + 0.5)
    s, c = sin_cos_of_rest(turned, turns)
    quadrant = turns - 4.0 * np.floor(0.25 * turns)
    is_odd = (quadrant == 1.0) | (quadrant == 3.0)
    sine, cosine = (c if is_odd else s), (s if is_odd else c)
    sine = -sine if quadrant >= 2.0 else sine
    cosine = -cosine if (quadrant == 1.0) | (quadrant == 2.0) else cosine
    sine = angle if angle == 0.0 else sine
    return (sine if is_known else math.nan), (cosine if is_known else math.nan)
