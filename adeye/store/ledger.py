"""The ledger: what every transaction added to which table, so that nothing can go missing unseen.

A row has a hash of its own, which tells that it was altered; that it is gone, or was never
written, only another place can tell. So each transaction notes for each table how many rows it
added and the sum of their hashes, and for each run the same in a seal. Sums do not depend on an
order, so that transactions need not wait for each other's results.

``note`` collects while a transaction writes, ``close`` writes the entries as its last step: they
are there exactly when the rows are.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Table

from adeye.signals import Ints
from adeye.store import tables
from adeye.store.catalogue import rows_among
from adeye.store.encoding import Row, driver_insert, hash_words, next_number, row, row_hashes
from adeye.store.records import values_of
from adeye.store.tables import LEDGER, RECOUNTED, SEALED

# --- The ledger: what every transaction added to which table, so that nothing can go missing
# unseen.

MODULUS: Final = 1 << 128
SEAL_MASK: Final = (1 << 48) - 1
"""A seal keeps 48 bits of a sum: enough to name a run, where the ledger's 128 tell of it."""
DETAILED: Final = 1024
"""Rows that one entry lists; it bounds what a cell holds."""
_SUMMED: Final = 5_000
"""Hashes that are summed at once."""
_WAITING: Final = 64
"""Entries that wait in memory for the end of a transaction that writes more."""
_KEY: Final = "adeye_ledger"
HashWords: TypeAlias = "NDArray[np.unsignedinteger[Any]]"
_SHORT: Final = 12


def hash_sum(hashes: Sequence[str]) -> int:
    """Sum hashes of 128 bits in hex, modulo 2**128.

    >>> hash_sum(["f" * 32, "0" * 31 + "2"])
    1
    """
    return total_of(words_of(hashes))


def total_of(hashes: HashWords) -> int:
    """Sum hashes (R, 4) of 128 bits, modulo 2**128."""
    words = hashes.sum(axis=0, dtype=np.uint64).tolist()
    return sum(int(word) << shift for word, shift in zip(words, (96, 64, 32, 0), strict=True)) % (
        MODULUS
    )


def seal_parts(hashes: HashWords) -> NDArray[np.uint64]:
    """Give of each hash (R, 4) the part (R,) that seals sum."""
    words = hashes.astype(np.uint64)
    return ((words[:, 2] << np.uint64(32)) | words[:, 3]) & np.uint64(SEAL_MASK)


def words_of(hashes: Sequence[str]) -> HashWords:
    """Read hashes of 128 bits in hex as words (R, 4) of 32."""
    return np.frombuffer(bytes.fromhex("".join(hashes)), dtype=">u4").reshape(-1, 4)


def by_run(numbers: Ints, hashes: HashWords) -> tuple[Ints, NDArray[np.uint64]]:
    """Sum the hashes of the rows of each run for its seal.

    Args:
        numbers: (R,) numbers of runs.
        hashes: (R, 4) words of the hashes of rows.

    Returns:
        The different numbers, ascending, and their sums modulo 2**48.
    """
    runs, place = np.unique(numbers, return_inverse=True)
    sums = np.zeros(len(runs), dtype=np.uint64)
    # Sums of 64 bits wrap around, which leaves the lower 48 as they are.
    np.add.at(sums, place, seal_parts(hashes))
    return runs, sums & np.uint64(SEAL_MASK)


def sealed_name(table: Table) -> str | None:
    """Name what a seal calls a table; None if its rows are not of one run."""
    return _sealed_name(table.name, next(iter(table.columns)).name)


@cache
def _sealed_name(name: str, key: str) -> str | None:
    if name in SEALED:
        return name
    is_of_plugin = key == "run_number" and name not in tables.metadata.tables
    return "plugin" if is_of_plugin else None


def row_name(table: Table, values: Row) -> str:
    """Name a row by its key, digests by their beginnings."""
    texts = (str(values[place]) for place in key_places(table))
    return " ".join(text[:_SHORT] if len(text) in (32, 64) else text for text in texts)


@cache
def key_places(table: Table) -> tuple[int, ...]:
    """Give the places of the key in a row."""
    names = [column.name for column in table.columns]
    return tuple(names.index(column.name) for column in table.primary_key.columns)


def key_text(table: Table, values: Sequence[Any]) -> str:
    """Name a row by its key."""
    return " ".join(str(values[place]) for place in key_places(table))


def summed(
    connection: Connection,
    query: str,
    values: tuple[Any, ...],
    read: Callable[[Sequence[Any]], Sequence[str]] = tuple,
) -> tuple[int, int]:
    """Count and sum the hashes that a query gives, modulo 2**128.

    Args:
        connection: In a transaction.
        query: Of one column.
        values: What its parameters stand for.
        read: Gives the hashes that some values are.
    """
    found = connection.exec_driver_sql(query, values, execution_options={"yield_per": _SUMMED})
    count, total = 0, 0
    for part in found.partitions(_SUMMED):
        hashes = read([item[0] for item in part])
        count, total = count + len(hashes), (total + hash_sum(hashes)) % MODULUS
    return count, total


def detail_of(table: Table, rows: Sequence[Row]) -> str:
    """List rows for the ledger: the last eight digits of the hash and the key, one a line."""
    return "\n".join(f"{item[-1][-8:]} {row_name(table, item)}".replace("\n", " ") for item in rows)


def offset(number: int, place: int, table: str, detail: str) -> int:
    """Hash an entry, so that its total belongs to no other place and to no other list."""
    text = f"{number} {place} {table}\n{detail}"
    return int.from_bytes(hashlib.sha256(text.encode("utf-8", "surrogatepass")).digest()[:16])


@dataclass
class Entries:
    """What a transaction has added so far.

    Attributes:
        sums: By sealed table: rows and sum.
        runs: By column of the seal: numbers of runs and their sums, part by part.
        listed: Rows of other tables that wait to be listed.
        waiting: Entries that wait to be written: table, rows, sum and detail.
        number: Of the transaction; 0 as long as no entry of it is written.
        place: Of the next entry.
    """

    sums: dict[str, tuple[int, int]] = field(default_factory=dict)
    runs: dict[str, list[tuple[Ints, NDArray[np.uint64]]]] = field(default_factory=dict)
    listed: dict[Table, list[Row]] = field(default_factory=dict)
    waiting: list[tuple[str, int, int, str]] = field(default_factory=list)
    number: int = 0
    place: int = 0

    def add(self, table: Table, rows: Sequence[Row]) -> None:
        """Note rows that were inserted."""
        name = sealed_name(table)
        if name is None:
            listed = self.listed.setdefault(table, [])
            listed.extend(rows)
            while len(listed) >= DETAILED:
                self._list(table, listed[:DETAILED])
                del listed[:DETAILED]
            return
        hashes = words_of([item[-1] for item in rows])
        count, total = self.sums.get(table.name, (0, 0))
        self.sums[table.name] = count + len(rows), total + total_of(hashes)
        numbers = np.fromiter((item[0] for item in rows), dtype=np.int64, count=len(rows))
        self.runs.setdefault(name, []).append(by_run(numbers, hashes))

    def _list(self, table: Table, rows: Sequence[Row]) -> None:
        total = hash_sum([item[-1] for item in rows])
        self.waiting.append((table.name, len(rows), total, detail_of(table, rows)))

    def write_waiting(self, connection: Connection, *, keep: int) -> None:
        """Write entries, but keep as many as given: only the last one says that it is that."""
        count = max(0, len(self.waiting) - keep)
        if not count:
            return
        self._begin(connection)
        made: list[Row] = []
        for table, rows, total, detail in self.waiting[:count]:
            is_last = len(made) == len(self.waiting) - 1
            bound = (total + offset(self.number, self.place, table, detail)) % MODULUS
            values = (self.number, self.place, table, is_last, rows, f"{bound:032x}", detail)
            made.append(row(tables.ledger, values))
            self.place += 1
        driver_insert(connection, tables.ledger, made)
        del self.waiting[:count]

    def finish(self, connection: Connection) -> None:
        """Write all that is noted."""
        for table, rows in self.listed.items():
            if rows:
                self._list(table, rows)
        self.waiting += [(name, rows, total, "") for name, (rows, total) in self.sums.items()]
        if self.waiting:
            self._begin(connection)
            driver_insert(connection, tables.seal, self._seals())
            self.write_waiting(connection, keep=0)

    def _begin(self, connection: Connection) -> None:
        if not self.number:
            self.number = next_number(connection, "ledger")

    def _seals(self) -> list[Row]:
        parts = [numbers for of_table in self.runs.values() for numbers, _ in of_table]
        if not parts:
            return []
        runs = np.unique(np.concatenate(parts))
        sums = np.zeros((len(SEALED), len(runs)), dtype=np.uint64)
        for name, of_table in self.runs.items():
            for numbers, added in of_table:
                sums[SEALED.index(name), np.searchsorted(runs, numbers)] += added
        sums &= np.uint64(SEAL_MASK)
        columns = [runs, np.full(len(runs), self.number), *sums.astype(np.int64)]
        hashes = seal_hashes(columns)
        return list(zip(*(column.tolist() for column in columns), hashes, strict=True))


def seal_hashes(columns: Sequence[Ints]) -> list[str]:
    """Hash seals, from their columns but the hash."""
    return row_hashes(tables.seal, hash_words(columns))


def begin(connection: Connection) -> None:
    """Forget what a transaction on this connection noted that did not come to its end."""
    connection.info.pop(_KEY, None)


def note(connection: Connection, table: Table, rows: Sequence[Row]) -> None:
    """Note rows that this transaction inserted, if it is to be told of."""
    if table in LEDGER or table in RECOUNTED:
        return
    noted = entries(connection)
    noted.add(table, rows)
    if len(noted.waiting) > _WAITING:
        noted.write_waiting(connection, keep=1)


def entries(connection: Connection) -> Entries:
    """Return what the transaction on a connection noted so far."""
    noted: Entries = connection.info.setdefault(_KEY, Entries())
    return noted


def close(connection: Connection) -> None:
    """Write the entries of a transaction, as its last step."""
    noted: Entries | None = connection.info.pop(_KEY, None)
    if noted is not None:
        noted.finish(connection)


# --- The one way for rows of evidence into the database: insert what is new and note it -----------

_CHUNK: Final = 10_000


def insert_rows(
    connection: Connection, table: Table, rows: Iterable[Row], *, ignore_existing: bool = False
) -> None:
    """Insert rows that have a value for every column, in the order of the columns.

    Args:
        connection: In a transaction of ``Database.write``, whose end writes the ledger.
        table: An insert-only table.
        rows: The rows.
        ignore_existing: Leave out rows whose key is there already; of several with one key the
            first goes in.
    """
    batch = list(rows)
    if ignore_existing:
        batch = _new(connection, table, batch)
    if batch:
        driver_insert(connection, table, batch)
        note(connection, table, batch)


def row_of(table: Table, record: object, **others: Any) -> Row:
    """Make a row from a record, see ``records.values_of``."""
    return row(table, values_of(table.columns.keys()[:-1], record, **others))


def add_row(
    connection: Connection, table: Table, *values: Any, ignore_existing: bool = False
) -> None:
    """Insert one row, given by its values without the hash."""
    insert_rows(connection, table, [row(table, values)], ignore_existing=ignore_existing)


def add_numbered(connection: Connection, table: Table, *values: Any) -> None:
    """Insert one row under the next number of its table."""
    add_row(connection, table, next_number(connection, table.name), *values)


def insert_new(
    connection: Connection,
    table: Table,
    rows: Iterable[Row],
    refuse: Callable[[Row], None],
) -> int:
    """Insert rows whose key is not there; what is there, or came before, stays as it is.

    Args:
        connection: As for ``insert_rows``.
        table: An insert-only table.
        rows: The rows.
        refuse: Called with each that has another hash than the row with its key.

    Returns:
        Number of rows added.
    """
    batch, places = list(rows), key_places(table)
    key = table.primary_key.columns.keys()
    first = {item[places[0]] for item in batch}
    found = rows_among(connection, table, ", ".join((*key, "row_hash")), key[0], first)
    known = {tuple(own): hashed for *own, hashed in found}
    new: list[Row] = []
    for item in batch:
        own = tuple(item[place] for place in places)
        if own not in known:
            known[own] = item[-1]
            new.append(item)
        elif known[own] != item[-1]:
            refuse(item)
    insert_rows(connection, table, new)
    return len(new)


def _new(connection: Connection, table: Table, rows: list[Row]) -> list[Row]:
    """Choose the rows whose key is not there, each key once."""
    places = key_places(table)
    found: dict[Any, Row] = {}
    for item in rows:
        found.setdefault(tuple(item[place] for place in places), item)
    key = table.primary_key.columns.keys()
    first = sorted({item[places[0]] for item in found.values()})
    for start in range(0, len(first), _CHUNK):
        part = [item if isinstance(item, str) else int(item) for item in first[start:][:_CHUNK]]
        for known in rows_among(connection, table, ", ".join(key), key[0], part):
            found.pop(tuple(known), None)
    return list(found.values())
