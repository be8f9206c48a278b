"""Who breaks on content is told by the database that holds it, and only then."""

from __future__ import annotations

import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from sqlalchemy import Boolean, Float, Integer
from sqlalchemy.exc import NoResultFound

from adeye.errors import InputError, IntegrityError
from adeye.judge.stl.batch import NEEDED
from adeye.judge.verdict import ExitCode
from adeye.store import tables
from adeye.store.evidence.verification import close
from adeye.store.location import Location
from adeye.store.read.totals import gate_code
from adeye.store.records import Finding
from adeye.store.repository import Repository
from tests.store.conftest import Store
from tests.store.raw import guarded, on_sqlite, unguarded

OF = "WHERE campaign_id = '{}'"
PARTS = 6
"""What is done with every table is done in so many tests."""


@pytest.fixture
def place(place: str | Path, request: pytest.FixtureRequest) -> str | Path:
    """Where a database is; a file has everything in it from the start if a test asks for that."""
    if isinstance(place, Path) and "campaign" in request.fixturenames:
        place.write_bytes(request.getfixturevalue("filled")[0])
    return place


@pytest.fixture
def campaign(store: Store, place: str | Path, request: pytest.FixtureRequest) -> str:
    if isinstance(place, Path):
        return str(request.getfixturevalue("filled")[1])
    return str(store.everything())


@pytest.fixture
def full(store: Store, campaign: str) -> Store:
    """A database with rows in every table."""
    assert campaign
    return store


def test_untouched_database_has_no_findings(repository: Repository, campaign: str) -> None:
    assert repository.progress(campaign).accounted == 8
    assert repository.verify() == ()


def rows_found(repository: Repository) -> list[Finding]:
    """Findings about rows; the dropped triggers are found as well."""
    return [item for item in repository.verify() if item.table != "schema"]


def another(value: Any, column: Any) -> Any:
    """Change a value into one that the column may have: numbers, and texts of the same length."""
    if isinstance(value, int | float) or isinstance(column.type, Boolean | Integer | Float):
        return (value or 0) + 99
    return ("y" if value[0] == "x" else "x") + value[1:] if value else "x"


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_every_altered_value_is_named(full: Store, part: int) -> None:
    unguarded(full.raw)
    for table in tables.INSERT_ONLY[part::PARTS]:
        last = f"WHERE row_hash = (SELECT max(row_hash) FROM {table.name})"  # noqa: S608
        columns = [column for column in table.columns if column.name != "row_hash"]
        if full.repository.location.is_server:
            # Every column is compared in the same way, and a server takes longer for each.
            columns = columns[:: max(1, len(columns) // 2)]
        for column in columns:
            select = f"SELECT {column.name} FROM {table.name} {last}"  # noqa: S608
            (value,) = full.raw.execute(select).fetchone()
            change = f"UPDATE {table.name} SET {column.name} = ? {last}"  # noqa: S608
            full.raw.execute(change, (another(value, column),))
            assert table.name in {item.table for item in rows_found(full.repository)}, column
            full.raw.execute(change, (value,))
    assert rows_found(full.repository) == []


@on_sqlite
def test_value_of_another_type_is_named(full: Store) -> None:
    unguarded(full.raw)
    for table, column, value in (("run", "duration_s", "4.0\xa0"), ("work", "attempt", "1_0")):
        full.raw.execute(f"UPDATE {table} SET {column} = ?", (value,))  # noqa: S608
        problem = f"{column} is text, which its column never has"
        assert (table, problem) in {(item.table, item.problem) for item in full.repository.verify()}


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ("DROP INDEX ix_fork_origin_digest", "ix_fork_origin_digest is missing"),
        ("ALTER TABLE work ADD COLUMN note TEXT", "work is not as this release makes it"),
        ("DROP TABLE artifact", "artifact is missing"),
    ],
)
@on_sqlite
def test_schema_of_another_make_is_named(full: Store, change: str, name: str) -> None:
    full.raw.execute(change)
    found = full.repository.verify()
    assert name in [f"{item.row} {item.problem}" for item in found]


DELETABLE = (
    *("run", "metric", "verdict", "event", "tally", "campaign_case", "campaign_fsr"),
    *("case_count", "case_match", "case_run", "case_tally"),
    *("case_repeat", "never_held"),
)


@pytest.mark.slow
@pytest.mark.parametrize(
    "table", [*DELETABLE, "test_case", "campaign", "odd", "scenario", "concept", "fsr", "work"]
)
def test_deleted_row_is_noticed(full: Store, table: str) -> None:
    key = "id" if table == "work" else "row_hash"
    unguarded(full.raw)
    full.raw.execute(
        f"DELETE FROM {table} WHERE {key} = (SELECT min({key}) FROM {table})"  # noqa: S608
    )
    assert rows_found(full.repository) != []


def next_of(column: Any) -> str:
    """Make another value of a key in SQL."""
    if isinstance(column.type, Integer):
        return f"{column.name} + 90"
    return f"'9' || substr({column.name}, 2)"


@pytest.mark.slow
@pytest.mark.parametrize("table", DELETABLE)
def test_inserted_row_with_a_copied_hash(full: Store, table: str) -> None:
    described = tables.metadata.tables[table]
    key = next(iter(described.primary_key.columns)).name
    last = "result_digest" if table == "run" else list(described.primary_key.columns)[-1].name
    names = set(described.columns.keys())
    kept = sorted(names - {last, "number"})
    new = {name: next_of(described.columns[name]) for name in {last, "number"} & names}
    unguarded(full.raw)
    full.raw.execute(
        f"INSERT INTO {table} ({', '.join((*kept, *new))}) "  # noqa: S608
        f"SELECT {', '.join((*kept, *new.values()))} FROM {table} ORDER BY {key} LIMIT 1"
    )
    assert table in {item.table for item in full.repository.verify()}


def test_dropped_trigger_and_changed_view_are_named(full: Store) -> None:
    full.raw.execute("DROP TRIGGER run_no_delete")
    full.raw.execute("DROP VIEW v_timeline")
    full.raw.execute("CREATE VIEW v_timeline AS SELECT * FROM event")
    assert {(item.table, item.row) for item in full.repository.verify()} == {
        ("schema", "run_no_delete"),
        ("schema", "v_timeline"),
    }


@on_sqlite
def test_row_that_an_index_lacks_is_named_by_whoever_decides(full: Store, campaign: str) -> None:
    raw, name = full.raw, "ix_withdrawal_result_digest"
    own = "SELECT name, sql FROM sqlite_master WHERE type = 'trigger' AND tbl_name = 'withdrawal'"
    triggers = raw.execute(own).fetchall()
    for trigger, _ in triggers:
        raw.execute(f"DROP TRIGGER {trigger}")
    rows = raw.execute("SELECT * FROM withdrawal").fetchall()
    index = raw.execute("SELECT * FROM sqlite_master WHERE name = ?", (name,)).fetchone()
    raw.execute("DELETE FROM withdrawal")
    raw.execute("PRAGMA writable_schema = ON")
    raw.execute("DELETE FROM sqlite_master WHERE name = ?", (name,))
    raw.execute("PRAGMA writable_schema = RESET")
    marks = ", ".join("?" * len(rows[0]))
    raw.executemany(f"INSERT INTO withdrawal VALUES ({marks})", rows)  # noqa: S608
    raw.execute("PRAGMA writable_schema = ON")
    raw.execute("INSERT INTO sqlite_master VALUES (?, ?, ?, ?, ?)", index)
    raw.execute("PRAGMA writable_schema = RESET")
    for _, statement in triggers:
        raw.execute(statement)
    found = [str(item) for item in full.repository.unsound(campaign)]
    assert any(f"missing from index {name}" in text for text in found)


def test_what_stands_where_something_else_was_is_named(full: Store) -> None:
    full.raw.execute("DROP TRIGGER run_no_delete")
    full.raw.execute("CREATE INDEX run_no_delete ON run (backend)")
    full.raw.execute("DROP VIEW v_timeline")
    full.raw.execute("CREATE TABLE v_timeline AS SELECT 1 AS campaign")
    assert {(item.table, item.row) for item in full.repository.verify()} == {
        ("schema", "run_no_delete"),
        ("schema", "v_timeline"),
    }


def test_block_that_is_done_without_its_results_is_named(store: Store) -> None:
    plan = store.plan(store.example.cases(4), block_size=4)
    store.raw.execute("UPDATE work SET state = 'done', owner = NULL")
    named = [str(item) for item in store.repository.verify()]
    assert f"run {plan.campaign}: 0 results are there, blocks of 4 cases are done" in named


VIEWS = {
    "sqlite": "SELECT name FROM sqlite_master WHERE name LIKE 'v_runs_%'",
    "postgresql": "SELECT viewname FROM pg_views WHERE viewname LIKE 'v_runs_%'",
}
DECEIVING = {
    "sqlite": "CREATE TRIGGER helpful BEFORE INSERT ON verdict WHEN NEW.verdict = 'FAIL' "
    "BEGIN SELECT RAISE(IGNORE); END",
    "postgresql": "CREATE TRIGGER helpful BEFORE INSERT ON verdict FOR EACH ROW "
    "EXECUTE FUNCTION suppress_redundant_updates_trigger()",
}


def test_view_of_a_scenario_and_trigger_of_somebody_else_are_named(
    store: Store, campaign: str
) -> None:
    repository, raw = store.repository, store.raw
    kind = repository.location.url.get_backend_name()
    view, *others = (name for (name,) in store.rows(VIEWS[kind]))
    assert repository.verify() == ()
    raw.execute(f"DROP VIEW {view}")
    raw.execute(f"CREATE VIEW {view} AS SELECT 99.0 AS min_distance_m")
    raw.execute("CREATE VIEW my_own AS SELECT 1")
    raw.execute(DECEIVING[kind])
    named = {(item.table, item.row) for item in repository.verify()}
    assert named == {("schema", view), ("schema", "helpful")}
    unsound = {(item.table, item.row) for item in repository.unsound(campaign)}
    assert ("schema", "helpful") in unsound
    for name in others:
        raw.execute(f"DROP VIEW {name}")
    assert len(repository.verify()) == 2 + len(others)


def test_edited_row_is_named_with_its_key(store: Store, campaign: str) -> None:
    result = store.repository.find_run("3", campaign=campaign).result_digest
    unguarded(store.raw)
    store.raw.execute(
        "UPDATE verdict SET verdict = 'FAIL' WHERE fsr_id = 'FSR1' AND run_number = "
        "(SELECT number FROM run WHERE result_digest = ?)",
        (result,),
    )
    findings = store.repository.verify()
    assert any(item.table == "verdict" and item.row.startswith(result) for item in findings)
    assert any(item.table == "tally" for item in findings)


def test_exchanged_metrics_of_two_runs_are_noticed(full: Store) -> None:
    unguarded(full.raw)
    for old, new in ((1, 99), (2, 1), (99, 2)):
        full.raw.execute("UPDATE metric SET run_number = ? WHERE run_number = ?", (new, old))
    assert {item.table for item in full.repository.verify()} >= {"metric", "run"}


@on_sqlite
def test_text_that_is_not_unicode_is_a_finding_not_a_crash(full: Store) -> None:
    unguarded(full.raw)
    full.raw.execute("UPDATE event SET text = CAST(x'ff41' AS TEXT) WHERE seq = 0")
    full.raw.execute("UPDATE run SET end_reason = x'ff41', variant = x'ff41'")
    named = {item.table for item in full.repository.verify()}
    assert named >= {"event", "run"}


def read(*findings: Finding) -> Mock:
    """A database that somebody reads, with what is wrong in it."""
    return Mock(location=Location.of_file(Path("a.db")), verify=lambda: findings)


WRONG = Finding("run", "3", "has another digest")


@pytest.mark.parametrize("raised", [KeyError("gate"), NoResultFound("No row was found")])
def test_unforeseen_error_on_altered_content_names_the_row(raised: Exception) -> None:
    stored = read(WRONG)
    with pytest.raises(IntegrityError, match="run 3: has another digest") as caught:
        close(stored, raised)
    assert (caught.value.__cause__, stored.close.called) == (raised, True)
    # Errors in words stay, and so do those on sound content; a cause is looked for once.
    for error, findings in (
        *((item, (WRONG,)) for item in (None, InputError("no run"), KeyboardInterrupt(), raised)),
        (KeyError("gate"), ()),
    ):
        stored = read(*findings)
        close(stored, error)
        assert stored.close.called


@pytest.fixture
def mixed(store: Store) -> str:
    store.example.repeat(NEEDED)
    return str(store.campaign(8))


def tamper(raw: sqlite3.Connection, statement: str) -> None:
    """Change rows and leave the triggers as they were."""
    unguarded(raw)
    assert raw.execute(statement).rowcount > 0
    guarded(raw)


def test_untouched_campaign_is_sound(repository: Repository, mixed: str) -> None:
    assert repository.unsound(mixed) == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statement", "table"),
    [
        ("UPDATE tally SET verdict = 'VACUOUS' WHERE fsr_id = 'FSR1'", "tally"),
        ("UPDATE tally SET runs = runs + 1", "tally"),
        ("UPDATE campaign_fsr SET mandatory = 0", "campaign_fsr"),
        ("UPDATE campaign_fsr SET min_exercised = 0", "campaign_fsr"),
        ("UPDATE campaign SET gate = '[]'", "campaign"),
        ("UPDATE campaign SET planned = 4", "campaign"),
        ("DELETE FROM campaign_case WHERE ordinal = 3", "campaign_case"),
        ("DELETE FROM work", "work"),
        ("UPDATE work SET to_ordinal = to_ordinal - 1", "work"),
        ("DELETE FROM run WHERE number = 2", "run"),
        ("DELETE FROM verdict WHERE run_number = 2", "verdict"),
        ("UPDATE case_repeat SET passed = 0", "case_repeat"),
        ("DELETE FROM case_repeat", "case_repeat"),
        ("DELETE FROM case_repeat WHERE scenario = '' AND architecture = 'new'", "case_repeat"),
        ("UPDATE never_held SET decides = 0", "never_held"),
        ("DELETE FROM never_held WHERE architecture = 'new'", "case_repeat"),
    ],
)
def test_what_changes_a_verdict(store: Store, mixed: str, statement: str, table: str) -> None:
    tamper(store.raw, statement)
    assert table in {item.table for item in store.repository.unsound(mixed)}
    info = store.repository.find_campaign(mixed)
    code, message = gate_code(store.repository, info)
    assert code is ExitCode.INTEGRITY
    assert table in message


@pytest.mark.parametrize(
    "statement",
    [
        *(
            f"DELETE FROM {name} WHERE row_hash = (SELECT min(row_hash) FROM {name})"  # noqa: S608
            for name in (*(item.name for item in tables.RESULTS), *("fork", "injection"))
        ),
        *(
            f"DELETE FROM {item.name} {OF}"  # noqa: S608
            for item in tables.RECOUNTED
            if item is not tables.never_held
        ),
        "UPDATE injection SET safe_s = 99",
        "UPDATE case_run SET run_number = CASE run_number WHEN 1 THEN 2 ELSE 1 END",
    ],
)
def test_nothing_is_handed_on_beside_a_row_that_is_gone_or_altered(
    full: Store, campaign: str, statement: str
) -> None:
    full.repository.require_sound(campaign)
    tamper(full.raw, statement.format(campaign))
    with pytest.raises(IntegrityError, match="the database is not as it was written"):
        full.repository.require_sound(campaign)


def test_what_is_altered_is_refused_of_the_campaign_and_of_runs_in_none(
    store: Store, mixed: str
) -> None:
    store.example.with_odd("2")
    store.example.engine = replace(store.example.engine, variant="float64")
    other, stored = str(store.campaign(4)), store.repository
    run = f"SELECT number FROM run JOIN campaign_case USING (result_digest) {OF}".format(other)  # noqa: S608
    tamper(store.raw, f"UPDATE metric SET min_ttc_s_time_s = 77 WHERE run_number IN ({run})")  # noqa: S608
    stored.require_sound(mixed)
    stored.require_sound(other, has_figures=False)
    with pytest.raises(IntegrityError, match=r"metric .*: altered"):
        stored.require_sound(other)
    tamper(store.raw, f"UPDATE verdict SET margin = 77 WHERE run_number IN ({run})")  # noqa: S608
    stored.require_sound(mixed)
    with pytest.raises(IntegrityError, match=r"verdict .*: altered"):
        stored.require_sound(other, has_figures=False)
    # Who belongs to no campaign may be a fork of this one.
    tamper(store.raw, f"DELETE FROM campaign_case {OF.format(other)}")  # noqa: S608
    with pytest.raises(IntegrityError, match=r": altered"):
        stored.require_sound(mixed)


@pytest.mark.parametrize("table", ["run", "verdict"])
def test_row_that_another_campaign_lost_is_missed(store: Store, mixed: str, table: str) -> None:
    store.example.with_odd("2")
    store.example.engine = replace(store.example.engine, variant="float64")
    other = str(store.campaign(4))
    key = "number" if table == "run" else "run_number"
    tamper(store.raw, f"DELETE FROM {table} WHERE {key} = (SELECT max({key}) FROM {table})")  # noqa: S608
    for campaign in (mixed, other):
        found = store.repository.unsound(campaign)
        assert table in {item.table for item in found if not item.row}


def test_dropped_trigger_is_named(store: Store, mixed: str) -> None:
    store.raw.execute("DROP TRIGGER tally_no_update")
    assert [str(item) for item in store.repository.unsound(mixed)] == [
        "schema tally_no_update: is missing"
    ]


def test_other_campaigns_are_not_looked_at(store: Store, mixed: str) -> None:
    store.example.with_odd("2")
    other = str(store.campaign(4))
    tamper(store.raw, f"UPDATE tally SET runs = runs + 1 WHERE campaign_id = '{other}'")  # noqa: S608
    assert store.repository.unsound(mixed) == ()
    assert store.repository.unsound(other) != ()
