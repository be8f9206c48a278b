"""Programs as channels: any language, one process for each run, lines of JSON between them.

One process for each run, not one for a batch: what a program does in one run cannot reach another,
nobody who writes one has to think of batches, and results do not depend on how runs are put
together. All programs of a batch are asked line by line at the same time, so that they share the
processors and a tick waits for the slowest only. They run under a warden of their own, see
``warden``. Each has deadlines of its own on the monotonic clock; all they do is stop what hangs.
"""

from __future__ import annotations

import json
import os
import re
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import time
import weakref
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.errors import PlatformError, SpecError
from adeye.plugins import locate_file
from adeye.signals import SILENT, ControlCommand, Observation
from adeye.simulate.channels.guard import ERROR, INVALID_OUTPUT, KILLED, TIMEOUT, Failures
from adeye.simulate.channels.links import no_command
from adeye.simulate.channels.process import protocol
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.ports import ChannelContext
    from adeye.signals import Bools
    from adeye.spec.channels import ProgramParameters
    from adeye.trace import ChannelEvent

# --- Programs that are asked line by line, in parallel, each with deadlines of its own ------------

LONGEST_LINE: Final = 65_536
"""Longest line that a program may answer with [bytes]."""
ERROR_TAIL: Final = 2_048
"""How much of what a program wrote to its standard error last is kept [bytes]; the rest is read
and dropped."""
_CHUNK: Final = 65_536
_WARDEN: Final = Path(__file__).with_name("warden.py")
_CLOSING_S: Final = 3.0


@dataclass(frozen=True, slots=True)
class Ceilings:
    """What the system stops a program at.

    Attributes:
        cpu_s: Processor time [s].
        memory: Address space [bytes].
        file_size: Of every file that it writes [bytes].
        open_files: Descriptors.
        processes: Processes at once, with itself; watched on Linux only.
    """

    cpu_s: int
    memory: int
    file_size: int
    open_files: int
    processes: int


@dataclass(frozen=True, slots=True)
class Broken:
    """Why a program did not answer.

    Attributes:
        outcome: What the run's outcome is, see ``guard.Failures``.
        detail: In words.
        is_machine_dependent: Whether the machine's speed or load may have been the cause.
    """

    outcome: str
    detail: str
    is_machine_dependent: bool = False


class _Child:
    """One program as seen from here."""

    def __init__(self, number: int, stdin: int, stdout: int, stderr: int) -> None:
        self.number = number
        self.stdin, self.stdout, self.stderr = stdin, stdout, stderr
        self.unsent = b""
        self.heard = b""
        self.complaint = b""
        self.is_paused = False
        self.is_closed = False
        self.code: int | None = None
        self.why = ""

    def line(self) -> bytes | None:
        """Take the first whole line that it has answered with."""
        line, ending, rest = self.heard.partition(b"\n")
        if not ending:
            return None
        self.heard = rest
        return line


class Children:
    """The programs of a batch, one for each run."""

    def __init__(self) -> None:
        """Start their warden.

        Raises:
            PlatformError: There is no such thing here, or no room for it.
        """
        if os.name != "posix":
            raise PlatformError("channels of kind process need a POSIX system, such as Linux")
        try:
            self._control, other = socket.socketpair()
            with other:
                warden = subprocess.Popen(  # noqa: S603 - our own program
                    [sys.executable, "-I", "-S", "-B", str(_WARDEN), str(other.fileno())],
                    pass_fds=(other.fileno(),),
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    start_new_session=True,
                    env={name: os.environ[name] for name in ("TMPDIR",) if name in os.environ},
                )
            self._selector = selectors.DefaultSelector()
        except OSError as error:
            raise PlatformError(f"no program can be started: {error}") from error
        self._told = b""
        self._children: dict[int, _Child] = {}
        self._selector.register(self._control, selectors.EVENT_READ)
        self._end = weakref.finalize(
            self, _end_all, self._control, self._selector, warden, self._children
        )

    def start(self, number: int, argv: Sequence[str], ceilings: Ceilings) -> None:
        """Start a program.

        Args:
            number: Its id from now on.
            argv: Its path and its arguments.
            ceilings: What it is stopped at.

        Raises:
            PlatformError: Too many descriptors are open.
        """
        try:
            pipes = [os.pipe() for _ in range(3)]
        except OSError as error:
            raise PlatformError(f"no more programs can be started: {error}") from error
        (theirs_in, stdin), (stdout, theirs_out), (stderr, theirs_err) = pipes
        child = _Child(number, stdin, stdout, stderr)
        self._children[number] = child
        for fd in (stdin, stdout, stderr):
            os.set_blocking(fd, False)
        message = {
            "start": number,
            "argv": list(argv),
            "environment": _environment(),
            "limits": {name: getattr(ceilings, name) for name in Ceilings.__slots__},
        }
        try:
            theirs = [theirs_in, theirs_out, theirs_err]
            socket.send_fds(self._control, [json.dumps(message).encode() + b"\n"], theirs)
        except OSError as error:
            raise PlatformError(_LOST) from error
        finally:
            for fd in (theirs_in, theirs_out, theirs_err):
                os.close(fd)
        self._selector.register(stdout, selectors.EVENT_READ, child)
        self._selector.register(stderr, selectors.EVENT_READ, child)

    def ask(
        self, lines: Mapping[int, bytes], patience: Mapping[int, float]
    ) -> dict[int, tuple[bytes | Broken, float]]:
        """Send each program its line and wait for one line of each.

        Args:
            lines: What each is sent, with its line feed.
            patience: How long each may take [s].

        Returns:
            Line without its line feed, or why there is none, and how long it took [s].

        Raises:
            PlatformError: The warden has died.
        """
        begin = time.monotonic()
        answers: dict[int, tuple[bytes | Broken, float]] = {}
        waiting = {number: self._children[number] for number in lines}
        for number, child in waiting.items():
            child.unsent += lines[number]
            self._send(child)
            if child.is_paused:
                child.is_paused = False
                self._selector.register(child.stdout, selectors.EVENT_READ, child)
        touched = list(waiting.values())
        while True:
            passed = time.monotonic() - begin
            for child in touched:
                if child.number in waiting:
                    answer = self._answer(child)
                    if answer is not None:
                        answers[child.number] = answer, passed
                        del waiting[child.number]
            for number in [name for name in waiting if passed >= patience[name]]:
                answers[number] = _late(waiting.pop(number)), passed
            if not waiting:
                return answers
            nearest = min(patience[number] for number in waiting)
            touched = self._wait(nearest - passed, waiting)

    def end(self, number: int) -> None:
        """End a program and forget it; it is not waited for."""
        child = self._children.pop(number, None)
        if child is None:
            return
        for fd in (child.stdin, child.stdout, child.stderr):
            with suppress(KeyError, ValueError):
                self._selector.unregister(fd)
            os.close(fd)
        if child.code is None:
            with suppress(OSError):
                self._control.sendall(json.dumps({"end": number}).encode() + b"\n")

    def close(self) -> None:
        """End every program and the warden, and wait for it."""
        self._end()

    def _send(self, child: _Child) -> None:
        try:
            sent = os.write(child.stdin, child.unsent)
        except BlockingIOError:
            sent = 0
        except OSError:  # it has closed its input; its exit code will say more
            sent = len(child.unsent)
        child.unsent = child.unsent[sent:]
        is_registered = child.stdin in self._selector.get_map()
        if child.unsent and not is_registered:
            self._selector.register(child.stdin, selectors.EVENT_WRITE, child)
        elif not child.unsent and is_registered:
            self._selector.unregister(child.stdin)

    def _wait(self, timeout: float, waiting: Mapping[int, _Child]) -> list[_Child]:
        """Read and write what is ready; return the programs that there is something new of."""
        touched: list[_Child] = []
        for key, _ in self._selector.select(max(0.0, timeout)):
            child: Any = key.data
            if child is None:
                touched += self._listen()
            elif key.fd == child.stdin:
                self._send(child)
            elif key.fd == child.stderr:
                self._read_complaint(child)
            elif child.number in waiting:
                self._read(child)
                touched.append(child)
            else:
                # It is not its turn: it may write until its pipe is full.
                child.is_paused = True
                self._selector.unregister(child.stdout)
        return touched

    def _listen(self) -> list[_Child]:
        try:
            text = self._control.recv(_CHUNK)
        except OSError as error:
            raise PlatformError(_LOST) from error
        if not text:
            raise PlatformError(_LOST)
        *lines, self._told = (self._told + text).split(b"\n")
        ended = []
        for line in lines:
            message = json.loads(line)
            child = self._children.get(message["ended"])
            if child is not None:
                child.code, child.why = message["code"], message["why"]
                ended.append(child)
        return ended

    def _read(self, child: _Child) -> None:
        try:
            text = os.read(child.stdout, _CHUNK)
        except BlockingIOError:
            return
        child.heard += text
        if not text:
            child.is_closed = True
            self._selector.unregister(child.stdout)

    def _read_complaint(self, child: _Child) -> None:
        try:
            text = os.read(child.stderr, _CHUNK)
        except BlockingIOError:
            return
        child.complaint = (child.complaint + text)[-ERROR_TAIL:]
        if not text:
            self._selector.unregister(child.stderr)

    def _answer(self, child: _Child) -> bytes | Broken | None:
        """Return its line, or why none will come; None while one may."""
        if child.code is not None:
            # What it wrote before it ended counts.
            while not child.is_closed and b"\n" not in child.heard and _is_readable(child.stdout):
                self._read(child)
                if len(child.heard) > LONGEST_LINE:
                    break
        line = child.line()
        if len(line if line is not None else child.heard) > LONGEST_LINE:
            return Broken(INVALID_OUTPUT, f"a line of more than {LONGEST_LINE} bytes")
        if line is not None:
            return line
        if child.code is None:
            return None
        while child.stderr in self._selector.get_map() and _is_readable(child.stderr):
            self._read_complaint(child)
        return _ended(child)


_LOST: Final = "the process that watches over the programs of channels has died"


def _late(child: _Child) -> Broken:
    said = "no answer until its deadline"
    if child.heard:
        said = "a part of a line, then nothing until its deadline"
    elif child.is_closed:
        said = "closed its output, and did not end until its deadline"
    return Broken(TIMEOUT, said, is_machine_dependent=True)


def _ended(child: _Child) -> Broken:
    """Say how a program ended that owed an answer."""
    code = child.code
    assert code is not None
    if child.why == "processes":
        return Broken(KILLED, "it had more processes than it may have", is_machine_dependent=True)
    lines = child.complaint.decode("utf-8", "replace").strip().splitlines()
    said = f": {lines[-1].strip()}" if lines else ""
    if code < 0:
        # Processor time, and the memory of the machine, are not the program's alone.
        is_dependent = -code in {signal.SIGXCPU, signal.SIGKILL, signal.SIGTERM}
        return Broken(
            KILLED, f"ended by {_signal_name(-code)}{said}", is_machine_dependent=is_dependent
        )
    if code == 0 and child.heard:
        return Broken(INVALID_OUTPUT, "a part of a line, then it ended")
    return Broken(ERROR, f"ended with code {code} without an answer{said}")


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _is_readable(fd: int) -> bool:
    with selectors.DefaultSelector() as selector:
        selector.register(fd, selectors.EVENT_READ)
        return bool(selector.select(0))


def _environment() -> dict[str, str]:
    """Return all that a program gets to see of the environment; the warden adds its folder."""
    return {
        "PATH": os.environ.get("PATH", os.defpath),
        "LANG": "C.UTF-8",
        "LC_ALL": "C.UTF-8",
        "TZ": "UTC",
    }


def _end_all(
    control: socket.socket,
    selector: selectors.BaseSelector,
    warden: subprocess.Popen[bytes],
    children: dict[int, _Child],
) -> None:
    """Close everything; the warden kills what is left when its socket closes."""
    selector.close()
    for child in children.values():
        for fd in (child.stdin, child.stdout, child.stderr):
            os.close(fd)
    children.clear()
    control.close()
    try:
        warden.wait(_CLOSING_S)
    except subprocess.TimeoutExpired:
        warden.kill()
        warden.wait()


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


class HostedChannel:
    """A channel whose decisions are made by programs, one for each run.

    A program that ends, does not answer in time or answers nonsense is silent from that tick on, in
    its run; it is ended, and so is whatever it started.
    """

    monitor_ids: tuple[str, ...] = ()

    def __init__(self, base_dir: Path) -> None:
        """Remember where files are looked for.

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

    def close(self) -> None:
        """End every program and wait until they have."""
        if self._children is not None:
            self._children.close()
            self._children = None

    def _begin(
        self,
        context: ChannelContext,
        argvs: Sequence[Sequence[str]],
        hellos: Sequence[dict[str, Any]],
        greeting: str,
    ) -> None:
        """Start the program of every run and exchange first lines.

        Args:
            context: Of the batch; its parameters are ``ProgramParameters``.
            argvs: Path and arguments of each run's program.
            hellos: First line that each is sent.
            greeting: Name and version of the protocol that each must answer with.

        Raises:
            PlatformError: The system lets no program be started.
        """
        self.close()
        self._failures = Failures(context.channel_id, context.runs)
        self._previous = no_command(context.channel_id, context.runs)
        self._programs: list[ProgramParameters] = list(context.parameters)
        self._patience = [item.run_deadline for item in self._programs]
        self._ticks = [0] * context.runs
        self._children = Children()
        for run, item in enumerate(self._programs):
            self._children.start(run, argvs[run], _ceilings(item))
        starts = {run: item.start_deadline for run, item in enumerate(self._programs)}
        lines = {run: protocol.encode(hello) for run, hello in enumerate(hellos)}
        for run, line in self._ask(lines, starts, 0.0).items():
            wrong = protocol.wrong_hello(line, greeting)
            if wrong:
                self._fail(run, 0.0, Broken(INVALID_OUTPUT, wrong))

    def _open_runs(self, running: Bools) -> list[int]:
        """Return the runs whose programs are to be asked; those of the others are ended."""
        is_open = running & ~self._failures.silent
        if self._children is not None:
            for run in np.flatnonzero(~is_open):
                self._children.end(int(run))
        return [int(run) for run in np.flatnonzero(is_open)]

    def _ask_step(self, lines: Mapping[int, bytes], time: float) -> dict[int, bytes]:
        """Return the answers of one tick, each within the deadline of a step."""
        return self._ask(lines, {run: self._programs[run].step_deadline for run in lines}, time)

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


class ProcessChannel(HostedChannel):
    """Asks the program of each run for a command at each tick."""

    def __init__(self, base_dir: Path, before: Sequence[str] = ()) -> None:
        """Remember where files are looked for.

        Args:
            base_dir: Folder of the file that names them.
            before: Program that is given the command of the channel, to ask it by other means.
        """
        super().__init__(base_dir)
        self._before = tuple(before)

    def reset(self, context: ChannelContext) -> None:
        """Start the program of every run and exchange first lines.

        Raises:
            SpecError: There is no such program.
            PlatformError: The system lets no program be started.
        """
        named = [item.command for item in context.parameters]
        argvs = {command: find_program(command, self._base_dir) for command in dict.fromkeys(named)}
        hellos = [protocol.hello(context, run) for run in range(context.runs)]
        started = [(*self._before, *argvs[command]) for command in named]
        self._begin(context, started, hellos, protocol.PROTOCOL)

    def act(self, observation: Observation) -> ControlCommand:
        """Ask the program of every run that has not ended."""
        command = self._previous.copy()
        lines = {
            run: protocol.encode(protocol.observation_shown(observation, run, self._ticks[run]))
            for run in self._open_runs(observation.running)
        }
        for run, line in self._ask_step(lines, observation.time).items():
            answer, wrong = protocol.read_command(line, self._ticks[run])
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


def _ceilings(parameters: Any) -> Ceilings:
    limits = parameters.limits
    return Ceilings(
        cpu_s=max(1, round(limits.cpu_time)),
        memory=limits.memory_mib * 2**20,
        file_size=limits.file_mib * 2**20,
        open_files=limits.open_files,
        processes=limits.processes,
    )
