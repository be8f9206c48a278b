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

from adeye.evaluation.stl.measures import EXACT, OPEN
from adeye.evaluation.stl.past import fill_past, fill_since, restrict
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
    PREVIOUS,
    RISE,
    SECOND_PART,
    SINCE,
    TO_ROW,
    UNTIL,
    WORD,
)
from adeye.evaluation.stl.sliding import slide
from adeye.kernel.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats, Ints

    Bytes = NDArray[np.int8]


@compiled
def needs_rows(node: Ints) -> bool:
    """Tell whether a condition is read row by row, not only as part of the whole formula."""
    if not node[IS_START]:
        return True
    kind = node[KIND]
    if kind in (NOT, AND, OR, IMPLIES):
        return False
    return not is_open_ended(node)


@compiled
def is_open_ended(node: Ints) -> bool:
    """Tell whether a condition ranges over the rows to the horizon: outermost, without window."""
    kind = node[KIND]
    is_temporal = kind == EVENTUALLY or kind == ALWAYS or kind == UNTIL  # noqa: PLR1714
    return bool(node[IS_START]) and is_temporal and not node[HAS_WINDOW]


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
        slide(
            kind == ALWAYS, exact[first], a, p, known, from_row, to_row, scratch, queue, out, sign
        )
        exact[node] = OPEN
        return
    if kind == UNTIL:
        _until(nodes[node], a, p, b, q, known, scratch, queue, out, sign)
        exact[node] = OPEN
        return
    if kind >= PREVIOUS:
        if kind == SINCE:
            fill_since(nodes[node], a, p, b, q, known, scratch, queue, out, sign)
        else:
            fill_past(nodes[node], a, p, known, rows, scratch, queue, out, sign)
        # Where nothing lies in a window, the bounds are infinite.
        exact[node] = min(exact[node], EXACT)
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
            restrict(before, after, endless, known, first, last, beyond, queue)
        for k in range(known):
            if plane < 2:
                out[half, k] = endless[k]
            else:
                sign[half, k] = int(endless[k])


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
def fill_decided(  # noqa: PLR0913, PLR0917 - a kernel
    nodes: Ints,
    decided: Ints,
    known: int,
    rows: int,
    last: int,
    is_cut: bool,  # noqa: FBT001 - compiled
    bounds: Floats,
    truth: Bytes,
    start: Floats,
    exact: Bytes,
    scratch: Floats,
    queue: Ints,
    is_changed: Bools,
) -> None:
    """Take antecedents as true or false without a degree, and write again what hangs on them.

    An implication is worth its consequent then at the rows at which its antecedent held, and
    nothing at the others; so the least of them is the margin that people read.
    """
    is_changed[:] = False
    for place in range(decided.shape[0]):
        node = decided[place]
        is_changed[node] = True
        exact[node] = min(exact[node], EXACT)
        for k in range(known):
            if truth[node, 0, k] == truth[node, 1, k]:
                bounds[node, 0, k] = bounds[node, 1, k] = math.inf * truth[node, 0, k]
        if start[node, 2] == start[node, 3]:
            start[node, 0] = start[node, 1] = math.inf * start[node, 2]
    for node in range(nodes.shape[0]):
        if nodes[node, KIND] <= WORD or is_changed[node]:
            continue
        if is_changed[nodes[node, FIRST_PART]] or is_changed[nodes[node, SECOND_PART]]:
            is_changed[node] = True
            if needs_rows(nodes[node]):
                fill_operator(node, nodes, known, rows, bounds, truth, exact, scratch, queue)
            if nodes[node, IS_START]:
                fill_start(node, nodes, last, is_cut, bounds, truth, start)


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
