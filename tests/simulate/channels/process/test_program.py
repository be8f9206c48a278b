"""From a command to what is executed."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import pytest

from adeye.errors import SpecError
from adeye.simulate.channels.process.channel import command_files, find_program

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
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


def test_files_get_their_paths_and_other_words_stay(folder: Path) -> None:
    argv = find_program(("./drive", "--gain", "2", "./plain.txt"), folder)
    assert argv == (str(folder / "drive"), "--gain", "2", str(folder / "plain.txt"))


def test_other_programs_are_found_on_the_path(folder: Path) -> None:
    program, script = find_program(("sh", "./drive"), folder)
    assert os.access(program, os.X_OK)
    assert script == str(folder / "drive")


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
def test_what_cannot_be_executed_is_refused(
    folder: Path, command: tuple[str, ...], words: str
) -> None:
    with pytest.raises(SpecError, match=words) as caught:
        find_program(command, folder)
    assert caught.value.remedy


def test_other_systems_are_told_what_is_needed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("adeye.simulate.channels.process.channel.os.name", "nt")
    with pytest.raises(SpecError, match="needs a POSIX system"):
        find_program(("./drive",), folder)


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
