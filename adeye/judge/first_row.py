"""What a formula asks of the first row of a run and of no other.

It seems to be about the whole run, and is met by how the run begins. Beside what stands under no
operator of time, that is what an operator over many rows takes from the first of them: what held
``once`` up to every row held at the first one, and it is enough that it did. What parts say only
together is found by ``short_runs``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from adeye.judge.stl import syntax


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
