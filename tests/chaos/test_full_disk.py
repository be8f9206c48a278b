"""A disk that is full at a random moment leaves whole blocks, and a message that says so."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from tests.chaos import runners

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

POINTS: Final = runners.size(6, 50)
PAGE: Final = 4096
"""Of the database [bytes]."""
PARTS: Final = 10
"""Of a campaign, at whose ends it is looked at."""


def test_file_that_may_not_grow_leaves_whole_blocks(little: runners.Undisturbed) -> None:
    kept = 0
    for number, size in enumerate(moments(little, runners.SEED)):
        db = f"limited-{number}.db"
        said = little.adeye(*runners.run_of(db), fsize=size)
        runners.assert_one_message(said, 5, db, "Check free space")
        kept += runners.assert_whole_blocks(little.folder / db)
        little.resume(db)
    assert kept > 0
    runners.record("file that may not grow", points=POINTS, runs_kept=kept, partial_rows=0)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Mount a file system in memory, smaller than the campaign needs."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=16m", "none", str(disk)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("mounting a small file system is not allowed here")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def test_full_disk_leaves_whole_blocks(little: runners.Undisturbed, small_disk: Path) -> None:
    kept, slowest = 0, 0.0
    for number, size in enumerate(moments(little, runners.SEED + 1)):
        db = small_disk / f"full-{number}.db"
        shutil.rmtree(small_disk, ignore_errors=True)
        ballast = small_disk / "ballast"
        free = shutil.disk_usage(small_disk).free
        with ballast.open("wb") as file:
            # Database and log have to go into what is left.
            os.posix_fallocate(file.fileno(), 0, free - size)
        before = time.monotonic()
        said = little.adeye(*runners.run_of(str(db)))
        slowest = max(slowest, time.monotonic() - before)
        runners.assert_one_message(said, 5, db.name, "Free some space")
        ballast.unlink()
        kept += runners.assert_whole_blocks(db)
        little.resume(db)
    assert kept > 0
    runners.record(
        "full disk", points=POINTS, runs_kept=kept, partial_rows=0, slowest_s=round(slowest, 1)
    )


def moments(whole: runners.Undisturbed, seed: int) -> list[int]:
    """Return at how many bytes of the log there is no more room: at random, and near the end."""
    low, high = written(whole)
    random = np.random.default_rng(seed)
    return [*(int(random.uniform(low, high)) for _ in range(POINTS - 1)), high - PAGE]


def written(whole: runners.Undisturbed) -> tuple[int, int]:
    """Find how large the log is [bytes] halfway in the schema, and when some blocks are in it.

    It grows until the campaign has ended, and is empty from then on.
    """
    fresh, _ = whole.calls
    sizes = []
    for part in range(2, PARTS):
        db = whole.killed_at(f"written-{part}.db", fresh * part // PARTS)
        sizes.append(db.with_name(f"{db.name}-wal").stat().st_size)
    return next(size for size in sizes if size) // 2, max(sizes)
