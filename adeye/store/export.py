"""Read a campaign out, part by part: what an export writes, in an order of its own.

Everything comes from one state of the database, in ranges of ordinals, so that memory does not
grow with the campaign. Rows are sorted here, not by the database: two databases that hold the same
campaign give the same rows in the same order, whatever their collation.
"""

from __future__ import annotations

import json
from contextlib import contextmanager
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import text

from adeye.errors import InputError, suggest
from adeye.store import reading, summaries
from adeye.store.database import Database, database_path
from adeye.store.export_columns import (
    PARAMETERS_AFTER,
    TABLES,
    ExportColumn,
    ExportTable,
    Kind,
    metric_columns,
    unit_of,
)
from adeye.store.scenario_view import identifier, unique_name
from adeye.store.schema import require_current, require_exists

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from sqlalchemy import Connection

    from adeye.store.stored import CampaignInfo

CHUNK_CASES: Final = 4096
"""Test cases that are read at once."""

_CASES: Final = (
    "SELECT c.scenario, t.parameters, c.point FROM campaign_case c "
    "JOIN test_case t ON t.digest = c.test_case_digest "
    "WHERE c.campaign_id = :campaign AND c.ordinal >= :first AND c.ordinal < :last"
)
_FSRS: Final = (
    "SELECT DISTINCT fsr_id FROM campaign_fsr WHERE campaign_id = :campaign AND applicable = 1"
)
_UNITS: Final = "SELECT units FROM campaign WHERE id = :campaign"
_KINDS: Final[Mapping[type, Kind]] = {bool: "flag", int: "number", float: "number", str: "text"}

Place = tuple[str, str, str]
"""Scenario, ``parameters`` or ``point``, and key of a parameter."""


@dataclass(frozen=True)
class Chunk:
    """Some rows of a table.

    Attributes:
        table: Its name.
        columns: Values by column, None where there is none; columns have equal lengths.
    """

    table: str
    columns: Sequence[Sequence[Any]]


@dataclass(frozen=True)
class _Parameters:
    """Columns of parameters.

    Attributes:
        columns: In the order of the file.
        places: For each column, by scenario, where its value stands.
    """

    columns: tuple[ExportColumn, ...]
    places: tuple[Mapping[str, tuple[str, str]], ...]


class CampaignExport:
    """A campaign to be written to files; valid as long as its connection."""

    def __init__(
        self,
        connection: Connection,
        campaign: CampaignInfo,
        names: Sequence[str],
        *,
        with_provenance: bool,
    ) -> None:
        """Find out which columns the tables have.

        Args:
            connection: In a transaction.
            campaign: The campaign.
            names: Tables to read.
            with_provenance: Whether columns are read that differ between two executions.
        """
        self.campaign = campaign
        self.done = summaries.progress(connection, campaign.id).executed
        self._connection = connection
        chosen = {name: _without_provenance(TABLES[name], keep=with_provenance) for name in names}
        self._fsrs: tuple[str, ...] = ()
        self._parameters = _Parameters((), ())
        if "runs" in chosen:
            self._fsrs = tuple(sorted(self._rows_of(_FSRS, lambda row: str(row[0]))))
            self._parameters = self._find_parameters(chosen["runs"])
            chosen["runs"] = self._wide(chosen["runs"])
        self.tables: Mapping[str, ExportTable] = chosen

    def chunks(self) -> Iterator[Chunk]:
        """Read all rows of all tables, those of a table in its order."""
        by_case = [name for name in self.tables if "ordinal" in TABLES[name].order]
        for first in range(0, self.campaign.planned, CHUNK_CASES):
            verdicts = None
            if "verdicts" in by_case or "runs" in by_case:
                verdicts = self._read(self._source("verdicts"), first)
            if "runs" in by_case and verdicts is not None:
                yield Chunk("runs", self._runs(first, verdicts))
            if "verdicts" in by_case and verdicts is not None:
                yield Chunk("verdicts", verdicts)
            if "events" in by_case:
                yield Chunk("events", self._read(self.tables["events"], first))
        yield from (
            Chunk(name, self._read(table))
            for name, table in self.tables.items()
            if name not in by_case
        )

    def _source(self, name: str) -> ExportTable:
        return self.tables.get(name, TABLES[name])

    def _read(
        self, table: ExportTable, first: int | None = None, names: Sequence[str] = ()
    ) -> list[Sequence[Any]]:
        """Read columns of a table, sorted, of a range of test cases or of all.

        Args:
            table: The table.
            first: First ordinal of the range.
            names: Columns of its view; those of the table unless given.
        """
        kinds = {column.name: column.kind for column in table.columns}
        names = names or list(kinds)
        where = "" if first is None else " AND ordinal >= :first AND ordinal < :last"
        query = f"SELECT {', '.join(names)} FROM {table.view} WHERE campaign = :campaign{where}"  # noqa: S608 - names of this package
        rows = self._rows_of(query, tuple, first)
        rows.sort(key=itemgetter(*map(names.index, table.order)))
        columns = zip(*rows, strict=True) if rows else ((),) * len(names)
        return [
            _converted(kinds.get(name, "text"), values)
            for name, values in zip(names, columns, strict=True)
        ]

    def _rows_of(
        self, query: str, take: Callable[[Any], Any], first: int | None = None
    ) -> list[Any]:
        bound: dict[str, Any] = {"campaign": self.campaign.id}
        if first is not None:
            bound |= {"first": first, "last": first + CHUNK_CASES}
        return list(map(take, self._connection.execute(text(query), bound)))

    def _wide(self, runs: ExportTable) -> ExportTable:
        """Add the columns of parameters, verdicts and metrics."""
        names = [column.name for column in runs.columns]
        place = names.index(PARAMETERS_AFTER) + 1
        taken = {column.name for column in self._parameters.columns}
        verdicts = []
        for fsr in self._fsrs:
            name = unique_name(f"verdict_{identifier(fsr)}", taken)
            taken.add(name)
            verdicts.append(ExportColumn(name, "text", text=f"verdict of {fsr}"))
        columns = (
            *runs.columns[:place],
            *self._parameters.columns,
            *runs.columns[place:],
            *metric_columns(),
            *verdicts,
        )
        return replace(runs, columns=columns)

    def _runs(self, first: int, verdicts: Sequence[Sequence[Any]]) -> list[Sequence[Any]]:
        """Read runs; their parameters and verdicts become columns."""
        table = self.tables["runs"]
        added = len(self._parameters.columns), len(self._fsrs)
        place = [column.name for column in table.columns].index(PARAMETERS_AFTER) + 1
        of_view = [
            *table.columns[:place], *table.columns[place + added[0] : len(table.columns) - added[1]]
        ]  # fmt: skip
        names = [column.name for column in of_view]
        columns = self._read(
            replace(table, columns=tuple(of_view)), first, [*names, "parameters", "point"]
        )
        *columns, parameters, points = columns
        scenarios, ordinals = columns[names.index("scenario")], columns[names.index("ordinal")]
        return [
            *columns[:place],
            *self._parameter_columns(scenarios, parameters, points),
            *columns[place:],
            *self._verdict_columns(ordinals, verdicts),
        ]

    def _parameter_columns(
        self, scenarios: Sequence[str], parameters: Sequence[str], points: Sequence[str]
    ) -> Iterator[list[Any]]:
        found = [
            {"parameters": json.loads(one), "point": json.loads(other)}
            for one, other in zip(parameters, points, strict=True)
        ]
        for column, places in zip(self._parameters.columns, self._parameters.places, strict=True):
            values = []
            for scenario, row in zip(scenarios, found, strict=True):
                source, key = places.get(scenario, ("point", ""))
                values.append(_parameter(column.kind, row[source].get(key)))
            yield values

    def _verdict_columns(
        self, ordinals: Sequence[int], verdicts: Sequence[Sequence[Any]]
    ) -> list[list[str | None]]:
        names = [column.name for column in self._source("verdicts").columns]
        of_run = {ordinal: row for row, ordinal in enumerate(ordinals)}
        of_fsr = {fsr: place for place, fsr in enumerate(self._fsrs)}
        columns: list[list[str | None]] = [[None] * len(ordinals) for _ in self._fsrs]
        chosen = (verdicts[names.index(name)] for name in ("ordinal", "fsr", "verdict"))
        for ordinal, fsr, verdict in zip(*chosen, strict=True):
            row = of_run.get(ordinal)
            if row is not None:
                columns[of_fsr[fsr]][row] = verdict
        return columns

    def _find_parameters(self, runs: ExportTable) -> _Parameters:
        """Look at every test case: which parameters there are, and whether they are numbers."""
        (stored,) = self._rows_of(_UNITS, lambda row: json.loads(row[0]))
        kinds: dict[Place, set[Kind | None]] = {}
        for first in range(0, self.campaign.planned, CHUNK_CASES):
            for scenario, parameters, point in self._rows_of(_CASES, tuple, first):
                named = json.loads(parameters)
                swept = {k: v for k, v in json.loads(point).items() if k not in named}
                for source, values in (("parameters", named), ("point", swept)):
                    for key, value in values.items():
                        found = kinds.setdefault((scenario, source, key), set())
                        if value is not None:
                            found.add(_KINDS.get(type(value)))
        by_name: dict[tuple[str, str], dict[Place, set[Kind | None]]] = {}
        for (scenario, source, key), found in kinds.items():
            suffix = stored.get(scenario, {}).get(key, "")
            name = f"{key}_{suffix}" if suffix else key
            by_name.setdefault((name, suffix), {})[scenario, source, key] = found
        return _named(by_name, {column.name for column in (*runs.columns, *metric_columns())})


def _named(
    by_name: Mapping[tuple[str, str], Mapping[Place, set[Kind | None]]], taken: set[str]
) -> _Parameters:
    columns, places = [], []
    for (wanted, suffix), found in sorted(by_name.items()):
        name = unique_name(wanted, taken)
        taken.add(name)
        kinds = set[Kind | None]().union(*found.values())
        # Values of several kinds, and lists, are written as JSON.
        kind = kinds.pop() if len(kinds) == 1 else None
        unit = unit_of(f"x_{suffix}") if suffix else ""
        key = next(iter(found))[2]
        columns.append(ExportColumn(name, kind or "text", unit, f"parameter {key}"))
        places.append({scenario: (source, key) for scenario, source, key in found})
    return _Parameters(tuple(columns), tuple(places))


def _parameter(kind: Kind, value: Any) -> Any:
    if value is None:
        return None
    if kind == "number":
        return float(value)
    if kind == "text" and not isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return value


def _converted(kind: Kind, values: Sequence[Any]) -> Sequence[Any]:
    """Give what is stored the type of its column."""
    if kind == "flag":
        return [None if value is None else bool(value) for value in values]
    if kind == "count":
        return [None if value is None else int(value) for value in values]
    return values


def _without_provenance(table: ExportTable, *, keep: bool) -> ExportTable:
    columns = tuple(column for column in table.columns if keep or not column.is_provenance)
    return replace(table, columns=columns)


@contextmanager
def open_export(
    location: str | Path | None,
    campaign: str | None,
    names: Iterable[str] = tuple(TABLES),
    *,
    with_provenance: bool = False,
) -> Iterator[CampaignExport]:
    """Open a campaign for reading it out.

    Args:
        location: The database, as everywhere.
        campaign: Its number or the beginning of its id; None for the latest.
        names: Tables to read.
        with_provenance: Whether columns are read that differ between two executions.

    Raises:
        InputError: There is no such database, campaign or table.
        PlatformError: The database cannot be read.
    """
    chosen = list(dict.fromkeys(names))
    for name in chosen:
        if name not in TABLES:
            raise InputError(
                f"export: there is no table {name!r}, only {', '.join(TABLES)}",
                remedy=suggest(name, TABLES),
            )
    path = database_path(location)
    require_exists(path)
    database = Database(path)
    try:
        with database.read() as connection:
            require_current(connection, path)
            found = reading.find_campaign(connection, campaign)
            yield CampaignExport(connection, found, chosen, with_provenance=with_provenance)
    finally:
        database.close()
