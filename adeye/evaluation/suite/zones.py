"""The zones around the ego that a suite is asked to see, as polygons cut into cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats

LANE: Final = 3.5
"""Width of a lane [m]. Our choice: between 3.25 m and 3.75 m of German motorways (RAA)."""

FRONT_NEAR: Final = 46.0
FRONT_MID: Final = 90.0
FRONT_FAR: Final = 150.0
"""Where the zones ahead end, from the front [m]: the least forward detection ranges of UN R157 for
60, 100 and 130 km/h."""

SIDE_AHEAD: Final = 46.0
"""How far ahead the lanes beside are looked at for vehicles that cut in [m]. Our choice: as far as
the near zone."""

REAR: Final = 55.0
"""How far back one looks [m]: the least rear detection range of UN R79, 5.6.4.8.1 (03 series
of amendments) for lane changes."""

NEAR_FIELD: Final = 2.0
"""Width of the near field around the body [m]. Our choice: what parking and moving off need."""

_CELLS: Final = 3500.0
"""About how many cells a zone is cut into."""
_FINEST: Final = 0.05
_COARSEST: Final = 0.5


@dataclass(frozen=True, slots=True)
class Zone:
    """A part of the ground around the ego, without what the ego covers itself.

    Attributes:
        id: Its name.
        title: In words.
        target: Class that it is judged for in short tables.
        outline_m: Corners in the vehicle frame, x and y [m].
    """

    id: str
    title: str
    target: str
    outline_m: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Cells:
    """A zone cut into rectangles that are nearly square.

    Attributes:
        along: Edge of a cell along x [m].
        across: Edge of a cell along y [m].
        x: Middles of the columns (N,) [m].
        y: Middles of the rows (M,) [m].
        inside: (M, N) which cells belong to the zone.
    """

    along: float
    across: float
    x: Floats
    y: Floats
    inside: Bools

    @property
    def points(self) -> tuple[Floats, Floats]:
        """Middles of the cells of the zone, x and y (K,)."""
        x, y = np.meshgrid(self.x, self.y)
        return x[self.inside], y[self.inside]

    @property
    def area(self) -> float:
        """Of the zone [m²]."""
        return float(self.inside.sum()) * self.cell

    @property
    def cell(self) -> float:
        """Area of a cell [m²]."""
        return self.along * self.across


def zones_of(length: float, width: float) -> tuple[Zone, ...]:
    """List the zones around a vehicle.

    Args:
        length: Of the vehicle [m].
        width: Of the vehicle [m].
    """
    front, half_lane, far_lane = 0.5 * length, 0.5 * LANE, 1.5 * LANE
    ring = (front + NEAR_FIELD, 0.5 * width + NEAR_FIELD)
    boxes = (
        ("front_near", "ahead, near", front, front + FRONT_NEAR, -half_lane, half_lane),
        ("front_mid", "ahead, mid", front + FRONT_NEAR, front + FRONT_MID, -half_lane, half_lane),
        ("front_far", "ahead, far", front + FRONT_MID, front + FRONT_FAR, -half_lane, half_lane),
        ("front_left", "lane ahead left", front, front + SIDE_AHEAD, half_lane, far_lane),
        ("front_right", "lane ahead right", front, front + SIDE_AHEAD, -far_lane, -half_lane),
        ("side_left", "lane beside left", -front, front, half_lane, far_lane),
        ("side_right", "lane beside right", -front, front, -far_lane, -half_lane),
        ("rear", "behind", -front - REAR, -front, -half_lane, half_lane),
        ("rear_left", "lane behind left", -front - REAR, -front, half_lane, far_lane),
        ("rear_right", "lane behind right", -front - REAR, -front, -far_lane, -half_lane),
        ("near_field", "near field all around", -ring[0], ring[0], -ring[1], ring[1]),
    )
    return tuple(
        Zone(
            name,
            title,
            "pedestrian" if name == "near_field" else "car",
            ((x0, y0), (x1, y0), (x1, y1), (x0, y1)),
        )
        for name, title, x0, x1, y0, y1 in boxes
    )


def cells_of(zone: Zone, length: float, width: float) -> Cells:
    """Cut a zone into cells and leave out those under the ego.

    Args:
        zone: The zone.
        length: Of the ego [m].
        width: Of the ego [m].
    """
    corners = np.array(zone.outline_m)
    low, high = corners.min(axis=0), corners.max(axis=0)
    extent = high - low
    size = float(np.clip(np.sqrt(extent[0] * extent[1] / _CELLS), _FINEST, _COARSEST))
    columns, rows = (max(1, round(float(side) / size)) for side in extent)
    along, across = float(extent[0]) / columns, float(extent[1]) / rows
    x = low[0] + (np.arange(columns) + 0.5) * along
    y = low[1] + (np.arange(rows) + 0.5) * across
    grid_x, grid_y = np.meshgrid(x, y)
    inside = within(corners, grid_x, grid_y)
    inside &= ~((np.abs(grid_x) < 0.5 * length) & (np.abs(grid_y) < 0.5 * width))
    return Cells(along, across, x, y, inside)


def within(corners: Floats, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Tell which points lie inside a polygon, by the number of edges to their right.

    Args:
        corners: (K, 2), in order.
        x: Of the points [m].
        y: Of the points, same shape [m].
    """
    inside = np.zeros(x.shape, dtype=np.bool_)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 == y1:
            continue
        crosses = (y0 <= y) != (y1 <= y)
        inside ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return inside
