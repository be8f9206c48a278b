"""Abstract syntax of a signal temporal logic formula.

Every node knows its span in the text, so that messages and reports quote what the user wrote.
Values are SI. There are two families: terms, which are numbers at every row of a trace, and
conditions, which hold or do not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, Literal, TypeAlias

from adeye.errors import ExpressionError

# --- Abstract syntax of a signal temporal logic formula -------------------------------------------

ROW_SLACK: Final = 1e-6
"""Part of a step by which a window bound may miss a row, for bounds such as 0.3 s at 0.1 s."""
_MAX_ROWS: Final = float(2**40)
"""Rows beyond the end of any trace, which 64 bits still hold."""

Span: TypeAlias = tuple[int, int]


@dataclass(frozen=True, slots=True)
class _Node:
    """Anything with a place in the text."""

    span: Span


@dataclass(frozen=True, slots=True)
class Constant(_Node):
    """A number in SI with its exponents of length, time and angle.

    Zero without a unit fits every dimension.
    """

    value: float
    exponents: tuple[int, int, int]
    has_unit: bool


@dataclass(frozen=True, slots=True)
class Signal(_Node):
    """The name of a signal, or of a label on the right of ``==``."""

    name: str


@dataclass(frozen=True, slots=True)
class Arithmetic(_Node):
    """An operation on terms; ``negate`` and ``abs`` have one operand, the others two."""

    operator: Literal["+", "-", "*", "/", "min", "max", "abs", "negate"]
    operands: tuple[Term, ...]


Term: TypeAlias = Constant | Signal | Arithmetic


@dataclass(frozen=True, slots=True)
class Comparison(_Node):
    """An order between two terms."""

    operator: Literal["<", "<=", ">", ">="]
    left: Term
    right: Term


@dataclass(frozen=True, slots=True)
class Equality(_Node):
    """Equality of a signal with a label, a truth value or another signal."""

    left: Term
    right: Term
    is_negated: bool


@dataclass(frozen=True, slots=True)
class Assertion(_Node):
    """A boolean signal on its own."""

    name: str


@dataclass(frozen=True, slots=True)
class Not(_Node):
    """Negation."""

    operand: Condition


@dataclass(frozen=True, slots=True)
class Connective(_Node):
    """``and``, ``or`` or ``implies`` between two conditions."""

    operator: Literal["and", "or", "implies"]
    left: Condition
    right: Condition


@dataclass(frozen=True, slots=True)
class Edge(_Node):
    """``rise``: true where the operand begins to hold; ``fall``: where it ceases to."""

    operator: Literal["rise", "fall"]
    operand: Condition


@dataclass(frozen=True, slots=True)
class Window:
    """A closed interval of time after a row, or before it where the operator looks back [s]."""

    first_s: float
    last_s: float


@dataclass(frozen=True, slots=True)
class Temporal(_Node):
    """``always`` or ``eventually`` over a window, or without one."""

    operator: Literal["always", "eventually"]
    window: Window | None
    operand: Condition


@dataclass(frozen=True, slots=True)
class Until(_Node):
    """``left`` holds at every row before one, inside the window, at which ``right`` holds."""

    window: Window | None
    left: Condition
    right: Condition


@dataclass(frozen=True, slots=True)
class Previous(_Node):
    """The operand held one row before; false at the first row."""

    operand: Condition


@dataclass(frozen=True, slots=True)
class Past(_Node):
    """``once`` or ``historically``: at some, or every, row of a window before; back to row 0."""

    operator: Literal["once", "historically"]
    window: Window | None
    operand: Condition


@dataclass(frozen=True, slots=True)
class Since(_Node):
    """``right`` held at a row of the window before, and ``left`` at every row after that one."""

    window: Window | None
    left: Condition
    right: Condition


Predicate: TypeAlias = Comparison | Equality | Assertion
Operator: TypeAlias = Not | Connective | Edge | Temporal | Until | Previous | Past | Since
Condition: TypeAlias = Predicate | Operator
Node: TypeAlias = Term | Condition

TERMS = (Constant, Signal, Arithmetic)
PREDICATES = (Comparison, Equality, Assertion)
LOOKING_BACK = (Previous, Past, Since)


def children(node: Node) -> tuple[Node, ...]:
    """List the direct parts of a node, left to right."""
    match node:
        case Arithmetic(operands=operands):
            return operands
        case Comparison() | Equality() | Connective() | Until() | Since():
            return (node.left, node.right)
        case Not() | Edge() | Temporal() | Previous() | Past():
            return (node.operand,)
        case _:
            return ()


def window_of(node: Node) -> Window | None:
    """Give the window of a temporal operator; None if it has none."""
    return node.window if isinstance(node, Temporal | Until | Past | Since) else None


def label_of(node: Equality) -> str | None:
    """Give the label on the right of an equality: a word without dots is never a signal there."""
    if isinstance(node.right, Signal) and "." not in node.right.name:
        return node.right.name
    return None


def names_in(node: Node) -> tuple[str, ...]:
    """List the signals that a node reads, once each, in the order of the text."""
    match node:
        case Signal(name=name) | Assertion(name=name):
            return (name,)
        case Equality() if label_of(node) is not None:
            return names_in(node.left)
        case _:
            found = (name for child in children(node) for name in names_in(child))
            return tuple(dict.fromkeys(found))


def silence_of(node: Node) -> tuple[str, ...]:
    """List the channels whose failure a formula masters: their silence implies something.

    The silence, or an age beyond a bound, has to stand in what is the condition of an implication,
    at whichever row it comes: then a run exercises the formula only if the channel was silent in
    it. A formula that forbids the silence cannot hold of a run that was judged while it lasted.
    What holds of a silent channel anyway, or once it was not, notices nothing.
    """
    split = (name.split(".") for name in names_in(node))
    channels = dict.fromkeys(
        name[1] for name in split if len(name) == 3 and name[::2] in _OF_SILENCE
    )
    return tuple(channel for channel in channels if _notices(node, channel))


_Truth: TypeAlias = bool | None
"""None where it is open."""
_OF_SILENCE: Final = (["channel", "status"], ["channel", "age"])


def _notices(
    node: Node,
    channel: str,
    *,
    is_asked: bool = True,
    at_any_row: bool = False,
    is_condition: bool = False,
) -> bool:
    """Tell whether a part of a formula asks for something because a channel is silent.

    Args:
        node: The part.
        channel: Id of the channel.
        is_asked: Whether the formula asks for the part; else for its contrary, or for what follows.
        at_any_row: Whether it counts at whichever row the channel is silent.
        is_condition: Whether something is implied by the part.
    """
    if _while_silent(node, channel) is is_asked:
        return False
    same = partial(
        _notices,
        channel=channel,
        is_asked=is_asked,
        at_any_row=at_any_row,
        is_condition=is_condition,
    )
    match node:
        case Comparison() | Equality():
            return is_condition and at_any_row and _while_silent(node, channel) is not None
        case Temporal() | Past():
            is_every = (node.operator in {"always", "historically"}) is is_asked
            # Else one row without silence is enough.
            return (at_any_row or is_every) and same(node.operand, at_any_row=True)
        case Connective(operator="implies"):
            asks = same(node.left, is_asked=not is_asked, at_any_row=True, is_condition=True)
            # Only a condition right behind the condition has to hold for a run to exercise it.
            return asks or (_is_implication(node.right) and same(node.right))
        case Connective(operator="and") if not is_condition:
            # A run exercises the formula already by the other part.
            return same(node.left) and same(node.right)
        case Not() | Edge(operator="fall"):
            is_asked = not is_asked
    return any(same(child, is_asked=is_asked) for child in children(node))


def _is_implication(node: Node) -> bool:
    return isinstance(node, Connective) and node.operator == "implies"


def _while_silent(node: Node, channel: str) -> _Truth:
    """Tell what a part of a formula is as long as a channel is silent; None if that is open."""
    found: _Truth = None
    match node:
        case Equality():
            found = _status_while_silent(node, channel)
        case Comparison():
            found = _age_while_silent(node, channel)
        case Connective():
            left, right = (_while_silent(part, channel) for part in (node.left, node.right))
            if node.operator == "implies":
                left = _contrary(left)
            decides = node.operator != "and"
            if decides in {left, right}:
                found = decides
            elif left is not None and right is not None:
                found = not decides
        case Not(operand=part) | Edge(operator="fall", operand=part):
            found = _contrary(_while_silent(part, channel))
        case Edge() | Temporal() | Past() | Previous():
            found = _while_silent(node.operand, channel)
        case Until() | Since():
            found = _while_silent(node.right, channel) or None
    return found


def _contrary(found: _Truth) -> _Truth:
    return None if found is None else not found


def _status_while_silent(node: Equality, channel: str) -> _Truth:
    if not isinstance(node.left, Signal) or node.left.name != f"channel.{channel}.status":
        return None
    # A channel that failed does not say so; whoever says that it has a fault did not fail.
    is_as_silent = label_of(node) == "silent"
    return is_as_silent is not node.is_negated


def _age_while_silent(node: Comparison, channel: str) -> _Truth:
    age = f"channel.{channel}.age"
    is_left = age in names_in(node.left)
    if not is_left and age not in names_in(node.right):
        return None
    is_above = (node.operator in {">", ">="}) is is_left
    bound = node.right if is_left else node.left
    # No age is below zero, so that `>= 0` and `< 0` tell nothing apart; `> 0` and `<= 0` do.
    is_strict = is_above is ("=" not in node.operator)
    if isinstance(bound, Constant) and not (bound.value > 0 or (bound.value == 0 and is_strict)):
        return None
    return is_above


def future_reach(node: Node, *, is_outermost: bool = True) -> float:
    """Give the time after an obligation's start that its truth may depend on [s].

    An operator without a window ranges over the scenario's horizon where it is outermost, and has
    infinite reach below another temporal operator or an edge.
    """
    match node:
        case Temporal() | Until():
            inner = max(future_reach(child, is_outermost=False) for child in children(node))
            if node.window is not None:
                return node.window.last_s + inner
            return inner if is_outermost else float("inf")
        case Edge() | Previous() | Past() | Since():
            reaches = (
                future_reach(child, is_outermost=False) - back for child, back in read_back(node)
            )
            return max(0.0, *reaches)
        case _:
            parts = (future_reach(child, is_outermost=is_outermost) for child in children(node))
            return max(parts, default=0.0)


def read_back(node: Node) -> Iterator[tuple[Node, float]]:
    """List the parts of a node with the time to the latest row that it reads them at, before [s].

    ``since`` reads what has to hold up to the row itself, whatever its window.
    """
    window = window_of(node) if isinstance(node, Past | Since) else None
    for child in children(node):
        is_held = isinstance(node, Since) and child is node.left
        yield child, 0.0 if window is None or is_held else window.first_s


def first_looking_back(node: Node) -> Node | None:
    """Find an operator that looks back and that no operator which looks ahead encloses.

    It would be evaluated at row 0 alone, before which there is nothing.
    """
    if isinstance(node, LOOKING_BACK):
        return node
    if isinstance(node, Not | Connective | Edge):
        found = (first_looking_back(child) for child in children(node))
        return next((child for child in found if child is not None), None)
    return None


def needed_time(node: Node, horizon_s: float) -> float:
    """Give the length of a trace that decides the formula in every case [s].

    Args:
        node: The formula's root, evaluated at time 0.
        horizon_s: Last time at which an obligation of an outermost operator may start [s].
    """
    if isinstance(node, Temporal | Until):
        if node.window is None:
            return horizon_s + future_reach(node)
        return future_reach(node)
    if isinstance(node, Edge | Previous | Past | Since):
        return future_reach(node)
    return max((needed_time(child, horizon_s) for child in children(node)), default=0.0)


def response_time(node: Node, *, is_due: bool = False, is_negated: bool = False) -> float | None:
    """Give the longest time that a formula leaves for what an implication asks for [s].

    Args:
        node: The formula's root.
        is_due: Whether an implication asks for it.
        is_negated: Whether it asks for the opposite.

    Returns:
        Infinity for ``eventually`` or ``until`` without a window; None where nothing is asked for
        in response to anything. ``not p or q`` is ``p implies q``, ``not always not`` is
        ``eventually``, and what is to hold ``always[2 s, 3 s]`` may come in 2 s.
    """
    sides = [(child, is_due) for child in children(node)]
    if isinstance(node, Connective):
        is_either = node.operator == "or"
        is_answer = node.operator == "implies" or (is_either and isinstance(node.left, Not))
        sides = [
            (node.left, is_due or (is_either and isinstance(node.right, Not))),
            (node.right, is_due or is_answer),
        ]
    turned = is_negated != isinstance(node, Not)
    parts = [response_time(part, is_due=due, is_negated=turned) for part, due in sides]
    found = max((part for part in parts if part is not None), default=None)
    window = window_of(node)
    if is_due and isinstance(node, Temporal | Until):
        late = "always" if is_negated else "eventually"
        if isinstance(node, Until) or node.operator == late:
            return (math.inf if window is None else window.last_s) + (found or 0.0)
        if window is not None and window.first_s > 0.0:
            return window.first_s + (found or 0.0)
    return found


def window_rows(window: Window, step_s: float, row_slack: float = ROW_SLACK) -> tuple[int, int]:
    """Give the first and last row of a window after its start.

    Args:
        window: Closed at both ends.
        step_s: Time between rows [s].
        row_slack: Part of a step by which an end may miss a row.

    Raises:
        ExpressionError: The window lies between two rows and contains none.
    """
    first = math.ceil(min(window.first_s / step_s - row_slack, _MAX_ROWS))
    last = last_row(window.last_s, step_s, row_slack)
    if first > last:
        raise ExpressionError(
            f"the window from {window.first_s:g} s to {window.last_s:g} s contains no row at a "
            f"step of {step_s:g} s",
            remedy="Widen the window or reduce the step.",
        )
    return first, last


def last_row(time_s: float, step_s: float, row_slack: float = ROW_SLACK) -> int:
    """Give the last row up to a time; ends of windows and horizons are turned into rows here."""
    return math.floor(min(time_s / step_s + row_slack, _MAX_ROWS))


Implication = tuple[tuple[Condition, ...], Temporal | None]
"""Antecedents that must hold at one row together, and the operator whose obligations they are."""


def find_implications(root: Condition, operator: Temporal | None = None) -> Iterator[Implication]:
    """Find the implications at the top level, joined by ``and``, of the formula and its always."""
    match root:
        case Connective(operator="and"):
            yield from find_implications(root.left, operator)
            yield from find_implications(root.right, operator)
        case Connective(operator="implies"):
            antecedents = [root.left]
            consequent = root.right
            while isinstance(consequent, Connective) and consequent.operator == "implies":
                antecedents.append(consequent.left)
                consequent = consequent.right
            yield tuple(antecedents), operator
        case Temporal() if operator is None:
            yield from find_implications(root.operand, root)


def told_from(node: Node, first: Callable[[Window], float], *, is_met: bool = True) -> float:
    """Return how far from the beginning a condition may be met by nothing.

    A window that looks back may lie before the first row as a whole. Nothing held in it, so that
    ``historically``, ``not once`` and ``not previous`` are met, and what is met by nothing was not
    tested.

    Args:
        node: The condition.
        first: Gives where a window begins: in rows, so the result is the first row at which the
            condition is met by what was there; in seconds it tells only whether there are others.
        is_met: Whether it is to hold, or not to hold.
    """

    def inner(part: Node, *, is_met: bool = is_met) -> float:
        return told_from(part, first, is_met=is_met)

    window = window_of(node)
    near = float(isinstance(node, Previous)) if window is None else first(window)
    match node:
        case Not():
            return inner(node.operand, is_met=not is_met)
        case Connective(operator="implies"):
            return max(inner(node.left, is_met=not is_met), inner(node.right))
        case Temporal() | Until():
            return max(0.0, max(map(inner, children(node))) - near)
        case Previous() | Past() | Since():
            told = max(map(inner, children(node)))
            is_of_all = isinstance(node, Past) and node.operator == "historically"
            return near + told if told or is_of_all is is_met else 0.0
        case _ if isinstance(node, PREDICATES):
            return 0.0
        case _:
            return max(map(inner, children(node)))


def may_be_met_by_nothing(node: Node) -> bool:
    """Tell whether a condition may be met by a window that lies before the first row."""
    return told_from(node, lambda window: window.first_s) > 0.0


def nested_implications(root: Condition) -> list[Connective]:
    """List the implications below the top level, in the order of the text."""
    outer = {id(part) for parts, _ in find_implications(root) for part in parts}
    return [
        node
        for node in walk(root)
        if isinstance(node, Connective)
        and node.operator == "implies"
        and id(node.left) not in outer
    ]


def walk(node: Node) -> Iterator[Node]:
    """List a node and all parts of it, in the order of the text."""
    yield node
    for child in children(node):
        yield from walk(child)


def without(node: Condition, implications: Collection[int]) -> Condition:
    """Write a formula with the antecedents of some implications in the place of these.

    Where an antecedent never held, its implication is false then instead of true.

    Args:
        node: The formula's root.
        implications: Identities of the nodes.
    """
    if isinstance(node, PREDICATES):
        return node
    if id(node) in implications and isinstance(node, Connective):
        return without(node.left, implications)
    if isinstance(node, Connective | Until | Since):
        left, right = (without(part, implications) for part in (node.left, node.right))
        return replace(node, left=left, right=right)
    return replace(node, operand=without(node.operand, implications))


# --- The one way to write a formula: what it asks for, apart from how it is spelt -----------------


def canonical(node: Node) -> str:
    """Write a node in prefix notation, so that two spellings of one formula come out equal.

    Spaces, redundant parentheses and the names of parameters are gone. Numbers are in SI, as the
    shortest text that reads back: they are not rounded, because a threshold in the last digit
    decides a run that lies on it. A unit is converted with one rounding, so ``100 cm`` is ``1 m``.

    >>> from adeye.judge.stl.formula import parse_formula
    >>> canonical(parse_formula("always[0 s, 500 ms] ((gap)>=100 cm)").root)
    '(always [0.0,0.5] (>= gap 1.0{1,0,0}))'
    """
    match node:
        case Constant(value=value, exponents=exponents):
            # Zero has no sign, as nothing is below the one and not below the other.
            dimension = ",".join(map(str, exponents)) if any(exponents) else ""
            return f"{value + 0.0!r}{{{dimension}}}"
        case Signal(name=name) | Assertion(name=name):
            return name
    window = window_of(node)
    words = [head_of(node)]
    if window is not None:
        words.append(f"[{window.first_s + 0.0!r},{window.last_s + 0.0!r}]")
    words += [canonical(child) for child in children(node)]
    return f"({' '.join(words)})"


def head_of(node: Node) -> str:
    """Name what a node with parts does with them."""
    if isinstance(node, Equality):
        return "!=" if node.is_negated else "=="
    word: str = getattr(node, "operator", type(node).__name__.lower())
    return word
