"""The picture of a comparison: cost against failing test cases, with the front of what to choose.

Places only, in a box of ``WIDTH`` by ``HEIGHT``; the template writes them as SVG.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.report.words import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.comparison import Candidate, Comparison

WIDTH: Final = 560.0
HEIGHT: Final = 300.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 24.0, 24.0, 46.0
_TICKS: Final = 5
_LINE: Final = 15.0
_LETTER: Final = 7.0
"""Room of a label: height of a line and width of a letter."""


@dataclass(frozen=True, slots=True)
class Dot:
    """One architecture.

    Attributes:
        name: Its id.
        x: To the right.
        y: Downwards.
        style: ``front`` or ``behind``.
        is_gate: Whether it decides the exit code: drawn as a square.
        label_x: Where its name begins or ends.
        label_y: Baseline of its name.
        anchor: ``start`` or ``end``.
        title: What it says when it is pointed at.
    """

    name: str
    x: float
    y: float
    style: str
    is_gate: bool
    label_x: float
    label_y: float
    anchor: str
    title: str


@dataclass(frozen=True, slots=True)
class Tick:
    """A line of the grid with its number."""

    at: float
    text: str


@dataclass(frozen=True, slots=True)
class Front:
    """The picture.

    Attributes:
        dots: Architectures.
        steps: Points of the line along those that no other beats in cost and failures.
        columns: Ticks of the cost.
        rows: Ticks of the failing cases.
    """

    dots: tuple[Dot, ...]
    steps: str
    columns: tuple[Tick, ...]
    rows: tuple[Tick, ...]


def draw_front(comparison: Comparison) -> Front | None:
    """Place the architectures; None if one has no cost, because then there is no place for it."""
    items = comparison.candidates
    costs = [item.cost.total for item in items if item.cost is not None]
    if len(costs) < len(items):
        return None
    losses = [float(item.failing + item.undecided) for item in items]
    cost_ticks = ticks(min(costs), max(costs))
    loss_ticks = ticks(0.0, max(losses), whole=True)

    def right(cost: float) -> float:
        return _place(cost, cost_ticks, _LEFT, WIDTH - _RIGHT)

    def down(loss: float) -> float:
        return _place(loss, loss_ticks, HEIGHT - _BOTTOM, _TOP)

    places = [(right(cost), down(loss)) for cost, loss in zip(costs, losses, strict=True)]
    best = _staircase(list(zip(costs, losses, strict=True)))
    steps: list[tuple[float, float]] = []
    for cost, loss in best:
        if steps:
            steps.append((right(cost), steps[-1][1]))
        steps.append((right(cost), down(loss)))
    return Front(
        dots=_dots(items, places),
        steps=" ".join(f"{x:.1f},{y:.1f}" for x, y in steps),
        columns=tuple(Tick(right(value), f"{value:,g}") for value in cost_ticks),
        rows=tuple(Tick(down(value), f"{value:,g}") for value in loss_ticks),
    )


def ticks(low: float, high: float, *, whole: bool = False) -> list[float]:
    """Choose round numbers that enclose a range.

    Args:
        low: Least value.
        high: Greatest value.
        whole: Whether only whole numbers make sense.

    >>> ticks(0.0, 33.0, whole=True)
    [0.0, 10.0, 20.0, 30.0, 40.0]
    >>> ticks(5.0, 5.0)
    [4.0, 5.0, 6.0]
    """
    if high <= low:
        return [low, low + 1.0] if low == 0.0 else [low - 1.0, low, low + 1.0]
    raw = (high - low) / (_TICKS - 1)
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(size * power for size in (1.0, 2.0, 5.0, 10.0) if size * power >= raw)
    step = max(1.0, step) if whole else step
    first = math.floor(low / step)
    return [step * (first + at) for at in range(math.ceil(high / step - first) + 1)]


def _place(value: float, marks: Sequence[float], begin: float, end: float) -> float:
    return begin + (end - begin) * (value - marks[0]) / (marks[-1] - marks[0])


def _staircase(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Keep what no other point beats, from cheap to dear."""
    kept: list[tuple[float, float]] = []
    for point in sorted(points):
        if not kept or point[1] < kept[-1][1]:
            kept.append(point)
    return kept


def _dots(items: Sequence[Candidate], places: Sequence[tuple[float, float]]) -> tuple[Dot, ...]:
    taken: list[tuple[float, float, float]] = []
    dots = []
    for item, (x, y) in zip(items, places, strict=True):
        length = _LETTER * len(item.id)
        is_left = x + length + 12.0 > WIDTH
        begin = x - 8.0 - length if is_left else x + 8.0
        # Above the dot, because the line of the front leaves it to the right.
        label_y = _free(taken, begin, begin + length, y - 8.0)
        taken.append((begin, begin + length, label_y))
        cost = 0.0 if item.cost is None else item.cost.total
        state = "on the front" if item.is_on_front else f"dominated by {item.dominated_by}"
        dots.append(
            Dot(
                name=item.id,
                x=x,
                y=y,
                style="front" if item.is_on_front else "behind",
                is_gate=item.is_gate,
                label_x=x - 8.0 if is_left else x + 8.0,
                label_y=label_y,
                anchor="end" if is_left else "start",
                title=f"{item.id}: cost {cost:,g}, {counted(item.failing + item.undecided)} of "
                f"{counted(item.cases)} test cases fail or are undecided, {state}",
            )
        )
    return tuple(dots)


def _free(
    taken: Sequence[tuple[float, float, float]], begin: float, end: float, wanted: float
) -> float:
    """Find the line nearest to the wanted one where a label covers no other and stays inside."""
    offsets = [0.0]
    for step in range(1, len(taken) + 2):
        offsets += [-step * _LINE, step * _LINE]
    for offset in offsets:
        y = wanted + offset
        clear = all(
            end < other[0] or begin > other[1] or abs(y - other[2]) >= _LINE for other in taken
        )
        if clear and _LINE <= y <= HEIGHT - _BOTTOM + 4.0:
            return y
    return wanted
