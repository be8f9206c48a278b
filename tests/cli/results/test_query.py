"""``query``: what is asked, in which form, what is refused; saved queries."""

import io
import json
import re
import sys
from dataclasses import replace
from typing import Any

import pyarrow.parquet as pq
import pytest

from adeye.store import schema
from adeye.store.read import saved as queries
from adeye.store.read.saved import SAVED

# --- ``query``: formats, saved queries by name, refusals


@pytest.fixture
def adeye(adeye: Any, folder: Any) -> Any:
    """Call verbs beside an empty database."""
    assert folder.is_dir()
    schema.upgrade(".adeye/adeye.db")
    return adeye


def test_forms_of_a_result(adeye: Any) -> None:
    lines = adeye("query", "SELECT 1 AS a, NULL AS b, 'x' AS c").out.splitlines()
    assert lines[0].split() == ["a", "b", "c"]
    assert lines[-1].split() == ["1", "\N{EN DASH}", "x"]
    assert adeye("query", "SELECT 0.1 AS a, NULL AS b", "--format", "csv").out == "a,b\n0.1,\n"
    # Columns of one name are kept apart.
    for flags in (("--json",), ("--format", "json")):
        assert adeye("query", "SELECT 1 AS a, 2 AS a", *flags).document == {
            "schema": "adeye/query@1",
            "columns": ["a", "a_2"],
            "rows": [{"a": 1, "a_2": 2}],
            "is_cut": False,
        }


def test_cut_result_and_no_rows_are_said(adeye: Any) -> None:
    ended = adeye("query", "SELECT 1 AS a UNION SELECT 2", "--max-rows", "1", "--json")
    assert ended.document["is_cut"] is True
    assert "only the first 1 rows" in ended.err
    assert "no rows" in adeye("query", "SELECT 1 AS a WHERE 0").err


def test_statement_from_standard_input(adeye: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("SELECT 7 AS a"))
    assert adeye("query", "-", "--format", "csv").out == "a\n7\n"


def test_wrong_statement_is_an_input_error(adeye: Any) -> None:
    for sql, part in (
        ("DROP TABLE run", "only reading is allowed"),
        ("SELECT no_such FROM run", "no_such"),
        ("failing", "Did you mean 'failing-fsrs'?"),
    ):
        ended = adeye("query", sql)
        assert part in ended.refused


def test_saved_queries_are_listed_in_every_form(adeye: Any) -> None:
    for arguments in ((), ("--list",)):
        out = adeye("query", *arguments).out
        assert all(name in out for name in SAVED)
        assert "adeye run ODD" in out
    names = [item["name"] for item in adeye("query", "--list", "--json").document["queries"]]
    assert names == list(SAVED)
    assert adeye("query", "--list", "--format", "csv").out.startswith("name,text\n")


def test_every_saved_query_fits_the_schema_and_without_evidence_is_no_answer(adeye: Any) -> None:
    for name, query in SAVED.items():
        ended = adeye("query", name, "--json").ok
        assert ended.document["columns"], name
        assert ended.document["rows"] == [], name
        assert f"note: no rows, and that says nothing: {query.lacking}" in ended.err
        assert "'adeye " in query.lacking


def test_no_rows_are_an_answer(adeye: Any, mini: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = replace(SAVED["contacts"], sql="SELECT 1 AS a WHERE 0")
    monkeypatch.setitem(queries.SAVED, "contacts", nothing)
    assert adeye("query", "contacts", "--db", str(mini.db)).err == "note: no rows\n"


ROWS = "SELECT 1 AS a, '=cmd' AS b, 'x\x1b[31m' AS c UNION ALL SELECT 2.5, NULL, 'y'"


@pytest.mark.slow
def test_file_is_written_as_its_name_says(adeye: Any, folder: Any) -> None:
    for name in ("rows.csv", "rows.json", "rows.parquet"):
        ended = adeye("query", ROWS, "-o", name)
        assert (ended.code, ended.out, ended.err) == (0, "", f"wrote {name}\n")
    assert (folder / "rows.csv").read_text("utf-8") == "a,b,c\n1,'=cmd,x[31m\n2.5,,y\n"
    assert json.loads((folder / "rows.json").read_text("utf-8")) == (
        adeye("query", ROWS, "--json").document
    )
    assert pq.read_table(folder / "rows.parquet").to_pydict() == {
        "a": [1.0, 2.5],
        "b": ["=cmd", None],
        "c": ["x\x1b[31m", "y"],
    }


def test_formula_is_text_in_printed_csv(adeye: Any) -> None:
    assert adeye("query", ROWS, "--format", "csv").out == "a,b,c\n1,'=cmd,x[31m\n2.5,,y\n"
    assert "\x1b" not in adeye("query", ROWS).out


def test_what_cannot_be_written_is_refused(adeye: Any, folder: Any) -> None:
    for arguments, part in (
        (("--format", "parquet"), "Name a file: -o FILE.parquet"),
        (("-o", "rows.xlsx"), "does not end in .csv or .json or .parquet"),
        (("-o", "rows.csv", "--json"), "does not end in .json"),
        (("-o", ".adeye/adeye.db"), "would be overwritten"),
        (("--list", "-o", "list.csv"), "is not written to a file"),
        (("--campaign", "1"), "no campaign"),
    ):
        ended = adeye("query", "SELECT 1 AS a", *arguments)
        assert part in ended.refused
        assert [path.name for path in folder.iterdir()] == [".adeye"]


def test_database_is_not_written_over(adeye: Any, folder: Any) -> None:
    named = folder / "adeye.csv"
    (folder / ".adeye" / "adeye.db").rename(named)
    before = named.read_bytes()
    ended = adeye("query", "SELECT 1 AS a", "--db", str(named), "-o", str(named))
    assert (ended.code, named.read_bytes()) == (2, before)


@pytest.mark.slow
def test_saved_query_is_about_the_campaign_that_is_named(adeye: Any, mini: Any) -> None:
    db = ("--db", str(mini.db), "--json")
    for name in SAVED.keys() - {"campaigns"}:
        asked = adeye("query", name, "--campaign", "1", *db)
        assert (asked.code, asked.document) == (0, adeye("query", name, *db).document), name


def test_own_sql_has_the_campaign_as_a_parameter(adeye: Any, mini: Any) -> None:
    sql = "SELECT COUNT(*) AS runs FROM v_runs WHERE campaign = :campaign"
    arguments = ("--db", str(mini.db), "--format", "csv")
    assert adeye("query", sql, "-c", "1", *arguments).out == "runs\n28\n"
    latest = adeye("query", sql, *arguments)
    assert latest.out == "runs\n28\n"
    assert latest.err == "note: :campaign is the latest, 1 of ODD mini\n"
    assert (
        "WHERE campaign = :campaign"
        in adeye("query", "SELECT COUNT(*) AS runs FROM v_runs", "-c", "1", *arguments).refused
    )


def test_columns_of_a_view_are_listed_in_every_form(adeye: Any) -> None:
    columns = ("query", "--columns", "v_goal_asil")
    lines = adeye(*columns).out.splitlines()
    assert [line.split()[0] for line in lines[2:]] == ["concept", "goal", "rank"]
    assert adeye(*columns, "-f", "csv").out.startswith("column,type,unit\nconcept,VARCHAR(64),\n")
    listed = adeye(*columns, "--json").document
    assert [item["name"] for item in listed["columns"]] == ["concept", "goal", "rank"]
    for more in (("SELECT 1",), ("--list",), ("-o", "x.csv")):
        assert "Leave the others out" in adeye(*columns, *more).refused
    assert "Did you mean 'v_gate'?" in adeye("query", "--columns", "v_gates").refused


def test_missing_evidence_is_told(adeye: Any, mini: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = replace(SAVED["contacts"], sql="SELECT 1 AS a WHERE :campaign = ''")
    monkeypatch.setitem(queries.SAVED, "contacts", nothing)
    db = ("--db", str(mini.db), "--campaign", "1")
    assert adeye("query", "contacts", *db).err == "note: no rows\n"
    monkeypatch.setitem(queries.SAVED, "contacts", replace(nothing, basis="SELECT 0"))
    assert "no run of this campaign has a result" in adeye("query", "contacts", *db).err


def test_slack_in_a_scenario_stands_beside_the_verdict_of_the_requirement(
    adeye: Any, mini: Any
) -> None:
    rows = adeye("query", "least-slack", "--db", str(mini.db), "--json").document["rows"]
    gate = adeye("query", "gate", "--db", str(mini.db), "--json").document["rows"]
    verdicts = {(row["fsr"], row["architecture"]): row["verdict"] for row in gate}
    assert {(row["fsr"], row["architecture"], row["verdict"]) for row in rows} <= {
        (*key, verdict) for key, verdict in verdicts.items()
    }
    assert any(row["verdict"] != row["in_scenario"] for row in rows)


# --- saved queries: names, and that each is one statement about one campaign


def test_the_promised_ones_are_there() -> None:
    assert SAVED.keys() >= {
        "failing-fsrs",
        "worst-runs",
        "fault-coverage",
        "architecture-pairs",
        "metrics-by-architecture",
        "least-slack",
        "undetected-faults",
        "unexercised",
        "evidence-by-element",
    }


def test_queries_are_complete_statements_about_the_latest_campaign() -> None:
    for name, query in SAVED.items():
        assert query.name == name
        assert re.fullmatch(r"[a-z-]+", name)
        assert query.text
        assert "$" not in query.sql, name
        assert ";" not in query.sql, name
        assert "ORDER BY" in query.sql, name
        is_about_one = "(SELECT campaign FROM v_campaigns WHERE recency = 1)" in query.sql
        assert is_about_one == (name != "campaigns")
