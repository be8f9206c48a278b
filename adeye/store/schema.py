"""The version of a database: create, upgrade, and refuse what this version cannot read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final

from sqlalchemy import Connection, Dialect, Table

from adeye.errors import InputError, PlatformError
from adeye.store import catalogue as catalog
from adeye.store import postgres
from adeye.store.catalogue import LONGEST_NAME
from adeye.store.database import Database, create_parent
from adeye.store.location import Location, Place, locate

# --- Triggers that keep results from being changed or deleted, per dialect ------------------------


def trigger_ddl(dialect: str = "sqlite") -> tuple[str, ...]:
    """Write the statements that create every trigger.

    Raises:
        KeyError: The dialect has no triggers written for it.
    """
    from adeye.store.tables import INSERT_ONLY

    return tuple(
        statement for table in INSERT_ONLY for statement in insert_only_ddl(table.name, dialect)
    )


def insert_only_ddl(table: str, dialect: str = "sqlite") -> tuple[str, ...]:
    """Write the statements that make one table insert-only; its name is an identifier."""
    if dialect == "sqlite":
        return tuple(
            f"CREATE TRIGGER {table}_no_{action.lower()} BEFORE {action} ON {table}\n"
            f"BEGIN SELECT RAISE(ABORT, '{table} is insert-only'); END"
            for action in ("UPDATE", "DELETE")
        )
    if dialect != "postgresql":
        raise KeyError(dialect)
    # Cut as the server would cut it, so that a trigger is found by its name.
    return tuple(
        f"CREATE TRIGGER {f'{table}_no_{action.lower()}'[:LONGEST_NAME]} "
        f"BEFORE {action} ON {table}\n"
        f"FOR EACH {each} EXECUTE FUNCTION insert_only()"
        for action, each in (("UPDATE", "ROW"), ("DELETE", "ROW"), ("TRUNCATE", "STATEMENT"))
    )


# --- The version of a database: create, upgrade, and refuse what this version cannot read ---------

_HEAD: Final = "0017"
_DEVELOPMENT: Final = frozenset(f"{number:04}" for number in range(1, int(_HEAD)))
"""Schemas from before the first release, which nothing upgrades."""
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
    with closing(Database(location)) as database, database.read() as connection:
        return read_version(connection)


def upgrade(place: Place = None) -> str:
    """Create a database or bring it to the newest version, wholly or not at all.

    Views of a server that were put back from a copy get their words again, which users who may only
    read compare them by.

    Returns:
        The version that it has now.

    Raises:
        InputError: The location is not supported.
        PlatformError: The file cannot be written, is not ours, or is newer than this release.
    """
    from adeye.store.views import scenario_views, view_ddl

    location = locate(place)
    create_parent(location)
    with closing(Database(location)) as database:
        upgrade_database(database)
        with database.write() as connection:
            catalog.reword_views(connection, {**view_ddl(), **scenario_views(connection)})
    return _HEAD


def upgrade_database(database: Database) -> None:
    """Bring an open database to the newest version in one transaction."""
    with database.write() as connection:
        version = read_version(connection)
        if version == _HEAD:
            return
        if version is None:
            if not catalog.is_empty(connection):
                raise PlatformError(
                    f"database {database.location} holds tables that adeye did not make. "
                    "Name another file with --db."
                )
            _create(connection)
        elif version not in known_versions():
            raise _unknown(database.location, version)
        _migrate(connection, is_new=version is None)
        if version is not None:
            catalog.note_views(connection)


def require_current(connection: Connection, location: Location) -> None:
    """Refuse a database of another version.

    Raises:
        PlatformError: It is older, newer or not ours.
    """
    version = read_version(connection)
    if version == _HEAD:
        return
    if version is None and catalog.is_empty(connection):
        raise PlatformError(
            f"database {location} was not made by adeye: it holds nothing. Name another file with "
            "--db; a copy needs what ends in -wal beside the original, too (db copy takes it)"
        )
    if version is None:
        raise PlatformError(
            f"database {location} was not made by adeye. Name another file with --db."
        )
    if version in known_versions():
        raise PlatformError(
            f"database {location} has schema {version}, this release needs {_HEAD}. "
            "Run 'adeye db upgrade'; keep a copy if older releases still use it."
        )
    raise _unknown(location, version)


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


@contextmanager
def opened(place: Place, *, is_read_only: bool = False) -> Iterator[Connection]:
    """Read one state of a database of this release, which is closed at the end.

    Args:
        place: The database, as everywhere.
        is_read_only: Whether it is somebody else's: nothing in it is executed.

    Raises:
        InputError: There is no such database.
        PlatformError: It cannot be read, is not ours, or has another schema version.
    """
    location = locate(place)
    require_exists(location)
    with (
        closing(Database(location, is_read_only=is_read_only)) as database,
        database.read() as connection,
    ):
        require_current(connection, location)
        yield connection


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


_STATEMENTS: Final[dict[object, tuple[tuple[str, str], ...]]] = {}
"""By what their words depend on: each database that is opened is compared with them."""


def statements(dialect: Dialect) -> tuple[tuple[str, str], ...]:
    """Give name and statement of all that a database has, in the order of dependencies."""
    known = dialect.name, dialect.server_version_info
    if known not in _STATEMENTS:
        _STATEMENTS[known] = tuple(_statements(dialect))
    return _STATEMENTS[known]


def _statements(dialect: Dialect) -> Iterator[tuple[str, str]]:
    from sqlalchemy.schema import CreateIndex

    from adeye.store.tables import metadata
    from adeye.store.views import view_ddl

    is_server = dialect.name == "postgresql"
    if is_server:
        yield from postgres.FUNCTIONS.items()
    for table in metadata.sorted_tables:
        yield table.name, created(table, dialect)
        for index in sorted(table.indexes, key=lambda item: str(item.name)):
            yield str(index.name), str(CreateIndex(index).compile(dialect=dialect)).strip()
    for statement in trigger_ddl(dialect.name):
        yield statement.split(maxsplit=3)[2], statement
    yield from view_ddl().items()


def created(table: Table, dialect: Dialect) -> str:
    """Write the statement that creates a table."""
    from sqlalchemy.schema import CreateTable

    return str(CreateTable(table).compile(dialect=dialect)).strip()


def made(dialect: Dialect) -> dict[str, str]:
    """Give all of ``statements`` by name, and of a server its constraints, which are in them."""
    from adeye.store.tables import metadata

    rules = (rule for table in metadata.tables.values() for rule in table.constraints)
    written = dialect.identifier_preparer.format_constraint
    names = {str(written(rule)): "" for rule in rules if dialect.name == "postgresql"}
    return {**names, **dict(statements(dialect))}


def _create(connection: Connection) -> None:
    if catalog.is_server(connection):
        connection.exec_driver_sql(f"CREATE SCHEMA IF NOT EXISTS {postgres.SCHEMA}")
    for name, statement in statements(connection.dialect):
        if statement.startswith("CREATE VIEW"):
            catalog.create_view(connection, name, statement)
        else:
            connection.exec_driver_sql(statement)


def _migrate(connection: Connection, *, is_new: bool) -> None:
    """Bring a database of an earlier version to the newest; a new one is the newest."""
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(_FOLDER).replace("%", "%%"))
    config.attributes["connection"] = connection
    if is_new:
        command.stamp(config, "head")
    else:
        command.upgrade(config, "head")


def _unknown(location: Location, version: str) -> PlatformError:
    if version in _DEVELOPMENT:
        return PlatformError(
            f"database {location} has schema {version}, of a version from before the first "
            "release, which no release reads. Execute its campaigns again into another file, or "
            "read it with the version that wrote it."
        )
    return PlatformError(
        f"database {location} has schema {version}, which this release ({_HEAD}) does not know. "
        "Use the newer release of adeye that wrote it, or name another file with --db."
    )
