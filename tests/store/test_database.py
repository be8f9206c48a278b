"""Transactions: whole or not at all, by several threads and processes, and again when lost."""

import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from adeye.errors import LostConnection, PlatformError
from adeye.store import database as database_module
from adeye.store.database import Database, create_parent, persistently
from adeye.store.location import Location


@pytest.fixture
def database(place: str | Path) -> Iterator[Database]:
    opened = Database(place)
    with opened.write() as connection:
        connection.exec_driver_sql("CREATE TABLE t (x INTEGER UNIQUE)")
    yield opened
    opened.close()


def values(database: Database) -> list[int]:
    with database.read() as connection:
        return list(connection.exec_driver_sql("SELECT x FROM t ORDER BY x").scalars())


def fail_half_way(database: Database) -> None:
    with database.write() as connection:
        connection.exec_driver_sql("INSERT INTO t VALUES (1)")
        raise RuntimeError("half way")


def test_write_that_raises_leaves_nothing(database: Database) -> None:
    with pytest.raises(RuntimeError, match="half way"):
        fail_half_way(database)
    assert values(database) == []


def test_reader_sees_one_state_and_never_waits_for_the_writer(database: Database) -> None:
    with database.read() as reader:
        assert reader.exec_driver_sql("SELECT count(*) FROM t").scalar() == 0
        with database.write() as writer:
            writer.exec_driver_sql("INSERT INTO t VALUES (1)")
        assert reader.exec_driver_sql("SELECT count(*) FROM t").scalar() == 0
    assert values(database) == [1]


def test_writers_of_several_threads_wait_for_each_other(database: Database) -> None:
    def add(first: int) -> None:
        for number in range(first, first + 20):
            with database.write() as connection:
                connection.exec_driver_sql("INSERT INTO t VALUES (?)", (number,))

    threads = [threading.Thread(target=add, args=(100 * index,)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(values(database)) == 80


def test_child_uses_connections_of_its_own(database: Database) -> None:
    assert values(database) == []
    pid = os.fork()
    if pid == 0:
        with database.write() as connection:
            connection.exec_driver_sql("INSERT INTO t VALUES (7)")
        os._exit(0)
    _, status = os.waitpid(pid, 0)
    assert status == 0
    assert values(database) == [7]


def test_parent_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(PlatformError, match="folder cannot be made"):
        create_parent(Location.of_file(tmp_path / "file" / "a.db"))


def test_connections_of_another_process_are_not_used(database: Database) -> None:
    with database.read() as before:
        parents = before.connection.dbapi_connection
    database._pid = -1
    with database.read() as after:
        assert after.connection.dbapi_connection is not parents
    assert database._pid == os.getpid()
    assert parents is not None
    parents.close()


def test_lost_connection_is_tried_again_until_it_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    pauses: list[float] = []
    monkeypatch.setattr(time, "sleep", pauses.append)
    answers = iter([LostConnection("gone"), LostConnection("gone"), None])

    def action() -> str:
        answer = next(answers)
        if answer is not None:
            raise answer
        return "done"

    assert persistently(action) == "done"
    assert pauses == sorted(pauses)
    assert len(pauses) == 2


def test_lost_connection_is_not_tried_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(database_module, "RECONNECT_S", 0.0)

    def action() -> None:
        raise LostConnection("gone")

    with pytest.raises(LostConnection, match="gone"):
        persistently(action)


def test_other_errors_are_not_tried_again() -> None:
    calls: list[int] = []

    def action() -> None:
        calls.append(1)
        raise PlatformError("no")

    with pytest.raises(PlatformError, match="no"):
        persistently(action)
    assert calls == [1]


def test_change_that_was_lost_is_made_again(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(time, "sleep", lambda _: None)
    tries: list[int] = []

    def change(connection: object) -> int:
        tries.append(1)
        connection.exec_driver_sql("INSERT INTO t VALUES (5)")  # type: ignore[attr-defined]
        if len(tries) == 1:
            raise LostConnection("gone")
        return len(tries)

    assert database.change(change) == 2
    assert values(database) == [5]
