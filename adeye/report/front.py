"""The picture of a comparison: cost against failing test cases, with the front of what to choose.

Places only, in a box of ``WIDTH`` by ``HEIGHT``; the template writes them as SVG.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from adeye.report.labels import Box, Label, place_labels
from adeye.report.words import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.comparison import Candidate, Comparison

WIDTH: Final = 560.0
HEIGHT: Final = 300.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 24.0, 24.0, 46.0
_TICKS: Final = 5


@dataclass(frozen=True, slots=True)
class Dot:
    """One architecture.

    Attributes:
        name: Its id.
        x: To the right.
        y: Downwards.
        style: ``front`` or ``behind``.
        is_gate: Whether it decides the exit code: drawn as a square.
        label: Its name and where it stands; None where no room is left for it.
        title: What it says when it is pointed at.
    """

    name: str
    x: float
    y: float
    style: str
    is_gate: bool
    label: Label | None
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

    @property
    def unnamed(self) -> int:
        """How many architectures have no name in the picture."""
        return sum(dot.label is None for dot in self.dots)


def draw_front(comparison: Comparison) -> Front | None:
    """Place the architectures; None if one has no cost or no test case: it has no place then."""
    items = comparison.candidates
    costs = [item.cost.total for item in items if item.cost is not None and item.cases]
    if len(costs) < len(items):
        return None
    losses = [float(item.failing + item.undecided) for item in items]
    cost_ticks = ticks(min(costs), max(costs))
    loss_ticks = ticks(0.0, max(losses), whole=True)

    def right(cost: float) -> float:
        return place(cost, cost_ticks, _LEFT, WIDTH - _RIGHT)

    def down(loss: float) -> float:
        return place(loss, loss_ticks, HEIGHT - _BOTTOM, _TOP)

    places = [(right(cost), down(loss)) for cost, loss in zip(costs, losses, strict=True)]
    best = _staircase(list(zip(costs, losses, strict=True)))
    steps: list[tuple[float, float]] = []
    for cost, loss in best:
        if steps:
            steps.append((right(cost), steps[-1][1]))
        steps.append((right(cost), down(loss)))
    return Front(
        dots=_dots(items, places, steps),
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


def place(value: float, marks: Sequence[float], begin: float, end: float) -> float:
    """Place a value between two ends of an axis with these marks."""
    return begin + (end - begin) * (value - marks[0]) / (marks[-1] - marks[0])


def _staircase(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Keep what no other point beats, from cheap to dear."""
    kept: list[tuple[float, float]] = []
    for point in sorted(points):
        if not kept or point[1] < kept[-1][1]:
            kept.append(point)
    return kept


def _dots(
    items: Sequence[Candidate],
    places: Sequence[tuple[float, float]],
    steps: Sequence[tuple[float, float]],
) -> tuple[Dot, ...]:
    area = Box(_LEFT + 4.0, 2.0, WIDTH - 2.0, HEIGHT - _BOTTOM)
    lines = [
        Box(min(x, right), min(y, down), max(x, right), max(y, down))
        for (x, y), (right, down) in pairwise(steps)
    ]
    labels = place_labels([item.id for item in items], places, area, lines)
    dots = []
    for item, (x, y), label in zip(items, places, labels, strict=True):
        cost = 0.0 if item.cost is None else item.cost.total
        state = "on the front" if item.is_on_front else f"dominated by {item.dominated_by}"
        dots.append(
            Dot(
                name=item.id,
                x=x,
                y=y,
                style="front" if item.is_on_front else "behind",
                is_gate=item.is_gate,
                label=label,
                title=f"{item.id}: cost {cost:,g}, {counted(item.failing + item.undecided)} of "
                f"{counted(item.cases)} test cases fail or are undecided, {state}",
            )
        )
    return tuple(dots)
