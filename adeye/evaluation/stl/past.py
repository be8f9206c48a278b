"""Compiled: operators that look back, at the rows of one run.

They are the operators that look ahead, on the rows in reverse order, with one difference: before
row 0 there is nothing, where after the last row there is something that is not known. So a window
is cut off at row 0 and opens no bound. Of an empty one, the largest value is minus infinity:
nothing was there once, and everything was there historically.

Source:
    Maler and Nickovic (2013), "Monitoring properties of analog and mixed-signal circuits" (past
    operators); Donze, Ferrere and Maler (2013), "Efficient robust monitoring for STL", lemma 2.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.stl.kernels import sliding_maximum
from adeye.evaluation.stl.program import FROM_ROW, HAS_WINDOW, HISTORICALLY, KIND, PREVIOUS, TO_ROW
from adeye.kernel.jit import allocating, compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Floats, Ints

    Bytes = NDArray[np.int8]


@compiled
def fill_previous(state: Floats, truth: Bytes, known: int, out: Floats, sign: Bytes) -> None:
    """Write the state of ``previous``: that of the row before; false at row 0."""
    for plane in range(2):
        out[plane, 0], sign[plane, 0] = -math.inf, -1
        for k in range(1, known):
            out[plane, k], sign[plane, k] = state[plane, k - 1], truth[plane, k - 1]


@compiled
def fill_once(  # noqa: PLR0913, PLR0917 - a kernel
    node: Ints,
    state: Floats,
    truth: Bytes,
    known: int,
    rows: int,
    scratch: Floats,
    queue: Ints,
    out: Floats,
    sign: Bytes,
) -> None:
    """Write the state of ``once``, or of ``historically`` as its dual, at the known rows.

    Args:
        node: Of the ``Program``.
        state: (2, T) bounds of the operand's robustness.
        truth: (2, T) bounds of its truth.
        known: Rows of the run.
        rows: Of the arrays: the reach of an operator without a window.
        scratch: (3, T).
        queue: (T,) scratch.
        out: (2, T) bounds of the robustness, out.
        sign: (2, T) bounds of the truth, out.
    """
    first, last = 0, rows
    if node[HAS_WINDOW]:
        first, last = node[FROM_ROW], node[TO_ROW]
    factor = -1.0 if node[KIND] == HISTORICALLY else 1.0
    for plane in range(4):
        half = plane % 2
        turned, found = scratch[0], scratch[1]
        for k in range(known):
            value = state[half, k] if plane < 2 else float(truth[half, k])
            turned[known - 1 - k] = factor * value
        nothing = -math.inf if plane < 2 else -1.0
        sliding_maximum(turned, known, first, last, nothing, queue, found)
        for k in range(known):
            value = factor * found[known - 1 - k]
            if plane < 2:
                out[half, k] = value
            else:
                sign[half, k] = int(value)


@compiled
def fill_since(  # noqa: PLR0913, PLR0917 - a kernel
    node: Ints,
    left: Floats,
    left_truth: Bytes,
    right: Floats,
    right_truth: Bytes,
    known: int,
    scratch: Floats,
    queue: Ints,
    out: Floats,
    sign: Bytes,
) -> None:
    """Write the state of ``since``: that of one without end, restricted to the window."""
    for plane in range(4):
        half = plane % 2
        nothing = -math.inf if plane < 2 else -1.0
        before, after, endless = scratch[0], scratch[1], scratch[2]
        earlier = nothing
        for k in range(known):
            turned = known - 1 - k
            before[turned] = -(left[half, k] if plane < 2 else float(left_truth[half, k]))
            after[turned] = right[half, k] if plane < 2 else float(right_truth[half, k])
            earlier = max(after[turned], min(-before[turned], earlier))
            endless[turned] = earlier
        if node[HAS_WINDOW]:
            restrict(before, after, endless, known, node[FROM_ROW], node[TO_ROW], nothing, queue)
        for k in range(known):
            value = endless[known - 1 - k]
            if plane < 2:
                out[half, k] = value
            else:
                sign[half, k] = int(value)


@allocating
def restrict(  # noqa: PLR0913, PLR0917 - a kernel
    before: Floats,
    after: Floats,
    endless: Floats,
    known: int,
    first: int,
    last: int,
    beyond: float,
    queue: Ints,
) -> None:
    """Restrict an ``until`` without end to a window; ``before`` comes negated.

    Args:
        before: (T,) what has to hold before, negated.
        after: (T,) what has to hold in the window.
        endless: (T,) the ``until`` without end, in and out.
        known: Rows of the run.
        first: Rows to the window's first row.
        last: Rows to the window's last row.
        beyond: Bound of every row from ``known`` on.
        queue: (T,) scratch.
    """
    found = np.empty(before.shape[0])
    sliding_maximum(after, known, first, last, beyond, queue, found)
    for k in range(known):
        endless[k] = min(found[k], endless[k + first] if k + first < known else beyond)
    if first > 0:
        # The negation of a bound is the other bound of the negation.
        sliding_maximum(before, known, 0, first - 1, -beyond, queue, found)
        for k in range(known):
            endless[k] = min(endless[k], -found[k])


@compiled
def fill_past(  # noqa: PLR0913, PLR0917 - a kernel
    node: Ints,
    state: Floats,
    truth: Bytes,
    known: int,
    rows: int,
    scratch: Floats,
    queue: Ints,
    out: Floats,
    sign: Bytes,
) -> None:
    """Write the state of an operator with one operand that looks back; see ``fill_once``."""
    if node[KIND] == PREVIOUS:
        fill_previous(state, truth, known, out, sign)
    else:
        fill_once(node, state, truth, known, rows, scratch, queue, out, sign)
