"""Where the lanes of a graph lie, as rows of points: for pictures of a map and for its checks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from adeye.maps.lanes import LaidRoad, Strip, along, laid, value_at, width_at
from adeye.maps.network import Rows
from adeye.maps.opendrive import Floats

LEAST_POINTS = 9
"""Points of a lane at least, however short."""


class Points(NamedTuple):
    """Points P on the centre lines of lanes, those of one lane one after the other.

    Attributes:
        row: (P,) lane that each is of.
        s: (P,) on its road [m].
        x: (P,) [m].
        y: (P,) [m].
        z: (P,) elevation of the reference line [m].
        heading: (P,) towards greater s [rad].
        curvature: (P,) [1/m].
        width: (P,) [m].
        first: (N,) point of each lane where s is least.
        last: (N,) where it is greatest.
    """

    row: NDArray[np.int64]
    s: Floats
    x: Floats
    y: Floats
    z: Floats
    heading: Floats
    curvature: Floats
    width: Floats
    first: NDArray[np.int64]
    last: NDArray[np.int64]


def strips_of(rows: Rows) -> Iterator[tuple[LaidRoad, Strip]]:
    """Yield where each lane of a graph lies, with its road."""
    # The lanes of a road follow each other, so that it is laid once.
    for name, keys in groupby(rows.keys, itemgetter(0)):
        road = laid(rows.map.roads[name])
        found = {(strip.section, strip.lane.id): strip for item in road.strips for strip in item}
        for key in keys:
            yield road, found[key[1:]]


def points_along(strips: Iterable[tuple[LaidRoad, Strip]], step: float) -> Points:
    """Return points on the centre lines of lanes.

    Args:
        strips: Lanes, with their roads.
        step: Between two of them at most [m].
    """
    columns = []
    for row, (road, strip) in enumerate(strips):
        count = max(int((strip.end - strip.start) / step) + 2, LEAST_POINTS)
        s = np.linspace(strip.start, strip.end, count)
        line = along(road, strip.center, s)
        z = value_at(road.road.elevations, s)[0]
        width = width_at(strip, s)
        of_row = np.full(count, float(row))
        columns.append(
            np.stack((of_row, s, line.x, line.y, z, line.heading, line.curvature, width))
        )
    table = np.concatenate(columns, axis=1) if columns else np.zeros((8, 0))
    row = table[0].astype(np.int64)
    first = np.searchsorted(row, np.arange(len(columns)))
    last = np.append(first[1:], len(row)) - 1
    _, s, x, y, z, heading, curvature, width = table
    return Points(row, s, x, y, z, heading, curvature, width, first, last)
