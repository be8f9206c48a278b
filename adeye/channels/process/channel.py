"""A program as a channel: one process for each run, asked by lines of JSON.

One process for each run, not one for a batch: what a program does in one run cannot reach another,
nobody who writes one has to think of batches, and results do not depend on how runs are put
together. All programs of a batch are asked at the same time, so that they share the processors and
a tick waits for the slowest only.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.channels.failures import INVALID_OUTPUT, Failures
from adeye.channels.links import no_command
from adeye.channels.process.children import Broken, Ceilings, Children
from adeye.channels.process.program import find_program
from adeye.channels.process.protocol import encode, hello, read_command, shown, wrong_hello
from adeye.signals import SILENT, ControlCommand, Observation

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from adeye.ports import ChannelContext
    from adeye.spec.channels import ProcessParameters
    from adeye.trace import ChannelEvent

MOST_PROGRAMS: Final = 64
"""Programs that a block of a campaign has at once: more take memory and descriptors, not less time.
Our choice."""

_FOLDERS: Final = re.compile(r"(?<![\w.])(?:/[^\s/:'\"()]+)+/")


class ProcessChannel:
    """Asks the program of each run for a command at each tick.

    A program that ends, does not answer in time or answers nonsense is silent from that tick on, in
    its run; it is ended, and so is whatever it started.
    """

    monitor_ids: tuple[str, ...] = ()

    def __init__(self, base_dir: Path) -> None:
        """Remember where programs are looked for.

        Args:
            base_dir: Folder of the file that names them.
        """
        self._base_dir = base_dir
        self._failures = Failures("", 0)
        self._previous = no_command("", 0)
        self._children: Children | None = None
        self._patience: list[float] = []
        self._ticks: list[int] = []

    @property
    def events(self) -> list[ChannelEvent | None]:
        """First failure of the channel in each run, or None."""
        return self._failures.events

    def reset(self, context: ChannelContext) -> None:
        """Start the program of every run and exchange first lines.

        Raises:
            SpecError: There is no such program.
            PlatformError: The system lets no program be started.
        """
        self.close()
        runs = range(context.runs)
        self._failures = Failures(context.channel_id, context.runs)
        self._previous = no_command(context.channel_id, context.runs)
        self._parameters: list[ProcessParameters] = list(context.parameters)
        self._patience = [item.run_deadline for item in self._parameters]
        self._ticks = [0] * context.runs
        commands = dict.fromkeys(item.command for item in self._parameters)
        argvs = {item: find_program(item, self._base_dir) for item in commands}
        self._children = Children()
        for run, item in enumerate(self._parameters):
            self._children.start(run, argvs[item.command], _ceilings(item))
        starts = {run: item.start_deadline for run, item in enumerate(self._parameters)}
        lines = {run: encode(hello(context, run)) for run in runs}
        for run, line in self._ask(lines, starts, 0.0).items():
            wrong = wrong_hello(line)
            if wrong:
                self._fail(run, 0.0, Broken(INVALID_OUTPUT, wrong))

    def act(self, observation: Observation) -> ControlCommand:
        """Ask the program of every run that has not ended."""
        command = self._previous.copy()
        lines: dict[int, bytes] = {}
        for run, is_open in enumerate(observation.running & ~self._failures.silent):
            if is_open:
                lines[run] = encode(shown(observation, run, self._ticks[run]))
            elif self._children is not None:
                self._children.end(run)
        steps = {run: self._parameters[run].step_deadline for run in lines}
        for run, line in self._ask(lines, steps, observation.time).items():
            answer, wrong = read_command(line, self._ticks[run])
            self._ticks[run] += 1
            if answer is None:
                self._fail(run, observation.time, Broken(INVALID_OUTPUT, wrong))
                continue
            command.status[run] = answer.status
            if answer.status != SILENT:
                command.acceleration[run] = answer.acceleration
                command.steering_angle[run] = answer.steering_angle
                command.stamp[run] = observation.time
        self._previous = self._failures.hold(command, self._previous)
        return self._previous

    def close(self) -> None:
        """End every program and wait until they have."""
        if self._children is not None:
            self._children.close()
            self._children = None

    def _ask(
        self, lines: Mapping[int, bytes], deadlines: Mapping[int, float], time: float
    ) -> dict[int, bytes]:
        """Return the lines of the programs that answer; the others have failed."""
        if not lines or self._children is None:
            return {}
        patience = {run: min(deadlines[run], self._patience[run]) for run in lines}
        answers: dict[int, bytes] = {}
        for run, (answer, passed) in sorted(self._children.ask(lines, patience).items()):
            self._patience[run] -= passed
            if isinstance(answer, Broken):
                self._fail(run, time, answer)
            else:
                answers[run] = answer
        return answers

    def _fail(self, run: int, time: float, broken: Broken) -> None:
        runs = np.zeros(self._failures.silent.shape[0], dtype=np.bool_)
        runs[run] = True
        self._failures.add(
            runs,
            broken.outcome,
            time,
            # What is stored with results must not depend on where a project lies.
            _FOLDERS.sub("", broken.detail),
            is_machine_dependent=broken.is_machine_dependent,
        )
        if self._children is not None:
            self._children.end(run)


def _ceilings(parameters: Any) -> Ceilings:
    limits = parameters.limits
    return Ceilings(
        cpu_s=max(1, round(limits.cpu_time)),
        memory=limits.memory_mib * 2**20,
        file_size=limits.file_mib * 2**20,
        open_files=limits.open_files,
        processes=limits.processes,
    )
