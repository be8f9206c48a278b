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
from tests.project import ROOT, Project, count_rows, table_hash

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


def kill(process: subprocess.Popen[bytes], *, workers_too: bool) -> None:
    """End the runner with SIGKILL, alone or with its workers, and wait until nobody is left."""
    if workers_too:
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.send_signal(signal.SIGKILL)
    process.wait()
    # A worker ends when the pipe to its parent does, so it is gone after its present batch.
    deadline = time.monotonic() + 20.0
    while survivors(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert survivors(process.pid) == []


def results(db: Path) -> int:
    """Count the results in a database, which the first kill may have come too early for."""
    return count_rows(db, "run") if db.exists() else 0


def test_killed_campaign_ends_as_an_uninterrupted_one(tmp_path: Path) -> None:
    project = Project(tmp_path)
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"]["lateral_speed"] = ["1 m/s", "2 m/s"]
    whole, again = tmp_path / "whole.db", tmp_path / "again.db"
    assert start(project, whole).wait() == 0
    # The first one may have compiled; the moments are those of a run that does not.
    began = time.monotonic()
    assert start(project, again).wait() == 0
    duration = time.monotonic() - began
    expected, runs = table_hash(whole), count_rows(whole, "run")
    killed = tmp_path / "killed_0.db"
    kills, halfway, finished = 0, 0, [again]
    for moment in np.random.default_rng(SEED).uniform(0.2, 1.0, 4 * KILLS) * duration:
        if kills == KILLS:
            break
        process = start(project, killed)
        time.sleep(float(moment))
        if process.poll() is None:
            kill(process, workers_too=bool(kills % 2))
            kills += 1
            halfway += 0 < results(killed) < runs
        else:
            # It came to its end before the moment: the next kills hit another one.
            assert process.wait() == 0
            finished.append(killed)
            killed = tmp_path / f"killed_{len(finished)}.db"
    assert kills == KILLS
    assert halfway > 0
    assert start(project, killed).wait() == 0
    for db in (*finished, killed):
        assert table_hash(db) == expected
        with Repository.open(db, create=False) as repository:
            assert repository.verify() == ()
        assert project.run(db=db.name).executed == 0
