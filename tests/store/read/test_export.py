"""Reading a campaign out: what the views say, sorted, whole, the same from every database."""

import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import InputError
from adeye.judge.metrics import METRICS
from adeye.judge.verdict import Verdict
from adeye.store.location import Place
from adeye.store.read import export
from adeye.store.read.export import RUNS, SUFFIX_UNITS, TABLES, metric_columns, open_export, unit_of
from adeye.store.repository import Repository
from adeye.store.tables import METRIC_IDS
from adeye.units import UNITS, Dimension
from tests.postgres import Server
from tests.store.conftest import Example, Store
from tests.store.raw import raw_connection

Tables = dict[str, list[dict[str, Any]]]

AS_COLUMNS = {"parameters", "point", "verdicts"}
"""What ``v_runs`` has as JSON."""


def read(path: Place, campaign: str | None = None, **options: Any) -> Tables:
    with open_export(path, campaign, **options) as source:
        found: Tables = {name: [] for name in source.tables}
        for chunk in source.chunks():
            names = [column.name for column in source.tables[chunk.table].columns]
            found[chunk.table] += [
                dict(zip(names, row, strict=True)) for row in zip(*chunk.columns, strict=True)
            ]
    return found


def of_view(repository: Repository, table: str) -> list[dict[str, Any]]:
    connection = raw_connection(repository)
    if isinstance(connection, sqlite3.Connection):
        connection.row_factory = sqlite3.Row
    order = ", ".join(TABLES[table].order)
    sql = f"SELECT * FROM {TABLES[table].view} ORDER BY {order}"  # noqa: S608
    rows = connection.execute(sql).fetchall()
    connection.close()
    return [{name: row[name] for name in row.keys()} for row in rows]  # noqa: SIM118


def test_tables_hold_what_their_views_hold(store: Store) -> None:
    store.example.judge(Verdict.FAIL, 1, 4, 7)
    store.campaign(9)
    found = read(store.repository.location)
    for name in ("verdicts", "events", "fsr_status"):
        assert found[name]
        assert found[name] == of_view(store.repository, name)
    for row, seen in zip(found["runs"], of_view(store.repository, "runs"), strict=True):
        assert seen.keys() - row.keys() == {*AS_COLUMNS, "executed_at"}
        assert all(row[name] == seen[name] for name in seen.keys() & row.keys())
    # Flags are truth values, not the numbers that the database has.
    assert {type(row["mandatory"]) for row in found["verdicts"]} == {bool}


def test_parameters_and_verdicts_are_columns(store: Store) -> None:
    store.example.verdict_of = lambda _, fsr: Verdict.FAIL if fsr == "FSR2" else Verdict.PASS
    store.campaign(8)
    runs = read(store.repository.location)["runs"]
    # Only the units of one scenario are known, so that a parameter has a column for each.
    assert [(row["ego_speed_mps"], row["ego_speed"]) for row in runs[:5]] == [
        (20.0, None), (20.0, None), (None, 20.0), (None, 20.0), (21.0, None)
    ]  # fmt: skip
    assert {(row["verdict_fsr1"], row["verdict_fsr2"]) for row in runs} == {("PASS", "FAIL")}
    # FSR3 is about what is outside the ODD, and nothing is.
    assert {row["verdict_fsr3"] for row in runs} == {None}
    with open_export(store.repository.location, None) as source:
        columns = {column.name: column for column in source.tables["runs"].columns}
    assert (columns["ego_speed_mps"].kind, columns["ego_speed_mps"].unit) == ("number", "m/s")


def test_missing_result_is_not_run_and_no_row_of_runs(store: Store) -> None:
    store.example.work_off = lambda *_: 0
    store.campaign(4)
    found = read(store.repository.location)
    assert found["runs"] == []
    assert {row["verdict"] for row in found["verdicts"]} == {"NOT_RUN"}
    assert len(found["verdicts"]) == 8
    with open_export(store.repository.location, None) as source:
        assert (source.campaign.planned, source.done) == (4, 0)


def test_parts_make_no_difference(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    store.campaign(10)
    whole = read(store.repository.location)
    monkeypatch.setattr(export, "CHUNK_CASES", 3)
    assert read(store.repository.location) == whole
    with open_export(store.repository.location, None, ["runs"]) as source:
        sizes = [len(chunk.columns[0]) for chunk in source.chunks()]
    # Never more at once than asked for, however large the campaign is.
    assert sizes == [3, 3, 3, 1]


def test_another_database_gives_the_same(tmp_path: Path) -> None:
    one, other = tmp_path / "one.db", tmp_path / "other.db"
    with Repository.open(one) as repository:
        campaign = Example().campaign(repository, 8, block_size=3)
    with Repository.open(other) as repository:
        before = Example()
        before.with_odd("2")
        before.gate = ("legacy",)
        before.campaign(repository, 6)
        example: Any = Example()
        run = example.run
        example.run = lambda case, **changes: replace(run(case, **changes), executed_by="host 2")
        assert example.campaign(repository, 8, block_size=5) == campaign
    assert read(one, campaign) == read(other, campaign)


@pytest.mark.slow
def test_server_gives_the_same_as_a_file(server: Server, repository: Repository) -> None:
    url = server.new_database()
    with Repository.open(url) as other:
        campaign = Example().campaign(other, 8, block_size=5)
    assert Example().campaign(repository, 8) == campaign
    assert repr(read(url, campaign)) == repr(read(repository.location, campaign))


def test_what_differs_between_executions_is_left_out_unless_asked_for(store: Store) -> None:
    store.campaign(2)
    assert "executed_at" not in read(store.repository.location)["runs"][0]
    with_it = read(store.repository.location, with_provenance=True)["runs"][0]
    assert with_it["executed_at"].startswith("2026-01-01T00:00:00")


def test_hostile_and_mixed_parameters_become_plain_columns(store: Store) -> None:
    plain = store.example.case

    def case(ordinal: int, **changes: Any) -> Any:
        values = {'a"; DROP TABLE run; --': ordinal, "Run": "x", "contact": 1.5}
        values |= {"on": bool(ordinal), "either": "word" if ordinal else 3, "list": [1, ordinal]}
        return plain(ordinal, **{"parameters": values, "point": {"extra.key": 2}, **changes})

    store.example.case = case
    store.campaign(2)
    with open_export(store.repository.location, None) as source:
        columns = {column.name: column.kind for column in source.tables["runs"].columns}
    row = read(store.repository.location)["runs"][1]
    assert (row["a_drop_table_run"], columns["a_drop_table_run"]) == (1.0, "number")
    assert (row["on"], columns["on"]) == (True, "flag")
    assert (row["either"], row["list"], columns["list"]) == ("word", "[1, 1]", "text")
    assert row["extra_key"] == 2.0
    # A column of the view keeps its name, the parameter gets another.
    assert len(row["run"]) == 64
    assert row["contact"] == 0.0
    assert [row[name] for name in row if name.startswith(("run_", "contact_"))][:2]
    assert "x" in [row[name] for name in row if name.startswith("run_")]
    assert 1.5 in [row[name] for name in row if name.startswith("contact_")]


def test_what_is_not_there_is_an_input_error(store: Store) -> None:
    store.campaign(1)
    place = store.repository.location
    for campaign, names, part in (
        ("9", ["runs"], "no number of one"),
        (None, ["run"], "there is no table 'run'"),
    ):
        with pytest.raises(InputError, match=part), open_export(place, campaign, names):
            pass


@pytest.mark.parametrize("name", TABLES)
def test_columns_are_those_of_the_view(tmp_path: Path, empty: bytes, name: str) -> None:
    path = tmp_path / "adeye.db"
    path.write_bytes(empty)
    table = TABLES[name]
    connection = sqlite3.connect(path)
    of_view = [row[1] for row in connection.execute(f"PRAGMA table_info({table.view})")]
    connection.close()
    added = metric_columns() if table is RUNS else ()
    assert [item.name for item in (*table.columns, *added)] == [
        column for column in of_view if table is not RUNS or column not in AS_COLUMNS
    ]
    assert set(table.order) < set(of_view)


def test_suffix_of_a_parameter_is_the_si_unit_of_its_dimension() -> None:
    for dimension in (item for item in Dimension if item.suffix):
        unit = UNITS[SUFFIX_UNITS[dimension.suffix]]
        assert (unit.exponents, unit.numerator, unit.denominator) == (*dimension.value[:1], 1, 1)


@pytest.mark.parametrize("name", METRIC_IDS)
def test_unit_of_a_metric_is_that_of_its_definition(name: str) -> None:
    unit = METRICS[name].unit
    assert unit_of(name) == ("" if unit == "1" else unit)
    by_name = {item.name: item for item in metric_columns()}
    assert by_name[name].unit == unit_of(name)
    assert by_name[name].text == METRICS[name].text
    assert by_name[f"{name}_time_s"].unit == "s"


def test_word_that_is_a_unit_alone_has_none() -> None:
    assert (unit_of("s"), unit_of("m"), unit_of("fsr_status")) == ("", "", "")
