"""What built-in channels have in common, and the faults inside them.

Those are objects forgotten, the map shifted, parts frozen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.kernel.road import position
from adeye.signals import FAULT, OK, Bools, ControlCommand, Floats, Ints, Observation
from adeye.simulate.channels.perception.pose import POSE_D, POSE_S, POSE_STAMP, POSE_X, POSE_Y
from adeye.simulate.channels.perception.step import Perception, Seen
from adeye.simulate.channels.perception.tracks import TRACK_HITS

if TYPE_CHECKING:
    from adeye.ports import ChannelContext

TRACKS_LOST: Final = "tracks_lost"
PLANNER_FROZEN: Final = "planner_frozen"
MAP_SHIFTED: Final = "map_shifted"
MONITORS_FROZEN: Final = "monitors_frozen"
HOOKS: Final = (TRACKS_LOST, PLANNER_FROZEN, MAP_SHIFTED)
SAFETY_HOOKS: Final = (*HOOKS, MONITORS_FROZEN)
"""Of the safety channel, which has monitors beside."""


class Hooks:
    """The faults inside one channel, and where they are present; nowhere at first.

    The monitors and the planner of a safety channel fail apart from each other. While the planner
    is frozen, the monitors go on, and with them status and requests; while the monitors are, the
    planner goes on.

    Attributes:
        monitors_frozen: (B,) where the monitors stay as they were; (1,) while that is nowhere.
    """

    def __init__(self, *, has_monitors: bool = False) -> None:
        """Begin without a fault.

        Args:
            has_monitors: Whether the status of the channel is that of its monitors.
        """
        self._has_monitors = has_monitors
        self.monitors_frozen: Bools = np.zeros(1, dtype=np.bool_)
        self._active: dict[str, Bools] = {}
        self._offset: Floats = np.zeros(0)
        self._pose: Floats | None = None
        self._last: ControlCommand | None = None

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Take in where a fault is present from now on, see ``ports.HookedChannel``."""
        self._active[hook] = active.copy()
        if hook == MAP_SHIFTED:
            self._offset = size.copy()
        elif hook == MONITORS_FROZEN:
            self.monitors_frozen = self._active[hook]

    def before(self, seen: Seen) -> None:
        """Give the pose back what it is without the shift, so that the filter goes on with it."""
        if self._pose is not None:
            seen.pose[:] = self._pose
            self._pose = None

    def after(self, seen: Seen) -> None:
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
            x, y, _ = position(seen.grounds.segments[run], pose[POSE_S], pose[POSE_D])
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
            if not self._has_monitors:
                command.status[frozen] = OK
            for name in ("plan", "candidates", "candidate_costs", "chosen"):
                rows, before = getattr(command, name), getattr(last, name, None)
                if rows is not None:
                    nothing = -1 if name == "chosen" else np.nan
                    rows[frozen] = nothing if before is None else before[frozen]
        self._last = command
        return command


class Shown(NamedTuple):
    """What a channel weighed up, for pictures; empty where nobody looks.

    Attributes:
        candidates: (B, N, POINTS, 2) places in the map, NaN for what cannot be had.
        costs: (B, N).
        chosen: (B,) which of them it takes, -1 for none.
    """

    candidates: Floats
    costs: Floats
    chosen: Ints


POINTS: Final = 5
"""Places of a candidate that are shown, the first that of the ego."""


class PerceivingChannel:
    """A built-in channel: it perceives, decides and answers, with the faults of its hooks."""

    monitor_ids: tuple[str, ...] = ()
    hooks: tuple[str, ...] = HOOKS

    def _prepare(self, context: ChannelContext, records: Any, candidates: int = 0) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Of the channel.
            records: (B,) see ``driving.channel_records``.
            candidates: How many it weighs up.
        """
        self._channel_id = context.channel_id
        self._hooks = Hooks(has_monitors=MONITORS_FROZEN in self.hooks)
        self._perception = Perception(context, records)
        self._seen = self._perception.seen
        self._command = np.zeros((context.runs, 2))
        self._status = np.full(context.runs, FAULT, dtype=np.int64)
        # Room for so many candidates, in all runs if somebody looks.
        runs = context.runs if context.shows_candidates and candidates else 0
        self._shown = Shown(
            np.full((runs, candidates, POINTS, 2), np.nan),
            np.full((runs, candidates), np.nan),
            np.full(runs, -1, dtype=np.int64),
        )

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Take in where a fault inside the channel is present from now on."""
        self._hooks.inject(hook, active, size)

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation with one command per run."""
        self._hooks.before(self._seen)
        self._read(observation)
        self._hooks.after(self._seen)
        self._decide(observation.time)
        return self._hooks.answer(self._command_at(observation.time))

    def _read(self, observation: Observation) -> None:
        self._perception.update(observation)

    def _decide(self, time: float) -> None:
        raise NotImplementedError

    def _command_at(self, time: float) -> ControlCommand:
        command = ControlCommand(
            self._channel_id,
            self._command[:, 0].copy(),
            self._command[:, 1].copy(),
            np.full(self._status.shape, time),
            self._status.copy(),
            tracks=self._seen.shown.copy(),
        )
        if self._shown.chosen.size:
            command.candidates = self._shown.candidates.copy()
            command.candidate_costs = self._shown.costs.copy()
            command.chosen = self._shown.chosen.copy()
        return command
