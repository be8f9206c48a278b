"""Lanes along lines made by hand, and vehicles on rails in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from adeye.kernel.strips import DRIVING, SLAB_WIDTH, STRIP_WIDTH
from adeye.kernel.traffic import network as n
from adeye.kernel.traffic import rails as k
from adeye.simulate.traffic.batch import (
    COMFORT_ACCELERATION,
    COMFORT_BRAKING,
    DESIRED_TIME_GAP,
    JAM_GAP,
    SPEED_EXPONENT,
)
from adeye.simulate.world.roads import RUN_OUT, join_segments

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.signals import Floats, Ints

WIDTH = 3.5
"""Of a lane [m]."""


class Strip(NamedTuple):
    """A lane of a slab: its way, d of its edges where the slab begins, and their slopes."""

    right: float
    left: float
    way: float = 1.0
    limit: float = np.inf
    right_slope: float = 0.0
    left_slope: float = 0.0


def lanes(*numbers: int, limit: float = np.inf) -> list[Strip]:
    """Return lanes side by side, of those of one width that are numbered from the right."""
    return [Strip(i * WIDTH, (i + 1) * WIDTH, limit=limit) for i in numbers]


@dataclass(frozen=True)
class Lines:
    """A line and what lies across it.

    Attributes:
        pieces: Length [m] and curvature [1/m] of each.
        slabs: Where each begins [m], and its lanes from the right.
    """

    pieces: Sequence[tuple[float, float]]
    slabs: Sequence[tuple[float, Sequence[Strip]]]

    @property
    def length(self) -> float:
        """Of all pieces [m]."""
        return sum(length for length, _ in self.pieces)

    @property
    def segments(self) -> Floats:
        """The pieces (K, 5) and what they run out into."""
        segments: Floats = np.zeros((1, len(self.pieces) + 1, 5))
        segments[0, :, 3:] = [*self.pieces, (RUN_OUT, 0.0)]
        join_segments(segments)
        return segments[0]

    @property
    def across(self) -> tuple[Floats, Floats]:
        """Slabs (S, 4) and strips (J, 8), see ``kernel.strips``."""
        slabs: Floats = np.zeros((len(self.slabs), SLAB_WIDTH))
        strips: list[tuple[float, ...]] = []
        for row, (begin, members) in zip(slabs, self.slabs, strict=True):
            own = sum(strip.way > 0.0 for strip in members)
            row[:] = begin, len(strips), len(members), own
            for strip in members:
                edges = (strip.right, strip.right_slope, strip.left, strip.left_slope)
                strips.append((DRIVING, strip.way, strip.limit, 0, *edges))
        return slabs, np.array(strips).reshape(-1, STRIP_WIDTH)


class Car(NamedTuple):
    """A vehicle at its start."""

    s: float
    d: float
    speed: float
    desired: float
    way: float = 1.0
    is_changing: bool = True
    length: float = 4.5
    width: float = 1.8
    timer: float = 0.0
    role: int | None = None


def lay(lines: Lines, cars: Sequence[Car], keys: Ints | None = None) -> k.Rails:
    """Lay the rails of a line and put vehicles on them; by default the keys are their numbers."""
    segments, (slabs, strips) = lines.segments, lines.across
    rails = k.Rails(
        np.zeros((len(segments) + 1, k.LINE_WIDTH)),
        np.zeros((len(strips), k.LANE_WIDTH)),
        np.zeros((len(strips), k.ROW_WIDTH)),
        np.zeros((len(cars), k.VEHICLE_WIDTH)),
        np.zeros((len(cars), k.MARK_WIDTH), dtype=np.int64),
    )
    k.lay_line(segments, RUN_OUT, rails.line)
    k.lay_lanes(slabs, strips, lines.length, rails.line, rails.lanes, rails.rows)
    rails.marks[:, n.ORDER] = np.arange(len(cars))
    rails.marks[:, k.KEY] = np.arange(len(cars)) if keys is None else keys
    rails.marks[:, k.BY_KEY] = np.argsort(rails.marks[:, k.KEY])
    for who, car in enumerate(cars):
        vehicle = rails.vehicles[who]
        vehicle[n.LENGTH], vehicle[k.HALF_ACROSS] = car.length, 0.5 * car.width
        vehicle[n.JAM_DISTANCE] = JAM_GAP + car.length
        vehicle[n.TIME_GAP], vehicle[n.EXPONENT] = DESIRED_TIME_GAP, SPEED_EXPONENT
        vehicle[n.GAIN] = COMFORT_ACCELERATION
        vehicle[n.BRAKING] = 2.0 * (COMFORT_ACCELERATION * COMFORT_BRAKING) ** 0.5
        vehicle[n.SPEED], vehicle[n.DESIRED_SPEED] = car.speed, car.desired
        vehicle[n.TIMER] = car.timer
        rails.marks[who, n.ROLE] = n.CHANGING if car.is_changing else n.FOLLOWING
        if car.role is not None:
            rails.marks[who, n.ROLE] = car.role
            aslant = 0.0 if car.way > 0.0 else np.pi
            k.show_thing(rails, who, car.s, car.d, aslant, car.speed)
        elif not k.begin_driver(rails, who, car.s, car.d, car.way):
            msg = f"no lane goes the way of {car}"
            raise ValueError(msg)
    return rails
