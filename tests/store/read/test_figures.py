"""Executed runs as columns: the same as the view shows, in the order of the plan."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.store.read.bulk import Labels, encode_points
from adeye.store.repository import Repository
from adeye.store.tables import METRIC_IDS

if TYPE_CHECKING:
    from tests.project import Executed


def test_words_are_coded_in_the_order_of_their_coming_and_none_is_no_word() -> None:
    labels = Labels.of(["b", None, "a", "b"])
    assert labels.codes.tolist() == [0, -1, 1, 0]
    assert labels.words == ("b", "a")
    assert [labels[place] for place in range(4)] == ["b", None, "a", "b"]
    assert labels.take(np.array([2, 1])).codes.tolist() == [1, -1]


def test_axis_that_comes_late_or_lacks_in_between_is_no_word_there() -> None:
    points = [{"gap": 1.0}, {"gap": 2.0, "rain": 3.0}, {"rain": 3.0}, {}, {"gap": 1.0}]
    columns = encode_points(points)
    shown = {name: [column[row] for row in range(5)] for name, column in columns.items()}
    assert shown == {
        "gap": [1.0, 2.0, None, None, 1.0],
        "rain": [None, 3.0, 3.0, None, None],
    }


def test_figures_are_what_the_view_shows(mini: Executed) -> None:
    campaign = mini.summary.campaign
    with Repository.open(mini.db, create=False) as repository:
        table = repository.results(campaign)
        figures = repository.figures(campaign)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
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


def test_only_executed_runs_of_the_campaign_are_there(repository: Repository, example: Any) -> None:
    example.campaign(repository, 4)
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=3)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    assert repository.complete_block(block, example.runs(block))
    table = repository.results(plan.campaign)
    expected = [row[table.columns.index("ordinal")] for row in table.rows]
    assert 0 < len(expected) < 8
    assert repository.figures(plan.campaign).ordinal.tolist() == expected


def test_scenario_that_was_not_executed_has_no_runs(mini: Executed) -> None:
    with Repository.open(mini.db, create=False) as repository:
        figures = repository.figures(mini.summary.campaign)
    assert len(figures.of_scenario("unheard_of")) == 0
    parts = [figures.of_scenario(name) for name in figures.scenario.words]
    assert sum(len(part) for part in parts) == len(figures)
    with pytest.raises(KeyError):
        figures.points["unheard_of"]
