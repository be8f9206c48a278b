"""Parts of a formula whose truth does not depend on their signals: they ask for nothing.

From the formula down: a part is asked for at the rows that what encloses it looks at. A consequent
is asked for only where its antecedent held, what stands left of ``until`` only before the row that
fulfils it.
"""

from __future__ import annotations

import math
from itertools import product
from typing import TYPE_CHECKING, Final, TypeAlias

from adeye.judge.stl.operators import is_open_ended
from adeye.judge.stl.program import (
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
from adeye.judge.stl.syntax import (
    Assertion,
    Comparison,
    Connective,
    Constant,
    Equality,
    Not,
    Signal,
    canonical,
    children,
    label_of,
)
from adeye.kernel.jit import compiled

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from adeye.judge.stl.program import State, Tables
    from adeye.judge.stl.syntax import Arithmetic, Condition, Node, Term
    from adeye.signals import Floats, Ints

    Bytes = NDArray[np.int8]

# --- Parts of a formula whose truth does not depend on their signals: they ask for nothing --------

Interval: TypeAlias = tuple[float, float]

_ANY: Final = (-math.inf, math.inf)
FAR: Final = 1e6
"""A limit beyond it, in SI, is one that nothing about a drive reaches: 11 days, 1,000 km."""
_MOST_PARTS: Final = 8
"""Different parts of a condition up to which all ways in which they hold are tried."""


def first_constant(node: Node) -> tuple[Node, bool] | None:
    """Find a part that always or never holds, whatever numbers and truth values its signals have.

    Signals range over all numbers, ``time`` over those from 0 on. What depends on a value is never
    found; of what does not, comparisons by the ranges of their terms, and equal parts, are.

    Args:
        node: The formula's root.

    Returns:
        The first such part, innermost, and whether it always holds; None if there is none.
    """
    for child in children(node):
        if (found := first_constant(child)) is not None:
            return found
    held: bool | None = None
    if isinstance(node, Comparison):
        held = _ordered(node)
    elif isinstance(node, Equality) and label_of(node) is None:
        held = _equal(node)
    elif isinstance(node, Connective):
        held = _joined(node)
    return None if held is None else (node, held)


def _ordered(node: Comparison) -> bool | None:
    """Tell how a comparison comes out for all numbers, None if that depends on them."""
    low, high = node.left, node.right
    if node.operator in {">", ">="}:
        low, high = high, low
    is_strict = node.operator in {"<", ">"}
    if canonical(low) == canonical(high):
        return not is_strict
    (least, below), (above, most) = _limit(low), _limit(high)
    if above == most and math.isinf(above):
        return above > 0.0
    if least == below and math.isinf(below):
        return below < 0.0
    if below < above or (below == above and not is_strict):
        return True
    if most < least or (most == least and is_strict):
        return False
    return None


def _equal(node: Equality) -> bool | None:
    """Tell how an equality of two terms comes out, None if that depends on them."""
    if canonical(node.left) == canonical(node.right):
        return not node.is_negated
    (least, below), (above, most) = _limit(node.left), _limit(node.right)
    return node.is_negated if below < above or most < least else None


def _limit(term: Term) -> Interval:
    """Give the values of a term; one that lies too far counts as infinite."""
    low, high = _values(term)
    if low == high and abs(low) > FAR:
        low = high = math.copysign(math.inf, low)
    return low, high


def _values(term: Term) -> Interval:
    """Give the least and the largest value of a term."""
    if isinstance(term, Constant):
        return term.value, term.value
    if isinstance(term, Signal):
        return (0.0, math.inf) if term.name == "time" else _ANY
    found = _applied(term)
    return _ANY if any(map(math.isnan, found)) else found


def _applied(term: Arithmetic) -> Interval:
    first, second = term.operands[0], term.operands[-1]
    (low, high), (least, most) = _values(first), _values(second)
    is_same = canonical(first) == canonical(second)
    found = {
        "negate": (-high, -low),
        "abs": (max(low, -high, 0.0), max(-low, high)),
        "min": (min(low, least), min(high, most)),
        "max": (max(low, least), max(high, most)),
        "+": (low + least, high + most),
        "-": (0.0, 0.0) if is_same else (low - most, high - least),
    }.get(term.operator)
    if found is not None:
        return found
    is_product = term.operator == "*"
    if not is_product and least <= 0.0 <= most:
        return _ANY
    pairs = [(a, b) for a in (low, high) for b in (least, most)]
    ends = [_times(a, b) if is_product else a / b for a, b in pairs]
    if any(map(math.isnan, ends)):
        return _ANY
    # A square is never negative.
    return max(min(ends), 0.0) if is_same and is_product else min(ends), max(ends)


def _times(left: float, right: float) -> float:
    """Multiply ends of ranges; nothing times what has no end is nothing."""
    return 0.0 if 0.0 in {left, right} else left * right


def _joined(node: Connective) -> bool | None:
    """Tell how a condition comes out however its parts hold, None if that depends on them."""
    parts = sorted(_parts(node))
    if len(parts) > _MOST_PARTS:
        return None
    ways = product((False, True), repeat=len(parts))
    held = {_holds(node, dict(zip(parts, way, strict=True))) for way in ways}
    return held.pop() if len(held) == 1 else None


def _parts(node: Condition) -> set[str]:
    if isinstance(node, Connective):
        return _parts(node.left) | _parts(node.right)
    return _parts(node.operand) if isinstance(node, Not) else {_part(node)[0]}


def _holds(node: Condition, parts: Mapping[str, bool]) -> bool:
    if isinstance(node, Not):
        return not _holds(node.operand, parts)
    if not isinstance(node, Connective):
        name, is_plain = _part(node)
        return parts[name] is is_plain
    left, right = _holds(node.left, parts), _holds(node.right, parts)
    if node.operator == "implies":
        return right or not left
    return left and right if node.operator == "and" else left or right


def _part(node: Condition) -> tuple[str, bool]:
    """Name a part without connectives, and tell whether it is what is named or its opposite."""
    if isinstance(node, Comparison):
        left, right = canonical(node.left), canonical(node.right)
        # a <= b is the opposite of b < a.
        is_less = node.operator in {"<", ">="}
        name = f"(< {left} {right})" if is_less else f"(< {right} {left})"
        return name, node.operator in {"<", ">"}
    if isinstance(node, Equality):
        label = label_of(node)
        left, right = canonical(node.left), canonical(node.right)
        if label in {"true", "false"}:
            return left, (label == "true") is not node.is_negated
        return f"(== {left} {right})", not node.is_negated
    return (node.name if isinstance(node, Assertion) else canonical(node)), True


# --- Compiled: at which rows the parts of a formula are asked for, and where antecedents held
# there.


@compiled
def find_held(  # noqa: PLR0912, C901 - one branch for each operator
    tables: Tables, known: int, last: int, state: State, scope: Bytes, held: Bytes
) -> None:
    """Tell of each nested implication whether its antecedent held where it was asked for.

    Args:
        tables: The formula.
        known: Rows of the run.
        last: Last known row at which an outermost obligation starts.
        state: Of its conditions.
        scope: (N, T) scratch: whether a condition is asked for at a row.
        held: (J,) out.
    """
    nodes, nested, truth, start = tables.nodes, tables.nested, state.truth, state.start
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
                    if kind != IMPLIES or _part_holds(first, k, nodes[node], truth, start):
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
            if scope[node, k] and _part_holds(antecedent, k, nodes[node], truth, start):
                held[place] = 1
                break


@compiled
def _part_holds(part: int, row: int, above: Ints, truth: Bytes, start: Floats) -> bool:
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
