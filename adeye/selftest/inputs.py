"""Masters in what people write: thresholds, formulas and files."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from adeye.selftest.bench import (
    DB,
    DRIVING,
    DRIVING_CONCEPT,
    Bench,
    Edit,
    Examine,
    Master,
    Seen,
    edited,
    master_of,
    written,
)

# --- Masters in what people write: thresholds, formulas and files ---------------------------------

THRESHOLDS: Final = tuple(edited(*item) for item in written("threshold").items())
FILES: Final = tuple(edited(*item) for item in written("file").items())


# --- Masters in metrics: metrics that fail, and metrics with an error against a second opinion ----

TOLERANCE: Final = 1e-6
"""Up to which two metrics of one quantity agree, in its unit; both compute in double precision."""
_BOUND: Final = "{metric: max_deceleration_mps2, at_most: 6.0}"


def bounded(plugin: str, metric: str, bound: str) -> tuple[Edit, Edit]:
    """Let FSR-02 be a bound on a metric of a plug-in."""
    return (
        Edit(DRIVING, "plugins: []", f"plugins: [./parts.py:{plugin}]"),
        Edit(DRIVING_CONCEPT, _BOUND, f"{{metric: {metric}, {bound}}}"),
    )


@dataclass(frozen=True, slots=True)
class Gauge:
    """A metric of the bench and the bound on it.

    Attributes:
        plugin: Its class.
        column: Its column.
        bound: That FSR-02 asks for.
    """

    plugin: str
    column: str
    bound: str

    @property
    def edits(self) -> tuple[Edit, ...]:
        """What makes FSR-02 depend on it."""
        return bounded(self.plugin, self.column, self.bound)


def _compared(metric: Gauge, own: str) -> Examine:
    def examine(bench: Bench) -> Seen:
        seen = bench.run(metric.edits)
        if seen.exit_code != 0:
            return seen
        return compare(bench.settle(metric.edits) / DB, metric.column, own)

    return examine


def compare(db: Path, column: str, own: str) -> Seen:
    """Hold a plug-in's metric against a built-in one, run by run.

    Args:
        db: Database.
        column: Of the plug-in's metric.
        own: Column of the built-in one.
    """
    with closing(sqlite3.connect(db)) as connection:
        tables = [
            name
            for (name,) in connection.execute(
                "SELECT name FROM sqlite_master WHERE type = 'table' AND name LIKE 'metric_%'"
            )
            if any(row[1] == column for row in connection.execute(f"PRAGMA table_info({name})"))
        ]
        if len(tables) != 1:
            return Seen(4, f"{column} is in {len(tables)} tables and not in one")
        rows = connection.execute(
            f"SELECT run_number, p.{column}, m.{own} "  # noqa: S608 - names of this package
            f"FROM metric m LEFT JOIN {tables[0]} p USING (run_number) ORDER BY run_number"
        ).fetchall()
    apart = [
        f"run {number}: {column} is {found} and not {expected}"
        for number, found, expected in rows
        if found is None or expected is None or not abs(found - expected) <= TOLERANCE
    ]
    if not rows:
        return Seen(3, "there is no run to compare")
    return Seen(4 if apart else 0, "\n".join(apart) or f"{len(rows)} runs agree")


def _as_program(plugin: str) -> Examine:
    """Run the bench with a metric as a shell does: in a process that the metric may end."""

    def examine(bench: Bench) -> Seen:
        folder = bench.settle(bounded(plugin, f"selftest_{plugin.lower()}_m", "at_least: 0.5"))
        command = [sys.executable, "-m", "adeye", "run", DRIVING, "--quiet"]
        done = subprocess.run(  # noqa: S603 - this program
            [*command, "--workers", "1", "--db", "program.db"],
            cwd=folder,
            env=_environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        return Seen(done.returncode, " ".join((done.stdout + done.stderr).split()))

    return examine


def _environment() -> dict[str, str]:
    """Leave out what would change what the command does."""
    kept = "ADEYE_NUMBA_CACHE_DIR"
    return {n: text for n, text in os.environ.items() if n == kept or not n.startswith("ADEYE_")}


def _metric(name: str, item: dict[str, Any]) -> Master:
    if "own" in item:
        # By a metric with an error an FSR passes that would fail by the right one. The verdict does
        # not tell; the built-in metric must differ from it, and agree with the good one.
        bad, good = (_compared(Gauge(*item[key]), item["own"]) for key in ("bad", "good"))
    elif isinstance(item["bad"], str):
        bad, good = _as_program(item["bad"]), _as_program(item["good"])
    else:
        return edited(name, item)
    return master_of(name, item, bad, good)


METRICS: Final = tuple(_metric(*item) for item in written("metric").items())
