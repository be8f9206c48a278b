"""When runs end: at contact, after horizon and tail, a tail after the goal, at the road's end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.jit import compiled
from adeye.kernel.relation import AT_LEAST, compares
from adeye.signals import ROAD_EDGE
from adeye.spec.clock import ticks

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints


class Ending:
    """Keeps which runs have ended, and up to which row their obligations may start.

    Attributes:
        running: (B,) which runs have not ended.
        arrived: (B,) which egos have reached their goal within the horizon.
    """

    def __init__(
        self, *, step: float, horizon: float, tail: float, goal: Floats, road_length: Floats
    ) -> None:
        """Start with every run running.

        Args:
            step: Master clock [s].
            horizon: Obligations start within it [s].
            tail: What is simulated after it, and after the goal [s].
            goal: (B,) place along the road where the ego is to arrive [m], inf for none.
            road_length: (B,) where the road ends [m].

        Raises:
            SpecError: Horizon or tail is no whole number of steps.
        """
        self._horizon = ticks(horizon, step, "horizon")
        self._tail = ticks(tail, step, "tail")
        self._goal = goal
        self._road_length = road_length
        self.running: Bools = np.ones(goal.shape, dtype=np.bool_)
        self.arrived: Bools = np.zeros(goal.shape, dtype=np.bool_)
        self._cut_short: Bools = np.zeros(goal.shape, dtype=np.bool_)
        self._horizon_row: Ints = np.full(goal.shape, self._horizon, dtype=np.int64)

    def update(self, tick: int, ego_s: Floats, contact: Ints) -> None:
        """End the runs that end at a tick.

        Args:
            tick: Number of the tick.
            ego_s: (B,) place of the ego along the road [m].
            contact: (B,) object that the ego touches, -1 for none.
        """
        # Scenes keep the array of their tick.
        self.running = self.running.copy()
        end_runs(
            tick,
            self._tail,
            ego_s,
            self._goal,
            self._road_length,
            contact,
            self.running,
            self.arrived,
            self._cut_short,
            self._horizon_row,
        )

    @property
    def ended(self) -> Bools:
        """Runs that have ended (B,)."""
        return ~self.running

    @property
    def horizon_row(self) -> Ints:
        """Last row at which an obligation may start (B,): horizon, goal, contact, road's end."""
        return self._horizon_row

    @property
    def complete(self) -> Bools:
        """Runs that ended by goal or horizon, not by contact or the end of the road (B,)."""
        return ~self.running & ~self._cut_short


@compiled
def end_runs(  # noqa: PLR0913, PLR0917 - a kernel
    tick: int,
    tail: int,
    ego_s: Floats,
    goal: Floats,
    road_length: Floats,
    contact: Ints,
    running: Bools,
    arrived: Bools,
    cut_short: Bools,
    horizon_row: Ints,
) -> None:
    """End the runs that end at a tick.

    Args:
        tick: Number of the tick.
        tail: Ticks that are simulated after the horizon and after the goal.
        ego_s: (B,) place of the ego along the road [m].
        goal: (B,) where it is to arrive [m], inf for nowhere.
        road_length: (B,) where the road ends [m]; it begins at 0.
        contact: (B,) object that the ego touches, -1 for none.
        running: (B,) in and out.
        arrived: (B,) in and out.
        cut_short: (B,) whether a run has ended by contact or the end of the road, in and out.
        horizon_row: (B,) in and out.
    """
    for run in range(running.shape[0]):
        if not running[run]:
            continue
        is_there = compares(AT_LEAST, ego_s[run], goal[run], max(abs(ego_s[run]), abs(goal[run])))
        if is_there and tick < horizon_row[run]:
            horizon_row[run] = tick
            arrived[run] = True
        if contact[run] >= 0:
            cut_short[run] = True
            horizon_row[run] = min(horizon_row[run], tick)
            running[run] = False
        elif ego_s[run] > road_length[run] + ROAD_EDGE or ego_s[run] < -ROAD_EDGE:
            # What is true behind the end says nothing about a road.
            cut_short[run] = True
            horizon_row[run] = max(0, min(horizon_row[run], tick - 1))
            running[run] = False
        elif tick >= horizon_row[run] + tail:
            running[run] = False
