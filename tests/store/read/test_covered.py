"""Executed runs of a campaign as situations: every planned case is somewhere, once."""

from __future__ import annotations

import shutil
import sqlite3
from typing import TYPE_CHECKING

from adeye.store.read.bulk import coverage_of_runs, declared_attributes, executed_runs

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


def test_every_run_with_a_result_is_a_situation(mini: Executed) -> None:
    found = executed_runs(mini.db, mini.summary.campaign)
    assert (found.planned, found.without_result) == (28, 0)
    rows = [row for item in found.situations for row in item.parameters]
    assert len(rows) + found.not_judged + found.outside_odd == 28
    assert {item.scenario["scenario"] for item in found.situations} == {"cut_in", "lead_braking"}
    planned = sorted(case.parameters["ego_speed"] for case in mini.plan.cases)
    if not found.not_judged:
        assert sorted(row["ego_speed"] for row in rows) == planned


def test_planned_case_without_a_result_is_counted_and_no_situation(
    mini: Executed, tmp_path: Path
) -> None:
    copy = tmp_path / "adeye.db"
    shutil.copyfile(mini.db, copy)
    campaign = mini.summary.campaign
    whole = executed_runs(copy, campaign)
    with sqlite3.connect(copy) as connection:
        # As if one block had not been executed: its cases name results that are not there.
        for name, table in connection.execute(
            "SELECT name, tbl_name FROM sqlite_master WHERE type = 'trigger'"
        ).fetchall():
            if table == "campaign_case":
                connection.execute(f"DROP TRIGGER {name}")
        connection.execute(
            "UPDATE campaign_case SET result_digest = substr('0' || result_digest, 1, 64) "
            "WHERE ordinal < 5"
        )
    found = executed_runs(copy, campaign)
    assert (found.planned, found.without_result) == (28, 5)
    count = sum(len(item.parameters) for item in found.situations)
    assert count == sum(len(item.parameters) for item in whole.situations) - 5


def test_runs_cover_the_bins_that_the_stored_odd_declares(mini: Executed) -> None:
    runs = executed_runs(mini.db, mini.summary.campaign)
    odd = {
        "attributes": {"dynamic_elements": {"ego_speed": {"max": 130.0 / 3.6}}},
        "coverage": {"ego_speed": [0.0, 90.0 / 3.6, 130.0 / 3.6]},
    }
    attributes, bins = declared_attributes(odd)
    assert attributes.dynamic_elements.ego_speed is not None
    assert bins is not None
    (speed, *_) = [
        item
        for item in coverage_of_runs(runs, odd, 1).combinations
        if item.attributes == ("ego_speed",)
    ]
    assert [label for (label,), _ in speed.counts] == ["0 to 90 km/h", "90 to 130 km/h"]
    assert sum(count for _, count in speed.counts) == 28 - runs.not_judged


def test_stored_odd_without_bins_declares_none() -> None:
    assert declared_attributes({"attributes": {}})[1] is None
