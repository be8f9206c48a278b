"""Programs as channels: any language, one process for each run, lines of JSON between them.

One process for each run, not one for a batch: what a program does in one run cannot reach another,
nobody who writes one has to think of batches, and results do not depend on how runs are put
together. How programs are started, asked and ended is in ``bridges.programs``.
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from adeye.errors import SpecError
from adeye.plugin_code import imports_beside
from adeye.plugins import locate_file
from adeye.signals import SILENT, ControlCommand, Observation
from adeye.simulate.bridges.programs import INVALID_OUTPUT, Broken, Children, ceilings_of
from adeye.simulate.channels.guard import Failures
from adeye.simulate.channels.links import no_command
from adeye.simulate.channels.process import protocol
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.ports import ChannelContext
    from adeye.signals import Bools
    from adeye.spec.channels import ProcessParameters, RemoteParameters
    from adeye.trace import ChannelEvent

# --- From the command of an architecture to what is executed: a program and files of the project --

HERE: Final = "./"
"""How a word of a command begins that names a file of the project."""


def command_files(command: Sequence[str]) -> dict[int, str]:
    """Return the words of a command that name files of the project, by their place."""
    return {at: word for at, word in enumerate(command) if word.startswith(HERE)}


def counted_files(command: Sequence[str], files: Sequence[str], base_dir: Path) -> tuple[Path, ...]:
    """List all files that are in the identity of results with a program, as they are found.

    They are those that its command or its channel names, and what the program imports beside it.

    Args:
        command: As the user wrote it; empty for none.
        files: Files that the channel says it reads, as the user wrote them.
        base_dir: Folder of the file that names them.

    Raises:
        SpecError: There is no such file, or it lies elsewhere.
    """
    names = (*command_files(command).values(), *files)
    named = [locate_file(name, base_dir) for name in names]
    beside = [
        path
        # The first word that names a file is the program or its script.
        for at, file in enumerate(named)
        for path in imports_beside(file, command[0] if command and not at else "")
    ]
    return tuple(dict.fromkeys((*named, *beside)))


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


class Programs(Protocol):
    """The programs of a batch, one for each run."""

    @property
    def strays(self) -> int:
        """Processes that they have left behind."""

    def finish(self, patience: float) -> dict[int, str]:
        """End what each is told, and say of which run's it is wrong how it ends."""

    def end(self, number: int) -> None:
        """End the one of a run; it is not waited for."""

    def close(self) -> None:
        """End all and wait until they have."""


class HostedChannel:
    """A channel whose decisions are made by programs, one for each run.

    A program that ends, does not answer in time or answers nonsense is silent from that tick on, in
    its run; it is ended, and so is whatever it started.
    """

    monitor_ids: tuple[str, ...] = ()

    def __init__(self, base_dir: Path, files: Sequence[Sequence[str]] = ()) -> None:
        """Remember where files are looked for, and which are read.

        Args:
            base_dir: Folder of the file that names them.
            files: Those that the channel says it reads, of each run; none where it is left out.
        """
        self._base_dir = base_dir
        self._files = files
        self._failures = Failures("", 0)
        self._previous = no_command("", 0)
        self._programs: Programs | None = None

    @property
    def events(self) -> list[ChannelEvent | None]:
        """First failure of the channel in each run, or None."""
        return self._failures.events

    def finish(self, patience: float) -> tuple[dict[int, str], int]:
        """End what every program is told, and wait for its end by itself.

        Args:
            patience: How long they may take [s].

        Returns:
            What is wrong with the end of those that there is something wrong with, by run; and how
            many processes they have left behind.
        """
        if self._programs is None:
            return {}, 0
        return self._programs.finish(patience), self._programs.strays

    def close(self) -> None:
        """End every program and wait until they have."""
        if self._programs is not None:
            self._programs.close()
            self._programs = None

    def _files_of(self, run: int) -> tuple[str, ...]:
        """Return which files the channel says it reads in a run."""
        return tuple(self._files[run]) if self._files else ()

    def _begin(self, context: ChannelContext) -> None:
        """End the programs of the batch before, and forget its failures."""
        self.close()
        self._failures = Failures(context.channel_id, context.runs)
        self._previous = no_command(context.channel_id, context.runs)

    def _open_runs(self, running: Bools) -> list[int]:
        """Return the runs whose programs are to be asked; those of the others are ended."""
        is_open = running & ~self._failures.silent
        if self._programs is not None:
            for run in np.flatnonzero(~is_open):
                self._programs.end(int(run))
        return [int(run) for run in np.flatnonzero(is_open)]

    def _fail(self, run: int, time: float, why: Broken | str) -> None:
        """Let a channel be silent from now on in a run; text says what is wrong with an answer."""
        broken = Broken(INVALID_OUTPUT, why) if isinstance(why, str) else why
        self._failures.add(
            run,
            f"channel_{broken.cause}",
            time,
            # What is stored with results must not depend on where a project lies.
            _FOLDERS.sub("", broken.detail),
            is_machine_dependent=broken.is_machine_dependent,
        )
        if self._programs is not None:
            self._programs.end(run)


class ProcessChannel(HostedChannel):
    """Asks the program of each run for a command at each tick."""

    def __init__(
        self, base_dir: Path, files: Sequence[Sequence[str]] = (), before: Sequence[str] = ()
    ) -> None:
        """Remember where files are looked for, and which are read.

        Args:
            base_dir: Folder of the file that names them.
            files: Those that the channel says it reads, of each run.
            before: Program that is given the command of the channel, to ask it by other means.
        """
        super().__init__(base_dir, files)
        self._before = tuple(before)

    def reset(self, context: ChannelContext) -> None:
        """Start the program of every run and exchange first lines.

        Raises:
            SpecError: There is no such program.
            PlatformError: The system lets no program be started.
        """
        self._begin(context)
        self._parameters: list[Any] = list(context.parameters)
        self._ticks = [0] * context.runs
        self._start()
        starts = {run: item.start_deadline for run, item in enumerate(self._parameters)}
        lines = {run: protocol.encode(protocol.hello(context, run)) for run in starts}
        for run, line in self._children.ask(lines, starts).items():
            version = getattr(self._parameters[run], "version", "")
            wrong = line if isinstance(line, Broken) else protocol.wrong_hello(line, version)
            if wrong:
                self._fail(run, 0.0, wrong)

    def _start(self) -> None:
        """Start the program of every run."""
        parameters: list[ProcessParameters] = self._parameters
        uses = [(item.command, self._files_of(run)) for run, item in enumerate(parameters)]
        argvs = {use: find_program(use[0], self._base_dir) for use in dict.fromkeys(uses)}
        reads = {use: counted_files(*use, self._base_dir) for use in argvs}
        self._programs = self._children = Children()
        for run, (item, use) in enumerate(zip(parameters, uses, strict=True)):
            argv, most = (*self._before, *argvs[use]), item.run_deadline
            self._children.start(run, argv, ceilings_of(item), most, reads[use])

    def act(self, observation: Observation) -> ControlCommand:
        """Ask the program of every run that has not ended."""
        command = self._previous.copy()
        lines = {
            run: protocol.encode(protocol.observation_shown(observation, run, self._ticks[run]))
            for run in self._open_runs(observation.running)
        }
        deadlines = {
            run: self._parameters[run].of_answer(begins=bool(self._before) and not self._ticks[run])
            for run in lines
        }
        for run, line in self._children.ask(lines, deadlines).items():
            if isinstance(line, Broken):
                self._fail(run, observation.time, line)
                continue
            answer, wrong = protocol.read_command(line, self._ticks[run])
            if answer is not None and run in self._children.unasked:
                answer, wrong = None, f"it answers tick {self._ticks[run]} before it is asked"
            self._ticks[run] += 1
            if answer is None:
                self._fail(run, observation.time, wrong)
                continue
            command.status[run] = answer.status
            if answer.status != SILENT:
                command.acceleration[run] = answer.acceleration
                command.steering_angle[run] = answer.steering_angle
                command.stamp[run] = observation.time
        self._previous = self._failures.hold(command, self._previous)
        return self._previous


class RemoteChannel(ProcessChannel):
    """Asks what listens at an address, over a connection of its own for each run."""

    def _start(self) -> None:
        parameters: list[RemoteParameters] = self._parameters
        self._programs = self._children = Children()
        for run, item in enumerate(parameters):
            self._children.connect(run, item.place, item.start_deadline, item.run_deadline)
