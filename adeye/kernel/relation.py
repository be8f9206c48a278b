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
