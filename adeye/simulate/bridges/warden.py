"""The warden of a batch: starts programs under limits and leaves none of them behind.

It is executed as a program of its own, by name, with the standard library only. It has one thread,
so that it may fork; programs and whatever they start are its descendants, also those that leave
their session; and when the other end of its control socket closes, however that came about, it
kills them all and ends.

A Python program of adeye's own may be read once by the warden, by ``prepare``, and be a fork of it
from then on: what it imports is there already, and each fork is still a process for itself.

Where the system has Landlock, a program reads and executes what lies at or below the paths that it
may read, and in its working folder; any other file that it opens is denied to it.

One message is one line of JSON. It is told ``{"start": id, "argv", "environment", "limits",
"reads"}`` with the three descriptors that become standard input, output and error, and ``{"end":
id}``; it says ``{"ended": id, "code": exit code or minus the signal, "why": ""}``, and ``{"stray":
process}`` of what has left its session and outlives who started it.
"""

from __future__ import annotations

import ctypes
import json
import os
import resource
import selectors
import shutil
import signal
import socket
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

GRACE_S = 0.3
"""Time between asking a program to end (SIGTERM) and ending it (SIGKILL)."""
WATCH_S = 0.05
"""Time between two looks at how many processes each program has."""
SWEEP_S = 1.0
"""Longest that the warden tries to kill what has survived, before it ends itself."""
_SET_PDEATHSIG, _SET_CHILD_SUBREAPER, _SET_NO_NEW_PRIVS = 1, 36, 38  # linux/prctl.h
_IS_LINUX = sys.platform == "linux"
_LIBC = ctypes.CDLL(None, use_errno=True)
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # landlock(7); alike on every machine
_ASK_VERSION, _PATH_BENEATH = 1, 1  # linux/landlock.h
_EXECUTE, _READ_FILE = 1 << 0, 1 << 2


def _prctl(option: int, value: int) -> None:
    if _IS_LINUX:
        _LIBC.prctl(option, value, 0, 0, 0)


def landlock(number: int, *arguments: Any) -> int:
    """Call one of the three calls of Landlock.

    Raises:
        OSError: The system does not have it, or refuses.
    """
    found: int = _LIBC.syscall(ctypes.c_long(number), *arguments)
    if found < 0:
        error = ctypes.get_errno()
        raise OSError(error, os.strerror(error))
    return found


def has_landlock() -> bool:
    """Return whether what a program reads can be confined on this system."""
    if not _IS_LINUX:
        return False
    try:
        return landlock(_CREATE_RULESET, None, ctypes.c_size_t(0), _ASK_VERSION) > 0
    except OSError:
        return False


class _Beneath(ctypes.Structure):
    """``struct landlock_path_beneath_attr``."""

    _pack_ = 1
    _fields_ = (("allowed_access", ctypes.c_uint64), ("parent_fd", ctypes.c_int32))


def _confine(paths: list[str]) -> None:
    """Let this process and what it starts read and execute nothing but what is at these paths.

    Names, sizes and times of other files are still seen, and it may write where its user may.
    """
    handled = ctypes.c_uint64(_EXECUTE | _READ_FILE)
    size = ctypes.c_size_t(ctypes.sizeof(handled))
    rules = landlock(_CREATE_RULESET, ctypes.byref(handled), size, 0)
    for path in paths:
        try:
            place = os.open(path, os.O_PATH | os.O_CLOEXEC)
        except OSError:  # what is not there is not read
            continue
        rule = _Beneath(handled.value, place)
        landlock(_ADD_RULE, rules, _PATH_BENEATH, ctypes.byref(rule), 0)
        os.close(place)
    landlock(_RESTRICT_SELF, rules, 0)
    os.close(rules)


def children(pid: int) -> list[int]:
    """Return the child processes of a process, as far as the system tells."""
    found: list[int] = []
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            with suppress(OSError):
                found.extend(map(int, (task / "children").read_text("ascii").split()))
    return found


def descendants(pid: int) -> list[int]:
    """Return the children of a process, theirs, and so on."""
    found: list[int] = []
    open_ends = [pid]
    while open_ends:
        below = children(open_ends.pop())
        found += below
        open_ends += below
    return found


class _Program:
    """One started program: the leader of its session.

    Attributes:
        number: Its id in messages.
        most: Processes that it may have at once.
        kill_at: When it is killed if it has not ended, on the monotonic clock.
        why: Why the warden ended it by itself.
    """

    def __init__(self, number: int, most: int) -> None:
        self.number = number
        self.most = most
        self.kill_at = float("inf")
        self.why = ""


class Warden:
    """Serves one control socket until it closes."""

    def __init__(self, control: socket.socket, run: Callable[[], None] | None) -> None:
        """Prepare.

        Args:
            control: Its end of the socket.
            run: What programs are that are told to begin without a path.
        """
        self._control = control
        self._run = run
        self._folder = Path(tempfile.mkdtemp(prefix="adeye-"))
        self._programs: dict[int, _Program] = {}
        self._leaders: set[int] = set()
        self._fds: list[int] = []
        self._text = b""
        self._watched = 0.0

    def serve(self) -> None:
        """Start and end programs as told; kill all of them at the end."""
        awake, alarm = os.pipe()
        os.set_blocking(alarm, False)
        signal.set_wakeup_fd(alarm, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        with selectors.DefaultSelector() as selector:
            selector.register(self._control, selectors.EVENT_READ)
            selector.register(awake, selectors.EVENT_READ)
            try:
                while True:
                    # What a program left behind may outlive it.
                    is_watched = self._programs or (_IS_LINUX and children(os.getpid()))
                    ready = selector.select(WATCH_S if is_watched else None)
                    fds = {key.fd for key, _ in ready}
                    if awake in fds:
                        os.read(awake, 4096)
                    if self._control.fileno() in fds and not self._listen():
                        return
                    self._reap()
                    self._look_after()
            except OSError:  # the other end has closed
                return
            finally:
                self._sweep()
                shutil.rmtree(self._folder, ignore_errors=True)

    def _listen(self) -> bool:
        text, fds, _, _ = socket.recv_fds(self._control, 1 << 16, 3)
        if not text:
            return False
        self._fds += fds
        self._text += text
        *lines, self._text = self._text.split(b"\n")
        for line in lines:
            message = json.loads(line)
            if "start" in message:
                self._start(message)
            else:
                self._end(message["end"])
        return True

    def _start(self, message: dict[str, Any]) -> None:
        fds, self._fds = self._fds[:3], self._fds[3:]
        folder = self._folder / str(message["start"])
        folder.mkdir(mode=0o700)
        pid = os.fork()
        if pid == 0:
            _become(message, str(folder), fds, self._run)
        for fd in fds:
            os.close(fd)
        self._programs[pid] = _Program(message["start"], message["limits"]["processes"])
        self._leaders.add(pid)

    def _end(self, number: int) -> None:
        for pid, program in self._programs.items():
            if program.number == number and program.kill_at == float("inf"):
                program.kill_at = time.monotonic() + GRACE_S
                for name in (signal.SIGTERM, signal.SIGCONT):
                    _signal_group(pid, name)

    def _reap(self) -> None:
        """Take the exit codes of what has ended; the rest of its group ends with a leader."""
        while True:
            try:
                # The id stays taken until the group has been killed.
                ended = os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
            except ChildProcessError:
                return
            if ended is None:
                return
            pid = ended.si_pid
            program = self._programs.pop(pid, None)
            if program is not None:
                _signal_group(pid, signal.SIGKILL)
            _, status = os.waitpid(pid, 0)
            if program is not None:
                shutil.rmtree(self._folder / str(program.number), ignore_errors=True)
                code = os.waitstatus_to_exitcode(status)
                self._say({"ended": program.number, "code": code, "why": program.why})

    def _look_after(self) -> None:
        """Kill what has not ended in time, has too many processes, or left its session."""
        now = time.monotonic()
        for pid, program in self._programs.items():
            if now >= program.kill_at:
                _kill_all(pid)
        if not _IS_LINUX or now < self._watched + WATCH_S:
            return
        self._watched = now
        for pid, program in self._programs.items():
            if 1 + len(descendants(pid)) > program.most:
                program.why = "processes"
                _kill_all(pid)
        for pid in children(os.getpid()):
            session = _session(pid)
            if pid not in self._programs and session not in self._programs:
                _kill_all(pid)
                if session not in self._leaders:  # else it ends with its leader
                    self._say({"stray": pid})

    def _say(self, content: dict[str, Any]) -> None:
        self._control.sendall(json.dumps(content).encode() + b"\n")

    def _sweep(self) -> None:
        """Kill every descendant, also those that come into being meanwhile."""
        for pid in self._programs:
            _kill_all(pid)
        until = time.monotonic() + SWEEP_S
        while time.monotonic() < until:
            for pid in children(os.getpid()):
                _kill_all(pid)
            try:
                if os.waitpid(-1, os.WNOHANG)[0] == 0:
                    time.sleep(0.002)
            except ChildProcessError:
                return


def _session(pid: int) -> int:
    try:
        return os.getsid(pid)
    except OSError:
        return 0


def _signal_group(pid: int, name: signal.Signals) -> None:
    # Once and no more: a program that is already leaving has no handler left for a second signal.
    try:
        os.killpg(pid, name)
    except OSError:  # between fork and setsid it has no group of its own yet
        with suppress(OSError):
            os.kill(pid, name)


def _kill_all(pid: int) -> None:
    # The group first and at once: nothing in it can fork away.
    _signal_group(pid, signal.SIGKILL)
    for below in descendants(pid):
        with suppress(OSError):
            os.kill(below, signal.SIGKILL)


def _become(
    message: dict[str, Any], folder: str, fds: list[int], run: Callable[[], None] | None
) -> None:
    """Turn this forked process into the program; it never returns."""
    try:
        os.setsid()
        _prctl(_SET_PDEATHSIG, signal.SIGKILL)
        _prctl(_SET_NO_NEW_PRIVS, 1)
        signal.set_wakeup_fd(-1)
        for name in signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP}:
            with suppress(OSError, ValueError):
                signal.signal(name, signal.SIG_DFL)
        for target, fd in enumerate(fds):
            os.dup2(fd, target, inheritable=True)
        os.chdir(folder)
        os.umask(0o077)
        limits = message["limits"]
        for kind, value in (
            (resource.RLIMIT_CPU, limits["cpu_s"]),
            (resource.RLIMIT_AS, limits["memory"]),
            (resource.RLIMIT_FSIZE, limits["file_size"]),
            (resource.RLIMIT_NOFILE, limits["open_files"]),
            (resource.RLIMIT_CORE, 0),
        ):
            _limit(kind, value)
        os.closerange(3, max(4096, *fds) + 1)
        if has_landlock():
            _confine([folder, *message["reads"]])
        environment = {**message["environment"], "HOME": folder, "TMPDIR": folder}
        if message["argv"]:
            os.execve(message["argv"][0], message["argv"], environment)  # noqa: S606 - no shell
        os.environ.clear()
        os.environ.update(environment)
        tempfile.tempdir = None
        _be_run(run)
    except BaseException as error:  # noqa: BLE001 - said on its standard error, as a program would
        os.write(2, f"cannot be started: {error}\n".encode())
    os._exit(127)


def _be_run(run: Callable[[], None] | None) -> None:
    """Run what was prepared as a program that Python has started, and end as that would."""
    code = 1
    try:
        assert run is not None
        run()
        code = 0
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 1
        if code and not isinstance(error.code, int):
            os.write(2, f"{error.code}\n".encode(errors="replace"))
    except BaseException as error:  # noqa: BLE001 - its last line is what is told
        os.write(2, f"{type(error).__name__}: {error}\n".encode(errors="replace"))
    os._exit(code)


def _limit(kind: int, value: int) -> None:
    """Set a limit, as far as the one that holds already allows."""
    _, hard = resource.getrlimit(kind)
    value = value if hard == resource.RLIM_INFINITY else min(value, hard)
    # A little later, so that the soft limit's signal names the cause.
    most = value + 1 if kind == resource.RLIMIT_CPU else value
    resource.setrlimit(kind, (value, most if hard == resource.RLIM_INFINITY else min(most, hard)))


def main(arguments: list[str]) -> None:
    """Serve the control socket whose descriptor is named."""
    _prctl(_SET_CHILD_SUBREAPER, 1)
    with socket.socket(fileno=int(arguments[1])) as control:
        Warden(control, _prepared(Path(arguments[2])) if arguments[2:] else None).serve()


def _prepared(path: Path) -> Callable[[], None]:
    """Read a program, let it import what it needs, and return what it does."""
    spec = spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    module.prepare()
    run: Callable[[], None] = module.main
    return run


if __name__ == "__main__":
    main(sys.argv)
