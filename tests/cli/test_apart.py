"""Standard output is for results, whatever prints or closes it meanwhile."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from adeye.cli.output import emit, results, results_apart
from tests.project import ROOT


def say(text: str) -> None:
    print(text)  # noqa: T201 - as code from outside does


def test_what_others_print_meanwhile_goes_to_standard_error(
    capfd: pytest.CaptureFixture[str],
) -> None:
    say("before")
    with results_apart():
        say("a plug-in")
        os.write(1, b"a library\n")
        emit("a result")
        subprocess.run([sys.executable, "-c", "print('a worker')"], check=True)
    say("after")
    sys.stdout.flush()
    written = capfd.readouterr()
    assert written.out == "before\na result\nafter\n"
    assert sorted(written.err.splitlines()) == ["a library", "a plug-in", "a worker"]


def test_it_is_laid_apart_once(capfd: pytest.CaptureFixture[str]) -> None:
    with results_apart():
        stream = results()
        with results_apart():
            assert results() is stream
            emit("a result")
    assert results() is sys.stdout
    assert capfd.readouterr().out == "a result\n"


def test_descriptors_are_given_back_also_after_an_error(capfd: pytest.CaptureFixture[str]) -> None:
    def count() -> int:
        return len(list(Path("/proc/self/fd").iterdir()))

    before = count()
    with pytest.raises(RuntimeError), results_apart():
        raise RuntimeError
    assert count() == before
    say("after")
    assert capfd.readouterr().out == "after\n"


def test_streams_without_a_file_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stdout", stream)
    with results_apart():
        emit("a result")
        say("a plug-in")
    assert stream.getvalue() == "a result\na plug-in\n"


@pytest.mark.parametrize("mischief", ["sys.stdout.close()", "os.close(1)", "sys.stdout = None"])
def test_result_comes_through_although_the_output_was_closed(mischief: str) -> None:
    program = (
        "import os, sys\n"
        "from adeye.cli.output import results_apart\n"
        "from adeye.cli.output import emit\n"
        f"with results_apart():\n    {mischief}\n    emit('a result')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "a result\n", "")
