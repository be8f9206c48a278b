"""A campaign whose runner and workers are killed at random moments ends as an undisturbed one."""

from __future__ import annotations

import os
import signal
import time
from typing import Final

import numpy as np
import pytest

from tests.chaos.runners import SEED, Runner, Undisturbed, claimed, record, run_of, size

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

WORKERS: Final = 2
KILLS: Final = size(20, 200)
SHARE_WITH_WORKERS: Final = size(5, 2)
"""Of so many runners one has workers; they are slow to start."""


def test_killed_runners_lose_nothing_and_repeat_nothing(whole: Undisturbed) -> None:
    random = np.random.default_rng(SEED)
    fresh, again = whole.calls
    # So far that the last kills still find something to interrupt.
    furthest = again + 1.6 * (fresh - again) / KILLS
    wasted = 0
    for number in range(KILLS):
        with_workers = number % SHARE_WITH_WORKERS == 0
        options = ("--workers", str(WORKERS)) if with_workers else ()
        runner = whole.start(*run_of("killed.db", *options))
        runner.wait_for_calls(int(random.uniform(1.0, furthest)))
        time.sleep(float(random.uniform(0.0, 0.01)))
        if with_workers and random.integers(2):
            kill_a_worker(runner, random)
        wasted += runner.is_over
        runner.kill(workers_too=bool(random.integers(2)))
    # Of a campaign that is whole already nothing could be lost.
    assert wasted <= KILLS // 4
    whole.resume("killed.db")
    claims, blocks = claimed(whole.folder / "killed.db")
    # A runner has one block in its thread, or one in each worker, when it dies.
    assert claims - blocks <= KILLS * WORKERS
    figures = {"kills": KILLS, "of_a_whole_campaign": wasted, "runs": whole.runs}
    record("kills", **figures, lost=0, twice=0, blocks=blocks, claims=claims)


def kill_a_worker(runner: Runner, random: np.random.Generator) -> None:
    """End one worker, and give the runner a moment to notice."""
    workers = runner.workers()
    if workers:
        os.kill(int(random.choice(workers)), signal.SIGKILL)
        time.sleep(float(random.uniform(0.0, 0.3)))


def test_worker_that_is_killed_costs_its_block_only(whole: Undisturbed) -> None:
    runner = whole.start(*run_of("worker.db", "--workers", str(WORKERS)))
    killed = 0
    fresh, again = whole.calls
    for share in np.linspace(0.2, 0.8, size(1, 30)):
        assert runner.wait_for_calls(int(again + share * (fresh - again)))
        workers = runner.workers()
        assert workers
        os.kill(workers[0], signal.SIGKILL)
        killed += 1
    said = runner.wait()
    assert said.code == 0, said.text
    whole.assert_identical(whole.folder / "worker.db")
    claims, blocks = claimed(whole.folder / "worker.db")
    assert 0 < claims - blocks <= killed
