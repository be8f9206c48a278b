"""Parts of a formula whose truth does not depend on their signals: they ask for nothing."""

from __future__ import annotations

import math
from itertools import product
from typing import TYPE_CHECKING, Final, TypeAlias

from adeye.judge.stl import syntax
from adeye.spec.plausible import farthest

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.judge.stl.syntax import Condition, Node, Term, Window


# --- Parts of a formula whose truth does not depend on their signals: they ask for nothing --------

Interval: TypeAlias = tuple[float, float]

_ANY: Final = (-math.inf, math.inf)
_UNKNOWN: Final = (0, 0, 0)
_NEVER_NEGATIVE: Final = frozenset(
    [
        "time",
        "age",
        "distance",
        "ttc",
        "time_gap",
        "time_headway",
        "mttc",
        "drac",
        "required_deceleration",
    ]
)
"""Last words of the names of signals that are 0 or more, whatever happens."""
_MOST_PARTS: Final = 8
"""Different parts of a condition up to which all ways in which they hold are tried."""


def first_constant(node: Node) -> tuple[Node, bool] | None:
    """Find a part that always or never holds, whatever numbers and truth values its signals have.

    Signals range over all numbers, times and distances over those from 0 on. What depends on a
    value is never found; of what does not, comparisons by the ranges of their terms, equal parts,
    and an answer that its question contains, are.

    Args:
        node: The formula's root.

    Returns:
        The first such part, innermost, and whether it always holds; None if there is none.
    """
    for child in syntax.children(node):
        if (found := first_constant(child)) is not None:
            return found
    held: bool | None = None
    if isinstance(node, syntax.Comparison):
        held = _ordered(node)
    elif isinstance(node, syntax.Equality) and syntax.label_of(node) is None:
        held = _equal(node)
    elif isinstance(node, syntax.Connective):
        held = _joined(node)
    return None if held is None else (node, held)


def _ordered(node: syntax.Comparison) -> bool | None:
    """Tell how a comparison comes out for all numbers, None if that depends on them."""
    low, high = node.left, node.right
    if node.operator in {">", ">="}:
        low, high = high, low
    is_strict = node.operator in {"<", ">"}
    if syntax.canonical(low) == syntax.canonical(high):
        return not is_strict
    is_chosen = _is_among(high, low, "min") or _is_among(low, high, "max")
    (least, below), (above, most) = _limit(low), _limit(high)
    if above == most and math.isinf(above):
        return above > 0.0
    if least == below and math.isinf(below):
        return below < 0.0
    if below < above or (not is_strict and (is_chosen or below == above)):
        return True
    if most < least or (most == least and is_strict):
        return False
    return None


def _is_among(part: syntax.Term, whole: syntax.Term, operator: str) -> bool:
    """Tell whether a term is one of those of which another takes the least or the largest."""
    is_choice = isinstance(whole, syntax.Arithmetic) and whole.operator == operator
    return is_choice and syntax.canonical(part) in map(syntax.canonical, syntax.children(whole))


def _equal(node: syntax.Equality) -> bool | None:
    """Tell how an equality of two terms comes out, None if that depends on them."""
    if syntax.canonical(node.left) == syntax.canonical(node.right):
        return not node.is_negated
    (least, below), (above, most) = _limit(node.left), _limit(node.right)
    return node.is_negated if below < above or most < least else None


def _limit(term: Term) -> Interval:
    """Give the values of a term; a limit that nothing plausible reaches counts as infinite."""
    low, high = _values(term)
    exponents = term.exponents if isinstance(term, syntax.Constant) else _UNKNOWN
    if low == high and abs(low) > farthest(exponents):
        low = high = math.copysign(math.inf, low)
    return low, high


def _values(term: Term) -> Interval:
    """Give the least and the largest value of a term."""
    if isinstance(term, syntax.Constant):
        return term.value, term.value
    if isinstance(term, syntax.Signal):
        last = term.name.rpartition(".")[2]
        return (0.0, math.inf) if last in _NEVER_NEGATIVE else _ANY
    found = _applied(term)
    return _ANY if any(map(math.isnan, found)) else found


def _applied(term: syntax.Arithmetic) -> Interval:
    first, second = term.operands[0], term.operands[-1]
    (low, high), (least, most) = _values(first), _values(second)
    is_same = syntax.canonical(first) == syntax.canonical(second)
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


def _joined(node: syntax.Connective) -> bool | None:
    """Tell how a condition comes out however its parts hold, None if that depends on them."""
    if node.operator == "implies" and _entails(node.left, node.right):
        return True
    parts = sorted(_parts(node))
    if len(parts) > _MOST_PARTS:
        return None
    ways = product((False, True), repeat=len(parts))
    held = {_holds(node, dict(zip(parts, way, strict=True))) for way in ways}
    return held.pop() if len(held) == 1 else None


def _entails(given: Condition, asked: Condition) -> bool:
    """Tell whether a condition holds at each row at which another does, by their form alone.

    What has just begun to hold does so within any time from now: such an answer is never late.
    """
    return (
        syntax.canonical(given) == syntax.canonical(asked)
        or _is_answered(given, asked)
        or any(_entails(part, asked) for part in _parts_that_hold(given))
    )


def _is_answered(given: Condition, asked: Condition) -> bool:
    match asked:
        case syntax.Temporal(operator="eventually") | syntax.Past(operator="once"):
            return _has_now(asked.window) and _entails(given, asked.operand)
        case syntax.Connective(operator="or"):
            return _entails(given, asked.left) or _entails(given, asked.right)
        case syntax.Connective(operator="and"):
            return _entails(given, asked.left) and _entails(given, asked.right)
        case syntax.Connective(operator="implies"):
            return _entails(given, asked.right)
    return False


def _parts_that_hold(given: Condition) -> tuple[Condition, ...]:
    """List what holds at a row at which a condition does."""
    match given:
        case syntax.Edge(operator="rise"):
            return (given.operand,)
        case syntax.Temporal(operator="always") | syntax.Past(operator="historically"):
            return (given.operand,) if _has_now(given.window) else ()
        case syntax.Connective(operator="and"):
            return given.left, given.right
    return ()


def _has_now(window: Window | None) -> bool:
    return window is None or window.first_s == 0.0


def _parts(node: Condition) -> set[str]:
    if isinstance(node, syntax.Connective):
        return _parts(node.left) | _parts(node.right)
    return _parts(node.operand) if isinstance(node, syntax.Not) else {_part(node)[0]}


def _holds(node: Condition, parts: Mapping[str, bool]) -> bool:
    if isinstance(node, syntax.Not):
        return not _holds(node.operand, parts)
    if not isinstance(node, syntax.Connective):
        name, is_plain = _part(node)
        return parts[name] is is_plain
    left, right = _holds(node.left, parts), _holds(node.right, parts)
    if node.operator == "implies":
        return right or not left
    return left and right if node.operator == "and" else left or right


def _part(node: Condition) -> tuple[str, bool]:
    """Name a part without connectives, and tell whether it is what is named or its opposite."""
    if isinstance(node, syntax.Comparison):
        left, right = syntax.canonical(node.left), syntax.canonical(node.right)
        # a <= b is the opposite of b < a.
        is_less = node.operator in {"<", ">="}
        name = f"(< {left} {right})" if is_less else f"(< {right} {left})"
        return name, node.operator in {"<", ">"}
    if isinstance(node, syntax.Equality):
        label = syntax.label_of(node)
        left, right = syntax.canonical(node.left), syntax.canonical(node.right)
        if label in {"true", "false"}:
            return left, (label == "true") is not node.is_negated
        return f"(== {left} {right})", not node.is_negated
    return (node.name if isinstance(node, syntax.Assertion) else syntax.canonical(node)), True
