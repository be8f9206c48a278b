"""Compiled: at which rows the parts of a formula are asked for, and where antecedents held there.

From the formula down: a part is asked for at the rows that what encloses it looks at. A consequent
is asked for only where its antecedent held, what stands left of ``until`` only before the row that
fulfils it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.evaluation.stl.operators import is_open_ended
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
from adeye.kernel.jit import compiled

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from adeye.signals import Floats, Ints

    Bytes = NDArray[np.int8]


@compiled
def find_held(  # noqa: PLR0913, PLR0917, PLR0912, C901 - one branch for each operator
    nodes: Ints,
    nested: Ints,
    known: int,
    last: int,
    truth: Bytes,
    start: Floats,
    scope: Bytes,
    held: Bytes,
) -> None:
    """Tell of each nested implication whether its antecedent held where it was asked for.

    Args:
        nodes: Of the ``Program``, like ``nested``.
        nested: (J,).
        known: Rows of the run.
        last: Last known row at which an outermost obligation starts.
        truth: (N, 2, T).
        start: (N, 4) states as whole formulas.
        scope: (N, T) scratch: whether a condition is asked for at a row.
        held: (J,) out.
    """
    scope[:] = 0
    scope[nodes.shape[0] - 1, 0] = 1
    for node in range(nodes.shape[0] - 1, -1, -1):
        kind = nodes[node, KIND]
        if kind <= WORD:
            continue
        first, second = nodes[node, FIRST_PART], nodes[node, SECOND_PART]
        if kind in (NOT, AND, OR, IMPLIES):
            for k in range(known):
                if scope[node, k]:
                    scope[first, k] = 1
                    if kind != IMPLIES or _holds(first, k, nodes[node], truth, start):
                        scope[second, k] = 1
        elif kind in (RISE, FALL, PREVIOUS):
            for k in range(1, known):
                if scope[node, k]:
                    scope[first, k - 1] = 1
                    if kind != PREVIOUS:
                        scope[first, k] = 1
        else:
            _ask_over_time(node, nodes[node], known, last, truth, scope)
    for place in range(nested.shape[0]):
        node, held[place] = nested[place], 0
        for k in range(known):
            antecedent = nodes[node, FIRST_PART]
            if scope[node, k] and _holds(antecedent, k, nodes[node], truth, start):
                held[place] = 1
                break


@compiled
def _holds(part: int, row: int, above: Ints, truth: Bytes, start: Floats) -> bool:
    """Tell whether a part of a connective holds, which at the top has no rows."""
    if above[IS_START]:
        return bool(start[part, 2] > 0.0)
    return bool(truth[part, 0, row] > 0)


@compiled
def _ask_over_time(  # noqa: C901, PLR0912 - one branch for each operator
    node: int, what: Ints, known: int, last: int, truth: Bytes, scope: Bytes
) -> None:
    """Mark the rows that the parts of a temporal operator are asked for at."""
    kind, first, second = what[KIND], what[FIRST_PART], what[SECOND_PART]
    done = 0
    for k in range(known):
        if not scope[node, k]:
            continue
        near, far = 0, known
        if what[HAS_WINDOW]:
            near, far = what[FROM_ROW], what[TO_ROW]
        if kind in (EVENTUALLY, ALWAYS, UNTIL):
            begin, end = k + near, min(k + far, known - 1)
            if is_open_ended(what):
                end = last
        else:
            begin, end = max(k - far, 0), k - near
        if kind == UNTIL:
            for j in range(k, end + 1):
                if j >= begin:
                    scope[second, j] = 1
                    if truth[second, 0, j] > 0:
                        break
                scope[first, j] = 1
        elif kind == SINCE:
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
