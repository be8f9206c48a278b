import sqlite3
from dataclasses import replace
from typing import Any

import pytest

from adeye.errors import IntegrityError
from adeye.judge.metrics.registry import LONGEST_COLUMN
from adeye.store.records import MetricValue
from adeye.store.repository import Repository
from tests.store.rows import complete_block, result_table_hash

COMFORT = {"sway_m": MetricValue(0.5, "value", 2.0), "nausea": MetricValue(None, "undefined")}


def complete(
    repository: Repository, example: Any, metrics: Any, *, plugin: str = "comfort", **changes: Any
) -> str:
    """Complete a campaign whose runs, new or judged again, carry metrics of a plug-in."""
    plan = repository.plan_campaign(example.record(), example.cases(2))
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    runs = [example.run(case, plugin_metrics={plugin: metrics}, **changes) for case in block.cases]
    assert complete_block(repository, block, runs)
    return str(runs[0].result_digest)


@pytest.mark.slow
def test_metrics_of_a_plugin_have_a_wide_table_of_their_own(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    result = complete(repository, example, COMFORT)
    stored = repository.run_row(result)
    assert stored is not None
    (table,) = stored.plugin_metrics
    assert table.startswith("metric_comfort_")
    assert stored.plugin_metrics[table] == COMFORT
    found = raw.execute(f"SELECT sway_m, nausea, nausea_status FROM {table}").fetchall()  # noqa: S608
    assert found == [(0.5, None, "undefined")] * 2
    assert repository.verify() == ()


@pytest.mark.slow
def test_new_metric_makes_another_table_and_keeps_the_first(
    repository: Repository, example: Any
) -> None:
    complete(repository, example, COMFORT)
    example.thresholds["FSR1"] = "3 m"
    result = complete(repository, example, {**COMFORT, "third": MetricValue(1.0)})
    stored = repository.run_row(result)
    assert stored is not None
    assert sorted(len(metrics) for metrics in stored.plugin_metrics.values()) == [2, 3]
    assert repository.verify() == ()


@pytest.mark.slow
def test_run_without_metrics_of_a_plugin_has_none(repository: Repository, example: Any) -> None:
    complete(repository, example, COMFORT)
    example.with_odd("2")
    example.campaign(repository, 4)
    stored = repository.run_row(example.case(3).result_digest)
    assert stored is not None
    assert stored.plugin_metrics == {}


@pytest.mark.slow
def test_same_metrics_again_are_kept_once_and_others_are_an_error(
    repository: Repository, example: Any
) -> None:
    complete(repository, example, COMFORT)
    example.thresholds["FSR1"] = "3 m"
    complete(repository, example, COMFORT)
    example.thresholds["FSR1"] = "4 m"
    changed = {**COMFORT, "sway_m": replace(COMFORT["sway_m"], value=0.6)}
    with pytest.raises(IntegrityError, match="measured something else"):
        complete(repository, example, changed)


def test_machine_dependent_result_keeps_its_first_metrics(
    repository: Repository, example: Any
) -> None:
    complete(repository, example, COMFORT, is_machine_dependent=True)
    example.thresholds["FSR1"] = "3 m"
    changed = {**COMFORT, "sway_m": replace(COMFORT["sway_m"], value=0.6)}
    result = complete(repository, example, changed, trace_digest="f" * 32)
    stored = repository.run_row(result)
    assert stored is not None
    assert list(stored.plugin_metrics.values()) == [COMFORT]


@pytest.mark.slow
def test_rows_of_plugins_are_protected_and_verified(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    stored = repository.run_row(complete(repository, example, COMFORT))
    assert stored is not None
    (table,) = stored.plugin_metrics
    change = f"UPDATE {table} SET sway_m = 0.7"  # noqa: S608
    with pytest.raises(sqlite3.IntegrityError, match="insert-only"):
        raw.execute(change)
    raw.execute(f"DROP TRIGGER {table}_no_update")
    raw.execute(change)
    assert {item.table for item in repository.verify()} == {table}


@pytest.mark.parametrize("name", ["Sway", "sway m", "1st", "a;b", "", "x" * 65])
def test_metric_id_must_be_an_identifier(repository: Repository, example: Any, name: str) -> None:
    with pytest.raises(ValueError, match="lower-case identifier"):
        complete(repository, example, {name: MetricValue(1.0)})
    assert repository.info().rows["run"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("plugin", ["./my plug'in.py:Comfort", f"./{'long' * 20}.py:Comfort"])
def test_plugin_may_have_any_name(repository: Repository, example: Any, plugin: str) -> None:
    longest = {f"{'x' * (LONGEST_COLUMN - 1)}{end}": MetricValue(1.0) for end in "ab"}
    result = complete(repository, example, {**COMFORT, **longest}, plugin=plugin)
    stored = repository.run_row(result)
    assert stored is not None
    assert list(stored.plugin_metrics.values()) == [{**COMFORT, **longest}]
    assert repository.verify() == ()


@pytest.mark.slow
def test_metrics_of_a_plugin_are_in_no_result_hash(repository: Repository, example: Any) -> None:
    campaign = example.campaign(repository, 2)
    before = result_table_hash(repository, campaign)
    example.thresholds["FSR1"] = "3 m"
    complete(repository, example, COMFORT)
    assert result_table_hash(repository, campaign) == before
