"""When runs end: at contact, after horizon and tail, or a tail after the goal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.jit import compiled
from adeye.kernel.relation import AT_LEAST, compares
from adeye.spec.clock import ticks

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints


class Ending:
    """Keeps which runs have ended, and up to which row their obligations may start.

    Attributes:
        running: (B,) which runs have not ended.
        arrived: (B,) which egos have reached their goal within the horizon.
    """

    def __init__(self, *, step: float, horizon: float, tail: float, goal: Floats) -> None:
        """Start with every run running.

        Args:
            step: Master clock [s].
            horizon: Obligations start within it [s].
            tail: What is simulated after it, and after the goal [s].
            goal: (B,) place along the road where the ego is to arrive [m], inf for none.

        Raises:
            SpecError: Horizon or tail is no whole number of steps.
        """
        self._horizon = ticks(horizon, step, "horizon")
        self._tail = ticks(tail, step, "tail")
        self._goal = goal
        self.running: Bools = np.ones(goal.shape, dtype=np.bool_)
        self.arrived: Bools = np.zeros(goal.shape, dtype=np.bool_)
        self._contact: Bools = np.zeros(goal.shape, dtype=np.bool_)
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
            contact,
            self.running,
            self.arrived,
            self._contact,
            self._horizon_row,
        )

    @property
    def ended(self) -> Bools:
        """Runs that have ended (B,)."""
        return ~self.running

    @property
    def horizon_row(self) -> Ints:
        """Last row at which an obligation may start (B,): horizon, goal or contact."""
        return self._horizon_row

    @property
    def complete(self) -> Bools:
        """Runs that ended by goal or horizon, not by contact (B,)."""
        return ~self.running & ~self._contact


@compiled
def end_runs(  # noqa: PLR0913, PLR0917 - a kernel
    tick: int,
    tail: int,
    ego_s: Floats,
    goal: Floats,
    contact: Ints,
    running: Bools,
    arrived: Bools,
    touched: Bools,
    horizon_row: Ints,
) -> None:
    """End the runs that end at a tick.

    Args:
        tick: Number of the tick.
        tail: Ticks that are simulated after the horizon and after the goal.
        ego_s: (B,) place of the ego along the road [m].
        goal: (B,) where it is to arrive [m], inf for nowhere.
        contact: (B,) object that the ego touches, -1 for none.
        running: (B,) in and out.
        arrived: (B,) in and out.
        touched: (B,) whether a run has ended by contact, in and out.
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
            touched[run] = True
            horizon_row[run] = min(horizon_row[run], tick)
            running[run] = False
        elif tick >= horizon_row[run] + tail:
            running[run] = False
