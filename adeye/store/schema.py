"""The version of a database: create, upgrade, and refuse what this version cannot read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from adeye.errors import InputError, PlatformError
from adeye.store.database import Database, create_parent, database_path
from adeye.store.scenario_view import ensure_scenario_views

if TYPE_CHECKING:
    from sqlalchemy import Connection

_HEAD: Final = "0005"
_FOLDER: Final = Path(__file__).parent / "migrations"


def head() -> str:
    """Return the version that this release reads and writes."""
    return _HEAD


def current(location: str | Path | None = None) -> str | None:
    """Return the version of a database, None if there is none yet.

    Raises:
        InputError: The location is not a file.
        PlatformError: The file cannot be read or is not a database.
    """
    path = database_path(location)
    if not path.exists():
        return None
    database = Database(path)
    try:
        with database.read() as connection:
            return read_version(connection)
    finally:
        database.close()


def upgrade(location: str | Path | None = None) -> str:
    """Create a database or bring it to the newest version, wholly or not at all.

    Returns:
        The version that it has now.

    Raises:
        InputError: The location is not a file.
        PlatformError: The file cannot be written, is not ours, or is newer than this release.
    """
    path = database_path(location)
    create_parent(path)
    database = Database(path)
    try:
        upgrade_database(database)
    finally:
        database.close()
    return _HEAD


def upgrade_database(database: Database) -> None:
    """Bring an open database to the newest version in one transaction."""
    with database.write() as connection:
        version = read_version(connection)
        if version == _HEAD:
            return
        if version is None:
            _refuse_foreign(connection, database.path)
        elif version not in known_versions():
            raise _newer(database.path, version)
        _migrate(connection)
        if version is not None:
            # These views are made of what the database holds, and v_runs has other columns now.
            ensure_scenario_views(connection)


def require_current(connection: Connection, path: Path) -> None:
    """Refuse a database of another version.

    Raises:
        PlatformError: It is older, newer or not ours.
    """
    version = read_version(connection)
    if version == _HEAD:
        return
    if version is None:
        raise PlatformError(f"database {path} was not made by adeye. Name another file with --db.")
    if version in known_versions():
        raise PlatformError(
            f"database {path} has schema {version}, this release needs {_HEAD}. "
            "Run 'adeye db upgrade'; keep a copy if older releases still use it."
        )
    raise _newer(path, version)


def require_exists(path: Path) -> None:
    """Refuse to read a database that is not there.

    Raises:
        InputError: There is no such file.
    """
    if not path.is_file():
        raise InputError(
            f"database {path}: no such file",
            remedy="Run a campaign first, or name the database with --db.",
        )


def read_version(connection: Connection) -> str | None:
    """Read the version that a database says it has."""
    known = connection.exec_driver_sql(
        "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'alembic_version'"
    ).first()
    if known is None:
        return None
    return connection.exec_driver_sql("SELECT version_num FROM alembic_version").scalar()


def known_versions() -> frozenset[str]:
    """Versions that this release can upgrade, with its own."""
    from alembic.script import ScriptDirectory

    return frozenset(script.revision for script in ScriptDirectory(_FOLDER).walk_revisions())


def _migrate(connection: Connection) -> None:
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(_FOLDER).replace("%", "%%"))
    config.attributes["connection"] = connection
    command.upgrade(config, "head")


def _refuse_foreign(connection: Connection, path: Path) -> None:
    if connection.exec_driver_sql("SELECT 1 FROM sqlite_master").first() is not None:
        raise PlatformError(
            f"database {path} holds tables that adeye did not make. Name another file with --db."
        )


def _newer(path: Path, version: str) -> PlatformError:
    return PlatformError(
        f"database {path} has schema {version}, which this release ({_HEAD}) does not know. "
        "Use the newer release of adeye that wrote it, or name another file with --db."
    )
