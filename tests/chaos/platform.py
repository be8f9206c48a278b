"""A machine that does not do its part: the message names the path and what to do."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING, Final

from tests.chaos.bench import DB, ODD_FILE, Said
from tests.chaos.ways import Way
from tests.project import ROOT

if TYPE_CHECKING:
    from tests.chaos.bench import Bench

NOBODY: Final = 65534
LIMITED: Final = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
size = int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
from adeye.cli.entry import main
sys.exit(main(sys.argv[2:]))
"""


def limited(bench: Bench, size: int, *arguments: str, user: int | None = None) -> Said:
    ended = subprocess.run(
        [sys.executable, "-c", LIMITED, str(size), *arguments],
        cwd=bench.folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        user=user,
    )
    return Said(ended.returncode, ended.stdout + ended.stderr)


def disk_full(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["seed"] = 8
    size = (bench.folder / DB).stat().st_size
    return limited(bench, size + 30_000, "run", ODD_FILE, "--db", DB, "--quiet")


def disk_full_for_the_baseline(bench: Bench) -> Said:
    return limited(bench, 1_000, "gate", "--db", DB, "--baseline", "new.json", "--update")


def newer_schema(bench: Bench) -> Said:
    bench.tamper("UPDATE alembic_version SET version_num = '9999'")
    return bench.gate()


def not_a_database(bench: Bench) -> Said:
    (bench.folder / DB).write_bytes(b"no database at all, only words. " * 400)
    return bench.gate()


def read_only(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["seed"] = 8
    bench.folder.chmod(0o555)
    (bench.folder / DB).chmod(0o444)
    for parent in bench.folder.parents[:3]:
        parent.chmod(0o755)
    user = NOBODY if os.geteuid() == 0 else None
    try:
        return limited(bench, 2**30, "run", ODD_FILE, "--db", DB, "--quiet", user=user)
    finally:
        bench.folder.chmod(0o755)


WAYS: Final = [
    Way("full disk", 5, "adeye.db", disk_full, is_slow=True),
    Way("full disk for the baseline", 5, "new.json", disk_full_for_the_baseline, is_slow=True),
    Way("database of a newer release", 5, "9999", newer_schema),
    Way("file that is no database", 5, "adeye.db", not_a_database),
    Way("database that may not be written", 5, "adeye.db", read_only, is_slow=True),
]
