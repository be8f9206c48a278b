"""Write results: runs with metrics and events, verdicts, and the tallies over a block.

Beside the metrics that is: whether a contact ended a run, why no FSR can be judged on it, which
definitions its metrics have, and the samples that decide formulas of one comparison.

``recording.tally_rows`` and ``accounts.done_cases`` count the same from the database; ``db verify``
compares the two.
"""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, Final

import numpy as np
from sqlalchemy import Connection, Table, text

from adeye.errors import IntegrityError
from adeye.identity import digest as content_digest
from adeye.judge.outcome import OUTCOMES
from adeye.judge.verdict import VERDICTS, Verdict
from adeye.signals import Ints
from adeye.store import tables
from adeye.store.accounts import Done, done_cases, save_done
from adeye.store.block import NUMBERS, BasisBlock, JudgedBlock, RunBlock
from adeye.store.cases import JUDGED
from adeye.store.catalogue import rows_among, rows_of_runs
from adeye.store.encoding import (
    Column,
    Dictionary,
    Row,
    Texts,
    Words,
    bulk_hashes,
    hash_words,
    hashed_names,
    next_number,
    row,
    run_numbers,
    table_rows,
)
from adeye.store.ledger import add_row, insert_new, insert_rows
from adeye.store.plugin_metrics import plugin_tables
from adeye.store.records import values_of
from adeye.store.tables import basis, extreme, kept_trace, metadata, uid_set
from adeye.store.texts import json_text, utc_text
from adeye.store.views import WORST_FIRST
from adeye.store.write.plugin_metrics import metric_columns, record_plugin_metrics
from adeye.trace import LINK_TICKS

# --- What it takes to judge runs again without their traces: written with them, read to judge -----

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
    uids = content_digest(dict(block.uids))
    add_row(connection, uid_set, uids, json_text(dict(block.uids)), ignore_existing=True)
    version = np.full(len(numbers), block.version)
    columns = _columns(
        basis,
        block,
        result_digest=results,
        version=version,
        uid_set_digest=Texts.same(uids, len(numbers)),
    )
    _insert(connection, basis, numbers, columns, ignore_existing=True)
    found = block.extremes
    own = results[found.run]
    columns = _columns(extreme, found, result_digest=own, version=version[found.run])
    _insert(connection, extreme, numbers[found.run], columns, ignore_existing=True)
    kept = [(run, *place) for run, place in enumerate(block.files) if place is not None]
    if kept:
        runs, names, places = zip(*kept, strict=True)
        rows = np.array(runs)
        columns = [results[rows], Texts.of(names), np.array(places)]
        _insert(connection, kept_trace, numbers[rows], columns, ignore_existing=True)


def _columns(table: Table, source: object, **others: Column) -> list[Column]:
    """List what the hash of the rows of a table covers, see ``records.values_of``."""
    return values_of(hashed_names(table), source, **others)


def _insert(
    connection: Connection,
    table: Table,
    numbers: Ints,
    columns: Sequence[Column],
    words: Words | None = None,
    *,
    ignore_existing: bool = False,
) -> None:
    """Insert rows of runs by the numbers of these; the digest of its result is kept with a run."""
    stored = columns if table is tables.run else columns[1:]
    words = hash_words(columns) if words is None else words
    rows = table_rows([numbers, *stored], words, table)
    insert_rows(connection, table, rows, ignore_existing=ignore_existing)


def require_unaltered(connection: Connection, table: Table, numbers: Sequence[int]) -> None:
    """Refuse rows of runs that are not as they were written: what is made of them hangs on them.

    Raises:
        IntegrityError: One does not have its hash.
    """
    own = rows_among(connection, tables.run, "number, result_digest", "number", numbers)
    digests = dict(map(tuple, own))
    columns = ", ".join((*hashed_names(table)[1:], "row_hash"))
    found = rows_of_runs(connection, table, columns, numbers)
    rows = [(number, digests[number], *values) for number, *values in found]
    if rows and bulk_hashes(table, rows) != [values[-1] for values in rows]:
        raise IntegrityError(
            f"table {table.name}: rows are not as they were written, so that nothing is judged or "
            "proven by them. 'adeye db verify' names them; restore the database from a copy."
        )


def read_bases(
    connection: Connection, numbers: Sequence[int], version: int
) -> dict[int, tuple[bool, str | None, Mapping[str, str]]]:
    """Read whether contact ended runs, why they are invalid, and the uids of their metrics."""
    require_unaltered(connection, basis, numbers)
    found = connection.execute(uid_set.select())
    uids = {item.digest: json.loads(item.uids) for item in found}
    columns = "version, by_contact, invalid, uid_set_digest"
    return {
        number: (bool(by_contact), invalid, uids[digest])
        for number, own, by_contact, invalid, digest in rows_of_runs(
            connection, basis, columns, numbers
        )
        if own == version
    }


def read_metric(
    connection: Connection, numbers: Sequence[int], name: str
) -> dict[int, tuple[Any, ...]]:
    """Read value, status, time and actor of a metric, by number of the run."""
    everywhere = (*metadata.sorted_tables, *plugin_tables(connection))
    columns = f"{name}, {name}_status, {name}_time_s, {name}_actor"
    found: dict[int, tuple[Any, ...]] = {}
    twice: set[int] = set()
    for table in (item for item in everywhere if f"{name}_status" in item.columns):
        require_unaltered(connection, table, numbers)
        for number, *values in rows_of_runs(connection, table, columns, numbers):
            if number in found:
                twice.add(number)
            found[number] = tuple(values)
    # Of two plug-ins that measure under one name neither is known to be meant.
    return {number: values for number, values in found.items() if number not in twice}


def read_extremes(
    connection: Connection, numbers: Sequence[int], measure: str, version: int
) -> dict[int, Any]:
    """Read the samples that decide, as ``samples_text`` wrote them, by number of the run."""
    require_unaltered(connection, extreme, numbers)
    found = connection.exec_driver_sql(
        "SELECT run_number, samples FROM extreme WHERE measure = ? AND version = ? "
        "AND run_number IN (SELECT CAST(value AS INTEGER) FROM json_each(?))",
        (measure, version, json.dumps(list(numbers))),
    )
    return {item[0]: json.loads(item[1]) for item in found}


def read_files(connection: Connection, numbers: Sequence[int]) -> list[tuple[int, str, int]]:
    """Read where traces are kept: number of the run, name of the file, place in it."""
    found = rows_of_runs(connection, kept_trace, "file, place", numbers)
    return sorted(((item[0], item[1], item[2]) for item in found), key=itemgetter(1, 2))


def numbers_of(connection: Connection, results: Iterable[str]) -> dict[str, int]:
    """Give the numbers of those of some results that are there."""
    found = rows_among(connection, tables.run, "result_digest, number", "result_digest", results)
    return {item[0]: item[1] for item in found}


# --- Write results: runs with metrics and events, verdicts, and the tallies over a block ----------

RUN_HASHED = tuple(
    column.name
    for column in tables.run.columns
    if column.name not in {"number", "result_hash", "executed_by", "executed_at", "row_hash"}
)
"""Columns of ``run`` that the result hash covers."""

_TALLY = """
    WITH judged AS (
        SELECT w.campaign_id, f.fsr_id, f.fsr_digest, c.architecture, c.scenario, v.verdict,
            v.exercised, v.robustness_low AS worst_robustness, v.margin AS worst_margin,
            v.unit AS worst_unit, r.result_digest AS worst_result_digest
        FROM work w
        JOIN campaign_case c ON c.campaign_id = w.campaign_id
            AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal
        JOIN campaign_fsr f ON {judged}
        JOIN run r ON r.result_digest = c.result_digest
        JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
        WHERE w.id = :work_id),
    ranked AS (
        SELECT *, ROW_NUMBER() OVER same AS place, COUNT(*) OVER whole AS runs,
            SUM(exercised) OVER whole AS exercised_runs
        FROM judged
        WINDOW whole AS (PARTITION BY fsr_id, architecture, scenario, verdict),
            same AS (whole ORDER BY {worst_first}))
    SELECT :work_id, campaign_id, fsr_id, fsr_digest, architecture, scenario, verdict, runs,
        exercised_runs, worst_robustness, worst_margin, worst_unit, worst_result_digest
    FROM ranked WHERE place = 1 ORDER BY fsr_id, architecture, scenario, verdict
    """


def tally_rows(connection: Connection, work_id: int) -> list[Row]:
    """Count the verdicts of a block from the verdict rows, worst first within each count."""
    query = text(_TALLY.format(judged=JUDGED, worst_first=WORST_FIRST))
    return [
        row(tables.tally, tuple(counted))
        for counted in connection.execute(query, {"work_id": work_id})
    ]


def write_tallies(connection: Connection, work_id: int) -> None:
    """Save the tallies of a block that is done, but those that are there, and account for it."""
    add_tallies(connection, work_id)
    save_done(connection, work_id, done_cases(connection, work_id))


def add_tallies(
    connection: Connection, work_id: int, missing: Collection[str] = frozenset()
) -> None:
    """Save the tallies of a block, but those that are there and those of FSRs that it lacks."""
    known = tallied(connection, work_id)
    rows = [
        item
        for item in tally_rows(connection, work_id)
        if item[2] not in missing and (item[2], item[4], item[5]) not in known
    ]
    insert_rows(connection, tables.tally, rows)


def tallied(connection: Connection, work_id: int) -> set[tuple[str, str, str]]:
    """List the FSRs, architectures and scenarios of a block that are counted already."""
    found = connection.exec_driver_sql(
        "SELECT fsr_id, architecture, scenario FROM tally WHERE work_id = ?", (work_id,)
    )
    return {tuple(item) for item in found}


def result_hashes(run: Words, metrics: Words, events: Words, run_of_event: Ints) -> list[str]:
    """Hash results: trace digest, outcome, metrics and events (sha256 in hex).

    Args:
        run: (B, W) words of the columns ``RUN_HASHED``, see ``columns.hash_words``.
        metrics: (B, W) words of the metric rows without their hash.
        events: (E, W) words of the event rows without their hashes, run after run, in order.
        run_of_event: (E,) row of the run, ascending.
    """
    ends = np.searchsorted(run_of_event, np.arange(len(run) + 1)).tolist()
    run, metrics, events = (np.ascontiguousarray(words) for words in (run, metrics, events))
    return [
        hashlib.sha256(
            one.tobytes() + two.tobytes() + events[ends[place] : ends[place + 1]].tobytes()
        ).hexdigest()
        for place, (one, two) in enumerate(zip(run, metrics, strict=True))
    ]


@dataclass(frozen=True)
class Recorded:
    """What came of recording a block of results.

    Attributes:
        existing: Digests of results that were there before, or came twice.
        differing: Those that were there with another trace, because they depend on the machine.
    """

    existing: frozenset[str]
    differing: frozenset[str]


def record_runs(connection: Connection, block: RunBlock) -> Recorded:
    """Save results that are not there yet, without their verdicts.

    A result that exists must have the same trace: a test case has one result for each engine.

    Raises:
        IntegrityError: Two executions of one test case gave different traces.
        ValueError: The block lacks a metric or has another one.
    """
    if block.metrics.ids != tables.METRIC_IDS:
        unknown = sorted(set(block.metrics.ids) ^ set(tables.METRIC_IDS))
        msg = f"metrics {unknown} are missing from the result or unknown to the database"
        raise ValueError(msg)
    place: dict[str, int] = {}
    again: list[int] = []
    for run, digest in enumerate(block.result_digests):
        if place.setdefault(digest, run) != run:
            again.append(run)
    dependent = block.machine_dependent.tolist()
    differing: set[str] = set()
    for run in again:
        first = place[block.result_digests[run]]
        _differs(block, run, block.trace_digests[first], is_excused=dependent[first])
    existing = _existing(connection, block.result_digests)
    for digest, (trace_digest, machine_dependent) in existing.items():
        run = place[digest]
        if _differs(block, run, trace_digest, is_excused=bool(machine_dependent)):
            differing.add(digest)
    fresh = [run for digest, run in place.items() if digest not in existing]
    if fresh:
        chosen = block.take(np.array(fresh, dtype=np.int64))
        _insert_runs(connection, chosen)
        record_basis(connection, chosen.result_digests, chosen.basis)
    record_plugin_metrics(connection, block, frozenset(differing))
    known = {*existing, *(block.result_digests[run] for run in again)}
    return Recorded(frozenset(known), frozenset(differing))


NOTHING: Final = Recorded(frozenset(), frozenset())
"""What came of recording no result."""


def record_judged_runs(connection: Connection, block: RunBlock) -> Recorded:
    """Save results and their verdicts that are not there yet.

    Raises:
        IntegrityError: A result or verdict contradicts one that exists.
        ValueError: The block lacks a metric or has another one.
    """
    recorded = record_runs(connection, block)
    if recorded.differing:
        _require_alike(connection, block, recorded.differing)
    record_verdicts(
        connection,
        JudgedBlock(block.result_digests, block.verdicts),
        results=block.results,
        are_new=not recorded.existing,
        differing=recorded.differing,
    )
    return recorded


def _require_alike(connection: Connection, block: RunBlock, differing: frozenset[str]) -> None:
    """Refuse other executions of results that depend on the machine, unless they are judged alike.

    Raises:
        IntegrityError: A verdict or margin is another one than that of the first, or it has none.
    """
    numbers = numbers_of(connection, differing)
    columns = "run_number, fsr_digest, verdict, margin"
    found = rows_among(connection, tables.verdict, columns, "run_number", numbers.values())
    first = {(run, fsr): _words(*judged) for run, fsr, *judged in found}
    told = block.verdicts
    again = zip(told.run.tolist(), told.fsr_digest.values(), told.fsr_id.values(), strict=True)
    for place, (run, fsr_digest, fsr_id) in enumerate(again):
        result = block.result_digests[run]
        if result not in differing:
            continue
        now = _words(VERDICTS[told.verdict[place]], _finite(told.numbers[place, _MARGIN]))
        before = first.get((numbers[result], fsr_digest), "not judged")
        if now != before:
            raise IntegrityError(
                f"run {result[:12]}: FSR {fsr_id} is {before} in its first execution, {now} in "
                "another one. The machine had its part in it, such as by a deadline. The first "
                "stays, and nothing of the other is kept: give its channel more time, or make it "
                "deterministic."
            )


def _words(verdict: object, margin: float | None) -> str:
    return f"{verdict} with margin {margin}"


def _differs(block: RunBlock, run: int, trace_digest: str, *, is_excused: bool) -> bool:
    if trace_digest == block.trace_digests[run]:
        return False
    if is_excused or block.machine_dependent[run]:
        return True
    raise IntegrityError(
        f"run {block.result_digests[run][:12]}: two executions of one test case differ, traces "
        f"{trace_digest} and {block.trace_digests[run]}. Something in it is not deterministic: "
        "look for time, threads or unseeded randomness in its channels and sensors."
    )


def _existing(connection: Connection, digests: Sequence[str]) -> dict[str, tuple[str, int]]:
    columns = "result_digest, trace_digest, machine_dependent"
    found = rows_among(connection, tables.run, columns, "result_digest", digests)
    return {item[0]: (item[1], item[2]) for item in found}


def changed_case(connection: Connection, origin: str, **changes: Any) -> Row:
    """Describe a test case that is another one but for some columns; its digest is one of them."""
    table = tables.test_case
    found = connection.execute(table.select().where(table.c.digest == origin)).one()
    return row(table, tuple((dict(found._mapping) | changes).values())[:-1])


def require_same_traces(connection: Connection, block: JudgedBlock) -> None:
    """Refuse verdicts on traces that are not those of the results.

    Raises:
        IntegrityError: A run came out otherwise than it was recorded.
    """
    existing = _existing(connection, block.result_digests) if block.trace_digests else {}
    for digest, trace_digest in zip(block.result_digests, block.trace_digests, strict=False):
        if existing.get(digest, ("",))[0] != trace_digest:
            raise IntegrityError(
                f"run {digest[:12]} does not come out as it was recorded, so it cannot be judged "
                "again; `adeye replay` shows the difference"
            )


def _insert_runs(connection: Connection, block: RunBlock) -> None:
    results = Texts(np.arange(len(block)), block.results)
    metrics = {
        name: metric_columns(results, block.metrics, ids) for name, ids in tables.TABLES.items()
    }
    words = {name: hash_words(columns) for name, columns in metrics.items()}
    events = block.events
    event_columns = _columns(tables.event, events, result_digest=results[events.run])
    event_words = hash_words(event_columns)
    hashed = _run_columns(block, results)
    hashes = result_hashes(hash_words(hashed), words["metric"], event_words, events.run)
    at = [utc_text(moment) for moment in dict.fromkeys(block.executed_at)]
    moments = {moment: code for code, moment in enumerate(dict.fromkeys(block.executed_at))}
    executed_at = Texts(np.array([moments[item] for item in block.executed_at]), Dictionary(at))
    columns = [*hashed, Texts.unique(hashes), block.executed_by, executed_at]
    numbers = next_number(connection) + np.arange(len(block))
    _insert(connection, tables.run, numbers, columns)
    for name, measured in metrics.items():
        _insert(connection, metadata.tables[name], numbers, measured, words[name])
    _insert(connection, tables.event, numbers[events.run], event_columns, event_words)
    if block.chains:
        ticks = np.full(len(block), LINK_TICKS, dtype=np.int64)
        _insert(connection, tables.chain, numbers, [results, ticks, Texts.unique(block.chains)])


def _run_columns(block: RunBlock, results: Texts) -> list[Column]:
    """List the columns ``RUN_HASHED``."""
    versions = [engine.numerics_version for engine in block.engines]
    of_engines = {
        name: Texts(block.engine, Dictionary([getattr(engine, name) for engine in block.engines]))
        for name in ("backend", "variant", "plugins_digest")
    }
    return values_of(
        RUN_HASHED,
        block,
        result_digest=results,
        test_case_digest=Texts.unique(block.test_cases),
        numerics_version=np.array(versions, dtype=np.int64)[block.engine],
        outcome=Texts(block.outcome, Dictionary([str(word) for word in OUTCOMES])),
        trace_digest=Texts.unique(block.trace_digests),
        **of_engines,
    )


def record_verdicts(
    connection: Connection,
    block: JudgedBlock,
    *,
    results: Dictionary | None = None,
    are_new: bool = False,
    differing: frozenset[str] = frozenset(),
) -> int:
    """Save verdicts that are not there yet.

    Args:
        connection: In a write transaction.
        block: The verdicts.
        results: Its result digests, if they are hashed already.
        are_new: Whether no result can have a verdict already.
        differing: Results whose second execution may be judged differently.

    Returns:
        Number of rows added.

    Raises:
        IntegrityError: A result has another verdict for the same FSR already.
    """
    digests = results or Dictionary(block.result_digests, is_clean=True)
    run_number = run_numbers(connection, block.result_digests)
    verdicts = block.verdicts
    # In the order of the table, a page is filled once.
    verdicts = verdicts.take(np.lexsort((verdicts.fsr_digest.codes, run_number[verdicts.run])))
    numbers = np.where(np.isfinite(verdicts.numbers), verdicts.numbers, np.nan)
    columns = _columns(
        tables.verdict,
        verdicts,
        result_digest=Texts(verdicts.run, digests),
        verdict=Texts(verdicts.verdict, Dictionary([str(word) for word in VERDICTS])),
        **dict(zip(NUMBERS, numbers.T, strict=True)),
    )
    stored = [run_number[verdicts.run], *columns[1:]]
    rows = table_rows(stored, hash_words(columns), tables.verdict)
    if are_new:
        insert_rows(connection, tables.verdict, rows)
        return len(rows)
    known = dict(zip(run_number.tolist(), block.result_digests, strict=True))

    def refuse(new: Row) -> None:
        if not (known[new[0]] in differing or _is_respelt(connection, new)):
            raise IntegrityError(
                f"run {known[new[0]][:12]}: FSR {new[2]} was judged differently before. "
                f"Judging must be deterministic; a changed FSR has another digest."
            )

    return insert_new(connection, tables.verdict, rows, refuse)


def _is_respelt(connection: Connection, new: Row) -> bool:
    """Tell whether a verdict is the stored one but for the words of its predicate: the first's."""
    table = tables.verdict
    same = table.c.run_number == new[0], table.c.fsr_digest == new[1]
    stored = connection.execute(table.select().where(*same)).first()
    if stored is None:
        return False
    # NaN becomes NULL in the table.
    told = [None if isinstance(now, float) and np.isnan(now) else now for now in new]
    pairs = zip(table.columns, stored, told, strict=True)
    return all(old == now for c, old, now in pairs if c.name not in {"predicate", "row_hash"})


# --- Tallies of a block that was executed just now, counted from its columns instead of its rows --

_LOW, _MARGIN = 0, 2
_FAIL: Final = VERDICTS.index(Verdict.FAIL)

Group = tuple[str, str, bool]
"""Architecture, scenario and whether the planned attributes lie inside the ODD."""
Case = tuple[int, int, str, str, str]
"""Row of the block, ordinal, scenario, architecture and fault entry of a case."""


@dataclass(frozen=True)
class Counted:
    """What was counted of a block.

    Attributes:
        work_id: The block.
        tallies: Rows of ``tally``.
        campaign: Id of its campaign.
        results: Digests of the runs of its cases, in the order of their ordinals.
        cases: Ordinal, scenario, architecture, fault entry of each, and whether its run exercises
            an FSR, 1 or 0.
    """

    work_id: int
    tallies: list[Row]
    campaign: str
    results: list[str]
    cases: list[tuple[int, str, str, str, int]]

    def done(self, connection: Connection) -> list[Done]:
        """Give the cases with their runs, which are saved."""
        numbers = run_numbers(connection, self.results).tolist()
        return [
            (self.campaign, ordinal, number, *told)
            for number, (ordinal, *told) in zip(numbers, self.cases, strict=True)
        ]

    def save(self, connection: Connection) -> None:
        """Save it; the runs are saved."""
        insert_rows(connection, tables.tally, self.tallies)
        save_done(connection, self.work_id, self.done(connection))


def count_block(connection: Connection, work_id: int, block: RunBlock) -> Counted | None:
    """Count the verdicts of a block whose cases are exactly the runs of ``block``.

    Returns:
        What was counted; None if a case of it is no run of the block, or a verdict is missing.
    """
    campaign, cases, groups = _cases(connection, work_id, block)
    if campaign is None:
        return None
    exercised = np.zeros(len(block), dtype=np.int64)
    verdicts = block.verdicts
    # The row of the verdict on each run and FSR (B, F), -1 for none.
    words = verdicts.fsr_digest.dictionary.words
    place = np.full((len(block), max(1, len(words))), -1, dtype=np.int64)
    place[verdicts.run, verdicts.fsr_digest.codes] = np.arange(len(verdicts.run))
    fsrs = _fsrs(connection, campaign)
    digests = {word: code for code, word in enumerate(words)}
    chosen: dict[tuple[str, str, str, str], list[Ints]] = defaultdict(list)
    for (architecture, scenario, is_inside), runs in groups.items():
        for fsr_id, fsr_digest, applies in fsrs.get((architecture, scenario), ()):
            if applies != "everywhere" and (applies == "inside") != is_inside:
                continue
            found = place[np.array(runs), digests[fsr_digest]] if fsr_digest in digests else None
            if found is None or (found < 0).any():
                return None
            chosen[fsr_id, fsr_digest, architecture, scenario].append(found)
            exercised[runs] |= verdicts.exercised[found]
    rows: list[Row] = []
    for key in sorted(chosen, key=lambda item: (item[0], *item[2:])):
        rows += _counted(block, work_id, campaign, key, np.concatenate(chosen[key]))
    results = [block.result_digests[case[0]] for case in cases]
    told = [(*case[1:], int(exercised[case[0]])) for case in cases]
    return Counted(work_id, rows, campaign, results, told)


def _cases(
    connection: Connection, work_id: int, block: RunBlock
) -> tuple[str | None, list[Case], dict[Group, list[int]]]:
    """Find the runs of the block behind the cases of a piece of work; no campaign if one lacks.

    Returns:
        Id of the campaign, the cases in the order of their ordinals, and their runs by group.
    """
    of_digest = {digest: run for run, digest in enumerate(block.result_digests)}
    found = connection.exec_driver_sql(
        "SELECT c.campaign_id, c.ordinal, c.result_digest, c.architecture, c.scenario, "
        "c.inside_odd, t.fault_entry "
        "FROM work w JOIN campaign_case c ON c.campaign_id = w.campaign_id "
        "AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal "
        "JOIN test_case t ON t.digest = c.test_case_digest WHERE w.id = ? ORDER BY c.ordinal",
        (work_id,),
    )
    cases: list[Case] = []
    groups: dict[Group, list[int]] = defaultdict(list)
    campaign: str | None = None
    for campaign_id, ordinal, digest, architecture, scenario, inside_odd, fault_entry in found:
        run = of_digest.get(digest)
        if run is None:
            return None, [], {}
        campaign = campaign_id
        cases.append((run, ordinal, scenario, architecture, fault_entry))
        groups[architecture, scenario, bool(inside_odd)].append(run)
    return campaign, cases, groups


def _fsrs(
    connection: Connection, campaign: str
) -> dict[tuple[str, str], list[tuple[str, str, str]]]:
    """List id, digest and applicability of the FSRs by architecture and scenario."""
    found = connection.exec_driver_sql(
        "SELECT architecture, scenario, fsr_id, fsr_digest, applies FROM campaign_fsr "
        "WHERE campaign_id = ? AND applicable = 1",
        (campaign,),
    )
    fsrs: dict[tuple[str, str], list[tuple[str, str, str]]] = defaultdict(list)
    for architecture, scenario, *rest in found:
        fsrs[architecture, scenario].append((rest[0], rest[1], rest[2]))
    return fsrs


def _counted(
    block: RunBlock, work_id: int, campaign: str, key: tuple[str, str, str, str], found: Ints
) -> list[Row]:
    fsr_id, fsr_digest, architecture, scenario = key
    verdicts = block.verdicts
    kinds = verdicts.verdict[found]
    rows: list[Row] = []
    for kind in sorted(np.unique(kinds).tolist(), key=lambda code: str(VERDICTS[code])):
        same = found[kinds == kind]
        worst = _worst(block, same, is_fail=kind == _FAIL)
        numbers = [_finite(number) for number in verdicts.numbers[worst, [_LOW, _MARGIN]]]
        unit = verdicts.unit[[worst]].values()[0]
        result = block.result_digests[verdicts.run[worst]]
        values: tuple[Any, ...] = (
            work_id, campaign, fsr_id, fsr_digest, architecture, scenario, str(VERDICTS[kind]),
            len(same), int(verdicts.exercised[same].sum()), *numbers, unit, result,
        )  # fmt: skip
        rows.append(row(tables.tally, values))
    return rows


def _worst(block: RunBlock, rows: Ints, *, is_fail: bool) -> int:
    """Find the worst verdict as ``views.WORST_FIRST`` does: NULL is the worst of a FAIL only."""
    margin = block.verdicts.numbers[rows, _MARGIN]
    margin = np.where(np.isfinite(margin), margin, -np.inf if is_fail else np.inf)
    ties = rows[margin == margin.min()]
    return int(min(ties, key=lambda item: block.result_digests[block.verdicts.run[item]]))


def _finite(number: float) -> float | None:
    return float(number) if np.isfinite(number) else None
