"""What a database says about itself: its tables and views, and how they are defined."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any, Final

from sqlalchemy import Boolean, Column, Connection, Float, Integer, Table, exists, select
from sqlalchemy.exc import DBAPIError

from adeye.store.postgres import FUNCTIONS, SCHEMA

LONGEST_NAME: Final = 63
"""Bytes of a name that PostgreSQL keeps; it cuts off the rest without an error."""

_TABLES: Final = {
    "sqlite": "SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name",
    "postgresql": "SELECT tablename FROM pg_tables "  # noqa: S608 - own names
    f"WHERE schemaname = '{SCHEMA}' ORDER BY tablename COLLATE \"C\"",
}
_COLUMNS: Final = {
    "sqlite": "SELECT name FROM pragma_table_info(?)",
    "postgresql": "SELECT column_name FROM information_schema.columns "  # noqa: S608 - own names
    f"WHERE table_schema = '{SCHEMA}' AND table_name = ? ORDER BY ordinal_position",
}
_VIEWS: Final = {
    "sqlite": "SELECT name, sql FROM sqlite_master WHERE type = 'view'",
    "postgresql": "SELECT c.relname, COALESCE(obj_description(c.oid), '') FROM pg_class c "  # noqa: S608 - own names
    f"WHERE c.relkind = 'v' AND c.relnamespace = '{SCHEMA}'::regnamespace",
}
_TRIGGERS: Final = {
    "sqlite": "SELECT name FROM sqlite_master WHERE type = 'trigger' ORDER BY name",
    "postgresql": "SELECT t.tgname FROM pg_trigger t JOIN pg_class c ON c.oid = t.tgrelid "  # noqa: S608 - own names
    f"WHERE NOT t.tgisinternal AND c.relnamespace = '{SCHEMA}'::regnamespace "
    f"UNION ALL SELECT rulename FROM pg_rules WHERE schemaname = '{SCHEMA}' "
    f"UNION ALL SELECT policyname FROM pg_policies WHERE schemaname = '{SCHEMA}' "
    f"UNION ALL SELECT proname FROM pg_proc WHERE pronamespace = '{SCHEMA}'::regnamespace "
    # An operator of ours would compare what views compare; a cast acts wherever it is.
    f"UNION ALL SELECT oprname FROM pg_operator WHERE oprnamespace = '{SCHEMA}'::regnamespace "
    f"UNION ALL SELECT opcname FROM pg_opclass WHERE opcnamespace = '{SCHEMA}'::regnamespace "
    f"UNION ALL SELECT collname FROM pg_collation WHERE collnamespace = '{SCHEMA}'::regnamespace "
    f"UNION ALL SELECT typname FROM pg_type WHERE typnamespace = '{SCHEMA}'::regnamespace "
    "AND typrelid = 0 AND typcategory <> 'A' "
    "UNION ALL SELECT 'cast to ' || casttarget::regtype FROM pg_cast WHERE oid >= 16384 "
    "AND castsource < 16384 AND casttarget < 16384 "
    "ORDER BY 1",
}
"""What acts when somebody writes or reads: of PostgreSQL rules, policies, functions, operators and
their like, too."""
_BUILT: Final = (
    "SELECT relname, CASE relkind WHEN 'r' THEN 'CREATE TABLE' ELSE 'CREATE INDEX' END "  # noqa: S608 - own names
    "FROM pg_class WHERE relkind IN ('r', 'i') "
    f"AND relnamespace = '{SCHEMA}'::regnamespace "
    f"UNION SELECT conname, '' FROM pg_constraint WHERE connamespace = '{SCHEMA}'::regnamespace"
)
"""Names, and how what makes one of the kind begins; constraints are made with their table."""
MISSING: Final = "is missing"
_OBJECTS: Final = {
    "sqlite": "SELECT 1 FROM sqlite_master",
    "postgresql": f"SELECT 1 FROM pg_class WHERE relnamespace = to_regnamespace('{SCHEMA}')",  # noqa: S608 - own names
}
_SIZE: Final = {
    "sqlite": "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size",
    "postgresql": "SELECT COALESCE(SUM(pg_total_relation_size(c.oid)), 0) FROM pg_class c "  # noqa: S608 - own names
    f"WHERE c.relkind = 'r' AND c.relnamespace = '{SCHEMA}'::regnamespace",
}


def is_server(connection: Connection) -> bool:
    """Tell whether a connection is to a PostgreSQL server."""
    return connection.dialect.name == "postgresql"


def is_empty(connection: Connection) -> bool:
    """Tell whether nothing is there, neither ours nor of somebody else."""
    return connection.exec_driver_sql(_OBJECTS[connection.dialect.name]).first() is None


def table_names(connection: Connection) -> list[str]:
    """List the tables in the order of their names."""
    found = connection.exec_driver_sql(_TABLES[connection.dialect.name])
    return [str(name) for name in found.scalars()]


def column_names(connection: Connection, table: str) -> list[str]:
    """List the columns of a table in their order."""
    found = connection.exec_driver_sql(_COLUMNS[connection.dialect.name], (table,))
    return [str(name) for name in found.scalars()]


def rows_among(
    connection: Connection, table: Table, columns: str, key: str, values: Iterable[str | int]
) -> Iterable[Any]:
    """Read columns of the rows of a table that have one of some values in a column."""
    value = "CAST(value AS INTEGER)" if isinstance(table.columns[key].type, Integer) else "value"
    return connection.exec_driver_sql(
        f"SELECT {columns} FROM {table.name} "  # noqa: S608 - own names
        f"WHERE {key} IN (SELECT {value} FROM json_each(?))",
        (json.dumps(list(values)),),
    )


def rows_of_runs(
    connection: Connection, table: Table, columns: str, numbers: Iterable[int]
) -> Iterable[Any]:
    """Read the number of the run, and columns, of the rows of a table that some runs have."""
    key = "number" if table.name == "run" else "run_number"
    return rows_among(connection, table, f"{key}, {columns}", key, numbers)


def size_bytes(connection: Connection) -> int:
    """Return how much the tables take on disk, with their indexes."""
    return int(connection.exec_driver_sql(_SIZE[connection.dialect.name]).scalar_one())


def mark(connection: Connection, statement: str) -> str:
    """Give what ``views`` tells of a view that a statement made."""
    if not is_server(connection):
        return statement
    # PostgreSQL keeps a view in words of its own, so that its comment tells what made it.
    return hashlib.sha256(statement.encode()).hexdigest()


def views(connection: Connection) -> dict[str, str]:
    """Tell by name what made each view, see ``mark``."""
    found = connection.exec_driver_sql(_VIEWS[connection.dialect.name])
    if is_server(connection):
        return {str(name): str(comment).partition(" ")[0] for name, comment in found}
    return {str(name): str(statement) for name, statement in found}


def create_view(connection: Connection, name: str, statement: str) -> None:
    """Make a view and note what made it."""
    connection.exec_driver_sql(statement)
    if is_server(connection):
        _note_view(connection, name, mark(connection, statement))


def note_views(connection: Connection) -> None:
    """Note with the views of a server how it keeps them, for users who may make none."""
    if is_server(connection):
        for name, told in views(connection).items():
            _note_view(connection, name, told)


def reword_views(connection: Connection, made: Mapping[str, str]) -> None:
    """Make views of a server anew that were put back from a copy, which words them otherwise.

    What was replaced by something else is left for the verification to find.

    Args:
        connection: In a transaction, of the owner.
        made: Statement that made each view, by name.
    """
    there = views(connection) if is_server(connection) else {}
    for name, statement in made.items():
        if name not in there:
            continue
        _, kept = _as_kept(connection, name)
        # Also what has the same words may be another thing to the server.
        if kept in list(_as_restored(connection, _query_of(statement))):
            connection.exec_driver_sql(
                statement.replace("CREATE VIEW", "CREATE OR REPLACE VIEW", 1)
            )
            _note_view(connection, name, mark(connection, statement))


def _note_view(connection: Connection, name: str, told: str) -> None:
    release, kept = _as_kept(connection, name)
    hashes = [_hash(text) for text in (kept, *_as_restored(connection, kept))]
    note = f"{told} {release}:{','.join(hashes)}"
    connection.exec_driver_sql(f"COMMENT ON VIEW {name} IS '{note}'")


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _as_kept(connection: Connection, view: str) -> tuple[str, str]:
    """Return a view as the server keeps it, after the release whose words these are."""
    release, text = connection.exec_driver_sql(
        "SELECT current_setting('server_version_num')::int / 10000, "
        f"pg_get_viewdef('{SCHEMA}.{view}'::regclass)"
    ).one()
    return str(release), str(text)


def _as_restored(connection: Connection, query: str) -> Iterator[str]:
    """Word a query as the server keeps it once it is put back from a copy, twice, and so on.

    What the server keeps says more than it was told, and again more when it is told that. None are
    given to a user who may make no view.
    """
    known = {query}
    with suppress(DBAPIError):
        while True:
            with connection.begin_nested() as passing:
                connection.exec_driver_sql(f"CREATE TEMP VIEW worded AS {query}")
                query = connection.exec_driver_sql(
                    "SELECT pg_get_viewdef('pg_temp.worded'::regclass)"
                ).scalar_one()
                passing.rollback()
            if query in known:
                return
            known.add(query)
            yield query


def altered(connection: Connection, expected: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Name what is gone or says something else, and what is wrong.

    Views, tables and indexes of other people may stand beside ours; their triggers may not. Of
    tables, indexes and constraints of a server only their names are compared.

    Args:
        connection: In a transaction.
        expected: Statement that made each table, index, trigger and view, by name.
    """
    given = dict(expected)
    if is_server(connection):
        given.update(FUNCTIONS)
        present = _server_definitions(connection, given)
    else:
        found = connection.exec_driver_sql("SELECT name, sql FROM sqlite_master WHERE sql > ''")
        present = {item.name: item.sql for item in found}
    for name, statement in given.items():
        if name not in present:
            yield name, MISSING
        elif present[name].split() != statement.split():
            yield name, "is not as this release makes it"
    for name in connection.exec_driver_sql(_TRIGGERS[connection.dialect.name]).scalars():
        if name not in given:
            yield str(name), "acts on what is written or read, and no release makes it"


def _server_definitions(connection: Connection, given: Mapping[str, str]) -> dict[str, str]:
    """Give of what a server has the statement that made it; anything else where it differs."""
    found: dict[str, str] = {}
    for name, text, enabled in connection.exec_driver_sql(
        "SELECT t.tgname, pg_get_triggerdef(t.oid, true), t.tgenabled FROM pg_trigger t "  # noqa: S608 - own names
        "JOIN pg_class c ON c.oid = t.tgrelid "
        f"WHERE NOT t.tgisinternal AND c.relnamespace = '{SCHEMA}'::regnamespace"
    ).all():
        same = text == " ".join(given.get(name, "").split()) and enabled in ("O", "A")
        found[name] = given[name] if same else ""
    for name, body, is_set in connection.exec_driver_sql(
        "SELECT proname, prosrc, proconfig IS NOT NULL OR prosecdef FROM pg_proc "  # noqa: S608 - own names
        f"WHERE pronamespace = '{SCHEMA}'::regnamespace"
    ).all():
        statement = given.get(name, "")
        # With a setting of its own, as of where names are looked up, it is another function.
        if is_set or f"$body${body}$body$" not in statement:
            found[name] = body
        else:
            # One of the same name for other types would be called in its place.
            found.setdefault(name, statement)
    for name, begins in connection.exec_driver_sql(_BUILT):
        own = given.get(name)
        # What has a name of ours and is of another kind stands where ours is missing.
        if own is not None and own[: len("CREATE TABLE")] == begins:
            found.setdefault(name, own)
    made = {name: text for name, text in given.items() if text.startswith("CREATE VIEW")}
    may_make = connection.exec_driver_sql(
        "SELECT has_database_privilege(current_database(), 'TEMPORARY') "
        "AND current_setting('transaction_read_only') = 'off'"
    ).scalar_one()
    same_views = _as_made_now if may_make else _as_noted
    for name, same in same_views(connection, made):
        found[name] = made[name] if same else ""
    return found


def _as_made_now(connection: Connection, made: Mapping[str, str]) -> Iterator[tuple[str, bool]]:
    """Tell of the views that are there whether each is what its statement makes just now."""
    there = views(connection)
    for name, statement in made.items():
        if name in there:
            _, kept = _as_kept(connection, name)
            yield name, kept in _as_restored(connection, _query_of(statement))


def _query_of(statement: str) -> str:
    """Return what follows CREATE VIEW name AS."""
    return statement.split(maxsplit=4)[4]


_NARROW: Final = (
    *(
        "from_collapse_limit TO 1",
        "join_collapse_limit TO 1",
        "max_parallel_workers_per_gather TO 0",
    ),
    *("enable_mergejoin TO off", "enable_hashjoin TO off", "enable_bitmapscan TO off"),
)
"""Fewer ways for the server to look at: the plans have to be the same, not good."""


def _as_noted(connection: Connection, made: Mapping[str, str]) -> Iterator[tuple[str, bool]]:
    """Tell the same to a user who may only read: each view against its note, and against its plan.

    Whoever replaces a view can replace what is noted with it. What the server makes of the view
    and of the statement that made it is the same plan, but for bounds of windows and of rows.
    """
    notes = {
        str(name): str(note) for name, note in connection.exec_driver_sql(_VIEWS["postgresql"])
    }
    passing = connection.begin_nested()
    for setting in _NARROW:
        connection.exec_driver_sql(f"SET LOCAL {setting}")
    for name, statement in made.items():
        if name not in notes:
            continue
        statement_hash, _, noted = notes[name].partition(" ")
        release, kept = _as_kept(connection, name)
        own, _, hashes = noted.partition(":")
        # Another release of the server may word the same view differently.
        is_worded_so = own not in {"", release} or _hash(kept) in hashes.split(",")
        is_noted = statement_hash == mark(connection, statement) and is_worded_so
        yield name, is_noted and _is_planned_alike(connection, name, statement)
    passing.rollback()


def _is_planned_alike(connection: Connection, view: str, statement: str) -> bool:
    """Tell whether a view has the columns and the plan of the statement that made it."""
    columns = connection.exec_driver_sql(
        "SELECT string_agg(quote_ident(attname), ', ' ORDER BY attname) FROM pg_attribute "  # noqa: S608 - own names
        f"WHERE attrelid = '{SCHEMA}.{view}'::regclass AND attnum > 0"
    ).scalar_one()
    query = _query_of(statement)
    try:
        with connection.begin_nested():
            plans = [
                connection.exec_driver_sql(
                    f"EXPLAIN (VERBOSE, COSTS OFF) SELECT {columns} FROM {source}"  # noqa: S608 - own names
                ).all()
                for source in (f"{SCHEMA}.{view}", f"({query}) AS {view}")
            ]
    except DBAPIError:
        # It has a column that the statement does not make.
        return False
    return plans[0] == plans[1]


@contextmanager
def readable(connection: Connection) -> Iterator[None]:
    """Let damaged text be read, which may not be UTF-8: it must be named, not end the reading."""
    if is_server(connection):
        yield
        return
    driver: Any = connection.connection.dbapi_connection
    normal = driver.text_factory
    driver.text_factory = lambda raw: raw.decode("utf-8", "surrogateescape")
    try:
        yield
    finally:
        driver.text_factory = normal


def damaged_pages(connection: Connection, tables: Iterable[Table] | None = None) -> Iterator[str]:
    """Say what is wrong with the file; a server looks after its own.

    Args:
        connection: In a transaction.
        tables: Those to look at, with their indexes; None for all of the file.
    """
    if is_server(connection):
        return
    for which in [""] if tables is None else [f"({table.name})" for table in tables]:
        for line in connection.exec_driver_sql(f"PRAGMA integrity_check{which}").scalars().all():
            if line != "ok":
                yield str(line)


def misplaced(connection: Connection, tables: Iterable[Table]) -> Iterator[tuple[str, str, str]]:
    """Name values of a type that their column never has: table, which row, and what is there.

    SQLite keeps any value in any column; a server looks after its own.
    """
    for table in () if is_server(connection) else tables:
        key = " || ' ' || ".join(table.primary_key.columns.keys())
        wrong = " ".join(
            f"WHEN typeof({column.name}) NOT IN ('null', '{_type_of(column)}') "
            f"THEN '{column.name} is ' || typeof({column.name})"
            for column in table.columns
        )
        for row, said in connection.exec_driver_sql(
            f"SELECT {key}, CASE {wrong} END AS wrong FROM {table.name} WHERE wrong <> ''"  # noqa: S608 - own names
        ):
            yield table.name, str(row), f"{said}, which its column never has"


def _type_of(column: Column[Any]) -> str:
    if isinstance(column.type, Float):
        return "real"
    return "integer" if isinstance(column.type, Integer | Boolean) else "text"


def dangling(connection: Connection, tables: Iterable[Table]) -> Iterator[tuple[str, str, str]]:
    """Name rows that refer to a row that is not there: table, which row, and the other table."""
    if not is_server(connection):
        for name, row, parent, _ in connection.exec_driver_sql("PRAGMA foreign_key_check").all():
            # Tables in the order of their key have no row numbers.
            yield name, "a row" if row is None else f"rowid {row}", parent
        return
    for table in tables:
        for key in table.foreign_key_constraints:
            parent = key.referred_table
            ours = [table.c[name] for name in key.column_keys]
            theirs = [element.column for element in key.elements]
            lost = select(*table.primary_key.columns).where(
                *(column.is_not(None) for column in ours),
                ~exists().where(*(a == b for a, b in zip(ours, theirs, strict=True))),
            )
            for row in connection.execute(lost).all():
                yield table.name, " ".join(str(value) for value in row), parent.name
