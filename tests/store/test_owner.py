"""Owners of leases: alive, dead, or of another machine."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from adeye.store import owner as owner_module
from adeye.store.owner import Owner, boot_clock_s, owner_from_text


def test_this_process_is_alive() -> None:
    assert not Owner.current().is_dead


def test_owner_survives_the_database() -> None:
    assert owner_from_text(Owner.current().to_text()) == Owner.current()


def test_used_again_pid_is_another_process() -> None:
    assert replace(Owner.current(), started="1").is_dead


def test_ended_process_is_dead_even_before_its_parent_looks() -> None:
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    there = replace(Owner.current(), pid=child.pid, started=_started(child.pid))
    assert [there.is_dead] == [False]
    child.kill()
    _wait_for_exit_without_reaping(child.pid)
    assert [there.is_dead] == [True]
    child.communicate()
    assert [there.is_dead] == [True]


def test_process_of_another_machine_is_never_known_to_be_dead() -> None:
    far = Owner("another machine", 1, "1")
    assert not far.is_here
    assert not far.is_dead


def test_clock_of_the_boot_goes_forward() -> None:
    before = boot_clock_s()
    assert boot_clock_s() >= before


def test_without_proc_the_pid_alone_tells(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(owner_module, "_PROC", tmp_path / "none")
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    there = replace(Owner.current(), pid=child.pid)
    assert there.started == ""
    assert [there.is_dead] == [False]
    child.kill()
    child.communicate()
    assert [there.is_dead] == [True]


def test_without_proc_the_process_of_another_user_is_alive(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def forbid(_pid: int, _signal: int) -> None:
        raise PermissionError

    monkeypatch.setattr(owner_module, "_PROC", tmp_path / "none")
    monkeypatch.setattr(os, "kill", forbid)
    assert not Owner.current().is_dead


def _started(pid: int) -> str:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]


def _wait_for_exit_without_reaping(pid: int) -> None:
    import os

    os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
