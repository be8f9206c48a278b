"""The executed runs of a campaign as columns of numbers and codes: a million fit into memory.

The view ``v_runs`` finds every row by its digest, in four tables; over a whole campaign it is
faster to read each table once, as it lies in the file, and to put the rows together here.
"""

from __future__ import annotations

import json
from array import array
from dataclasses import dataclass, fields, replace
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.store.catalog import is_server
from adeye.store.metric_ids import TABLES
from adeye.store.postgres import translated

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence

    from sqlalchemy import Connection

    from adeye.signals import Bools, Floats, Ints

_CHUNK = 10_000
_NUMBERS = count()
"""Cursors of a server have names."""


class _Encoder:
    """Turns a long column of few different words into codes."""

    def __init__(self, rows: int = 0) -> None:
        self._seen: dict[Hashable, int] = {}
        self._codes = array("q", [-1] * rows)

    def add(self, value: Hashable) -> None:
        """Add a row; None is no word."""
        seen = self._seen
        self._codes.append(-1 if value is None else seen.setdefault(value, len(seen)))

    def fill(self, rows: int) -> None:
        """Add rows without a word until there are so many."""
        self._codes.extend([-1] * (rows - len(self._codes)))

    def labels(self) -> Labels:
        """Return the column."""
        return Labels(np.array(self._codes, dtype=np.int64), tuple(self._seen))


@dataclass(frozen=True, eq=False)
class Labels:
    """A column of few different words.

    Attributes:
        codes: (R,) index into the words, -1 where there is none.
        words: Each different one once.
    """

    codes: Ints
    words: tuple[Any, ...]

    @classmethod
    def of(cls, values: Iterable[Hashable]) -> Labels:
        """Encode a column; None is no word."""
        encoder = _Encoder()
        for value in values:
            encoder.add(value)
        return encoder.labels()

    def __getitem__(self, place: int) -> Any:
        """Return the word of a row."""
        code = int(self.codes[place])
        return None if code < 0 else self.words[code]

    def take(self, places: Ints) -> Labels:
        """Keep some rows."""
        return Labels(self.codes[places], self.words)


@dataclass(frozen=True, eq=False)
class Figures:
    """Executed runs in the order of the plan.

    Attributes:
        ordinal: (R,) of the test case in the campaign.
        scenario: (R,) id.
        architecture: (R,) id.
        fault_entry: (R,) entry of the fault list.
        replicate: (R,) number.
        outcome: (R,) name.
        points: (R,) swept value by axis; no word where a run does not have the axis.
        metrics: (R,) by id, NaN where a metric has no value.
        duration_s: (R,) simulated time [s].
        machine_dependent: (R,) whether it hit a wall-clock deadline.
    """

    ordinal: Ints
    scenario: Labels
    architecture: Labels
    fault_entry: Labels
    replicate: Ints
    outcome: Labels
    points: Mapping[str, Labels]
    metrics: Mapping[str, Floats]
    duration_s: Floats
    machine_dependent: Bools

    def __len__(self) -> int:
        """Return the number of runs R."""
        return len(self.ordinal)

    def take(self, places: Ints) -> Figures:
        """Keep some runs."""
        changed: dict[str, Any] = {}
        for item in fields(self):
            column = getattr(self, item.name)
            if isinstance(column, Labels):
                changed[item.name] = column.take(places)
            elif isinstance(column, np.ndarray):
                changed[item.name] = column[places]
        return replace(
            self,
            **changed,
            points={name: column.take(places) for name, column in self.points.items()},
            metrics={name: column[places] for name, column in self.metrics.items()},
        )

    def where(self, mask: Bools) -> Figures:
        """Keep the runs (R,) that are marked; without a copy if all of them are."""
        return self if mask.all() else self.take(np.flatnonzero(mask))

    def of_scenario(self, scenario: str) -> Figures:
        """Keep the runs of a scenario."""
        words = self.scenario.words
        code = words.index(scenario) if scenario in words else -1
        return self.where((self.scenario.codes == code) & (code >= 0))

    def point(self, place: int) -> dict[str, float | str]:
        """Return the swept values of a run by axis."""
        values = {name: column[place] for name, column in self.points.items()}
        return {name: value for name, value in values.items() if value is not None}


def read_figures(connection: Connection, campaign_id: str) -> Figures:
    """Read every executed run of a campaign.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
    """
    names = "ordinal, scenario, architecture, point, result_digest, test_case_digest"
    query = f"SELECT {names} FROM campaign_case WHERE campaign_id = ? ORDER BY ordinal"  # noqa: S608 - own names
    ordinal, scenario, architecture = array("q"), _Encoder(), _Encoder()
    points, digests, tests = _PointEncoder(), list[str](), list[str]()
    # Row by row into codes: a million rows as objects would take a gigabyte.
    for chunk in read_chunks(connection, query, campaign_id):
        for row in chunk:
            ordinal.append(row[0])
            scenario.add(row[1])
            architecture.add(row[2])
            points.add(json.loads(row[3]))
            digests.append(row[4])
            tests.append(row[5])
    fault, replicate = read_columns(
        connection, "test_case", "digest", ("fault_entry", "replicate"), tests, object
    )
    tests.clear()
    names_of_run = ("outcome", "number", "duration_s", "machine_dependent")
    outcome, number, duration, dependent = read_columns(
        connection, "run", "result_digest", names_of_run, digests, object
    )
    digests.clear()
    numbers = number.tolist()
    metrics: dict[str, Floats] = {}
    for table, ids in TABLES.items():
        columns = read_columns(connection, table, "run_number", ids, numbers, np.float64)
        metrics.update(zip(ids, columns, strict=True))
    everything = Figures(
        np.array(ordinal, dtype=np.int64),
        scenario.labels(),
        architecture.labels(),
        Labels.of(fault),
        replicate.astype(np.int64),
        Labels.of(outcome),
        points.columns(),
        metrics,
        duration.astype(np.float64),
        dependent == 1,
    )
    return everything.where(everything.outcome.codes >= 0)


def read_columns(
    connection: Connection,
    table: str,
    key: str,
    names: Sequence[str],
    keys: Sequence[Hashable],
    kind: type,
) -> Any:
    """Read columns (C, R) of a table for rows of given keys; None or NaN where there is none."""
    first: dict[Hashable, int] = {}
    # Two cases of a campaign may be one test case.
    places = [first.setdefault(item, row) for row, item in enumerate(keys)]
    columns: Any = np.full((len(names), len(keys)), None if kind is object else np.nan, dtype=kind)
    query = f"SELECT {', '.join((key, *names))} FROM {table}"  # noqa: S608 - own names
    # One object for equal values: every row of a database brings its own.
    same: dict[Any, Any] = {}
    for chunk in read_chunks(connection, query):
        rows = np.array([first.get(row[0], -1) for row in chunk], dtype=np.int64)
        values: Any = np.array([row[1:] for row in chunk], dtype=kind)
        if kind is object:
            values = np.frompyfunc(lambda value: same.setdefault(value, value), 1, 1)(values)
        columns[:, rows[rows >= 0]] = values[rows >= 0].T
    return columns[:, places] if len(first) < len(keys) else columns


class _PointEncoder:
    """Turns swept points into a column for each axis."""

    def __init__(self) -> None:
        self._axes: dict[str, _Encoder] = {}
        self._rows = 0

    def add(self, point: Mapping[str, Any]) -> None:
        """Add the point of a run."""
        for name, value in point.items():
            if name not in self._axes:
                self._axes[name] = _Encoder(self._rows)
            self._axes[name].add(value)
        self._rows += 1
        if len(point) < len(self._axes):
            for axis in self._axes.values():
                axis.fill(self._rows)

    def columns(self) -> dict[str, Labels]:
        """Return the columns by axis."""
        return {name: axis.labels() for name, axis in self._axes.items()}


def encode_points(points: Iterable[Mapping[str, Any]]) -> dict[str, Labels]:
    """Encode swept points by axis.

    Args:
        points: Of each run, values by axis.
    """
    encoder = _PointEncoder()
    for point in points:
        encoder.add(point)
    return encoder.columns()


def read_chunks(
    connection: Connection, query: str, *values: str | int
) -> Iterator[list[tuple[Any, ...]]]:
    """Read the rows of a query, many at a time."""
    # The cursor of the driver: a row object of SQLAlchemy costs more than the row.
    cursor: Any
    if is_server(connection):
        if not connection.in_transaction():
            # The driver would begin one of its own, which sees other states as it goes on.
            connection.begin()
        driver: Any = connection.connection.dbapi_connection
        cursor = driver.cursor(name=f"chunks_{next(_NUMBERS)}")
        cursor.execute(translated(query), values)
    else:
        cursor = connection.exec_driver_sql(query, values).cursor
    try:
        while chunk := cursor.fetchmany(_CHUNK):
            yield chunk
    finally:
        cursor.close()
