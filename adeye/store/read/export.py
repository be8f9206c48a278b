"""Read a campaign out, part by part: what an export writes, in an order of its own.

Everything comes from one state of the database, in ranges of ordinals, so that memory does not
grow with the campaign. Rows are sorted here, not by the database: two databases that hold the same
campaign give the same rows in the same order, whatever their collation.

They hold what the views hold, by the same names, so that a query over ``v_verdicts`` runs over
``verdicts`` as well. ``runs`` has parameters and verdicts as columns in place of JSON.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Any, Final, Literal

from sqlalchemy import Connection, text

from adeye.errors import InputError, require_known
from adeye.store.evidence.verification import require_sound
from adeye.store.location import Place
from adeye.store.read import campaigns as reading
from adeye.store.records import CampaignInfo
from adeye.store.schema import opened
from adeye.store.tables import METRIC_IDS
from adeye.store.views import identifier, unique_name

# --- The tables of an export and their columns: name, kind, SI unit, meaning ----------------------

Kind = Literal["text", "number", "count", "flag"]

SUFFIX_UNITS: Final = {
    "m": "m",
    "s": "s",
    "s2": "s²",
    "mps": "m/s",
    "mps2": "m/s²",
    "mps3": "m/s³",
    "rad": "rad",
    "radps": "rad/s",
    "radps2": "rad/s²",
    "hz": "Hz",
    "pm": "1/m",
}
"""SI unit by the suffix that names of columns carry."""


@dataclass(frozen=True, slots=True)
class ExportColumn:
    """A column of an exported table.

    Attributes:
        name: As in the view.
        kind: Text, number (64-bit floating point), count (64-bit integer) or flag.
        unit: SI unit; empty for none.
        text: What it means; empty if the name says it.
        is_provenance: Whether it differs between two executions of one plan.
    """

    name: str
    kind: Kind
    unit: str = ""
    text: str = ""
    is_provenance: bool = False


@dataclass(frozen=True, slots=True)
class ExportTable:
    """An exported table.

    Attributes:
        name: Of the table, and of its file.
        view: The view that it is read from.
        text: What one row is.
        order: Columns that its rows are sorted by.
        columns: In the order of the file.
    """

    name: str
    view: str
    text: str
    order: tuple[str, ...]
    columns: tuple[ExportColumn, ...]


def unit_of(name: str) -> str:
    """Read the SI unit from the suffix of a name; empty if it has none.

    >>> unit_of("max_jerk_mps3"), unit_of("min_time_headway_s"), unit_of("campaign")
    ('m/s³', 's', '')
    """
    stem, _, suffix = name.rpartition("_")
    return SUFFIX_UNITS.get(suffix, "") if stem else ""


def _column(kind: Kind, name: str, text: str = "") -> ExportColumn:
    return ExportColumn(name, kind, unit_of(name) if kind == "number" else "", text)


def _columns(kind: Kind, *names: str) -> tuple[ExportColumn, ...]:
    return tuple(_column(kind, name) for name in names)


_CAMPAIGN: Final = _column("text", "campaign", "id of the campaign")
_ORDINAL: Final = _column("count", "ordinal", "place of the test case in the plan, from 0")
_RUN: Final = _column("text", "run", "digest of the result")
_UNIT: Final = _column("text", "unit", "unit of margin, value and threshold")
_CASE: Final = (_CAMPAIGN, _ORDINAL, *_columns("text", "scenario", "architecture", "fault_entry"))

PARAMETERS_AFTER: Final = "inside_odd"
"""Column of ``runs`` that those of the parameters follow."""

RUNS: Final = ExportTable(
    "runs",
    "v_runs",
    "one row a run: a planned test case without a result is not in it, but in verdicts",
    ("ordinal",),
    (
        *_CASE,
        *_columns("count", "replicate", "seed"),
        *_columns("flag", "inside_odd"),
        _RUN,
        *_columns("text", "test_case", "situation", "outcome", "outcome_channel", "outcome_detail"),
        *_columns("flag", "realised"),
        *_columns("text", "end_reason"),
        *_columns("number", "duration_s"),
        *_columns("text", "backend", "trace_digest"),
        *_columns("flag", "machine_dependent"),
        ExportColumn("executed_at", "text", text="UTC time of execution", is_provenance=True),
    ),
)
"""Without metrics, parameters and verdicts, which ``campaign_tables`` adds."""

VERDICTS: Final = ExportTable(
    "verdicts",
    "v_verdicts",
    "one row a run and FSR that it is judged on; NOT_RUN where there is no result",
    ("ordinal", "fsr"),
    (
        *_CASE,
        _RUN,
        *_columns("text", "test_case", "fsr", "asil"),
        *_columns("flag", "mandatory"),
        *_columns("text", "verdict"),
        *_columns("flag", "exercised"),
        _column("number", "margin", "signed distance to the threshold, in its unit"),
        _UNIT,
        *_columns("number", "robustness_low", "robustness_high"),
        *_columns("text", "signal", "predicate"),
        *_columns("number", "time_s"),
        *_columns("text", "actor"),
        *_columns("number", "value", "threshold"),
        *_columns("text", "detail"),
    ),
)
EVENTS: Final = ExportTable(
    "events",
    "v_timeline",
    "one row an event of a run: storyboard, faults, monitors, handovers, contact",
    ("ordinal", "seq"),
    (
        *_CASE,
        _RUN,
        *_columns("count", "seq"),
        *_columns("number", "time_s"),
        *_columns("text", "kind", "subject", "text"),
    ),
)
FSR_STATUS: Final = ExportTable(
    "fsr_status",
    "v_fsr_status",
    "one row an FSR, architecture and scenario: runs by verdict, the worst one, folded verdict",
    ("fsr", "architecture", "scenario"),
    (
        _CAMPAIGN,
        *_columns("text", "fsr", "architecture", "scenario", "asil"),
        *_columns("flag", "mandatory", "in_gate", "applicable"),
        *_columns("text", "reason"),
        *_columns("count", "min_exercised"),
        *_columns("text", "waived_until"),
        *_columns(
            "count", "planned", "n_fail", "n_error", "n_invalid", "n_inconclusive", "n_vacuous"
        ),
        *_columns("count", "n_pass", "n_not_run", "exercised"),
        *_columns("number", "worst_margin"),
        _UNIT,
        *_columns("number", "worst_robustness"),
        *_columns("text", "worst_run", "verdict"),
        *_columns("count", "runs_exercised", "repeated", "repeated_pass"),
    ),
)

TABLES: Final = {item.name: item for item in (RUNS, VERDICTS, EVENTS, FSR_STATUS)}
"""Every table that can be exported, by name."""


def metric_columns() -> tuple[ExportColumn, ...]:
    """List value, status, time and actor of every built-in metric with unit and meaning."""
    from adeye.judge.metrics import METRICS

    found: list[ExportColumn] = []
    for name in METRIC_IDS:
        known = METRICS.get(name)
        unit = unit_of(name) if known is None or known.unit == "1" else known.unit
        found += [
            ExportColumn(name, "number", unit, "" if known is None else known.text),
            ExportColumn(f"{name}_status", "text", text=f"whether {name} has a value, and why not"),
            ExportColumn(f"{name}_time_s", "number", "s", f"time of the worst case of {name}"),
            ExportColumn(f"{name}_actor", "text", text=f"actor of the worst case of {name}"),
        ]
    return tuple(found)


# --- Read a campaign out, part by part: what an export writes, in an order of its own -------------

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

Key = tuple[str, str, str]
"""Scenario, ``parameters`` or ``point``, and key of a parameter."""
Places = dict[ExportColumn, Mapping[str, tuple[str, str]]]
"""Columns of parameters in the order of the file, and by scenario where the value of one stands."""


@dataclass(frozen=True)
class Chunk:
    """Some rows of a table.

    Attributes:
        table: Its name.
        columns: Values by column, None where there is none; columns have equal lengths.
    """

    table: str
    columns: Sequence[Sequence[Any]]


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
        self.done = reading.progress(connection, campaign.id).executed
        self._connection = connection
        chosen = {name: _without_provenance(TABLES[name], keep=with_provenance) for name in names}
        self._fsrs: tuple[str, ...] = ()
        self._parameters: Places = {}
        if "runs" in chosen:
            self._fsrs = tuple(sorted(self._rows_of(_FSRS, lambda row: str(row[0]))))
            self._parameters = self._find_parameters(chosen["runs"])
            columns = (*chosen["runs"].columns, *metric_columns())
            self._of_view = replace(chosen["runs"], columns=columns)
            chosen["runs"] = self._wide(self._of_view)
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
        """Add the columns of parameters and verdicts."""
        place = _place_of_parameters(runs)
        taken = {column.name for column in self._parameters}
        verdicts = []
        for fsr in self._fsrs:
            name = unique_name(f"verdict_{identifier(fsr)}", taken)
            taken.add(name)
            verdicts.append(ExportColumn(name, "text", text=f"verdict of {fsr}"))
        columns = (
            *runs.columns[:place],
            *self._parameters,
            *runs.columns[place:],
            *verdicts,
        )
        return replace(runs, columns=columns)

    def _runs(self, first: int, verdicts: Sequence[Sequence[Any]]) -> list[Sequence[Any]]:
        """Read runs; their parameters and verdicts become columns."""
        place = _place_of_parameters(self._of_view)
        names = [column.name for column in self._of_view.columns]
        *columns, parameters, points = self._read(
            self._of_view, first, [*names, "parameters", "point"]
        )
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
        for column, places in self._parameters.items():
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

    def _find_parameters(self, runs: ExportTable) -> Places:
        """Look at every test case: which parameters there are, and whether they are numbers."""
        (stored,) = self._rows_of(_UNITS, lambda row: json.loads(row[0]))
        kinds: dict[Key, set[Kind | None]] = {}
        for first in range(0, self.campaign.planned, CHUNK_CASES):
            for scenario, parameters, point in self._rows_of(_CASES, tuple, first):
                named = json.loads(parameters)
                swept = {k: v for k, v in json.loads(point).items() if k not in named}
                for source, values in (("parameters", named), ("point", swept)):
                    for key, value in values.items():
                        found = kinds.setdefault((scenario, source, key), set())
                        if value is not None:
                            found.add(_KINDS.get(type(value)))
        by_name: dict[tuple[str, str], dict[Key, set[Kind | None]]] = {}
        for (scenario, source, key), found in kinds.items():
            suffix = stored.get(scenario, {}).get(key, "")
            name = f"{key}_{suffix}" if suffix else key
            by_name.setdefault((name, suffix), {})[scenario, source, key] = found
        return _named(by_name, {column.name for column in (*runs.columns, *metric_columns())})


def _named(
    by_name: Mapping[tuple[str, str], Mapping[Key, set[Kind | None]]], taken: set[str]
) -> Places:
    columns: Places = {}
    for (wanted, suffix), found in sorted(by_name.items()):
        name = unique_name(wanted, taken)
        taken.add(name)
        kinds = set[Kind | None]().union(*found.values())
        # Values of several kinds, and lists, are written as JSON.
        kind = kinds.pop() if len(kinds) == 1 else None
        unit = unit_of(f"x_{suffix}") if suffix else ""
        key = next(iter(found))[2]
        column = ExportColumn(name, kind or "text", unit, f"parameter {key}")
        columns[column] = {scenario: (source, key) for scenario, source, key in found}
    return columns


def _place_of_parameters(runs: ExportTable) -> int:
    return [column.name for column in runs.columns].index(PARAMETERS_AFTER) + 1


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
    place: Place,
    campaign: str | None,
    names: Iterable[str] = tuple(TABLES),
    *,
    with_provenance: bool = False,
) -> Iterator[CampaignExport]:
    """Open a campaign for reading it out.

    Args:
        place: The database, as everywhere.
        campaign: Its number or the beginning of its id; None for the latest.
        names: Tables to read.
        with_provenance: Whether columns are read that differ between two executions.

    Raises:
        InputError: There is no such database, campaign or table.
        IntegrityError: Results are not as they were written.
        PlatformError: The database cannot be read.
    """
    chosen = list(dict.fromkeys(names))
    only = f"only {', '.join(TABLES)}"
    said = "export: there is no table"
    require_known(chosen, TABLES, lambda name: f"{said} {name!r}, {only}", InputError)
    with opened(place) as connection:
        found = reading.find_campaign(connection, campaign)
        require_sound(connection, found.id)
        yield CampaignExport(connection, found, chosen, with_provenance=with_provenance)
