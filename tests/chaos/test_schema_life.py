"""Databases live on: made, upgraded, used, refused, killed while they change."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import sqlite3
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest
from sqlalchemy import Engine, event

from adeye.cli.app import main
from adeye.store import schema
from adeye.store.repository import Repository
from tests.chaos.bench import DB
from tests.chaos.runners import size
from tests.store.rows import result_table_hash
from tests.stored import stored

FORK: Final = multiprocessing.get_context("fork")
STRIDE: Final = 23
"""Of how many statements one is killed at in the ordinary run."""

AFTER: Final = f"{int(schema.head()) + 1:04}"
NOTICED: Final = stored("plugins")["noticed"]

READING: Final = (
    ("db", "info"), ("db", "verify"), ("query", "SELECT * FROM v_runs"),
    ("query", "SELECT * FROM v_fsr_status"), ("query", "SELECT * FROM v_gate"),
    ("show", "RUN"), ("timeline", "RUN"), ("faults",), ("forks", "--sample", "0"), ("gate",),
    ("matrix",), ("report", "-o", "report.html"), ("compare",), ("confidence",), ("coverage", "1"),
    ("stale",), ("check",), ("uncertainty",), ("preventability", "RUN"), ("replay", "RUN"),
    ("fork", "RUN", "--from", "0", "--authority", "nominal"),
)  # fmt: skip
"""Verbs that open a database that is there."""

Results = tuple[tuple[str, str], ...]


@pytest.fixture
def asset(green: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give a database with a campaign, to which another version is the newest."""
    migrations = tmp_path / "migrations"
    shutil.copytree(Path(schema.__file__).parent / "migrations", migrations)
    (migrations / "versions" / f"{AFTER}_noticed.py").write_text(
        f'revision = "{AFTER}"\ndown_revision = "{schema.head()}"\n{NOTICED}'
    )
    monkeypatch.setattr(schema, "_FOLDER", migrations)
    monkeypatch.setattr(schema, "_HEAD", AFTER)
    return green / DB


def copy_of(asset: Path, folder: Path) -> Path:
    path = folder / "copy.db"
    for suffix in ("-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)
    shutil.copyfile(asset, path)
    return path


def results_of(path: Path) -> Results:
    """Hash the results of each campaign."""
    with Repository.open(path, create=False) as repository:
        assert repository.verify() == ()
        campaigns = [item.id for item in repository.campaigns()]
        return tuple((name, result_table_hash(repository, name)) for name in campaigns)


def in_child(do: Callable[[], object]) -> int:
    """Do something in a child; return what it ended with: 0, or minus the signal."""

    def only() -> None:
        try:
            do()
        except BaseException:  # noqa: BLE001 - a child tells by its code alone
            os._exit(1)
        os._exit(0)

    child = FORK.Process(target=only)
    child.start()
    child.join(120)
    assert child.exitcode is not None
    return child.exitcode


def upgraded(path: Path, killed_at: int = -1) -> int:
    """Upgrade, and die before the n-th statement, of which the last is the commit; count them."""
    seen: list[int] = []

    def count(*_: Any) -> None:
        if len(seen) == killed_at:
            os.kill(os.getpid(), signal.SIGKILL)
        seen.append(1)

    for name in ("before_cursor_execute", "commit"):
        event.listen(Engine, name, count)
    try:
        schema.upgrade(path)
    finally:
        for name in ("before_cursor_execute", "commit"):
            event.remove(Engine, name, count)
    return len(seen)


def dies(path: Path, at: int) -> bool:
    return in_child(partial(upgraded, path, at)) == -signal.SIGKILL


def kill_everywhere(asset: Path, folder: Path, stride: int) -> int:
    """Kill an upgrade at every ``stride``-th statement and at the last ones; return how many."""
    path = copy_of(asset, folder)
    before = schema.current(path)
    total = upgraded(path)
    whole = results_of(path)
    places = sorted({*range(0, total, stride), total - 2, total - 1})
    for at in places:
        copy_of(asset, folder)
        assert dies(path, at), at
        assert schema.current(path) == before, at
        assert schema.upgrade(path) == schema.head()
        assert results_of(path) == whole, at
    return len(places)


@pytest.mark.slow
def test_upgrade_that_is_killed_has_not_begun(asset: Path, tmp_path: Path) -> None:
    assert kill_everywhere(asset, tmp_path, size(3, 1)) >= 5


@pytest.mark.slow
def test_first_use_that_is_killed_has_not_begun(tmp_path: Path) -> None:
    path = tmp_path / "new.db"
    total = upgraded(path)
    for at in sorted({*range(0, total, 10 * STRIDE), total - 1}):
        for item in tmp_path.iterdir():
            item.unlink()
        assert dies(path, at), at
        assert schema.current(path) is None
        assert schema.upgrade(path) == schema.head()


@pytest.mark.slow
def test_several_that_upgrade_at_once_make_one_database(asset: Path, tmp_path: Path) -> None:
    path = copy_of(asset, tmp_path)
    (tmp_path / "alone").mkdir()
    alone = copy_of(asset, tmp_path / "alone")
    schema.upgrade(alone)
    children = [FORK.Process(target=schema.upgrade, args=(path,)) for _ in range(4)]
    for child in children:
        child.start()
    for child in children:
        child.join(120)
    assert [child.exitcode for child in children] == [0] * 4
    assert results_of(path) == results_of(alone)


@pytest.fixture
def folder(tmp_path: Path, unset: pytest.MonkeyPatch) -> Path:
    unset.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("version", "remedy"),
    [
        ("9999", "Use the newer release of adeye that wrote it"),
        ("0001", "Execute its campaigns again"),
    ],
)
def test_every_verb_refuses_a_database_of_another_schema(
    green: Path, folder: Path, capfd: pytest.CaptureFixture[str], version: str, remedy: str
) -> None:
    path = copy_of(green / DB, folder)
    run = "0"
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE alembic_version SET version_num = ?", (version,))
    connection.close()
    content = path.read_bytes()
    for verb in READING:
        words = [run if word == "RUN" else word for word in verb]
        capfd.readouterr()
        code = main([*words, "--db", str(path)])
        said = capfd.readouterr()
        assert (code, said.out) == (5, ""), (verb, said)
        assert f"has schema {version}" in said.err
        assert remedy in said.err
    assert main(["db", "upgrade", "--db", str(path)]) == 5
    assert remedy in capfd.readouterr().err
    # The header of 100 bytes tells the journal mode, which opening sets.
    assert path.read_bytes()[100:] == content[100:]
