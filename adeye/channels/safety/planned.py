"""The safety channel with a planner of safe stops."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.channels.driving import MAX_LATERAL
from adeye.channels.safety.channel import SafetyChannel
from adeye.channels.safety.monitors import MONITOR_IDS
from adeye.channels.safety.planner import FOUND_ROW, NO_STOP
from adeye.channels.safety.planning import (
    KEPT_ROW,
    KEPT_STOP,
    POINTS,
    Plans,
    planned_step,
    show_plan,
)
from adeye.channels.safety.supervision import Batch, tell
from adeye.channels.tracks import TRACKS
from adeye.kernel.elementary import tan
from adeye.kernel.jit import compiled
from adeye.kernel.prediction import OBJECT_ROW, WAY_ROW
from adeye.kernel.profiles import (
    PATH_ROW,
    PATH_TARGET,
    PROFILE_ROW,
)
from adeye.kernel.stop_rating import RULE_NAMES
from adeye.kernel.stops import (
    LAID_PATHS,
    LAID_PROFILES,
    STOP_SAMPLES,
    STOPS,
)
from adeye.signals import ControlCommand, Floats, Ints, spec_columns

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.spec.architecture import Vehicle
    from adeye.spec.channels import SafetyParameters

PLANNING: Final = {
    "uncertainty_growth": 0.1,
    "follower_deceleration": 3.0,
    "max_lateral_acceleration": 1.5 * MAX_LATERAL / 1.3,
}
"""Growth of a prediction [m/s], what a stop may ask of who comes from behind and the lateral
acceleration that steering may use, in the end as much as the in-lane stop [m/s²]: those of the
trajectory channel."""


class PlannedSafetyChannel(SafetyChannel):
    """Supervises as ``SafetyChannel`` does, and chooses where and how hard it stops.

    While a monitor is confirmed it follows the stop of the library whose end is rated best. It
    plans at each tick and keeps its choice unless that has become infeasible or clearly worse. One
    monitor more fires when no safe stop would exist once the monitor could be confirmed.
    """

    monitor_ids: tuple[str, ...] = (*MONITOR_IDS, "last_safe_stop")

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        super().reset(context)
        runs = context.runs
        rules = spec_columns(context.parameters, _rules)
        self._rules = np.stack([rules[name] for name in RULE_NAMES], axis=1)
        self._refuges = np.ascontiguousarray(context.road.refuges)
        self._kept = np.zeros((runs, KEPT_ROW))
        self._kept[:, KEPT_STOP] = NO_STOP
        self._driven = np.zeros((runs, PATH_ROW))
        self._driven[:, PATH_TARGET] = np.nan
        self._shows = context.shows_candidates
        shown = runs if self._shows else 0
        self._candidates = np.full((shown, STOPS, POINTS, 2), np.nan)
        self._costs = np.full((shown, STOPS), np.nan)
        self._chosen = np.full(shown, NO_STOP, dtype=np.int64)
        self._scratch = (
            np.zeros((TRACKS, OBJECT_ROW)),
            np.zeros((TRACKS, STOP_SAMPLES, WAY_ROW)),
            np.zeros((LAID_PATHS, PATH_ROW)),
            np.zeros((LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW)),
            np.zeros((STOP_SAMPLES, 2)),
            np.zeros((STOPS, FOUND_ROW)),
        )

    def _fields(self, context: ChannelContext) -> dict[str, Any]:
        rear = spec_columns(context.parameters, lambda item: {"rear_sight": float(item.rear_sight)})
        limits = spec_columns(context.vehicles, _limits)
        return super()._fields(context) | rear | limits | PLANNING

    def _decide(self, time: float) -> None:
        _act(
            self._batch(),
            self._plans(),
            time,
            self._shows,
            self._candidates,
            self._costs,
            self._chosen,
        )

    def _plans(self) -> Plans:
        return Plans(self._rules, self._refuges, self._kept, self._driven, *self._scratch)

    def _command_at(self, time: float) -> ControlCommand:
        command = super()._command_at(time)
        if self._shows:
            command.candidates = self._candidates.copy()
            command.candidate_costs = self._costs.copy()
            command.chosen = self._chosen.copy()
        return command


def _rules(item: SafetyParameters) -> dict[str, float]:
    return {name: float(getattr(item.ratings, name)) for name in RULE_NAMES}


def _limits(vehicle: Vehicle) -> dict[str, float]:
    return {
        "max_curvature": tan(vehicle.max_steering_angle) / vehicle.wheelbase,
        "steering_lag": vehicle.steering_lag,
        "acceleration_lag": vehicle.acceleration_lag,
    }


@compiled
def _act(  # noqa: PLR0913, PLR0917 - a kernel
    batch: Batch,
    plans: Plans,
    time: float,
    shows: bool,  # noqa: FBT001 - a kernel
    candidates: Floats,
    costs: Floats,
    chosen: Ints,
) -> None:
    for run in range(batch.records.shape[0]):
        if not batch.running[run]:
            continue
        state = planned_step(batch, plans, run, time, shows)
        tell(batch, run, state)
        if shows:
            show_plan(batch, plans, run, state, candidates, costs, chosen)
