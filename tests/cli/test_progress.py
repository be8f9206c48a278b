"""Progress for people, and what Ctrl-C and SIGTERM do."""

import io
import signal
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import Mock

import pytest

from adeye import notices
from adeye.campaign import executors, plan
from adeye.campaign.run import Stop
from adeye.cli import output, progress
from adeye.cli.options import plan_of
from adeye.errors import Terminated
from tests.refusals import refused

# --- rate, remaining time, and who is shown a live line


@dataclass(frozen=True)
class State:
    done: int
    total: int = 100
    failures: int = 0
    phase: str = "run"


class Screen(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_speed_is_that_of_the_phase_and_what_was_there_at_its_start_does_not_count() -> None:
    meter = progress.Meter()
    for state, now, told in (
        (State(50), 10.0, ("", "")),
        (State(60), 15.0, ("2/s", "20 s left")),
        (State(100), 35.0, ("2/s", "")),
        (State(0, total=4, phase="report"), 100.0, ("", "")),
        (State(2, total=4, phase="report"), 101.0, ("2/s", "1 s left")),
    ):
        assert meter.update(state, now) == told
    assert meter.update(State(4, total=4, phase="report"), 101.0)[1] == ""


def test_durations_for_people() -> None:
    told = ["0 s", "59 s", "1 min 0 s", "59 min 59 s", "1 h 0 min"]
    assert [progress.duration(s) for s in (0.4, 59.4, 59.6, 3599, 3600)] == told


def test_no_terminal_gets_one_line_at_each_end(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.reporting("12 test cases") as report:
        for done in range(13):
            report(State(done, total=12))
    written = capsys.readouterr()
    lines = written.err.splitlines()
    assert [line.split(":")[0] for line in lines] == ["12 test cases …", "12 test cases"]
    assert written.out == ""


def test_who_is_quiet_is_told_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    for shown in (progress.reporting("12 test cases", quiet=True), progress.watching()):
        with shown as report:
            report(State(1))
        assert capsys.readouterr() == ("", "")


def test_error_inside_prints_no_end(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), progress.reporting("work"):
        raise KeyboardInterrupt
    assert "done" not in capsys.readouterr().err


def watched(monkeypatch: pytest.MonkeyPatch) -> Screen:
    """Let somebody watch."""
    screen = Screen()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.delenv("CI", raising=False)
    return screen


def impatient(monkeypatch: pytest.MonkeyPatch) -> Screen:
    """Let somebody watch who has no patience."""
    monkeypatch.setattr(progress, "PATIENCE_S", 0.0)
    return watched(monkeypatch)


def wait_for_line(screen: Screen) -> None:
    """Wait until a thread has drawn it."""
    end = time.monotonic() + 60.0
    while "Verifying: 12 rows" not in screen.getvalue():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_what_is_being_done_is_shown_until_something_is_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    screen = impatient(monkeypatch)
    with progress.ongoing():
        notices.doing("Verifying: 12 rows")
        wait_for_line(screen)
        output.talk("the end")
        written = screen.getvalue()
        # The line is gone when another one is written, and the cursor is there again.
        assert written.endswith(("\x1b[?25hthe end\n", "\x1b[2Kthe end\n"))
    assert screen.getvalue() == written
    notices.doing("nobody watches")
    assert screen.getvalue() == written


def test_whoever_shows_something_else_ends_the_line(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = impatient(monkeypatch)
    with progress.ongoing():
        for other in (progress.waiting("a dozen cases"), progress.reporting("12 test cases")):
            screen.truncate(0)
            notices.doing("Verifying: 12 rows")
            wait_for_line(screen)
            with other:
                written = screen.getvalue()
                time.sleep(0.3)
                assert "Verifying" not in screen.getvalue()[len(written) :]


def test_what_takes_no_time_is_not_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = impatient(monkeypatch)
    monkeypatch.setattr(progress, "PATIENCE_S", 60.0)
    with progress.ongoing():
        notices.doing("Verifying: 12 rows")
    assert not screen.getvalue()


@pytest.mark.parametrize("quiet", [True, False])
def test_a_bar_or_silence_leaves_no_room_for_it(
    monkeypatch: pytest.MonkeyPatch, *, quiet: bool
) -> None:
    screen = impatient(monkeypatch)
    with progress.ongoing(), progress.reporting("12 test cases", quiet=quiet):
        notices.doing("Verifying: 12 rows")
        time.sleep(0.3)
    assert "Verifying" not in screen.getvalue()


def test_terminal_shows_what_a_plan_waits_for_unless_quiet(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    screen = watched(monkeypatch)
    monkeypatch.setattr(plan, "make_plan", Mock())
    for quiet, shown in ((True, ""), (False, "Checking [b]odd.yaml; formulas are compiled")):
        plan_of(Path("[b]o\x1bdd.yaml"), "batch", None, quiet=quiet)
        assert shown in screen.getvalue()
        assert bool(shown) == bool(screen.getvalue())


def test_terminal_shows_rate_and_failures(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = watched(monkeypatch)
    with progress.reporting("work") as report:
        report(State(0, phase="r\x1bun"))
        report(State(10, failures=3, phase="r\x1bun"))
    text = screen.getvalue()
    assert "run" in text
    for part in ("10/100", "/s", "left", "3 failed"):
        assert part in text


def test_ci_and_dumb_terminals_are_not_live(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", Screen())
    for name, value in (("CI", "true"), ("TERM", "dumb")):
        monkeypatch.setenv("TERM", "xterm")
        monkeypatch.delenv("CI", raising=False)
        assert progress.is_live()
        monkeypatch.setenv(name, value)
        assert not progress.is_live()


def test_long_work_without_a_terminal_shows_life_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = iter([0.0, 1.0, 30.0, 61.0, 62.0, 121.0, 130.0])
    monkeypatch.setattr("adeye.cli.progress.time.perf_counter", lambda: next(now))
    with progress.reporting("100 test cases") as report:
        for done, failures in ((0, 0), (10, 0), (60, 3), (61, 3), (90, 4)):
            report(State(done, failures=failures))
    assert capsys.readouterr().err.splitlines()[1:-1] == [
        "run: 60/100, 1/s, 40 s left, 3 failed",
        "run: 90/100, 0.75/s, 13 s left, 4 failed",
    ]


def test_waiting_for_others_is_said_in_words() -> None:
    assert progress.line(State(3, phase="wait"), "", "") == "wait for other runners: 3/100"
    assert progress.line(State(1000, 2000, phase="r\x1bun"), "", "") == "run: 1,000/2,000"


# --- signals become exceptions, wishes, and at last the end


def test_sigterm_raises_inside_and_the_former_handler_comes_back() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(Terminated), progress.raising_on_sigterm():
        signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) == before


def test_what_compiled_code_makes_of_it_stands_for_it() -> None:
    class Named:
        def __set_name__(self, _owner: object, _name: str) -> None:
            signal.raise_signal(signal.SIGTERM)

    def make() -> None:
        type("Owner", (), {"part": Named()})

    with pytest.raises(Terminated) as caught, progress.raising_on_sigterm():
        make()
    assert isinstance(caught.value.__cause__, RuntimeError)
    with pytest.raises(RuntimeError, match="its own"), progress.raising_on_sigterm():
        raise RuntimeError("its own")


def test_another_thread_leaves_the_handler_alone() -> None:
    before = signal.getsignal(signal.SIGTERM)
    seen: list[object] = []

    def look() -> None:
        with progress.raising_on_sigterm():
            seen.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert seen == [before]


class Ended(BaseException):
    """Stands for the end of the process."""


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Note the exit code of a process that would have ended."""
    codes: list[int] = []

    def end(code: int) -> None:
        codes.append(code)
        raise Ended

    monkeypatch.setattr("adeye.cli.progress.os._exit", end)
    return codes


@pytest.mark.parametrize(
    ("name", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)]
)
def test_outside_of_blocks_it_interrupts(name: signal.Signals, kind: type[BaseException]) -> None:
    before = signal.getsignal(name)
    with pytest.raises(kind), progress.asking(Stop(), "go on"):
        signal.raise_signal(name)
    assert signal.getsignal(name) == before


def test_inside_of_blocks_the_first_signal_is_a_wish(capsys: pytest.CaptureFixture[str]) -> None:
    stop, went_on = Stop(is_deferred=True), []
    with progress.asking(stop, "go on"):
        signal.raise_signal(signal.SIGTERM)
        went_on.append(signal.getitimer(signal.ITIMER_REAL)[0])
    assert stop.asked is Terminated
    assert 0.0 < went_on[0] <= progress.GRACE_S
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0
    assert "gets 5 s to end" in capsys.readouterr().err


def test_blocks_that_do_not_end_in_time_are_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "GRACE_S", 0.05)
    stop = Stop(is_deferred=True)

    def execute() -> None:
        with progress.asking(stop, "go on"):
            signal.raise_signal(signal.SIGINT)
            while True:
                time.sleep(0.01)

    refused(KeyboardInterrupt, execute)


def test_second_signal_kills_the_workers_and_ends(
    monkeypatch: pytest.MonkeyPatch, ends: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    killed: list[bool] = []
    monkeypatch.setattr(executors, "kill_workers", lambda: killed.append(True))
    stop = Stop(is_deferred=True)

    def execute() -> None:
        with progress.asking(stop, "go on with this"):
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGINT)

    refused(Ended, execute)
    assert (ends, killed) == ([130], [True])
    assert "go on with this" in capsys.readouterr().err


@pytest.mark.parametrize("is_running", [False, True])
def test_process_ends_at_once_only_where_a_block_would_be_waited_for(
    monkeypatch: pytest.MonkeyPatch,
    ends: list[int],
    is_running: bool,  # noqa: FBT001 - a table
) -> None:
    monkeypatch.setattr(executors, "is_abandoned_work_running", lambda: is_running)
    if is_running:
        refused(Ended, progress.leave_if_abandoned, 143)
    else:
        progress.leave_if_abandoned(143)
    assert ends == [143] * is_running
