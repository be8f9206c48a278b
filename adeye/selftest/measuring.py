"""Masters in metrics: metrics that fail, and metrics with an error against a second opinion."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING, Final

from adeye.selftest.bench import DB, Bench, Edit, Seen
from adeye.selftest.masters import Examine, Master, running
from adeye.selftest.project import DRIVING, DRIVING_CONCEPT

if TYPE_CHECKING:
    from pathlib import Path

TOLERANCE: Final = 1e-6
"""Up to which two metrics of one quantity agree, in its unit; both compute in double precision."""
_BOUND: Final = "{metric: max_deceleration_mps2, at_most: 6.0}"


def _plugin(name: str) -> Edit:
    return Edit(DRIVING, "plugins: []", f"plugins: [./parts.py:{name}]")


def _failing(name: str, metric: str, wrong: str) -> Master:
    """A metric that gives no value: what is bounded by it is an ERROR and never a PASS."""

    def bounded(plugin: str) -> Examine:
        bound = f"{{metric: selftest_{plugin.lower()}_m, at_least: 0.5}}"
        return running(_plugin(plugin), Edit(DRIVING_CONCEPT, _BOUND, bound))

    finder = "status of the metric, fold of the verdicts"
    return Master(
        name, "metric", wrong, finder, 3, "FSR-02 ERROR", bounded(metric), bounded("Whole")
    )


def _wrong(
    name: str, wrong: str, metric: tuple[str, str], twin: tuple[str, str], own: str
) -> Master:
    """A metric with an error; the built-in one must differ from it, and agree with the good one."""
    finder = f"comparison with the built-in {own}, run by run"
    return Master(
        name, "metric", wrong, finder, 4, "and not", _compared(metric, own), _compared(twin, own)
    )


def _compared(metric: tuple[str, str], own: str) -> Examine:
    name, column = metric

    def examine(bench: Bench) -> Seen:
        edits = (_plugin(name),)
        seen = bench.run(edits)
        if seen.exit_code != 0:
            return seen
        return compare(bench.settle(edits) / DB, column, own)

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


_DISTANCE: Final = ("Distance", "selftest_distance_m")
_BRAKING: Final = ("Braking", "selftest_braking_mps2")

METRICS: Final = (
    _failing("metric_nan", "Broken", "a metric is not a number"),
    _failing("metric_infinite", "Endless", "a metric is infinite without a reason"),
    _failing("metric_raises", "Raising", "a metric raises an exception"),
    _wrong(
        "metric_centres",
        "distance from centre to centre",
        ("CentreDistance", "selftest_centre_distance_m"),
        _DISTANCE,
        "min_distance_m",
    ),
    _wrong(
        "metric_row_late",
        "the ego is taken from the row before",
        ("LateDistance", "selftest_late_distance_m"),
        _DISTANCE,
        "min_distance_m",
    ),
    _wrong(
        "metric_without_tail",
        "the metric ends at the horizon",
        ("ShortDistance", "selftest_short_distance_m"),
        _DISTANCE,
        "min_distance_m",
    ),
    _wrong(
        "metric_sign",
        "acceleration for deceleration",
        ("FlippedBraking", "selftest_flipped_braking_mps2"),
        _BRAKING,
        "max_deceleration_mps2",
    ),
)
