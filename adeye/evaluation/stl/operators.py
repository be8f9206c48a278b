"""Compiled: operators of a numbered formula at the rows of one run.

A state is lower and upper bound of robustness and of truth. Operators without a window reach to the
end of time, of which the trace shows a part; only those that no other temporal operator encloses
range over the rows 0 to the horizon (``fill_start``).

Source:
    Donze, Ferrere and Maler (2013), "Efficient robust monitoring for STL" (until, lemma 2).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.stl.kernels import sliding_maximum
from adeye.evaluation.stl.measures import EXACT, OPEN, SIGN
from adeye.evaluation.stl.program import (
    ALWAYS,
    AND,
    EVENTUALLY,
    FALL,
    FIRST_PART,
    FROM_ROW,
    HAS_WINDOW,
    IMPLIES,
    IS_START,
    KIND,
    NOT,
    OR,
    RISE,
    SECOND_PART,
    TO_ROW,
    UNTIL,
)
from adeye.kernel.jit import allocating, compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Floats, Ints

    Bytes = NDArray[np.int8]


@compiled
def needs_rows(node: Ints) -> bool:
    """Tell whether a condition is read row by row, not only as part of the whole formula."""
    if not node[IS_START]:
        return True
    kind = node[KIND]
    if kind in (NOT, AND, OR, IMPLIES):
        return False
    is_temporal = kind == EVENTUALLY or kind == ALWAYS or kind == UNTIL  # noqa: PLR1714
    return bool(node[HAS_WINDOW]) or not is_temporal


@compiled
def fill_operator(  # noqa: PLR0913, PLR0917, C901, PLR0912 - one branch for each operator
    node: int,
    nodes: Ints,
    known: int,
    rows: int,
    bounds: Floats,
    truth: Bytes,
    exact: Bytes,
    scratch: Floats,
    queue: Ints,
) -> None:
    """Combine the states of the parts of an operator at the known rows."""
    kind, first, second = nodes[node, KIND], nodes[node, FIRST_PART], nodes[node, SECOND_PART]
    exact[node] = min(exact[first], exact[second])
    out, sign = bounds[node], truth[node]
    a, b, p, q = bounds[first], bounds[second], truth[first], truth[second]
    if kind in (EVENTUALLY, ALWAYS):
        from_row, to_row = 0, rows
        if nodes[node, HAS_WINDOW]:
            from_row, to_row = nodes[node, FROM_ROW], nodes[node, TO_ROW]
        level, reach = _known_part(exact[first], a, p, known)
        if level == OPEN:
            _slide_open_truth(kind == ALWAYS, p, known, from_row, to_row, sign)
        else:
            _slide_truth(kind == ALWAYS, p[0], known, reach, from_row, to_row, sign)
        if level == SIGN:
            _slide_signs(kind == ALWAYS, sign, known, reach, from_row, to_row, out)
        else:
            _slide(
                kind == ALWAYS, a, known, reach, from_row, to_row, level == EXACT, scratch, queue,
                out,
            )  # fmt: skip
        exact[node] = OPEN
        return
    if kind == UNTIL:
        _until(nodes[node], a, p, b, q, known, scratch, queue, out, sign)
        exact[node] = OPEN
        return
    for plane in range(2):
        other = 1 - plane
        if kind == NOT:
            for k in range(known):
                out[plane, k], sign[plane, k] = -a[other, k], -p[other, k]
        elif kind == AND:
            for k in range(known):
                out[plane, k] = min(a[plane, k], b[plane, k])
                sign[plane, k] = min(p[plane, k], q[plane, k])
        elif kind == OR:
            for k in range(known):
                out[plane, k] = max(a[plane, k], b[plane, k])
                sign[plane, k] = max(p[plane, k], q[plane, k])
        elif kind == IMPLIES:
            for k in range(known):
                out[plane, k] = max(-a[other, k], b[plane, k])
                sign[plane, k] = max(-p[other, k], q[plane, k])
        elif kind == RISE:
            for k in range(1, known):
                out[plane, k] = min(a[plane, k], -a[other, k - 1])
                sign[plane, k] = min(p[plane, k], -p[other, k - 1])
        elif kind == FALL:
            for k in range(1, known):
                out[plane, k] = min(-a[other, k], a[plane, k - 1])
                sign[plane, k] = min(-p[other, k], p[plane, k - 1])
        if kind in (RISE, FALL):
            out[plane, 0], sign[plane, 0] = -1.0, -1


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


@compiled
def _until(  # noqa: PLR0913, PLR0917 - a kernel
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
    """Write the state of ``until``: that of one without end, restricted to the window."""
    first, last = node[FROM_ROW], node[TO_ROW]
    for plane in range(4):
        half = plane % 2
        beyond = (-math.inf if half == 0 else math.inf) if plane < 2 else 2.0 * half - 1.0
        before, after, endless = scratch[0], scratch[1], scratch[2]
        later = beyond
        for k in range(known - 1, -1, -1):
            before[k] = -(left[half, k] if plane < 2 else float(left_truth[half, k]))
            after[k] = right[half, k] if plane < 2 else float(right_truth[half, k])
            later = max(after[k], min(-before[k], later))
            endless[k] = later
        if node[HAS_WINDOW]:
            _restrict(before, after, endless, known, first, last, beyond, queue)
        for k in range(known):
            if plane < 2:
                out[half, k] = endless[k]
            else:
                sign[half, k] = int(endless[k])


@allocating
def _restrict(  # noqa: PLR0913, PLR0917 - a kernel
    before: Floats,
    after: Floats,
    endless: Floats,
    known: int,
    first: int,
    last: int,
    beyond: float,
    queue: Ints,
) -> None:
    """Restrict an ``until`` without end to a window; ``before`` comes negated."""
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
def fill_start(  # noqa: PLR0913, PLR0917 - one branch for each operator
    node: int,
    nodes: Ints,
    last: int,
    is_cut: bool,  # noqa: FBT001 - compiled
    bounds: Floats,
    truth: Bytes,
    start: Floats,
) -> None:
    """Write the state (4,) of a condition as a whole formula.

    Operators without a window that no temporal operator encloses range over the rows 0 to ``last``
    and, if the trace was cut short, over unknown ones; everything else is that of row 0.
    """
    kind, first, second = nodes[node, KIND], nodes[node, FIRST_PART], nodes[node, SECOND_PART]
    out = start[node]
    if needs_rows(nodes[node]):
        out[0], out[1] = bounds[node, 0, 0], bounds[node, 1, 0]
        out[2], out[3] = truth[node, 0, 0], truth[node, 1, 0]
        return
    if kind in (EVENTUALLY, ALWAYS):
        _start_over_rows(kind == ALWAYS, bounds[first], truth[first], last, is_cut, out)
        return
    for plane in range(4):
        half = plane % 2
        other = plane + 1 - 2 * half
        if kind == NOT:
            out[plane] = -start[first, other]
        elif kind == AND:
            out[plane] = min(start[first, plane], start[second, plane])
        elif kind == OR:
            out[plane] = max(start[first, plane], start[second, plane])
        elif kind == IMPLIES:
            out[plane] = max(-start[first, other], start[second, plane])
        else:
            most = -math.inf if plane < 2 else -1.0
            if is_cut and half == 1:
                most = -most
            for k in range(last, -1, -1):
                one = bounds[first, half, k] if plane < 2 else float(truth[first, half, k])
                two = bounds[second, half, k] if plane < 2 else float(truth[second, half, k])
                most = max(two, min(one, most))
            out[plane] = most


@compiled
def _start_over_rows(
    is_always: bool,  # noqa: FBT001 - compiled
    state: Floats,
    truth: Bytes,
    last: int,
    is_cut: bool,  # noqa: FBT001 - compiled
    out: Floats,
) -> None:
    """Write the extremes of a condition over the rows that obligations start at."""
    # One loop for all four: each alone would wait for its last comparison.
    low, high = state[0, 0], state[1, 0]
    no, yes = truth[0, 0], truth[1, 0]
    if is_always:
        for k in range(1, last + 1):
            low, high = min(low, state[0, k]), min(high, state[1, k])
            no, yes = min(no, truth[0, k]), min(yes, truth[1, k])
        if is_cut:
            low, no = -math.inf, np.int8(-1)
    else:
        for k in range(1, last + 1):
            low, high = max(low, state[0, k]), max(high, state[1, k])
            no, yes = max(no, truth[0, k]), max(yes, truth[1, k])
        if is_cut:
            high, yes = math.inf, np.int8(1)
    out[0], out[1], out[2], out[3] = low, high, float(no), float(yes)


@compiled
def is_vacuous(
    implied: Ints, antecedents: Ints, known: int, last: int, truth: Bytes, start: Floats
) -> bool:
    """Tell whether a top-level implication was never exercised."""
    for item in range(implied.shape[0]):
        begin, end = implied[item, 0], implied[item, 0] + implied[item, 1]
        is_held = False
        if implied[item, 2] == 0:
            is_held = True
            for place in range(begin, end):
                is_held = is_held and start[antecedents[place], 2] > 0.0
        else:
            stop = last if implied[item, 4] < 0 else min(implied[item, 4], known - 1)
            for k in range(implied[item, 3], stop + 1):
                is_held = True
                for place in range(begin, end):
                    is_held = is_held and truth[antecedents[place], 0, k] > 0
                if is_held:
                    break
        if not is_held:
            return True
    return False
