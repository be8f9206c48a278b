"""Compiled: from a formula's robustness down to the predicate and row that it comes from.

Robustness is a maximum of minima over predicates and rows, so one predicate at one row carries it.
The search goes down the formula, at each operator to the part that decided; ties go to the
earliest row and the leftmost part. Truth and robustness order alike, except where robustness is 0
or where a part is open: then the parts that leave the formula open are the ones to show.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from adeye.judge.stl import program
from adeye.judge.stl.measures import kind_and_parts, parted
from adeye.kernel.jit import compiled

if TYPE_CHECKING:
    from adeye.judge.stl.program import Extent, State, Tables
    from adeye.signals import Bytes, Floats, Ints


BINDING_STATUSES: Final = (
    "value",
    "no_conflict",
    "not_applicable",
    "beyond_trace",
    "before_trace",
)
"""What a binding predicate can be, by code."""
_NO_CONFLICT, _NOT_APPLICABLE, _BEYOND, _BEFORE = 1, 2, 3, 4


@compiled
def find_binding_row(
    bound: int, tables: Tables, extent: Extent, state: State, numbers: Floats, facts: Ints
) -> None:
    """Find the binding predicate of a run and what it says there.

    Args:
        bound: Which bound of the robustness to explain: 0 lower, 1 upper.
        tables: The formula.
        extent: Of the run.
        state: Of its terms and conditions.
        numbers: (5,) out, from 2: value, threshold, difference.
        facts: (7,) out, from 3: node, row, obligation, status.
    """
    nodes, known = tables.nodes, extent.known
    node, row, side, obligation = nodes.shape[0] - 1, 0, bound, 0
    while row < known and nodes[node, program.KIND] > program.WORD:
        above, kind, first = node, nodes[node, program.KIND], nodes[node, program.FIRST_PART]
        if kind == program.NOT:
            node, side = first, 1 - side
        elif kind in (program.AND, program.OR, program.IMPLIES):
            is_left, side = _connective(nodes[node], row, side, known, state)
            node = first if is_left else nodes[node, program.SECOND_PART]
        elif kind in (program.RISE, program.FALL):
            if row == 0:
                break
            row, side = _edge(kind, first, row, side, state.bounds, state.truth)
            node = first
        else:
            node, row = _through_time(node, nodes, row, side, extent, state)
            if row < 0:
                row = -1 - row
                break
            if (
                nodes[above, program.IS_START]
                and not nodes[above, program.HAS_WINDOW]
                and kind != program.UNTIL
            ):
                obligation = row
    facts[3], facts[4], facts[5] = node, row, obligation
    if row >= known:
        facts[4], facts[6] = -1, _BEYOND
        numbers[2] = numbers[3] = numbers[4] = math.nan
        return
    facts[6] = _read(nodes[node], tables.limits[node], state.values, state.flags, row, numbers)
    if side != bound:
        numbers[4] = -numbers[4]


@compiled
def _through_time(
    node: int, nodes: Ints, row: int, side: int, extent: Extent, state: State
) -> tuple[int, int]:
    """Go to the part and row that decide a temporal operator; row is -1 - row if there is none."""
    kind, first, second = kind_and_parts(nodes[node])
    known = extent.known
    if kind < program.PREVIOUS:
        begin, end = _window(nodes[node], row, extent)
        if kind == program.UNTIL:
            return _until(first, second, row, begin, end, side, known, state)
        sign = 1.0 if kind == program.ALWAYS else -1.0
        return first, _temporal(sign, first, begin, end, side, known, state)
    oldest, newest = _look_back(nodes[node], row)
    if newest < 0:
        return node, -1 - row
    if kind == program.SINCE:
        return _since(first, second, row, oldest, newest, side, state)
    sign = 1.0 if kind == program.HISTORICALLY else -1.0
    return first, _temporal(sign, first, oldest, newest, side, known, state)


@compiled
def _key(
    node: int, row: int, side: int, known: int, bounds: Floats, truth: Bytes
) -> tuple[float, float]:
    """Rank a condition at a row: truth (-2 false, 0 open, 2 true), then robustness."""
    if row >= known:
        return 0.0, (-math.inf if side == 0 else math.inf)
    return float(truth[node, 0, row] + truth[node, 1, row]), bounds[node, side, row]


@compiled
def _is_less(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return one[0] < other[0] or (one[0] == other[0] and one[1] < other[1])


@compiled
def _connective(node: Ints, row: int, side: int, known: int, state: State) -> tuple[bool, int]:
    """Tell whether the left part decides, and which of its bounds."""
    kind, first, second = kind_and_parts(node)
    bounds, truth, start = state.bounds, state.truth, state.start
    near = 1 - side if kind == program.IMPLIES else side
    if node[program.IS_START]:
        left = (start[first, 2] + start[first, 3], start[first, near])
        right = (start[second, 2] + start[second, 3], start[second, side])
    else:
        left = _key(first, row, near, known, bounds, truth)
        right = _key(second, row, side, known, bounds, truth)
    if kind == program.IMPLIES:
        # In a tie, what should have followed says more than what it should have followed.
        is_left = _is_less(right, (-left[0], -left[1]))
    elif kind == program.AND:
        is_left = not _is_less(right, left)
    else:
        is_left = not _is_less(left, right)
    return is_left, (near if is_left else side)


@compiled
def _edge(
    kind: int, first: int, row: int, side: int, bounds: Floats, truth: Bytes
) -> tuple[int, int]:
    """Go to the row or the one before, whichever decides; its bound comes along."""
    near = 1 - side if kind == program.FALL else side
    now = _key(first, row, near, row + 1, bounds, truth)
    before = _key(first, row - 1, 1 - near, row + 1, bounds, truth)
    if kind == program.FALL:
        now = (-now[0], -now[1])
    else:
        before = (-before[0], -before[1])
    if _is_less(before, now):
        return row - 1, 1 - near
    return row, near


@compiled
def _window(node: Ints, row: int, extent: Extent) -> tuple[int, int]:
    """Give first and last row; the first row beyond the trace stands for all of them."""
    known = extent.known
    begin, end = 0, known
    if node[program.HAS_WINDOW]:
        begin, end = node[program.FROM_ROW], node[program.TO_ROW]
    elif node[program.IS_START] and not extent.is_cut:
        end = extent.last
    return min(row + begin, known), min(row + end, known)


@compiled
def _look_back(node: Ints, row: int) -> tuple[int, int]:
    """Give first and last row that an operator reads before a row; below 0 there is none."""
    if node[program.KIND] == program.PREVIOUS:
        return row - 1, row - 1
    if node[program.HAS_WINDOW]:
        return max(row - node[program.TO_ROW], 0), row - node[program.FROM_ROW]
    return 0, row


@compiled
def _temporal(  # noqa: PLR0913, PLR0917 - a kernel
    sign: float, first: int, begin: int, end: int, side: int, known: int, state: State
) -> int:
    """Find the earliest row that decides: the least, or with the sign -1 the largest."""
    bounds, truth = state.bounds, state.truth
    found = begin
    best = (math.inf, math.inf)
    for row in range(begin, end + 1):
        key = _key(first, row, side, known, bounds, truth)
        signed = (sign * key[0], sign * key[1])
        if _is_less(signed, best):
            best, found = signed, row
    return found


@compiled
def _until(  # noqa: PLR0913, PLR0917 - a kernel
    first: int, second: int, row: int, begin: int, end: int, side: int, known: int, state: State
) -> tuple[int, int]:
    """Find the part and row that decide an ``until``."""
    bounds, truth = state.bounds, state.truth
    held = (math.inf, math.inf)
    held_row = -1
    best = (-math.inf, -math.inf)
    earliest_node = latest_node = second
    earliest_row = latest_row = begin
    has_best = False
    for k in range(row, end + 1):
        key = _key(second, k, side, known, bounds, truth)
        if k >= begin:
            node, place = second, k
            if held_row >= 0 and not _is_less(key, held):
                key, node, place = held, first, held_row
            if not has_best or _is_less(best, key):
                has_best = True
                best = key
                earliest_node, earliest_row = node, place
                latest_node, latest_row = node, place
            elif best[0] == key[0] and best[1] == key[1]:
                latest_node, latest_row = node, place
        left = _key(first, k, side, known, bounds, truth)
        if held_row < 0 or _is_less(left, held):
            held, held_row = left, k
    # In a tie, a row that was too late shows what had been broken before it.
    if best[0] > 0.0:
        return earliest_node, earliest_row
    return latest_node, latest_row


@compiled
def _since(  # noqa: PLR0913, PLR0917 - a kernel
    first: int, second: int, row: int, oldest: int, newest: int, side: int, state: State
) -> tuple[int, int]:
    """Find the part and row that decide a ``since``: of several, the latest."""
    bounds, truth = state.bounds, state.truth
    held = best = (math.inf, math.inf)
    held_row = -1
    found_node, found_row = second, newest
    has_best = False
    for k in range(row, oldest - 1, -1):
        if k <= newest:
            key = _key(second, k, side, row + 1, bounds, truth)
            node, place = second, k
            if held_row >= 0 and not _is_less(key, held):
                key, node, place = held, first, held_row
            if not has_best or _is_less(best, key):
                has_best = True
                best, found_node, found_row = key, node, place
        left = _key(first, k, side, row + 1, bounds, truth)
        if held_row < 0 or _is_less(left, held):
            held, held_row = left, k
    return found_node, found_row


@compiled
def _read(
    node: Ints, limits: Floats, values: Floats, flags: Bytes, row: int, numbers: Floats
) -> int:
    """Write value, threshold and difference of a predicate at a row; return the status."""
    numbers[2] = numbers[3] = numbers[4] = math.nan
    kind = node[program.KIND]
    if kind > program.WORD:
        # At row 0 an edge is false by definition, and nothing lies before: nothing is measured.
        return _BEFORE if kind >= program.PREVIOUS else 0
    first, second = node[program.FIRST_PART], node[program.SECOND_PART]
    if (flags[first, row] | flags[second, row]) & 1:
        return _NOT_APPLICABLE
    value, threshold = values[node[program.VALUE], row], values[node[program.THRESHOLD], row]
    if kind == program.WORD:
        numbers[2] = value
        numbers[3] = limits[program.CODE] if limits[program.CODE] >= 0.0 else threshold
        return 0
    numbers[2] = value if math.isfinite(value) else math.nan
    numbers[3] = threshold if math.isfinite(threshold) else math.nan
    if kind != program.COMPARE:
        # What is equal or not has no distance that anybody would keep.
        return 0
    # A conflict beyond the cap is none, however far beyond.
    difference = parted(values[first, row] - values[second, row], limits[program.SLACK])
    numbers[4] = min(max(difference, limits[program.LOWER_CAP]), limits[program.UPPER_CAP])
    return 0 if numbers[4] == difference else _NO_CONFLICT
