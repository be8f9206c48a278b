"""Runners that can be killed, filled up and failed, and the undisturbed campaign beside them."""

from __future__ import annotations

import copy
import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, TypeVar

from adeye.store.repository import Repository
from tests.chaos.bench import ODD, Said
from tests.chaos.failing import WIDTH
from tests.processes import survivors
from tests.project import ROOT, Project, table_hash

IS_FULL: Final = os.environ.get("CHAOS", "") == "full"
SEED: Final = 20261123
MESSAGE: Final = re.compile(r"^\w*Error: |^The report was not written: ")
ODD_FILE: Final = "odd/tested.yaml"


Number = TypeVar("Number", int, float)


def size(reduced: Number, full: Number) -> Number:
    """Choose how much is tried: little in every change, all of it by ``make chaos``."""
    return full if IS_FULL else reduced


def project_of(folder: Path, runs: int) -> Project:
    """Make a project whose ODD is cheap and has this even number of test cases."""
    odd = copy.deepcopy(ODD)
    gaps = [f"{30 + 30 * number / (runs // 2):.5f} m" for number in range(runs // 2)]
    odd["scenarios"] = [{"use": "cut_in", "sweep": {"parameters": {"gap": gaps}}}]
    return Project(folder, odd)


@dataclass
class Runner:
    """A child that runs a verb.

    Attributes:
        pid: Its process, which leads a session of its own.
        output: What it says.
        calls: The file in which it counts.
    """

    cradle: Cradle
    pid: int
    output: Path
    calls: Path
    code: int | None = None

    def wait(self) -> Said:
        """Wait for its end; a negative code is the signal that ended it."""
        if self.code is None:
            self.code = int(self.cradle.ask(wait=self.pid))
        return Said(self.code, self.output.read_text("utf-8", "replace"))

    @property
    def counted(self) -> int:
        """How many calls it made so far."""
        return int.from_bytes(self.calls.read_bytes(), "little")

    @property
    def is_over(self) -> bool:
        """Whether it ended by itself."""
        try:
            status = Path(f"/proc/{self.pid}/stat").read_text("utf-8").rpartition(")")[2]
        except OSError:
            return True
        return status.split()[0] in "ZX"

    def wait_for_calls(self, wanted: int) -> bool:
        """Wait until it made so many calls; tell whether it is still there."""
        deadline = time.monotonic() + 120.0
        while self.counted < wanted and not self.is_over:
            assert time.monotonic() < deadline, self.output.read_text("utf-8", "replace")
            time.sleep(0.0005)
        return not self.is_over

    def workers(self) -> list[int]:
        """List its worker processes."""
        found = []
        for pid in survivors(self.pid):
            try:
                command = Path(f"/proc/{pid}/cmdline").read_bytes()
            except OSError:
                continue
            if pid != self.pid and b"spawn_main" in command:
                found.append(pid)
        return found

    def kill(self, *, workers_too: bool) -> None:
        """End it with SIGKILL, alone or with its workers, and see that nobody is left."""
        if workers_too:
            os.killpg(self.pid, signal.SIGKILL)
        else:
            os.kill(self.pid, signal.SIGKILL)
        self.wait()
        deadline = time.monotonic() + 30.0
        while (left := survivors(self.pid)) and time.monotonic() < deadline:
            time.sleep(0.01)
        assert left == []


@dataclass
class Cradle:
    """The process that forks runners; see ``tests/chaos/cradle.py``."""

    folder: Path
    started: int = 0
    process: subprocess.Popen[str] = field(init=False)

    def __post_init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", "from tests.chaos.cradle import serve; serve()"],
            env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "500"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ask(self, **request: Any) -> str:
        """Send one request and return the answer."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(request, default=str) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        assert answer, f"the cradle ended with {self.process.wait()}"
        return answer

    def start(
        self, folder: Path, *arguments: str, setup: Mapping[str, Any] | None = None
    ) -> Runner:
        """Start a verb in a folder."""
        self.started += 1
        output = self.folder / f"output-{self.started}"
        calls = self.folder / f"calls-{self.started}"
        calls.write_bytes(bytes(WIDTH))
        wanted = {"calls": calls, **(setup or {})}
        pid = self.ask(arguments=arguments, folder=folder, output=output, setup=wanted)
        return Runner(self, int(pid), output, calls)

    def adeye(self, folder: Path, *arguments: str, setup: Mapping[str, Any] | None = None) -> Said:
        """Run a verb in a folder to its end."""
        return self.start(folder, *arguments, setup=setup).wait()

    def warm(self, folder: Path) -> None:
        """Load the kernels here, so that every child has them."""
        request = {"arguments": run_of("warm.db"), "folder": folder, "here": True}
        code = int(self.ask(**request, output=self.folder / "warm"))
        assert code == 0, (self.folder / "warm").read_text("utf-8")

    def close(self) -> None:
        """End it."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait(timeout=30)
        assert self.process.stdout is not None
        self.process.stdout.close()


def run_of(db: str, *options: str) -> tuple[str, ...]:
    """Return the arguments that run the ODD, in one thread unless workers are asked for."""
    lanes = () if "--workers" in options else ("--threads", "1")
    return ("run", ODD_FILE, "--db", db, "--quiet", *lanes, *options)


@dataclass(frozen=True)
class Undisturbed:
    """A campaign that nothing happened to, and the same again in other databases of its folder.

    Attributes:
        cradle: Who forks its runners.
        project: Its project; the database is ``whole.db``.
        runs: Test cases.
        block: Test cases in one block, unless another is asked for.
        table: The hash of all that came of it.
        calls: What it asks of the database, and what the same asks once it is done.
    """

    cradle: Cradle
    project: Project
    runs: int
    block: int
    table: str = ""
    calls: tuple[int, int] = (0, 0)

    @property
    def folder(self) -> Path:
        """Where the verbs run."""
        return self.project.folder

    @property
    def db(self) -> Path:
        """The whole database."""
        return self.folder / "whole.db"

    def start(self, *arguments: str, **setup: Any) -> Runner:
        """Start a verb in its folder."""
        return self.cradle.start(self.folder, *arguments, setup={"block": self.block, **setup})

    def adeye(self, *arguments: str, **setup: Any) -> Said:
        """Run a verb in its folder to its end."""
        return self.start(*arguments, **setup).wait()

    def cleared(self, name: str) -> Path:
        """Take a database away with all that is beside it; return where it was."""
        for left in self.folder.glob(f"{name}*"):
            left.unlink()
        return self.folder / name

    def killed_at(self, name: str, call: int) -> Path:
        """Kill a runner at a call of the database, so that its log stays; return the database."""
        db = self.cleared(name)
        said = self.adeye(*run_of(name), fail={"nth": call, "is_fatal": True})
        assert said.code == -signal.SIGKILL, said.text
        return db

    def assert_identical(self, db: Path | str) -> None:
        """See that a database holds what this one holds: all of it, once, as written."""
        with Repository.open(db, create=False) as repository:
            (campaign,) = repository.campaigns()
            assert repository.verify() == ()
            assert repository.progress(campaign.id).accounted == self.runs
            assert repository.info().rows["run"] == self.runs
            work = repository.work_state(campaign.id)
            assert work.done == sum(work.__dict__.values())
        assert table_hash(db) == self.table

    def resume(self, db: Path | str, **setup: Any) -> None:
        """Run the rest undisturbed and see that the campaign is the same."""
        said = self.adeye(*run_of(str(db)), **setup)
        assert said.code == 0, said.text
        self.assert_identical(db if "://" in str(db) else self.folder / db)


def undisturbed(cradle: Cradle, folder: Path, runs: int, block: int) -> Undisturbed:
    """Run a campaign of so many test cases as nobody disturbs it."""
    made = Undisturbed(cradle, project_of(folder, runs), runs, block)
    calls = []
    for _ in range(2):
        runner = made.start(*run_of(made.db.name))
        said = runner.wait()
        assert said.code == 0, said.text
        calls.append(runner.counted)
    return replace(made, table=table_hash(made.db), calls=(calls[0], calls[1]))


def claimed(db: Path) -> tuple[int, int]:
    """Count how often a block was claimed, and the blocks."""
    with closing(sqlite3.connect(db)) as raw:
        claims, blocks = raw.execute("SELECT SUM(attempt), COUNT(*) FROM work").fetchone()
    return int(claims), int(blocks)


def assert_whole_blocks(db: Path) -> int:
    """See that what a failure left is whole blocks and nothing besides; return the runs."""
    if not db.exists() or not tables_of(db):
        return 0
    with Repository.open(db, create=False) as repository:
        assert repository.verify() == ()
        runs = repository.info().rows["run"]
    with closing(sqlite3.connect(db)) as raw:
        done = "SELECT SUM(to_ordinal - from_ordinal) FROM work WHERE state = 'done'"
        assert runs == (raw.execute(done).fetchone()[0] or 0)
    return runs


def tables_of(db: Path) -> int:
    """Count what a database defines; nothing if its first transaction was not kept."""
    with closing(sqlite3.connect(db)) as raw:
        return int(raw.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0])


def assert_one_message(said: Said, code: int, *named: str) -> None:
    """See that a verb ended with a documented code and one line that names what is needed."""
    assert said.code == code, said.text
    assert "Traceback" not in said.text
    assert "defect of adeye" not in said.text
    lines = [line for line in said.text.splitlines() if MESSAGE.search(line)]
    assert len(lines) == 1, said.text
    assert all(word in lines[0] for word in named), said.text


def record(name: str, **figures: Any) -> None:
    """Say what was measured; a full one is kept with its date."""
    known = {"what": name, "on": datetime.now(UTC).date().isoformat(), "full": IS_FULL, **figures}
    print(f"\n{name}: " + ", ".join(f"{key} {value}" for key, value in figures.items()))  # noqa: T201
    if IS_FULL:
        folder = ROOT / "reports" / "chaos"
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{name.replace(' ', '-')}.json"
        path.write_text(json.dumps(known, indent=2) + "\n", encoding="utf-8")
