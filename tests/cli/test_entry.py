"""How the program ends: one message, the right code, never 0 by accident."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import adeye.campaign.plan
from adeye import errors
from adeye.errors import SourceLocation, Terminated

ROOT = Path(__file__).parents[2]
PLACE = SourceLocation("odd/first.yaml", 14, 9)


@pytest.fixture
def plan_raises(monkeypatch: pytest.MonkeyPatch) -> Callable[[BaseException], None]:
    """Make ``adeye plan`` raise."""

    def arrange(error: BaseException) -> None:
        def make_plan(*_arguments: Any, **_options: Any) -> Any:
            raise error

        monkeypatch.setattr(adeye.campaign.plan, "make_plan", make_plan)

    return arrange


def start(*arguments: str, cwd: Path, **options: Any) -> subprocess.Popen[str]:
    environment = {name: value for name, value in os.environ.items() if name[:6] != "ADEYE_"}
    return subprocess.Popen(
        [sys.executable, "-m", "adeye", *arguments],
        cwd=cwd,
        env={**environment, "PYTHONPATH": str(ROOT)},
        stdout=options.pop("stdout", subprocess.PIPE),
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (
            errors.SweepError("gap: 0 s", where=PLACE, remedy="Write a length."),
            2,
            "SweepError: odd/first.yaml:14:9: gap: 0 s. Write a length.\n",
        ),
        (errors.PlatformError("database x is locked"), 5, "PlatformError: database x is locked\n"),
        (errors.IntegrityError("row 7"), 4, "IntegrityError: row 7\n"),
        (OSError(28, "No space left on device"), 5, "PlatformError: No space left on device.\n"),
        (MemoryError(), 5, "PlatformError: out of memory. Use fewer workers.\n"),
    ],
)
def test_error_is_one_message_and_its_exit_code(
    adeye: Any, plan_raises: Any, error: Exception, code: int, message: str
) -> None:
    plan_raises(error)
    ended = adeye("plan", "odd.yaml")
    assert (ended.code, ended.err, ended.out) == (code, message, "")


def test_several_input_errors_are_one_line_each(adeye: Any, plan_raises: Any) -> None:
    plan_raises(errors.InputErrors([errors.SpecError("a"), errors.UnitError("b")]))
    ended = adeye("plan", "odd.yaml")
    assert (ended.code, ended.err) == (2, "SpecError: a.\nUnitError: b.\n2 errors.\n")


def test_defect_says_so_without_traceback(adeye: Any, plan_raises: Any) -> None:
    plan_raises(KeyError("speed"))
    ended = adeye("plan", "odd.yaml")
    assert ended.code == 3
    assert "KeyError: 'speed'" in ended.err
    assert "defect of adeye" in ended.err
    assert "ADEYE_DEBUG=1" in ended.err
    assert "Traceback" not in ended.err


def test_debug_prints_the_traceback_and_is_forgotten(adeye: Any, plan_raises: Any) -> None:
    plan_raises(KeyError("speed"))
    assert "Traceback" in adeye("--debug", "plan", "odd.yaml").err
    assert "Traceback" not in adeye("plan", "odd.yaml").err


def test_debug_by_environment_prints_the_traceback(
    adeye: Any, plan_raises: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ADEYE_DEBUG", "1")
    plan_raises(errors.SpecError("a"))
    ended = adeye("plan", "odd.yaml")
    assert ended.code == 2
    assert "Traceback" in ended.err


def test_control_characters_of_a_message_do_not_reach_the_terminal(
    adeye: Any, plan_raises: Any
) -> None:
    plan_raises(errors.SpecError("name 'a\x1b]0;title\x07b'"))
    assert adeye("plan", "odd.yaml").err == "SpecError: name 'a]0;titleb'.\n"


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (Terminated(), 143)])
def test_interruption_has_its_code_and_no_traceback(
    adeye: Any, plan_raises: Any, error: BaseException, code: int
) -> None:
    plan_raises(error)
    ended = adeye("plan", "odd.yaml")
    assert (ended.code, ended.err) == (code, "")


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("rnu",), "Did you mean 'run'?"),
        (("run",), "Missing argument 'ODD'"),
        (("run", "odd.yaml", "--wokers", "2"), "--workers"),
        (("run", "odd.yaml", "--workers", "0"), "'--workers'"),
        (("query", "--format", "xml"), "table"),
    ],
)
def test_wrong_usage_is_one_line_and_code_2(
    adeye: Any, arguments: tuple[str, ...], part: str
) -> None:
    ended = adeye(*arguments)
    assert ended.code == 2
    assert ended.err.startswith("UsageError: ")
    assert part in ended.err
    assert ended.err.count("\n") == 1
    assert ended.out == ""


def test_without_a_verb_the_help_is_shown_once_and_the_code_is_2(adeye: Any) -> None:
    ended = adeye()
    assert ended.code == 2
    assert (ended.out + ended.err).count("Usage: adeye") == 1


def test_missing_file_names_it(adeye: Any) -> None:
    ended = adeye("plan", "no_such.yaml")
    assert ended.code == 2
    assert "no_such.yaml" in ended.err


@pytest.mark.slow
def test_unreadable_output_encoding_does_not_end_the_program(folder: Path) -> None:
    process = start("query", "--list", cwd=folder)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")
    assert "failing-fsrs" in out


@pytest.mark.slow
def test_reader_that_goes_away_is_no_error(folder: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    process = start("scenario", "list", "--json", cwd=folder, stdout=writing)
    os.close(writing)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")


@pytest.mark.slow
def test_full_disk_is_an_environment_error(folder: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    with Path("/dev/full").open("w") as full:
        process = start("scenario", "list", "--json", cwd=folder, stdout=full)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 5
    assert err.startswith("PlatformError: ")
    assert err.count("\n") == 1


@pytest.mark.slow
def test_sigterm_ends_with_143(folder: Path) -> None:
    with start("query", "-", cwd=folder, stdin=subprocess.PIPE) as process:
        # It waits for the statement; give it time to get there.
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(timeout=4)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=60) == 143
