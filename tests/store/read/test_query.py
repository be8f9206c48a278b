import os
import re
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar

import pytest

from adeye.errors import AdeyeError, InputError, PlatformError
from adeye.store.read.query import _Guard, run_query
from adeye.store.repository import Repository
from tests.hostile_sql import (
    ALLOWED,
    CUT,
    DENIED,
    TOO_BIG,
    TOO_MUCH,
    statements,
    written_out,
)
from tests.project import ROOT
from tests.store.raw import on_sqlite


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


@pytest.mark.parametrize("sql", ALLOWED)
def test_everything_that_an_engineer_needs_is_allowed(path: Path, sql: str) -> None:
    assert run_query(path, sql).rows


def test_rows_beyond_the_cap_are_cut_and_it_says_so(path: Path) -> None:
    sql = "SELECT ordinal FROM v_runs ORDER BY ordinal"
    assert run_query(path, sql, max_rows=8).is_cut is False
    cut = run_query(path, sql, max_rows=7)
    assert (len(cut.rows), cut.is_cut) == (7, True)
    assert run_query(path, written_out("ENDLESS SELECT i FROM n"), max_rows=500).is_cut


def state_of(path: Path) -> tuple[set[str], bytes]:
    return {item.name for item in path.parent.iterdir()}, path.read_bytes()


@pytest.mark.parametrize("sql", DENIED)
def test_harmful_statement_is_denied(path: Path, monkeypatch: pytest.MonkeyPatch, sql: str) -> None:
    monkeypatch.chdir(path.parent)
    before = state_of(path)
    with pytest.raises(InputError, match="query: "):
        run_query(path, written_out(sql), timeout_s=5.0)
    assert state_of(path) == before


@pytest.mark.slow
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


IN_A_FRESH_PROCESS = """
import resource, sys
from adeye.errors import InputError
from adeye.store.read.query import run_query

before = resource.getrlimit(resource.RLIMIT_AS)
try:
    run_query(sys.argv[1], sys.stdin.read(), timeout_s=20.0)
except InputError as error:
    print(error)
assert resource.getrlimit(resource.RLIMIT_AS) == before
"""


@pytest.mark.slow
@pytest.mark.parametrize("sql", TOO_MUCH, ids=range(len(TOO_MUCH)))
def test_statement_that_takes_all_memory_is_stopped(path: Path, sql: str) -> None:
    # In a process of its own: what tests before it gave back would be there to be used.
    ended = subprocess.run(
        [sys.executable, "-c", IN_A_FRESH_PROCESS, str(path)],
        input=written_out(sql),
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    assert re.search(r"took more than 512 MiB|stopped after", ended.stdout), ended.stdout


@pytest.mark.parametrize("pattern", ["%a" * 45 + "%b", "%_a" * 30 + "%b", "%a_a_" * 15 + "%b"])
@pytest.mark.parametrize("operator", ["LIKE", "GLOB"])
def test_pattern_cannot_run_beyond_the_deadline(path: Path, operator: str, pattern: str) -> None:
    # One call of a function is one step, which no deadline ends.
    text = pattern if operator == "LIKE" else pattern.replace("%", "*").replace("_", "?")
    began = time.monotonic()
    sql = f"LARGE SELECT s {operator} '{text}' FROM large"  # noqa: S608
    found = run_query(path, written_out(sql))
    assert time.monotonic() - began < 5.0
    assert found.rows == ((0,),)


def test_parameter_is_a_value_and_never_sql(path: Path) -> None:
    hostile = "' OR 1=1; DROP TABLE run; --"
    found = run_query(path, "SELECT :campaign", parameters={"campaign": hostile})
    assert found.rows == ((hostile,),)


def fuzz(path: Path, count: int) -> None:
    before = state_of(path)
    answered = 0
    for sql in statements(count):
        try:
            run_query(path, sql, timeout_s=0.5, max_rows=100)
            answered += 1
        except InputError:
            pass
        assert {item.name for item in path.parent.iterdir()} == before[0], sql
    assert state_of(path) == before
    assert answered > count / 10


@pytest.mark.slow
def test_fuzzed_statements_write_nothing(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    fuzz(path, 500)


@pytest.mark.slow
def test_many_fuzzed_statements_write_nothing(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    fuzz(path, 1_500)


def late_after(duration_s: float) -> Callable[[], bool]:
    end = time.monotonic() + duration_s
    return lambda: time.monotonic() > end


@pytest.mark.slow
def test_fuzzed_statements_would_do_harm_on_a_plain_connection(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(path.parent)
    before = state_of(path)
    for sql in statements(500):
        connection = sqlite3.connect(path, isolation_level=None, timeout=0)
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, 1_000_000)
        connection.set_progress_handler(late_after(0.5), 1000)
        with suppress(sqlite3.Error, sqlite3.Warning, UnicodeError):
            connection.execute(sql).fetchmany(100)
        connection.close()
    files, content = state_of(path)
    assert files > before[0]
    assert content != before[1]


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
    path = tmp_path / "a b&mode=rwc#50%.db"
    with Repository.open(path) as repository:
        example.campaign(repository, 1)
    assert run_query(path, "SELECT count(*) FROM run").rows == ((1,),)
    assert {item.name.partition(".db")[0] for item in tmp_path.iterdir()} == {"a b&mode=rwc#50%"}


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
