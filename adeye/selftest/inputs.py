"""Masters in what people write: thresholds, formulas and files."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.selftest.bench import (
    BARE,
    DB,
    DRIVING,
    DRIVING_CONCEPT,
    HANDOVER,
    HANDOVER_CONCEPT,
    SCENARIO,
    Bench,
    Edit,
    Examine,
    Master,
    Seen,
    running,
)

if TYPE_CHECKING:
    from pathlib import Path

# --- Masters in what people write: thresholds, formulas and files ---------------------------------

_CHECK: Final = "check of the files, before anything is executed"


def _odd_of(file: str) -> str:
    return HANDOVER if file in {HANDOVER, HANDOVER_CONCEPT} else DRIVING


def _threshold(name: str, wrong: str, code: int, words: str, bad: Edit, good: str) -> Master:
    """A threshold that is wrong; its twin has another that is right."""
    twin = Edit(bad.file, bad.old, good)
    finder = "judging, on runs that are known to be good" if code != 2 else _CHECK
    odd = _odd_of(bad.file)
    return Master(
        name, "threshold", wrong, finder, code, words, running(bad, odd=odd), running(twin, odd=odd)
    )


def _file(name: str, wrong: str, words: str, bad: Edit, good: str = "") -> Master:
    """A mistake in a file; its twin is written otherwise and right, or is the file as it is."""
    odd = _odd_of(bad.file)
    twin = running(*([Edit(bad.file, bad.old, good)] if good else []), odd=odd)
    return Master(name, "file", wrong, _CHECK, 2, words, running(bad, odd=odd), twin)


_SWEEP: Final = "    sweep:\n      parameters:\n        ego_speed: [20 m/s, 25 m/s]\n"
_AGAIN: Final = f"{_SWEEP}  - use: closing\n    as: again\n    faults: [none]\n"
_FOUR: Final = Edit(DRIVING_CONCEPT, "min_exercised: 1", "min_exercised: 4")
_NOW: Final = "sensor.front.age <= 0.3 s)"

THRESHOLDS: Final = (
    _threshold(
        "threshold_swapped",
        "at_least in place of at_most",
        2,
        "'max_deceleration_mps2 >= 6 m/s²' bounds the harmless side: the higher it is, the worse",
        Edit(DRIVING_CONCEPT, "at_most: 6.0", "at_least: 6.0"),
        "at_most: 6.5",
    ),
    _threshold(
        "threshold_sign",
        "a deceleration without its sign",
        1,
        "FSR-07 FAIL",
        Edit(DRIVING_CONCEPT, ">= -1 m/s^2", ">= 1 m/s^2"),
        ">= -2 m/s^2",
    ),
    _threshold(
        "threshold_factor",
        "ms in place of s",
        1,
        "FSR-06 FAIL",
        Edit(DRIVING_CONCEPT, "age <= 0.3 s", "age <= 0.3 ms"),
        "age <= 300 ms",
    ),
    _threshold(
        "threshold_dimension",
        "m in place of s",
        2,
        "is a time, '0.3 m' is a length",
        Edit(DRIVING_CONCEPT, "age <= 0.3 s", "age <= 0.3 m"),
        "age <= 0.005 min",
    ),
    _threshold(
        "threshold_without_unit",
        "a length is compared with a plain number",
        2,
        "Give the number its unit",
        Edit(DRIVING_CONCEPT, "ego.lane_offset) <= 0.6 m", "ego.lane_offset) <= 0.6"),
        "ego.lane_offset) <= 60 cm",
    ),
    _threshold(
        "precondition_never_met",
        "the precondition of an FSR never holds",
        3,
        "FSR-06 VACUOUS",
        Edit(DRIVING_CONCEPT, "always(time >= 0.5 s implies", "always(time >= 500 s implies"),
        "always(time >= 5 s implies",
    ),
    _threshold(
        "too_few_runs",
        "more exercised runs are asked for than there are",
        3,
        "FSR-01 VACUOUS",
        Edit(DRIVING_CONCEPT, "min_exercised: 1", "min_exercised: 3"),
        "min_exercised: 2",
    ),
    Master(
        "run_counted_twice",
        "threshold",
        "two runs are there under two names, where four are asked for",
        "counting of results",
        3,
        "FSR-01 VACUOUS",
        running(Edit(DRIVING, _SWEEP, f"{_AGAIN}{_SWEEP}"), _FOUR),
        running(Edit(DRIVING, _SWEEP, _AGAIN + _SWEEP.replace("20 m/s, 25", "22 m/s, 24")), _FOUR),
    ),
    _threshold(
        "implication_never_asked_for",
        "the condition inside of a condition never holds",
        3,
        "FSR-06 VACUOUS",
        Edit(
            DRIVING_CONCEPT,
            f"time >= 0.5 s implies {_NOW}",
            f"time >= 0.5 s implies always[0 s, 1 s](time >= 500 s implies {_NOW})",
        ),
        f"time >= 0.5 s implies always[0 s, 1 s](time >= 5 s implies {_NOW})",
    ),
    _threshold(
        "fault_never_comes",
        "the fault begins after the end of the run",
        2,
        "fault nominal_silent never acts in scenario closing: it begins at 200 s",
        Edit(HANDOVER, "onset: {at: 2 s}", "onset: {at: 200 s}"),
        "onset: {at: 2.5 s}",
    ),
    _threshold(
        "fault_never_acts",
        "the condition of the fault never holds, and no contact happens without it either",
        3,
        "FSR-11 INVALID",
        Edit(HANDOVER, "onset: {at: 2 s}", "onset: {when: neighbour.gap >= 500 m}"),
        "onset: {when: neighbour.gap <= 500 m and time >= 2 s}",
    ),
    _threshold(
        "event_never_comes",
        "the lead never brakes, so that the scenario does not come about",
        3,
        "FSR-01 INVALID",
        Edit(SCENARIO, "when: time >= 3 s", "when: time >= 300 s"),
        "when: time >= 3.5 s",
    ),
    _threshold(
        "window_beyond_the_end",
        "an obligation is longer than the tail of the scenario",
        2,
        "FSR-13: it looks 30.05 s beyond the horizon, and scenario 'closing' has a tail of 5 s",
        Edit(HANDOVER_CONCEPT, "always[0 s, 3 s]", "always[0 s, 30 s]"),
        "always[0 s, 2 s]",
    ),
)

FILES: Final = (
    _file(
        "key_unknown",
        "a misspelt key",
        "Did you mean 'range'?",
        Edit(BARE, "range: 150 m", "range: 150 m\n    rang: 150 m"),
    ),
    _file(
        "key_twice",
        "a key is there twice",
        "key 'severity' occurs twice",
        Edit(DRIVING_CONCEPT, "severity: S3\n", "severity: S3\n    severity: S2\n"),
    ),
    _file(
        "unit_missing",
        "a length without a unit",
        "150 has no unit",
        Edit(BARE, "range: 150 m", "range: 150"),
        "range: 0.15 km",
    ),
    _file(
        "unit_of_another_quantity",
        "a length in seconds",
        "'150 s' is not a length",
        Edit(BARE, "range: 150 m", "range: 150 s"),
        "range: 15000 cm",
    ),
    _file(
        "not_a_number",
        ".nan as a threshold",
        ".nan is not a finite number",
        Edit(DRIVING_CONCEPT, "at_most: 6.0", "at_most: .nan"),
        "at_most: 6",
    ),
    _file(
        "infinite",
        ".inf as a threshold",
        ".inf is not a finite number",
        Edit(DRIVING_CONCEPT, "at_most: 6.0", "at_most: .inf"),
        "at_most: 6 m/s^2",
    ),
    _file(
        "severity_swapped",
        "an exposure where the severity belongs",
        "must be 'S0', 'S1', 'S2' or 'S3' ('E3')",
        Edit(DRIVING_CONCEPT, "severity: S3", "severity: E3"),
        "severity: S2",
    ),
    _file(
        "exposure_swapped",
        "a controllability where the exposure belongs",
        "must be 'E0', 'E1', 'E2', 'E3' or 'E4' ('C3')",
        Edit(DRIVING_CONCEPT, "exposure: E4", "exposure: C3"),
        "exposure: E3",
    ),
    _file(
        "hazard_unknown",
        "a safety goal of a hazardous event that is not there",
        "'HE-02' is none of HE-01",
        Edit(DRIVING_CONCEPT, "hazardous_events: [HE-01]", "hazardous_events: [HE-02]"),
    ),
    _file(
        "signal_unknown",
        "a formula names a signal that is not there",
        "Did you mean 'ego.lane_offset'?",
        Edit(DRIVING_CONCEPT, "ego.lane_offset", "ego.lane_ofset"),
    ),
    _file(
        "metric_unknown",
        "a bound on a metric that is not there",
        "there is no metric 'max_deceleration_mps'",
        Edit(DRIVING_CONCEPT, "max_deceleration_mps2", "max_deceleration_mps"),
    ),
    _file(
        "link_unknown",
        "a channel links a sensor that is not there",
        "Did you mean 'front'?",
        Edit(BARE, "links: [localisation, front]", "links: [localisation, frnt]"),
        "links: [front, localisation]",
    ),
    _file(
        "gate_unknown",
        "the gate names an architecture that is not there",
        "gate names 'bear'",
        Edit(DRIVING, "gate: {architectures: [bare]}", "gate: {architectures: [bear]}"),
    ),
    _file(
        "selection_empty",
        "no combination of the sweep is left",
        "none of 2 combinations",
        Edit(DRIVING, "25 m/s]\n", "25 m/s]\n      where: [ego_speed >= 29 m/s]\n"),
        "25 m/s]\n      where: [ego_speed >= 19 m/s]\n",
    ),
    _file(
        "value_out_of_range",
        "a swept value outside the scenario's range",
        "35 m/s is outside the scenario's range",
        Edit(DRIVING, "25 m/s]", "35 m/s]"),
        "24 m/s]",
    ),
    _file(
        "outside_the_odd",
        "a swept value outside the ODD",
        "is above the ODD's maximum 80 km/h",
        Edit(DRIVING, "max: 130 km/h", "max: 80 km/h"),
        "max: 120 km/h",
    ),
    _file(
        "trigger_unknown",
        "a trigger names what is not there",
        "uses 'tyme', which does not exist",
        Edit(SCENARIO, "when: time >= 3 s", "when: tyme >= 3 s"),
    ),
)


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
