"""Metrics: the second opinion agrees with the built-in ones, and every error is seen."""

from pathlib import Path

import pytest

from adeye.selftest.bench import DB, Bench, Edit
from adeye.selftest.masters import Master, is_good
from adeye.selftest.measuring import METRICS, compare
from adeye.selftest.project import DRIVING

PLUGIN = Edit(DRIVING, "plugins: []", "plugins: [./parts.py:Braking]")
BRAKING = "selftest_braking_mps2"


@pytest.mark.slow
@pytest.mark.parametrize("master", METRICS, ids=lambda item: item.name)
def test_master_is_detected(bench: Bench, master: Master) -> None:
    seen = master.examine(bench)
    assert master.is_detected(seen), seen.text
    twin = master.twin(bench)
    assert is_good(twin), twin.text


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
