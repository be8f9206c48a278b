"""A straight road of parallel lanes with vehicles on it, in the rows of the traffic kernels."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.kernel.traffic import network as n
from adeye.kernel.traffic.drivers import decide, locate
from adeye.kernel.traffic.network import LANE_WIDTH, build_links, mark_alongside, write_straight

if TYPE_CHECKING:
    from adeye.signals import Floats, Ints

WIDTH = 4.0
LENGTH = 2000.0


@dataclass
class LaneRoad:
    """Lanes 4 m wide along x, lane 0 on the left with its centre at y = 0.

    Attributes:
        count: Number of lanes.
        limit: Speed limit [m/s].
    """

    count: int = 3
    limit: float = np.inf
    rows: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.lanes: Floats = np.zeros((self.count, LANE_WIDTH))
        for number, row in enumerate(self.lanes):
            write_straight(row, 0.0, -WIDTH * number, 0.0, LENGTH, WIDTH, self.limit)
        self.links: Ints = build_links([("a", "b", self.count)])
        mark_alongside(self.lanes, self.links)
        self.vehicles: Floats = np.zeros((0, n.VEHICLE_WIDTH))
        self.marks: Ints = np.zeros((0, n.MARK_WIDTH), dtype=np.int64)

    def put(
        self, lane: int, s: float, speed: float = 20.0, role: int = n.CHANGING, **more: float
    ) -> int:
        """Put a vehicle on a lane and return its number; more are columns by name."""
        row = np.zeros(n.VEHICLE_WIDTH)
        row[[n.X, n.Y, n.SPEED, n.COSINE]] = s, -WIDTH * lane, speed, 1.0
        row[[n.DESIRED_SPEED, n.EXPONENT, n.JAM_DISTANCE, n.TIME_GAP]] = 30.0, 4.0, 10.0, 1.5
        row[[n.GAIN, n.BRAKING]] = 3.0, 2.0 * np.sqrt(15.0)
        row[[n.TOP_SPEED, n.LENGTH]] = np.inf, 5.0
        for name, value in more.items():
            row[getattr(n, name.upper())] = value
        row[n.SINUS], row[n.COSINE] = np.sin(row[n.HEADING]), np.cos(row[n.HEADING])
        who = len(self.vehicles)
        marks = np.array([[lane, lane, role, 0, 0, who, who]])
        self.vehicles = np.vstack([self.vehicles, row])
        self.marks = np.vstack([self.marks, marks])
        locate(self.road, who)
        return who

    @property
    def road(self) -> n.Road:
        """What the kernels take, with new scratch."""
        lists = n.make_lists(self.count, len(self.vehicles))
        return n.Road(self.lanes, self.links, self.vehicles, self.marks, *lists)

    def decide(self) -> None:
        """Let the drivers decide."""
        decide(self.road)
