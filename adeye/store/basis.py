"""What it takes to judge runs again without their traces: written with them, read to judge.

Beside the metrics that is: whether a contact ended a run, why no FSR can be judged on it, which
definitions its metrics have, and the samples that decide formulas of one comparison.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.identity import digest
from adeye.store.basis_tables import basis, extreme, kept_trace, uid_set
from adeye.store.column_kinds import metadata
from adeye.store.columns import Column, Texts, hash_words, table_rows
from adeye.store.encoding import json_text, row
from adeye.store.inserting import insert_rows
from adeye.store.numbers import run_numbers
from adeye.store.plugin_metrics import plugin_tables

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sqlalchemy import Connection, Table

    from adeye.signals import Ints
    from adeye.store.basis_block import BasisBlock

CHUNK: Final = 2_048
"""Runs that are looked up together."""


def record_basis(
    connection: Connection, result_digests: Sequence[str], block: BasisBlock | None
) -> None:
    """Save what judging runs again depends on; what is there stays.

    Args:
        connection: In a write transaction.
        result_digests: The runs, which are in the database.
        block: Of these runs; None for nothing.
    """
    if block is None or not result_digests:
        return
    numbers = run_numbers(connection, result_digests)
    results = Texts.of(result_digests)
    uids = digest(dict(block.uids))
    row_of_set = row(uid_set, (uids, json_text(dict(block.uids))))
    insert_rows(connection, uid_set, [row_of_set], ignore_existing=True)
    columns: list[Column] = [
        results,
        np.full(len(numbers), block.version),
        Texts.same(uids, len(numbers)),
        block.by_contact,
        block.invalid,
    ]
    _insert(connection, basis, numbers, columns)
    found = block.extremes
    columns = [
        results[found.run],
        found.measure,
        np.full(len(found.run), block.version),
        found.value,
        found.time_s,
        found.actor,
        found.samples,
    ]
    _insert(connection, extreme, numbers[found.run], columns)
    kept = [(run, place) for run, place in enumerate(block.files) if place is not None]
    if kept:
        runs = np.array([run for run, _ in kept])
        columns = [
            results[runs],
            Texts.of([name for _, (name, _) in kept]),
            np.array([place for _, (_, place) in kept]),
        ]
        _insert(connection, kept_trace, numbers[runs], columns)


def _insert(connection: Connection, table: Table, numbers: Ints, columns: list[Column]) -> None:
    rows = table_rows([numbers, *columns[1:]], hash_words(columns), table)
    insert_rows(connection, table, rows, ignore_existing=True)


def read_bases(
    connection: Connection, numbers: Sequence[int], version: int
) -> dict[int, tuple[bool, str | None, str]]:
    """Read whether contact ended runs, why they are invalid, and their definitions, by number."""
    found = connection.exec_driver_sql(
        "SELECT run_number, by_contact, invalid, uid_set_digest FROM basis "
        "WHERE version = ? AND run_number IN (SELECT CAST(value AS INTEGER) FROM json_each(?))",
        (version, json.dumps(list(numbers))),
    )
    return {item[0]: (bool(item[1]), item[2], item[3]) for item in found}


def read_uids(connection: Connection) -> dict[str, Mapping[str, str]]:
    """Read the definitions of metrics, by the digest of all of them."""
    found = connection.execute(uid_set.select())
    return {item.digest: json.loads(item.uids) for item in found}


def read_metric(
    connection: Connection, numbers: Sequence[int], name: str
) -> dict[int, tuple[Any, ...]]:
    """Read value, status, time and actor of a metric, by number of the run."""
    everywhere = (*metadata.sorted_tables, *plugin_tables(connection))
    tables = [item.name for item in everywhere if f"{name}_status" in item.columns]
    found: dict[int, tuple[Any, ...]] = {}
    twice: set[int] = set()
    for table in tables:
        rows = connection.exec_driver_sql(
            f"SELECT run_number, {name}, {name}_status, {name}_time_s, {name}_actor "  # noqa: S608 - ids of metrics
            f"FROM {table} WHERE run_number IN (SELECT CAST(value AS INTEGER) FROM json_each(?))",
            (json.dumps(list(numbers)),),
        )
        for number, *values in rows:
            if number in found:
                twice.add(number)
            found[number] = tuple(values)
    # Of two plug-ins that measure under one name neither is known to be meant.
    return {number: values for number, values in found.items() if number not in twice}


def read_extremes(
    connection: Connection, numbers: Sequence[int], measure: str, version: int
) -> dict[int, Any]:
    """Read the samples that decide, as ``samples_text`` wrote them, by number of the run."""
    found = connection.exec_driver_sql(
        "SELECT run_number, samples FROM extreme WHERE measure = ? AND version = ? "
        "AND run_number IN (SELECT CAST(value AS INTEGER) FROM json_each(?))",
        (measure, version, json.dumps(list(numbers))),
    )
    return {item[0]: json.loads(item[1]) for item in found}


def read_files(connection: Connection, numbers: Sequence[int]) -> list[tuple[int, str, int]]:
    """Read where traces are kept: number of the run, name of the file, place in it."""
    found = connection.exec_driver_sql(
        "SELECT run_number, file, place FROM kept_trace "
        "WHERE run_number IN (SELECT CAST(value AS INTEGER) FROM json_each(?)) "
        "ORDER BY file, place",
        (json.dumps(list(numbers)),),
    )
    return [(item[0], item[1], item[2]) for item in found]
