"""``matrix``: both ways, as table, CSV and JSON."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Any

import pytest

import adeye.reporting
from adeye.report.formats.matrix import matrix_of

if TYPE_CHECKING:
    from adeye.report.model.report import Report
from tests.report.fake import build_report


@pytest.fixture
def report(monkeypatch: pytest.MonkeyPatch) -> Report:
    """Put a report behind the verb."""
    made = build_report(rows=10, replays=0)
    monkeypatch.setattr(adeye.reporting, "read_report", lambda *_: made)
    return made


def test_table_has_a_line_for_each_hazard_with_its_gaps(adeye: Any, report: Report) -> None:
    ended = adeye("matrix")
    assert ended.code == 0, ended.err
    assert all(item.id in ended.out for item in report.hazards)
    assert "no FSR is allocated to it" in ended.out
    assert ended.out.rstrip().endswith("gaps; every row: --csv or --json.")


def test_way_back_begins_with_the_scenario(adeye: Any, report: Report) -> None:
    ended = adeye("matrix", "--by", "scenario", "--csv")
    assert ended.code == 0, ended.err
    rows = list(csv.DictReader(ended.out.splitlines()))
    assert next(iter(rows[0])) == "scenario"
    assert [row["fsr"] for row in rows] == [row.fsr for row in matrix_of(report, "scenario")]


def test_json_has_every_row_and_counts_the_gaps(adeye: Any, report: Report) -> None:
    document = adeye("matrix", "--json").document
    assert (document["schema"], document["campaign"]) == ("adeye/matrix@1", report.campaign)
    assert len(document["rows"]) == len(matrix_of(report))
    assert document["gaps"] == sum(bool(row["gap"]) for row in document["rows"]) > 0


def test_column_that_is_none_is_refused_with_what_is_allowed(adeye: Any, report: Report) -> None:
    assert report.campaign
    ended = adeye("matrix", "--by", "scenarios")
    assert ended.code == 2
    assert "scenario" in ended.err


def test_csv_and_json_exclude_each_other(adeye: Any, report: Report) -> None:
    assert report.campaign
    assert adeye("matrix", "--csv", "--json").code == 2
