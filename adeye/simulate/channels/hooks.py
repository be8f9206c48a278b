"""Faults inside the built-in channels: objects forgotten, the map shifted, parts frozen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.road import position
from adeye.signals import OK, Bools, ControlCommand, Floats
from adeye.simulate.channels.perception.pose import POSE_D, POSE_S, POSE_STAMP, POSE_X, POSE_Y
from adeye.simulate.channels.perception.tracks import TRACK_HITS

if TYPE_CHECKING:
    from adeye.simulate.channels.perception.step import Perception

TRACKS_LOST: Final = "tracks_lost"
PLANNER_FROZEN: Final = "planner_frozen"
MAP_SHIFTED: Final = "map_shifted"
MONITORS_FROZEN: Final = "monitors_frozen"
HOOKS: Final = (TRACKS_LOST, PLANNER_FROZEN, MAP_SHIFTED)
SAFETY_HOOKS: Final = (*HOOKS, MONITORS_FROZEN)
"""Of the safety channel, which has monitors beside."""


class Hooks:
    """The faults inside one channel, and where they are present; nowhere at first."""

    def __init__(self) -> None:
        self._active: dict[str, Bools] = {}
        self._offset: Floats = np.zeros(0)
        self._pose: Floats | None = None
        self._last: ControlCommand | None = None

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Take in where a fault is present from now on, see ``ports.HookedChannel``."""
        self._active[hook] = active.copy()
        if hook == MAP_SHIFTED:
            self._offset = size.copy()

    def before(self, seen: Perception) -> None:
        """Give the pose back what it is without the shift, so that the filter goes on with it."""
        if self._pose is not None:
            seen.pose[:] = self._pose
            self._pose = None

    def after(self, seen: Perception) -> None:
        """Disturb what the channel has perceived at this tick, before it decides."""
        lost = self._active.get(TRACKS_LOST)
        if lost is not None and lost.any():
            seen.tracks[lost, :, TRACK_HITS] = 0.0
            seen.shown[lost] = np.nan
        shifted = self._active.get(MAP_SHIFTED)
        if shifted is None or not shifted.any():
            return
        self._pose = seen.pose.copy()
        for run in np.flatnonzero(shifted & seen.running & (seen.pose[:, POSE_STAMP] >= 0.0)):
            pose = seen.pose[run]
            # A map that lies to the left puts the ego to the right of where it is on it.
            pose[POSE_D] -= self._offset[run]
            x, y, _ = position(seen.segments[run], pose[POSE_S], pose[POSE_D])
            pose[POSE_X], pose[POSE_Y] = x, y

    def answer(self, command: ControlCommand) -> ControlCommand:
        """Return what the channel says: of a frozen planner its last command, and that it is ok.

        Args:
            command: What it has decided at this tick; perception and its tracks go on.
        """
        frozen = self._active.get(PLANNER_FROZEN)
        if frozen is not None and frozen.any():
            last = self._last
            command.acceleration[frozen] = 0.0 if last is None else last.acceleration[frozen]
            command.steering_angle[frozen] = 0.0 if last is None else last.steering_angle[frozen]
            self._set_status(command, frozen)
            for name in ("plan", "candidates", "candidate_costs", "chosen"):
                rows, before = getattr(command, name), getattr(last, name, None)
                if rows is not None:
                    nothing = -1 if name == "chosen" else np.nan
                    rows[frozen] = nothing if before is None else before[frozen]
        self._last = command
        return command

    def _set_status(self, command: ControlCommand, frozen: Bools) -> None:
        command.status[frozen] = OK


class SafetyHooks(Hooks):
    """The faults inside a safety channel: its monitors and its planner fail apart from each other.

    While the planner is frozen, the monitors go on, and with them status and requests; while the
    monitors are, the planner goes on.

    Attributes:
        monitors_frozen: (B,) where the monitors stay as they were.
    """

    def __init__(self, runs: int) -> None:
        """Begin without a fault.

        Args:
            runs: B.
        """
        super().__init__()
        self.monitors_frozen: Bools = np.zeros(runs, dtype=np.bool_)

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Take in where a fault is present from now on, see ``ports.HookedChannel``."""
        super().inject(hook, active, size)
        if hook == MONITORS_FROZEN:
            self.monitors_frozen = active.copy()

    def _set_status(self, command: ControlCommand, frozen: Bools) -> None:
        """Leave the status: it is that of the monitors."""
