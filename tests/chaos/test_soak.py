"""A long campaign takes no more memory, descriptors and time per run at its end than before."""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from tests.chaos.runners import IS_FULL, Cradle, project_of, record, run_of, size

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

RUNS: Final = size(2_000, 100_000)
BLOCK: Final = 100
LOG_BYTES: Final = 2 * 32 * 2**20
"""The log goes into the file at 32 MiB, after the transaction that fills it; that of the plan is
larger, and is cut after it."""
SLOPE_BYTES: Final = 200
"""Most that a run may add to the memory in the second half [bytes]: 20 MB for 100,000 runs."""
LEAST_SPEED: Final = 0.95
COMPARED: Final = size(3, 50)
"""Blocks at both ends whose typical speed is compared; a single one may wait for the disk."""


@dataclass(frozen=True)
class Look:
    """One look at the runner: when [s], runs done, memory [bytes], descriptors, log [bytes]."""

    at: float
    done: int
    memory: int
    descriptors: int
    log: int


def look(pid: int, db: Path, done: int) -> Look | None:
    """Look at a process; None if it has ended."""
    process = Path(f"/proc/{pid}")
    log = db.with_name(f"{db.name}-wal")
    try:
        pages = int((process / "statm").read_text("ascii").split()[1])
        descriptors = len(list((process / "fd").iterdir()))
        bytes_of_log = log.stat().st_size if log.exists() else 0
    except OSError:
        return None
    return Look(time.monotonic(), done, pages * 4096, descriptors, bytes_of_log)


def test_long_campaign_stays_as_it_begins(cradle: Cradle, tmp_path: Path) -> None:
    project = project_of(tmp_path / "project", RUNS)
    db = project.folder / "soak.db"
    runner = cradle.start(
        project.folder, *run_of(db.name), setup={"block": BLOCK, "calls_of": ["complete_block"]}
    )
    looks: list[Look] = []
    blocks = 0
    while not runner.is_over:
        time.sleep(0.005)
        if runner.counted > blocks:
            blocks = runner.counted
            seen = look(runner.pid, db, blocks * BLOCK)
            if seen is not None:
                looks.append(seen)
    said = runner.wait()
    assert said.code == 0, said.text
    assert blocks == RUNS // BLOCK
    half = looks[len(looks) // 2 :]
    descriptors = [item.descriptors for item in half]
    slope = float(np.polyfit([i.done for i in half], [i.memory for i in half], 1)[0])
    # First come all runs without a fault, then all with one, which take longer.
    ratios = [ended_by_begun(looks[: len(looks) // 2]), ended_by_begun(half)]
    record(
        "soak",
        runs=RUNS,
        memory_mb=round(looks[-1].memory / 1e6),
        slope_bytes_per_run=round(slope, 1),
        descriptors=max(descriptors),
        log_mb=round(max(item.log for item in looks) / 1e6, 1),
        per_s=round(typical_speed(half)),
        last_by_first_without_fault=round(ratios[0], 3),
        last_by_first_with_fault=round(ratios[1], 3),
    )
    assert max(item.log for item in looks) <= LOG_BYTES
    # A connection more or less may be open at a look: database, log and the index of the log.
    assert max(descriptors) - min(descriptors) <= 3
    assert np.median(descriptors[-100:]) == np.median(descriptors[:100])
    if IS_FULL:
        assert slope <= SLOPE_BYTES
        assert min(ratios) >= LEAST_SPEED


def ended_by_begun(looks: list[Look]) -> float:
    """Return the speed at the end by that at the beginning."""
    return typical_speed(looks[-COMPARED - 1 :]) / typical_speed(looks[: COMPARED + 1])


def typical_speed(looks: list[Look]) -> float:
    """Return the median of the runs per second from one look to the next."""
    pairs = itertools.pairwise(looks)
    return float(np.median([(b.done - a.done) / (b.at - a.at) for a, b in pairs]))
