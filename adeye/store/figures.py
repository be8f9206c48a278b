"""The executed runs of a campaign as columns of numbers and codes: a million fit into memory.

The view ``v_runs`` finds every row by its digest, in four tables; over a whole campaign it is
faster to read each table once, as it lies in the file, and to put the rows together here.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, replace
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.store import tables

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence

    from sqlalchemy import Connection

    from adeye.signals import Floats, Ints

_CHUNK = 10_000


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
        seen: dict[Hashable, int] = {None: -1}
        # A word gets the number of words before it: the dictionary holds None beside them.
        codes = [seen.setdefault(value, len(seen) - 1) for value in values]
        return cls(np.array(codes, dtype=np.int64), tuple(seen)[1:])

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
    """

    ordinal: Ints
    scenario: Labels
    architecture: Labels
    fault_entry: Labels
    replicate: Ints
    outcome: Labels
    points: Mapping[str, Labels]
    metrics: Mapping[str, Floats]

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

    def of_scenario(self, scenario: str) -> Figures:
        """Keep the runs of a scenario."""
        if scenario not in self.scenario.words:
            return self.take(np.zeros(0, dtype=np.int64))
        return self.take(np.flatnonzero(self.scenario.codes == self.scenario.words.index(scenario)))

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
    columns = "ordinal, result_digest, test_case_digest, scenario, architecture, point"
    query = f"SELECT {columns} FROM campaign_case WHERE campaign_id = ? ORDER BY ordinal"  # noqa: S608 - own names
    cases = list(chain.from_iterable(_chunks(connection, query, campaign_id)))
    ordinal, digests, tests, scenario, architecture, points = zip(*cases, strict=True)
    del cases
    [outcome] = _found(connection, "run", "result_digest", ("outcome",), digests, object)
    metrics = _found(connection, "metric", "result_digest", tables.METRIC_IDS, digests, np.float64)
    fault, replicate = _found(
        connection, "test_case", "digest", ("fault_entry", "replicate"), tests, object
    )
    everything = Figures(
        np.array(ordinal, dtype=np.int64),
        Labels.of(scenario),
        Labels.of(architecture),
        Labels.of(fault),
        replicate.astype(np.int64),
        Labels.of(outcome),
        encode_points(json.loads(point) for point in points),
        dict(zip(tables.METRIC_IDS, metrics, strict=True)),
    )
    return everything.take(np.flatnonzero(everything.outcome.codes >= 0))


def _found(
    connection: Connection,
    table: str,
    key: str,
    names: Sequence[str],
    digests: Sequence[str],
    kind: type,
) -> Any:
    """Read columns (C, R) of a table for rows of given digests; None or NaN where there is none."""
    first: dict[str, int] = {}
    # Two cases of a campaign may be one test case.
    places = [first.setdefault(digest, row) for row, digest in enumerate(digests)]
    columns: Any = np.full(
        (len(names), len(digests)), None if kind is object else np.nan, dtype=kind
    )
    query = f"SELECT {', '.join((key, *names))} FROM {table}"  # noqa: S608 - own names
    for chunk in _chunks(connection, query):
        rows = np.array([first.get(row[0], -1) for row in chunk], dtype=np.int64)
        values: Any = np.array([row[1:] for row in chunk], dtype=kind)
        columns[:, rows[rows >= 0]] = values[rows >= 0].T
    return columns[:, places] if len(first) < len(digests) else columns


def encode_points(points: Iterable[Mapping[str, Any]]) -> dict[str, Labels]:
    """Encode swept points by axis.

    Args:
        points: Of each run, values by axis.
    """
    columns: dict[str, list[Any]] = {}
    for row, point in enumerate(points):
        for name, value in point.items():
            if name not in columns:
                columns[name] = [None] * row
            columns[name].append(value)
        for column in columns.values() if len(point) < len(columns) else ():
            column.extend([None] * (row + 1 - len(column)))
    return {name: Labels.of(column) for name, column in columns.items()}


def _chunks(connection: Connection, query: str, *values: str) -> Iterator[list[tuple[Any, ...]]]:
    # The cursor of the driver: a row object of SQLAlchemy costs more than the row.
    cursor: Any = connection.exec_driver_sql(query, values).cursor
    while chunk := cursor.fetchmany(_CHUNK):
        yield chunk
