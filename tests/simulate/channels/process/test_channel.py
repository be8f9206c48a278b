"""Programs as channels, in the languages that are here."""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.signals import OK, SILENT, ControlCommand, Observation
from adeye.simulate.channels.process.channel import ProcessChannel, command_files, find_program
from adeye.spec.channels import ProcessParameters
from adeye.testing import channel_context, check_channel
from docs import walk
from tests.refusals import refused

PAGE = Path(__file__).resolve().parents[4] / "docs" / "guide" / "process-channels.md"
IN_C = r"""
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
static char line[1 << 22];
int main(void) {
    setvbuf(stdout, NULL, _IOLBF, 0);
    if (!fgets(line, sizeof line, stdin)) return 1;
    puts("{\"hello\":\"adeye/channel@1\"}");
    while (fgets(line, sizeof line, stdin)) {
        long tick = strtol(strstr(line, "\"tick\":") + 7, NULL, 10);
        printf("{\"tick\":%ld,\"acceleration\":-0.25,\"steering_angle\":0}\n", tick);
    }
    return 0;
}
"""
IN_PYTHON = """
import json, sys, time
hello = json.loads(sys.stdin.readline())
values = hello["parameters"]["values"]
print(json.dumps({"hello": hello["hello"]}), flush=True)
for line in sys.stdin:
    tick = json.loads(line)["tick"]
    time.sleep(values.get("sleep", 0.0))
    status = values["status"][min(tick, len(values["status"]) - 1)]
    print(json.dumps({"tick": tick, "acceleration": 0.1 * tick, "steering_angle": 0.0,
                      "status": status}), flush=True)
"""


def parameters(*command: str, **content: Any) -> ProcessParameters:
    return ProcessParameters.model_validate({"command": list(command), **content})


def needs(program: str) -> None:
    if shutil.which(program) is None:
        pytest.skip(f"there is no {program} here")


def drive(
    channel: ProcessChannel, given: Sequence[Any], running: Sequence[Sequence[bool]]
) -> list[ControlCommand]:
    channel.reset(channel_context(list(given), links=(), sensors={}, runs=len(given)))
    return [
        channel.act(Observation(0.05 * tick, {}, {}, None, np.array(flags)))
        for tick, flags in enumerate(running)
    ]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "told.py").write_text(IN_PYTHON)
    return tmp_path


def told(*status: str, **values: Any) -> ProcessParameters:
    return parameters("python3", "./told.py", values={"status": status or ["ok"], **values})


@pytest.mark.slow
def test_channel_of_the_guide_in_perl_conforms(tmp_path: Path) -> None:
    needs("perl")
    files = {Path(name).name: text for name, text in walk.files_of(PAGE.read_text("utf-8")).items()}
    path = tmp_path / "cruise.pl"
    path.write_text(files["cruise.pl"], "utf-8")
    assert len(files["cruise.pl"].splitlines()) <= 40
    given = parameters("perl", "./cruise.pl", values={"gain": 0.5})
    check_channel(lambda: ProcessChannel(tmp_path), given)


@pytest.mark.slow
def test_channel_in_c_conforms(tmp_path: Path) -> None:
    needs("gcc")
    (tmp_path / "drive.c").write_text(IN_C)
    subprocess.run(["gcc", "-O1", "-o", "drive", "drive.c"], cwd=tmp_path, check=True)
    check_channel(lambda: ProcessChannel(tmp_path), parameters("./drive"))


def test_status_is_taken_over_and_silence_freezes_stamp_and_values(folder: Path) -> None:
    channel = ProcessChannel(folder)
    answers = drive(channel, [told("ok", "silent", "degraded")], [[True]] * 3)
    channel.close()
    assert [answer.status[0] for answer in answers] == [OK, SILENT, 1]
    assert [answer.stamp[0] for answer in answers] == [0.0, 0.0, 0.1]
    assert [answer.acceleration[0] for answer in answers] == [0.0, 0.0, 0.2]
    assert channel.events == [None]


@pytest.mark.slow
def test_run_deadline_counts_all_that_it_keeps_its_run_waiting(folder: Path) -> None:
    slow = told(sleep=0.2)
    given = slow.model_copy(update={"run_deadline": 0.9, "step_deadline": 0.8})
    channel = ProcessChannel(folder)
    answers = drive(channel, [given, told()], [[True, True]] * 8)
    channel.close()
    event = channel.events[0]
    assert event is not None
    assert (event.outcome, event.is_machine_dependent) == ("channel_timeout", True)
    assert answers[0].status[0] == OK
    assert answers[-1].status.tolist() == [SILENT, OK]


def test_program_of_an_ended_run_is_not_asked(folder: Path) -> None:
    channel = ProcessChannel(folder)
    answers = drive(channel, [told(), told()], [[True, True], [False, True], [False, True]])
    channel.close()
    assert answers[-1].acceleration.tolist() == [0.0, 0.2]
    assert channel.events == [None, None]


def test_batch_after_batch_starts_anew(folder: Path) -> None:
    channel = ProcessChannel(folder)
    first = drive(channel, [told()], [[True]] * 3)
    again = drive(channel, [told()], [[True]] * 3)
    channel.close()
    assert [item.acceleration[0] for item in first] == [item.acceleration[0] for item in again]


def test_program_that_is_not_there_is_an_input_error(folder: Path) -> None:
    with pytest.raises(SpecError, match="is not there"):
        drive(ProcessChannel(folder), [parameters("./gone")], [])


def test_detail_names_no_folder(folder: Path) -> None:
    (folder / "told.py").write_text("raise RuntimeError('lost /a/b/x.bin')")
    channel = ProcessChannel(folder)
    drive(channel, [told()], [])
    channel.close()
    event = channel.events[0]
    assert event is not None
    assert event.detail == "ended with code 1 without an answer: RuntimeError: lost x.bin"


# From a command to what is executed.


@pytest.fixture
def folder_program(tmp_path: Path) -> Path:
    (tmp_path / "drive").write_text("#!/bin/sh\n")
    (tmp_path / "drive").chmod(0o755)
    (tmp_path / "plain.txt").write_text("1\n")
    (tmp_path.parent / "outside").write_text("1\n")
    return tmp_path


def test_words_with_a_dot_and_a_slash_are_files() -> None:
    assert command_files(("perl", "./drive.pl", "--gain", "0.4", "./net.bin")) == {
        1: "./drive.pl",
        4: "./net.bin",
    }


def test_files_get_their_paths_and_other_words_stay(folder_program: Path) -> None:
    argv = find_program(("./drive", "--gain", "2", "./plain.txt"), folder_program)
    assert argv == (str(folder_program / "drive"), "--gain", "2", str(folder_program / "plain.txt"))


def test_other_programs_are_found_on_the_path(folder_program: Path) -> None:
    program, script = find_program(("sh", "./drive"), folder_program)
    assert os.access(program, os.X_OK)
    assert script == str(folder_program / "drive")


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("./missing",), "is not there"),
        (("./../outside",), "is outside of"),
        (("./plain.txt",), "cannot be executed"),
        (("/bin/sh", "./drive"), "neither a file of the project nor the name of a program"),
        (("no-such-program", "./drive"), "there is no program"),
        (("sh", "-c", "exit"), "names no file of the project"),
    ],
)
def test_bad_program_is_refused(folder_program: Path, command: tuple[str, ...], words: str) -> None:
    caught = refused(SpecError, find_program, command, folder_program, says=words)
    assert caught.remedy


def test_other_systems_are_told_need(folder_program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("adeye.simulate.channels.process.channel.os.name", "nt")
    refused(SpecError, find_program, ("./drive",), folder_program, says="needs a POSIX system")


@pytest.mark.slow
def test_package_imports_without_what_only_posix_has() -> None:
    # The warden is executed by name; nothing imports it.
    assert "adeye.simulate.channels.process.channel" in sys.modules
    import subprocess

    program = (
        "import sys; sys.modules['resource'] = sys.modules['fcntl'] = None; "
        "import adeye.simulate.channels.process.channel, adeye.testing"
    )
    subprocess.run([sys.executable, "-c", program], check=True, env={**os.environ})
