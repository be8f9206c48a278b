"""The clock of a run: a tick is its decimal, as people write it."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

TIME_SLACK: Final = 1e-9
"""Times that are closer are one time [s]: their differences and sums are rounded, far below a
step."""
_EXACT: Final = 2**53
"""Whole numbers up to here are floats."""


@lru_cache(maxsize=256)
def _ratio(step: float) -> tuple[int, int]:
    """Give the shortest decimal of a step as a fraction."""
    return Fraction(repr(float(step))).as_integer_ratio()


def tick_time(tick: int, step: float) -> float:
    """Give the time of a tick: the float nearest to the product of tick and step as decimals.

    Args:
        tick: Its number.
        step: Master clock [s], as its shortest decimal.

    >>> tick_time(6, 0.05), 6 * 0.05
    (0.3, 0.30000000000000004)
    """
    top, bottom = _ratio(step)
    # The quotient of two whole numbers is rounded once, however many digits they have.
    return int(tick) * top / bottom


def tick_times(ticks: NDArray[Any], step: float) -> NDArray[np.float64]:
    """Give the times [s] of many ticks, as ``tick_time``.

    Args:
        ticks: Whole numbers, of any shape.
        step: Master clock [s].
    """
    whole = np.asarray(ticks, dtype=np.int64)
    top, bottom = _ratio(step)
    most = int(np.abs(whole).max(initial=0))
    if bottom <= _EXACT and most * top <= _EXACT:
        return np.asarray((whole * top) / bottom, dtype=np.float64)
    times = [tick_time(tick, step) for tick in whole.ravel().tolist()]
    return np.array(times, dtype=np.float64).reshape(whole.shape)
