"""Names beside dots: no label covers another label or a dot, and none leaves its area.

A label goes as near to its dot as there is room, and is tied to it by a line where it does not
touch. The same dots give the same picture; a dot for whose name there is no room has none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.signals import Bools, Floats

SIZE: Final = 12.0
"""Of the letters."""
RADIUS: Final = 10.0
"""Half of the square that a dot takes, with a gap."""
_ASCENT, _DESCENT = 11.0, 4.0
_LINE: Final = _ASCENT + _DESCENT
_WIDEST: Final = 240.0
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
    """Give the length of a text.

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
    """Tell which boxes (N, 4) share more than a side with which others (M, 4), as (N, M)."""
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
    """Tell which lines (N, 4) go through which boxes (M, 4), as (N, M).

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
    if width_of(name) <= _WIDEST:
        return name
    kept = name
    while width_of(kept) + SIZE > _WIDEST:
        kept = kept[:-1]
    return f"{kept}\N{HORIZONTAL ELLIPSIS}"
