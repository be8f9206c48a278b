"""How do time and memory of a campaign grow with the number of runs?

Whole campaigns of the shipped ODD with a million test cases, cut to a random sample of 10³, 10⁴
and 10⁵ runs (and of 10⁶ with ``ADEYE_MILLION=1``), each by ``adeye run`` in a process of its own
into a new database. Wall and CPU time, the peak of the process's memory and the size of the
database; the ratio is the CPU time per run over that of the smallest campaign.

    python benchmarks/growth.py            the whole measurement
    python benchmarks/growth.py --smoke    one short round, to see that it works
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
from typing import Any

from support.command import drive, ratios, spread
from support.sample import ROOT, write_sample


def campaign(samples: int) -> dict[str, float]:
    """Run a sample of the ODD and return what it took."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        path = write_sample(place, samples)
        command = [sys.executable, "-m", "adeye", "run", str(path), "--quiet"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        began = time.perf_counter()
        done = subprocess.run(  # noqa: S603 - adeye itself
            [*command, "--db", str(place / "growth.db")],
            cwd=place,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode not in {0, 1}:
            raise RuntimeError(done.stderr)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return {
            "wall_s": time.perf_counter() - began,
            "cpu_s": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            # The largest child so far: sizes are measured in ascending order.
            "peak_mb": after.ru_maxrss / 1024,
            "database_mb": (place / "growth.db").stat().st_size / 1e6,
        }


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure every size once a round."""
    sizes = [20, 40] if smoke else [1_000, 10_000, 100_000]
    if os.environ.get("ADEYE_MILLION"):
        sizes.append(1_000_000)
    took: dict[int, list[dict[str, float]]] = {size: [] for size in sizes}
    for size in sizes:
        for _ in range(rounds if size < 100_000 else 1):
            took[size].append(campaign(size))
    base = statistics.median(item["cpu_s"] for item in took[sizes[0]]) / sizes[0]
    return [
        {
            "runs": size,
            **{name: statistics.median(item[name] for item in items) for name in items[0]},
            **ratios([(item["cpu_s"] / size, base) for item in items]),
        }
        for size, items in took.items()
    ]


HEADERS = ("runs", "wall [s]", "CPU [s]", "ms/run", "peak [MB]", "database [MB]", "ratio (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [
        str(item["runs"]),
        f"{item['wall_s']:.1f}",
        f"{item['cpu_s']:.1f}",
        f"{1e3 * item['cpu_s'] / item['runs']:.2f}",
        f"{item['peak_mb']:.0f}",
        f"{item['database_mb']:.1f}",
        spread(item),
    ]


if __name__ == "__main__":
    sys.exit(drive("growth", __doc__, measure, HEADERS, row))
