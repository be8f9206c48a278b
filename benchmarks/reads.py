"""How long does a person wait for a verb that reads, beside an empty Python and beside SQLite?

Each verb is a process of its own, on a database of 20 runs and on one of 10⁴ (of 10⁶ with
``ADEYE_MILLION=1``) of the shipped ODD with a million test cases. The peer is Python's own module
``sqlite3``, which counts the runs of the same file. Rounds are interleaved. Wall and CPU time; the
ratio is the CPU time over that of ``python -c pass``.

    python benchmarks/reads.py            the whole measurement
    python benchmarks/reads.py --smoke    one round on the small one, to see that it works
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from support.command import drive, ratios, spread
from support.sample import ROOT, write_sample

if TYPE_CHECKING:
    from collections.abc import Sequence

VERBS = (
    "query failing-fsrs",
    "query --columns v_runs",
    "show --worst {fsr}",
    "where {fsr}",
    "db info",
    "gate",
    "diff 1 1",
)
COUNT = "import sqlite3, sys; print(sqlite3.connect(sys.argv[1]).execute({sql!r}).fetchone())"
ASKED = "SELECT count(*) FROM run"
EMPTY = "python -c pass"
PEER = "python -c 'import sqlite3; …'"
FSR = "SELECT fsr_id FROM campaign_fsr ORDER BY fsr_id LIMIT 1"


def _environment() -> dict[str, str]:
    # Byte code is kept, as it is where adeye is installed.
    kept = {name: value for name, value in os.environ.items() if name[:6] != "ADEYE_"}
    kept.pop("PYTHONDONTWRITEBYTECODE", None)
    return {**kept, "PYTHONPATH": str(ROOT)}


def _timed(command: Sequence[str]) -> tuple[float, float]:
    """Run a process and return its wall and its CPU time [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.perf_counter()
    done = subprocess.run(  # noqa: S603 - commands of this file
        command, env=_environment(), cwd=ROOT, capture_output=True, text=True, check=False
    )
    wall = time.perf_counter() - began
    if done.returncode not in {0, 1}:
        raise RuntimeError(done.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _commands(db: Path) -> dict[str, list[str]]:
    import sqlite3

    ((fsr,),) = sqlite3.connect(db).execute(FSR).fetchall()
    adeye = [sys.executable, "-m", "adeye"]
    verbs = (verb.format(fsr=fsr) for verb in VERBS)
    return {
        EMPTY: [sys.executable, "-c", "pass"],
        PEER: [sys.executable, "-c", COUNT.format(sql=ASKED), str(db)],
        **{f"adeye {verb}": [*adeye, *verb.split(), "--db", str(db)] for verb in verbs},
    }


def _on(runs: int, rounds: int) -> list[dict[str, Any]]:
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        odd, db = write_sample(place, runs), place / "reads.db"
        _timed([sys.executable, "-m", "adeye", "run", str(odd), "--quiet", "--db", str(db)])
        commands = _commands(db)
        took: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
        for number in range(rounds + 1):
            for name, command in commands.items():
                found = _timed(command)
                # The first round fills the caches of the machine.
                if number:
                    took[name].append(found)
    return [
        {
            "runs": runs,
            "command": name,
            "wall_s": statistics.median(wall for wall, _ in times),
            "cpu_s": statistics.median(cpu for _, cpu in times),
            **ratios([(one[1], base[1]) for one, base in zip(times, took[EMPTY], strict=True)]),
        }
        for name, times in took.items()
    ]


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure every verb once a round, on every size."""
    sizes = [20] if smoke else [20, 10_000]
    if os.environ.get("ADEYE_MILLION"):
        sizes.append(1_000_000)
    return [item for runs in sizes for item in _on(runs, rounds)]


HEADERS = ("runs", "command", "wall [s]", "CPU [s]", "ratio to an empty Python (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [
        f"{item['runs']:,}",
        item["command"],
        f"{item['wall_s']:.2f}",
        f"{item['cpu_s']:.2f}",
        spread(item, 1),
    ]


if __name__ == "__main__":
    sys.exit(drive("reads", __doc__, measure, HEADERS, row))
