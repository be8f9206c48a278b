"""Rate, remaining time, and who is shown a live line."""

import io
import sys
from dataclasses import dataclass

import pytest

from adeye.cli.progress import Meter, duration, is_live, line, reporting, watching


@dataclass(frozen=True)
class State:
    done: int
    total: int = 100
    failures: int = 0
    phase: str = "run"


class Screen(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_what_was_there_at_the_start_does_not_count_as_speed() -> None:
    meter = Meter()
    assert meter.update(State(50), 10.0) == ("", "")
    assert meter.update(State(60), 15.0) == ("2/s", "20 s left")


def test_a_new_phase_starts_the_clock_again() -> None:
    meter = Meter()
    meter.update(State(0), 0.0)
    meter.update(State(100), 10.0)
    meter.update(State(0, total=4, phase="report"), 100.0)
    assert meter.update(State(2, total=4, phase="report"), 101.0) == ("2/s", "1 s left")


def test_finished_has_no_time_left() -> None:
    meter = Meter()
    meter.update(State(0), 0.0)
    assert meter.update(State(100), 1.0) == ("100/s", "")


def test_durations_for_people() -> None:
    assert [duration(s) for s in (0.4, 59.4, 59.6, 3599, 3600)] == [
        "0 s",
        "59 s",
        "1 min 0 s",
        "59 min 59 s",
        "1 h 0 min",
    ]


def test_no_terminal_gets_one_line_at_each_end(capsys: pytest.CaptureFixture[str]) -> None:
    with reporting("12 test cases") as report:
        for done in range(13):
            report(State(done, total=12))
    written = capsys.readouterr()
    lines = written.err.splitlines()
    assert [line.split(":")[0] for line in lines] == ["12 test cases …", "12 test cases"]
    assert written.out == ""


def test_quiet_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with reporting("12 test cases", quiet=True) as report:
        report(State(1))
    assert capsys.readouterr() == ("", "")


def test_who_watches_without_a_terminal_is_told_nothing(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with watching() as report:
        report(State(1))
    assert capsys.readouterr() == ("", "")


def test_error_inside_prints_no_end(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), reporting("work"):
        raise KeyboardInterrupt
    assert "done" not in capsys.readouterr().err


def test_terminal_shows_rate_and_failures(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Screen()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.delenv("CI", raising=False)
    with reporting("work") as report:
        report(State(0, phase="r\x1bun"))
        report(State(10, failures=3, phase="r\x1bun"))
    text = screen.getvalue()
    assert "run" in text
    for part in ("10/100", "/s", "left", "3 failed"):
        assert part in text


@pytest.mark.parametrize(("name", "value"), [("CI", "true"), ("TERM", "dumb")])
def test_ci_and_dumb_terminals_are_not_live(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setattr(sys, "stderr", Screen())
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("CI", raising=False)
    assert is_live()
    monkeypatch.setenv(name, value)
    assert not is_live()


def test_long_work_without_a_terminal_shows_life_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = iter([0.0, 1.0, 30.0, 61.0, 62.0, 121.0, 130.0])
    monkeypatch.setattr("adeye.cli.progress.time.perf_counter", lambda: next(now))
    with reporting("100 test cases") as report:
        for done, failures in ((0, 0), (10, 0), (60, 3), (61, 3), (90, 4)):
            report(State(done, failures=failures))
    assert capsys.readouterr().err.splitlines()[1:-1] == [
        "run: 60/100, 1/s, 40 s left, 3 failed",
        "run: 90/100, 0.75/s, 13 s left, 4 failed",
    ]


def test_waiting_for_others_is_said_in_words() -> None:
    assert line(State(3, phase="wait"), "", "") == "wait for other runners: 3/100"
    assert line(State(1000, 2000, phase="r\x1bun"), "", "") == "run: 1,000/2,000"
