"""Every run of a few rows: what parts of a formula say together, and whether two say the same.

Each choice of what holds at a few rows is judged, so that what is found is so of all runs. Nothing
is found of formulas of many parts, or whose windows are of very different lengths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np

from adeye.judge.first_row import Rows
from adeye.judge.stl import syntax
from adeye.judge.stl.batch import VIOLATED, evaluate_columns
from adeye.judge.stl.formula import TRUTH_LABELS, Formula
from adeye.judge.stl.series import Series
from adeye.signals import Bools, Ints

_MOST_CELLS: Final = 16
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
    if (short := _shortened((root,), rows)) is None:
        return None
    parts, every, failed = short
    return _first_uncounted(parts, every.count(failed[0]))


def fail_alike(one: syntax.Condition, other: syntax.Condition, rows: Rows) -> bool | None:
    """Tell whether two formulas fail on the same runs; None if that is not found out.

    Args:
        one: A formula.
        other: Another one.
        rows: At which they are read.
    """
    short = _shortened((one, other), rows)
    return None if short is None else bool((short[2][0] == short[2][1]).all())


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


def _shortened(
    roots: Sequence[syntax.Condition], rows: Rows
) -> tuple[dict[str, list[_Place]], _EveryRun, list[Bools]] | None:
    """Judge formulas on every run of a few rows; None if there are too many.

    Returns:
        Their parts, the runs, and on which of these each formula fails.
    """
    if (small := _Small.of(roots, rows)) is None:
        return None
    # Where each predicate by itself is too many, what stands under no operator of time is one part.
    for is_part in (_is_predicate, _says_no_time):
        parts = _cut_up(roots, is_part)
        names = {text: f"p{number}" for number, text in enumerate(parts)}
        formulas = [small.rebuilt(root, names) for root in roots]
        every = _EveryRun(tuple(names.values()), max(map(small.rows, formulas)))
        if 0 < len(names) * every.rows <= _MOST_CELLS and _are_apart(parts):
            return parts, every, [every.failed(formula, small.last) for formula in formulas]
    return None


def _is_predicate(node: syntax.Node) -> bool:
    return isinstance(node, syntax.PREDICATES)


def _says_no_time(node: syntax.Node) -> bool:
    alone = (syntax.Not, syntax.Connective, *syntax.PREDICATES, *syntax.TERMS)
    return all(isinstance(part, alone) for part in syntax.walk(node))


def _cut_up(
    roots: Sequence[syntax.Condition], is_part: Callable[[syntax.Node], bool]
) -> dict[str, list[_Place]]:
    """List parts of formulas by what they say."""
    found: dict[str, list[_Place]] = {}

    def cut(node: Any, *, is_condition: bool) -> None:
        if is_part(node):
            found.setdefault(_said(node)[0], []).append((node, is_condition))
            return
        implies = isinstance(node, syntax.Connective) and node.operator == "implies"
        for place, part in enumerate(syntax.children(node)):
            cut(part, is_condition=is_condition or (implies and place == 0))

    for root in roots:
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

    def failed(self, root: syntax.Condition, horizon: int) -> Bools:
        """Tell of each run (B) whether it fails a formula; obligations start up to the horizon."""
        every = np.ones(len(self._numbers), dtype=np.int64)
        found = evaluate_columns(
            Formula(syntax.canonical(root), None, root, syntax.names_in(root), float(self.rows)),
            self,
            step_s=1.0,
            length=self.rows * every,
            horizon=horizon * every,
            complete=every == 1,
            chosen=every == 1,
        )
        failed: Bools = found.verdict == VIOLATED
        return failed

    def count(self, failed: Bools) -> Bools:
        """Tell of each signal (S) at which rows (T) it decides of some run whether it fails."""
        cells = range(len(self.names) * self.rows)
        counts = [(failed != failed[self._numbers ^ (1 << cell)]).any() for cell in cells]
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
    def of(cls, roots: Sequence[syntax.Condition], rows: Rows) -> _Small | None:
        """Shrink the runs of formulas; None where a window is open at one end only."""
        nodes = [node for root in roots for node in syntax.walk(root)]
        end = syntax.last_row(rows.end_s, rows.step)
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
