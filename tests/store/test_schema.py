import multiprocessing
import shutil
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import create_engine

from adeye.errors import InputError, PlatformError
from adeye.store import schema
from adeye.store.repository import Repository
from adeye.store.tables import metadata
from adeye.store.triggers import trigger_ddl
from adeye.store.views import view_ddl

ASSETS = sorted((Path(__file__).parents[1] / "db_assets").glob("*.db"))
# Recorded when each file was made, by Example.campaign (from 0002 on with Example.fork, from 0003
# on with Example.hindsight, from 0004 on with Example.halved, from 0005 on with a certificate): its
# campaign and its result hash. 0006 and 0007 are 0005, upgraded.
ASSET_RESULTS = {
    "v0001.db": (
        "b18b5e195097d12b46f7598a25e646bd",
        "51681dc6f1d48433ea1de69fa8a855cb63e382936708ee4febb8dd397eb4e8b9",
    ),
    "v0002.db": (
        "b18b5e195097d12b46f7598a25e646bd",
        "51681dc6f1d48433ea1de69fa8a855cb63e382936708ee4febb8dd397eb4e8b9",
    ),
    "v0003.db": (
        "b18b5e195097d12b46f7598a25e646bd",
        "51681dc6f1d48433ea1de69fa8a855cb63e382936708ee4febb8dd397eb4e8b9",
    ),
    "v0004.db": (
        "b18b5e195097d12b46f7598a25e646bd",
        "51681dc6f1d48433ea1de69fa8a855cb63e382936708ee4febb8dd397eb4e8b9",
    ),
    "v0005.db": (
        "b18b5e195097d12b46f7598a25e646bd",
        "51681dc6f1d48433ea1de69fa8a855cb63e382936708ee4febb8dd397eb4e8b9",
    ),
    "v0006.db": (
        "b18b5e195097d12b46f7598a25e646bd",
        "51681dc6f1d48433ea1de69fa8a855cb63e382936708ee4febb8dd397eb4e8b9",
    ),
    "v0007.db": (
        "b18b5e195097d12b46f7598a25e646bd",
        "51681dc6f1d48433ea1de69fa8a855cb63e382936708ee4febb8dd397eb4e8b9",
    ),
}


def ddl(path: Path) -> dict[str, str]:
    connection = sqlite3.connect(path)
    found = connection.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL")
    statements = {name: " ".join(sql.split()) for name, sql in found}
    connection.close()
    statements.pop("alembic_version", None)
    return statements


def test_migrated_database_is_the_one_that_the_code_describes(tmp_path: Path) -> None:
    schema.upgrade(tmp_path / "migrated.db")
    engine = create_engine(f"sqlite:///{tmp_path / 'described.db'}")
    metadata.create_all(engine)
    with engine.begin() as connection:
        for statement in (*trigger_ddl(), *view_ddl().values()):
            connection.exec_driver_sql(statement)
    engine.dispose()
    assert ddl(tmp_path / "migrated.db") == ddl(tmp_path / "described.db")


def test_no_migration_is_missing(tmp_path: Path) -> None:
    schema.upgrade(tmp_path / "a.db")
    engine = create_engine(f"sqlite:///{tmp_path / 'a.db'}")
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, metadata) == []
    engine.dispose()


def test_head_is_that_of_the_migrations() -> None:
    scripts = ScriptDirectory(Path(schema.__file__).parent / "migrations")
    assert scripts.get_current_head() == schema.head()
    assert schema.head() in schema.known_versions()


def test_upgrade_of_the_newest_version_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "er" / "a.db"
    assert schema.current(path) is None
    assert schema.upgrade(path) == schema.head() == schema.current(path)
    before = path.read_bytes()
    assert schema.upgrade(path) == schema.head()
    assert path.read_bytes() == before


def test_newer_database_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    schema.upgrade(path)
    set_version(path, "9999")
    for action in (schema.upgrade, Repository.open):
        with pytest.raises(PlatformError, match=r"9999.*Use the newer release"):
            action(path)
    assert schema.current(path) == "9999"


def test_older_database_is_refused_until_it_is_upgraded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.db"
    schema.upgrade(path)
    monkeypatch.setattr(schema, "_HEAD", "0099")
    with pytest.raises(PlatformError, match="'adeye db upgrade'"):
        Repository.open(path)


def test_older_database_is_upgraded_by_its_migrations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.db"
    schema.upgrade(path)
    migrated: list[Any] = []
    monkeypatch.setattr(schema, "_HEAD", "0099")
    monkeypatch.setattr(schema, "_migrate", migrated.append)
    schema.upgrade(path)
    assert len(migrated) == 1


def test_database_of_someone_else_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE theirs (x)")
    connection.close()
    with pytest.raises(PlatformError, match="did not make"):
        schema.upgrade(path)
    with pytest.raises(PlatformError, match="did not make"):
        Repository.open(path)
    assert set(ddl(path)) == {"theirs"}


def test_foreign_database_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    path.touch()
    with pytest.raises(PlatformError, match="not made by adeye"):
        Repository.open(path, create=False)


def test_missing_database_is_an_input_error_for_readers(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no such file.*Run a campaign"):
        Repository.open(tmp_path / "a.db", create=False)
    assert list(tmp_path.iterdir()) == []


def test_migration_that_fails_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.db"
    whole = schema._migrate

    def fail_after(connection: Any) -> None:
        whole(connection)
        raise RuntimeError("power cut")

    monkeypatch.setattr(schema, "_migrate", fail_after)
    with pytest.raises(RuntimeError, match="power cut"):
        schema.upgrade(path)
    assert ddl(path) == {}
    monkeypatch.undo()
    assert schema.upgrade(path) == schema.head()


def open_and_close(path: Path, failures: "multiprocessing.Queue[str]") -> None:
    try:
        Repository.open(path).close()
    except Exception as error:  # noqa: BLE001 - reported by the parent
        failures.put(repr(error))


def test_many_first_users_make_one_database(tmp_path: Path) -> None:
    context = multiprocessing.get_context("fork")
    failures: multiprocessing.Queue[str] = context.Queue()
    processes = [
        context.Process(target=open_and_close, args=(tmp_path / "a.db", failures)) for _ in range(6)
    ]
    for process in processes:
        process.start()
    for process in processes:
        process.join(60)
    assert failures.empty()
    assert [process.exitcode for process in processes] == [0] * 6


@pytest.mark.parametrize("asset", ASSETS, ids=lambda path: path.stem)
def test_database_of_every_past_schema_upgrades_with_its_results(
    asset: Path, tmp_path: Path
) -> None:
    path = tmp_path / "copy.db"
    shutil.copyfile(asset, path)
    campaign, results = ASSET_RESULTS[asset.name]
    assert schema.current(path) == asset.stem.removeprefix("v")
    assert schema.upgrade(path) == schema.head()
    with Repository.open(path) as repository:
        assert repository.verify() == ()
        assert repository.result_table_hash(campaign) == results
        assert repository.progress(campaign).accounted == 8


@pytest.mark.parametrize("asset", ASSETS, ids=lambda path: path.stem)
def test_runs_of_an_older_schema_lack_the_metrics_that_came_later(
    asset: Path, tmp_path: Path
) -> None:
    path = tmp_path / "copy.db"
    shutil.copyfile(asset, path)
    schema.upgrade(path)
    is_new = asset.stem >= "v0003"
    with Repository.open(path) as repository:
        campaign = ASSET_RESULTS[asset.name][0]
        figures = repository.figures(campaign)
        assert len(figures) == 8
        assert np.isnan(figures.metrics["trips"]).all()
        stored = repository.run_row(repository.find_run("0", campaign=campaign).result_digest)
        assert stored is not None
        assert ("trips" in stored.metrics) is is_new
    connection = sqlite3.connect(path)
    for view in ("v_runs", "v_runs_cut_in"):
        found = connection.execute(f"SELECT DISTINCT trips_status IS NULL FROM {view}").fetchall()  # noqa: S608
        assert found == [(0 if is_new else 1,)]
    connection.close()


def test_every_schema_has_its_database() -> None:
    assert {asset.stem.removeprefix("v") for asset in ASSETS} == schema.known_versions()


def set_version(path: Path, version: str) -> None:
    connection = sqlite3.connect(path)
    connection.execute("UPDATE alembic_version SET version_num = ?", (version,))
    connection.commit()
    connection.close()
