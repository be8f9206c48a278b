"""A disk that is full at a random moment leaves whole blocks, and a message that says so."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import time
from contextlib import closing
from typing import TYPE_CHECKING, Final

import numpy as np
import pytest

from adeye.store.repository import Repository
from tests.chaos.runners import (
    SEED,
    assert_identical,
    assert_one_message,
    record,
    run_of,
    size,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.chaos.runners import Cradle, Undisturbed

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

POINTS: Final = size(8, 50)
BLOCK: Final = 4


def test_file_that_may_not_grow_leaves_whole_blocks(cradle: Cradle, little: Undisturbed) -> None:
    random = np.random.default_rng(SEED)
    most = little.db.stat().st_size
    kept = 0
    for number in range(POINTS):
        db = f"limited-{number}.db"
        runner = cradle.start(
            little.folder,
            *run_of(db),
            setup={"block": BLOCK, "fsize": int(random.uniform(0.0, most))},
        )
        said = runner.wait()
        assert_one_message(said, 5, db, "Check free space")
        kept += assert_whole_blocks(little.folder / db)
        resume(cradle, little, little.folder / db)
    record("file that may not grow", points=POINTS, runs_kept=kept, partial_rows=0)


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


def test_full_disk_leaves_whole_blocks(
    cradle: Cradle, little: Undisturbed, small_disk: Path
) -> None:
    random = np.random.default_rng(SEED + 1)
    most = little.db.stat().st_size
    kept, slowest = 0, 0.0
    for number in range(POINTS):
        db = small_disk / f"full-{number}.db"
        shutil.rmtree(small_disk, ignore_errors=True)
        ballast = small_disk / "ballast"
        free = shutil.disk_usage(small_disk).free
        with ballast.open("wb") as file:
            # Database and log have to go into what is left.
            os.posix_fallocate(file.fileno(), 0, free - int(random.uniform(8_192, 1.2 * most)))
        before = time.monotonic()
        said = cradle.adeye(little.folder, *run_of(str(db)), setup={"block": BLOCK})
        slowest = max(slowest, time.monotonic() - before)
        assert_one_message(said, 5, db.name, "Free some space")
        ballast.unlink()
        kept += assert_whole_blocks(db)
        resume(cradle, little, db)
    record("full disk", points=POINTS, runs_kept=kept, partial_rows=0, slowest_s=round(slowest, 1))


def assert_whole_blocks(db: Path) -> int:
    """See that what a failure left is whole blocks and nothing besides; return the runs."""
    if not db.exists() or not tables_of(db):
        return 0
    with Repository.open(db, create=False) as repository:
        assert repository.verify() == ()
        found = repository.campaigns()
        if not found:
            return 0
        done = repository.work_state(found[0].id).done
        runs = repository.info().rows["run"]
        assert runs == done * BLOCK
        return runs


def tables_of(db: Path) -> int:
    """Count what a database defines; nothing if its first transaction was not kept."""
    with closing(sqlite3.connect(db)) as raw:
        return int(raw.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0])


def resume(cradle: Cradle, whole: Undisturbed, db: Path) -> None:
    """Run the rest undisturbed and see that the campaign is the same."""
    said = cradle.adeye(whole.folder, *run_of(str(db)), setup={"block": BLOCK})
    assert said.code == 0, said.text
    assert_identical(whole, db)
