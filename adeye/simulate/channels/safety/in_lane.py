"""The built-in safety channel on the batch."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.jit import compiled
from adeye.signals import FAULT, Bools, ControlCommand, Floats, Observation, spec_columns
from adeye.simulate.channels.corridor import PATH_WIDTH
from adeye.simulate.channels.driving import channel_records
from adeye.simulate.channels.hooks import SAFETY_HOOKS, SafetyHooks
from adeye.simulate.channels.links import SWITCH, linked_channels
from adeye.simulate.channels.perception.step import Perception
from adeye.simulate.channels.safety.monitors import (
    EVIDENCE_WIDTH,
    MEMORY_PATH,
    MEMORY_WIDTH,
    MONITOR_IDS,
    NO_SWITCH,
    STATE_FROZEN,
    STATE_WIDTH,
    Batch,
    safety_step,
    tell,
)
from adeye.spec.channels import BESIDE_NUMBERS, SafetyParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext

PERCEPTION: Final = {"coast": 0.3, "gate": 4.0, "confirm_hits": 2.0, "confirm_window": 0.0}
"""Coasting [s], gate [m] and confirmation of the channel's own tracks. Two samples give a velocity,
which is all that ground truth needs; shorter coasting than the nominal channel's, because a ghost
would trigger a stop. Our choice."""

SHADOW: Final = {
    "time_gap": 2.0,
    "standstill_gap": 5.0,
    "max_acceleration": 1.0,
    "comfort_deceleration": 2.0,
}
"""Car following while no stop is asked for [s], [m], [m/s²]: gentler than the nominal channel. The
time gap is the headway of the careful and competent driver of UN R157."""


class SafetyChannel:
    """Supervises nominal channel and scene, and brings the ego to an in-lane safe stop.

    It requests authority while a monitor is confirmed. Its command is computed at every tick, also
    without authority. Without a recent ego estimate its state is FAULT.
    """

    monitor_ids: tuple[str, ...] = MONITOR_IDS
    hooks: tuple[str, ...] = SAFETY_HOOKS

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs = context.runs
        self._channel_id = context.channel_id
        self._hooks = SafetyHooks(runs)
        fields = self._fields(context)
        self._perception = Perception(context, channel_records(context, fields))
        self._supervised = linked_channels(context.links)
        self._has_switch = SWITCH in context.links
        self._numbers = np.zeros((runs, len(self._supervised), 3))
        self._channel_status = np.zeros((runs, len(self._supervised)), dtype=np.int64)
        self._reason = np.full(runs, NO_SWITCH, dtype=np.int64)
        self._heard = np.zeros(self._channel_status.shape, dtype=np.bool_)
        self._states = np.zeros((runs, len(self.monitor_ids), STATE_WIDTH), dtype=np.int64)
        self._memory = np.zeros((runs, MEMORY_WIDTH))
        self._memory[:, MEMORY_PATH] = np.nan
        self._command = np.zeros((runs, 2))
        self._status = np.full(runs, FAULT, dtype=np.int64)
        self._monitors = np.zeros((runs, len(self.monitor_ids), 2), dtype=np.bool_)
        self._path = np.zeros(PATH_WIDTH)
        self._evidence = np.zeros(EVIDENCE_WIDTH)

    def _fields(self, context: ChannelContext) -> dict[str, Any]:
        """List what the compiled steps read, for the parameter records."""
        numbers = spec_columns(
            context.parameters, lambda item: safety_numbers(item, context.period)
        )
        return numbers | PERCEPTION | SHADOW

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Take in where a fault inside the channel is present from now on."""
        self._hooks.inject(hook, active, size)

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation with one command per run."""
        self._hooks.before(self._perception)
        self._read(observation)
        self._hooks.after(self._perception)
        self._states[:, :, STATE_FROZEN] = self._hooks.monitors_frozen[:, np.newaxis]
        self._decide(observation.time)
        return self._hooks.answer(self._command_at(observation.time))

    def _read(self, observation: Observation) -> None:
        self._perception.update(observation)
        for index, name in enumerate(self._supervised):
            heard = observation.commands[name]
            self._numbers[:, index, 0] = heard.acceleration
            self._numbers[:, index, 1] = heard.steering_angle
            self._numbers[:, index, 2] = heard.stamp
            self._channel_status[:, index] = heard.status
        if self._has_switch and observation.authority is not None:
            self._reason[:] = observation.authority.reason

    def _decide(self, time: float) -> None:
        _act(self._batch(), time)

    def _batch(self) -> Batch:
        seen = self._perception
        return Batch(
            records=seen.records,
            segments=seen.segments,
            running=seen.running,
            numbers=self._numbers,
            channel_status=self._channel_status,
            reason=self._reason,
            pose=seen.pose,
            tracks=seen.tracks,
            notes=seen.notes,
            degraded=seen.degraded,
            heard=self._heard,
            states=self._states,
            memory=self._memory,
            command=self._command,
            status=self._status,
            monitors=self._monitors,
            path=self._path,
            evidence=self._evidence,
        )

    def _command_at(self, time: float) -> ControlCommand:
        return ControlCommand(
            self._channel_id,
            self._command[:, 0].copy(),
            self._command[:, 1].copy(),
            np.full(self._status.shape, time),
            self._status.copy(),
            monitors=self._monitors.copy(),
            tracks=self._perception.shown.copy(),
        )


def safety_numbers(item: SafetyParameters, period: float) -> dict[str, float]:
    """List what the compiled step reads of the channel's parameters, whichever way it stops."""
    names = [name for name in SafetyParameters.model_fields if name not in BESIDE_NUMBERS]
    numbers = {name: float(getattr(item, name)) for name in names}
    for name in ("confirm", "heal"):
        numbers[f"{name}_ticks"] = ticks_within(numbers[name], period)
    return numbers


def ticks_within(duration: float, period: float) -> int:
    """Return how many periods a duration takes, rounded up.

    Args:
        duration: [s].
        period: [s].

    >>> ticks_within(0.1, 0.05), ticks_within(0.12, 0.05), ticks_within(0.0, 0.05)
    (2, 3, 0)
    """
    return math.ceil(duration / period - 1e-6)


@compiled
def _act(batch: Batch, time: float) -> None:
    for run in range(batch.records.shape[0]):
        if batch.running[run]:
            tell(batch, run, safety_step(batch, run, time))
