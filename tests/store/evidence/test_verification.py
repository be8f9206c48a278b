import random  # noqa: TID251 - picks rows to alter; no simulated noise
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Boolean, Float, Integer

from adeye.errors import IntegrityError, PlatformError
from adeye.judge.stl.batch import NEEDED
from adeye.store import tables
from adeye.store.records import Finding
from adeye.store.repository import Repository
from tests.store.raw import on_sqlite, unguarded

PARTS = 6
"""What is done with every table is done in so many tests."""


@pytest.fixture
def campaign(repository: Repository, example: Any) -> str:
    example.decompose()
    planned = str(example.campaign(repository, 8))
    example.hindsight(repository, planned)
    example.halved(repository, planned)
    example.campaign(repository, 2)
    example.campaign(repository, 8)
    example.vouched(repository, planned)
    example.repeat(NEEDED)
    example.campaign(repository, 4)
    return planned


@contextmanager
def tampering(raw: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    """Someone with the database and a shell: no triggers, no foreign keys."""
    unguarded(raw)
    yield raw


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
def test_every_altered_value_is_named_with_its_table(
    repository: Repository, campaign: str, raw: sqlite3.Connection, part: int
) -> None:
    assert campaign
    with tampering(raw):
        for table in tables.INSERT_ONLY[part::PARTS]:
            last = f"WHERE row_hash = (SELECT max(row_hash) FROM {table.name})"  # noqa: S608
            columns = [column for column in table.columns if column.name != "row_hash"]
            if repository.location.is_server:
                # Every column is compared in the same way, and a server takes longer for each.
                columns = columns[:: max(1, len(columns) // 2)]
            for column in columns:
                select = f"SELECT {column.name} FROM {table.name} {last}"  # noqa: S608
                (value,) = raw.execute(select).fetchone()
                change = f"UPDATE {table.name} SET {column.name} = ? {last}"  # noqa: S608
                raw.execute(change, (another(value, column),))
                assert table.name in {item.table for item in rows_found(repository)}, column
                raw.execute(change, (value,))
    assert rows_found(repository) == []


DELETABLE = (
    *("run", "metric", "verdict", "event", "tally", "campaign_case", "campaign_fsr"),
    *("case_count", "case_match", "case_run", "case_tally"),
    *("case_repeat", "never_held"),
)


@pytest.mark.slow
@pytest.mark.parametrize(
    "table", [*DELETABLE, "test_case", "campaign", "odd", "scenario", "concept", "fsr", "work"]
)
def test_deleted_row_is_noticed(
    repository: Repository, campaign: str, raw: sqlite3.Connection, table: str
) -> None:
    assert campaign
    key = "id" if table == "work" else "row_hash"
    with tampering(raw):
        raw.execute(
            f"DELETE FROM {table} WHERE {key} = (SELECT min({key}) FROM {table})"  # noqa: S608
        )
    assert rows_found(repository) != []


def next_of(column: Any) -> str:
    """Make another value of a key in SQL."""
    if isinstance(column.type, Integer):
        return f"{column.name} + 90"
    return f"'9' || substr({column.name}, 2)"


@pytest.mark.slow
@pytest.mark.parametrize("table", DELETABLE)
def test_inserted_row_is_noticed_even_with_a_copied_hash(
    repository: Repository, campaign: str, raw: sqlite3.Connection, table: str
) -> None:
    assert campaign
    described = tables.metadata.tables[table]
    key = next(iter(described.primary_key.columns)).name
    last = "result_digest" if table == "run" else list(described.primary_key.columns)[-1].name
    names = set(described.columns.keys())
    kept = sorted(names - {last, "number"})
    new = {name: next_of(described.columns[name]) for name in {last, "number"} & names}
    with tampering(raw):
        raw.execute(
            f"INSERT INTO {table} ({', '.join((*kept, *new))}) "  # noqa: S608
            f"SELECT {', '.join((*kept, *new.values()))} FROM {table} ORDER BY {key} LIMIT 1"
        )
    assert table in {item.table for item in repository.verify()}


def test_dropped_trigger_and_changed_view_are_named(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    assert campaign
    raw.execute("DROP TRIGGER run_no_delete")
    raw.execute("DROP VIEW v_timeline")
    raw.execute("CREATE VIEW v_timeline AS SELECT * FROM event")
    assert {(item.table, item.row) for item in repository.verify()} == {
        ("schema", "run_no_delete"),
        ("schema", "v_timeline"),
    }


def test_edited_row_is_named_with_its_key(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    result = repository.find_run("3", campaign=campaign).result_digest
    with tampering(raw):
        raw.execute(
            "UPDATE verdict SET verdict = 'FAIL' WHERE fsr_id = 'FSR1' AND run_number = "
            "(SELECT number FROM run WHERE result_digest = ?)",
            (result,),
        )
    findings = repository.verify()
    assert any(item.table == "verdict" and item.row.startswith(result) for item in findings)
    assert any(item.table == "tally" for item in findings)


def test_metrics_of_two_runs_exchanged_with_their_hashes_are_noticed(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    assert campaign
    with tampering(raw):
        for old, new in ((1, 99), (2, 1), (99, 2)):
            raw.execute("UPDATE metric SET run_number = ? WHERE run_number = ?", (new, old))
    assert {item.table for item in repository.verify()} >= {"metric", "run"}


@on_sqlite
def test_text_that_is_not_unicode_is_a_finding_not_a_crash(
    repository: Repository, campaign: str, raw: sqlite3.Connection
) -> None:
    assert campaign
    with tampering(raw):
        raw.execute("UPDATE event SET text = CAST(x'ff41' AS TEXT) WHERE seq = 0")
        raw.execute("UPDATE run SET end_reason = x'ff41', variant = x'ff41'")
    named = {item.table for item in repository.verify()}
    assert named >= {"event", "run"}


@pytest.mark.slow
@on_sqlite
def test_one_hundred_flipped_bits_are_never_taken_for_the_truth(
    repository: Repository, example: Any, tmp_path: Path
) -> None:
    campaign = example.campaign(repository, 8)
    truth = repository.result_table_hash(campaign)
    repository.close()
    stored = repository.location.path
    assert stored is not None
    with sqlite3.connect(stored) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    content = stored.read_bytes()
    picks = random.Random(7)  # noqa: S311 - where to flip
    for trial in range(100):
        damaged = bytearray(content)
        damaged[picks.randrange(100, len(content))] ^= 1 << picks.randrange(8)
        path = tmp_path / f"flip{trial}.db"
        path.write_bytes(damaged)
        try:
            with Repository.open(path, create=False) as flipped:
                findings = flipped.verify()
                changed = flipped.result_table_hash(campaign) != truth
        except (IntegrityError, PlatformError):
            continue
        finally:
            for leftover in tmp_path.glob("flip*"):
                leftover.unlink()
        assert findings or not changed
