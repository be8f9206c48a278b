"""The version of a database: create, upgrade, and refuse what this version cannot read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from adeye.errors import InputError, PlatformError
from adeye.store import catalog, postgres
from adeye.store.accounts import account_all
from adeye.store.balance import open_ledger
from adeye.store.database import Database, create_parent
from adeye.store.location import Location, Place, locate
from adeye.store.scenario_view import ensure_scenario_views

if TYPE_CHECKING:
    from sqlalchemy import Connection

_HEAD: Final = "0007"
_FIRST_OF_SERVERS: Final = "0005"
"""Before it there was SQLite only: its migration makes everything on a server."""
_FIRST_WITH_LEDGER: Final = "0005"
_FOLDER: Final = Path(__file__).parent / "migrations"


def head() -> str:
    """Return the version that this release reads and writes."""
    return _HEAD


def current(place: Place = None) -> str | None:
    """Return the version of a database, None if there is none yet.

    Raises:
        InputError: The location is not supported.
        PlatformError: It cannot be read or is not a database.
    """
    location = locate(place)
    if location.path is not None and not location.path.exists():
        return None
    database = Database(location)
    try:
        with database.read() as connection:
            return read_version(connection)
    finally:
        database.close()


def upgrade(place: Place = None) -> str:
    """Create a database or bring it to the newest version, wholly or not at all.

    Returns:
        The version that it has now.

    Raises:
        InputError: The location is not supported.
        PlatformError: The file cannot be written, is not ours, or is newer than this release.
    """
    location = locate(place)
    create_parent(location)
    database = Database(location)
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
            _refuse_foreign(connection, database.location)
        elif version not in known_versions():
            raise _newer(database.location, version)
        _migrate(connection)
        catalog.note_views(connection)
        if version is not None:
            # These views are made of what the database holds, and v_runs has other columns now.
            ensure_scenario_views(connection)
            account_all(connection)
        if version is not None and version < _FIRST_WITH_LEDGER:
            open_ledger(connection)


def require_current(connection: Connection, location: Location) -> None:
    """Refuse a database of another version.

    Raises:
        PlatformError: It is older, newer or not ours.
    """
    version = read_version(connection)
    if version == _HEAD:
        return
    if version is None:
        raise PlatformError(
            f"database {location} was not made by adeye. Name another file with --db."
        )
    if version in known_versions():
        raise PlatformError(
            f"database {location} has schema {version}, this release needs {_HEAD}. "
            "Run 'adeye db upgrade'; keep a copy if older releases still use it."
        )
    raise _newer(location, version)


def require_exists(location: Location) -> None:
    """Refuse to read a database that is not there.

    Raises:
        InputError: There is no such file.
    """
    if location.path is not None and not location.path.is_file():
        raise InputError(
            f"database {location}: no such file",
            remedy="Run a campaign first, or name the database with --db.",
        )


def read_version(connection: Connection) -> str | None:
    """Read the version that a database says it has.

    Raises:
        PlatformError: This user has no right to read it.
    """
    if catalog.is_server(connection):
        postgres.require_readable(connection, Location(connection.engine.url, None))
    if "alembic_version" not in catalog.table_names(connection):
        return None
    return connection.exec_driver_sql("SELECT version_num FROM alembic_version").scalar()


def known_versions() -> frozenset[str]:
    """Versions that this release can upgrade, with its own."""
    from alembic.script import ScriptDirectory

    return frozenset(script.revision for script in ScriptDirectory(_FOLDER).walk_revisions())


def _migrate(connection: Connection) -> None:
    from alembic import command
    from alembic.config import Config
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", str(_FOLDER).replace("%", "%%"))
    config.attributes["connection"] = connection
    if catalog.is_server(connection) and read_version(connection) is None:
        connection.exec_driver_sql(f"CREATE SCHEMA IF NOT EXISTS {postgres.SCHEMA}")
        before = ScriptDirectory.from_config(config).get_revision(_FIRST_OF_SERVERS).down_revision
        command.stamp(config, str(before))
    command.upgrade(config, "head")


def _refuse_foreign(connection: Connection, location: Location) -> None:
    if not catalog.is_empty(connection):
        raise PlatformError(
            f"database {location} holds tables that adeye did not make. "
            "Name another file with --db."
        )


def _newer(location: Location, version: str) -> PlatformError:
    return PlatformError(
        f"database {location} has schema {version}, which this release ({_HEAD}) does not know. "
        "Use the newer release of adeye that wrote it, or name another file with --db."
    )
