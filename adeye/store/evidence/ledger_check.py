"""Hold a database against its ledger: name rows that are gone, altered, moved or foreign.

Three places tell of each row of a run: the row, the seal of its run, and the ledger. Where two
agree, the third is named. Rows of other tables are listed in the ledger with their keys.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from operator import index
from typing import Any, Final

import numpy as np
from sqlalchemy import Connection, Table

from adeye.errors import IntegrityError
from adeye.notices import doing
from adeye.signals import Ints
from adeye.store import ledger, tables
from adeye.store.catalogue import rows_among
from adeye.store.encoding import Row, chunked, read_chunks, stored_rows
from adeye.store.ledger import DETAILED, MODULUS, SEAL_MASK
from adeye.store.plugin_metrics import plugin_tables
from adeye.store.records import Finding
from adeye.store.tables import LEDGER, RECOUNTED, SEALED

_RUNS: Final = 2_000
"""Runs that are looked at together."""
_LENGTH: Final = 32
_DIGITS: Final = b"0123456789abcdef"


def _run_rows(
    connection: Connection, table: str, first: int, end: int
) -> tuple[Ints, ledger.HashWords]:
    """Read of the rows of runs from one number to before another number and hash.

    Returns:
        (R,) numbers of runs, and (R, 4) words of the hashes.
    """
    key = "number" if table == "run" else "run_number"
    query = f"SELECT {key}, row_hash FROM {table} WHERE {key} >= ? AND {key} < ?"  # noqa: S608 - own names
    numbers, words = [np.zeros(0, dtype=np.int64)], [ledger.words_of(())]
    for chunk in read_chunks(connection, query, first, end):
        of_runs, hashes = zip(*chunk, strict=True)
        numbers.append(np.fromiter(map(int, of_runs), np.int64, len(of_runs)))
        words.append(ledger.words_of(_hexes(hashes)))
    return np.concatenate(numbers), np.concatenate(words)


@dataclass
class _Told:
    """What the ledger tells.

    Attributes:
        totals: By table: rows and sum of their hashes.
        sealed: By transaction and column of the seal, the sum that its seals have to have.
        broken: Tables of which an entry is not as it was written.
    """

    totals: dict[str, tuple[int, int]] = field(default_factory=dict)
    sealed: dict[tuple[int, str], int] = field(default_factory=lambda: defaultdict(int))
    broken: set[str] = field(default_factory=set)


_NAMED: Final = 3


def refuse(what: str, findings: Iterable[Finding]) -> None:
    """Raise an error that names the first findings, if there is one.

    Raises:
        IntegrityError: There is.
    """
    # To the end: what is left of a stream would hold its cursor.
    if named := "; ".join(map(str, list(findings)[:_NAMED])):
        raise IntegrityError(f"{what} is not as it was written: {named}. See 'adeye db verify'.")


def require_no_campaign_gone(connection: Connection) -> None:
    """Refuse to say that a campaign is not there if the ledger knows one that is gone.

    Raises:
        IntegrityError: There is one.
    """
    refuse("the database", differing(connection, tables.campaign))


def unbalanced(connection: Connection) -> Iterator[Finding]:
    """Name what the ledger, the seals and the tables do not agree on."""
    told = _Told()
    yield from _entries(connection, told)
    for table in tables.INSERT_ONLY:
        if table in (*LEDGER, *RECOUNTED) or ledger.sealed_name(table) is not None:
            continue
        query = f"SELECT row_hash FROM {table.name}"  # noqa: S608 - own names
        count, total = ledger.summed(connection, query, (), _hexes)
        if (count, total) != told.totals.pop(table.name, (0, 0)):
            named = list(differing(connection, table))
            yield from named or [Finding(table.name, "", f"{count} rows are not as in the ledger")]
    yield from _sealed(connection, told)


def _entries(connection: Connection, told: _Told) -> Iterator[Finding]:
    """Read the ledger; name its entries that are gone or contradict themselves."""
    number, place, was_last = 0, 0, True
    found = connection.exec_driver_sql(
        "SELECT number, place, table_name, is_last, row_count, total, detail FROM ledger "
        "ORDER BY number, place",
        execution_options={"yield_per": _RUNS},
    )
    plugins = {table.name for table in plugin_tables(connection)}
    for own_number, own_place, name, is_last, rows, text, detail in found:
        expected = (number + 1, 0) if was_last else (number, place + 1)
        if (own_number, own_place) != expected:
            yield Finding("ledger", f"{expected[0]} {expected[1]}", "is missing or out of order")
        number, place, was_last = own_number, own_place, bool(is_last)
        total = _total(text)
        sum_of = (total - ledger.offset(number, place, name, detail)) % MODULUS
        of_seal = name if name in SEALED else "plugin" if name in plugins else None
        if of_seal is not None and not detail:
            told.sealed[number, of_seal] += sum_of & SEAL_MASK
        elif not _lists(detail, rows, sum_of):
            told.broken.add(name)
            yield Finding("ledger", f"{number} {place}", f"is altered, which is about {name}")
        count, before = told.totals.get(name, (0, 0))
        told.totals[name] = count + rows, (before + sum_of) % MODULUS
    if not was_last:
        yield Finding("ledger", f"{number} {place + 1}", "is missing")


def _total(text: Any) -> int:
    try:
        return int(text, 16)
    except (TypeError, ValueError):
        return 0


def _lists(detail: Any, rows: int, sum_of: int) -> bool:
    """Tell whether an entry lists as many rows as it counts, and those that it sums."""
    try:
        lines = detail.split("\n")
        listed = sum(int(line[:8], 16) for line in lines)
    except (AttributeError, ValueError):
        return False
    return len(lines) == rows and (listed - sum_of) % (1 << 32) == 0


def _hexes(values: Sequence[Any]) -> Sequence[str]:
    """Give hashes, with zeros for what is none; the row is named by its own check."""
    if set(map(type, values)) == {str} and set(map(len, values)) == {_LENGTH}:
        everything = "".join(values).encode("utf-8", "surrogatepass")
        if not everything.translate(None, _DIGITS):
            return values
    return [_hex(str(value)) for value in values]


def _hex(text: str) -> str:
    is_hash = len(text) == _LENGTH and set(text) <= set(_DIGITS.decode())
    return text if is_hash else "0" * _LENGTH


def differing(connection: Connection, table: Table) -> Iterator[Finding]:
    """Name the rows of a listed table that are not those that the ledger lists."""
    listed: Counter[str] = Counter()
    found = connection.exec_driver_sql(
        "SELECT detail FROM ledger WHERE table_name = ?", (table.name,)
    )
    for (detail,) in found:
        listed.update(str(detail).split("\n"))
    extra: dict[str, str] = {}
    for rows in chunked(stored_rows(connection, table), DETAILED):
        for item, line in zip(rows, ledger.detail_of(table, rows).split("\n"), strict=True):
            if listed[line]:
                listed[line] -= 1
            else:
                extra[line[9:]] = ledger.row_name(table, item)
    missing = {line[9:] for line, count in listed.items() if count > 0}
    for name in sorted(missing | set(extra)):
        if name in missing and name in extra:
            yield Finding(table.name, name, "is not the row that was written")
        elif name in missing:
            yield Finding(table.name, name, "is missing")
        else:
            yield Finding(table.name, name, "was never written by adeye")


def _sealed(connection: Connection, told: _Told) -> Iterator[Finding]:
    """Compare tables with rows of runs with the seals, and both with the ledger."""
    counted: dict[str, tuple[int, int]] = {}
    blamed: list[tuple[int, str, bool]] = []
    altered: list[Finding] = []
    # The tables with rows of runs: name, and what seals call it.
    names = [
        *((name, name) for name in SEALED if name in tables.metadata.tables),
        *((table.name, "plugin") for table in plugin_tables(connection)),
    ]
    for first, end in _ranges(connection, [name for name, _ in names]):
        doing(f"Verifying the database: seals of runs up to {end:,}")
        actual = np.zeros((len(SEALED), end - first), dtype=np.uint64)
        for name, of_seal in names:
            numbers, hashes = _run_rows(connection, name, first, end)
            if len(numbers):
                runs, sums = ledger.by_run(numbers, hashes)
                actual[SEALED.index(of_seal), runs - first] += sums
                count, total = counted.get(name, (0, 0))
                counted[name] = (
                    count + len(numbers),
                    (total + ledger.total_of(hashes)) % MODULUS,
                )
        within = "run_number >= ? AND run_number < ?"
        seals = list(stored_rows(connection, tables.seal, within, (first, end)))
        altered += _altered_seals(seals)
        expected = np.zeros_like(actual)
        for run, number, *of_run, _ in seals:
            for place, value in enumerate(of_run):
                if value:
                    # Sums of 64 bits wrap around, which leaves the lower 48 as they are.
                    expected[place, run - first] += np.uint64(index(value) % (1 << 64))
                    told.sealed[number, SEALED[place]] -= value
        blamed += [
            (first + place, SEALED[at], bool(actual[at, place]))
            for at, place in np.argwhere((expected - actual) & np.uint64(SEAL_MASK)).tolist()
        ]
    yield from altered
    yield from _judged(connection, told, counted, blamed)


def _ranges(connection: Connection, names: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Give the ranges of numbers that hold everything, also rows of runs that are not there."""
    # A number far away would make a million empty ranges.
    present = sorted(
        {
            int(item[0])
            for name in (*names, "seal")
            for item in connection.exec_driver_sql(
                f"SELECT DISTINCT {'number' if name == 'run' else 'run_number'} / {_RUNS} "  # noqa: S608
                f"FROM {name}"
            )
        }
    )
    for part in present:
        yield part * _RUNS, (part + 1) * _RUNS


def _altered_seals(seals: Sequence[Row]) -> Iterator[Finding]:
    """Name seals that do not have their hash."""
    if not seals:
        return
    hashes = _seal_hashes(seals)
    if hashes == [item[-1] for item in seals]:
        return
    for item in seals:
        if _seal_hashes([item]) != [item[-1]]:
            yield Finding("seal", f"{item[0]} {item[1]}", "altered")


def _seal_hashes(seals: Sequence[Row]) -> list[str] | None:
    columns = list(zip(*seals, strict=True))[:-1]
    if any(set(map(type, column)) != {int} for column in columns):
        return None
    try:
        return ledger.seal_hashes([np.array(column, dtype=np.int64) for column in columns])
    except OverflowError:
        return None


def _judged(
    connection: Connection,
    told: _Told,
    counted: dict[str, tuple[int, int]],
    blamed: Sequence[tuple[int, str, bool]],
) -> Iterator[Finding]:
    """Say of each disagreement which of the three is not as it was written."""
    plugins = [table.name for table in plugin_tables(connection)]
    differ: set[str] = set()
    for name in {*counted, *told.totals}:
        if counted.get(name, (0, 0)) != told.totals.get(name, (0, 0)):
            differ.add("plugin" if name in plugins else name)
    off_seals = {name for (_, name), value in told.sealed.items() if value & SEAL_MASK}
    digests = _digests(connection, {run for run, _, _ in blamed})
    explained: set[str] = set()
    for run, name, is_there in sorted(blamed):
        explained.add(name)
        which = digests.get(run, f"number {run}")
        if name in differ:
            problem = "has other rows than were written" if is_there else "has no row any more"
            for table in plugins if name == "plugin" else [name]:
                yield Finding(table, which, problem)
        elif name in off_seals:
            yield Finding("seal", which, f"is not what was written of {name}")
        else:
            yield Finding(name, which, "has rows of another run")
    for (number, name), value in sorted(told.sealed.items()):
        if value & SEAL_MASK and name not in explained:
            yield Finding("ledger", str(number), f"is altered or gone, which is about {name}")
    for name in sorted(differ - explained - off_seals):
        yield Finding("ledger", name, "counts other rows than the table and the seals")


def _digests(connection: Connection, numbers: set[int]) -> dict[int, str]:
    found = rows_among(connection, tables.run, "number, result_digest", "number", numbers)
    return {int(item[0]): str(item[1]) for item in found}
