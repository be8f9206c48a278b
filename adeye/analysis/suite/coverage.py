"""Which share of each zone is seen, by how many sensors and kinds, and what stays blind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.analysis.suite.geometry import Cells, Zone, cells_of, distance, looks_at, sees
from adeye.analysis.suite.records import BlindBearing, BlindSpot, ZoneCoverage
from adeye.kernel.elementary import sin_cos
from adeye.simulate.world.objects import DEFAULT_SIZES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.analysis.suite.conditions import Condition
    from adeye.analysis.suite.geometry import Reach, View
    from adeye.signals import Bools, Floats

BEARINGS: Final = 24
"""Directions in which the nearest blind place is looked for, every 15 degrees."""

RAY: Final = 150.0
_RAY_STEP: Final = 0.1
"""How far from the body one looks along a direction, and how finely [m]."""

HIDDEN: Final = ("pedestrian", "cyclist", "motorcycle", "car", "van", "truck")
"""Road users that a blind spot may hide whole, the smallest first; they stand along the road."""


@dataclass(frozen=True)
class Look:
    """The cells of all zones as every sensor looks at them, weather aside.

    Attributes:
        zones: The zones.
        cells: Of each zone.
        ends: Of each zone among the points: zone k has ``ends[k]`` to ``ends[k + 1]``.
        away: (S, K) distance of each point from each sensor, infinite where it does not look [m].
        kinds: (S,) kind of each sensor.
    """

    zones: tuple[Zone, ...]
    cells: tuple[Cells, ...]
    ends: tuple[int, ...]
    away: Floats
    kinds: tuple[str, ...]

    def seen(self, reaches: Sequence[Reach]) -> Bools:
        """Tell which sensor detects a target at which point, (S, K).

        Args:
            reaches: From where to where each sensor detects it.
        """
        out = np.zeros(self.away.shape, dtype=np.bool_)
        for row, reach in enumerate(reaches):
            if reach.far > reach.near:
                out[row] = (self.away[row] >= reach.near) & (self.away[row] <= reach.far)
        return out

    def of_zone(self, number: int, values: NDArray[Any]) -> NDArray[Any]:
        """Take the points of one zone from values whose last axis is points."""
        return values[..., self.ends[number] : self.ends[number + 1]]

    def area(self, seen: NDArray[Any]) -> float:
        """Return the area of the points that are true, over all zones [m²]."""
        return sum(
            float(self.of_zone(number, seen).sum()) * cells.cell
            for number, cells in enumerate(self.cells)
        )


def look_of(
    zones: Sequence[Zone],
    size: tuple[float, float],
    views: Mapping[str, View],
    kinds: Sequence[str],
) -> Look:
    """Let every sensor look at every cell once.

    Args:
        zones: The zones.
        size: Length and width of the ego [m].
        views: Sensors by id.
        kinds: Of each sensor.
    """
    cells = tuple(cells_of(zone, *size) for zone in zones)
    points = [item.points for item in cells]
    x = np.concatenate([point[0] for point in points])
    y = np.concatenate([point[1] for point in points])
    ends = (0, *np.cumsum([len(point[0]) for point in points]).tolist())
    away = np.full((len(views), len(x)), np.inf)
    for row, view in enumerate(views.values()):
        away[row] = np.where(looks_at(view, x, y), distance(view, x, y), np.inf)
    return Look(tuple(zones), cells, ends, away, tuple(kinds))


def coverage(look: Look, seen: Bools, target: str, condition: Condition) -> Iterator[ZoneCoverage]:
    """Measure what is seen of each zone.

    Args:
        look: The zones' cells.
        seen: (S, K) which sensor detects the target where.
        target: Its class.
        condition: Weather and light.
    """
    count = seen.sum(axis=0)
    by_kind = {kind: _of_kind(look, seen, kind) for kind in sorted(set(look.kinds))}
    kinds = sum(by_kind.values(), np.zeros(seen.shape[1]))
    for number, (zone, cells) in enumerate(zip(look.zones, look.cells, strict=True)):
        own, own_kinds = look.of_zone(number, count), look.of_zone(number, kinds)
        yield ZoneCoverage(
            zone=zone.id,
            target=target,
            condition=condition.id,
            area_m2=cells.area,
            seen_by_1=_share(own >= 1),
            seen_by_2=_share(own >= 2),
            seen_by_3=_share(own >= 3),
            seen_by_2_kinds=_share(own_kinds >= 2),
            seen_by_kind={kind: _share(look.of_zone(number, by_kind[kind])) for kind in by_kind},
        )


def anybody(seen: Bools) -> Bools:
    """Tell which points at least one of the sensors sees: (S, K) to (K,)."""
    out: Bools = np.logical_or.reduce(seen, axis=0)
    return out


def _of_kind(look: Look, seen: Bools, kind: str) -> Bools:
    rows = [row for row, name in enumerate(look.kinds) if name == kind]
    return anybody(seen[rows])


def _share(which: NDArray[np.bool_]) -> float:
    return float(which.mean()) if which.size else 0.0


def blind_spots(look: Look, seen: Bools, target: str, condition: Condition) -> Iterator[BlindSpot]:
    """Measure what is seen by nobody in each zone; a zone without a blind cell is left out."""
    by_anybody = anybody(seen)
    for number, (zone, cells) in enumerate(zip(look.zones, look.cells, strict=True)):
        blind = np.zeros(cells.inside.shape, dtype=np.bool_)
        blind[cells.inside] = ~look.of_zone(number, by_anybody)
        if blind.any():
            yield BlindSpot(
                zone=zone.id,
                target=target,
                condition=condition.id,
                area_m2=float(blind.sum()) * cells.cell,
                circle_m=_largest_circle(blind, cells),
                hides=_largest_hidden(blind, cells),
            )


def _largest_circle(blind: Bools, cells: Cells) -> float:
    """Diameter of the largest circle inside the blind cells [m], good to one cell."""
    from scipy.ndimage import distance_transform_edt

    # Around the zone nothing is known to be blind, so the circle ends there.
    framed = np.pad(blind, 1)
    depth = distance_transform_edt(framed, sampling=(cells.across, cells.along))
    return max(0.0, 2.0 * float(depth.max()) - max(cells.along, cells.across))


def _largest_hidden(blind: Bools, cells: Cells) -> str:
    """Name the largest road user that stands whole inside the blind cells; empty for none."""
    sums = np.pad(np.cumsum(np.cumsum(blind, axis=0, dtype=np.int64), axis=1), ((1, 0), (1, 0)))
    found = ""
    for kind in HIDDEN:
        length, width, _ = DEFAULT_SIZES[kind]
        columns = int(np.ceil(length / cells.along - 1e-9))
        rows = int(np.ceil(width / cells.across - 1e-9))
        if rows >= sums.shape[0] or columns >= sums.shape[1]:
            continue
        whole = sums[rows:, columns:] - sums[:-rows, columns:] - sums[rows:, :-columns]
        if bool(((whole + sums[:-rows, :-columns]) == rows * columns).any()):
            found = kind
    return found


def blind_bearings(
    views: Sequence[View],
    reaches: Sequence[Reach],
    size: tuple[float, float],
    condition: Condition,
) -> Iterator[BlindBearing]:
    """Find the nearest place that nobody sees in each direction from the body outward.

    Args:
        views: The sensors.
        reaches: Of each for a car.
        size: Length and width of the ego [m].
        condition: Weather and light.
    """
    steps = np.arange(0.5 * _RAY_STEP, RAY, _RAY_STEP)
    for number in range(BEARINGS):
        bearing = 2.0 * np.pi * number / BEARINGS
        bearing -= 2.0 * np.pi if bearing > np.pi else 0.0
        sine, cosine = sin_cos(float(bearing))
        # From the centre of the box to the outline of the body.
        along = 0.5 * size[0] / abs(cosine) if abs(cosine) > 1e-12 else np.inf
        across = 0.5 * size[1] / abs(sine) if abs(sine) > 1e-12 else np.inf
        start = float(min(along, across))
        x, y = (start + steps) * cosine, (start + steps) * sine
        seen = np.zeros(steps.shape, dtype=np.bool_)
        for view, reach in zip(views, reaches, strict=True):
            seen |= sees(view, reach, x, y)
        blind = np.flatnonzero(~seen)
        last = np.flatnonzero(seen)
        yield BlindBearing(
            condition=condition.id,
            bearing_rad=float(bearing),
            blind_from_m=round(_RAY_STEP * int(blind[0]), 3) if len(blind) else None,
            seen_until_m=round(_RAY_STEP * (int(last[-1]) + 1), 3) if len(last) else 0.0,
        )
