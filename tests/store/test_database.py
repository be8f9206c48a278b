"""Transactions: whole or not at all, by several threads and processes, and again when lost."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import pytest

from adeye.errors import LostConnection, PlatformError
from adeye.store import database as database_module
from adeye.store import owner as owner_module
from adeye.store import schema
from adeye.store.database import Database, create_parent, persistently
from adeye.store.location import Location
from adeye.store.owner import Owner, boot_clock_s, owner_from_text
from adeye.store.repository import Repository
from tests.refusals import refused
from tests.store.conftest import Store


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
    refused(RuntimeError, fail_half_way, database, says="half way")
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

    with pytest.raises(LostConnection, match="gone"):
        persistently(Mock(side_effect=LostConnection("gone")))


def test_other_errors_are_not_tried_again() -> None:
    calls: list[int] = []

    def action() -> None:
        calls.append(1)
        raise PlatformError("no")

    refused(PlatformError, persistently, action, says="no")
    assert calls == [1]


def test_lost_change_is_made_again(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
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


# --- the repository as its users open it: made on first use, committed, shared by threads


def test_database_is_made_on_first_use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with Repository.open() as repository:
        assert repository.location.path == Path(".adeye/adeye.db")
        info = repository.info()
    assert (info.schema, set(info.rows.values())) == (schema.head(), {0})
    assert info.size_bytes > 0
    assert Repository.open(create=False).verify() == ()


def test_save_methods_commit(store: Store) -> None:
    store.repository.save_content("odd", store.example.odd)
    store.repository.save_concept(store.example.concept())
    with Repository.open(store.repository.location, create=False) as other:
        assert other.info().rows["odd"] == other.info().rows["concept"] == 1


@pytest.mark.slow
def test_threads_share_a_repository(store: Store) -> None:
    plan = store.plan(40, block_size=2)
    done: list[int] = []

    def work() -> None:
        while (block := store.repository.claim_block(campaign=plan.campaign)) is not None:
            assert store.complete(block)
            done.append(block.id)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(done) == list(range(1, 21))
    assert store.repository.progress(plan.campaign).accounted == 40


# --- owners of leases: alive, dead, or of another machine


def test_this_process_is_alive() -> None:
    assert not Owner.current().is_dead


def test_owner_survives_the_database() -> None:
    assert owner_from_text(Owner.current().to_text()) == Owner.current()


def test_used_again_pid_is_another_process() -> None:
    assert replace(Owner.current(), started="1").is_dead


def test_ended_process_is_dead_even_before_its_parent_looks() -> None:
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    there = replace(Owner.current(), pid=child.pid, started=_started(child.pid))
    assert [there.is_dead] == [False]
    child.kill()
    _wait_for_exit_without_reaping(child.pid)
    assert [there.is_dead] == [True]
    child.communicate()
    assert [there.is_dead] == [True]


def test_process_of_another_machine_is_never_known_to_be_dead() -> None:
    far = Owner("another machine", 1, "1")
    assert not far.is_here
    assert not far.is_dead


def test_clock_of_the_boot_goes_forward() -> None:
    before = boot_clock_s()
    assert boot_clock_s() >= before


def test_without_proc_the_pid_alone_tells(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(owner_module, "_PROC", tmp_path / "none")
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    there = replace(Owner.current(), pid=child.pid)
    assert there.started == ""
    assert [there.is_dead] == [False]
    child.kill()
    child.communicate()
    assert [there.is_dead] == [True]


def test_process_of_another_user(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(owner_module, "_PROC", tmp_path / "none")
    monkeypatch.setattr(os, "kill", Mock(side_effect=PermissionError))
    assert not Owner.current().is_dead


def _started(pid: int) -> str:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]


def _wait_for_exit_without_reaping(pid: int) -> None:
    import os

    os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
