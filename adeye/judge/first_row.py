"""What a formula asks of the first row of a run and of no other.

It seems to be about the whole run, and is met by how the run begins. Beside what stands under no
operator of time, that is what an operator over many rows takes from the first of them: what held
``once`` up to every row held at the first one, and it is enough that it did.

What parts of a formula say only together is found by judging every run of a few rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np

from adeye.judge.stl import syntax
from adeye.judge.stl.batch import VIOLATED, evaluate_columns
from adeye.judge.stl.formula import TRUTH_LABELS, Formula
from adeye.judge.stl.series import Series
from adeye.signals import Bools, Ints

# --- What a part asks by itself -------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Rows:
    """The rows of runs at which a part of a formula is read.

    Attributes:
        step: Time between two rows [s].
        end_s: Time of the last row of the longest run [s].
        last_s: Time of the last row at which the part is read [s]; the formula is, at the first.
    """

    step: float
    end_s: float
    last_s: float = 0.0

    @property
    def are_first(self) -> bool:
        """Whether the part is read at the first row and at no other."""
        return syntax.last_row(self.last_s, self.step) == 0

    def of_operand(self, node: syntax.Temporal | syntax.Until) -> Rows:
        """Return the rows at which an operator over later rows reads what it is about."""
        reach = math.inf if node.window is None else node.window.last_s
        return replace(self, last_s=min(self.last_s + reach, self.end_s))

    def are_within(self, node: syntax.Temporal | syntax.Past) -> bool:
        """Tell whether an operator always reads from the first row on, or to the last one."""
        if node.window is None:
            return True
        farthest = self.last_s if isinstance(node, syntax.Past) else self.end_s
        return node.window.first_s <= 0.0 and node.window.last_s >= farthest


def asked_of_first_row(
    node: syntax.Condition, rows: Rows, *, is_asked: bool = True
) -> syntax.Condition | None:
    """Find what is asked of the first row alone.

    What implies something may be about the start: it says of which runs that is asked.

    Args:
        node: The formula, or a part of it.
        rows: At which it is read.
        is_asked: Whether the formula asks for the part, else for its contrary.
    """
    sides: list[tuple[syntax.Condition, bool]]
    match node:
        case syntax.Not():
            sides = [(node.operand, not is_asked)]
        case syntax.Connective(operator="implies"):
            sides = [(node.right, is_asked), *([] if is_asked else [(node.left, True)])]
        case syntax.Connective() | syntax.Since():
            sides = [(node.left, is_asked), (node.right, is_asked)]
        case syntax.Until():
            sides, rows = [(node.left, is_asked), (node.right, is_asked)], rows.of_operand(node)
        case syntax.Temporal() | syntax.Past():
            if _is_settled_at_first(node, rows, is_asked=is_asked):
                return node
            sides = [(node.operand, is_asked)]
            rows = rows.of_operand(node) if isinstance(node, syntax.Temporal) else rows
        case _ if rows.are_first:
            # Of rise, fall and previous nothing more is asked: before the first row is nothing.
            return node
        case syntax.Edge() | syntax.Previous():
            sides = [(node.operand, is_asked)]
        case _:
            return None
    found = (asked_of_first_row(part, rows, is_asked=asked) for part, asked in sides)
    return next((part for part in found if part is not None), None)


def _is_settled_at_first(
    node: syntax.Temporal | syntax.Past, rows: Rows, *, is_asked: bool
) -> bool:
    """Tell whether the first row decides an operator over many rows, or a part of it.

    ``always`` of what once begun goes on holding takes the row that it begins at, as does
    ``eventually`` of what once ended stays so; ``historically`` and ``once`` take the first of all.
    """
    if isinstance(node, syntax.Past):
        if rows.are_first or not rows.are_within(node):
            return False
        read, taken = rows, replace(rows, last_s=0.0)
    else:
        read, taken = rows.of_operand(node), rows
        if read.are_first or (node.window is not None and node.window.first_s > 0.0):
            return False
    is_every = _is_every(node)
    for part, is_held in _parts(node.operand, "and" if is_every else "or"):
        # Of a part that is denied, the contrary goes on.
        if _goes_on(part, read, is_held is is_every) and asked_of_first_row(
            part, taken, is_asked=is_asked is is_held
        ):
            return True
    return False


def _parts(
    node: syntax.Condition, wanted: str, *, is_held: bool = True
) -> Iterator[tuple[syntax.Condition, bool]]:
    """Take apart what is joined by ``and``, or by ``or``, however it is written.

    Yields:
        A part, and whether it has to hold, or not to.
    """
    match node:
        case syntax.Not():
            yield from _parts(node.operand, wanted, is_held=not is_held)
        case syntax.Connective() if ((node.operator == "and") is is_held) is (wanted == "and"):
            left = is_held is not (node.operator == "implies")
            yield from _parts(node.left, wanted, is_held=left)
            yield from _parts(node.right, wanted, is_held=is_held)
        case syntax.Temporal() | syntax.Past() if (_is_every(node) is is_held) is (wanted == "and"):
            for part, is_own in _parts(node.operand, "and" if _is_every(node) else "or"):
                operand = part if is_own else syntax.Not(part.span, part)
                yield replace(node, operand=operand), is_held
        case _:
            yield node, is_held


def _is_every(node: syntax.Temporal | syntax.Past) -> bool:
    return node.operator in {"always", "historically"}


def _goes_on(node: syntax.Condition, rows: Rows, how: bool) -> bool:  # noqa: FBT001 - a truth
    """Tell whether a part that has become true (or false) at one row is so at all that follow."""
    match node:
        case syntax.Not():
            return _goes_on(node.operand, rows, not how)
        case syntax.Connective():
            left = how is not (node.operator == "implies")
            return _goes_on(node.left, rows, left) and _goes_on(node.right, rows, how)
        case syntax.Temporal() | syntax.Past():
            if rows.are_within(node) and how is (node.operator in {"always", "once"}):
                return True
            is_from_here = node.window is None or node.window.first_s <= 0.0
            read = rows.of_operand(node) if isinstance(node, syntax.Temporal) else rows
            return is_from_here and _goes_on(node.operand, read, how)
        case _:
            return False


# --- What parts say together ----------------------------------------------------------------------

_MOST_CELLS: Final = 18
"""Rows times parts of which every choice of truth values is judged."""


def uncounted(root: syntax.Condition, rows: Rows) -> tuple[syntax.Condition, bool] | None:
    """Find a part that counts at the first row alone, or never, for what the other parts say.

    Nothing is found in formulas of many parts, or of windows of very different lengths. What
    implies something may be about the start.

    Args:
        root: The formula.
        rows: At which it is read.

    Returns:
        The part and whether it counts at the first row; None if none is found.
    """
    small = _Small.of(root, rows)
    if small is None:
        return None
    # Where each predicate by itself is too many, what stands under no operator of time is one part.
    for is_part in (_is_predicate, _says_no_time):
        parts = _cut_up(root, is_part)
        names = {text: f"p{number}" for number, text in enumerate(parts)}
        formula = small.rebuilt(root, names)
        every = _EveryRun(tuple(names.values()), small.rows(formula))
        if 0 < len(names) * every.rows <= _MOST_CELLS and _are_apart(parts):
            return _first_uncounted(parts, every.count(formula, small.last))
    return None


_Place = tuple[syntax.Condition, bool]
"""A part of a formula where it stands, and whether it only says when something is asked."""


def _first_uncounted(
    parts: Mapping[str, list[_Place]], counts: Bools
) -> tuple[syntax.Condition, bool] | None:
    for places, at_rows in zip(parts.values(), counts, strict=True):
        part, _ = places[0]
        if at_rows[1:].any() or syntax.names_in(part) == ("time",):
            continue
        if not at_rows[0] or not all(is_condition for _, is_condition in places):
            return part, bool(at_rows[0])
    return None


def _is_predicate(node: syntax.Node) -> bool:
    return isinstance(node, syntax.PREDICATES)


def _says_no_time(node: syntax.Node) -> bool:
    alone = (syntax.Not, syntax.Connective, *syntax.PREDICATES, *syntax.TERMS)
    return all(isinstance(part, alone) for part in syntax.walk(node))


def _cut_up(
    root: syntax.Condition, is_part: Callable[[syntax.Node], bool]
) -> dict[str, list[_Place]]:
    """List parts of a formula by what they say."""
    found: dict[str, list[_Place]] = {}

    def cut(node: Any, *, is_condition: bool) -> None:
        if is_part(node):
            found.setdefault(_said(node)[0], []).append((node, is_condition))
            return
        implies = isinstance(node, syntax.Connective) and node.operator == "implies"
        for place, part in enumerate(syntax.children(node)):
            cut(part, is_condition=is_condition or (implies and place == 0))

    cut(root, is_condition=False)
    return found


def _are_apart(parts: Mapping[str, Sequence[_Place]]) -> bool:
    """Tell whether no predicate is in two of the parts."""
    every = [
        {_said(node)[0] for node in syntax.walk(places[0][0]) if _is_predicate(node)}
        for places in parts.values()
    ]
    return sum(map(len, every)) == len(set[str]().union(*every))


def _said(node: syntax.Node) -> tuple[str, bool]:
    """Write what a part says, in one spelling for each predicate, and whether it denies it."""
    match node:
        case syntax.Comparison():
            left, right = map(syntax.canonical, (node.left, node.right))
            if node.operator in {">", "<="}:
                left, right = right, left
            return f"(< {left} {right})", node.operator in {"<=", ">="}
        case syntax.Equality():
            same = syntax.canonical(replace(node, is_negated=False))
            label = syntax.label_of(node)
            if label not in TRUTH_LABELS:
                return same, node.is_negated
            return syntax.canonical(node.left), node.is_negated is (label == "true")
    return syntax.canonical(node), False


@dataclass(frozen=True, slots=True)
class _EveryRun:
    """Signals of every run of a few rows, a run for each choice of truth values; arrays (B, T)."""

    names: tuple[str, ...]
    rows: int

    def series(self, name: str) -> Series:
        places = self.names.index(name) * self.rows + np.arange(self.rows)
        held = self._numbers[:, np.newaxis] >> places & 1 == 1
        return Series(held, 1.0, "", "boolean")

    def count(self, root: syntax.Condition, horizon: int) -> Bools:
        """Tell of each signal (S) at which rows (T) it decides of some run whether it fails."""
        numbers = self._numbers
        every = np.ones(len(numbers), dtype=np.int64)
        failed = (
            evaluate_columns(
                Formula(
                    syntax.canonical(root), None, root, syntax.names_in(root), float(self.rows)
                ),
                self,
                step_s=1.0,
                length=self.rows * every,
                horizon=horizon * every,
                complete=every == 1,
                chosen=every == 1,
            ).verdict
            == VIOLATED
        )
        cells = range(len(self.names) * self.rows)
        counts = [(failed != failed[numbers ^ (1 << cell)]).any() for cell in cells]
        return np.reshape(counts, (len(self.names), self.rows))

    @property
    def _numbers(self) -> Ints:
        return np.arange(2 ** (len(self.names) * self.rows))


@dataclass(frozen=True, slots=True)
class _Small:
    """A run of few rows, in which the windows of a formula are as long beside one another.

    Attributes:
        unit: Rows of a real run, of which the windows are multiples.
        scale: Rows of the small run for these: more than are looked back at one by one.
        step: Time between the rows of a real run [s].
        end: Last row of a real run.
        last: Last row of the small run at which an obligation may start.
    """

    unit: int
    scale: int
    step: float
    end: int
    last: int = 0

    @classmethod
    def of(cls, root: syntax.Condition, rows: Rows) -> _Small | None:
        """Shrink the runs of a formula; None where a window is open at one end only."""
        nodes, end = list(syntax.walk(root)), syntax.last_row(rows.end_s, rows.step)
        windows = [window for node in nodes if (window := syntax.window_of(node))]
        ends = [syntax.window_rows(window, rows.step) for window in windows]
        if any(first > 0 and last >= end for first, last in ends):
            return None
        unit = math.gcd(*(row for pair in ends if pair[1] < end for row in pair)) or 1
        back = sum(isinstance(node, syntax.Edge | syntax.Previous) for node in nodes)
        whole = cls(unit, min(unit, 1 + back), rows.step, end)
        past = (node for node in nodes if isinstance(node, syntax.Past | syntax.Since))
        reach = sum(found.last_s for node in past if (found := whole.window(node)))
        turns = sum(isinstance(node, syntax.Since | syntax.Until) for node in nodes)
        return replace(whole, last=2 + back + turns + round(reach))

    def rows(self, formula: syntax.Condition) -> int:
        """Count the rows that decide the formula of a small run."""
        needed = syntax.needed_time(formula, self.last)
        return max(self.last, round(min(needed, _MOST_CELLS))) + 1

    def window(self, node: syntax.Node) -> syntax.Window | None:
        """Return the window of an operator; None if it has none, or one over a whole run."""
        window = syntax.window_of(node)
        if window is None:
            return None
        first, last = syntax.window_rows(window, self.step)
        if last >= self.end:
            return None
        return syntax.Window(*(float(row // self.unit * self.scale) for row in (first, last)))

    def rebuilt(self, node: Any, names: Mapping[str, str]) -> Any:
        """Write a formula over parts that have names, with windows of the small run."""
        said, is_denied = _said(node)
        if said in names:
            part = syntax.Assertion(node.span, names[said])
            return syntax.Not(node.span, part) if is_denied else part
        changed = {
            item.name: self.rebuilt(getattr(node, item.name), names)
            for item in fields(node)
            if item.name in {"operand", "left", "right"}
        }
        if syntax.window_of(node) is not None:
            changed["window"] = self.window(node)
        return replace(node, **changed)
