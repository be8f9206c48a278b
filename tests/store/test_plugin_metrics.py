"""Metrics of plug-ins: a wide table for each set of them, kept once and protected."""

import sqlite3
from dataclasses import replace
from typing import Any

import pytest

from adeye.errors import IntegrityError
from adeye.judge.metrics.registry import LONGEST_COLUMN
from adeye.store.records import MetricValue
from tests.refusals import refused
from tests.store.conftest import Store

COMFORT = {"sway_m": MetricValue(0.5, "value", 2.0), "nausea": MetricValue(None, "undefined")}


def complete(store: Store, metrics: Any, *, plugin: str = "comfort", **changes: Any) -> str:
    """Complete a campaign whose runs, new or judged again, carry metrics of a plug-in."""
    plan = store.plan(2)
    block = store.claim(plan.campaign)
    runs = [
        store.example.run(case, plugin_metrics={plugin: metrics}, **changes) for case in block.cases
    ]
    assert store.complete(block, runs)
    return str(runs[0].result_digest)


def test_metrics_of_a_plugin_have_a_wide_table_of_their_own(store: Store) -> None:
    result = complete(store, COMFORT)
    stored = store.run(result)
    (table,) = stored.plugin_metrics
    assert table.startswith("metric_comfort_")
    assert stored.plugin_metrics[table] == COMFORT
    found = store.rows(f"SELECT sway_m, nausea, nausea_status FROM {table}")  # noqa: S608
    assert found == [(0.5, None, "undefined")] * 2
    assert store.repository.verify() == ()


def test_new_metric_makes_another_table_and_keeps_the_first(store: Store) -> None:
    complete(store, COMFORT)
    store.example.thresholds["FSR1"] = "3 m"
    result = complete(store, {**COMFORT, "third": MetricValue(1.0)})
    stored = store.run(result)
    assert sorted(len(metrics) for metrics in stored.plugin_metrics.values()) == [2, 3]
    assert store.repository.verify() == ()


def test_run_without_metrics_of_a_plugin_has_none(store: Store) -> None:
    complete(store, COMFORT)
    store.example.with_odd("2")
    store.campaign(4)
    stored = store.run(store.example.case(3).result_digest)
    assert stored.plugin_metrics == {}


def test_same_metrics_again_are_kept_once_and_others_are_an_error(store: Store) -> None:
    complete(store, COMFORT)
    store.example.thresholds["FSR1"] = "3 m"
    complete(store, COMFORT)
    store.example.thresholds["FSR1"] = "4 m"
    changed = {**COMFORT, "sway_m": replace(COMFORT["sway_m"], value=0.6)}
    refused(IntegrityError, complete, store, changed, says="measured something else")


def test_machine_dependent_result_keeps_its_first_metrics(store: Store) -> None:
    blocks = []
    for version in ("1", "2"):
        store.example.with_odd(version)
        blocks.append(store.claim(store.plan(2).campaign))
    changed = {**COMFORT, "sway_m": replace(COMFORT["sway_m"], value=0.6)}
    measured = ({"comfort": COMFORT}, {"comfort": changed, "pitch": COMFORT})
    for block, metrics, trace in zip(blocks, measured, ("e" * 32, "f" * 32), strict=True):
        changes = {"trace_digest": trace, "is_machine_dependent": True, "plugin_metrics": metrics}
        runs = [store.example.run(case, **changes) for case in block.cases]
        assert store.complete(block, runs)
    stored = store.run(runs[0].result_digest)
    assert list(stored.plugin_metrics.values()) == [COMFORT]


def test_rows_of_plugins_are_protected_and_verified(store: Store) -> None:
    stored = store.run(complete(store, COMFORT))
    (table,) = stored.plugin_metrics
    change = f"UPDATE {table} SET sway_m = 0.7"  # noqa: S608
    refused(sqlite3.IntegrityError, store.raw.execute, change, says="insert-only")
    store.raw.execute(f"DROP TRIGGER {table}_no_update")
    store.raw.execute(change)
    found = {(item.table, item.row) for item in store.repository.verify()}
    assert {name for name, _ in found} == {table, "schema"}
    assert ("schema", f"{table}_no_update") in found


@pytest.mark.parametrize("name", ["Sway", "sway m", "1st", "a;b", "", "x" * 65])
def test_metric_id_must_be_an_identifier(store: Store, name: str) -> None:
    with pytest.raises(ValueError, match="lower-case identifier"):
        complete(store, {name: MetricValue(1.0)})
    assert store.repository.info().rows["run"] == 0


@pytest.mark.parametrize("plugin", ["./my plug'in.py:Comfort", f"./{'long' * 20}.py:Comfort"])
def test_plugin_may_have_any_name(store: Store, plugin: str) -> None:
    longest = {f"{'x' * (LONGEST_COLUMN - 1)}{end}": MetricValue(1.0) for end in "ab"}
    result = complete(store, {**COMFORT, **longest}, plugin=plugin)
    stored = store.run(result)
    assert list(stored.plugin_metrics.values()) == [{**COMFORT, **longest}]
    assert store.repository.verify() == ()


def test_metrics_of_a_plugin_are_in_no_result_hash(store: Store) -> None:
    campaign = store.campaign(2)
    before = store.result_hash(campaign)
    store.example.thresholds["FSR1"] = "3 m"
    complete(store, COMFORT)
    assert store.result_hash(campaign) == before
