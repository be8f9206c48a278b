"""From values to rows: normalisation by column type, row hashes, bulk inserts.

Statements go to the driver with tuples of values; on wide rows that is four times as fast as
parameters by name.

The hash of a row is made of 64-bit words, so that thousands of rows are hashed at
once: one word for a number or a truth value, two for a text (a BLAKE2b of 128 bits). It is the
hash of the tables of results, ``tables.RESULTS``, and of the metrics of plug-ins; the tables of
plans have that of ``encoding.row_hash``. Both tell an altered row from the one that was written;
whoever alters it on purpose can also write a matching hash.

A digest falls anywhere into an index; with a number, the rows of a block lie one after the other.

A digest falls anywhere into an index, so that an insert touches a page of its own. A larger cache
keeps these pages; an index that gets more entries than it had is cheaper built again at the end.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import count, islice, repeat
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Boolean, Connection, Float, Integer, Table
from sqlalchemy.dialects import sqlite

from adeye.errors import IntegrityError
from adeye.signals import Ints
from adeye.store import postgres
from adeye.store.catalogue import is_server
from adeye.store.texts import clean_text

# --- From values to rows: normalisation by column type, row hashes, bulk inserts ------------------

Row = tuple[Any, ...]

_MANY: Final = 10_000
"""Rows that are read at a time."""
_NUMBERS = count()
"""Cursors of a server have names."""
CHUNK = 500
"""Values bound in one IN list, below the variable limit of every supported SQLite."""


def _float(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{number} cannot be stored; use NULL and a status")
    # SQLite stores -0.0 as 0.
    return number + 0.0


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is not text")
    return clean_text(value)


def _integer(value: Any) -> int:
    number = int(value)
    if number != value:
        raise ValueError(f"{value!r} is not a whole number")
    return number


@cache
def _kinds(table: Table) -> tuple[str, ...]:
    """Tell of each column but the hash whether it has numbers, whole numbers or texts."""
    return tuple(
        "f"
        if isinstance(column.type, Float)
        else "i"
        if isinstance(column.type, Integer | Boolean)
        else "t"
        for column in list(table.columns)[:-1]
    )


_CONVERTERS: Final[Mapping[str, Callable[[Any], Any]]] = {"f": _float, "i": _integer, "t": _text}


def stored_hashes(table: Table, rows: Sequence[Row]) -> list[str]:
    """Hash stored rows of a plan as ``row_hash`` does, many together.

    Args:
        table: An insert-only table that is not written a block at a time.
        rows: All of their columns, of which the hash is left out.

    Raises:
        TypeError: A value has a type that is never written.
    """
    template, varied = [table.name], list[Sequence[Any]]()
    for column in list(zip(*rows, strict=True))[:-1]:
        (kind, *others) = set(map(type, column))
        if others or kind not in _TAGS:
            return [row_hash(table, values[:-1]) for values in rows]
        template.append(_TAGS[kind])
        if kind is not type(None):
            varied.append(column)
    if not varied:
        return [row_hash(table, values[:-1]) for values in rows]
    written = map("".join(template).__mod__, zip(*varied, strict=True))
    sha256 = hashlib.sha256
    return [sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:32] for text in written]


def row_hash(table: Table, values: Sequence[Any]) -> str:
    """Hash a stored row of a plan without its hash column: 128 bits of sha256 in hex.

    It tells an altered row from the one that was written; whoever alters it on purpose can also
    write a matching hash.

    Raises:
        TypeError: A value has a type that is never written.
    """
    text = table.name + "".join(map(_tagged, values))
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
    raise TypeError(f"{value!r} is not what was written")


_TAGS: Final = {type(None): "\0n", str: "\0t%s", int: "\0i%d", float: "\0f%r"}
"""How ``_tagged`` writes values of a type."""


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
    tags = {"f": "\0f%r", "i": "\0i%d", "t": "\0t%s"}
    template = table.name
    varied: list[Sequence[Any]] = []
    filled: list[Iterable[Any]] = []
    for kind, column in zip(_kinds(table), columns, strict=True):
        if isinstance(column, list | range):
            template += tags[kind]
            varied.append(column)
            filled.append(column)
        else:
            value = None if column is None else _CONVERTERS[kind](column)
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
        None if value is None else _CONVERTERS[kind](value)
        for kind, value in zip(_kinds(table), values, strict=True)
    ]
    return (*converted, row_hash(table, converted))


@cache
def _insert_statement(table: Table) -> str:
    return str(sqlite.insert(table).compile(dialect=sqlite.dialect()))


def driver_insert(connection: Connection, table: Table, rows: Sequence[Row]) -> None:
    """Insert rows that have a value for every column, without a word in the ledger.

    ``ledger.insert_rows`` is what evidence enters by.

    Raises:
        IntegrityError: The database took other rows than that, without an error.
    """
    if not rows:
        return
    if is_server(connection):
        taken = postgres.insert_rows(connection, table, rows)
    else:
        taken = connection.exec_driver_sql(_insert_statement(table), rows).rowcount
    if taken != len(rows):
        raise IntegrityError(
            f"the database kept {taken:,} of {len(rows):,} rows of table {table.name}: something "
            "in it, such as a trigger, acts on what is written. Nothing was changed. See 'adeye db "
            "verify'."
        )


def stored_rows(
    connection: Connection, table: Table, condition: str = "", values: tuple[Any, ...] = ()
) -> Iterator[Row]:
    """Read rows with all of their columns as they are stored, in the order of their key.

    Args:
        connection: In a transaction.
        table: The table.
        condition: Of the rows, in SQL; empty for all.
        values: What its parameters stand for.
    """
    names = ", ".join(table.columns.keys())
    key = ", ".join(column.name for column in table.primary_key.columns)
    where = condition and f" WHERE {condition}"
    found = connection.exec_driver_sql(
        f"SELECT {names} FROM {table.name}{where} ORDER BY {key}",  # noqa: S608 - own names
        values,
        execution_options={"yield_per": CHUNK},
    )
    for part in found.partitions(CHUNK):
        yield from map(tuple, part)


def read_chunks(
    connection: Connection, query: str, *values: str | int, size: int = _MANY
) -> Iterator[list[tuple[Any, ...]]]:
    """Read the rows of a query, many at a time.

    Args:
        connection: In a transaction.
        query: With question marks for parameters.
        values: What they stand for.
        size: How many at a time.
    """
    # The cursor of the driver: a row object of SQLAlchemy costs more than the row.
    cursor: Any
    if is_server(connection):
        if not connection.in_transaction():
            # The driver would begin one of its own, which sees other states as it goes on.
            connection.begin()
        driver: Any = connection.connection.dbapi_connection
        cursor = driver.cursor(name=f"chunks_{next(_NUMBERS)}")
        cursor.execute(postgres.translated(query), values)
    else:
        cursor = connection.exec_driver_sql(query, values).cursor
    try:
        while chunk := cursor.fetchmany(size):
            yield chunk
    finally:
        cursor.close()


def chunked(rows: Iterable[Row], size: int = CHUNK) -> Iterator[list[Row]]:
    """Cut rows into pieces that are looked at together."""
    waiting = iter(rows)
    while chunk := list(islice(waiting, size)):
        yield chunk


# --- Columns on their way to the database: rows of a table for a whole block, with their hashes ---

Words: TypeAlias = "NDArray[np.uint64]"
Column: TypeAlias = "NDArray[Any] | Texts"

_NULL_NUMBER: Final = np.float64("nan").view(np.uint64)
_NULL_TEXT: Final = b"\x00"
"""No text of a database has a NUL, so that none is hashed like NULL."""


class Dictionary:
    """Texts that a column refers to by number; None is NULL."""

    def __init__(self, words: Sequence[str | None], *, is_clean: bool = False) -> None:
        """Keep the words.

        Args:
            words: Texts; NUL and lone surrogates are escaped.
            is_clean: Whether they cannot have any, as digests cannot.
        """
        self.words: tuple[str | None, ...] = tuple(
            words if is_clean else (word if word is None else clean_text(word) for word in words)
        )

    def __getstate__(self) -> tuple[str | None, ...]:
        return self.words

    def __setstate__(self, words: tuple[str | None, ...]) -> None:
        self.words = words

    @cached_property
    def objects(self) -> NDArray[Any]:
        """The words as an array of objects."""
        found = np.empty(len(self.words), dtype=object)
        found[:] = self.words
        return found

    @cached_property
    def hashes(self) -> NDArray[np.uint64]:
        """(W, 2) words of their hashes."""
        blake2b = hashlib.blake2b
        joined = b"".join(
            [
                blake2b(
                    _NULL_TEXT if word is None else word.encode("utf-8", "surrogatepass"),
                    digest_size=16,
                ).digest()
                for word in self.words
            ]
        )
        return np.frombuffer(joined, dtype="<u8").reshape(-1, 2)


@dataclass(frozen=True)
class Texts:
    """A column of text.

    Attributes:
        codes: (R,) index into the dictionary; -1 is its last word.
        dictionary: The words.
    """

    codes: NDArray[np.integer[Any]]
    dictionary: Dictionary

    @classmethod
    def of(cls, values: Sequence[str | None], *, is_clean: bool = False) -> Texts:
        """Number the different ones of some texts, see ``Dictionary``."""
        words = {word: place for place, word in enumerate(dict.fromkeys(values))}
        codes: NDArray[np.int64]
        if len(words) == 1:
            codes = np.zeros(len(values), dtype=np.int64)
        elif len(words) == len(values):
            codes = np.arange(len(values))
        else:
            codes = np.fromiter(map(words.__getitem__, values), np.int64, len(values))
        return cls(codes, Dictionary(tuple(words), is_clean=is_clean))

    @classmethod
    def same(cls, value: str | None, rows: int) -> Texts:
        """Repeat one text."""
        return cls(np.zeros(rows, dtype=np.int64), Dictionary((value,)))

    @classmethod
    def unique(cls, values: Sequence[str]) -> Texts:
        """Take digests, which are all different and need no escaping."""
        return cls(np.arange(len(values)), Dictionary(values, is_clean=True))

    def __len__(self) -> int:
        """Count the rows."""
        return len(self.codes)

    def __getitem__(self, rows: Any) -> Texts:
        """Choose rows."""
        return Texts(self.codes[rows], self.dictionary)

    def values(self) -> list[str | None]:
        """Give the texts; None is NULL."""
        return list(self.dictionary.objects[self.codes].tolist())


def table_rows(columns: Sequence[Column], words: NDArray[np.uint64], table: Table) -> list[Row]:
    """Make the rows of a table from all of its columns but the hash.

    Args:
        columns: In the order of the table.
        words: The words (R, W) of what the hash covers, see ``hashed_names`` and ``hash_words``.
        table: A table of results.
    """
    hashes = row_hashes(table, words)
    return list(zip(*[_objects(column) for column in columns], hashes, strict=True))


def _objects(column: Column) -> list[Any]:
    if isinstance(column, Texts):
        return column.values()
    if column.dtype.kind != "f":
        return list(column.astype(np.int64).tolist())
    numbers = column + 0.0
    missing = np.isnan(numbers)
    if not missing.any():
        return list(numbers.tolist())
    # SQLite would store NaN as NULL, PostgreSQL as NaN.
    values = numbers.astype(object)
    values[missing] = None
    return list(values.tolist())


def hash_words(columns: Sequence[Column]) -> NDArray[np.uint64]:
    """Give the words (R, W) that the hash of each row covers.

    Raises:
        ValueError: A number is infinite.
    """
    rows = len(columns[0])
    width = sum(2 if isinstance(column, Texts) else 1 for column in columns)
    # Column after column: writing to every row of a table in turn would wait for memory.
    words = np.empty((width, rows), dtype=np.uint64).T
    place = 0
    for column in columns:
        if isinstance(column, Texts):
            words[:, place : place + 2] = column.dictionary.hashes[column.codes]
            place += 2
            continue
        if column.dtype.kind == "f":
            words[:, place] = _number_words(column)
        else:
            words[:, place] = column.astype(np.int64).view(np.uint64)
        place += 1
    return words


def _number_words(column: NDArray[Any]) -> NDArray[np.uint64]:
    if np.isinf(column).any():
        raise ValueError("an infinity cannot be stored; use NULL and a status")
    # SQLite stores -0.0 as 0.
    found = (np.asarray(column, dtype=np.float64) + 0.0).view(np.uint64)
    return np.where(np.isnan(column), _NULL_NUMBER, found)


def row_hashes(table: Table, words: NDArray[np.uint64]) -> list[str]:
    """Hash the rows of a table: 128 bits each, in hex."""
    seed = np.frombuffer(hashlib.blake2b(table.name.encode(), digest_size=16).digest(), dtype="<u8")
    hashes = _hash_rows(words, seed)
    text = hashes.tobytes().hex()
    return [text[place : place + 32] for place in range(0, len(text), 32)]


def _hash_rows(words: NDArray[np.uint64], seed: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Mix the words of each row into two lanes.

    Every step is a bijection of a lane for a given word and of the word for a given lane, so that
    a change of one word always changes both lanes.

    Args:
        words: (R, W).
        seed: (2,).

    Returns:
        (R, 2).
    """
    one, two = (np.full(words.shape[0], start, dtype=np.uint64) for start in seed)
    for word in words.T:
        one = (one ^ word) * np.uint64(0x9E3779B97F4A7C15)
        one ^= one >> np.uint64(32)
        two = (two + word) * np.uint64(0xC2B2AE3D27D4EB4F)
        two ^= two >> np.uint64(29)
    for _ in range(2):
        one += two
        one = (one ^ (one >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        two += one
        two = (two ^ (two >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.stack(
        [one ^ (one >> np.uint64(31)), two ^ (two >> np.uint64(31))], axis=1, dtype="<u8"
    )


def hashed_names(table: Table) -> list[str]:
    """List what the hash of a row covers: the digest of its result in place of the run's number.

    A number depends on the order in which runs came into this database.
    """
    number, *others, _row_hash = (column.name for column in table.columns)
    return others if number == "number" else ["result_digest", *others]


def stored_words(table: Table, names: Sequence[str], rows: Sequence[Row]) -> NDArray[np.uint64]:
    """Give the words of rows as the database returns them.

    Args:
        table: A table of results.
        names: Those of ``hashed_names`` that the rows have.
        rows: Values.

    Raises:
        TypeError: A value has a type that was never written there.
        ValueError: A number is not finite.
    """
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(names)
    return _column_words(table, names, columns)


def _column_words(
    table: Table, names: Sequence[str], columns: Sequence[Sequence[Any]]
) -> NDArray[np.uint64]:
    kinds = dict(zip(table.columns.keys()[:-1], _kinds(table), strict=True))
    kinds["result_digest"] = "t"
    return hash_words(
        [_stored(kinds[name], values) for name, values in zip(names, columns, strict=True)]
    )


def _stored(kind: str, values: Sequence[Any]) -> Column:
    if kind == "t":
        texts = Texts.of(values, is_clean=True)
        # What is no text equals none: a look at each different one is enough.
        _require_types(texts.dictionary.words, str)
        return texts
    types = _require_types(values, int if kind == "i" else float)
    if kind == "i":
        return np.array(values, dtype=np.int64)
    if types == {type(None)}:
        return np.full(len(values), np.nan)
    if types == {float}:
        known = np.fromiter(values, np.float64, len(values))
        if not np.isfinite(known).all():
            raise ValueError("a number is not finite")
        return known
    # None becomes NaN.
    numbers = np.array(values, dtype=np.float64)
    if np.isfinite(numbers).sum() + values.count(None) != len(values):
        raise ValueError("a number is not finite")
    return numbers


def _require_types(values: Sequence[Any], allowed: type) -> set[type]:
    # Of each value to itself this would be half of what a look at a database takes.
    types = set(map(type, values))
    if wrong := types - {allowed, type(None)}:
        value = next(value for value in values if type(value) in wrong)
        raise TypeError(f"{value!r} is not what was written")
    return types


# --- Numbers of runs: what metrics, verdicts and events refer to, in the order in which runs came
# in.


def next_number(connection: Connection, table: str = "run") -> int:
    """Return the number that the next row of a table gets, in a write transaction."""
    query = f"SELECT COALESCE(MAX(number), 0) + 1 FROM {table}"  # noqa: S608 - own names
    return int(connection.exec_driver_sql(query).scalar_one())


def run_numbers(connection: Connection, digests: Sequence[str]) -> Ints:
    """Look up the numbers (B,) of runs.

    Raises:
        IntegrityError: One of them is not in the database.
    """
    found = connection.exec_driver_sql(
        "SELECT result_digest, number FROM run "
        "WHERE result_digest IN (SELECT value FROM json_each(?))",
        (json.dumps(digests),),
    )
    numbers = {str(item.result_digest): int(item.number) for item in found}
    missing = next((digest for digest in digests if digest not in numbers), None)
    if missing is not None:
        raise IntegrityError(f"run {missing[:12]} is not in the database. Execute it first.")
    return np.array([numbers[digest] for digest in digests], dtype=np.int64)


# --- Many inserts into a table with digests for keys: with room for its indexes, or without them --

CACHE_KIB: Final = 131_072
MANY_ROWS: Final = 20_000
"""Rows from which on an index is built again."""


@contextmanager
def large_cache(connection: Connection) -> Iterator[None]:
    """Let SQLite keep more pages in memory for a while; it takes them as it needs them."""
    if is_server(connection):
        yield
        return
    before = connection.exec_driver_sql("PRAGMA cache_size").scalar_one()
    connection.exec_driver_sql(f"PRAGMA cache_size = -{CACHE_KIB}")
    try:
        yield
    finally:
        connection.exec_driver_sql(f"PRAGMA cache_size = {before}")


@contextmanager
def rebuilt_indexes(connection: Connection, table: Table) -> Iterator[None]:
    """Insert without the table's own indexes and make them at the end.

    Args:
        connection: In a write transaction, which takes everything back if an insert fails.
        table: Where rows are inserted.
    """
    if is_server(connection):
        # A server has others who need its indexes meanwhile.
        yield
        return
    found = connection.exec_driver_sql(
        "SELECT name, sql FROM sqlite_master WHERE type = 'index' AND tbl_name = ? "
        "AND sql IS NOT NULL ORDER BY rowid",
        (table.name,),
    ).all()
    for name, _ in found:
        connection.exec_driver_sql(f"DROP INDEX {name}")
    yield
    for _, ddl in found:
        connection.exec_driver_sql(ddl)


def is_worth_rebuilding(rows: int, size: int) -> bool:
    """Tell whether making the indexes of a table again is cheaper than inserting into them.

    Args:
        rows: How many are inserted.
        size: How many there were before.
    """
    return rows >= MANY_ROWS and rows >= size


def size_of(connection: Connection, table: Table) -> int:
    """Count the rows of an insert-only table, whose row numbers have no gaps."""
    counted = "count(*)" if is_server(connection) else "max(rowid)"
    found = connection.exec_driver_sql(f"SELECT {counted} FROM {table.name}")  # noqa: S608 - own names
    return int(found.scalar() or 0)


def bulk_hashes(table: Table, rows: Sequence[Row]) -> list[str] | None:
    """Hash stored rows of results; None where a value has a type that is never written.

    Args:
        table: A table of results.
        rows: Each: number of the run, the values of ``hashed_names``, and the hash that is stored.
    """
    columns = list(zip(*rows, strict=True))[1:-1]
    try:
        return row_hashes(table, _column_words(table, hashed_names(table), columns))
    except (TypeError, ValueError, OverflowError):
        return None
