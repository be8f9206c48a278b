"""What do the ledger, the Merkle root and verification cost, and how do they grow with the runs?

Samples of 10³ and 10⁴ runs of the shipped ODD with a million test cases (10⁵ with
``ADEYE_LARGE=1``), each executed in this process into a new database. Seconds of the ledger are
those of noting rows and writing entries and seals, of the plan too; beside them those within blocks
being saved. Then the root and a whole verification are computed, with the peak of the memory that
Python took for each.

    python benchmarks/evidence.py            the whole measurement
    python benchmarks/evidence.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
import tracemalloc
from pathlib import Path
from typing import TYPE_CHECKING, Any

from support.command import drive, ratios, spread
from support.sample import write_sample

from adeye.campaign.plan import make_plan
from adeye.campaign.run import run_campaign
from adeye.store import ledger
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from collections.abc import Callable


class Clock:
    """Adds up the time within some functions [s]."""

    def __init__(self) -> None:
        """Begin at zero."""
        self.took = 0.0

    def timed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Make a function whose time counts."""

        def run(*arguments: Any, **options: Any) -> Any:
            began = time.perf_counter()
            try:
                return function(*arguments, **options)
            finally:
                self.took += time.perf_counter() - began

        return run


def peak_of(action: Callable[[], Any]) -> tuple[float, float]:
    """Return the time [s] and then, of another go, the peak of memory [MB]."""
    began = time.perf_counter()
    action()
    took = time.perf_counter() - began
    tracemalloc.start()
    action()
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    return took, peak


def campaign(samples: int) -> dict[str, float]:
    """Execute a sample, and check it."""
    kept, saving = Clock(), Clock()
    note, close, complete = ledger.note, ledger.close, Repository.complete_block
    place = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.chdir(folder)
        try:
            plan = make_plan(write_sample(folder, samples))
            ledger.note, ledger.close = kept.timed(note), kept.timed(close)
            Repository.complete_block = saving.timed(complete)  # type: ignore[method-assign]
            run_campaign(plan, db=folder / "a.db")
        finally:
            ledger.note, ledger.close = note, close
            Repository.complete_block = complete  # type: ignore[method-assign]
            os.chdir(place)
        with Repository.open(folder / "a.db") as opened:
            found = opened.find_campaign().id
            root_s, root_mb = peak_of(lambda: opened.evidence.computed_root(found))
            verify_s, verify_mb = peak_of(opened.verify)
            if opened.verify():
                raise RuntimeError(opened.verify())
        size = (folder / "a.db").stat().st_size / 1e6
    return {
        "ledger_s": kept.took,
        "saving_s": saving.took,
        "root_s": root_s,
        "root_mb": root_mb,
        "verify_s": verify_s,
        "verify_mb": verify_mb,
        "database_mb": size,
    }


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure every size; the ratio is the time of a root per run over that of the smallest."""
    sizes = [20, 40] if smoke else [1_000, 10_000]
    if os.environ.get("ADEYE_LARGE"):
        sizes.append(100_000)
    # Compiled once, and imported.
    campaign(20)
    found: list[dict[str, Any]] = []
    base = 0.0
    for size in sizes:
        took = [campaign(size) for _ in range(rounds if size < 10_000 else 1)]
        best = min(took, key=lambda item: item["root_s"])
        base = base or best["root_s"] / size
        pairs = [(item["root_s"] / size, base) for item in took]
        found.append({"runs": size, **best, **ratios(pairs)})
    return found


HEADERS = (
    "runs", "ledger [s]", "saving [s]", "root [s]", "[MB]", "verify [s]", "[MB]", "database [MB]",
    "ratio (spread)",
)  # fmt: skip


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [
        str(item["runs"]),
        *(f"{item[name]:.2f}" for name in ("ledger_s", "saving_s", "root_s")),
        f"{item['root_mb']:.1f}",
        f"{item['verify_s']:.2f}",
        f"{item['verify_mb']:.1f}",
        f"{item['database_mb']:.1f}",
        spread(item),
    ]


if __name__ == "__main__":
    sys.exit(drive("evidence", __doc__, measure, HEADERS, row))
