"""Masters in what people write, and in metrics."""

import re
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from adeye.selftest.bench import DB, DRIVING, Bench, Edit, Master
from adeye.selftest.inputs import FILES, Gauge, bounded, compare

# --- metrics: the second opinion agrees with the built-in ones; see ``test_running`` for the rest


PLUGIN = Edit(DRIVING, "plugins: []", "plugins: [./parts.py:Braking]")
BRAKING = "selftest_braking_mps2"


@pytest.fixture
def db(bench: Bench) -> Path:
    assert bench.run((PLUGIN,)).exit_code == 0
    return bench.settle((PLUGIN,)) / DB


def test_second_opinion_is_compared_run_by_run(db: Path) -> None:
    assert compare(db, BRAKING, "max_deceleration_mps2").text == "2 runs agree"
    apart = compare(db, BRAKING, "max_jerk_mps3")
    assert apart.exit_code == 4
    assert apart.text.count("and not") == 2


def test_metric_without_values_agrees_with_nothing(db: Path) -> None:
    assert compare(db, BRAKING, "takeover_time_s").exit_code == 4


def test_metric_that_is_not_there_agrees_with_nothing(db: Path) -> None:
    assert compare(db, "no_such_column", "max_jerk_mps3").exit_code == 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (Gauge("Distance", "selftest_distance_m", bound), Gauge(plugin, column, bound))
        for plugin, column, bound in (
            ("CentreDistance", "selftest_centre_distance_m", "at_least: 12.0"),
            ("LateDistance", "selftest_late_distance_m", "at_least: 8.83"),
            ("ShortDistance", "selftest_short_distance_m", "at_least: 15.0"),
            ("SwallowingDistance", "selftest_swallowing_distance_m", "at_least: 11.0"),
        )
    ]
    + [
        (
            Gauge("Braking", "selftest_braking_mps2", "at_most: 2.0"),
            Gauge("FlippedBraking", "selftest_flipped_braking_mps2", "at_most: 2.0"),
        )
    ],
    ids=lambda item: item.plugin,
)
def test_wrong_metric_lets_pass_too_much(bench: Bench, right: Gauge, wrong: Gauge) -> None:
    assert bench.run(wrong.edits).exit_code == 0
    seen = bench.run(right.edits)
    assert seen.exit_code == 1
    assert "FSR-02 FAIL" in seen.text


@pytest.mark.slow
@pytest.mark.parametrize("plugin", ["Broken", "Endless", "Raising"])
def test_metric_that_fails_spoils_its_run_alone(bench: Bench, plugin: str) -> None:
    edits = bounded(plugin, f"selftest_{plugin.lower()}_m", "at_least: 0.5")
    assert bench.run(edits).exit_code == 3
    with closing(sqlite3.connect(bench.settle(edits) / DB)) as connection:
        found = connection.execute(
            "SELECT verdict FROM verdict WHERE fsr_id = 'FSR-02' ORDER BY verdict"
        ).fetchall()
    assert found == [("ERROR",), ("PASS",)]


# --- files: each mistake is named with its place


@pytest.mark.parametrize("master", FILES, ids=lambda item: item.name)
def test_mistake_is_named_with_file_and_line(bench: Bench, master: Master) -> None:
    seen = master.examine(bench)
    assert master.is_detected(seen), seen.text
    assert re.search(r"\.yaml:\d+:\d+: ", seen.text)
