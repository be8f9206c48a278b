"""An FMU as a channel: told what the channel knows by name, it answers with a command.

What is known is made from the linked sensors as for any built-in channel; the FMU runs in a process
of its own in each run, see ``fmu_program`` and ``channels.process``.
"""

from __future__ import annotations

import json
import math
import sys
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from adeye.plugins import locate_file
from adeye.signals import DEGRADED, FAULT, OK
from adeye.simulate.bridges import fmi, fmu_program
from adeye.simulate.bridges.fmu_program import GREETING
from adeye.simulate.channels.driving import channel_records, parameter_columns
from adeye.simulate.channels.guard import INVALID_OUTPUT
from adeye.simulate.channels.policy import Kinematics
from adeye.simulate.channels.process.channel import Broken, HostedChannel
from adeye.simulate.channels.process.protocol import encode
from adeye.spec.channels import TrackingParameters
from adeye.units import Dimension

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from adeye.ports import ChannelContext
    from adeye.signals import ControlCommand, Observation
    from adeye.spec.channels import FmuParameters

PROGRAM: Final = (sys.executable, "-I", "-B", fmu_program.__file__)
"""What is started for each run."""

LATERAL_MARGIN: Final = 0.2
"""How much nearer than touching an object's side must come to be in the path [m]."""

COMMAND: Final = {
    "acceleration": Dimension.ACCELERATION,
    "steering_angle": Dimension.ANGLE,
}
"""What the command is made of, in the order in which it is read."""


class Wired(NamedTuple):
    """An FMU that has been checked: its file, and how it is wired."""

    file: Path
    inputs: list[fmi.Wire]
    outputs: list[fmi.Wire]


def wire_channel(parameters: FmuParameters, base_dir: Path) -> Wired:
    """Read the description of a channel's FMU and connect its variables.

    Raises:
        InputError: fmpy is not installed.
        SpecError: There is no such FMU, or its variables do not fit.
    """
    file = locate_file(parameters.file, base_dir)
    description = fmi.read_description(file)
    fmi.require_steppable(description, file.name)
    fmi.require_start(description, parameters.start)
    named = [(key, getattr(parameters.outputs, key), what) for key, what in COMMAND.items()]
    return Wired(
        file,
        fmi.wire_inputs(description, parameters.inputs),
        fmi.wire(description, named, "output"),
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
        fields: dict[str, Any] = parameter_columns(context, TrackingParameters.model_fields)
        fields["lateral_margin"] = LATERAL_MARGIN
        self._known = Kinematics(context, channel_records(context, fields))
        parameters: list[FmuParameters] = list(context.parameters)
        wired: list[tuple[FmuParameters, Wired]] = []
        self._wired: list[Wired] = []
        for item in parameters:
            found = next((wires for other, wires in wired if other == item), None)
            if found is None:
                found = wire_channel(item, self._base_dir)
                wired.append((item, found))
            self._wired.append(found)
        self._stepped = [math.nan] * context.runs
        hellos = [
            fmu_hello(wires.file, item, wires.inputs, wires.outputs)
            for item, wires in zip(parameters, self._wired, strict=True)
        ]
        self._is_before = [item.master == "gauss_seidel" for item in parameters]
        self._begin(context, [PROGRAM] * context.runs, hellos, GREETING)

    def act(self, observation: Observation) -> ControlCommand:
        """Step the FMU of every run that has not ended to the present tick."""
        self._known.update(observation)
        time = observation.time
        command = self._previous.copy()
        command.tracks = self._known.tracks.copy()
        signals = self._known.signals()
        lines: dict[int, bytes] = {}
        for run in self._open_runs(observation.running):
            command.stamp[run] = time
            command.status[run] = FAULT
            command.acceleration[run] = 0.0
            if not self._known.is_known[run]:
                continue
            values = [
                wire.to_variable(
                    time if wire.signal == "time" else float(signals[wire.signal][run])
                )
                for wire in self._wired[run].inputs
            ]
            began = self._stepped[run] if math.isfinite(self._stepped[run]) else time
            self._stepped[run] = time
            content = {
                "tick": self._ticks[run],
                "time": began,
                "step": time - began,
                "set": values,
                "before": self._is_before[run] or time == began,
            }
            lines[run] = encode(content)
        for run, line in self._ask_step(lines, time).items():
            found, wrong = read_values(line, self._ticks[run], self._wired[run].outputs)
            self._ticks[run] += 1
            if wrong:
                self._fail(run, time, Broken(INVALID_OUTPUT, wrong))
                continue
            command.acceleration[run], command.steering_angle[run] = found
            command.status[run] = DEGRADED if self._known.degraded[run] else OK
        self._previous = self._failures.hold(command, self._previous)
        return self._previous


def fmu_hello(
    file: Path, use: Any, inputs: Sequence[fmi.Wire], outputs: Sequence[fmi.Wire]
) -> dict[str, Any]:
    """Return the first line that a program is sent, see ``fmu_program``."""
    return {
        "hello": GREETING,
        "file": str(file),
        "start": use.start,
        "time": 0.0,
        "inputs": [wire.variable for wire in inputs],
        "outputs": [wire.variable for wire in outputs],
        "sub_steps": use.sub_steps,
    }


def read_values(line: bytes, tick: int, wires: Sequence[fmi.Wire]) -> tuple[list[float], str]:
    """Read what a program answers, in SI, or say what is wrong with it."""
    try:
        content = json.loads(line)
        values = [float(value) for value in content["values"]]
        is_answer = content["tick"] == tick and len(values) == len(wires)
    except (ValueError, TypeError, KeyError, RecursionError):
        is_answer = False
    if not is_answer:
        return [], f"its program answers {line[:60]!r}"
    found = [float(wire.to_signal(value)) for wire, value in zip(wires, values, strict=True)]
    for wire, value in zip(wires, found, strict=True):
        if not math.isfinite(value):
            return [], f"{wire.signal} {value} ({wire.variable}) is no finite number"
    return found, ""
