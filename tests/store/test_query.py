import sqlite3
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import pytest

from adeye.errors import AdeyeError, InputError, PlatformError
from adeye.store.query import _Guard, run_query
from adeye.store.repository import Repository
from tests.store.raw import on_sqlite

ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
GROWING = (
    "WITH RECURSIVE g(s) AS (SELECT 'aaaaaaaaaaaaaaaa' UNION ALL SELECT s || s FROM g LIMIT 40) "
)

DENIED = [
    "ATTACH 'stolen.db' AS other",
    "ATTACH ':memory:' AS other",
    "DETACH main",
    "PRAGMA journal_mode = DELETE",
    "PRAGMA query_only = OFF",
    "PRAGMA writable_schema = ON",
    "SELECT * FROM pragma_database_list",
    "INSERT INTO odd VALUES ('a', 'b', 'c', 'd', 'e')",
    "UPDATE work SET state = 'done'",
    "DELETE FROM run",
    "REPLACE INTO run SELECT * FROM run",
    "CREATE TABLE x (y)",
    "CREATE TEMP TABLE x (y)",
    "CREATE VIEW x AS SELECT 1",
    "CREATE VIRTUAL TABLE x USING fts5(y)",
    "DROP TABLE run",
    "DROP TRIGGER run_no_delete",
    "ALTER TABLE run ADD COLUMN x",
    "REINDEX",
    "ANALYZE",
    "BEGIN IMMEDIATE",
    "SAVEPOINT s",
    "COMMIT",
    "WITH x AS (SELECT 1) DELETE FROM run",
    "SELECT load_extension('evil.so')",
    "SELECT randomblob(1000000000)",
    "SELECT zeroblob(1000000000)",
    "SELECT hex(zeroblob(1000000000))",
    "SELECT printf('%.*c', 100000000, 'x')",
    "SELECT format('%.*c', 100000000, 'x')",
    "SELECT replace('aaaa', 'a', 'bbbbbbbb')",
    "SELECT instr('aaaa', 'ab')",
    "SELECT trim('aaaa', 'a')",
    "SELECT readfile('/etc/passwd')",
    "SELECT writefile('x', 'y')",
    "SELECT edit('x')",
    "SELECT fts3_tokenizer('simple')",
    "SELECT sqlite_compileoption_get(1)",
]
CUT = [
    "ENDLESS SELECT length(group_concat(i)) FROM n",
    "ENDLESS SELECT length(json_group_array(i)) FROM n",
    "ENDLESS SELECT count(*) FROM n",
    "ENDLESS SELECT max(i) FROM n WHERE i < 0",
    "ENDLESS SELECT i FROM n ORDER BY i DESC",
    "ENDLESS SELECT group_concat(i) FROM n WHERE i < 0",
    "SELECT count(*) FROM v_runs a, v_runs b, v_runs c, v_runs d, v_runs e, v_runs f, v_runs g",
    "SELECT * FROM run a, run b, run c, run d, run e, run f, run g ORDER BY random(), 1",
]
TOO_BIG = [
    "GROWING SELECT length(max(s)) FROM g",
    "SELECT " + "(" * 300 + "1" + ")" * 300,
    "SELECT 1" + " + 1" * 300,
    "SELECT 1" + " UNION ALL SELECT 1" * 60,
    "SELECT '" + "a" * 200_000 + "'",
    "SELECT 'a' LIKE '" + "%a" * 200 + "'",
    "SELECT 1; DELETE FROM run",
    "SELECT 1; SELECT 2",
    "",
    "-- nothing",
    "/* SELECT 1 */",
    "EXPLAIN",
    "SELEC 1",
    "SELECT nothing FROM v_runs",
    "SELECT 1\x00; DROP TABLE run",
    "SELECT ?",
    "VACUUM INTO 'copy.db'",
]


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory, make_example: Callable[[], Any]) -> bytes:
    path = tmp_path_factory.mktemp("query") / "adeye.db"
    with Repository.open(path) as repository:
        make_example().campaign(repository, 8)
    return path.read_bytes()


@pytest.fixture
def path(tmp_path: Path, filled: bytes) -> Path:
    copied = tmp_path / "adeye.db"
    copied.write_bytes(filled)
    return copied


def test_select_returns_columns_and_rows(path: Path) -> None:
    found = run_query(
        path,
        "SELECT architecture, count(*) AS runs, round(avg(min_distance_m), 2) FROM v_runs "
        "GROUP BY architecture ORDER BY 1",
    )
    assert found.columns[:2] == ("architecture", "runs")
    assert found.rows == (("legacy", 4, 6.0), ("new", 4, 7.0))
    assert not found.is_cut


@pytest.mark.parametrize(
    "sql",
    [
        "SELECT json_extract(verdicts, '$.FSR1') FROM v_runs",
        "SELECT verdicts ->> 'FSR1' FROM v_runs WHERE scenario LIKE 'cut%'",
        "SELECT key, value FROM v_runs, json_each(parameters)",
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 5) SELECT * FROM n",
        "SELECT ordinal, lag(ordinal) OVER (ORDER BY ordinal) FROM v_runs",
        "SELECT name FROM sqlite_master WHERE type = 'view'",
        "SELECT iif(1, 2, 3)",  # codespell:ignore iif
        "SELECT * FROM v_gate",
        "SELECT * FROM v_fsr_status",
        "SELECT * FROM v_architecture_pairs",
        "SELECT * FROM v_coverage",
        "SELECT * FROM v_timeline",
        "SELECT * FROM v_verdicts",
        "SELECT * FROM v_runs_cut_in",
        "VALUES (1, 2), (3, 4)",
        "EXPLAIN QUERY PLAN SELECT * FROM run",
    ],
)
def test_everything_that_an_engineer_needs_is_allowed(path: Path, sql: str) -> None:
    assert run_query(path, sql).rows


def test_rows_beyond_the_cap_are_cut_and_it_says_so(path: Path) -> None:
    sql = "SELECT ordinal FROM v_runs ORDER BY ordinal"
    assert run_query(path, sql, max_rows=8).is_cut is False
    cut = run_query(path, sql, max_rows=7)
    assert (len(cut.rows), cut.is_cut) == (7, True)
    assert run_query(path, written_out("ENDLESS SELECT i FROM n"), max_rows=500).is_cut


def written_out(sql: str) -> str:
    return sql.replace("ENDLESS", ENDLESS).replace("GROWING", GROWING)


def state_of(path: Path) -> tuple[set[str], list[str]]:
    connection = sqlite3.connect(path)
    dump = list(connection.iterdump())
    connection.close()
    return {item.name for item in path.parent.iterdir()}, dump


@pytest.mark.parametrize("sql", DENIED)
def test_harmful_statement_is_denied(path: Path, monkeypatch: pytest.MonkeyPatch, sql: str) -> None:
    monkeypatch.chdir(path.parent)
    before = state_of(path)
    with pytest.raises(InputError, match="query: "):
        run_query(path, written_out(sql), timeout_s=5.0)
    assert state_of(path) == before


@pytest.mark.parametrize("sql", CUT)
def test_endless_statement_is_stopped_at_its_deadline(path: Path, sql: str) -> None:
    began = time.monotonic()
    with pytest.raises(InputError, match=r"stopped after 0\.3 s"):
        run_query(path, written_out(sql), timeout_s=0.3)
    assert time.monotonic() - began < 3.0


@pytest.mark.parametrize("sql", TOO_BIG)
def test_oversized_or_malformed_statement_is_an_input_error(
    path: Path, monkeypatch: pytest.MonkeyPatch, sql: str
) -> None:
    monkeypatch.chdir(path.parent)
    before = state_of(path)
    with pytest.raises(InputError, match="query: "):
        run_query(path, written_out(sql), timeout_s=5.0)
    assert state_of(path) == before


def test_reading_does_not_wait_for_a_writer(path: Path) -> None:
    writer = sqlite3.connect(path, isolation_level=None)
    writer.execute("BEGIN IMMEDIATE")
    assert run_query(path, "SELECT count(*) FROM run").rows == ((8,),)
    writer.execute("ROLLBACK")
    writer.close()


def test_missing_database_is_not_made(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        run_query(tmp_path / "none.db", "SELECT 1")
    assert list(tmp_path.iterdir()) == []


def test_file_of_someone_else_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "theirs.db"
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE t (x)")
    connection.close()
    with pytest.raises(PlatformError, match="not made by adeye"):
        run_query(path, "SELECT * FROM t")


def test_path_with_marks_of_a_url_is_only_a_path(tmp_path: Path, example: Any) -> None:
    path = tmp_path / "a b?mode=rwc#50%.db"
    with Repository.open(path) as repository:
        example.campaign(repository, 1)
    assert run_query(path, "SELECT count(*) FROM run").rows == ((1,),)
    assert {item.name.partition(".db")[0] for item in tmp_path.iterdir()} == {"a b?mode=rwc#50%"}


class Configurable(sqlite3.Connection):
    """A connection as Python 3.12 has it."""

    settings: ClassVar[list[tuple[int, bool]]] = []

    def setconfig(self, setting: int, enable: bool = True, /) -> None:  # noqa: FBT001, FBT002
        self.settings.append((setting, enable))


def test_connection_is_defensive_where_python_can_ask_for_it() -> None:
    connection = sqlite3.connect(":memory:", factory=Configurable)
    _Guard(1.0).close_in(connection)
    assert Configurable.settings == [(1010, True)]
    connection.close()


@on_sqlite
def test_hostile_view_in_the_database_gains_nothing(path: Path, raw: sqlite3.Connection) -> None:
    raw.execute("CREATE VIEW harmless AS SELECT load_extension('evil.so')")
    raw.execute("CREATE VIEW big AS SELECT length(randomblob(1000000000))")
    raw.close()
    for view in ("harmless", "big"):
        with pytest.raises(AdeyeError, match=r"not allowed|unsafe"):
            run_query(path, f"SELECT * FROM {view}")  # noqa: S608
