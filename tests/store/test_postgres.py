"""Databases on a server: statements as it takes them, and what it says when it does not."""

from collections.abc import Iterator
from contextlib import closing
from typing import Any

import pytest
from sqlalchemy import Connection

from adeye.errors import InputError, IntegrityError, LostConnection, PlatformError
from adeye.store import postgres, tables
from adeye.store.database import Database
from adeye.store.encoding import Row, row
from adeye.store.location import locate
from adeye.store.repository import Repository
from tests.refusals import refused

on_server = pytest.mark.parametrize("place", ["postgresql"], indirect=True)


@pytest.fixture
def database(repository: Repository) -> Iterator[Database]:
    opened = Database(repository.location)
    yield opened
    opened.close()


@pytest.mark.parametrize(
    ("here", "there"),
    [
        ("SELECT ? AS a", "SELECT %s AS a"),
        ("SELECT '?', ?", "SELECT '?', %s"),
        ("SELECT 'it''s ?', ?", "SELECT 'it''s ?', %s"),
        ("SELECT a % 2, '%'", "SELECT a %% 2, '%%'"),
        ("SELECT group_concat(a, ', ')", "SELECT string_agg(a, ', ')"),
        ("FROM a CROSS JOIN b", "FROM a JOIN b"),
        ("FROM json_each(?)", "FROM json_each(CAST(%s AS TEXT))"),
        ("FROM json_each(t.point)", "FROM json_each(t.point)"),
    ],
)
def test_statement_is_written_as_the_server_takes_it(here: str, there: str) -> None:
    assert postgres.translated(here) == there


def test_option_that_the_driver_does_not_know_is_named_without_its_value() -> None:
    with pytest.raises(InputError, match="'pasword' is no option") as caught:
        Database(locate("postgresql://host/evidence?pasword=canary"))
    assert "canary" not in str(caught.value)


@pytest.mark.parametrize("option", ["sslmode", "target_session_attrs"])
def test_value_of_an_option_that_there_is_not_is_no_lost_connection(option: str) -> None:
    database = Database(locate(f"postgresql://127.0.0.1:1/evidence?{option}=nonsense"))
    with pytest.raises(InputError, match=f'invalid {option} value: "nonsense"'), database.read():
        pass


def odd_rows(count: int) -> list[Row]:
    return [
        row(tables.CONTENT["odd"], (f"{number:064x}", f"odd{number}", "1", "{}" * (number % 3)))
        for number in range(count)
    ]


def stored(connection: Connection) -> list[Any]:
    return [tuple(item) for item in connection.exec_driver_sql("SELECT * FROM odd ORDER BY digest")]


@on_server
@pytest.mark.parametrize("count", [3, 200])
def test_few_rows_and_many_go_in_as_they_are(database: Database, count: int) -> None:
    rows = odd_rows(count)
    with database.write() as connection:
        assert postgres.insert_rows(connection, tables.CONTENT["odd"], rows) == count
        assert stored(connection) == rows


@on_server
def test_each_session_says_how_numbers_times_and_texts_arrive(
    repository: Repository, raw: Any
) -> None:
    name = repository.location.url.database
    for setting in ("extra_float_digits = -15", "datestyle = 'SQL'", "client_encoding = 'LATIN1'"):
        raw.execute(f"ALTER DATABASE {name} SET {setting}")
    with closing(Database(repository.location)) as database, database.read() as connection:
        names = ("extra_float_digits", "datestyle", "client_encoding")
        shown = [connection.exec_driver_sql(f"SHOW {item}").scalar_one() for item in names]
    assert shown == ["1", "ISO, MDY", "UTF8"]


@on_server
def test_row_that_is_there_is_an_integrity_error(database: Database) -> None:
    rows = odd_rows(1)
    with database.write() as connection:
        postgres.insert_rows(connection, tables.CONTENT["odd"], rows)
    with pytest.raises(IntegrityError, match="refused a change"), database.write() as again:
        postgres.insert_rows(again, tables.CONTENT["odd"], rows)
    with pytest.raises(IntegrityError, match="insert-only"), database.write() as connection:
        connection.exec_driver_sql("UPDATE odd SET id = 'other'")


@on_server
def test_sums_of_whole_numbers_are_whole_numbers(database: Database) -> None:
    with database.read() as connection:
        found = connection.exec_driver_sql("SELECT SUM(v), SUM(v) / 8 FROM (VALUES (1), (3)) t (v)")
        assert [type(value) for value in found.one()] == [int, int]
        real = connection.exec_driver_sql("SELECT CAST(1.5 AS NUMERIC)").scalar_one()
        assert (real, type(real)) == (1.5, float)


@pytest.mark.parametrize(
    ("document", "expected"),
    [
        ('{"a": 1, "b": 2.5, "c": "x"}', ["a 1 integer", "b 2.5 real", "c x text"]),
        ('{"a": true, "b": null}', ["a 1 true", "b None null"]),
        ("[3, 4]", ["0 3 integer", "1 4 integer"]),
        ("[]", []),
        ("{}", []),
    ],
)
def test_json_each_is_the_same(database: Database, document: str, expected: list[str]) -> None:
    sql = "SELECT key, value, type FROM json_each(?) ORDER BY key"
    with database.read() as connection:
        found = connection.exec_driver_sql(sql, (document,)).all()
    assert [" ".join(map(str, item)) for item in found] == expected


def test_server_that_is_not_there_and_password_that_is(tmp_path: Any) -> None:
    url = f"postgresql://me:canary@/evidence?host={tmp_path}"
    raised = refused(LostConnection, Repository.open, url, says="cannot be reached")
    assert "canary" not in str(raised)


def test_database_that_does_not_exist_is_named_with_what_to_do(server: Any) -> None:
    with pytest.raises(PlatformError, match=r"does not exist .*createdb") as raised:
        Repository.open(server.url("nowhere"))
    assert not isinstance(raised.value, LostConnection)


@pytest.mark.parametrize("encoding", ["SQL_ASCII", "LATIN1"])
def test_database_that_does_not_hold_every_text_is_refused(server: Any, encoding: str) -> None:
    name = f"other_{encoding.lower()}"
    of_any_language = "LC_COLLATE 'C' LC_CTYPE 'C' TEMPLATE template0"
    server.execute(f"CREATE DATABASE {name} ENCODING '{encoding}' {of_any_language}")
    says = f"has the encoding {encoding}.*--encoding=UTF8"
    refused(PlatformError, Repository.open, server.url(name), says=says)


def test_user_who_does_not_exist_is_told_about_users(server: Any) -> None:
    url = server.url("postgres").replace("tester@", "stranger@")
    raised = refused(PlatformError, Repository.open, url, says="does not let this user in")
    assert not isinstance(raised, LostConnection)
