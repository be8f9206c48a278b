"""A second implementation of encounters in the plane: by the hull of the differences of corners.

Two boxes of fixed heading touch where their difference, a convex polygon, holds the origin. It
moves as the second box does past the first: contact and nearest passing are those of a point that
goes the other way along a ray. Without the product, which works with separating axes.
"""

import math
from typing import NamedTuple

import numpy as np

INF = math.inf
Point = tuple[float, float]


class Box(NamedTuple):
    x: float
    y: float
    heading: float
    length: float
    width: float

    def corners(self) -> list[Point]:
        c, s = math.cos(self.heading), math.sin(self.heading)
        return [
            (self.x + c * a - s * b, self.y + s * a + c * b)
            for a in (-0.5 * self.length, 0.5 * self.length)
            for b in (-0.5 * self.width, 0.5 * self.width)
        ]


def cross(o: Point, a: Point, b: Point) -> float:
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])


def hull(points: list[Point]) -> list[Point]:
    """Corners of the convex hull, counter-clockwise (two chains over the sorted points)."""
    ordered = sorted(set(points))

    def chain(some: list[Point]) -> list[Point]:
        kept: list[Point] = []
        for point in some:
            while len(kept) >= 2 and cross(kept[-2], kept[-1], point) <= 0.0:
                kept.pop()
            kept.append(point)
        return kept[:-1]

    return chain(ordered) + chain(ordered[::-1])


def difference(first: Box, second: Box) -> list[Point]:
    return hull([(q[0] - p[0], q[1] - p[1]) for p in first.corners() for q in second.corners()])


def edges(polygon: list[Point]) -> list[tuple[Point, Point]]:
    return list(zip(polygon, polygon[1:] + polygon[:1], strict=True))


def to_segment(point: Point, a: Point, b: Point) -> float:
    dx, dy = b[0] - a[0], b[1] - a[1]
    square = dx * dx + dy * dy
    share = ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / square if square > 0.0 else 0.0
    share = min(1.0, max(0.0, share))
    return math.hypot(point[0] - a[0] - share * dx, point[1] - a[1] - share * dy)


def distance(first: Box, second: Box) -> float:
    """Distance of two boxes, 0 where they overlap."""
    polygon = difference(first, second)
    if all(cross(a, b, (0.0, 0.0)) >= 0.0 for a, b in edges(polygon)):
        return 0.0
    return min(to_segment((0.0, 0.0), a, b) for a, b in edges(polygon))


def ttc(first: Box, second: Box, rate: Point) -> float:
    """First t >= 0 at which the point -rate t is inside of every edge of the difference."""
    enter, leave = 0.0, INF
    for a, b in edges(difference(first, second)):
        inside = cross(a, b, (0.0, 0.0))
        change = -((b[0] - a[0]) * rate[1] - (b[1] - a[1]) * rate[0])
        if change == 0.0:
            if inside < 0.0:
                return INF
        elif change > 0.0:
            enter = max(enter, -inside / change)
        else:
            leave = min(leave, -inside / change)
    return enter if enter <= leave else INF


def closest(first: Box, second: Box, rate: Point) -> tuple[float, float]:
    """Time and distance of the closest encounter, the earliest among equals."""
    time = ttc(first, second, rate)
    if time < INF:
        return time, 0.0
    best = (distance(first, second), 0.0)
    square = rate[0] * rate[0] + rate[1] * rate[1]
    if square == 0.0:
        return best[1], best[0]
    for x, y in difference(first, second):
        # Where the corner passes nearest to the origin.
        time = max(0.0, -(x * rate[0] + y * rate[1]) / square)
        apart = math.hypot(x + rate[0] * time, y + rate[1] * time)
        if apart < best[0] - 1e-12 or (abs(apart - best[0]) <= 1e-12 and time < best[1]):
            best = (apart, time)
    return best[1], best[0]


def worst_ttc(d: Point, rate: Point, reach: float, acceleration: float) -> float:
    """First positive root of (reach + a t^2 / 2)^2 = (d + v t)^2, a polynomial of degree four."""
    if math.hypot(*d) <= reach:
        return 0.0
    a, b, c = (
        rate[0] * rate[0] + rate[1] * rate[1],
        d[0] * rate[0] + d[1] * rate[1],
        d[0] * d[0] + d[1] * d[1],
    )
    quartic = [0.25 * acceleration**2, 0.0, reach * acceleration - a, -2.0 * b, reach**2 - c]
    slope = np.polyder(np.array(quartic))
    found = []
    for root in np.roots(quartic):
        if abs(root.imag) > 1e-4 * abs(root) or root.real <= 0.0:
            continue
        time = float(root.real)
        for _ in range(4):
            steep = float(np.polyval(slope, time))
            time -= float(np.polyval(quartic, time)) / steep if steep != 0.0 else 0.0
        if abs(room(time, d, rate, reach, acceleration)) <= 1e-9 * math.sqrt(c):
            found.append(time)
    return min(found, default=INF)


def room(time: float, d: Point, rate: Point, reach: float, acceleration: float) -> float:
    """What separates the growing circles at a time [m]."""
    apart = math.hypot(d[0] + rate[0] * time, d[1] + rate[1] * time)
    return apart - reach - 0.5 * acceleration * time * time
