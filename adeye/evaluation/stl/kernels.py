"""Compiled: the largest value in a sliding window of one run.

A run is a one-dimensional array of which the first ``length`` entries are known. What lies beyond
is one number, ``beyond``: minus infinity for a lower and plus infinity for an upper bound of
robustness. The loop is linear in the length, whatever the window.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.jit import compiled

if TYPE_CHECKING:
    from adeye.signals import Floats, Ints


@compiled
def sliding_maximum(  # noqa: PLR0913, PLR0917 - a kernel
    values: Floats, length: int, first: int, last: int, beyond: float, queue: Ints, out: Floats
) -> None:
    """Write ``max(values[k + first .. k + last])`` to ``out[k]`` for each known row k.

    Args:
        values: One run (T,).
        length: Known rows; reads past them give ``beyond``.
        first: Rows from k to the window's first row, >= 0.
        last: Rows from k to the window's last row, >= ``first``.
        beyond: Value of every unknown row.
        queue: Scratch (T,): rows of the window in which no later maximum hides them.
        out: Result (T,); ``beyond`` from ``length`` on.

    Source:
        Lemire (2006), "Streaming maximum-minimum filter using no more than three comparisons per
        element", run backwards.
    """
    for k in range(length, out.shape[0]):
        out[k] = beyond
    head = 0
    tail = 0
    for k in range(length - 1, -1, -1):
        entering = k + first
        if entering < length:
            while tail > head and values[queue[tail - 1]] <= values[entering]:
                tail -= 1
            queue[tail] = entering
            tail += 1
        while tail > head and queue[head] > k + last:
            head += 1
        best = beyond if k + last >= length else -np.inf
        if tail > head and values[queue[head]] > best:
            best = values[queue[head]]
        out[k] = best
