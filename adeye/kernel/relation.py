"""One comparison for whatever people write as decimals: what lies on a limit counts as on it.

20 km/h + 45 km/h is 65 km/h, also where the binary numbers differ in their last bits.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

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
