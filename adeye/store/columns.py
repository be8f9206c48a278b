"""Columns on their way to the database: rows of a table for a whole block, with their hashes.

The hash of a row is made of 64-bit words, so that a compiled loop hashes thousands of rows at
once: one word for a number or a truth value, two for a text (a BLAKE2b of 128 bits). It is the
hash of the tables of results, ``tables.RESULTS``, and of the metrics of plug-ins; the tables of
plans have that of ``encoding.row_hash``. Both tell an altered row from the one that was written;
whoever alters it on purpose can also write a matching hash.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from sqlalchemy import Boolean, Float, Integer, Table

from adeye.kernel.jit import compiled
from adeye.store.encoding import Row, clean_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

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
        joined = b"".join(
            hashlib.blake2b(
                _NULL_TEXT if word is None else word.encode("utf-8", "surrogatepass"),
                digest_size=16,
            ).digest()
            for word in self.words
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
    def of(cls, values: Sequence[str | None]) -> Texts:
        """Number the different ones of some texts."""
        words: dict[str | None, int] = {}
        codes = [words.setdefault(value, len(words)) for value in values]
        return cls(np.array(codes, dtype=np.int64), Dictionary(tuple(words)))

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
        msg = "an infinity cannot be stored; use NULL and a status"
        raise ValueError(msg)
    # SQLite stores -0.0 as 0.
    found = (np.asarray(column, dtype=np.float64) + 0.0).view(np.uint64)
    return np.where(np.isnan(column), _NULL_NUMBER, found)


def row_hashes(table: Table, words: NDArray[np.uint64]) -> list[str]:
    """Hash the rows of a table: 128 bits each, in hex."""
    seed = np.frombuffer(hashlib.blake2b(table.name.encode(), digest_size=16).digest(), dtype="<u8")
    hashes = np.empty((words.shape[0], 2), dtype="<u8")
    _hash_rows(words, seed, hashes)
    text = hashes.tobytes().hex()
    return [text[place : place + 32] for place in range(0, len(text), 32)]


@compiled
def _hash_rows(
    words: NDArray[np.uint64], seed: NDArray[np.uint64], out: NDArray[np.uint64]
) -> None:
    """Mix the words of each row into two lanes.

    Every step is a bijection of a lane for a given word and of the word for a given lane, so that
    a change of one word always changes both lanes.

    Args:
        words: (R, W).
        seed: (2,).
        out: (R, 2).
    """
    for row in range(words.shape[0]):
        one, two = seed[0], seed[1]
        for place in range(words.shape[1]):
            word = words[row, place]
            one = (one ^ word) * np.uint64(0x9E3779B97F4A7C15)
            one ^= one >> np.uint64(32)
            two = (two + word) * np.uint64(0xC2B2AE3D27D4EB4F)
            two ^= two >> np.uint64(29)
        for _ in range(2):
            one += two
            one = (one ^ (one >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            two += one
            two = (two ^ (two >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        out[row, 0], out[row, 1] = one ^ (one >> np.uint64(31)), two ^ (two >> np.uint64(31))


@cache
def _kinds(table: Table) -> tuple[str, ...]:
    return tuple(
        "f"
        if isinstance(column.type, Float)
        else "i"
        if isinstance(column.type, Integer | Boolean)
        else "t"
        for column in table.columns
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
    kinds = dict(zip((column.name for column in table.columns), _kinds(table), strict=True))
    kinds["result_digest"] = "t"
    columns = zip(*rows, strict=True) if rows else ([] for _ in names)
    return hash_words(
        [_stored(kinds[name], values) for name, values in zip(names, columns, strict=True)]
    )


def _stored(kind: str, values: Sequence[Any]) -> Column:
    allowed = {"f": float, "i": int, "t": str}[kind]
    for value in values:
        if value is not None and type(value) is not allowed:
            msg = f"{value!r} is not what was written"
            raise TypeError(msg)
    if kind == "t":
        words: dict[str | None, int] = {}
        codes = [words.setdefault(value, len(words)) for value in values]
        return Texts(np.array(codes, dtype=np.int64), Dictionary(tuple(words), is_clean=True))
    if kind == "i":
        return np.array(values, dtype=np.int64)
    if any(value is not None and not math.isfinite(value) for value in values):
        msg = "a number is not finite"
        raise ValueError(msg)
    return np.array([math.nan if value is None else value for value in values])
