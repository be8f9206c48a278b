"""Programs that are asked line by line, in parallel, each with deadlines of its own.

All programs of a batch are asked at the same time, so that they share the processors and a tick
waits for the slowest only. They run under a warden of their own, see ``warden``; or they listen at
an address and get a connection. Deadlines are on the monotonic clock; all they do is stop what
hangs.
"""

from __future__ import annotations

import errno
import json
import math
import os
import selectors
import signal
import socket
import subprocess
import sys
import sysconfig
import time
import weakref
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import PlatformError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

ERROR: Final = "error"
INVALID_OUTPUT: Final = "invalid_output"
KILLED: Final = "killed"
TIMEOUT: Final = "timeout"
"""Why a program did not answer."""

LONGEST_LINE: Final = 65_536
"""Longest line that a program may answer with [bytes]."""
ERROR_TAIL: Final = 2_048
"""How much of what a program wrote to its standard error last is kept [bytes]; the rest is read
and dropped."""
_CHUNK: Final = 65_536
_WARDEN: Final = Path(__file__).with_name("warden.py")
_PACKAGE: Final = Path(__file__).parents[2]
_SINGLE: Final = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""A warden that reads a program has no threads, for it forks."""
_CLOSING_S: Final = 3.0
_STRAYING_S: Final = 0.2


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
        cause: ``error``, ``invalid_output``, ``killed`` or ``timeout``.
        detail: In words.
        is_machine_dependent: Whether the machine's speed or load may have been the cause.
    """

    cause: str
    detail: str
    is_machine_dependent: bool = False


class _Child:
    """One program as seen from here; one at an address has no standard error and no exit code."""

    def __init__(self, number: int, pipes: tuple[int, ...], patience: float) -> None:
        self.number = number
        self.patience = patience
        self.fds = pipes
        self.stdin, self.stdout, *stderr = pipes
        self.stderr = stderr[0] if stderr else None
        self.was_asked = False
        self.unsent = b""
        self.heard = b""
        self.complaint = b""
        self.is_paused = False
        self.is_closed = False
        self.code: int | None = None
        self.why = ""

    @property
    def is_remote(self) -> bool:
        """Whether it is at an address."""
        return self.stderr is None

    def line(self) -> bytes | None:
        """Take the first whole line that it has answered with."""
        line, ending, rest = self.heard.partition(b"\n")
        if not ending:
            return None
        self.heard = rest
        return line


class Children:
    """The programs of a batch, one for each run.

    Attributes:
        strays: Processes that programs have left behind in sessions of their own up to now.
        unasked: Those whose last answer was there before it was asked for.
    """

    def __init__(self, prepared: str = "") -> None:
        """Start their warden.

        Args:
            prepared: Path of a program of adeye's own that the warden reads once, see there; it is
                what is started without a path.

        Raises:
            PlatformError: There is no such thing here, or no room for it.
        """
        if os.name != "posix":
            raise PlatformError("channels of kind process need a POSIX system, such as Linux")
        try:
            self._control, other = socket.socketpair()
            with other:
                warden = subprocess.Popen(  # noqa: S603 - our own program
                    [
                        *(sys.executable, "-I", *([] if prepared else ["-S"]), "-B"),
                        *(str(_WARDEN), str(other.fileno()), *([prepared] if prepared else [])),
                    ],
                    pass_fds=(other.fileno(),),
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    start_new_session=True,
                    env=_SINGLE | {k: v for k, v in os.environ.items() if k == "TMPDIR"},
                )
            self._selector = selectors.DefaultSelector()
        except OSError as error:
            raise PlatformError(f"no program can be started: {error}") from error
        self._told = b""
        self.strays = 0
        self.unasked: set[int] = set()
        self._children: dict[int, _Child] = {}
        self._selector.register(self._control, selectors.EVENT_READ)
        self._end = weakref.finalize(
            self, _end_all, self._control, self._selector, warden, self._children
        )

    def start(
        self,
        number: int,
        argv: Sequence[str],
        ceilings: Ceilings,
        patience: float = math.inf,
        reads: Sequence[Path] = (),
    ) -> None:
        """Start a program.

        Args:
            number: Its id from now on.
            argv: Its path and its arguments.
            ceilings: What it is stopped at.
            patience: How long it may keep who asks waiting in all [s].
            reads: Files that it may read beside installed software, by their resolved paths; where
                the system can deny it others.

        Raises:
            PlatformError: Too many descriptors are open.
        """
        try:
            pipes = [os.pipe() for _ in range(3)]
        except OSError as error:
            raise PlatformError(f"no more programs can be started: {error}") from error
        (theirs_in, stdin), (stdout, theirs_out), (stderr, theirs_err) = pipes
        child = _Child(number, (stdin, stdout, stderr), patience)
        self._children[number] = child
        for fd in (stdin, stdout, stderr):
            os.set_blocking(fd, False)
        message = {
            "start": number,
            "argv": list(argv),
            "environment": _environment(),
            "limits": {name: getattr(ceilings, name) for name in Ceilings.__slots__},
            "reads": _readable(argv[0] if argv else sys.executable, reads),
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

    def connect(
        self, number: int, place: tuple[str, int], within: float, patience: float = math.inf
    ) -> None:
        """Connect to a program that listens at an address.

        Args:
            number: Its id from now on.
            place: Host and port of TCP.
            within: How long connecting may take [s].
            patience: How long it may keep who asks waiting in all [s].

        Raises:
            PlatformError: Nobody listens there, or the host cannot be reached.
        """
        try:
            with socket.create_connection(place, within) as connection:
                # A line is sent at once and not kept until there is more to send.
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                pipes = os.dup(connection.fileno()), os.dup(connection.fileno())
        except OSError as error:
            host, port = place
            raise PlatformError(
                f"no connection to {host}, port {port}: {error.strerror or error}. Start what is "
                "to listen there, and run again: results so far are kept"
            ) from error
        for fd in pipes:
            os.set_blocking(fd, False)
        self._children[number] = child = _Child(number, pipes, patience)
        self._selector.register(child.stdout, selectors.EVENT_READ, child)

    def ask(
        self, lines: Mapping[int, bytes], patience: Mapping[int, float]
    ) -> dict[int, bytes | Broken]:
        """Send each program its line and wait for one line of each.

        Args:
            lines: What each is sent, with its line feed.
            patience: How long each may take [s], as far as that of its whole run is not used up.

        Returns:
            Line without its line feed, or why there is none; in the order of the numbers.

        Raises:
            PlatformError: The warden has died.
        """
        begin = time.monotonic()
        answers: dict[int, bytes | Broken] = {}
        waiting: dict[int, _Child] = {}
        self.unasked.clear()
        for number, line in lines.items():
            waiting[number] = child = self._children[number]
            if self._has_spoken(child):
                self.unasked.add(number)
            child.unsent += line
            self._send(child)
            self._resume(child)
        until = {number: min(patience[number], child.patience) for number, child in waiting.items()}
        touched = list(waiting.values())
        while True:
            passed = time.monotonic() - begin
            for child in touched:
                if child.number in waiting:
                    answer = self._answer(child)
                    if answer is not None:
                        answers[child.number] = answer
                        child.patience -= passed
                        del waiting[child.number]
            for number in [name for name in waiting if passed >= until[name]]:
                answers[number] = _late(waiting.pop(number))
            if not waiting:
                return dict(sorted(answers.items()))
            nearest = min(until[number] for number in waiting)
            touched = self._wait(nearest - passed, waiting)

    def finish(self, patience: float) -> dict[int, str]:
        """Tell every program by the end of its input that its run is over, and wait for its end.

        Args:
            patience: How long they may take [s].

        Returns:
            Of those that did not end by themselves, said something, or failed, what they did.
        """
        for child in self._children.values():
            _end_input(child)
            self._resume(child)
        speakers = set()
        until = time.monotonic() + patience
        open_ones = dict(self._children)
        while open_ones and (left := until - time.monotonic()) > 0.0:
            for child in self._wait(left, open_ones):
                speakers |= {child.number} if child.heard else set()
                child.heard = b""
                if child.code is not None or (child.is_remote and child.is_closed):
                    open_ones.pop(child.number, None)
        # The warden looks for what has left its session a little later.
        until = time.monotonic() + _STRAYING_S
        while (left := until - time.monotonic()) > 0.0:
            self._wait(left, {})
        found = dict.fromkeys(open_ones, f"goes on for {patience:g} s after the end of its input")
        for number, child in self._children.items():
            if not child.is_closed:
                self._read(child)
            is_wrong = bool(child.code) or bool(child.heard) or number in speakers
            if is_wrong:
                found.setdefault(number, f"{_how(child)} at the end of its input")
        return found

    def end(self, number: int) -> None:
        """End a program and forget it; it is not waited for."""
        child = self._children.pop(number, None)
        if child is None:
            return
        for fd in child.fds:
            self._unlisten(fd)
            os.close(fd)
        if child.code is None and not child.is_remote:
            with suppress(OSError):
                self._control.sendall(json.dumps({"end": number}).encode() + b"\n")

    def close(self) -> None:
        """End every program and the warden, and wait for it."""
        self._end()

    def _has_spoken(self, child: _Child) -> bool:
        """Return whether a line is there that it was not asked for."""
        if not child.was_asked:  # many a program greets by itself
            child.was_asked = True
            return False
        if not child.is_closed:
            self._read(child)
        return b"\n" in child.heard

    def _unlisten(self, fd: int) -> None:
        """Listen to a descriptor no more, also where nobody does: its turn may not have come."""
        with suppress(KeyError, ValueError):
            self._selector.unregister(fd)

    def _resume(self, child: _Child) -> None:
        """Listen again to one whose turn it was not."""
        if child.is_paused:
            child.is_paused = False
            self._selector.register(child.stdout, selectors.EVENT_READ, child)

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
                self._unlisten(child.stdout)
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
            self.strays += "stray" in message
            child = self._children.get(message.get("ended"))
            if child is not None:
                child.code, child.why = message["code"], message["why"]
                ended.append(child)
        return ended

    def _read(self, child: _Child) -> None:
        try:
            text = os.read(child.stdout, _CHUNK)
        except BlockingIOError:
            return
        except OSError:  # a connection that was lost
            text = b""
        child.heard += text
        if not text:
            child.is_closed = True
            self._unlisten(child.stdout)

    def _read_complaint(self, child: _Child) -> None:
        assert child.stderr is not None
        try:
            text = os.read(child.stderr, _CHUNK)
        except BlockingIOError:
            return
        child.complaint = (child.complaint + text)[-ERROR_TAIL:]
        if not text:
            self._unlisten(child.stderr)

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
        if child.is_remote and child.is_closed:
            said = "a part of a line, then " if child.heard else ""
            return Broken(ERROR, f"{said}it closed its connection", is_machine_dependent=True)
        if child.code is None or child.stderr is None:
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
    if os.strerror(errno.EACCES).encode() in child.complaint and is_confined():
        said += " (it reads files that are counted, and installed software)"
    if code < 0:
        # Processor time, and the memory of the machine, are not the program's alone.
        is_dependent = -code in {signal.SIGXCPU, signal.SIGKILL, signal.SIGTERM}
        return Broken(
            KILLED, f"ended by {_signal_name(-code)}{said}", is_machine_dependent=is_dependent
        )
    if code == 0 and child.heard:
        return Broken(INVALID_OUTPUT, "a part of a line, then it ended")
    return Broken(ERROR, f"ended with code {code} without an answer{said}")


def _how(child: _Child) -> str:
    if not child.code:
        return "wrote more"
    if child.code > 0:
        return f"ended with code {child.code}"
    return f"ended by {_signal_name(-child.code)}"


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _end_input(child: _Child) -> None:
    """Close what a program reads; the number of the descriptor stays taken until it is ended."""
    if child.is_remote:
        with suppress(OSError), socket.socket(fileno=os.dup(child.stdin)) as connection:
            connection.shutdown(socket.SHUT_WR)
        return
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, child.stdin, inheritable=False)
    os.close(nothing)


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


_PARTS: Final = ["bin", "sbin", "lib", "lib32", "lib64", "libx32", "libexec", "share", "include"]
_SYSTEM: Final = (
    *("/bin", "/sbin", "/usr", "/opt", "/lib", "/lib32", "/lib64", "/libx32", "/etc"),
    *("/dev", "/proc", "/sys", "/nix", "/gnu", "/snap", "/run/current-system"),
    *("/run/systemd/resolve", "/run/resolvconf", "/run/NetworkManager", "/run/nscd"),
    # What is left of these where a project lies below, as in containers in /usr/src.
    *(f"/usr/{part}" for part in (*_PARTS, "local", *(f"local/{part}" for part in _PARTS))),
)
"""Where systems keep software and themselves; below /run are also disks of people."""
_PROGRAMS: Final = {"bin", "sbin", "shims"}
"""How folders of programs are called that belong to what is around them."""


def is_confined() -> bool:
    """Return whether this system keeps programs to what they may read."""
    if os.name != "posix":  # which the warden needs
        return False
    from adeye.simulate.bridges.warden import has_landlock

    return has_landlock()


def _readable(program: str, files: Sequence[Path]) -> list[str]:
    """List what a program may read: files, and where installed software lies.

    Software is what the system has, what is on the PATH with what is around it, the Python of this
    process and adeye itself; but no folder that one of the files lies in.

    Args:
        program: Its path, which is as if it were on the PATH.
        files: By their resolved paths.
    """
    software = _software(program, os.environ.get("PATH", os.defpath))
    owned = {folder for file in (*files, *_homes()) for folder in file.parents}
    mine = set(map(_place, owned))
    found = [*map(str, files), *(folder for folder in software if _place(folder) not in mine)]
    inside = tuple(f"{folder}/" for folder in found)
    return [path for path in found if not path.startswith(inside)]


def _place(folder: str | Path) -> tuple[int, int]:
    """Return what a folder is, by whatever name: links and mounts have the same."""
    try:
        state = os.stat(folder)  # noqa: PTH116 - of texts as well
    except OSError:
        return -1, -1
    return state.st_dev, state.st_ino


@lru_cache(maxsize=1)
def _homes() -> tuple[Path, ...]:
    """Return a name in each folder that is the user's home."""
    import pwd  # POSIX only, as all that starts a program

    known = {os.path.expanduser("~")}  # noqa: PTH111 - it never fails
    with suppress(KeyError):  # containers have users that nobody knows
        known.add(pwd.getpwuid(os.getuid()).pw_dir)
    return tuple(Path(os.path.realpath(folder), "x") for folder in sorted(known))


@lru_cache(maxsize=64)
def _software(program: str, path: str) -> tuple[str, ...]:
    """List the folders of software that are there."""
    places = [Path(program), *(Path(folder, "x") for folder in path.split(os.pathsep) if folder)]
    own = (sys.prefix, sys.base_prefix, *sysconfig.get_paths().values())
    found = [*map(Path, (*_SYSTEM, *own)), _PACKAGE]
    for place in places:
        for folder in (place.parent, place.parent.resolve(), place.resolve().parent):
            found += [folder, *_around(folder)] if folder.name in _PROGRAMS else [folder]
    return tuple(dict.fromkeys(str(at) for at in found if at.is_absolute() and at.is_dir()))


_OF_USER: Final = ("lib", "pipx", "share/pipx", "share/uv")
"""Software below the user's own folder of programs, beside which applications keep data."""


def _around(folder: Path) -> list[Path]:
    """List where the software of a folder of programs is."""
    above = folder.parent
    is_users = above.name == ".local" and above.parent.resolve() in {at.parent for at in _homes()}
    return [above / name for name in _OF_USER] if is_users else [above]


def _end_all(
    control: socket.socket,
    selector: selectors.BaseSelector,
    warden: subprocess.Popen[bytes],
    children: dict[int, _Child],
) -> None:
    """Close everything; the warden kills what is left when its socket closes."""
    selector.close()
    for child in children.values():
        for fd in child.fds:
            os.close(fd)
    children.clear()
    control.close()
    try:
        warden.wait(_CLOSING_S)
    except subprocess.TimeoutExpired:
        warden.kill()
        warden.wait()


def ceilings_of(parameters: Any) -> Ceilings:
    """Return what the system stops the program of a ``spec.program.ProgramParameters`` at."""
    limits = parameters.limits
    return Ceilings(
        cpu_s=max(1, round(limits.cpu_time)),
        memory=limits.memory_mib * 2**20,
        file_size=limits.file_mib * 2**20,
        open_files=limits.open_files,
        processes=limits.processes,
    )
