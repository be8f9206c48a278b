"""Programs that are asked in parallel, each with its own deadline."""

import os
import signal
import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from adeye.errors import PlatformError
from adeye.simulate.bridges.programs import LONGEST_LINE, Broken, Ceilings, Children
from tests.refusals import refused

CEILINGS = Ceilings(cpu_s=20, memory=2**30, file_size=2**20, open_files=32, processes=4)
ECHO = "import sys\nfor line in sys.stdin: print(line, end='', flush=True)"
SLEEP = "import time\ntime.sleep(3600)"


@pytest.fixture
def children() -> Iterator[Children]:
    made = Children()
    yield made
    made.close()


def start(children: Children, number: int, program: str) -> None:
    python = os.path.realpath(sys.executable)
    children.start(number, [python, "-I", "-S", "-c", program], CEILINGS)


def test_each_answers_its_own_line(children: Children) -> None:
    for number in range(4):
        start(children, number, ECHO)
    lines = {number: f"line {number}\n".encode() for number in range(4)}
    answers = children.ask(lines, dict.fromkeys(range(4), 20.0))
    assert answers == {number: f"line {number}".encode() for number in range(4)}


def test_all_are_waited_for_at_the_same_time(children: Children) -> None:
    for number in range(3):
        start(children, number, SLEEP)
    begin = time.perf_counter()
    answers = children.ask(dict.fromkeys(range(3), b"\n"), dict.fromkeys(range(3), 0.4))
    assert 0.4 <= time.perf_counter() - begin < 1.0
    late = Broken("timeout", "no answer until its deadline", is_machine_dependent=True)
    assert answers == dict.fromkeys(range(3), late)


@pytest.mark.slow
def test_patience_of_a_run_is_used_up_by_all_its_answers(children: Children) -> None:
    slow = "import sys, time\nfor line in sys.stdin: time.sleep(0.4); print(flush=True)"
    python = os.path.realpath(sys.executable)
    children.start(0, [python, "-I", "-S", "-c", slow], CEILINGS, 1.0)
    answers = [children.ask({0: b"\n"}, {0: 20.0})[0] for _ in range(2)]
    assert answers == [b"", b""]
    began = time.perf_counter()
    last = [children.ask({0: b"\n"}, {0: 20.0})[0] for _ in range(2)][-1]
    assert isinstance(last, Broken)
    assert time.perf_counter() - began < 1.0


def test_long_lines_go_through_a_pipe_that_is_full(children: Children) -> None:
    start(children, 0, "import sys\nfor line in sys.stdin: print(len(line), flush=True)")
    answers = children.ask({0: b"x" * 1_000_000 + b"\n"}, {0: 20.0})
    assert answers[0] == b"1000001"


def test_longest_line_is_taken_and_a_longer_one_is_not(children: Children) -> None:
    start(children, 0, f"import time\nprint('x' * {LONGEST_LINE}, flush=True)\ntime.sleep(60)")
    start(children, 1, f"import time\nprint('x' * {LONGEST_LINE + 1}, flush=True)\ntime.sleep(60)")
    answers = children.ask({0: b"\n", 1: b"\n"}, {0: 20.0, 1: 20.0})
    assert answers[0] == b"x" * LONGEST_LINE
    assert answers[1] == Broken("invalid_output", "a line of more than 65536 bytes")


def test_last_words_before_the_end_count(children: Children) -> None:
    start(children, 0, "print('bye')")
    assert children.ask({0: b"\n"}, {0: 20.0})[0] == b"bye"
    answer = children.ask({0: b"\n"}, {0: 20.0})[0]
    assert answer == Broken("error", "ended with code 0 without an answer")


def test_program_that_cannot_be_executed_says_why(children: Children, tmp_path: Path) -> None:
    path = tmp_path / "binary"
    path.write_bytes(b"\x7fELF nothing")
    path.chmod(0o755)
    children.start(0, [str(path)], CEILINGS)
    answer = children.ask({0: b"\n"}, {0: 20.0})[0]
    assert isinstance(answer, Broken)
    assert "code 127" in answer.detail
    assert "Exec format error" in answer.detail


def test_pipe_that_closes_after_its_program_is_none_of_our_defects(children: Children) -> None:
    # A child holds it a little longer.
    leaving = "import os, sys, time\nsys.stdin.read()\nif os.fork() == 0: time.sleep(0.1)"
    start(children, 0, leaving)
    assert children.finish(20.0) == {}


def test_daemon_that_a_program_leaves_at_its_end_is_told(children: Children) -> None:
    # It is a child of the program itself, which ends right after.
    leaving = """
import os, sys, time
sys.stdin.read()
if os.fork() == 0:
    os.setsid()
    for fd in range(3):
        os.close(fd)
    time.sleep(3600)
time.sleep(0.1)
"""
    start(children, 0, leaving)
    assert children.finish(20.0) == {}
    assert children.strays == 1


def test_ended_program_is_gone(children: Children) -> None:
    start(children, 0, "import os\nprint(os.getpid(), flush=True)\nimport time\ntime.sleep(3600)")
    answer = children.ask({0: b"\n"}, {0: 20.0})[0]
    assert isinstance(answer, bytes)
    children.end(0)
    children.end(0)
    assert is_gone(int(answer))


def test_forgotten_children_end_too() -> None:
    before = len(list(Path("/proc/self/fd").iterdir()))
    children = Children()
    start(children, 0, "import os\nprint(os.getpid(), flush=True)\nimport time\ntime.sleep(3600)")
    answer = children.ask({0: b"\n"}, {0: 20.0})[0]
    assert isinstance(answer, bytes)
    del children
    assert is_gone(int(answer))
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_dead_warden_is_no_failure_of_the_channel(children: Children) -> None:
    start(children, 0, "import os\nprint(os.getppid(), flush=True)\nimport time\ntime.sleep(3600)")
    warden = children.ask({0: b"\n"}, {0: 20.0})[0]
    assert isinstance(warden, bytes)
    os.kill(int(warden), signal.SIGKILL)
    refused(PlatformError, children.ask, {0: b"\n"}, {0: 20.0}, says="watches over the programs")


def test_system_without_room_for_programs_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def full() -> None:
        raise OSError(24, "Too many open files")

    monkeypatch.setattr(socket, "socketpair", full)
    refused(PlatformError, Children, says="Too many open files")


def test_other_systems_are_told_need(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("adeye.simulate.bridges.programs.os.name", "nt")
    refused(PlatformError, Children, says="POSIX")


def is_gone(pid: int) -> bool:
    until = time.monotonic() + 5.0
    while time.monotonic() < until:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.01)
    return False
