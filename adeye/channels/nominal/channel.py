"""The built-in nominal channel on the batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.channels.corridor import PATH_WIDTH
from adeye.channels.driving import channel_records
from adeye.channels.hooks import HOOKS, Hooks
from adeye.channels.nominal.planning import MEMORY_PATH, MEMORY_WIDTH, nominal_step
from adeye.channels.perception import NOTE_END, Perception
from adeye.kernel.jit import compiled
from adeye.signals import (
    DEGRADED,
    FAULT,
    OK,
    Bools,
    ControlCommand,
    Floats,
    Ints,
    Observation,
    spec_columns,
)
from adeye.spec.channels import NominalParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext


class NominalChannel:
    """Drives along its lane on what its linked sensors see, follows, and brakes in an emergency.

    It sees measurements only. Without a recent ego estimate its state is FAULT, with a linked
    sensor that does not deliver it is DEGRADED.
    """

    monitor_ids: tuple[str, ...] = ()
    hooks: tuple[str, ...] = HOOKS

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs = context.runs
        names = tuple(NominalParameters.model_fields)
        fields = spec_columns(
            context.parameters, lambda item: {name: float(getattr(item, name)) for name in names}
        )
        self._channel_id = context.channel_id
        self._hooks = Hooks()
        self._perception = Perception(context, channel_records(context, fields))
        self._memory = np.zeros((runs, MEMORY_WIDTH))
        self._memory[:, MEMORY_PATH] = np.nan
        self._command = np.zeros((runs, 2))
        self._status = np.full(runs, FAULT, dtype=np.int64)
        self._path = np.zeros(PATH_WIDTH)

    def inject(self, hook: str, active: Bools, size: Floats) -> None:
        """Take in where a fault inside the channel is present from now on."""
        self._hooks.inject(hook, active, size)

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation with one command per run."""
        seen = self._perception
        self._hooks.before(seen)
        seen.update(observation)
        self._hooks.after(seen)
        _act(
            seen.records,
            observation.time,
            seen.running,
            seen.segments,
            seen.pose,
            seen.tracks,
            seen.notes,
            seen.degraded,
            self._memory,
            self._command,
            self._status,
            self._path,
        )
        command = ControlCommand(
            self._channel_id,
            self._command[:, 0].copy(),
            self._command[:, 1].copy(),
            np.full(self._status.shape, observation.time),
            self._status.copy(),
            tracks=seen.shown.copy(),
        )
        return self._hooks.answer(command)


@compiled
def _act(  # noqa: PLR0913, PLR0917 - a kernel
    records: Any,
    time: float,
    running: Bools,
    segments: Floats,
    pose: Floats,
    tracks: Floats,
    notes: Floats,
    degraded: Bools,
    memory: Floats,
    command: Floats,
    status: Ints,
    path: Floats,
) -> None:
    for run in range(records.shape[0]):
        if not running[run]:
            continue
        state = nominal_step(
            records[run],
            time,
            segments[run],
            int(notes[run, NOTE_END]),
            pose[run],
            tracks[run],
            memory[run],
            command[run],
            path,
        )
        if state == OK and degraded[run]:
            state = DEGRADED
        status[run] = state
