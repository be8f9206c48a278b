"""An FMU as a channel: told what the channel knows by name, it answers with a command.

What is known is made from the linked sensors as for any built-in channel; the FMU runs in a process
of its own in each run, see ``bridges.fmus``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.jit import compiled
from adeye.kernel.road import center_at, ground_of
from adeye.signals import DEGRADED, FAULT, OK
from adeye.simulate.bridges.fmus import Fmus, Step, Wired, wire_each, wire_fmu
from adeye.simulate.bridges.programs import Broken
from adeye.simulate.channels import corridor
from adeye.simulate.channels.driving import channel_records, parameter_columns
from adeye.simulate.channels.perception.pose import POSE_D, POSE_S, POSE_SPEED
from adeye.simulate.channels.policy import Kinematics
from adeye.simulate.channels.process.channel import HostedChannel, counted_files
from adeye.spec.channels import EGO_SIGNALS, SIGNALS, TrackingParameters
from adeye.spec.programs import LEAD_SIGNALS, NEAREST, OBJECT_SIGNALS
from adeye.units import Dimension

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.ports import ChannelContext
    from adeye.signals import ControlCommand, Floats, Observation
    from adeye.simulate.channels.perception.step import Seen
    from adeye.spec.channels import FmuParameters

LATERAL_MARGIN: Final = 0.2
"""How much nearer than touching an object's side must come to be in the path [m]."""

NO_LEAD: Final = 1000.0
"""Gap that is told where no object is in the path [m]: farther than any sensor sees."""

COMMAND: Final = {"acceleration": Dimension.ACCELERATION, "steering_angle": Dimension.ANGLE}
"""What the command is made of, in the order in which it is read."""


def wire_channel(parameters: FmuParameters, base_dir: Path) -> Wired:
    """Read the description of a channel's FMU and connect its variables.

    Raises:
        InputError: fmpy is not installed.
        SpecError: There is no such FMU, or its variables do not fit.
    """
    return wire_fmu(
        parameters,
        base_dir,
        [(signal, name, SIGNALS[signal]) for name, signal in sorted(parameters.inputs.items())],
        [(key, getattr(parameters.outputs, key), what) for key, what in COMMAND.items()],
    )


class FmuChannel(HostedChannel):
    """Asks the FMU of each run for a command at each tick.

    Without a recent ego estimate its state is FAULT and the FMU is not stepped; with a linked
    sensor that does not deliver it is DEGRADED.
    """

    def reset(self, context: ChannelContext) -> None:
        """Start the FMU of every run.

        Raises:
            SpecError: There is no such FMU, or its variables do not fit.
            PlatformError: The system lets no program be started.
        """
        self._begin(context)
        fields: dict[str, Any] = parameter_columns(context, TrackingParameters.model_fields)
        fields["lateral_margin"] = LATERAL_MARGIN
        self._known = Kinematics(context, channel_records(context, fields))
        self._leads = np.zeros((context.runs, len(LEAD_SIGNALS)))
        self._path = np.zeros(corridor.PATH_WIDTH)
        uses: list[FmuParameters] = list(context.parameters)
        self._wired = wire_each(uses, lambda use: wire_channel(use, self._base_dir))
        self._is_before = [use.master == "gauss_seidel" for use in uses]
        self._stepped = [math.nan] * context.runs
        reads = [counted_files((), self._files_of(run), self._base_dir) for run in range(len(uses))]
        self._programs = self._fmus = Fmus(uses, self._wired, reads=reads)
        for run, broken in self._fmus.greet().items():
            self._fail(run, 0.0, broken)

    def act(self, observation: Observation) -> ControlCommand:
        """Step the FMU of every run that has not ended to the present tick."""
        self._known.update(observation)
        time = observation.time
        command = self._previous.copy()
        command.tracks = self._known.tracks.copy()
        runs = self._open_runs(observation.running)
        command.stamp[runs] = time
        command.status[runs] = FAULT
        command.acceleration[runs] = 0.0
        signals = self._signals(time)
        asked = {run: self._step(run, signals, time) for run in runs if self._known.is_known[run]}
        for run, found in self._fmus.step(asked).items():
            if isinstance(found, Broken):
                self._fail(run, time, found)
                continue
            command.acceleration[run], command.steering_angle[run] = found
            command.status[run] = DEGRADED if self._known.degraded[run] else OK
        self._previous = self._failures.hold(command, self._previous)
        return self._previous

    def _step(self, run: int, signals: dict[str, Floats], time: float) -> Step:
        began = self._stepped[run] if math.isfinite(self._stepped[run]) else time
        self._stepped[run] = time
        values = [float(signals[wire.signal][run]) for wire in self._wired[run].inputs]
        return Step(values, began, time - began, self._is_before[run])

    def _signals(self, time: float) -> dict[str, Floats]:
        """Return each signal of all runs by name, in SI, see ``spec.channels.SIGNALS``."""
        known = self._known
        _find_leads(known.seen, self._path, self._leads)
        named = {"time": np.full(len(known.ego), time)}
        named |= {f"ego.{name}": known.ego[:, k] for k, name in enumerate(EGO_SIGNALS)}
        named |= {f"lead.{name}": self._leads[:, k] for k, name in enumerate(LEAD_SIGNALS)}
        for row in range(NEAREST):
            for k, name in enumerate(OBJECT_SIGNALS):
                named[f"objects.{row + 1}.{name}"] = known.objects[:, row, k]
        return named


@compiled
def _find_leads(seen: Seen, path: Floats, leads: Floats) -> None:
    """Write what is known of the nearest object in the path of each ego's lane.

    Where there is none, it is told as one without a gap limit that drives as fast as the ego.
    """
    for run in range(seen.records.shape[0]):
        if seen.running[run]:
            pose, ground = seen.pose[run], ground_of(seen.grounds, run)
            corridor.view_path(seen, run, center_at(ground, pose[POSE_S], pose[POSE_D]), path)
            is_there = path[corridor.PATH_GAP] < NO_LEAD
            leads[run, 0] = 1.0 if is_there else 0.0
            leads[run, 1] = path[corridor.PATH_GAP] if is_there else NO_LEAD
            leads[run, 2] = path[corridor.PATH_SPEED] if is_there else pose[POSE_SPEED]
