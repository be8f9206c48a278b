"""One comparison for whatever people write as decimals: what lies on a limit counts as on it.

20 km/h + 45 km/h is 65 km/h, also where the binary numbers differ in their last bits.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.jit import compiled

# --- One comparison for whatever people write as decimals: what lies on a limit counts as on it ---

SLACK: Final = 1e-9
"""Numbers are equal that differ by less than this part of the largest that they are made of."""
MOST_SLACK: Final = 1e-6
"""A number is no whole one that is farther from it, however large it is."""
AT_LEAST: Final = 12
"""Code of ``>=``."""


@compiled
def compares(op: int, left: float, right: float, size: float) -> bool:
    """Compare two numbers by the code of an operator of ``kernel.postfix``.

    Args:
        op: 7 to 12: ``==``, ``!=``, ``<``, ``<=``, ``>``, ``>=``.
        left: One number; whatever is compared with NaN, it is false.
        right: The other.
        size: Size of what they are made of: a difference of large numbers is rounded like these.
    """
    if math.isnan(left) or math.isnan(right):
        return False
    is_same = left == right or (abs(left - right) <= SLACK * size and size < math.inf)
    if op in (7, 10, 12) and is_same:
        return True
    if op == 7 or (op != 8 and is_same):
        return False
    if op == 8:
        return not is_same
    return left < right if op <= 10 else left > right


@compiled
def settled(op: int, value: float, size: float) -> float:
    """Put an operand on the number at which an operation jumps, if only the slack parts them.

    1 / (0.1 + 0.2 - 0.3) divides by zero, and floor(0.3 / 0.1) is 3.

    Args:
        op: Code of the operation: whole numbers for ``floor`` and ``ceil``, 0 for a divisor, the
            base of a power, ``sqrt`` and ``log``; of others, the value stays.
        value: Any number.
        size: Size of what it is made of.
    """
    near, slack = 0.0, SLACK * size
    if op in (21, 22):
        near, slack = float(np.rint(value)), min(slack, MOST_SLACK)
    elif op not in (5, 6, 20, 26):
        return value
    return near if value != near and abs(value - near) <= slack and size < math.inf else value


def settled_numbers(values: Any, size: Any, *, is_whole: bool) -> NDArray[np.float64]:
    """Put numbers on what only the slack parts them from, elementwise, as ``settled``.

    Args:
        values: Numbers or an array.
        size: Size of what they are made of.
        is_whole: Whether the operation jumps at whole numbers, else at 0.
    """
    values, size = np.asarray(values, dtype=np.float64), np.asarray(size)
    near = np.rint(values) if is_whole else np.zeros_like(values)
    slack = np.minimum(SLACK * size, MOST_SLACK if is_whole else np.inf)
    is_near = (values != near) & (np.abs(values - near) <= slack) & (size < np.inf)
    return np.asarray(np.where(is_near, near, values))


def differences(left: Any, right: Any, size: Any = None) -> NDArray[np.float64]:
    """Subtract numbers, elementwise; what differs by the slack only, differs by 0.

    Args:
        left: Numbers or arrays.
        right: The same.
        size: Size of what they are made of; by default of the larger one.
    """
    with np.errstate(invalid="ignore"):
        left, right = np.asarray(left, dtype=np.float64), np.asarray(right, dtype=np.float64)
        size = np.maximum(np.abs(left), np.abs(right)) if size is None else np.asarray(size)
        difference = left - right
        is_same = (np.abs(difference) <= SLACK * size) & (size < np.inf)
        # Infinities of one sign are equal, although their difference is no number.
        return np.asarray(np.where(is_same | (left == right), 0.0, difference))


# --- The clock of a run: a tick is its decimal, as people write it --------------------------------

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
