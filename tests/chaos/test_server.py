"""Two runners share a campaign on a PostgreSQL server while both and the server are disturbed."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import psycopg
import pytest

from tests.chaos.runners import SEED, Runner, Undisturbed, record, run_of, size
from tests.postgres import USER, Server, running

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

LEASE_S: Final = 2
MACHINES: Final = ("one", "two")
KILLS: Final = size(4, 200)
STOPS: Final = size(1, 12)
TERMINATIONS: Final = size(3, 60)
RESTARTS: Final = size(1, 20)
BLOCK: Final = size(3, 1)
LONGEST_PAUSE_S: Final = 0.3
BLOCK_S: Final = size(0.06, 0.3)
"""What a block takes besides its simulation, so that the last disturbances interrupt something."""


@pytest.fixture(scope="module")
def durable() -> Iterator[Server]:
    """A server that keeps what it confirmed, whatever ends it."""
    yield from running(is_durable=True)


@dataclass
class Pair:
    """Two runners on what they take for two machines, which are started again when they end."""

    whole: Undisturbed
    url: str
    block: int = 1
    present: dict[str, Runner] = field(default_factory=dict)
    ended: list[Runner] = field(default_factory=list)

    def keep_up(self) -> None:
        """Start whoever does not run."""
        for machine in MACHINES:
            runner = self.present.get(machine)
            if runner is None or runner.is_over:
                if runner is not None:
                    self.take_out(machine)
                self.start(machine)

    def start(self, machine: str) -> None:
        """Start the runner of a machine."""
        late: dict[str, Any] = {"calls_of": ["complete_block", False], "pause_s": BLOCK_S}
        setup = {"block": self.block, "machine": machine, "lease_s": LEASE_S, **late}
        self.present[machine] = self.whole.start(*run_of(self.url), **setup)

    def take_out(self, machine: str) -> Runner:
        """Wait for the end of a runner."""
        runner = self.present.pop(machine)
        runner.wait()
        self.ended.append(runner)
        return runner

    @property
    def fenced_off(self) -> int:
        """How many blocks were brought too late."""
        return sum(runner.counted for runner in (*self.ended, *self.present.values()))


def ask(server: Server, url: str, statement: str) -> list[Any]:
    """Ask the server past adeye."""
    name = url.partition("@/")[2].partition("?")[0]
    with psycopg.connect(f"host={server.folder} user={USER} dbname={name}") as connection:
        return connection.execute(statement.encode()).fetchall()


def holds(server: Server, url: str, machine: str) -> bool:
    """Tell whether a runner has a block and no transaction that stands still."""
    leased = ask(server, url, "SELECT owner FROM adeye.work WHERE state = 'leased'")
    busy = "SELECT 1 FROM pg_stat_activity WHERE application_name = 'adeye' AND state <> 'idle'"
    within = ask(server, url, busy)
    return any(f'"{machine}"' in owner for (owner,) in leased) and not within


def claims_and_open(server: Server, url: str) -> tuple[int, int]:
    """Count how often a block was claimed so far, and the blocks that nobody completed."""
    done = "COALESCE(SUM(attempt), 0), COUNT(*) FILTER (WHERE state <> 'done')"
    ((claims, left),) = ask(server, url, f"SELECT {done} FROM adeye.work")  # noqa: S608
    return int(claims), int(left)


def wait_for_claims(pair: Pair, server: Server, before: int) -> tuple[int, int]:
    """Wait until somebody claimed a block, or nothing is left."""
    deadline = time.monotonic() + 120.0
    claims, left = claims_and_open(server, pair.url)
    while claims <= before and (left or not claims):
        assert time.monotonic() < deadline, "no block was claimed"
        pair.keep_up()
        time.sleep(0.02)
        claims, left = claims_and_open(server, pair.url)
    return claims, left


def test_disturbed_pair_ends_with_the_same_campaign(whole: Undisturbed, durable: Server) -> None:
    url = durable.new_database()
    assert whole.adeye("db", "upgrade", "--db", url).code == 0
    random = np.random.default_rng(SEED)
    wanted = {"kill": KILLS, "stop": STOPS, "terminate": TERMINATIONS, "restart": RESTARTS}
    steps = random.permutation([name for name, times in wanted.items() for _ in range(times)])
    pair = Pair(whole, url, BLOCK)
    claims = idle = 0
    for step in steps:
        pair.keep_up()
        claims, left = wait_for_claims(pair, durable, claims)
        idle += not left
        time.sleep(float(random.uniform(0.0, LONGEST_PAUSE_S)))
        machine = str(random.choice(MACHINES))
        disturb(str(step), pair, durable, machine)
    for machine in list(pair.present):
        pair.take_out(machine)
    whole.resume(url, block=BLOCK)
    said = [runner.wait().text for runner in pair.ended]
    assert not any("Traceback" in text or "defect of adeye" in text for text in said), said
    claims, _ = claims_and_open(durable, url)
    figures = {f"{name}s": times for name, times in wanted.items()}
    figures |= {"of_a_whole_campaign": idle, "runs": whole.runs, "lost": 0, "twice": 0}
    figures |= {"blocks": whole.runs // BLOCK, "claims": claims, "fenced_off": pair.fenced_off}
    record("server", **figures)
    # Of a campaign that is whole already nothing could be lost.
    assert idle <= len(steps) // 4


def disturb(step: str, pair: Pair, server: Server, machine: str) -> None:
    """Do one harm."""
    runner = pair.present[machine]
    if step == "kill" and not runner.is_over:
        runner.kill(workers_too=True)
    elif step == "stop" and not runner.is_over:
        os.kill(runner.pid, signal.SIGSTOP)
        time.sleep(1.5 * LEASE_S)
        os.kill(runner.pid, signal.SIGCONT)
    elif step == "terminate":
        ended = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
        ask(server, pair.url, f"{ended} WHERE application_name = 'adeye' AND random() < 0.7")
    elif step == "restart":
        server.crash()
        server.start()


def test_late_commit_on_a_server_is_fenced_off(little: Undisturbed, durable: Server) -> None:
    """A runner is stopped with a block that another one then completes, and brings it later."""
    url = durable.new_database()
    assert little.adeye("db", "upgrade", "--db", url).code == 0
    pair = Pair(little, url)
    pair.start("one")
    stopped = pair.present["one"]
    while True:
        os.kill(stopped.pid, signal.SIGSTOP)
        if holds(durable, url, "one"):
            break
        os.kill(stopped.pid, signal.SIGCONT)
        time.sleep(0.002)
        assert not stopped.is_over, "it ended before it could be stopped with a block"
    pair.start("two")
    assert pair.take_out("two").wait().code == 0
    os.kill(stopped.pid, signal.SIGCONT)
    assert pair.take_out("one").wait().code == 0
    little.assert_identical(url)
    assert pair.fenced_off > 0
    record("server, late results", fenced_off=pair.fenced_off)
