"""Compiled: operators of a numbered formula at the rows of one run.

A state is lower and upper bound of robustness and of truth. Operators without a window reach to the
end of time, of which the trace shows a part; only those that no other temporal operator encloses
range over the rows 0 to the horizon (``fill_start``).

Source:
    Donze, Ferrere and Maler (2013), "Efficient robust monitoring for STL" (until, lemma 2).

A run is a one-dimensional array of which the first ``length`` entries are known. What lies beyond
is one number, ``beyond``: minus infinity for a lower and plus infinity for an upper bound of
robustness. The loop is linear in the length, whatever the window.

They are the operators that look ahead, on the rows in reverse order, with one difference: before
row 0 there is nothing, where after the last row there is something that is not known. So a window
is cut off at row 0 and opens no bound. Of an empty one, the largest value is minus infinity:
nothing was there once, and everything was there historically.

Source:
    Maler and Nickovic (2013), "Monitoring properties of analog and mixed-signal circuits" (past
    operators); Donze, Ferrere and Maler (2013), "Efficient robust monitoring for STL", lemma 2.

What is known of a condition at every row is its truth; where its bounds are 1 or -1 as the truth
is, a window of it is found without comparing any bound. A row at which nothing is known, like the
last one of what is decided, is as one beyond the trace.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from adeye.judge.stl import program
from adeye.judge.stl.measures import EXACT, OPEN, SIGN, kind_and_parts
from adeye.kernel.jit import allocating, compiled

if TYPE_CHECKING:
    from adeye.judge.stl.program import Extent, State, Tables
    from adeye.signals import Bools, Bytes, Floats, Ints


# --- Compiled: the largest value in a sliding window of one run -----------------------------------


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


# --- Compiled: operators that look back, at the rows of one run -----------------------------------


@compiled
def fill_previous(node: int, nodes: Ints, known: int, state: State) -> None:
    """Write the state of ``previous``: that of the row before; false at row 0."""
    part = nodes[node, program.FIRST_PART]
    out, sign = state.bounds[node], state.truth[node]
    before, truth = state.bounds[part], state.truth[part]
    for plane in range(2):
        out[plane, 0], sign[plane, 0] = -math.inf, -1
        for k in range(1, known):
            out[plane, k], sign[plane, k] = before[plane, k - 1], truth[plane, k - 1]


@compiled
def fill_once(node: int, nodes: Ints, known: int, state: State) -> None:
    """Write the state of ``once``, or of ``historically`` as its dual, at the known rows."""
    what, part, queue = nodes[node], nodes[node, program.FIRST_PART], state.queue
    out, sign = state.bounds[node], state.truth[node]
    bounds, truth = state.bounds[part], state.truth[part]
    turned, found = state.scratch[0], state.scratch[1]
    # Without a window it reaches as far back as the arrays do.
    first, last = 0, queue.shape[0]
    if what[program.HAS_WINDOW]:
        first, last = what[program.FROM_ROW], what[program.TO_ROW]
    factor = -1.0 if what[program.KIND] == program.HISTORICALLY else 1.0
    for plane in range(4):
        half = plane % 2
        for k in range(known):
            value = bounds[half, k] if plane < 2 else float(truth[half, k])
            turned[known - 1 - k] = factor * value
        nothing = -math.inf if plane < 2 else -1.0
        sliding_maximum(turned, known, first, last, nothing, queue, found)
        for k in range(known):
            value = factor * found[known - 1 - k]
            if plane < 2:
                out[half, k] = value
            else:
                sign[half, k] = int(value)


@allocating
def restrict(what: Ints, known: int, beyond: float, state: State) -> None:
    """Restrict an ``until`` without end to its window.

    Args:
        what: Its node.
        known: Rows of the run.
        beyond: Bound of every row from ``known`` on.
        state: In its scratch, row by row: what has to hold before, negated; what has to hold in the
            window; and the ``until`` without end, in and out.
    """
    first, last = what[program.FROM_ROW], what[program.TO_ROW]
    before, after, endless = state.scratch[0], state.scratch[1], state.scratch[2]
    queue = state.queue
    found = np.empty(before.shape[0])
    sliding_maximum(after, known, first, last, beyond, queue, found)
    for k in range(known):
        endless[k] = min(found[k], endless[k + first] if k + first < known else beyond)
    if first > 0:
        # The negation of a bound is the other bound of the negation.
        sliding_maximum(before, known, 0, first - 1, -beyond, queue, found)
        for k in range(known):
            endless[k] = min(endless[k], -found[k])


# --- Compiled: ``eventually`` and ``always`` over a window that slides along one run --------------


class Sliding(NamedTuple):
    """A window that slides along a run.

    Attributes:
        is_always: Whether it is that of ``always``, else of ``eventually``.
        known: Rows of the run.
        first: Rows to the window's first row.
        last: Rows to the window's last row.
    """

    is_always: bool
    known: int
    first: int
    last: int


@compiled
def slide(node: int, part: int, window: Sliding, state: State) -> None:
    """Write the state of ``eventually``, or of ``always``, of a condition at the known rows.

    Args:
        node: Which is written.
        part: The condition.
        window: Over which rows.
        state: Of both.
    """
    bounds, truth, sign = state.bounds[part], state.truth[part], state.truth[node]
    level, reach = _known_part(state.exact[part], bounds, truth, window.known)
    if level == OPEN:
        _slide_open_truth(window, truth, sign)
    else:
        _slide_truth(window, truth[0], reach, sign)
    if level == SIGN:
        _slide_signs(window, sign, reach, state.bounds[node])
    else:
        _slide(node, part, window, level, reach, state)


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
def _slide(node: int, part: int, window: Sliding, level: int, reach: int, state: State) -> None:
    """Write the bounds of ``eventually``, or of ``always`` as its dual, over a window.

    The lower bound of ``always`` is the negated upper bound of ``eventually not``.
    """
    is_always, known, first, last = window
    bounds, out, scratch = state.bounds[part], state.bounds[node], state.scratch
    for plane in range(2):
        beyond = -math.inf if plane == 0 else math.inf
        target = 1 - plane if is_always else plane
        if plane == 1 and level == EXACT:
            # Bounds differ only where the window reaches beyond the trace.
            near = 1 if is_always else 0
            for k in range(known):
                is_open = k + last >= reach
                out[target, k] = (-math.inf if is_always else math.inf) if is_open else out[near, k]
        else:
            source = bounds[plane]
            if is_always:
                source = scratch[0]
                for k in range(known):
                    source[k] = -bounds[target, k]
            sliding_maximum(source, reach, first, last, beyond, state.queue, scratch[1])
            for k in range(known):
                out[target, k] = -scratch[1, k] if is_always else scratch[1, k]


@compiled
def _slide_open_truth(window: Sliding, truth: Bytes, sign: Bytes) -> None:
    """Write the truth of ``eventually`` or ``always`` of what may be open at some rows."""
    is_always, known, first, last = window
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
def _slide_truth(window: Sliding, truth: Bytes, reach: int, sign: Bytes) -> None:
    """Write the truth of ``eventually`` or ``always`` of what is known at the rows to ``reach``."""
    is_always, known, first, last = window
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
def _slide_signs(window: Sliding, sign: Bytes, reach: int, out: Floats) -> None:
    """Write the bounds of ``eventually`` or ``always`` where they are 1 or -1, as the truth is."""
    is_always, known, first, last = window
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


# --- Compiled: operators of a numbered formula at the rows of one run -----------------------------


@compiled
def needs_rows(node: Ints) -> bool:
    """Tell whether a condition is read row by row, not only as part of the whole formula."""
    if not node[program.IS_START]:
        return True
    kind = node[program.KIND]
    if kind in (program.NOT, program.AND, program.OR, program.IMPLIES):
        return False
    return not is_open_ended(node)


@compiled
def is_open_ended(node: Ints) -> bool:
    """Tell whether a condition ranges over the rows to the horizon: outermost, without window."""
    kind = node[program.KIND]
    is_temporal = kind == program.EVENTUALLY or kind == program.ALWAYS or kind == program.UNTIL  # noqa: PLR1714
    return bool(node[program.IS_START]) and is_temporal and not node[program.HAS_WINDOW]


@compiled
def fill_operator(  # noqa: C901, PLR0912 - one branch for each operator
    node: int, nodes: Ints, known: int, state: State
) -> None:
    """Combine the states of the parts of an operator at the known rows."""
    kind, first, second = kind_and_parts(nodes[node])
    bounds, truth, exact = state.bounds, state.truth, state.exact
    exact[node] = min(exact[first], exact[second])
    out, sign = bounds[node], truth[node]
    a, b, p, q = bounds[first], bounds[second], truth[first], truth[second]
    if kind in (program.EVENTUALLY, program.ALWAYS):
        from_row, to_row = 0, state.queue.shape[0]
        if nodes[node, program.HAS_WINDOW]:
            from_row, to_row = nodes[node, program.FROM_ROW], nodes[node, program.TO_ROW]
        slide(node, first, Sliding(kind == program.ALWAYS, known, from_row, to_row), state)
        exact[node] = OPEN
        return
    if kind == program.UNTIL:
        _until(node, nodes, known, state)
        exact[node] = OPEN
        return
    if kind >= program.PREVIOUS:
        if kind == program.SINCE:
            _until(node, nodes, known, state)
        elif kind == program.PREVIOUS:
            fill_previous(node, nodes, known, state)
        else:
            fill_once(node, nodes, known, state)
        # Where nothing lies in a window, the bounds are infinite.
        exact[node] = min(exact[node], EXACT)
        return
    for plane in range(2):
        other = 1 - plane
        if kind == program.NOT:
            for k in range(known):
                out[plane, k], sign[plane, k] = -a[other, k], -p[other, k]
        elif kind == program.AND:
            for k in range(known):
                out[plane, k] = min(a[plane, k], b[plane, k])
                sign[plane, k] = min(p[plane, k], q[plane, k])
        elif kind == program.OR:
            for k in range(known):
                out[plane, k] = max(a[plane, k], b[plane, k])
                sign[plane, k] = max(p[plane, k], q[plane, k])
        elif kind == program.IMPLIES:
            for k in range(known):
                out[plane, k] = max(-a[other, k], b[plane, k])
                sign[plane, k] = max(-p[other, k], q[plane, k])
        elif kind == program.RISE:
            for k in range(1, known):
                out[plane, k] = min(a[plane, k], -a[other, k - 1])
                sign[plane, k] = min(p[plane, k], -p[other, k - 1])
        elif kind == program.FALL:
            for k in range(1, known):
                out[plane, k] = min(-a[other, k], a[plane, k - 1])
                sign[plane, k] = min(-p[other, k], p[plane, k - 1])
        if kind in (program.RISE, program.FALL):
            out[plane, 0], sign[plane, 0] = -1.0, -1


@compiled
def _until(node: int, nodes: Ints, known: int, state: State) -> None:
    """Write the state of ``until``: that of one without end, restricted to the window.

    ``since`` is the same on the rows in reverse order; before row 0 there is nothing.
    """
    what = nodes[node]
    kind, first, second = kind_and_parts(what)
    left, left_truth = state.bounds[first], state.truth[first]
    right, right_truth = state.bounds[second], state.truth[second]
    out, sign = state.bounds[node], state.truth[node]
    is_past = kind == program.SINCE
    before, after, endless = state.scratch[0], state.scratch[1], state.scratch[2]
    for plane in range(4):
        half = plane % 2
        beyond = (-math.inf if half == 0 else math.inf) if plane < 2 else 2.0 * half - 1.0
        if is_past:
            beyond = -math.inf if plane < 2 else -1.0
        later = beyond
        for k in range(known - 1, -1, -1):
            row = known - 1 - k if is_past else k
            before[k] = -(left[half, row] if plane < 2 else float(left_truth[half, row]))
            after[k] = right[half, row] if plane < 2 else float(right_truth[half, row])
            later = max(after[k], min(-before[k], later))
            endless[k] = later
        if what[program.HAS_WINDOW]:
            restrict(what, known, beyond, state)
        for k in range(known):
            row = known - 1 - k if is_past else k
            if plane < 2:
                out[half, row] = endless[k]
            else:
                sign[half, row] = int(endless[k])


@compiled
def fill_start(node: int, nodes: Ints, extent: Extent, state: State) -> None:
    """Write the state (4,) of a condition as a whole formula.

    Operators without a window that no temporal operator encloses range over the rows 0 to ``last``
    and, if the trace was cut short, over unknown ones; everything else is that of row 0.
    """
    kind, first, second = kind_and_parts(nodes[node])
    bounds, truth, start = state.bounds, state.truth, state.start
    out = start[node]
    if needs_rows(nodes[node]):
        out[0], out[1] = bounds[node, 0, 0], bounds[node, 1, 0]
        out[2], out[3] = truth[node, 0, 0], truth[node, 1, 0]
        return
    if kind in (program.EVENTUALLY, program.ALWAYS):
        _start_over_rows(kind, bounds[first], truth[first], extent, out)
        return
    for plane in range(4):
        half = plane % 2
        other = plane + 1 - 2 * half
        if kind == program.NOT:
            out[plane] = -start[first, other]
        elif kind == program.AND:
            out[plane] = min(start[first, plane], start[second, plane])
        elif kind == program.OR:
            out[plane] = max(start[first, plane], start[second, plane])
        elif kind == program.IMPLIES:
            out[plane] = max(-start[first, other], start[second, plane])
        else:
            most = -math.inf if plane < 2 else -1.0
            if extent.is_cut and half == 1:
                most = -most
            for k in range(extent.last, -1, -1):
                one = bounds[first, half, k] if plane < 2 else float(truth[first, half, k])
                two = bounds[second, half, k] if plane < 2 else float(truth[second, half, k])
                most = max(two, min(one, most))
            out[plane] = most


@compiled
def _start_over_rows(kind: int, state: Floats, truth: Bytes, extent: Extent, out: Floats) -> None:
    """Write the extremes of a condition over the rows that obligations start at."""
    # One loop for all four: each alone would wait for its last comparison.
    low, high = state[0, 0], state[1, 0]
    no, yes = truth[0, 0], truth[1, 0]
    if kind == program.ALWAYS:
        for k in range(1, extent.last + 1):
            low, high = min(low, state[0, k]), min(high, state[1, k])
            no, yes = min(no, truth[0, k]), min(yes, truth[1, k])
        if extent.is_cut:
            low, no = -math.inf, np.int8(-1)
    else:
        for k in range(1, extent.last + 1):
            low, high = max(low, state[0, k]), max(high, state[1, k])
            no, yes = max(no, truth[0, k]), max(yes, truth[1, k])
        if extent.is_cut:
            high, yes = math.inf, np.int8(1)
    out[0], out[1], out[2], out[3] = low, high, float(no), float(yes)


@compiled
def fill_decided(tables: Tables, extent: Extent, state: State, is_changed: Bools) -> None:
    """Take antecedents as true or false without a degree, and write again what hangs on them.

    An implication is worth its consequent then at the rows at which its antecedent held, and
    nothing at the others; so the least of them is the margin that people read.
    """
    nodes, decided = tables.nodes, tables.decided
    bounds, truth, start, exact = state.bounds, state.truth, state.start, state.exact
    is_changed[:] = False
    for place in range(decided.shape[0]):
        node = decided[place]
        is_changed[node] = True
        exact[node] = min(exact[node], EXACT)
        for k in range(extent.known):
            if truth[node, 0, k] == truth[node, 1, k]:
                bounds[node, 0, k] = bounds[node, 1, k] = math.inf * truth[node, 0, k]
        if start[node, 2] == start[node, 3]:
            start[node, 0] = start[node, 1] = math.inf * start[node, 2]
    for node in range(nodes.shape[0]):
        if nodes[node, program.KIND] <= program.WORD or is_changed[node]:
            continue
        if (
            is_changed[nodes[node, program.FIRST_PART]]
            or is_changed[nodes[node, program.SECOND_PART]]
        ):
            is_changed[node] = True
            if needs_rows(nodes[node]):
                fill_operator(node, nodes, extent.known, state)
            if nodes[node, program.IS_START]:
                fill_start(node, nodes, extent, state)


@compiled
def is_vacuous(tables: Tables, extent: Extent, state: State) -> bool:
    """Tell whether a top-level implication was never exercised."""
    implied, antecedents, truth, start = (
        tables.implied, tables.antecedents, state.truth, state.start,
    )  # fmt: skip
    for item in range(implied.shape[0]):
        begin, end = implied[item, 0], implied[item, 0] + implied[item, 1]
        is_held = False
        if implied[item, 2] == 0:
            # It is asked for at the first row alone.
            is_held = implied[item, 3] == 0
            for place in range(begin, end):
                is_held = is_held and start[antecedents[place], 2] > 0.0
        else:
            stop = extent.last
            if implied[item, 4] >= 0:
                stop = min(implied[item, 4], extent.known - 1)
            for k in range(implied[item, 3], stop + 1):
                is_held = True
                for place in range(begin, end):
                    is_held = is_held and truth[antecedents[place], 0, k] > 0
                if is_held:
                    break
        if not is_held:
            return True
    return False


# --- Compiled: at which rows parts of a formula are asked for, and where antecedents held there --
#
# From the formula down: a part is asked for at the rows that what encloses it looks at. A
# consequent is asked for only where its antecedent held, what stands left of ``until`` only before
# the row that fulfils it.


@compiled
def find_held(  # noqa: PLR0912, C901 - one branch for each operator
    tables: Tables, extent: Extent, state: State, scope: Bytes, held: Bytes
) -> None:
    """Tell of each nested implication whether its antecedent held where it was asked for.

    Args:
        tables: The formula.
        extent: Of the run.
        state: Of its conditions.
        scope: (N, T) scratch: whether a condition is asked for at a row.
        held: (J,) out.
    """
    nodes, nested, truth, start = tables.nodes, tables.nested, state.truth, state.start
    known = extent.known
    scope[:] = 0
    scope[nodes.shape[0] - 1, 0] = 1
    for node in range(nodes.shape[0] - 1, -1, -1):
        kind = nodes[node, program.KIND]
        if kind <= program.WORD:
            continue
        first, second = nodes[node, program.FIRST_PART], nodes[node, program.SECOND_PART]
        if kind in (program.NOT, program.AND, program.OR, program.IMPLIES):
            for k in range(known):
                if scope[node, k]:
                    scope[first, k] = 1
                    if kind != program.IMPLIES or _part_holds(first, k, nodes[node], truth, start):
                        scope[second, k] = 1
        elif kind in (program.RISE, program.FALL, program.PREVIOUS):
            for k in range(1, known):
                if scope[node, k]:
                    scope[first, k - 1] = 1
                    if kind != program.PREVIOUS:
                        scope[first, k] = 1
        else:
            _ask_over_time(node, nodes[node], extent, truth, scope)
    for place in range(nested.shape[0]):
        node, held[place] = nested[place, 0], 0
        for k in range(nested[place, 1], known):
            antecedent = nodes[node, program.FIRST_PART]
            if scope[node, k] and _part_holds(antecedent, k, nodes[node], truth, start):
                held[place] = 1
                break


@compiled
def _part_holds(part: int, row: int, above: Ints, truth: Bytes, start: Floats) -> bool:
    """Tell whether a part of a connective holds, which at the top has no rows."""
    if above[program.IS_START]:
        return bool(start[part, 2] > 0.0)
    return bool(truth[part, 0, row] > 0)


@compiled
def _ask_over_time(  # noqa: C901, PLR0912 - one branch for each operator
    node: int, what: Ints, extent: Extent, truth: Bytes, scope: Bytes
) -> None:
    """Mark the rows that the parts of a temporal operator are asked for at."""
    kind, first, second = kind_and_parts(what)
    known = extent.known
    done = 0
    for k in range(known):
        if not scope[node, k]:
            continue
        near, far = 0, known
        if what[program.HAS_WINDOW]:
            near, far = what[program.FROM_ROW], what[program.TO_ROW]
        if kind in (program.EVENTUALLY, program.ALWAYS, program.UNTIL):
            begin, end = k + near, min(k + far, known - 1)
            if is_open_ended(what):
                end = extent.last
        else:
            begin, end = max(k - far, 0), k - near
        if kind == program.UNTIL:
            for j in range(k, end + 1):
                if j >= begin:
                    scope[second, j] = 1
                    if truth[second, 0, j] > 0:
                        break
                scope[first, j] = 1
        elif kind == program.SINCE:
            for j in range(k, begin - 1, -1):
                if j <= end:
                    scope[second, j] = 1
                    if truth[second, 0, j] > 0:
                        break
                scope[first, j] = 1
        else:
            # Windows move on with the row: what is marked stays so.
            for j in range(max(begin, done), end + 1):
                scope[first, j] = 1
            done = max(done, end + 1)
