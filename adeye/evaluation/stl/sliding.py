"""Compiled: ``eventually`` and ``always`` over a window that slides along one run.

What is known of a condition at every row is its truth; where its bounds are 1 or -1 as the truth
is, a window of it is found without comparing any bound. A row at which nothing is known, like the
last one of what is decided, is as one beyond the trace.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from adeye.evaluation.stl.kernels import sliding_maximum
from adeye.evaluation.stl.measures import EXACT, OPEN, SIGN
from adeye.kernel.jit import compiled

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from adeye.signals import Floats, Ints

    Bytes = NDArray[np.int8]


@compiled
def slide(  # noqa: PLR0913, PLR0917 - a kernel
    is_always: bool,  # noqa: FBT001 - compiled
    level: int,
    state: Floats,
    truth: Bytes,
    known: int,
    first: int,
    last: int,
    scratch: Floats,
    queue: Ints,
    out: Floats,
    sign: Bytes,
) -> None:
    """Write the state of ``eventually``, or of ``always``, at the known rows.

    Args:
        is_always: Which of them.
        level: ``OPEN``, ``EXACT`` or ``SIGN``: what is known of the condition beforehand.
        state: (2, T) bounds of its robustness.
        truth: (2, T) bounds of its truth.
        known: Rows of the run.
        first: Rows to the window's first row.
        last: Rows to the window's last row.
        scratch: (3, T).
        queue: (T,) scratch.
        out: (2, T) bounds of the robustness, out.
        sign: (2, T) bounds of the truth, out.
    """
    level, reach = _known_part(level, state, truth, known)
    if level == OPEN:
        _slide_open_truth(is_always, truth, known, first, last, sign)
    else:
        _slide_truth(is_always, truth[0], known, reach, first, last, sign)
    if level == SIGN:
        _slide_signs(is_always, sign, known, reach, first, last, out)
    else:
        _slide(is_always, state, known, reach, first, last, level == EXACT, scratch, queue, out)


@compiled
def _known_part(level: int, state: Floats, truth: Bytes, known: int) -> tuple[int, int]:
    """Tell what is known of a condition, and at how many rows: an open last one is as none."""
    low, high = state[0, known - 1], state[1, known - 1]
    no, yes = truth[0, known - 1], truth[1, known - 1]
    if low == -math.inf and high == math.inf and no < yes:
        return level, known - 1
    if low != high or no != yes or (level == SIGN and low != no):
        return OPEN, known
    return level, known


@compiled
def _slide(  # noqa: PLR0913, PLR0917 - a kernel
    is_always: bool,  # noqa: FBT001 - compiled
    state: Floats,
    known: int,
    reach: int,
    first: int,
    last: int,
    is_exact: bool,  # noqa: FBT001 - compiled
    scratch: Floats,
    queue: Ints,
    out: Floats,
) -> None:
    """Write the bounds of ``eventually``, or of ``always`` as its dual, over a window.

    The lower bound of ``always`` is the negated upper bound of ``eventually not``.
    """
    for plane in range(2):
        beyond = -math.inf if plane == 0 else math.inf
        target = 1 - plane if is_always else plane
        if plane == 1 and is_exact:
            # Bounds differ only where the window reaches beyond the trace.
            near = 1 if is_always else 0
            for k in range(known):
                is_open = k + last >= reach
                out[target, k] = (-math.inf if is_always else math.inf) if is_open else out[near, k]
        else:
            source = state[plane]
            if is_always:
                source = scratch[0]
                for k in range(known):
                    source[k] = -state[target, k]
            sliding_maximum(source, reach, first, last, beyond, queue, scratch[1])
            for k in range(known):
                out[target, k] = -scratch[1, k] if is_always else scratch[1, k]


@compiled
def _slide_open_truth(
    is_always: bool,  # noqa: FBT001 - compiled
    truth: Bytes,
    known: int,
    first: int,
    last: int,
    sign: Bytes,
) -> None:
    """Write the truth of ``eventually`` or ``always`` of what may be open at some rows."""
    wanted = -1 if is_always else 1
    for plane in range(2):
        target = 1 - plane if is_always else plane
        nearest = known + last + 1
        for k in range(known - 1, -1, -1):
            entering = k + first
            if entering < known and truth[target, entering] == wanted:
                nearest = entering
            is_met = nearest <= k + last or (plane == 1 and k + last >= known)
            sign[target, k] = wanted if is_met else -wanted


@compiled
def _slide_truth(  # noqa: PLR0913, PLR0917 - a kernel
    is_always: bool,  # noqa: FBT001 - compiled
    truth: Bytes,
    known: int,
    reach: int,
    first: int,
    last: int,
    sign: Bytes,
) -> None:
    """Write the truth of ``eventually`` or ``always`` of what is known at the rows to ``reach``."""
    wanted = -1 if is_always else 1
    near = 1 if is_always else 0
    nearest = known + last + 1
    for k in range(known - 1, -1, -1):
        entering = k + first
        if entering < reach and truth[entering] == wanted:
            nearest = entering
        sign[near, k] = wanted if nearest <= k + last else -wanted
    # Behind them everything may still be met.
    end = min(max(reach - last, 0), known)
    for k in range(end):
        sign[1 - near, k] = sign[near, k]
    for k in range(end, known):
        sign[1 - near, k] = wanted


@compiled
def _slide_signs(  # noqa: PLR0913, PLR0917 - a kernel
    is_always: bool,  # noqa: FBT001 - compiled
    sign: Bytes,
    known: int,
    reach: int,
    first: int,
    last: int,
    out: Floats,
) -> None:
    """Write the bounds of ``eventually`` or ``always`` where they are 1 or -1, as the truth is."""
    near = 1 if is_always else 0
    beyond = math.inf if is_always else -math.inf
    for k in range(known):
        out[near, k] = sign[near, k]
    for k in range(max(reach - first, 0), known):
        out[near, k] = beyond
    end = min(max(reach - last, 0), known)
    for k in range(end):
        out[1 - near, k] = out[near, k]
    for k in range(end, known):
        out[1 - near, k] = -beyond
