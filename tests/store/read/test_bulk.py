"""The bulk read of a comparison: the same as the views show, also for what was not run."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.judge.pairing import NOT_JUDGED, NOT_RUN
from adeye.judge.verdict import VERDICTS
from adeye.store.read import bulk
from adeye.store.read.query import run_query
from adeye.store.repository import Repository
from adeye.store.tables import METRIC_IDS
from tests.project import Executed
from tests.store.conftest import Store
from tests.tampering import unguarded

BOTH = ("camera_radar", "legacy_camera")
WORDS = (*map(str, VERDICTS), "NOT_RUN", None)


@pytest.fixture
def stored(mini: Executed) -> Iterator[Repository]:
    with Repository.open(mini.db, create=False) as repository:
        yield repository


def runs_of(repository: Repository, campaign: str) -> list[dict[str, Any]]:
    table = repository.results(campaign)
    return [dict(zip(table.columns, row, strict=True)) for row in table.rows]


def test_verdicts_are_those_of_the_view(mini: Executed, stored: Repository) -> None:
    compared = stored.compared(mini.summary.campaign, BOTH)
    sql = "SELECT ordinal, fsr, verdict, robustness_low, margin, unit FROM v_verdicts"
    found = run_query(mini.db, sql)
    assert len(compared) == len({row[0] for row in found.rows}) == mini.summary.planned
    assert len(found.rows) == int((compared.verdict != NOT_JUDGED).sum())
    for ordinal, fsr, verdict, robustness, margin, unit in found.rows:
        column = compared.fsrs.index(fsr)
        assert WORDS[compared.verdict[ordinal, column]] == verdict
        for value, expected in (
            (compared.robustness[ordinal, column], robustness),
            (compared.margin[ordinal, column], margin),
        ):
            assert np.isnan(value) if expected is None else value == expected
        code = compared.measured[ordinal, column]
        assert (None if code < 0 else compared.units[code]) == unit


def test_columns_are_those_of_the_runs(mini: Executed, stored: Repository) -> None:
    compared = stored.compared(mini.summary.campaign, BOTH)
    same: dict[str, set[int]] = {}
    points: dict[str, set[int]] = {}
    for place, row in enumerate(runs_of(stored, mini.summary.campaign)):
        assert compared.result[place] == row["run"]
        assert compared.architecture[place] == row["architecture"]
        assert compared.fault_entry[place] == row["fault_entry"]
        same.setdefault(row["situation"], set()).add(int(compared.situation[place]))
        key = row["scenario"] + json.dumps(row["parameters"])
        points.setdefault(key, set()).add(int(compared.point[place]))
    for groups in (same, points):
        assert all(len(codes) == 1 for codes in groups.values())
        assert len(set.union(*groups.values())) == len(groups)
    assert compared.is_done.all()
    assert compared.axes == {}


def test_channels_that_acted_are_those_of_the_timeline(mini: Executed, stored: Repository) -> None:
    compared = stored.compared(mini.summary.campaign, BOTH)
    sql = "SELECT DISTINCT ordinal, subject FROM v_timeline WHERE kind = 'switch'"
    found = run_query(mini.db, sql)
    acted = {
        (place, name)
        for place in range(len(compared))
        for bit, name in enumerate(compared.channels)
        if compared.acting[place] >> bit & 1
    }
    assert acted == set(found.rows)
    assert {name for _, name in acted} == {"nominal", "safety"}


def test_only_the_named_architectures_are_read(mini: Executed, stored: Repository) -> None:
    one = stored.compared(mini.summary.campaign, ("camera_radar",))
    assert one.architecture.words == ("camera_radar",)
    assert len(one) == mini.summary.planned / 2
    assert len(stored.compared(mini.summary.campaign, ("unheard_of",))) == 0


def test_planned_case_without_a_result_is_not_run(store: Store) -> None:
    plan = store.plan(8, block_size=4)
    block = store.claim(plan.campaign)
    assert store.complete(block)
    compared = store.repository.compared(plan.campaign, ("legacy", "new"))
    assert compared.is_done.tolist() == [True] * 4 + [False] * 4
    judged = compared.verdict[:, compared.fsrs.index("FSR1")]
    assert (judged[:4] < NOT_RUN).all()
    assert (judged[4:] == NOT_RUN).all()
    # FSR3 is asked for outside the ODD only.
    assert (compared.verdict[:, compared.fsrs.index("FSR3")] == NOT_JUDGED).all()
    assert np.isnan(compared.margin[4:]).all()
    assert not compared.has_object.any()


def test_withdrawn_result_is_as_one_that_was_not_executed(store: Store) -> None:
    campaign = store.campaign(8)
    before = store.repository.compared(campaign, ("new", "legacy"))
    (withdrawn,) = (
        place
        for place, digest in enumerate(before.result)
        if digest == store.repository.find_run("1", campaign=campaign).result_digest
    )
    assert before.is_done[withdrawn]
    store.vouched(campaign)
    compared = store.repository.compared(campaign, ("new", "legacy"))
    assert compared.is_done.sum() == before.is_done.sum() - 1
    assert not compared.is_done[withdrawn]
    judged = before.verdict[withdrawn] != NOT_JUDGED
    assert (compared.verdict[withdrawn][judged] == NOT_RUN).all()
    assert np.isnan(compared.margin[withdrawn]).all()


def test_fsr_that_is_not_applicable_has_no_verdict(store: Store) -> None:
    store.example.not_applicable = {"FSR1": {"new": "no such signal"}}
    compared = store.repository.compared(store.campaign(), ("legacy", "new"))
    is_new = compared.architecture.codes == compared.architecture.words.index("new")
    judged = compared.verdict[:, compared.fsrs.index("FSR1")]
    assert (judged[is_new] == NOT_JUDGED).all()
    assert (judged[~is_new] == 0).all()


def test_words_are_coded_in_the_order_of_their_coming_and_none_is_no_word() -> None:
    labels = bulk.Labels.of(["b", None, "a", "b"])
    assert labels.codes.tolist() == [0, -1, 1, 0]
    assert labels.words == ("b", "a")
    assert [labels[place] for place in range(4)] == ["b", None, "a", "b"]
    assert labels.take(np.array([2, 1])).codes.tolist() == [1, -1]


def test_axis_that_comes_late_or_lacks_in_between_is_no_word_there() -> None:
    points = [{"gap": 1.0}, {"gap": 2.0, "rain": 3.0}, {"rain": 3.0}, {}, {"gap": 1.0}]
    columns = bulk.encode_points(points)
    shown = {name: [column[row] for row in range(5)] for name, column in columns.items()}
    assert shown == {"gap": [1.0, 2.0, None, None, 1.0], "rain": [None, 3.0, 3.0, None, None]}


def test_figures_are_what_the_view_shows(mini: Executed, stored: Repository) -> None:
    rows = runs_of(stored, mini.summary.campaign)
    figures = stored.figures(mini.summary.campaign)
    assert len(figures) == len(rows) > 0
    assert figures.ordinal.tolist() == [row["ordinal"] for row in rows]
    assert figures.replicate.tolist() == [row["replicate"] for row in rows]
    for name in ("scenario", "architecture", "fault_entry", "outcome"):
        column = getattr(figures, name)
        assert [column[place] for place in range(len(rows))] == [row[name] for row in rows]
    points = [figures.point(place) for place in range(len(rows))]
    assert points == [json.loads(row["point"]) for row in rows]
    for name in METRIC_IDS:
        expected = np.array([row[name] for row in rows], dtype=np.float64)
        assert np.array_equal(figures.metrics[name], expected, equal_nan=True)
    told = [row["fault_detection_time_s_status"] != "not_applicable" for row in rows]
    assert figures.has_fault.tolist() == told
    assert len(set(told)) == 2


def test_only_executed_runs_of_the_campaign_are_there(store: Store) -> None:
    store.campaign(4)
    plan = store.plan(8, block_size=3)
    block = store.claim(plan.campaign)
    assert store.complete(block)
    table = store.repository.results(plan.campaign)
    expected = [row[table.columns.index("ordinal")] for row in table.rows]
    assert 0 < len(expected) < 8
    assert store.repository.figures(plan.campaign).ordinal.tolist() == expected


def test_scenario_that_was_not_executed_has_no_runs(mini: Executed, stored: Repository) -> None:
    figures = stored.figures(mini.summary.campaign)
    assert len(figures.of_scenario("unheard_of")) == 0
    parts = [figures.of_scenario(name) for name in figures.scenario.words]
    assert sum(len(part) for part in parts) == len(figures)
    with pytest.raises(KeyError):
        figures.points["unheard_of"]


def test_every_run_with_a_result_is_a_situation(mini: Executed) -> None:
    found = bulk.executed_runs(mini.db, mini.summary.campaign)
    assert (found.planned, found.without_result) == (28, 0)
    rows = [row for item in found.situations for row in item.parameters]
    assert len(rows) + found.not_judged + found.outside_odd == 28
    assert {item.scenario["scenario"] for item in found.situations} == {"cut_in", "lead_braking"}
    planned = sorted(case.parameters["ego_speed"] for case in mini.plan.cases)
    if not found.not_judged:
        assert sorted(row["ego_speed"] for row in rows) == planned


def test_planned_case_without_a_result_is_counted(mini: Executed, tmp_path: Path) -> None:
    copy = tmp_path / "adeye.db"
    shutil.copyfile(mini.db, copy)
    campaign = mini.summary.campaign
    whole = bulk.executed_runs(copy, campaign)
    with sqlite3.connect(copy) as connection, unguarded(connection):
        # As if one block had not been executed: its cases name results that are not there.
        connection.execute(
            "UPDATE campaign_case SET result_digest = substr('0' || result_digest, 1, 64) "
            "WHERE ordinal < 5"
        )
    found = bulk.executed_runs(copy, campaign)
    assert (found.planned, found.without_result) == (28, 5)
    count = sum(len(item.parameters) for item in found.situations)
    assert count == sum(len(item.parameters) for item in whole.situations) - 5


def test_runs_cover_the_bins_that_the_stored_odd_declares(mini: Executed) -> None:
    runs = bulk.executed_runs(mini.db, mini.summary.campaign)
    odd = {
        "attributes": {"dynamic_elements": {"ego_speed": {"max": 130.0 / 3.6}}},
        "coverage": {"ego_speed": [0.0, 90.0 / 3.6, 130.0 / 3.6]},
    }
    attributes, bins = bulk.declared_attributes(odd)
    assert attributes.dynamic_elements.ego_speed is not None
    assert bins is not None
    found = {
        item.attributes: item
        for item in bulk.coverage_of_runs(runs, {"odd": odd, "scenarios": {}}, 1).combinations
    }
    speed = found["ego_speed",]
    assert [label for (label,), _ in speed.counts] == ["0 to 90 km/h", "90 to 130 km/h"]
    assert sum(count for _, count in speed.counts) == 28 - runs.not_judged


def test_stored_odd_without_bins_declares_none() -> None:
    assert bulk.declared_attributes({"attributes": {}})[1] is None
