"""Queries on a server: what a reader may, what nobody may, and that both lines hold alone."""

import hashlib
import math
import os
import re
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar

import psycopg
import pytest

from adeye.errors import AdeyeError, InputError, PlatformError, UsageError
from adeye.store.location import locate
from adeye.store.read import query as server_query
from adeye.store.read.query import (
    READER,
    _Guard,
    checked,
    columns_of,
    grant,
    run_query,
    tokens_of,
)
from adeye.store.read.saved import SAVED
from adeye.store.repository import Repository
from adeye.store.schema import upgrade
from adeye.store.tables import metadata
from adeye.store.views import view_ddl
from tests import hostile_sql
from tests.postgres import Server
from tests.project import ROOT
from tests.refusals import refused
from tests.store.conftest import Example
from tests.store.raw import on_sqlite
from tests.stored import known, stored


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("query") / "adeye.db"
    with Repository.open(path) as repository:
        Example().campaign(repository, 8)
    return path.read_bytes()


@pytest.fixture
def path(tmp_path: Path, filled: bytes) -> Path:
    copied = tmp_path / "adeye.db"
    copied.write_bytes(filled)
    return copied


@pytest.fixture(params=["path", "alice"])
def anywhere(request: pytest.FixtureRequest) -> Any:
    """The same campaign in a file and on a server, whose reader asks."""
    return request.getfixturevalue(request.param)


def test_select_returns_columns_and_rows(anywhere: Any) -> None:
    found = run_query(
        anywhere,
        "SELECT architecture, count(*) AS runs, round(avg(min_distance_m)) AS mean, 'a . b%' AS b "
        "FROM v_runs GROUP BY architecture ORDER BY 1",
    )
    assert found.columns == ("architecture", "runs", "mean", "b")
    assert found.rows == (("legacy", 4, 6.0, "a . b%"), ("new", 4, 7.0, "a . b%"))
    assert not found.is_cut


@pytest.mark.parametrize(
    ("sql", "says"),
    [
        ("SELECT min_tcc_s FROM v_runs", "mean 'min_ttc_s'"),
        ("SELECT r.min_tcc_s FROM v_runs r", "mean 'min_ttc_s'"),
        ("SELECT 1 FROM v_run", "mean 'v_runs'"),
        ("SELECT quite_another FROM v_gate", "--columns v_gate' lists them"),
    ],
)
def test_nearest_names_are_said_of_one_that_is_not_there(
    anywhere: Any, sql: str, says: str
) -> None:
    assert says in refused(InputError, run_query, anywhere, sql).remedy


def test_columns_of_a_view_have_the_unit_that_their_names_tell(anywhere: Any) -> None:
    units = {item.name: item.unit for item in columns_of(anywhere, "v_runs")}
    told = ("min_ttc_s", "max_drac_mps2", "max_yaw_rate_radps", "scenario", "contact", "min_mtc")
    assert [units[name] for name in told] == ["s", "m/s^2", "rad/s", "", "", ""]
    assert list(units) == list(run_query(anywhere, "SELECT * FROM v_runs").columns)
    refused(UsageError, columns_of, anywhere, "v_runz", says="'v_runz'")


def test_pragmas_tell_and_set_nothing(path: Path) -> None:
    told = run_query(path, "PRAGMA table_info(v_goal_asil)")
    assert [row[1] for row in told.rows] == ["concept", "goal", "rank"]
    before = run_query(path, "PRAGMA user_version").rows
    for sql in ("PRAGMA user_version = 7", "PRAGMA query_only = OFF", "PRAGMA journal_mode"):
        refused(InputError, run_query, path, sql, says="only reading is allowed")
    assert run_query(path, "PRAGMA user_version").rows == before


def test_rows_beyond_the_cap_are_cut_and_it_says_so(anywhere: Any) -> None:
    sql = "SELECT ordinal FROM v_runs ORDER BY ordinal"
    assert run_query(anywhere, sql, max_rows=8).is_cut is False
    cut = run_query(anywhere, sql, max_rows=7)
    assert (len(cut.rows), cut.is_cut) == (7, True)


def test_endless_rows_are_cut(path: Path) -> None:
    endless = hostile_sql.written_out("ENDLESS SELECT i FROM n")
    assert run_query(path, endless, max_rows=500).is_cut


def test_parameter_is_a_value_and_never_sql(anywhere: Any) -> None:
    hostile = "' OR 1=1; DROP TABLE run; --%s"
    found = run_query(anywhere, "SELECT :campaign AS a", parameters={"campaign": hostile})
    assert found.rows == ((hostile,),)


def test_parameter_that_is_not_given_is_named(alice: str) -> None:
    assert run_query(alice, "EXPLAIN SELECT * FROM v_gate").rows
    with pytest.raises(InputError, match="nothing is given for :other"):
        run_query(alice, "SELECT :other", parameters={"campaign": "x"})


@pytest.mark.parametrize("sql", hostile_sql.ALLOWED)
def test_everything_that_an_engineer_needs_is_allowed(path: Path, sql: str) -> None:
    assert run_query(path, sql).rows


def state_of(path: Path) -> tuple[set[str], bytes]:
    return {item.name for item in path.parent.iterdir()}, path.read_bytes()


@pytest.mark.parametrize("sql", [*hostile_sql.DENIED, *hostile_sql.TOO_BIG])
def test_bad_statement_is_denied(path: Path, monkeypatch: pytest.MonkeyPatch, sql: str) -> None:
    monkeypatch.chdir(path.parent)
    before = state_of(path)
    with pytest.raises(InputError, match="query: "):
        run_query(path, hostile_sql.written_out(sql), timeout_s=5.0)
    assert state_of(path) == before


@pytest.mark.slow
@pytest.mark.parametrize("sql", hostile_sql.CUT)
def test_endless_statement_is_stopped_at_its_deadline(path: Path, sql: str) -> None:
    began = time.monotonic()
    with pytest.raises(InputError, match=r"stopped after 0\.3 s"):
        run_query(path, hostile_sql.written_out(sql), timeout_s=0.3)
    assert time.monotonic() - began < 3.0


@pytest.mark.parametrize("limit", [math.nan, math.inf, 0.0, -1.0])
def test_limit_that_never_comes_is_refused(path: Path, limit: float) -> None:
    refused(InputError, run_query, path, "SELECT 1", timeout_s=limit, says="seconds above 0")


IN_A_FRESH_PROCESS: str = stored("plugins")["asked"]


@pytest.mark.slow
@pytest.mark.parametrize("sql", hostile_sql.TOO_MUCH, ids=range(len(hostile_sql.TOO_MUCH)))
def test_statement_that_takes_all_memory_is_stopped(path: Path, sql: str) -> None:
    # In a process of its own: what tests before it gave back would be there to be used.
    command = [sys.executable, "-c", IN_A_FRESH_PROCESS, str(path)]
    text, own = hostile_sql.written_out(sql), {**os.environ, "PYTHONPATH": str(ROOT)}
    said = subprocess.check_output(command, input=text, env=own, text=True)
    assert re.search(r"took more than 512 MiB|stopped after", said), said


@pytest.mark.parametrize("pattern", ["%a" * 45 + "%b", "%_a" * 30 + "%b", "%a_a_" * 15 + "%b"])
@pytest.mark.parametrize("operator", ["LIKE", "GLOB"])
def test_pattern_cannot_run_beyond_the_deadline(path: Path, operator: str, pattern: str) -> None:
    # One call of a function is one step, which no deadline ends.
    text = pattern if operator == "LIKE" else pattern.replace("%", "*").replace("_", "?")
    began = time.monotonic()
    sql = f"LARGE SELECT s {operator} '{text}' FROM large"  # noqa: S608
    found = run_query(path, hostile_sql.written_out(sql))
    assert time.monotonic() - began < 5.0
    assert found.rows == ((0,),)


@pytest.mark.slow
def test_fuzzed_statements_write_nothing(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    before = state_of(path)
    answered = 0
    for sql in hostile_sql.statements(1_500):
        with suppress(InputError):
            run_query(path, sql, timeout_s=0.5, max_rows=100)
            answered += 1
        assert {item.name for item in path.parent.iterdir()} == before[0], sql
    assert state_of(path) == before
    assert answered > 150


def late_after(duration_s: float) -> Callable[[], bool]:
    end = time.monotonic() + duration_s
    return lambda: time.monotonic() > end


@pytest.mark.slow
def test_fuzz_harms_a_plain_connection(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    before = state_of(path)
    for sql in hostile_sql.statements(500):
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


GROWN = (
    "WITH RECURSIVE g(s, n) AS (SELECT 'aaaaaaaaaaaaaaaa', 1 UNION ALL "
    "SELECT s || s, n + 1 FROM g WHERE n < {}) "
)
HARMFUL = hostile_sql.STATEMENTS["harmful_on_a_server"]


def grown(doublings: int, what: str) -> str:
    """Select something from texts that double."""
    return f"{GROWN.format(doublings)}SELECT {what}"


@pytest.fixture(scope="module")
def owned(server: Server) -> str:
    """A campaign on the server, as its owner names it; who may read is settled."""
    url = server.new_database()
    with Repository.open(url) as repository:
        Example().campaign(repository, 8)
    name = locate(url).url.database
    server.execute("CREATE ROLE alice LOGIN")
    server.execute("CREATE ROLE mallory LOGIN")
    assert grant(locate(url), "alice") == []
    server.execute(f"GRANT CONNECT ON DATABASE {name} TO mallory")
    return url


@pytest.fixture
def alice(owned: str) -> str:
    return owned.replace("://tester@", "://alice@")


@pytest.fixture
def reader(alice: str) -> Iterator[psycopg.Connection[Any]]:
    with psycopg.connect(alice, autocommit=True) as connection:
        connection.execute("SET search_path TO adeye")
        yield connection


def content(url: str) -> list[Any]:
    with psycopg.connect(url) as connection:
        return connection.execute(
            "SELECT c.oid::regclass::text, (xpath('/row/n/text()', query_to_xml("
            "format('SELECT count(*) AS n FROM %s', c.oid::regclass), true, true, '')))[1]::text "
            "FROM pg_class c WHERE c.relkind = 'r' AND c.relnamespace = 'adeye'::regnamespace "
            "ORDER BY 1"
        ).fetchall()


def test_names_that_occur_twice_and_the_order_are_kept(alice: str) -> None:
    sql = "SELECT ordinal, ordinal FROM v_runs ORDER BY ordinal DESC"
    found = run_query(alice, sql, max_rows=2)
    assert found.columns == ("ordinal", "ordinal")
    assert found.rows == ((7, 7), (6, 6))


def test_server_plans_for_the_rows_that_are_read(alice: str) -> None:
    # Without a word of ours a cursor is planned for a tenth of its rows.
    sql = "SELECT statement, current_setting('cursor_tuple_fraction') FROM pg_cursors"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(server_query, "checked", tokens_of)
        ((statement, fraction),) = run_query(alice, sql, max_rows=7).rows
    assert str(statement).endswith("LIMIT 8")
    assert fraction == "1"


@pytest.mark.parametrize(
    "sql", ["SELECT 1) AS one, (SELECT 2", "SELECT 1)", "(SELECT 1", "SELECT 1) AS x LIMIT 5 --"]
)
def test_brackets_of_a_statement_do_not_close_ours(alice: str, sql: str) -> None:
    refused(InputError, run_query, alice, sql, says="bracket")


@pytest.mark.slow
@pytest.mark.parametrize("renewed", ["", " 14:x", " {kept}"])
def test_reader_who_may_make_nothing_verifies_views_too(
    owned: str, alice: str, renewed: str
) -> None:
    with Repository.open(alice, create=False) as repository:
        assert repository.verify() == ()
    with psycopg.connect(owned, autocommit=True) as connection:
        connection.execute("SET search_path TO adeye")

        def told(what: str) -> str:
            found = connection.execute(f"SELECT {what}('v_goal_events'::regclass)".encode())
            return str(known(found.fetchone())[0])

        def replace(query: str, note: str) -> None:
            connection.execute(f"CREATE OR REPLACE VIEW v_goal_events AS {query}".encode())
            connection.execute(f"COMMENT ON VIEW v_goal_events IS '{note}'".encode())

        query, note = told("pg_get_viewdef"), told("obj_description")
        made, _, kept = note.partition(" ")
        other = f"SELECT * FROM ({query.rstrip(';')}) AS x WHERE false"  # noqa: S608 - the text of the view
        replace(other, note)
        if renewed:
            # Who replaces a view can write another note.
            release, text = kept.partition(":")[0], told("pg_get_viewdef")
            own = f"{release}:{hashlib.sha256(text.encode()).hexdigest()}"
            replace(other, f"{made}{renewed.format(kept=own)}")
        try:
            with Repository.open(alice, create=False) as repository:
                (finding,) = repository.verify()
        finally:
            replace(query, note)
    assert (finding.row, finding.problem) == ("v_goal_events", "is not as this release makes it")


def test_view_that_was_put_back_from_a_copy_is_the_same(owned: str, alice: str) -> None:
    with psycopg.connect(owned, autocommit=True) as connection:
        connection.execute("SET search_path TO adeye")
        made = connection.execute(
            "SELECT relname FROM pg_class WHERE relkind = 'v' "
            "AND relnamespace = 'adeye'::regnamespace ORDER BY oid"
        ).fetchall()
        # A copy has the words that the server keeps; it words them anew when it is put back.
        worded = "SELECT pg_get_viewdef(to_regclass(%s))"
        anew = 0
        for _ in range(2):
            for (name,) in made:
                (before,) = known(connection.execute(worded, (name,)).fetchone())
                connection.execute(f"CREATE OR REPLACE VIEW {name} AS {before}".encode())
                (after,) = known(connection.execute(worded, (name,)).fetchone())
                anew += after != before
    assert anew > 0
    with Repository.open(owned, create=False) as repository:
        assert repository.verify() == ()
    # Whoever may make no view compares words that the owner restores.
    upgrade(owned)
    with Repository.open(alice, create=False) as repository:
        assert repository.verify() == ()


def test_nobody_is_granted_anything_whom_the_server_does_not_have(owned: str) -> None:
    refused(InputError, grant, locate(owned), "nobody_there", says="no such user.*nobody_there")


@pytest.mark.slow
@pytest.mark.parametrize("setting", ["default_transaction_read_only", "quote_all_identifiers"])
def test_server_that_is_set_otherwise_has_the_same_views(owned: str, setting: str) -> None:
    with Repository.open(f"{owned}&options=-c%20{setting}%3Don", create=False) as repository:
        assert repository.verify() == ()


@pytest.mark.parametrize("name", SAVED)
def test_saved_query_answers_on_a_server_too(alice: str, name: str) -> None:
    (campaign,) = run_query(alice, "SELECT id FROM campaign").rows[0]
    latest = run_query(alice, SAVED[name].sql)
    assert latest.columns
    ((basis,),) = run_query(alice, SAVED[name].basis).rows
    assert isinstance(basis, int)
    one = SAVED[name].about_one()
    assert run_query(alice, one.sql, parameters={"campaign": campaign}) == latest


@pytest.mark.parametrize(
    "sql", [*HARMFUL, *(item for item in hostile_sql.DENIED if "trim" not in item)]
)
def test_harmful_statement_is_refused(owned: str, alice: str, sql: str) -> None:
    before = content(owned)
    for url in (alice, owned):
        with pytest.raises(InputError, match="query: "):
            run_query(url, hostile_sql.written_out(sql), timeout_s=5.0)
    assert content(owned) == before


@pytest.mark.parametrize("sql", HARMFUL)
def test_role_and_transaction_hold_without_the_list_of_words(
    owned: str, alice: str, monkeypatch: pytest.MonkeyPatch, sql: str
) -> None:
    monkeypatch.setattr(server_query, "checked", tokens_of)
    before = content(owned)
    refused(InputError, run_query, alice, sql, timeout_s=5.0, says="query: ")
    assert content(owned) == before


ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT"


@pytest.mark.parametrize(
    "sql",
    [
        f"{ENDLESS} count(*) FROM n",
        f"{ENDLESS} i FROM n ORDER BY 1",
        "SELECT count(*) FROM event a, event b, event c, event d, event e, event f, event g",
        grown(16, "count(*) FROM g a, g b, g c, g d WHERE a.s || b.s || c.s || d.s LIKE '%b'"),
    ],
)
def test_endless_statement_is_stopped_at_its_deadline_on_a_server(alice: str, sql: str) -> None:
    began = time.monotonic()
    with pytest.raises(InputError, match=r"stopped after 0\.5 s|too much memory"):
        run_query(alice, sql, timeout_s=0.5)
    assert time.monotonic() - began < 10.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "sql",
    [
        grown(16, f"s{', s' * 990} FROM g WHERE n = 16"),
        grown(18, "s FROM g, event, event e WHERE n = 18"),
        grown(40, "length(max(s)) FROM g"),
    ],
)
def test_statement_that_takes_all_memory_is_stopped_on_a_server(alice: str, sql: str) -> None:
    refused(AdeyeError, run_query, alice, sql, timeout_s=20.0, says="query: ")


@pytest.mark.slow
def test_fuzzed_statements_change_nothing(owned: str, alice: str) -> None:
    before = content(owned)
    for sql in hostile_sql.statements(300):
        with suppress(InputError):
            run_query(alice, sql, timeout_s=0.5, max_rows=100)
    assert content(owned) == before


@pytest.mark.slow
def test_reader_reads_every_table_and_view(reader: psycopg.Connection[Any]) -> None:
    for name in (*metadata.tables, *view_ddl(), "v_runs_cut_in", "alembic_version"):
        reader.execute(f"SELECT * FROM {name} LIMIT 1")  # noqa: S608


@pytest.mark.parametrize("name", [*metadata.tables, "alembic_version", "v_runs"])
def test_reader_may_do_nothing_else_to_a_table(reader: psycopg.Connection[Any], name: str) -> None:
    for right in ("INSERT", "UPDATE", "DELETE", "TRUNCATE", "REFERENCES", "TRIGGER"):
        found = reader.execute("SELECT has_table_privilege(%s, %s)", (name, right)).fetchone()
        assert found == (False,)


@pytest.mark.parametrize("statement", hostile_sql.STATEMENTS["forbidden_to_a_reader"])
def test_reader_has_no_other_right(reader: psycopg.Connection[Any], statement: str) -> None:
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        reader.execute(statement.encode())


def test_temporary_files_of_a_reader_are_limited(reader: psycopg.Connection[Any]) -> None:
    assert reader.execute("SHOW temp_file_limit").fetchone() == ("1GB",)


def test_query_of_the_owner_runs_as_the_reader(owned: str) -> None:
    assert run_query(owned, "SELECT current_user").rows == ((READER,),)


def test_user_without_rights_is_told_by_every_reader(owned: str) -> None:
    url = owned.replace("://tester@", "://mallory@")
    told = r"let user mallory read.*'adeye db grant mallory'"
    for is_made in (False, True):
        refused(PlatformError, Repository.open, url, create=is_made, says=told)
    refused(PlatformError, run_query, url, "SELECT * FROM v_runs", says="adeye db grant mallory")


@pytest.mark.slow
def test_owner_who_may_not_make_roles_is_told_what_granting_needs(server: Server) -> None:
    url = server.new_database()
    server.execute("CREATE ROLE plain_owner LOGIN")
    server.execute(f"ALTER DATABASE {locate(url).url.database} OWNER TO plain_owner")
    own = url.replace("://tester@", "://plain_owner@")
    with Repository.open(own) as repository:
        Example().campaign(repository, 2)
    server.execute("CREATE ROLE bob LOGIN")
    with pytest.raises(PlatformError, match="ALTER ROLE plain_owner CREATEROLE"):
        grant(locate(own), "bob")


@pytest.mark.slow
def test_mighty_user_without_a_reading_role_is_refused(server: Server) -> None:
    url = server.new_database()
    Repository.open(url).close()
    refused(InputError, run_query, url, "SELECT 1", says="adeye db grant")
    grant(locate(url), None)
    assert run_query(url, "SELECT 1 AS a").rows == ((1,),)
    # Views that come later can be read, too.
    with Repository.open(url) as repository:
        Example().campaign(repository, 4)
    assert run_query(url, "SELECT count(*) FROM v_runs_cut_in").rows == ((2,),)


def test_name_of_a_role_is_never_sql(owned: str) -> None:
    with pytest.raises(InputError, match="not a plain name"):
        grant(locate(owned), "alice; DROP TABLE adeye.run")


@pytest.mark.parametrize("sql", hostile_sql.STATEMENTS["words_of_reading"])
def test_reading_passes(sql: str) -> None:
    tokens = checked(sql)
    assert [token.text for token in tokens if sql[token.start :].startswith(token.text)] == [
        token.text for token in tokens
    ]


@pytest.mark.parametrize("sql", hostile_sql.STATEMENTS["words_refused"])
def test_everything_else_is_refused(sql: str) -> None:
    refused(InputError, checked, sql, says="query: ")


def test_text_and_name_hide_no_statement() -> None:
    tokens = tokens_of("""SELECT ';' AS ";" , a::text, :b -- ;""")
    expected = "word text word quoted sign word sign word sign parameter"
    assert " ".join(token.kind for token in tokens) == expected
