"""A runner that is killed again and again loses nothing and repeats nothing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from adeye.store.repository import Repository
from tests.project import ROOT, Project, table_hash

KILLS = 10
SEED = 20261121


def start(project: Project, db: Path) -> subprocess.Popen[bytes]:
    """Start the command line in a session of its own."""
    command = [sys.executable, "-m", "adeye", "run", str(project.odd), "--db", str(db)]
    return subprocess.Popen(
        [*command, "--workers", "2", "--quiet"],
        cwd=project.folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def survivors(session: int) -> list[int]:
    """List the processes of a session that have not ended."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[3]) == session and fields[0] != "Z":
                found.append(int(entry.name))
    return found


def test_killed_campaign_ends_as_an_uninterrupted_one(tmp_path: Path) -> None:
    project = Project(tmp_path)
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"]["lateral_speed"] = ["1 m/s", "2 m/s"]
    whole, killed = tmp_path / "whole.db", tmp_path / "killed.db"
    began = time.monotonic()
    assert start(project, whole).wait() == 0
    duration = time.monotonic() - began
    moments = np.random.default_rng(SEED).uniform(0.3, 0.9, KILLS) * duration
    for moment in moments:
        process = start(project, killed)
        time.sleep(float(moment))
        process.send_signal(signal.SIGKILL)
        process.wait()
        # A worker ends when the pipe to its parent does, so it is gone after its present batch.
        deadline = time.monotonic() + 20.0
        while survivors(process.pid) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert survivors(process.pid) == []
    assert start(project, killed).wait() == 0
    assert table_hash(killed) == table_hash(whole)
    with Repository.open(killed, create=False) as repository:
        assert repository.verify() == ()
    assert project.run(db="killed.db").executed == 0
