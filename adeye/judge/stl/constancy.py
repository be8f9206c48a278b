"""Parts of a formula whose truth does not depend on their signals: they ask for nothing.

A row of a trace is in a *state*: which cell of its line every number lies in, the line being cut
where it is compared; which word every other signal is; and whether each operator holds that reads
other rows. All states are listed, and those taken out that no row can be in: by the ranges of the
numbers, by what an operator says about its own row, and because the rows that it speaks of are in a
state, too. What comes out alike in all that are left does so on every trace.

Fewer are taken out than could be, and nothing is said where there are too many: so a part is never
called constant on doubt. Every sum of signals has a line of its own, whatever the others are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

import numpy as np

from adeye.judge.stl import syntax
from adeye.judge.stl.formula import TRUTH_LABELS
from adeye.spec.plausible import farthest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.judge.stl.syntax import Condition, Node, Term
    from adeye.signals import Bools, Ints, SignalType

# --- Parts of a formula whose truth does not depend on their signals: they ask for nothing --------

Sum: TypeAlias = dict[str, Fraction]
"""What each signal is multiplied by, and a number that is added, by an empty name."""
Line: TypeAlias = tuple[tuple[str, Fraction], ...]
"""A sum of signals by itself, of which the first, by name, counts once."""
Range: TypeAlias = tuple[Fraction, Fraction]

_MOST_STATES, _MOST_STEPS = 2**14, 2**20
"""Up to which all are listed; and what is done at most to take some out by what other rows are."""
_FAR, _BEYOND, _END = Fraction(10**1000), Fraction(10**2000), Fraction(10**3000)
"""Signals lie before the first; what nothing plausible reaches counts as the second."""
_ZERO, _ONE = Fraction(0), Fraction(1)
_TIME: Final[Line] = (("time", _ONE),)


def range_of(signal: SignalType, lasts_s: float = math.inf) -> Range:
    """Give the least and the largest value that a number can have in runs that last so long."""
    most = math.inf if signal.most is None else signal.most
    most *= lasts_s if signal.most_per == "s" else 1.0
    low = -_FAR if signal.least is None else Fraction(repr(signal.least))
    return low, Fraction(repr(most)) if most < math.inf else _FAR


def first_constant(
    node: Node, labels: Mapping[str, Sequence[str]], ranges: Mapping[str, Range]
) -> tuple[Node, bool] | None:
    """Find a part that always or never holds, whatever numbers and words its signals have.

    Signals range over all numbers that are not known to be beyond them, ``time`` from 0 on. What
    depends on a value is never found.

    Args:
        node: The formula's root.
        labels: What the signals can be that are no numbers.
        ranges: The least and the largest that those can be of which it is known.

    Returns:
        The first such part, innermost, and whether it always holds; None if there is none.
    """
    for child in syntax.children(node):
        if (found := first_constant(child, labels, ranges)) is not None:
            return found
    is_word = isinstance(node, syntax.Equality) and syntax.label_of(node) is not None
    if is_word or isinstance(node, syntax.Constant | syntax.Signal | syntax.Arithmetic):
        return None
    held = _truths(node, labels, ranges)
    return (node, held.pop()) if len(held) == 1 else None


def asks_nothing(node: Condition, signals: Mapping[str, SignalType]) -> bool:
    """Tell whether a formula asks nothing of a run without any object.

    What is measured of objects is put in as it is without any. Where what is left comes out alike
    on every trace, whatever the other signals are, nothing was asked.

    Args:
        node: The formula's root.
        signals: Those of such a run, by name.
    """
    ranges: dict[str, Range] = {}
    labels: dict[str, Sequence[str]] = {}
    for name in syntax.names_in(node):
        item = signals[name]
        ranges[name] = range_of(item)
        if item.of_objects:
            ranges[name] = (_ZERO, _ZERO) if item.cap is None else (_BEYOND, _BEYOND)
        if item.kind != "number":
            labels[name] = (item.labels or TRUTH_LABELS)[: 1 if item.of_objects else None]
    is_about = any(signals[name].of_objects for name in ranges)
    return is_about and len(_truths(node, labels, ranges)) == 1


def _truths(
    node: Node, labels: Mapping[str, Sequence[str]], ranges: Mapping[str, Range]
) -> set[bool]:
    """List what a condition can be; nothing if there are too many states."""
    states = _states(node, labels, ranges)
    return set() if states is None else set(states.truth(node)[states.are_left()].tolist())


# --- The cells of lines ---------------------------------------------------------------------------


def _plus(one: Sum, other: Sum, factor: Fraction | int = 1) -> Sum:
    names = {*one, *other}
    found = {name: one.get(name, _ZERO) + factor * other.get(name, _ZERO) for name in names}
    return {name: weight for name, weight in found.items() if weight}


def _place(found: Sum) -> tuple[Line, Fraction, int]:
    """Give the line of a sum, where on it the sum is 0, and its sign beyond."""
    lead = next((found[name] for name in sorted(found) if name), _ONE)
    line = tuple(sorted((name, weight / lead) for name, weight in found.items() if name))
    return line, -found.get("", _ZERO) / lead, 1 if lead > 0 else -1


@dataclass
class _Lines:
    """The lines of a part of a formula.

    Attributes:
        cuts: Where they are cut.
        known: The ranges of some, for what their terms are.
    """

    cuts: dict[Line, set[Fraction]] = field(default_factory=dict)
    known: dict[Line, Range] = field(default_factory=dict)

    def difference(self, node: syntax.Comparison | syntax.Equality) -> Sum:
        """Give the left side without the right one."""
        left, right = (
            {"": _BEYOND if side.value > 0.0 else -_BEYOND}
            if isinstance(side, syntax.Constant) and abs(side.value) > farthest(side.exponents)
            else self._sum(side)
            for side in (node.left, node.right)
        )
        return _plus(left, right, -1)

    def cells(self, line: Line) -> list[int]:
        """List the cells of a line that its range leaves; 1 is the first place where it is cut."""
        (low, high), (least, most) = self._range(dict(line)), self.known.get(line, (-_END, _END))
        low, high = max(low, least), min(high, most)
        places = sorted([-_END, *self.cuts[line], *self.cuts[line], _END])
        return [
            cell
            for cell, (begin, end) in enumerate(pairwise(places))
            if (begin < high and low < end) or low <= begin == end <= high
        ]

    def _range(self, found: Sum) -> Range:
        """Give the least and the largest value of a sum."""
        ends = [found.get("", _ZERO)] * 2
        for name, weight in found.items():
            if name:
                own = self.known.get(((name, _ONE),), (-_FAR, _FAR))
                low, high = sorted(weight * end for end in own)
                ends = [ends[0] + low, ends[1] + high]
        return ends[0], ends[1]

    def _sum(self, term: Term) -> Sum:
        if isinstance(term, syntax.Constant):
            return {"": Fraction(repr(term.value))}
        own = {syntax.canonical(term): _ONE}
        if isinstance(term, syntax.Signal):
            return own
        parts = [self._sum(part) for part in term.operands]
        first, last = parts[0], parts[-1]
        match term.operator:
            case "+" | "-" | "negate":
                first = {} if term.operator == "negate" else first
                return _plus(first, last, 1 if term.operator == "+" else -1)
            case "*" if last.keys() <= {""} or first.keys() <= {""}:
                factor, other = (last, first) if last.keys() <= {""} else (first, last)
                return _plus({}, other, factor.get("", _ZERO))
            case "/" if last.keys() == {""}:
                return _plus({}, first, 1 / last[""])
        self.known[_place(own)[0]] = self._known_of(term.operator, own, parts)
        return own

    def _known_of(self, operator: str, own: Sum, parts: list[Sum]) -> Range:
        """Give the range of a term that is no sum; say how far it is from those it is one of."""
        if operator in {"*", "/"}:
            low, high = map(self._range, (parts[0], parts[-1]))
            signs = [(ends[0] >= 0) - (ends[1] <= 0) for ends in (low, high)]
            sign = 1 if operator == "*" and parts[0] == parts[-1] else signs[0] * signs[1]
            return -_FAR if sign < 1 else _ZERO, _FAR if sign > -1 else _ZERO
        parts = [*parts, _plus({}, parts[0], -1), {}] if operator == "abs" else parts
        choose = min if operator == "min" else max
        for part in parts:
            line, place, sign = _place(_plus(own, part, -1))
            is_above = (choose is max) is (sign > 0)
            self.known[line] = (place, _END) if is_above else (-_END, place)
        low, high = zip(*map(self._range, parts), strict=True)
        return choose(low), choose(high)


# --- The states of a row, and those that the rows around it leave ---------------------------------

_ENDLESS: Final = (0.0, math.inf)
_NOW: Final = (0.0, 0.0)
_ROW_BEFORE: Final = (math.inf, math.inf)
"""Windows: the row before is within no window for sure but that without end."""
_ONE_ROW, _EVERY_ROW = False, True
_OF_ALL: Final = {"always", "historically"}
_ORDERS: Final = {"<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal}


class _Said(NamedTuple):
    """What an operator says about rows.

    Attributes:
        meant: (S,) states of which it says that they are in one.
        is_of_all: Whether it says so of all rows of a window, else of one.
        window: Where they lie [s].
        is_back: Whether they lie before.
    """

    meant: Bools
    is_of_all: bool
    window: tuple[float, float]
    is_back: bool = True


@dataclass
class _States:
    """The states of the rows that a part of a formula reads, S of them.

    Attributes:
        lines: On which its numbers lie.
        of: (S,) by line its cell, by signal its word, by operator whether it holds.
        others: The operators that read other rows.
    """

    lines: _Lines
    of: Mapping[str | Line, NDArray[Any]]
    others: Sequence[Condition]

    def truth(self, node: Node) -> Bools:
        """Tell in which states (S,) a condition holds."""
        match node:
            case syntax.Comparison():
                held = _ORDERS[node.operator](self._beyond(node), 0)
            case syntax.Equality():
                left, right = syntax.canonical(node.left), syntax.canonical(node.right)
                if left in self.of:
                    held = self.of[left] == (syntax.label_of(node) or self.of[right])
                else:
                    held = self._beyond(node) == 0
                held = held != node.is_negated
            case syntax.Assertion():
                held = self.of[node.name] == "true"
            case syntax.Not():
                held = ~self.truth(node.operand)
            case syntax.Connective():
                left_held, held = self.truth(node.left), self.truth(node.right)
                left_held = ~left_held if node.operator == "implies" else left_held
                held = left_held & held if node.operator == "and" else left_held | held
            case _:
                held = self.of[syntax.canonical(node)]
        return np.asarray(held)

    def _beyond(self, node: syntax.Comparison | syntax.Equality) -> Ints:
        """Give the sign (S,) of the difference between two sides."""
        line, place, sign = _place(self.lines.difference(node))
        at = 2 * sorted(self.lines.cuts[line]).index(place) + 1
        return np.asarray(np.sign(self.of[line] - at) * sign)

    def are_left(self) -> Bools:
        """Tell which states (S,) a row can be in, as far as is looked at."""
        left = np.ones(len(next(iter(self.of.values()))), dtype=np.bool_)
        held = [self.truth(node) for node in self.others]
        said = [[self._said(node, is_held=way) for way in (False, True)] for node in self.others]
        for truth, ways in zip(held, said, strict=True):
            for is_held, items in enumerate(ways):
                for item in items:
                    if item.is_of_all and item.window[0] == 0.0:
                        left &= (truth != is_held) | item.meant
        # Of a state, this much decides what is said of other rows.
        time: Ints = self.of.get(_TIME, np.zeros(left.shape, dtype=np.int64))
        kinds, kind = np.unique(np.stack([time, *held]), axis=1, return_inverse=True)
        if not self.others or kinds.shape[1] * left.size > _MOST_STEPS:
            return left
        # Every run has begun.
        start = _Said(time == time.min(), _ONE_ROW, _ENDLESS)
        before = -1
        while before != (before := int(left.sum())):
            for number in np.unique(kind[left]).tolist():
                now, *truths = kinds[:, number].tolist()
                own = [ways[is_held] for ways, is_held in zip(said, truths, strict=True)]
                if not _is_answered([start, *chain.from_iterable(own)], left, time, now):
                    left &= kind != number
        return left

    def _said(self, node: Condition, *, is_held: bool) -> list[_Said]:
        """List what an operator says about rows where it holds, or does not."""
        window, parts = syntax.window_of(node), [*map(self.truth, syntax.children(node))]
        ends = _ENDLESS if window is None else (window.first_s, window.last_s)
        is_back, meant = isinstance(node, syntax.LOOKING_BACK), parts[-1]
        match node:
            case syntax.Temporal() | syntax.Past():
                is_of_all = (node.operator in _OF_ALL) is is_held
                return [_Said(meant == is_held, is_of_all, ends, is_back)]
            case syntax.Previous():
                # There is a row before for sure where it held there.
                there = [_Said(meant, _ONE_ROW, _ROW_BEFORE)] * is_held
                return [_Said(meant == is_held, _EVERY_ROW, _ROW_BEFORE), *there]
            case syntax.Edge() if is_held:
                now = meant == (node.operator == "rise")
                return [_Said(now, _EVERY_ROW, _NOW), _Said(~now, _ONE_ROW, _ROW_BEFORE)]
            case syntax.Until() | syntax.Since() if is_held:
                there = [_Said(meant, _ONE_ROW, ends, is_back)]
                return [_Said(parts[0] | meant, _EVERY_ROW, _NOW), *there]
            case syntax.Until() | syntax.Since() if ends[0] == 0.0:
                return [_Said(~meant, _EVERY_ROW, _NOW)]
        return []


def _is_answered(items: Sequence[_Said], left: Bools, time: Ints, now: int) -> bool:
    """Tell whether each row that is spoken of can be in a state.

    Args:
        items: What is said about them.
        left: (S,) states that a row can be in.
        time: (S,) their cell of time.
        now: That of the row.
    """
    for item in items:
        # Time never stands still: no two rows lie at one place of its line.
        latest = now - now % 2 if item.window == _ROW_BEFORE else now
        found = left & item.meant & ((time <= latest) if item.is_back else (time >= now))
        for other in items:
            is_around = other.window[0] <= item.window[0] and item.window[1] <= other.window[1]
            if other.is_of_all and other.is_back is item.is_back and is_around:
                found = found & other.meant
        if not (item.is_of_all or found.any()):
            return False
    return True


def _states(
    node: Node, labels: Mapping[str, Sequence[str]], ranges: Mapping[str, Range]
) -> _States | None:
    """List the states of the rows that a part of a formula reads; None if they are too many."""
    known: dict[Line, Range] = {((name, _ONE),): ends for name, ends in ranges.items()}
    lines, parts = _Lines(known=known), list(syntax.walk(node))
    for part in parts:
        are_words = all(name in labels for name in syntax.names_in(part))
        if isinstance(part, syntax.Comparison) or (
            isinstance(part, syntax.Equality) and not are_words
        ):
            line, place, _ = _place(lines.difference(part))
            lines.cuts.setdefault(line, {_ZERO} if line == _TIME else set()).add(place)
    simple = (syntax.Comparison, syntax.Equality, syntax.Assertion, syntax.Not, syntax.Connective)
    others = {
        syntax.canonical(part): part
        for part in parts
        if isinstance(part, syntax.Condition) and not isinstance(part, simple)
    }
    axes: dict[str | Line, Sequence[Any]] = {line: lines.cells(line) for line in lines.cuts}
    axes |= {name: labels[name] for name in syntax.names_in(node) if name in labels}
    axes |= dict.fromkeys(others, (False, True))
    sizes = [len(axis) for axis in axes.values()]
    if not 0 < math.prod(sizes) <= _MOST_STATES:
        return None
    picked = np.indices(sizes).reshape(len(sizes), -1)
    of = {key: np.array(axis)[at] for (key, axis), at in zip(axes.items(), picked, strict=True)}
    return _States(lines, of, tuple(others.values()))
