"""Bring results of one database into another: those of shards and colleagues, or those to keep.

The source is only read, as known columns of known tables, and nothing of it counts that is not as
it was written: every row is checked as ``db verify`` does. Rows go over as they are, with their
hashes; what numbers them locally is given anew. What is there already stays, and has to be the
same. Tallies are counted here, of the blocks that have all their results by now.

Kept traces are files beside a database, and stay there: a run whose trace is elsewhere is executed
again where only its trace could judge it.

A copy of chosen campaigns is a database of its own: it has every row that they refer to as it is,
under the same numbers, and what the whole database told of them.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from sqlalchemy import Connection, Row, Table, select

from adeye.errors import InputError, IntegrityError
from adeye.store import tables
from adeye.store.catalogue import is_server, rows_among, table_names
from adeye.store.database import Database
from adeye.store.encoding import chunked, next_number, row, stored_rows
from adeye.store.evidence.ledger_check import refuse
from adeye.store.evidence.roots import campaign_sums
from adeye.store.evidence.verification import verify
from adeye.store.ledger import insert_rows
from adeye.store.location import Location, Place, locate
from adeye.store.plugin_metrics import plugin_tables
from adeye.store.read.campaigns import latest_id
from adeye.store.schema import opened, require_current
from adeye.store.tables import LEDGER, kept_trace, metadata
from adeye.store.views import ensure_scenario_views
from adeye.store.write.content import executable_digest
from adeye.store.write.planning import save_use, used_at
from adeye.store.write.plugin_metrics import ensure_same_table
from adeye.store.write.queue import add_block, close_blocks, note_failure

"""Altered rows that a message names."""

OF_CAMPAIGN: Final = frozenset(
    {"campaign", "campaign_case", "campaign_fsr", "case_count", "case_match"}
)
"""Tables whose rows go over with a campaign that is new here."""
APPENDED: Final = frozenset({"session", "withdrawal", "certificate"})
"""Tables of what was done: what is not here yet goes over under a number of its own."""
LEFT: Final = frozenset(
    {"campaign_use", "tally", "case_run", "case_tally", "case_repeat", "never_held"}
    | {"work", "artifact", kept_trace.name}
    | {"ledger", "seal", "campaign_root"}
)
"""Tables of which nothing goes over: local history, what is counted here, and names of files."""
_RESULTS: Final = tuple(table for table in tables.RESULTS if table is not kept_trace)
_FIRST_STAYS: Final = {
    "odd": {"id", "version"},
    "scenario": {"id", "version"},
    "architecture": {"id", "version"},
    "concept": {"id", "version"},
    "test_case": {"odd_digest", "point_index"},
    # Words of a predicate that mean the same, see ``recording``.
    "verdict": {"predicate"},
}
"""Columns that may differ in a row that is here already."""
_EXECUTED: Final = {
    "scenario_digest": "scenario",
    "architecture_digest": "architecture",
    "faults": "faults",
}
"""Columns of a test case that may differ where what is executed is the same."""
_PLUGIN_TABLE: Final = re.compile(r"metric_[a-z0-9_]{1,80}")


@dataclass(frozen=True, slots=True)
class Merged:
    """What came over from a source.

    Attributes:
        source: The database file.
        campaigns: Ids of its campaigns, the latest last.
        runs: Results that were not here.
        rows: Rows of all tables that were not here.
        blocks: Blocks of work that need nothing any more by it.
        traces: Results of the source whose kept traces stay beside it.
    """

    source: str
    campaigns: tuple[str, ...]
    runs: int
    rows: int
    blocks: int
    traces: int


@dataclass(frozen=True, slots=True)
class Origin:
    """A source that is open and found to be as it was written.

    Attributes:
        place: Where it is.
        connection: Sees one state of it.
    """

    place: Location
    connection: Connection


@dataclass(frozen=True, slots=True)
class Copied:
    """What a copy has.

    Attributes:
        campaigns: Ids of its campaigns.
        runs: Its results, with forks, twins and drives of reference drivers.
        rows: Rows of all tables.
    """

    campaigns: tuple[str, ...]
    runs: int
    rows: int


def require_source(source: Place) -> None:
    """Refuse what cannot be merged at all, before anything is; its rows are not looked at.

    Raises:
        InputError: There is no such database.
        PlatformError: It cannot be used, is not ours or has another schema version.
    """
    with opened(source, is_read_only=True):
        pass


@contextmanager
def origin_of(source: Place) -> Iterator[Origin]:
    """Open a source and verify it; meanwhile the database that grows need not be there.

    Raises:
        InputError: There is no such database.
        PlatformError: It cannot be used, or has another schema version.
        IntegrityError: It is not as it was written.
    """
    place = locate(source)
    with opened(place, is_read_only=True) as connection:
        _require_sound(connection, place)
        yield Origin(place, connection)


def merge(into: Database, source: str | Path | Origin) -> Merged:
    """Add what another database has, in one transaction; again, it adds nothing.

    Args:
        into: The database that grows.
        source: The other one, by its place, or open.

    Raises:
        InputError: The source does not exist, or is the same database.
        PlatformError: One of them cannot be used, or has another schema version.
        IntegrityError: The source is not as it was written, or contradicts what is here.
    """
    with nullcontext(source) if isinstance(source, Origin) else origin_of(source) as origin:
        place = origin.place
        if place == into.location or _is_same_file(place.path, into.location.path):
            raise InputError(f"database {place}: it is the one that is merged into")
        with into.write() as writing:
            return _Merge(origin.connection, writing, place).run()


def _is_same_file(one: Path | None, other: Path | None) -> bool:
    return one is not None and other is not None and other.exists() and one.samefile(other)


def _require_sound(connection: Connection, path: Location) -> None:
    """Refuse a source of which anything is not as it was written.

    Raises:
        PlatformError: It has another schema version, or is not ours.
        IntegrityError: It was altered.
    """
    require_current(connection, path)
    known = set(table_names(connection))
    for table in metadata.sorted_tables:
        if table.name not in known:
            raise IntegrityError(f"database {path}: {table.name} is not a table of this release")
    refuse(f"database {path}", verify(connection))


class _Merge:
    """One source on its way into the database."""

    def __init__(self, source: Connection, into: Connection, path: Location) -> None:
        self._source, self._into, self._path = source, into, path
        self._numbers: dict[int, int] = {}
        self._differing: dict[int, str] = {}
        self._alike: dict[tuple[str, str], bool] = {}
        self._rows = 0
        self._runs = 0

    def run(self) -> Merged:
        """Copy table by table, in the order of their references."""
        campaigns = self._campaigns()
        here = self._into.exec_driver_sql("SELECT id FROM campaign").scalars()
        new = {item.id for item in campaigns} - set(here)
        for table in metadata.sorted_tables:
            self._copy(table, campaigns, new)
        found = self._source.execute(tables.work.select().order_by(tables.work.c.id))
        for block in found.all():
            bounds = block.from_ordinal, block.to_ordinal
            if block.campaign_id in new:
                add_block(self._into, block.campaign_id, block.kind, bounds, detail=block.detail)
            elif block.detail is not None:
                note_failure(self._into, block.campaign_id, bounds, block.detail)
        self._require_alike()
        for table in (*_RESULTS, *self._plugins()):
            if table is not tables.run:
                self._add(table, self._renumbered(table))
        ids = tuple(item.id for item in campaigns)
        blocks = sum(close_blocks(self._into, campaign) for campaign in self._waiting())
        if new:
            ensure_scenario_views(self._into)
        now = used_at(self._into)
        for name, at in used_at(self._source).items():
            if at > now[name]:  # who was planned last stays so, whoever is merged into whom
                save_use(self._into, name, at)
        kept = "SELECT COUNT(DISTINCT run_number) FROM kept_trace"
        left = int(self._source.exec_driver_sql(kept).scalar_one())
        return Merged(str(self._path), ids, self._runs, self._rows, blocks, left)

    def _copy(self, table: Table, campaigns: Sequence[Row[Any]], new: set[str]) -> None:
        """Copy what a table has, unless it waits for the numbers of the runs."""
        if table is tables.run:
            self._copy_runs()
        elif table is tables.campaign:
            self._copy_campaigns(campaigns, new)
        elif table.name in OF_CAMPAIGN:
            for campaign in sorted(new):
                self._insert(
                    table, stored_rows(self._source, table, "campaign_id = ?", (campaign,))
                )
        elif table.name in APPENDED:
            self._append(table)
        elif table.name not in LEFT and table not in _RESULTS:
            self._add(table, stored_rows(self._source, table))

    def _campaigns(self) -> list[Row[Any]]:
        """Read the campaigns of the source, the latest last."""
        found = self._source.execute(tables.campaign.select().order_by(tables.campaign.c.number))
        latest = latest_id(self._source)
        return sorted(found.all(), key=lambda item: item.id == latest)

    def _waiting(self) -> list[str]:
        """Return the campaigns with open blocks, those of the source and those that were here.

        Files whose texts differ are two campaigns that share their results.
        """
        work = tables.work
        asked = select(work.c.campaign_id).where(work.c.state == "pending").distinct()
        return sorted(self._into.execute(asked).scalars())

    def _copy_campaigns(self, campaigns: Sequence[Row[Any]], new: set[str]) -> None:
        table = tables.campaign
        for item in campaigns:
            if item.id in new:
                number = next_number(self._into, "campaign")
                self._insert(table, [row(table, (number, *item[1:-1]))])
                continue
            here = self._into.execute(table.select().where(table.c.id == item.id)).one()
            for name in ("odd_digest", "concept_digest", "planned", "judging_hash"):
                if getattr(here, name) != getattr(item, name):
                    raise self._contradiction(table, item.id, name)

    def _append(self, table: Table) -> None:
        """Add what was done elsewhere, so that who executed and what was withdrawn stays known."""
        names = ", ".join(table.columns.keys()[1:-1])
        asked = f"SELECT {names} FROM {table.name}"  # noqa: S608 - own names
        here = {tuple(item) for item in self._into.exec_driver_sql(asked)}
        number = next_number(self._into, table.name)
        rows: list[tuple[Any, ...]] = []
        for _number, *values, _row_hash in stored_rows(self._source, table):
            if tuple(values) not in here:
                here.add(tuple(values))
                rows.append(row(table, (number + len(rows), *values)))
        self._insert(table, rows)

    def _copy_runs(self) -> None:
        """Add results under new numbers; one that is here must have the same trace."""
        table, names = tables.run, tables.run.columns.keys()
        number = next_number(self._into)
        for chunk in chunked(stored_rows(self._source, table)):
            known = self._known(table, chunk, [names.index("result_digest")])
            fresh: list[tuple[Any, ...]] = []
            for values in chunk:
                item = dict(zip(names, values, strict=True))
                stored = known.get((item["result_digest"],))
                if stored is None:
                    self._numbers[values[0]] = number
                    fresh.append((number, *values[1:]))
                    number += 1
                    continue
                self._numbers[values[0]] = stored[0]
                here = dict(zip(names, stored, strict=True))
                if here["result_hash"] == item["result_hash"]:
                    continue
                if not (here["machine_dependent"] or item["machine_dependent"]):
                    raise self._contradiction(table, item["result_digest"], "result_hash")
                # Of a result that depends on the machine the first execution stays.
                self._differing[values[0]] = item["result_digest"]
            self._insert(table, fresh)
            self._runs += len(fresh)

    def _require_alike(self) -> None:
        """Refuse a source whose verdicts would be lost with executions of which the first stays."""
        columns = "run_number, fsr_digest, verdict, margin"
        at = {number: self._numbers[number] for number in self._differing}
        found = rows_among(self._into, tables.verdict, columns, "run_number", at.values())
        here = {(run, fsr): judged for run, fsr, *judged in found}
        there = rows_among(self._source, tables.verdict, columns, "run_number", at)
        other = {run for run, fsr, *judged in there if here.get((at[run], fsr)) != judged}
        if other:
            which = f"of run {self._differing[min(other)][:12]}, the first of {len(other):,} that "
            which += "depend on the machine,"
            raise self._contradiction(tables.verdict, which, "verdict or margin")

    def _renumbered(self, table: Table) -> Iterator[tuple[Any, ...]]:
        for number, *values in stored_rows(self._source, table):
            if number not in self._differing:
                yield (self._numbers[number], *values)

    def _plugins(self) -> list[Table]:
        """Make the tables of the metrics of plug-ins that the source has."""
        found = plugin_tables(self._source)
        for table in found:
            if _PLUGIN_TABLE.fullmatch(table.name) is None:
                raise IntegrityError(f"database {self._path}: {table.name!r} is no table of adeye")
            ensure_same_table(self._into, table)
        return list(found)

    def _add(self, table: Table, rows: Iterable[tuple[Any, ...]]) -> None:
        """Add rows that are not here; those that are have to be the same."""
        names = table.columns.keys()
        key = [names.index(column.name) for column in table.primary_key.columns]
        free = {*_FIRST_STAYS.get(table.name, ()), "row_hash"}
        compared = [place for place, name in enumerate(names) if name not in free]
        for chunk in chunked(rows):
            known = self._known(table, chunk, key)
            fresh = []
            for values in chunk:
                here = known.get(tuple(values[place] for place in key))
                if here is None:
                    fresh.append(values)
                    continue
                for at in compared:
                    if here[at] != values[at] and not self._same(names[at], here[at], values[at]):
                        shown = " ".join(str(values[place]) for place in key)
                        raise self._contradiction(table, shown, names[at])
            self._insert(table, fresh)

    def _same(self, name: str, here: Any, there: Any) -> bool:
        """Tell whether what a test case has in a column runs as what the source has there.

        It has one identity whatever its files are called and their texts say.
        """
        if name not in _EXECUTED:
            return False
        if (here, there) not in self._alike:
            kind = _EXECUTED[name]
            texts = [here, there]
            if kind in tables.CONTENT:
                table = tables.CONTENT[kind]
                texts = [
                    on.execute(select(table.c.content).where(table.c.digest == value)).scalar_one()
                    for on, value in ((self._into, here), (self._source, there))
                ]
            try:
                one, other = (executable_digest(kind, text) for text in texts)
            except ValueError:
                return False
            self._alike[here, there] = one == other
        return self._alike[here, there]

    def _known(
        self, table: Table, chunk: Sequence[Any], key: Sequence[int]
    ) -> dict[tuple[Any, ...], tuple[Any, ...]]:
        """Read the rows of the database whose key begins like one of some rows, by their key."""
        names = table.columns.keys()
        first = sorted({values[key[0]] for values in chunk})
        found = rows_among(self._into, table, ", ".join(names), names[key[0]], first)
        return {tuple(item[place] for place in key): tuple(item) for item in found}

    def _insert(self, table: Table, rows: Iterable[tuple[Any, ...]]) -> None:
        for chunk in chunked(rows):
            insert_rows(self._into, table, chunk)
            self._rows += len(chunk)

    def _contradiction(self, table: Table, key: str, column: str) -> IntegrityError:
        return IntegrityError(
            f"database {self._path}: {table.name} {key} has another {column} than the database it "
            "is merged into. Both were checked, so two executions differ, or other content has "
            f"the same name; nothing of {self._path} was merged."
        )


def copy(into: Database, source: str | Path | Location, campaigns: Sequence[str]) -> Copied:
    """Copy campaigns with all that they refer to into an empty database, in one transaction.

    Nothing of the source is changed. Files of kept traces are not copied here, see ``kept_files``.

    Args:
        into: One of the current schema without any campaign.
        source: The database that has them.
        campaigns: Ids of the campaigns.

    Raises:
        InputError: The other database has campaigns already.
        PlatformError: One of them cannot be used.
        IntegrityError: The source is not as it was written, or the copy is not the same.
    """
    with origin_of(source) as origin:
        place, reading = origin.place, origin.connection
        with into.write() as writing:
            if latest_id(writing) is not None:
                raise InputError(
                    f"database {into.location} has campaigns already",
                    remedy="Copy into a new one; 'adeye db merge' brings databases together.",
                )
            copied = _Copy(reading, writing, place).run_chosen(campaigns)
        with into.read() as written:
            _require_sound(written, into.location)
            for name in campaigns:
                if campaign_sums(written, name) != campaign_sums(reading, name):
                    raise IntegrityError(
                        f"database {into.location}: campaign {name[:12]} is not as in {place}. "
                        "Copy it again; nothing was changed there."
                    )
    return copied


_CHOSEN: Final = "(SELECT value FROM json_each(?))"
_KEPT_RUNS: Final = f"""(WITH RECURSIVE link(origin, result) AS (
    SELECT origin_digest, result_digest FROM fork
    UNION ALL SELECT origin_digest, result_digest FROM half_step
    UNION ALL SELECT result_digest, drive_digest FROM benchmark),
kept(digest) AS (
    SELECT result_digest FROM campaign_case WHERE campaign_id IN {_CHOSEN}
    UNION SELECT link.result FROM link JOIN kept ON link.origin = kept.digest)
SELECT digest FROM kept)"""  # noqa: S608 - own names
"""Results of chosen campaigns, with their forks, twins and drives of reference drivers."""
_NUMBERS: Final = f"(SELECT number FROM run WHERE result_digest IN {_KEPT_RUNS})"  # noqa: S608
_CASES: Final = f"""(
    SELECT test_case_digest FROM campaign_case WHERE campaign_id IN {_CHOSEN}
    UNION SELECT test_case_digest FROM run WHERE result_digest IN {_KEPT_RUNS})"""  # noqa: S608
_FORKS: Final = f"FROM fork WHERE origin_digest IN {_KEPT_RUNS}"
_OF_CASES: Final = f"FROM test_case WHERE digest IN {_CASES}"
_OF_CAMPAIGNS: Final = f"FROM campaign WHERE id IN {_CHOSEN}"
_KEPT: Final = {
    "campaign": f"id IN {_CHOSEN}",
    "test_case": f"digest IN {_CASES}",
    "odd": f"digest IN (SELECT odd_digest {_OF_CAMPAIGNS} UNION SELECT odd_digest {_OF_CASES})",
    "scenario": f"digest IN (SELECT scenario_digest {_OF_CASES})",
    "architecture": f"digest IN (SELECT architecture_digest {_OF_CASES})",
    "concept": f"digest IN (SELECT concept_digest {_OF_CAMPAIGNS})",
    "uid_set": f"digest IN (SELECT uid_set_digest FROM basis WHERE run_number IN {_NUMBERS})",  # noqa: S608
    "fork": f"origin_digest IN {_KEPT_RUNS}",
    "half_step": f"origin_digest IN {_KEPT_RUNS}",
    "takeover": f"fork_digest IN (SELECT result_digest {_FORKS})",
}
"""Which rows of a table go with chosen campaigns."""
_KEPT_BY: Final = {
    "campaign_id": f"campaign_id IN {_CHOSEN}",
    "run_number": f"run_number IN {_NUMBERS}",
    "result_digest": f"result_digest IN {_KEPT_RUNS}",
    "concept_digest": f"concept_digest IN (SELECT concept_digest {_OF_CAMPAIGNS})",
}
"""The same of any other table, by the first of these columns that it has."""


def kept_condition(table: Table) -> str:
    """Say in SQL which rows of a table go with chosen campaigns; each parameter is their ids."""
    by_column = (text for name, text in _KEPT_BY.items() if name in table.columns)
    return _KEPT.get(table.name) or next(by_column)


class _Copy(_Merge):
    """Chosen campaigns on their way into an empty database."""

    def run_chosen(self, campaigns: Sequence[str]) -> Copied:
        """Copy every row that belongs to them, in the order of the references."""
        ids = json.dumps(list(campaigns))
        self._require_certificates(ids)
        for table in (*metadata.sorted_tables, *self._plugins()):
            if table in LEDGER:
                # They tell of transactions: that of the copy adds its own.
                continue
            condition = kept_condition(table)
            rows = stored_rows(self._source, table, condition, (ids,) * condition.count("?"))
            if table in tables.INSERT_ONLY or table.name not in metadata.tables:
                self._insert(table, rows)
            else:
                self._insert_changeable(table, rows)
        if is_server(self._into):
            self._into.exec_driver_sql(
                "SELECT setval(pg_get_serial_sequence('work', 'id'), (SELECT MAX(id) FROM work))"
            )
        ensure_scenario_views(self._into)
        runs = self._into.exec_driver_sql("SELECT COUNT(*) FROM run").scalar_one()
        return Copied(tuple(campaigns), runs, self._rows)

    def _require_certificates(self, ids: str) -> None:
        """Refuse to leave behind what a certificate of another campaign has against a result.

        Raises:
            InputError: One has something.
        """
        others = [
            (campaign, {item["run"] for item in json.loads(findings)})
            for campaign, findings in self._source.exec_driver_sql(
                "SELECT campaign_id, findings FROM certificate WHERE campaign_id NOT IN "  # noqa: S608 - own names
                f"{_CHOSEN} ORDER BY number",
                (ids,),
            )
        ]
        if not any(runs for _, runs in others):
            return
        query = f"SELECT digest FROM {_KEPT_RUNS} AS kept"  # noqa: S608 - own names
        kept = set(self._source.exec_driver_sql(query, (ids,)).scalars())
        for campaign, runs in others:
            if runs & kept:
                raise InputError(
                    f"{len(runs & kept):,} of the results came out otherwise for a certificate of "
                    f"campaign {campaign[:10]}",
                    remedy=f"Copy that as well: --campaign {campaign[:10]}.",
                )

    def _insert_changeable(self, table: Table, rows: Iterable[tuple[Any, ...]]) -> None:
        """Insert blocks and names of files; nobody here holds a block that is leased elsewhere."""
        free = {"state": "pending", "owner": None, "until": None, "until_boot_s": None}
        for values in rows:
            item = dict(zip(table.columns.keys(), values, strict=True))
            is_leased = item.get("state") == "leased"
            self._into.execute(table.insert().values(item | (free if is_leased else {})))
            self._rows += 1
