"""From values to rows: normalisation by column type, row hashes, bulk inserts.

Statements go to the driver with tuples of values; on wide rows that is four times as fast as
parameters by name.
"""

from __future__ import annotations

import hashlib
import json
import math
from datetime import UTC, datetime
from functools import cache
from itertools import repeat
from typing import TYPE_CHECKING, Any

from sqlalchemy import Boolean, Float, Integer, Table
from sqlalchemy.dialects import sqlite

from adeye.store import postgres
from adeye.store.catalog import is_server

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from sqlalchemy import Connection

Row = tuple[Any, ...]

CHUNK = 500
"""Values bound in one IN list, below the variable limit of every supported SQLite."""


def clean_text(text: str) -> str:
    r"""Escape what a database cannot keep: lone surrogates and NUL.

    >>> clean_text("a\x00b")
    'a\\x00b'
    """
    return text.encode("utf-8", "backslashreplace").decode("utf-8").replace("\x00", "\\x00")


def json_text(value: Any) -> str:
    """Write JSON with sorted keys; refuse NaN and infinity.

    Raises:
        ValueError: A number is not finite.
    """
    return clean_text(
        json.dumps(
            value, ensure_ascii=False, sort_keys=True, separators=(",", ":"), allow_nan=False
        )
    )


def utc_text(moment: datetime | None) -> str:
    """Write a time of day as UTC in ISO 8601, or now if there is none."""
    moment = datetime.now(UTC) if moment is None else moment
    return moment.astimezone(UTC).isoformat(timespec="milliseconds")


def _float(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        msg = f"{number} cannot be stored; use NULL and a status"
        raise ValueError(msg)
    # SQLite stores -0.0 as 0.
    return number + 0.0


def _text(value: Any) -> str:
    if not isinstance(value, str):
        msg = f"{value!r} is not text"
        raise TypeError(msg)
    return clean_text(value)


def _integer(value: Any) -> int:
    number = int(value)
    if number != value:
        msg = f"{value!r} is not a whole number"
        raise ValueError(msg)
    return number


@cache
def _converters(table: Table) -> tuple[Callable[[Any], Any], ...]:
    converters: list[Callable[[Any], Any]] = []
    for column in table.columns:
        if column.name == "row_hash":
            continue
        if isinstance(column.type, Float):
            converters.append(_float)
        elif isinstance(column.type, Integer | Boolean):
            converters.append(_integer)
        else:
            converters.append(_text)
    return tuple(converters)


def row_hash(table: Table, values: Sequence[Any]) -> str:
    """Hash a stored row of a plan without its hash column: 128 bits of sha256 in hex.

    It tells an altered row from the one that was written; whoever alters it on purpose can also
    write a matching hash.

    Raises:
        TypeError: A value has a type that is never written.
    """
    return _hashed(table.name + "".join(map(_tagged, values)))


def _hashed(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:32]


def _tagged(value: Any) -> str:
    """Write a value with its type behind a NUL, which no stored text has."""
    if value is None:
        return "\0n"
    if isinstance(value, str):
        return f"\0t{value}"
    if isinstance(value, int):
        return f"\0i{int(value)}"
    if isinstance(value, float):
        return f"\0f{value!r}"
    msg = f"{value!r} is not what was written"
    raise TypeError(msg)


def rows_of_columns(table: Table, columns: Sequence[Any]) -> list[Row]:
    """Make many rows in the order of the table's columns, with their hashes at the end.

    Args:
        table: A table whose last column is ``row_hash``.
        columns: Values of all other columns. A list or a range has one value for each row, of
            the column's type and clean, none of them None; anything else is the value of all rows.

    Returns:
        As many rows as the lists have values.

    Raises:
        ValueError: The lists differ in length.
    """
    tags: dict[Callable[[Any], Any], str] = {_float: "\0f%r", _integer: "\0i%d", _text: "\0t%s"}
    template = table.name
    varied: list[Sequence[Any]] = []
    filled: list[Iterable[Any]] = []
    for convert, column in zip(_converters(table), columns, strict=True):
        if isinstance(column, list | range):
            template += tags[convert]
            varied.append(column)
            filled.append(column)
        else:
            value = None if column is None else convert(column)
            template += _tagged(value).replace("%", "%%")
            filled.append(repeat(value))
    sha256 = hashlib.sha256
    hashes = [
        sha256((template % values).encode()).hexdigest()[:32]
        for values in zip(*varied, strict=True)
    ]
    return list(zip(*filled, hashes, strict=False))


def row(table: Table, values: Sequence[Any]) -> Row:
    """Make a row in the order of the table's columns, with its hash at the end.

    Args:
        table: A table whose last column is ``row_hash``.
        values: Values of all other columns.

    Raises:
        ValueError: A number is not finite, or the count of values is wrong.
        TypeError: A text column gets something else.
    """
    converted = [
        None if value is None else convert(value)
        for convert, value in zip(_converters(table), values, strict=True)
    ]
    return (*converted, row_hash(table, converted))


@cache
def _insert_statement(table: Table, *, ignore_existing: bool) -> str:

    statement = sqlite.insert(table)
    if ignore_existing:
        statement = statement.on_conflict_do_nothing()
    return str(statement.compile(dialect=sqlite.dialect()))


def insert_rows(
    connection: Connection, table: Table, rows: Iterable[Row], *, ignore_existing: bool = False
) -> None:
    """Insert rows that have a value for every column, in the order of the columns."""
    batch = list(rows)
    if is_server(connection):
        postgres.insert_rows(connection, table, batch, ignore_existing=ignore_existing)
    elif batch:
        connection.exec_driver_sql(_insert_statement(table, ignore_existing=ignore_existing), batch)


def chunks(values: Sequence[str]) -> Iterable[Sequence[str]]:
    """Cut a sequence into pieces that fit into one IN list."""
    for start in range(0, len(values), CHUNK):
        yield values[start : start + CHUNK]
