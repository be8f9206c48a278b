"""A runner that is killed again and again loses nothing and repeats nothing."""

import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from adeye.errors import AdeyeError
from adeye.store.repository import Repository
from tests.processes import started, wait_for_the_end
from tests.project import Project, count_rows, table_hash
from tests.stored import known

KILLS = 5
SEED = 20261121
RUNNER = """
import sys

import adeye
from adeye.campaign import run as runner

runner.block_size = lambda _: 3  # many blocks, so that there is something to interrupt
tell = lambda state: print(state.done, flush=True)
adeye.run(sys.argv[1], db=sys.argv[2], workers=2, progress=tell)
"""


def kill(process: subprocess.Popen[str], *, workers_too: bool) -> None:
    """End the runner with SIGKILL, alone or with its workers, and see that nobody is left."""
    if workers_too:
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.send_signal(signal.SIGKILL)
    process.communicate()
    # A worker looks at its parent, so it is gone soon, whatever it does.
    assert wait_for_the_end(process.pid) == []


def wait_for_a_moment(process: subprocess.Popen[str], blocks: int, delay: float) -> bool:
    """Wait until so many blocks are done, and a while; tell whether the runner is still there."""
    for _ in range(blocks):
        if not known(process.stdout).readline():
            break
    time.sleep(delay)
    return process.poll() is None


def results(db: Path) -> int:
    """Count the results in a database, which may not have its tables yet."""
    try:
        return count_rows(db, "run")
    except AdeyeError:
        return 0


@pytest.mark.slow
def test_killed_campaign_ends_as_an_uninterrupted_one(tmp_path: Path) -> None:
    project = Project(tmp_path)
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"]["lateral_speed"] = ["1 m/s", "2 m/s"]
    killed = tmp_path / "killed.db"
    random = np.random.default_rng(SEED)
    halfway = 0
    for number in range(KILLS):
        process = started("-c", RUNNER, project.odd, killed, cwd=project.folder)
        # From the start of Python over planning and the first lease to the middle of a batch.
        assert wait_for_a_moment(process, number % 3, float(random.uniform(0.0, 0.6)))
        kill(process, workers_too=bool(random.integers(2)))
        halfway += results(killed) > 0
    assert halfway > 0
    last = started("-c", RUNNER, project.odd, killed, cwd=project.folder)
    last.communicate()
    assert last.returncode == 0
    whole = project.run(db="whole.db")
    assert table_hash(killed) == table_hash(tmp_path / "whole.db")
    with Repository.open(killed, create=False) as repository:
        assert repository.verify() == ()
        assert repository.progress(whole.campaign).accounted == whole.planned
    assert project.run(db="killed.db").executed == 0
