"""The pictures of faults: the times of the worst runs as bars, and what a parameter trades.

Places only: bars in percent of their width, the curve in a box of ``WIDTH`` by ``HEIGHT``; the
template writes them as SVG.

A label goes as near to its dot as there is room, and is tied to it by a line where it does not
touch. The same dots give the same picture; a dot for whose name there is no room has none.

Places only, in a box of ``WIDTH`` by ``HEIGHT``; the template writes them as SVG.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from adeye.report.comparison.records import Candidate, Comparison
from adeye.report.model.assessment import FaultEvidence, FaultGroup, TradeCurve, WorstInjection
from adeye.report.words import counted, number, quantity
from adeye.signals import Bools, Floats

# --- Names beside dots: no label covers another label or a dot, and none leaves its area ----------

SIZE: Final = 12.0
"""Of the letters."""
RADIUS: Final = 10.0
"""Half of the square that a dot takes, with a gap."""
_ASCENT, _DESCENT = 11.0, 4.0
_LINE: Final = _ASCENT + _DESCENT
_WIDEST_LABEL: Final = 240.0
_NEAR: Final = 6.0
"""A label this far from its dot's square needs no line."""
_STEP_X, _STEP_Y = 8.0, 5.0
_WIDTHS: Final = {
    **dict.fromkeys("bdghnopqu", 0.611),
    **dict.fromkeys("ijl", 0.278),
    **dict.fromkeys("ft-", 0.333),
    "r": 0.389, "z": 0.5, "w": 0.778, "m": 0.889, "\N{HORIZONTAL ELLIPSIS}": 1.0,
    **dict.fromkeys("aceksvxy_0123456789", 0.556),
}  # fmt: skip
"""Widths of letters of Helvetica Bold, by the size; the picture asks for the width of their sum."""
_OTHER_WIDTH: Final = 0.722


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle; y points down."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def row(self) -> tuple[float, float, float, float]:
        """Its four sides."""
        return self.left, self.top, self.right, self.bottom


@dataclass(frozen=True, slots=True)
class Label:
    """A placed name.

    Attributes:
        text: The name, shortened if it is very long.
        box: What it covers.
        leader: Line from the dot to the label (x1, y1, x2, y2); None where it stands beside it.
    """

    text: str
    box: Box
    leader: tuple[float, float, float, float] | None

    @property
    def x(self) -> float:
        """Where the text begins."""
        return self.box.left

    @property
    def y(self) -> float:
        """Baseline of the text."""
        return self.box.top + _ASCENT

    @property
    def width(self) -> float:
        """Length of the text."""
        return self.box.right - self.box.left


def width_of(text: str) -> float:
    """Return the length of a text.

    >>> round(width_of("lidar"), 2)
    25.34
    """
    return SIZE * sum(_WIDTHS.get(letter, _OTHER_WIDTH) for letter in text)


def place_labels(
    names: Sequence[str],
    dots: Sequence[tuple[float, float]],
    area: Box,
    lines: Sequence[Box] = (),
) -> list[Label | None]:
    """Place the names of dots, in their order.

    Args:
        names: N names.
        dots: Their N places.
        area: Where labels may be.
        lines: What labels had better not cover, such as a drawn line.

    Returns:
        N labels; None where there is no room left.
    """
    squares = np.array([(x - RADIUS, y - RADIUS, x + RADIUS, y + RADIUS) for x, y in dots])
    soft = np.array([line.row for line in lines]).reshape(-1, 4)
    placed: list[Label | None] = []
    for name, dot in zip(names, dots, strict=True):
        labels = [item for item in placed if item is not None]
        placed.append(_placed(_shortened(name), dot, area, _Taken.of(squares, soft, labels)))
    return placed


@dataclass(frozen=True, eq=False)
class _Taken:
    """What is in the picture already: boxes (N, 4), and leaders (N, 4) from dots to labels."""

    squares: Floats
    soft: Floats
    labels: Floats
    leaders: Floats

    @classmethod
    def of(cls, squares: Floats, soft: Floats, labels: Sequence[Label]) -> _Taken:
        boxes = np.array([item.box.row for item in labels]).reshape(-1, 4)
        leaders = [item.leader for item in labels if item.leader is not None]
        return cls(squares, soft, boxes, np.array(leaders).reshape(-1, 4))


def _placed(text: str, dot: tuple[float, float], area: Box, taken: _Taken) -> Label | None:
    boxes = _candidates(width_of(text), dot, area)
    x, y = dot
    # The end of the leader: the point of each box that is nearest to the dot.
    ends = np.stack(
        [np.clip(x, boxes[:, 0], boxes[:, 2]), np.clip(y, boxes[:, 1], boxes[:, 3])], axis=1
    )
    reach = np.hypot(ends[:, 0] - x, ends[:, 1] - y)
    order = np.argsort(reach, kind="stable")
    boxes, ends, reach = boxes[order], ends[order], reach[order]
    is_free = ~_overlap(boxes, np.concatenate([taken.squares, taken.labels])).any(axis=1)
    boxes, ends, reach = boxes[is_free], ends[is_free], reach[is_free]
    if not len(boxes):
        return None
    needs_line = reach > RADIUS + _NEAR
    starts = np.broadcast_to(np.array(dot), ends.shape)
    lines = np.concatenate([starts, ends], axis=1)
    others = taken.squares[~_holds(taken.squares, dot)]
    is_crossed = needs_line & _crosses(lines, np.concatenate([taken.labels, others])).any(axis=1)
    is_crossed |= _crosses(taken.leaders, boxes).any(axis=0)
    covers = _overlap(boxes, taken.soft).any(axis=1)
    # The nearest that is best: clear of everything, else not crossed, else at least free.
    best = int(np.argmin(2 * is_crossed + covers))
    left, top, right, bottom = boxes[best].tolist()
    leader = (x, y, float(ends[best, 0]), float(ends[best, 1])) if needs_line[best] else None
    return Label(text, Box(left, top, right, bottom), leader)


def _candidates(width: float, dot: tuple[float, float], area: Box) -> Floats:
    """List the boxes (N, 4) of a label inside the area: around the dot first, then everywhere."""
    x, y = dot
    right, left, centre = x + RADIUS, x - RADIUS - width, x - width / 2.0
    above, below, beside = y - RADIUS - _LINE, y + RADIUS, y - _LINE / 2.0
    around = [
        (right, above), (left, above), (right, below), (left, below),
        (right, beside), (left, beside), (centre, above), (centre, below),
    ]  # fmt: skip
    columns = np.arange(area.left, area.right - width, _STEP_X)
    rows = np.arange(area.top, area.bottom - _LINE, _STEP_Y)
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    corners = np.concatenate([np.array(around), grid])
    boxes = np.concatenate([corners, corners + np.array([width, _LINE])], axis=1)
    is_inside = (
        (boxes[:, 0] >= area.left)
        & (boxes[:, 1] >= area.top)
        & (boxes[:, 2] <= area.right)
        & (boxes[:, 3] <= area.bottom)
    )
    kept: Floats = boxes[is_inside]
    return kept


def _overlap(boxes: Floats, others: Floats) -> Bools:
    """Return which boxes (N, 4) share more than a side with which others (M, 4), as (N, M)."""
    one, other = boxes[:, np.newaxis], others[np.newaxis]
    found: Bools = (
        (one[..., 0] < other[..., 2])
        & (other[..., 0] < one[..., 2])
        & (one[..., 1] < other[..., 3])
        & (other[..., 1] < one[..., 3])
    )
    return found


def _holds(boxes: Floats, point: tuple[float, float]) -> Bools:
    x, y = point
    found: Bools = (boxes[:, 0] <= x) & (x <= boxes[:, 2]) & (boxes[:, 1] <= y) & (y <= boxes[:, 3])
    return found


def _crosses(lines: Floats, boxes: Floats) -> Bools:
    """Return which lines (N, 4) go through which boxes (M, 4), as (N, M).

    Source:
        Kay, Kajiya (1986), "Ray tracing complex scenes": the slabs that bound a box.
    """
    enter = np.zeros((len(lines), len(boxes)))
    leave = np.ones((len(lines), len(boxes)))
    for axis in (0, 1):
        start = lines[:, np.newaxis, axis]
        along = lines[:, np.newaxis, axis + 2] - start
        low, high = boxes[np.newaxis, :, axis], boxes[np.newaxis, :, axis + 2]
        is_still = along == 0.0
        length = np.where(is_still, 1.0, along)
        first, last = (low - start) / length, (high - start) / length
        is_between = (low < start) & (start < high)
        still = np.where(is_between, 0.0, 2.0)
        enter = np.maximum(enter, np.where(is_still, still, np.minimum(first, last)))
        leave = np.minimum(leave, np.where(is_still, 1.0, np.maximum(first, last)))
    found: Bools = enter < leave
    return found


def _shortened(name: str) -> str:
    """Cut a name that would fill the picture."""
    if width_of(name) <= _WIDEST_LABEL:
        return name
    kept = name
    while width_of(kept) + SIZE > _WIDEST_LABEL:
        kept = kept[:-1]
    return f"{kept}\N{HORIZONTAL ELLIPSIS}"


# --- The picture of a comparison: cost against failing test cases, with the front of what to
# choose.

WIDTH: Final = 560.0
HEIGHT: Final = 300.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 24.0, 24.0, 46.0
_TICKS: Final = 5


@dataclass(frozen=True, slots=True)
class Dot:
    """One architecture.

    Attributes:
        x: To the right.
        y: Downwards.
        style: ``front`` or ``behind``.
        is_gate: Whether it decides the exit code: drawn as a square.
        label: Its name and where it stands; None where no room is left for it.
        title: What it says when it is pointed at.
    """

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
    # What no other point beats, from cheap to dear.
    best: list[tuple[float, float]] = []
    for point in sorted(zip(costs, losses, strict=True)):
        if not best or point[1] < best[-1][1]:
            best.append(point)
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


# --- The pictures of faults: the times of the worst runs as bars, and what a parameter trades -----

_WIDEST: Final = 2.5
"""The axis of the bars is at most so many times as long as what has to be seen on it."""
_LEAST: Final = 0.35
"""Least width of a bar [%], so that a short time is not taken for none."""


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a bar, in percent."""

    x: float
    width: float


@dataclass(frozen=True, slots=True)
class Bar:
    """The times of the worst run of a group.

    Attributes:
        group: Whose they are.
        fdti: From the fault to its detection; None without.
        frti: From there to safe state or emergency operation; None without.
        open_from: Where the bar begins that never ends, because nobody detects or handles the
            fault [%]; None if it is handled.
        ftti: Where the tolerated time ends [%]; None where nothing is violated.
        is_cut: Whether it ends beyond the picture.
        is_late: Whether the fault is handled too late or never.
        text: The times in words.
    """

    group: FaultGroup
    fdti: Span | None
    frti: Span | None
    open_from: float | None
    ftti: float | None
    is_cut: bool
    is_late: bool
    text: str


@dataclass(frozen=True, slots=True)
class Bars:
    """All bars on one axis of time."""

    bars: tuple[Bar, ...]
    ticks: tuple[Tick, ...]


def draw_bars(evidence: FaultEvidence) -> Bars | None:
    """Place the times of the worst run of each group whose fault was activated."""
    groups = [group for group in evidence.groups if group.worst.class_ != "not_activated"]
    if not groups:
        return None
    marks = ticks(0.0, _reach([group.worst for group in groups]))
    end = marks[-1]
    shown = tuple(Tick(100.0 * mark / end, f"{mark:g}") for mark in marks)
    return Bars(tuple(_bar(group, end) for group in groups), shown)


def _reach(worst: Sequence[WorstInjection]) -> float:
    """Choose how much time is shown: everything that is handled, and the nearer ends of FTTIs."""
    handled = max((item.fhti_s or item.fdti_s or 0.0 for item in worst), default=0.0)
    tolerated = [item.ftti_s for item in worst if item.ftti_s is not None]
    nearest = min(tolerated, default=0.0)
    reach = max(handled, min(max(tolerated, default=0.0), _WIDEST * max(handled, nearest)))
    return reach or 1.0


def _bar(group: FaultGroup, end: float) -> Bar:
    worst = group.worst

    def at(seconds: float) -> float:
        return 100.0 * seconds / end

    fdti = frti = open_from = None
    if worst.fdti_s is None:
        open_from = 0.0
    else:
        fdti = Span(0.0, max(_LEAST, at(worst.fdti_s)))
        if worst.fhti_s is None:
            open_from = fdti.width
        else:
            frti = Span(fdti.width, max(0.0, at(worst.fhti_s) - fdti.width))
    # What does no harm need not be handled.
    is_open = open_from is not None and worst.class_ != "masked"
    ftti = worst.ftti_s
    return Bar(
        group=group,
        fdti=fdti,
        frti=frti,
        open_from=open_from if is_open else None,
        ftti=None if ftti is None else min(100.0, at(ftti)),
        is_cut=ftti is not None and ftti > end,
        is_late=worst.class_ in {"detected_late", "undetected_violation"},
        text=_times(group),
    )


def _times(group: FaultGroup) -> str:
    worst = group.worst
    named = (("FDTI", worst.fdti_s), ("FRTI", worst.frti_s), ("FHTI", worst.fhti_s))
    known = [f"{name} {quantity(value, 's')}" for name, value in named if value is not None]
    if worst.fdti_s is None:
        known.append("not detected")
    elif worst.fhti_s is None:
        known.append("not handled")
    ftti = "none in the run" if worst.ftti_s is None else quantity(worst.ftti_s, "s")
    return ", ".join([*known, f"FTTI {ftti}"])


@dataclass(frozen=True, slots=True)
class TradeDot:
    """One value of the axis.

    Attributes:
        median: To the right, of the median FDTI; None where no fault was detected.
        worst: To the right, of the largest.
        y: Downwards, of the trips.
        low: Downwards, of the lower end of their interval; None without one.
        high: Of the upper end.
        label: The value of the axis; None where no room is left.
        title: What it says when it is pointed at.
    """

    median: float
    worst: float
    y: float
    low: float | None
    high: float | None
    label: Label | None
    title: str


@dataclass(frozen=True, slots=True)
class TradePicture:
    """The picture of a trade.

    Attributes:
        curve: What is drawn.
        dots: Its points that have a place.
        line: Points of the line along the medians.
        columns: Ticks of the FDTI.
        rows: Ticks of the trips.
        placeless: Values without a place: no fault was detected, or nothing was driven without.
    """

    curve: TradeCurve
    dots: tuple[TradeDot, ...]
    line: str
    columns: tuple[Tick, ...]
    rows: tuple[Tick, ...]
    placeless: tuple[str, ...]


def draw_trade(curve: TradeCurve) -> TradePicture | None:
    """Place the points of a curve; None if fewer than two have a place."""
    known = [
        (point, point.median_fdti_s, point.worst_fdti_s, point.calm.per_hour)
        for point in curve.points
    ]
    placed = [
        (point, median, worst, rate)
        for point, median, worst, rate in known
        if median is not None and worst is not None and rate is not None
    ]
    if len(placed) < 2:
        return None
    columns = ticks(0.0, max(worst for _, _, worst, _ in placed))
    highest = [rate if point.calm.high is None else point.calm.high for point, _, _, rate in placed]
    rows = ticks(0.0, max(highest))

    def right(seconds: float) -> float:
        return place(seconds, columns, _LEFT, WIDTH - _RIGHT)

    def down(rate: float) -> float:
        return place(rate, rows, HEIGHT - _BOTTOM, _TOP)

    places = [(right(median), down(rate)) for _, median, _, rate in placed]
    area = Box(_LEFT + 4.0, 2.0, WIDTH - 2.0, HEIGHT - _BOTTOM)
    spans = [
        Box(right(median), down(rate), right(worst), down(rate))
        for _, median, worst, rate in placed
    ]
    labels = place_labels([point.value for point, *_ in placed], places, area, spans)
    dots = tuple(
        TradeDot(
            median=right(median),
            worst=right(worst),
            y=down(rate),
            low=None if point.calm.low is None else down(point.calm.low),
            high=None if point.calm.high is None else down(point.calm.high),
            label=label,
            title=f"{curve.title} {point.value}: {number(rate)} trips per hour without a fault, "
            f"FDTI {quantity(median, 's')} (median), {quantity(worst, 's')} (worst), "
            f"{point.detected} of {point.faulty} detected",
        )
        for (point, median, worst, rate), label in zip(placed, labels, strict=True)
    )
    with_place = {point.value for point, *_ in placed}
    return TradePicture(
        curve=curve,
        dots=dots,
        line=" ".join(f"{x:.1f},{y:.1f}" for x, y in places),
        columns=tuple(Tick(right(mark), f"{mark:g}") for mark in columns),
        rows=tuple(Tick(down(mark), f"{mark:,g}") for mark in rows),
        placeless=tuple(item.value for item in curve.points if item.value not in with_place),
    )
