"""The warden as a process: what it starts ends with it, however it or its owner ends."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from adeye.simulate.bridges import warden as subject

LIMITS = {"cpu_s": 20, "memory": 2**30, "file_size": 2**20, "open_files": 32, "processes": 4}
# Who has it says its number: from where that one ends the daemon may be killed at any time.
DAEMON = """
import os, time
if os.fork() == 0:
    os.setsid()
    daemon = os.fork()
    if daemon == 0:
        time.sleep(3600)
    os.write(1, b"%d\\n" % daemon)
    os._exit(0)
time.sleep(3600)
"""


class Warden:
    def __init__(self, folder: Path) -> None:
        self.control, other = socket.socketpair()
        self.outputs: list[int] = []
        with other:
            self.process = subprocess.Popen(
                [sys.executable, "-I", "-S", "-B", subject.__file__, str(other.fileno())],
                pass_fds=(other.fileno(),),
                start_new_session=True,
                env={"TMPDIR": str(folder)},
            )

    def start(self, program: str, **limits: int) -> int:
        """Start a program; return where its output can be read."""
        stdout, theirs = os.pipe()
        self.outputs.append(stdout)
        null = os.open(os.devnull, os.O_RDWR)
        message: dict[str, Any] = {
            "start": 1,
            "argv": [os.path.realpath(sys.executable), "-I", "-S", "-c", program],
            "environment": {"PATH": os.defpath},
            "limits": {**LIMITS, **limits},
            "reads": ["/"],
        }
        line = json.dumps(message).encode() + b"\n"
        socket.send_fds(self.control, [line], [null, theirs, null])
        os.close(theirs)
        os.close(null)
        return stdout

    def says(self) -> dict[str, Any]:
        self.control.settimeout(20.0)
        said: dict[str, Any] = json.loads(self.control.recv(4096))
        return said


@pytest.fixture
def warden(tmp_path: Path) -> Iterator[Warden]:
    made = Warden(tmp_path)
    yield made
    made.control.close()
    made.process.wait(10)
    for output in made.outputs:
        os.close(output)


def read(fd: int) -> str:
    return os.read(fd, 4096).decode().strip()


def wait_until_gone(pid: int) -> bool:
    until = time.monotonic() + 5.0
    while time.monotonic() < until:
        with suppress(OSError):
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z":
                time.sleep(0.01)
                continue
        return True
    return False


def test_program_runs_in_a_session_and_an_empty_folder_of_its_own(warden: Warden) -> None:
    stdout = warden.start(
        "import os\nprint(os.getsid(0) == os.getpid(), os.listdir('.'), sorted(os.environ))"
    )
    assert warden.says() == {"ended": 1, "code": 0, "why": ""}
    assert read(stdout) == "True [] ['HOME', 'LC_CTYPE', 'PATH', 'TMPDIR']"


def test_program_inherits_no_descriptor_and_no_blocked_or_ignored_signal(warden: Warden) -> None:
    stdout = warden.start(
        "import os, signal\n"
        "ignored = [s for s in (15, 10, 17) if signal.getsignal(s) == signal.SIG_IGN]\n"
        "print(os.listdir('/proc/self/fd'), ignored, signal.pthread_sigmask(0, []))"
    )
    warden.says()
    assert read(stdout) == "['0', '1', '2', '3'] [] set()"  # 3 reads the folder


def test_limits_hold(warden: Warden) -> None:
    stdout = warden.start(
        "import resource as r\n"
        "print([r.getrlimit(k)[0] for k in (r.RLIMIT_CPU, r.RLIMIT_AS, r.RLIMIT_FSIZE, "
        "r.RLIMIT_NOFILE, r.RLIMIT_CORE)])"
    )
    warden.says()
    assert json.loads(read(stdout)) == [20, 2**30, 2**20, 32, 0]


def test_told_to_end_a_program_it_asks_first_and_then_kills(warden: Warden) -> None:
    polite = "import signal, sys, time\nsignal.signal(15, lambda *_: sys.exit(3))\n"
    stdout = warden.start(f"{polite}print('up', flush=True)\ntime.sleep(3600)")
    read(stdout)
    warden.control.sendall(b'{"end": 1}\n')
    assert warden.says()["code"] == 3


def test_a_group_is_signalled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    # While a program leaves, its handler is gone: a second request would be its exit code.
    sent: list[str] = []
    monkeypatch.setattr(os, "kill", lambda *_: sent.append("process"))
    monkeypatch.setattr(os, "killpg", lambda *_: sent.append("group"))
    subject._signal_group(7, signal.SIGTERM)
    assert sent == ["group"]


def test_a_process_without_a_group_of_its_own_is_signalled(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_group(*_: object) -> None:
        raise ProcessLookupError

    sent: list[int] = []
    monkeypatch.setattr(os, "kill", lambda pid, _: sent.append(pid))
    monkeypatch.setattr(os, "killpg", no_group)
    subject._signal_group(7, signal.SIGTERM)
    assert sent == [7]


def test_program_that_does_not_listen_is_killed(warden: Warden) -> None:
    stdout = warden.start(
        "import signal, time\nsignal.signal(15, signal.SIG_IGN)\nprint(1, flush=True)\n"
        "time.sleep(3600)"
    )
    read(stdout)
    begin = time.monotonic()
    warden.control.sendall(b'{"end": 1}\n')
    assert warden.says()["code"] == -signal.SIGKILL
    assert subject.GRACE_S <= time.monotonic() - begin < 1.0


def test_process_that_leaves_its_session_is_killed(warden: Warden) -> None:
    stdout = warden.start(DAEMON)
    assert wait_until_gone(int(read(stdout)))


def test_too_many_processes_are_the_end(warden: Warden) -> None:
    warden.start(
        "import os, time\nfor _ in range(20): os.fork() or time.sleep(3600)\ntime.sleep(3600)"
    )
    assert warden.says() == {"ended": 1, "code": -signal.SIGKILL, "why": "processes"}


def test_rest_of_a_program_ends_with_its_leader(warden: Warden) -> None:
    stdout = warden.start(
        "import os, time\npid = os.fork()\nif pid == 0: time.sleep(3600)\nprint(pid, flush=True)"
    )
    pid = int(read(stdout))
    warden.says()
    assert wait_until_gone(pid)


def test_everything_ends_when_the_socket_closes(warden: Warden, tmp_path: Path) -> None:
    stdout = warden.start(
        "import os, time\nos.fork()\nprint(os.getpid(), flush=True)\ntime.sleep(99)"
    )
    # Both lines may come at once, and then nothing more comes while the programs sleep.
    said = ""
    while said.count("\n") < 2:
        said += os.read(stdout, 4096).decode()
    pids = {int(item) for item in said.split()}
    warden.control.close()
    assert warden.process.wait(10) == 0
    assert all(wait_until_gone(pid) for pid in pids)
    assert list(tmp_path.iterdir()) == []


def test_programs_end_with_a_warden_that_is_killed(warden: Warden) -> None:
    stdout = warden.start("import os, time\nprint(os.getpid(), flush=True)\ntime.sleep(3600)")
    pid = int(read(stdout))
    warden.process.kill()
    assert wait_until_gone(pid)


def test_descendants_are_children_and_theirs() -> None:
    program = "import os, sys, time\nos.fork() or (os.fork(), time.sleep(60))\ntime.sleep(60)"
    with subprocess.Popen([sys.executable, "-S", "-c", program]) as process:
        until = time.monotonic() + 10.0
        while len(subject.descendants(process.pid)) < 2 and time.monotonic() < until:
            time.sleep(0.01)
        found = subject.descendants(process.pid)
        assert len(found) == 2
        assert found[0] in subject.children(process.pid)
        for pid in (*found, process.pid):
            os.kill(pid, signal.SIGKILL)
