"""The box of a cluster of returns: its nearest face, and its depth where a side shows it.

Boxes stand along the axes of the vehicle, as those of tracks do. What is measured is the face that
looks at the sensor; a side tells the depth only where its beams are close enough to show its end.
"""

from __future__ import annotations

import math
from typing import Final

from adeye.channels.tracks import CAR_WIDTH
from adeye.kernel.jit import inlined
from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_COLUMNS,
    DETECTION_LENGTH,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    Floats,
    Ints,
)

SLOTS: Final = 32
"""Detections of a sample: the nearest clusters. Four times as many as a channel has tracks."""

_UNKNOWN: Final = -1.0
"""Class of what only its outline is known of."""

_DEEP: Final = 1.0
"""Least depth that a side must show to count [m]: a face that stands aslant shows less."""

_SHARP: Final = 0.5
"""Most that beams may be apart at the end of a side whose depth counts [m]."""

_THIN: Final = 0.5
"""Width below which a deep cluster is a side alone [m]."""

_SIDE_SHARE: Final = 0.25
"""Share of the width, from its nearer edge, in which returns may be of a side."""

Row = tuple[float, float, float, float]
"""Place along and across, length, width of a detection [m]; 0 is unknown."""


@inlined
def fit_box(  # noqa: PLR0913, PLR0917 - a kernel
    mount_x: float,
    mount_y: float,
    spacing: float,
    head: int,
    following: Ints,
    xs: Floats,
    ys: Floats,
    cut: float = 0.0,
) -> Row:
    """Find the box of a cluster of returns.

    Args:
        mount_x: Of the sensor in the vehicle frame [m].
        mount_y: [m].
        spacing: Angle between two beams [rad].
        head: First return of the cluster.
        following: (P,) the next return of the cluster, -1 after the last.
        xs: (P,) places in the vehicle frame [m].
        ys: (P,) [m].
        cut: Where the field of view ends on it: 1 if at its left edge, seen from the sensor, -1 if
            at its right one, 0 if it does not.

    Returns:
        Place along and across, length and width, see ``signals.DETECTION_COLUMNS``.
    """
    low_x = low_y = math.inf
    high_x = high_y = -math.inf
    place = head
    while place >= 0:
        low_x, high_x = min(low_x, xs[place]), max(high_x, xs[place])
        low_y, high_y = min(low_y, ys[place]), max(high_y, ys[place])
        place = following[place]
    # The side of the box that looks at the sensor: 1 if that is its right one, -1 its left one.
    side = 1.0 if low_y > mount_y else (-1.0 if high_y < mount_y else 0.0)
    edge = low_y if side > 0.0 else high_y
    if low_x <= mount_x <= high_x:
        return _beside(side, edge, low_x, high_x, low_y, high_y)
    # Ahead of the sensor the face is the rear one, and depth goes forward; behind it, backward.
    ahead = 1.0 if low_x > mount_x else -1.0
    nearest = low_x if ahead > 0.0 else high_x
    width, depth = high_y - low_y, high_x - low_x
    if cut != 0.0 and width < CAR_WIDTH:
        return _cut_short(nearest, ahead * cut, low_y, high_y)
    if side != 0.0 and depth > _DEEP and width < _THIN:
        # A side alone: its rear is hidden or too far for a beam to meet it.
        middle = edge + side * 0.5 * CAR_WIDTH
        return nearest + 0.5 * ahead * depth, middle, depth, 0.0
    face, deepest = _face(ahead, side, edge, width, head, following, xs, ys)
    away_x, away_y = face - mount_x, 0.5 * (low_y + high_y) - mount_y
    seen = width + spacing * math.sqrt(away_x * away_x + away_y * away_y)
    depth = ahead * (deepest - face)
    # How far apart two beams meet the side at its end.
    off = abs(edge - mount_y)
    end_x = deepest - mount_x
    apart = spacing * (end_x * end_x + off * off)
    if side != 0.0 and depth > _DEEP and apart <= _SHARP * off:
        return face + 0.5 * ahead * depth, 0.5 * (low_y + high_y), depth, seen
    return face, 0.5 * (low_y + high_y), 0.0, seen


@inlined
def _cut_short(nearest: float, towards: float, low_y: float, high_y: float) -> Row:
    """Return the box of what the field of view shows a part of: a car's, from the edge in view.

    A part is no narrow object: a track that took over its width and its middle would leave the
    path of the ego with them.
    """
    middle = low_y + 0.5 * CAR_WIDTH if towards > 0.0 else high_y - 0.5 * CAR_WIDTH
    return nearest, middle, 0.0, 0.0


@inlined
def _beside(
    side: float, edge: float, low_x: float, high_x: float, low_y: float, high_y: float
) -> Row:
    """Return the box of what stands beside the sensor, whose side is its nearest face."""
    width = high_y - low_y
    middle = 0.5 * (low_y + high_y)
    if side != 0.0 and width < _THIN:
        middle, width = edge + side * 0.5 * CAR_WIDTH, 0.0
    return 0.5 * (low_x + high_x), middle, high_x - low_x, width


@inlined
def _face(  # noqa: PLR0913, PLR0917 - a kernel
    ahead: float,
    side: float,
    edge: float,
    width: float,
    head: int,
    following: Ints,
    xs: Floats,
    ys: Floats,
) -> tuple[float, float]:
    """Return where along x the face is, the mean of its returns, and where its side ends [m].

    A mean is not drawn towards the sensor by noise as the nearest return is.
    """
    total, count, nearest = 0.0, 0, math.inf
    deepest = -math.inf
    place = head
    while place >= 0:
        x = ahead * xs[place]
        nearest = min(nearest, x)
        if side == 0.0 or side * (ys[place] - edge) > _SIDE_SHARE * width:
            total += x
            count += 1
        else:
            deepest = max(deepest, x)
        place = following[place]
    face = total / count if count > 0 else nearest
    return ahead * face, ahead * max(deepest, face)


@inlined
def insert_box(count: int, row: Row, thing: int, detections: Floats, source: Ints) -> int:
    """Insert a box into a list by increasing distance; the farthest falls off a full list.

    Args:
        count: How many are in the list.
        row: The box.
        thing: Object behind it.
        detections: (SLOTS, 7) in and out.
        source: (SLOTS,) object behind each, in and out.

    Returns:
        How many are in the list now.
    """
    x, y, length, width = row
    distance = x * x + y * y
    slot = count
    while slot > 0:
        before = detections[slot - 1]
        if before[DETECTION_X] ** 2 + before[DETECTION_Y] ** 2 <= distance:
            break
        slot -= 1
    if slot == SLOTS:
        return count
    for later in range(min(count, SLOTS - 1), slot, -1):
        source[later] = source[later - 1]
        for column in range(len(DETECTION_COLUMNS)):
            detections[later, column] = detections[later - 1, column]
    detections[slot] = 0.0
    detections[slot, DETECTION_X], detections[slot, DETECTION_Y] = x, y
    detections[slot, DETECTION_LENGTH], detections[slot, DETECTION_WIDTH] = length, width
    detections[slot, DETECTION_CLASS] = _UNKNOWN
    source[slot] = thing
    return min(count + 1, SLOTS)
