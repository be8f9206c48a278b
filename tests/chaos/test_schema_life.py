"""Databases of every released schema live on: upgraded, used, refused, killed while they change."""

from __future__ import annotations

import gzip
import multiprocessing
import os
import shutil
import signal
import sqlite3
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest
from sqlalchemy import Engine, event

from adeye.cli.entry import main
from adeye.store import schema
from adeye.store.repository import Repository
from tests.chaos.runners import size

if TYPE_CHECKING:
    from collections.abc import Callable

ASSETS: Final = sorted((Path(__file__).parents[1] / "db_assets").glob("v*.db"))
OLDEST: Final = ASSETS[0]
CAMPAIGNS: Final = sorted((Path(__file__).parents[1] / "db_assets/campaigns").glob("*.db.gz"))
"""The campaign of ``tests.chaos.bench`` as releases ran and stored it, by their schema."""
FORK: Final = multiprocessing.get_context("fork")
STRIDE: Final = 23
"""Of how many statements one is killed at in the ordinary run."""

READING: Final = (
    ("db", "info"), ("db", "verify"), ("query", "SELECT * FROM v_runs"),
    ("query", "SELECT * FROM v_fsr_status"), ("query", "SELECT * FROM v_gate"),
    ("show", "RUN"), ("timeline", "RUN"), ("faults",), ("forks", "--sample", "0"), ("gate",),
    ("matrix",), ("report", "-o", "report.html"), ("compare",), ("confidence",), ("coverage", "1"),
    ("stale",), ("check",), ("uncertainty",), ("preventability", "RUN"), ("replay", "RUN"),
    ("fork", "RUN", "--from", "0", "--authority", "nominal"),
)  # fmt: skip
"""Verbs that open a database that is there."""

NOT_HERE: Final = {
    *("stale", "check", "uncertainty", "compare", "confidence", "timeline RUN"),
    *("replay RUN", "fork RUN --from 0 --authority nominal", "forks --sample 0", "faults"),
}
"""Verbs that need the ODD's files, a second architecture, a random design, a fault, or results of
the present arithmetic."""

Results = tuple[tuple[str, str], ...]


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
        return tuple(
            (item.id, repository.result_table_hash(item.id)) for item in repository.campaigns()
        )


def a_run(path: Path) -> str:
    with sqlite3.connect(path) as connection:
        (found,) = connection.execute("SELECT run FROM v_runs ORDER BY run LIMIT 1").fetchone()
    connection.close()
    return str(found)


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


def upgrade_killed(path: Path, at: int) -> None:
    """Upgrade, and die before the n-th statement; the last is the commit."""
    left = iter(range(at))

    def count(*_: Any) -> None:
        if next(left, None) is None:
            os.kill(os.getpid(), signal.SIGKILL)

    event.listen(Engine, "before_cursor_execute", count)
    event.listen(Engine, "commit", count)
    schema.upgrade(path)


def statements_of_upgrade(path: Path) -> int:
    seen: list[int] = []

    def count(*_: Any) -> None:
        seen.append(1)

    event.listen(Engine, "before_cursor_execute", count)
    event.listen(Engine, "commit", count)
    try:
        schema.upgrade(path)
    finally:
        event.remove(Engine, "before_cursor_execute", count)
        event.remove(Engine, "commit", count)
    return len(seen)


def kill_everywhere(asset: Path, folder: Path, stride: int) -> int:
    """Kill an upgrade at every ``stride``-th statement and at the last ones; return how many."""
    path = copy_of(asset, folder)
    before = asset.stem.removeprefix("v")
    total = statements_of_upgrade(path)
    whole = results_of(path)
    places = sorted({*range(0, total, stride), total - 2, total - 1})
    for at in places:
        copy_of(asset, folder)
        assert in_child(lambda at=at: upgrade_killed(path, at)) == -signal.SIGKILL, at  # type: ignore[misc]
        assert schema.current(path) == before, at
        assert schema.upgrade(path) == schema.head()
        assert results_of(path) == whole, at
    return len(places)


@pytest.mark.parametrize("asset", [OLDEST, *ASSETS[-2:-1]], ids=lambda path: path.stem)
def test_upgrade_that_is_killed_has_not_begun(asset: Path, tmp_path: Path) -> None:
    assert kill_everywhere(asset, tmp_path, STRIDE) >= 3


@pytest.mark.chaos
@pytest.mark.slow
@pytest.mark.parametrize("asset", ASSETS, ids=lambda path: path.stem)
def test_upgrade_that_is_killed_at_many_statements_has_not_begun(
    asset: Path, tmp_path: Path
) -> None:
    if asset.stem.removeprefix("v") != schema.head():
        assert kill_everywhere(asset, tmp_path, size(6, 1)) >= 5


def test_first_use_that_is_killed_has_not_begun(tmp_path: Path) -> None:
    path = tmp_path / "new.db"
    total = statements_of_upgrade(path)
    for at in sorted({*range(0, total, 10 * STRIDE), total - 1}):
        for item in tmp_path.iterdir():
            item.unlink()
        assert in_child(lambda at=at: upgrade_killed(path, at)) == -signal.SIGKILL  # type: ignore[misc]
        assert schema.current(path) is None
        assert schema.upgrade(path) == schema.head()


@pytest.mark.parametrize("asset", ASSETS, ids=lambda path: path.stem)
def test_several_that_upgrade_at_once_make_one_database(asset: Path, tmp_path: Path) -> None:
    path = copy_of(asset, tmp_path)
    alone = copy_of(asset, _other(tmp_path))
    schema.upgrade(alone)
    children = [FORK.Process(target=schema.upgrade, args=(path,)) for _ in range(4)]
    for child in children:
        child.start()
    for child in children:
        child.join(120)
    assert [child.exitcode for child in children] == [0] * 4
    assert results_of(path) == results_of(alone)


def _other(folder: Path) -> Path:
    other = folder / "alone"
    other.mkdir()
    return other


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in os.environ:
        if name.startswith("ADEYE_") and name != "ADEYE_NUMBA_CACHE_DIR":
            monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("asset", CAMPAIGNS, ids=lambda path: path.stem)
def test_verbs_read_what_was_upgraded(
    asset: Path, folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = folder / "copy.db"
    path.write_bytes(gzip.decompress(asset.read_bytes()))
    assert main(["db", "upgrade", "--db", str(path)]) == 0
    before = results_of(path)
    run = a_run(path)
    told: dict[str, tuple[int, str]] = {}
    for verb in READING:
        words = [run if word == "RUN" else word for word in verb]
        capfd.readouterr()
        code = main([*words, "--db", str(path)])
        written = capfd.readouterr()
        told[" ".join(verb)] = code, written.out + written.err
    wrong = {
        verb: said
        for verb, said in told.items()
        if said[0] == 5 or "defect of adeye" in said[1] or not said[1]
    }
    assert wrong == {}
    assert {verb for verb, said in told.items() if said[0] != 0} <= NOT_HERE
    assert results_of(path) == before


@pytest.mark.parametrize(
    ("version", "remedy"),
    [("9999", "Use the newer release of adeye that wrote it"), ("0001", "Run 'adeye db upgrade'")],
)
def test_every_verb_refuses_a_database_of_another_schema(
    folder: Path, capfd: pytest.CaptureFixture[str], version: str, remedy: str
) -> None:
    path = copy_of(OLDEST, folder)
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
    if version == "9999":
        assert main(["db", "upgrade", "--db", str(path)]) == 5
        assert remedy in capfd.readouterr().err
    # The header of 100 bytes tells the journal mode, which opening sets.
    assert path.read_bytes()[100:] == content[100:]
