"""Masters in what people write: thresholds, formulas and files."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING, Any, Final

import yaml

from adeye.selftest.bench import (
    BARE,
    DB,
    DRIVING,
    DRIVING_CONCEPT,
    HANDOVER,
    HANDOVER_CONCEPT,
    Bench,
    Edit,
    Examine,
    Group,
    Master,
    Seen,
    running,
)

if TYPE_CHECKING:
    from pathlib import Path

# --- Masters in what people write: thresholds, formulas and files ---------------------------------

_CHECK: Final = "check of the files, before anything is executed"


def _read(group: Group) -> tuple[Master, ...]:
    """Read the masters of a group from ``masters.yaml``, which says what its keys mean."""
    text = (resources.files("adeye.selftest") / "masters.yaml").read_text("utf-8")
    written = yaml.safe_load(text).items()
    return tuple(_master(name, item) for name, item in written if item["group"] == group)


def _master(name: str, item: dict[str, Any]) -> Master:
    odd = HANDOVER if item["file"] in {HANDOVER, HANDOVER_CONCEPT} else DRIVING
    code = item.get("exit_code", 2)
    finder = "judging, on runs that are known to be good" if code != 2 else _CHECK
    also = [Edit(*item["also"])] if "also" in item else []
    bad, good = (
        [Edit(item["file"], item["old"], item[key]), *also] if key in item else also
        for key in ("bad", "good")
    )
    return Master(
        name,
        item["group"],
        item["wrong"],
        item.get("finder", finder),
        code,
        item["words"],
        running(*bad, odd=odd),
        running(*good, odd=odd),
    )


THRESHOLDS: Final = _read("threshold")
FILES: Final = _read("file")


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


def _failing(name: str, metric: str, wrong: str) -> Master:
    """A metric without a value in one of two runs: over both the FSR is an ERROR, never a PASS."""

    def examine(plugin: str) -> Examine:
        return running(*bounded(plugin, f"selftest_{plugin.lower()}_m", "at_least: 0.5"))

    words = f"FSR-02 ERROR for bare (selftest_{metric.lower()}_m, the metric has no finite value)"
    finder = "status of the metric, fold of the verdicts"
    return Master(name, "metric", wrong, finder, 3, words, examine(metric), examine("Whole"))


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


def _tampering(plugin: str, flaw: str) -> Examine:
    """List a metric that no FSR hangs on beside a car with a flaw."""
    listed = Edit(DRIVING, "plugins: []", f"plugins: [./parts.py:{plugin}]")
    return running(listed, Edit(BARE, "flaw: none", f"flaw: {flaw}"))


def _wrong(name: str, wrong: str, metric: Gauge, twin: Gauge, own: str) -> Master:
    """A metric with an error by which an FSR passes that would fail by the right one.

    The verdict does not tell; the built-in metric must differ from it, and agree with the good one.
    """
    finder = f"comparison with the built-in {own}, run by run"
    return Master(
        name, "metric", wrong, finder, 4, "and not", _compared(metric, own), _compared(twin, own)
    )


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


_DISTANCE: Final = Gauge("Distance", "selftest_distance_m", "at_least: 5.0")
_BRAKING: Final = Gauge("Braking", "selftest_braking_mps2", "at_most: 6.0")


def _distance(name: str, wrong: str, metric: Gauge) -> Master:
    return _wrong(name, wrong, metric, _DISTANCE, "min_distance_m")


METRICS: Final = (
    _failing("metric_nan", "Broken", "a metric is not a number in one row of one run"),
    _failing("metric_infinite", "Endless", "a metric is infinite in one run without a reason"),
    _failing("metric_raises", "Raising", "a metric raises an exception in one run"),
    Master(
        "metric_leaves",
        "metric",
        "a metric ends the process with code 0",
        "the process that takes an exit code only from its explicit end",
        3,
        "in the plug-in ./parts.py:Leaving",
        _as_program("Leaving"),
        _as_program("Whole"),
    ),
    _distance(
        "metric_centres",
        "distance from centre to centre",
        Gauge("CentreDistance", "selftest_centre_distance_m", "at_least: 12.0"),
    ),
    _distance(
        "metric_row_late",
        "the ego is taken from the row before",
        Gauge("LateDistance", "selftest_late_distance_m", "at_least: 8.83"),
    ),
    _distance(
        "metric_without_tail",
        "the metric ends at the horizon",
        Gauge("ShortDistance", "selftest_short_distance_m", "at_least: 15.0"),
    ),
    _distance(
        "metric_nan_swallowed",
        "the metric is NaN where it is worst, and leaves out what is NaN",
        Gauge("SwallowingDistance", "selftest_swallowing_distance_m", "at_least: 11.0"),
    ),
    _wrong(
        "metric_sign",
        "acceleration for deceleration",
        Gauge("FlippedBraking", "selftest_flipped_braking_mps2", "at_most: 2.0"),
        _BRAKING,
        "max_deceleration_mps2",
    ),
    Master(
        "metric_tampers",
        "metric",
        "a metric writes into the trace: the steering of a car that oscillates is straight",
        "FSR-04: bound on the steering; guests are shown copies",
        1,
        "FSR-04 FAIL",
        _tampering("Tampering", "oscillates"),
        _tampering("Whole", "none"),
    ),
)
