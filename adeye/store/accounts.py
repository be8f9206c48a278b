"""Accounts of the cases of a campaign: made with plan and results, made again to check them.

The plan is accounted for in ``case_count`` and ``case_match``, a block that is done in ``case_run``
and ``case_tally``, a campaign of which every block is done in ``case_repeat`` and ``never_held``. A
block just executed is counted from its columns by ``tallying`` instead.

Counted while the cases pass by, 16 bytes and two small numbers for each.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Table, select

from adeye.errors import InputError
from adeye.identity import LINK_LENGTH, split_links
from adeye.signals import NO_FAULT, Ints
from adeye.store import tables
from adeye.store.cases import JUDGED, JUDGED_CASES
from adeye.store.encoding import Row, row, rows_of_columns, stored_rows
from adeye.store.ledger import insert_rows, key_text
from adeye.store.records import Finding
from adeye.store.sql import filled
from adeye.units import read_quantity

if TYPE_CHECKING:
    from adeye.judge.stl.parser import Parameters

SINCE_FAULT: Final = frozenset(
    {"fault_to_safe_state_s", "distance_to_safe_state_m", "takeover_time_s", "stop_regret"}
    | {"fault_detection_time_s", "fault_reaction_time_s", "fault_handling_time_s"}
    | {"emergency_operation_time_s"}
)
"""Metrics that count from a fault on. Their registry knows, and loads all that measures."""

# --- Which cases of a plan are pairs: several architectures, one situation, the same faults -------

_PAIRS_AT_ONCE: Final = 8_192


class CaseGroups:
    """Counts of the cases of a campaign and what matches among them, fed in their order."""

    def __init__(self) -> None:
        """Begin with no case."""
        self._planned: Counter[tuple[str, str, str]] = Counter()
        self._keys: list[bytes] = []
        self._architectures: list[tuple[int, int]] = []
        self._faults: list[tuple[int, int]] = []
        self._codes: dict[str, int] = {}

    def add(
        self, scenario: str, architecture: str, fault_entry: str, situations: Sequence[str]
    ) -> None:
        """Add the next cases, which share names and faults, by the digests of their situations."""
        count = len(situations)
        self._planned[scenario, architecture, fault_entry] += count
        # The digest of a situation knows nothing of the name that the scenario has in the ODD.
        head = hashlib.blake2b(f"{scenario}\0{fault_entry}\0".encode(), digest_size=16)
        for situation in situations:
            key = head.copy()
            key.update(situation.encode())
            self._keys.append(key.digest())
        self._architectures.append((self._code(architecture), count))
        self._faults.append((self._code(fault_entry), count))

    def _code(self, word: str) -> int:
        return self._codes.setdefault(word, len(self._codes))

    def counts(self, campaign_id: str) -> list[Row]:
        """Make the rows of ``case_count``."""
        return [
            row(tables.case_count, (campaign_id, *names, planned))
            for names, planned in sorted(self._planned.items())
        ]

    def matches(self, campaign_id: str) -> Iterator[list[Row]]:
        """Make the rows of ``case_match`` in the order of its key, many together."""
        first, ordinal = _matched(self._keys, _repeated(self._architectures))
        words = np.array(list(self._codes), dtype=object)
        faults = words[_repeated(self._faults)[ordinal]]
        for begin in range(0, len(ordinal), _PAIRS_AT_ONCE):
            part = slice(begin, begin + _PAIRS_AT_ONCE)
            columns = [list(item[part].tolist()) for item in (first, ordinal, faults)]
            yield rows_of_columns(tables.case_match, (campaign_id, *columns))


def _repeated(runs: Iterable[tuple[int, int]]) -> Ints:
    """Write out run lengths: a code for each case."""
    pairs = np.array(list(runs), dtype=np.int64).reshape(-1, 2)
    return np.repeat(pairs[:, 0], pairs[:, 1])


def _matched(keys: Sequence[bytes], architectures: Ints) -> tuple[Ints, Ints]:
    """Find the cases whose key another architecture has, too.

    Args:
        keys: N digests of 16 bytes, by ordinal.
        architectures: (N,) codes.

    Returns:
        (M,) ordinal of the first case with the same key and (M,) ordinal, in the order of both.
    """
    if not keys:
        nothing = np.zeros(0, dtype=np.int64)
        return nothing, nothing
    words: NDArray[np.uint64] = np.frombuffer(b"".join(keys), dtype="<u8").reshape(-1, 2)
    order = np.lexsort((words[:, 1], words[:, 0]))
    ranked = words[order]
    begins = np.flatnonzero(np.append(True, (ranked[1:] != ranked[:-1]).any(axis=1)))
    sizes = np.diff(np.append(begins, len(order)))
    codes = architectures[order]
    is_shared = np.minimum.reduceat(codes, begins) != np.maximum.reduceat(codes, begins)
    # Sorting keeps the order of equal keys, so that the first of a group was planned first.
    first = np.repeat(order[begins], sizes)
    chosen = np.repeat(is_shared, sizes)
    first, ordinal = first[chosen], order[chosen]
    place = np.lexsort((ordinal, first))
    return first[place], ordinal[place]


# --- Accounts of the cases of a campaign: made with plan and results, made again to check them ----

_CHUNK: Final = 1_024

_HAPPENED: Final = filled("happened", length=LINK_LENGTH)

Done = tuple[str, int, int, str, str, str, int]
"""A case with a run: campaign, ordinal, number of the run, scenario, architecture, fault entry,
and whether the run exercises an FSR of the campaign, 1 or 0."""


def save_groups(connection: Connection, campaign_id: str, groups: CaseGroups) -> None:
    """Save what was counted of the cases of a new campaign."""
    insert_rows(connection, tables.case_count, groups.counts(campaign_id))
    for rows in groups.matches(campaign_id):
        insert_rows(connection, tables.case_match, rows)


def done_cases(connection: Connection, work_id: int) -> list[Done]:
    """List the cases of a block that have a run, in the order of their ordinals."""
    found = connection.exec_driver_sql(filled("case_done", judged=JUDGED), (work_id,))
    return [(*item[:6], int(item[6])) for item in map(tuple, found)]


def run_rows(cases: Sequence[Done]) -> list[Row]:
    """Make the rows of ``case_run`` of some cases of one campaign."""
    if not cases:
        return []
    campaigns, ordinals, numbers = (list(items) for items in list(zip(*cases, strict=True))[:3])
    return rows_of_columns(tables.case_run, (campaigns[0], ordinals, numbers))


def case_tallies(work_id: int, cases: Sequence[Done]) -> list[Row]:
    """Make the rows of ``case_tally`` of the cases of a block."""
    runs = Counter((case[0], *case[3:6]) for case in cases)
    exercised = Counter((case[0], *case[3:6]) for case in cases if case[6])
    return [
        row(tables.case_tally, (work_id, *names, count, exercised[names]))
        for names, count in sorted(runs.items())
    ]


def save_done(connection: Connection, work_id: int, cases: Sequence[Done]) -> None:
    """Save the accounts of a block that is done."""
    insert_rows(connection, tables.case_run, run_rows(cases))
    insert_rows(connection, tables.case_tally, case_tallies(work_id, cases))


def whole_rows(connection: Connection, campaign_id: str) -> tuple[tuple[Table, list[Row]], ...]:
    """Make the rows that only a whole campaign tells; none before its last block is done."""
    if not _is_whole(connection, campaign_id):
        return (tables.case_repeat, []), (tables.never_held, [])
    # What reads formulas is not imported by who reads no verdicts.
    from adeye.judge.stl.formula import named_faults, nested_antecedents

    contents = connection.exec_driver_sql(
        "SELECT f.id, f.content FROM campaign c JOIN fsr f ON f.concept_digest = c.concept_digest "
        "WHERE c.id = ? ORDER BY f.id",
        (campaign_id,),
    ).all()
    idle = [
        found
        for fsr, content in contents
        for found in _without_effect(connection, campaign_id, fsr, _read(named_faults, content))
    ]
    never = [
        *(_nothing_acted(campaign_id, found) for found in idle if not found.has_effect),
        *(
            item
            for fsr, content in contents
            for item in _never_held(
                connection, campaign_id, fsr, _read(nested_antecedents, content)
            )
        ),
        *_only_outside(connection, campaign_id),
    ]
    return (tables.case_repeat, _repeat_rows(connection, campaign_id, never, idle)), (
        tables.never_held,
        never,
    )


def _repeat_rows(
    connection: Connection, campaign_id: str, never: Sequence[Row], idle: Sequence[_Idle]
) -> list[Row]:
    """Count the runs that repeat a result, by FSR, architecture and scenario.

    Two runs of one architecture with equal traces are one result, whatever their test cases are
    called and whatever margins a swept value gave them that the drive does not show: nothing that
    happened tells them apart, or only when a fault was present that changed nothing. For an FSR
    about that fault the run without it is none.
    """
    runs: Counter[tuple[Any, ...]] = Counter()
    contained = _beginnings(connection, campaign_id)
    shorter = sorted({happened for _, happened in contained})
    marks = f"OR happened IN ({', '.join('?' * len(shorter))})" if shorter else ""
    query = filled("case_repeated", judged=JUDGED, happened=_HAPPENED, or_contained=marks)
    for fsr, architecture, scenario, happened, passed, exercised in connection.exec_driver_sql(
        query, (campaign_id, *shorter)
    ):
        for where in (scenario, ""):
            runs[fsr, architecture, where, 0, happened] += int(passed)
            runs[fsr, architecture, where, 1, happened] += int(exercised)
    found = connection.exec_driver_sql(
        "SELECT DISTINCT fsr_id, architecture FROM campaign_fsr "
        "WHERE campaign_id = ? AND applicable = 1",
        (campaign_id,),
    )
    unheld = Counter((item[1], item[2]) for item in never)
    repeats = {(*pair, ""): [0, 0, unheld[tuple(pair)]] for pair in found}
    for (fsr, architecture, where, kind, happened), count in runs.items():
        new = 0 if not where and (architecture, happened) in contained else 1
        if count > new:
            repeats.setdefault((fsr, architecture, where), [0, 0, 0])[kind] += count - new
    for item in idle:
        for where, results in (*item.results.items(), ("", sum(item.results.values()))):
            if results:
                repeats.setdefault((item.fsr, item.architecture, where), [0, 0, 0])[1] += results
    return [
        row(tables.case_repeat, (campaign_id, *place, *counts))
        for place, counts in sorted(repeats.items())
    ]


def _beginnings(connection: Connection, campaign_id: str) -> set[tuple[str, str]]:
    """Find the results that are the beginning of a longer one: they show what that shows.

    What differs behind the last link of the shorter, in its last moments, is not looked at.

    Returns:
        Architecture and what happened, of the shorter runs.
    """
    found: set[tuple[str, str]] = set()
    longer: set[tuple[str, str]] = set()
    rows = connection.exec_driver_sql(
        filled("case_beginnings", length=LINK_LENGTH, happened=_HAPPENED), (campaign_id,)
    )
    for _, runs in groupby(rows.all(), itemgetter(1)):
        links: set[tuple[str, str]] = set()
        for architecture, _, text, parts, happened in runs:
            own = [(architecture, link) for link in split_links(text)[:parts]]
            if own[-1] in longer:
                found.add((architecture, happened))
            links.update(own)
        longer |= links
    return found


class _Idle(NamedTuple):
    """Results that exercise an FSR about faults, but are as if there were no such faults.

    Attributes:
        results: How many, by scenario.
        has_effect: Whether others exercise the FSR.
    """

    fsr: str
    architecture: str
    faults: Sequence[str]
    results: dict[str, int]
    has_effect: bool


def _without_effect(
    connection: Connection, campaign_id: str, fsr: str, faults: Sequence[str]
) -> Iterator[_Idle]:
    """Find, of an FSR that names faults, the results in which one of these changed nothing.

    Each is, but for the presence of that fault, one of the same scenario without it: what the FSR
    says about a vehicle with the fault was not asked. So none hides behind another of its entry.
    """
    if not faults:
        return
    found = connection.exec_driver_sql(
        filled(
            "case_about_faults",
            judged=JUDGED,
            happened=_HAPPENED,
            named=" UNION ALL ".join(["SELECT CAST(? AS TEXT) AS fault"] * len(faults)),
            no_fault=NO_FAULT,
        ),
        (*(f"+{name}+" for name in faults), campaign_id, fsr),
    )
    for architecture, rows in groupby(found.all(), itemgetter(0)):
        counts = [(scenario, int(idle), int(every)) for _, scenario, idle, every in rows]
        results = {scenario: idle for scenario, idle, _ in counts if idle}
        if results:
            has_effect = sum(results.values()) < sum(every for _, _, every in counts)
            yield _Idle(fsr, architecture, faults, results, has_effect)


def _nothing_acted(campaign_id: str, found: _Idle) -> Row:
    from adeye.judge.stl.formula import ANY_FAULT

    names = " or ".join(
        "a fault" if name == ANY_FAULT else f"fault.{name}" for name in found.faults
    )
    told = f"({names} changes the run)"
    return row(tables.never_held, (campaign_id, found.fsr, found.architecture, 0, told, 1))


def _read(
    what: Callable[[str | None, Parameters], tuple[str, ...]], content: str
) -> tuple[str, ...]:
    """Read something off the formula of an FSR, or what stands for a bound from a fault on."""
    try:
        told = json.loads(content)
        metric = str((told.get("bound") or {}).get("metric"))
        since = "faulted" if metric in SINCE_FAULT else None
        values = told.get("parameters", {}).items()
        named = {name: read_quantity(str(value)) for name, value in values}
        return what(told.get("formula") or since, named)
    except (ValueError, LookupError, TypeError, AttributeError, InputError):
        # What is no formula is refused where a plan is made; what was altered is named by itself.
        return ()


def _never_held(
    connection: Connection, campaign_id: str, fsr: str, antecedents: Sequence[str]
) -> Iterator[Row]:
    if not antecedents:
        return
    from adeye.judge.evaluate import read_never_held
    from adeye.judge.stl.batch import HELD, NEEDED

    told: dict[str, set[tuple[int, ...]]] = {}
    for architecture, detail in connection.exec_driver_sql(
        filled("case_passed", judged_cases=JUDGED_CASES), (campaign_id, fsr)
    ):
        kinds = read_never_held(detail, len(antecedents))
        told.setdefault(architecture, set()).add(kinds)
    for architecture, runs in sorted(told.items()):
        for place, kinds in enumerate(zip(*runs, strict=True)):
            if HELD not in kinds:
                values = place + 1, antecedents[place], int(NEEDED in kinds)
                yield row(tables.never_held, (campaign_id, fsr, architecture, *values))


_OUTSIDE: Final = 10_000
"""Place behind all implications."""


def _only_outside(connection: Connection, campaign_id: str) -> Iterator[Row]:
    """Find FSRs of everywhere that too few runs inside the ODD exercise: others do not count."""
    found = connection.exec_driver_sql(
        f"SELECT f.fsr_id, f.architecture, MAX(f.min_exercised) FROM {JUDGED_CASES} "  # noqa: S608 - own names
        "WHERE c.campaign_id = ? AND f.applies = 'everywhere' AND v.exercised = 1 "
        "GROUP BY f.fsr_id, f.architecture HAVING SUM(c.inside_odd) < COUNT(*) "
        "AND SUM(c.inside_odd) < MAX(f.min_exercised) ORDER BY f.fsr_id, f.architecture",
        (campaign_id,),
    )
    for fsr, architecture, least in found:
        runs = f" in {least:,} runs" if least > 1 else ""
        told = f"what it asks about inside the ODD{runs}"
        yield row(tables.never_held, (campaign_id, fsr, architecture, _OUTSIDE, told, 1))


def account_whole(connection: Connection, campaign_id: str) -> None:
    """Account for what only a whole campaign tells, if its last block is done by now."""
    for table, rows in whole_rows(connection, campaign_id):
        insert_rows(connection, table, rows, ignore_existing=True)


def _is_whole(connection: Connection, campaign_id: str) -> bool:
    open_blocks = select(tables.work.c.id).where(
        tables.work.c.campaign_id == campaign_id, tables.work.c.state != "done"
    )
    return connection.execute(open_blocks.limit(1)).first() is None


def wrong_plans(connection: Connection, campaign: str | None = None) -> Iterator[Finding]:
    """Name what is in the accounts of plans and should not be, or is not and should.

    A run of a case that was never planned is in no block, so it is named here, too.

    Args:
        connection: In a transaction.
        campaign: Id of the only one to look at; None for all.
    """
    found = connection.execute(
        select(tables.campaign.c.id).order_by(tables.campaign.c.number)
    ).scalars()
    for campaign_id in found.all() if campaign is None else (campaign,):
        groups = CaseGroups()
        planned = connection.exec_driver_sql(
            filled("case_planned"), (campaign_id,), execution_options={"yield_per": _CHUNK}
        )
        for (scenario, architecture, fault), items in groupby(planned, key=itemgetter(0, 1, 2)):
            groups.add(scenario, architecture, fault, [item[3] for item in items])
        yield from _differences(
            connection, tables.case_count, campaign_id, groups.counts(campaign_id)
        )
        matches = (item for rows in groups.matches(campaign_id) for item in rows)
        yield from _differences(connection, tables.case_match, campaign_id, matches)
        for table, rows in whole_rows(connection, campaign_id):
            yield from _differences(connection, table, campaign_id, rows)
    unplanned = (
        "NOT EXISTS (SELECT 1 FROM campaign_case c "
        "WHERE c.campaign_id = case_run.campaign_id AND c.ordinal = case_run.ordinal)"
    )
    for item in stored_rows(connection, tables.case_run, unplanned):
        yield _finding(tables.case_run, item, is_stored=True)


def _differences(
    connection: Connection, table: Table, campaign_id: str, expected: Iterable[Row]
) -> Iterator[Finding]:
    """Compare what is stored of a campaign with what should be, both in the order of the key."""
    width = len(table.primary_key.columns)
    left = stored_rows(connection, table, "campaign_id = ?", (campaign_id,))
    right = iter(expected)
    one, other = next(left, None), next(right, None)
    while one is not None or other is not None:
        if one == other:
            one, other = next(left, None), next(right, None)
        elif other is None or (one is not None and _before(one, other, width)):
            yield _finding(table, one or (), is_stored=True)
            one = next(left, None)
        else:
            yield _finding(table, other, is_stored=False)
            other = next(right, None)


def _before(one: Sequence[Any], other: Sequence[Any], width: int) -> bool:
    """Tell whether a stored row comes not behind another; an altered one comes first."""
    try:
        return tuple(one[:width]) <= tuple(other[:width])
    except TypeError:
        return True


def wrong_block(connection: Connection, block: Any) -> Iterator[Finding]:
    """Name what the accounts of a block have and should not, or lack.

    Args:
        connection: In a transaction.
        block: Its row of ``work``.
    """
    cases = done_cases(connection, block.id) if block.state == "done" else []
    within = block.campaign_id, block.from_ordinal, block.to_ordinal
    in_block = "campaign_id = ? AND ordinal >= ? AND ordinal < ?"
    for table, condition, values, rows in (
        (tables.case_run, in_block, within, run_rows(cases)),
        (tables.case_tally, "work_id = ?", (block.id,), case_tallies(block.id, cases)),
    ):
        stored = set(stored_rows(connection, table, condition, values))
        for item in sorted(stored ^ set(rows), key=str):
            yield _finding(table, item, is_stored=item in stored)


def _finding(table: Table, item: Sequence[Any], *, is_stored: bool) -> Finding:
    problem = "is not what plan and results say" if is_stored else "is missing"
    return Finding(table.name, key_text(table, item), problem)
