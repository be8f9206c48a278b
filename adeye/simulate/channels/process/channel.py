"""Programs as channels: any language, one process for each run, lines of JSON between them.

One process for each run, not one for a batch: what a program does in one run cannot reach another,
nobody who writes one has to think of batches, and results do not depend on how runs are put
together. All programs of a batch are asked at the same time, so that they share the processors and
a tick waits for the slowest only.
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import SpecError
from adeye.plugins import locate_file
from adeye.signals import SILENT, ControlCommand, Observation
from adeye.simulate.channels.guard import INVALID_OUTPUT, Failures
from adeye.simulate.channels.links import no_command
from adeye.simulate.channels.process.children import Broken, Ceilings, Children
from adeye.simulate.channels.process.protocol import (
    encode,
    hello,
    observation_shown,
    read_command,
    wrong_hello,
)
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.ports import ChannelContext
    from adeye.spec.channels import ProcessParameters
    from adeye.trace import ChannelEvent

# --- From the command of an architecture to what is executed: a program and files of the project --

HERE: Final = "./"
"""How a word of a command begins that names a file of the project."""


def command_files(command: Sequence[str]) -> dict[int, str]:
    """Return the words of a command that name files of the project, by their place."""
    return {at: word for at, word in enumerate(command) if word.startswith(HERE)}


def find_program(command: Sequence[str], base_dir: Path) -> tuple[str, ...]:
    """Turn a command into what is executed: files by their absolute paths.

    Args:
        command: As the user wrote it.
        base_dir: Folder of the file that names it.

    Returns:
        Path of the program and its arguments.

    Raises:
        SpecError: This system cannot do it, there is no such program, it cannot be executed, or a
            file lies outside of the folder.
    """
    if os.name != "posix":
        raise SpecError(
            "kind process needs a POSIX system, such as Linux",
            remedy="Run it there, or write the channel as ./file.py:Class.",
        )
    paths = {at: str(locate_file(word, base_dir)) for at, word in command_files(command).items()}
    if not paths:
        raise SpecError(
            f"the command {shown(' '.join(command))} names no file of the project",
            remedy="Write the program, or the script that it executes, as ./file beside this file:"
            " its content is part of a result's identity.",
        )
    name = command[0]
    if 0 in paths:
        if not os.access(paths[0], os.X_OK):
            raise SpecError(
                f"{shown(name)} cannot be executed",
                remedy=f"chmod +x {name}, or name its interpreter first.",
            )
    elif "/" in name:
        raise SpecError(
            f"{shown(name)} is neither a file of the project nor the name of a program",
            remedy="Write ./file relative to this file, or a name that is found on the PATH.",
        )
    else:
        found = shutil.which(name)
        if found is None:
            raise SpecError(
                f"there is no program {shown(name)} on the PATH",
                remedy="Install it, or name ./file.",
            )
        paths[0] = str(Path(found).absolute())
    return tuple(paths.get(at, word) for at, word in enumerate(command))


# --- A program as a channel: one process for each run, asked by lines of JSON ---------------------

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
                lines[run] = encode(observation_shown(observation, run, self._ticks[run]))
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
        self._failures.add(
            run,
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
