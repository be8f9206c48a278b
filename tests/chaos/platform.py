"""A machine that does not do its part: the message names the path and what to do."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from adeye.kernel import jit
from tests.chaos.bench import DB, ODD_FILE, Bench, Said
from tests.chaos.ways import Way
from tests.project import ROOT
from tests.stored import stored

NOBODY: Final = 65534
LIMITED: Final = stored("plugins")["limited"]


def limited(bench: Bench, size: int, *arguments: str) -> Said:
    command = [sys.executable, "-c", LIMITED, str(size), *arguments]
    own = {**os.environ, "PYTHONPATH": str(ROOT)}
    ended = subprocess.run(
        command, cwd=bench.folder, env=own, capture_output=True, text=True, check=False
    )
    return Said(ended.returncode, ended.stdout + ended.stderr)


def reseed(bench: Bench) -> None:
    """Leave nothing to reuse."""
    with bench.edited() as odd:
        odd["seed"] = 8


def disk_full(bench: Bench) -> Said:
    reseed(bench)
    size = (bench.folder / DB).stat().st_size
    return limited(bench, size // 4, "run", ODD_FILE, "--db", DB, "--quiet")


def nowhere_for_the_baseline(bench: Bench) -> Said:
    return bench.adeye("gate", "--db", DB, "--baseline", "/proc/nowhere/new.json", "--update")


def newer_schema(bench: Bench) -> Said:
    bench.tamper("UPDATE alembic_version SET version_num = '9999'")
    return bench.gate()


def not_a_database(bench: Bench) -> Said:
    (bench.folder / DB).write_bytes(b"no database at all, only words. " * 400)
    return bench.gate()


def read_only(bench: Bench) -> Said:
    reseed(bench)
    (bench.folder / DB).chmod(0o444)
    bench.folder.chmod(0o555)
    # The superuser may write everywhere.
    is_super = os.geteuid() == 0
    parents = list(bench.folder.parents)[: -len(Path(tempfile.gettempdir()).parents) - 1]
    for parent in parents if is_super else ():
        parent.chmod(0o755)
    if is_super:
        os.seteuid(NOBODY)
    # Nor may others read the superuser's compiled kernels, which are loaded already.
    bench.monkeypatch.setattr(jit, "is_cache_warm", lambda *_: True)
    try:
        return bench.run("--threads", "1")
    finally:
        if is_super:
            os.seteuid(0)
        bench.folder.chmod(0o755)


WAYS: Final = [
    Way("full disk", 5, "adeye.db", disk_full, is_slow=True),
    Way("baseline where nothing can be written", 5, "new.json", nowhere_for_the_baseline),
    Way("database of a newer release", 5, "9999", newer_schema),
    Way("file that is no database", 5, "adeye.db", not_a_database),
    Way("database that may not be written", 5, "adeye.db", read_only),
]
