"""Runners that are asked to end, that share a campaign, and that sleep longer than their lease."""

import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from adeye.store.repository import Repository
from tests.processes import started, wait_for_the_end
from tests.project import Project, count_rows, odd_of, table_hash, use

TWO = odd_of(use("cut_in", {"gap": ["30 m", "50 m"]}), architectures=("own",))
"""Two test cases of an architecture with a channel in Python."""
SLOW = """
import os
import time
from pathlib import Path

from adeye.ports import ScalarCommand


class Slow:
    def __init__(self, parameters, context):
        pass

    def act(self, observation):
        while "MARK" in os.environ and not Path(os.environ["MARK"] + ".go").exists():
            Path(os.environ["MARK"]).touch()
            time.sleep(0.05)
        return ScalarCommand(0.0, 0.0)
"""
RUNNER = """
import json
import sys

from adeye.campaign import run as runner
from adeye.campaign.plan import make_plan

runner.block_size = lambda _: 2
runner.LEASE_S = 2.0
runner.POLL_S = 0.1


def tell(state):
    print(state.phase, state.done, flush=True)


plan = make_plan(sys.argv[1])
summary = runner.run_campaign(plan, db=sys.argv[2], progress=tell)
document = [int(summary.exit_code), summary.executed, summary.to_execute, summary.message]
print(json.dumps(document), flush=True)
"""


@pytest.fixture
def slow(tmp_path: Path) -> Project:
    """Make a project whose runs, if MARK names a file, make it and wait for one ``.go`` more."""
    project = Project(tmp_path / "project", TWO)
    folder = project.folder / "odd" / "architectures"
    (folder / "slow.py").write_text(SLOW, "utf-8")
    own = project.read("odd/architectures/camera_radar.yaml")
    own["architecture"] = "own"
    own["channels"]["nominal"].update(kind="./slow.py:Slow")
    project.write("odd/architectures/own.yaml", own)
    return project


STARTED: list[subprocess.Popen[str]] = []


@pytest.fixture(autouse=True)
def _end_all() -> Iterator[None]:
    """Leave no process, whatever a test found."""
    yield
    for process in STARTED:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        with process:  # closes its pipes
            pass
    STARTED.clear()


def begun(*command: str, project: Project, **environment: str) -> subprocess.Popen[str]:
    """Start Python in the folder of a project; it does not outlive the test."""
    process = started(*command, cwd=project.folder, **environment)
    STARTED.append(process)
    return process


def interrupted(project: Project, lanes: str, *signals: signal.Signals) -> tuple[int, str]:
    """Start a campaign, signal it while blocks are executed, and see that it is gone."""
    mark = project.folder / "mark"
    options = ["--db", str(project.db), lanes, "2", "-k", "cut_in"]
    command = ["-m", "adeye", "run", str(project.odd), *options]
    process = begun(*command, project=project, MARK=str(mark))
    while not mark.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    for name in signals:
        process.send_signal(name)
        time.sleep(0.3)
    _, said = process.communicate(timeout=60)
    assert wait_for_the_end(process.pid) == []
    return process.returncode, said


def resumed(project: Project) -> None:
    """Go on, and see that nothing was kept from it."""
    assert count_rows(project.db, "run") == 0
    assert project.run().executed == 2
    with Repository.open(project.db, create=False) as repository:
        assert repository.verify() == ()


@pytest.mark.slow
@pytest.mark.parametrize("lanes", ["--threads", "--workers"])
@pytest.mark.parametrize("times", [1, 2])
def test_one_signal_gives_a_few_seconds_and_two_end_at_once_a_campaign_that_goes_on(
    slow: Project, lanes: str, times: int
) -> None:
    is_term = (lanes == "--workers") == (times == 1)
    name, code = (signal.SIGTERM, 143) if is_term else (signal.SIGINT, 130)
    returned, said = interrupted(slow, lanes, *[name] * times)
    told = "gets 5 s to end" if times == 1 else "go on with: adeye run"
    assert (returned, told in said) == (code, True), said
    if times == 1:
        assert f"adeye run {slow.odd} --db {slow.db} {lanes} 2 -k cut_in" in said
        with Repository.open(slow.db, create=False) as repository:
            # It gave back what it held.
            assert repository.work_state(repository.find_campaign().id).leased == 0
    resumed(slow)


def ended(process: subprocess.Popen[str]) -> list[Any]:
    """Wait for a runner; return what it found."""
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    found: list[Any] = json.loads(out.splitlines()[-1])
    return found


@pytest.mark.slow
def test_two_runners_share_a_campaign_and_end_with_one_verdict(tmp_path: Path) -> None:
    project = Project(tmp_path / "project")
    command = ["-c", RUNNER, str(project.odd), str(project.db)]
    runners = [begun(*command, project=project) for _ in range(2)]
    first, second = (ended(runner) for runner in runners)
    assert first[0] == second[0] == 0
    assert first[2] == second[2] == 0
    assert count_rows(project.db, "run") == 28
    project.run(db="whole.db")
    assert table_hash(project.db) == table_hash(project.folder / "whole.db")


@pytest.mark.slow
def test_stopped_runner_is_taken_over_and_fenced_off(slow: Project) -> None:
    mark = slow.folder / "mark"
    command = ["-c", RUNNER, str(slow.odd), str(slow.db)]
    stopped = begun(*command, project=slow, MARK=str(mark))
    while not mark.exists():
        assert stopped.poll() is None, stopped.communicate()
        time.sleep(0.05)
    # A slow block keeps its lease for longer than that, because its runner lives.
    with Repository.open(slow.db, create=False) as repository:
        time.sleep(3.0)
        assert repository.claim_block(campaign=repository.find_campaign().id) is None
    other = begun(*command, project=slow)
    assert other.stdout is not None
    assert any(line.startswith("wait") for line in other.stdout)
    stopped.send_signal(signal.SIGSTOP)
    code, executed, remaining, _ = ended(other)
    assert (executed, remaining) == (2, 0)
    before = table_hash(slow.db)
    mark.with_suffix(".go").touch()
    stopped.send_signal(signal.SIGCONT)
    late, none, _, message = ended(stopped)
    assert (late, none) == (code, 0)
    assert "1 block had been taken over by another runner" in message
    assert count_rows(slow.db, "run") == 2
    assert table_hash(slow.db) == before
