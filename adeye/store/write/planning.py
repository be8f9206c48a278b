"""Save a campaign: its selection of test cases, what judges them, and the blocks of work.

A campaign is a selection, so its id is the digest of what is selected: the ODD, the concept, how
FSRs are judged, and for every ordinal the test case with the result that it must have. Planning
the same selection again finds the same campaign and changes no row. Another threshold or another
version of a plug-in is another campaign, which reuses whatever results it still can.

A campaign's id is known only after its last case, and every row of the selection begins with it.
So the columns wait in a temporary file; what is counted on the way is small.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from datetime import datetime, timedelta
from itertools import repeat
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final, TextIO

from sqlalchemy import Connection

from adeye.errors import InputError
from adeye.store import encoding, tables, texts
from adeye.store.accounts import CaseGroups, account_whole, save_groups
from adeye.store.block import PlannedCases
from adeye.store.cases import count_open, lacks_result, lacks_verdict
from adeye.store.encoding import Row
from adeye.store.ledger import add_numbered, insert_rows
from adeye.store.read.campaigns import latest_id
from adeye.store.records import CampaignFsr, CampaignRecord, Plan
from adeye.store.views import ensure_scenario_views
from adeye.store.write.content import concept_record, save_concept, save_content
from adeye.store.write.queue import add_block
from adeye.store.write.results import write_tallies

if TYPE_CHECKING:
    from adeye.spec.concept import Requirement

# --- What a campaign selects: its identity, and its cases on their way to the database ------------


Columns = tuple[list[str], list[str], str, str, list[int], list[str]]
"""Consecutive cases that share scenario and architecture: digests of test cases, and of the results
that these must have, scenario, architecture, whether each lies inside the ODD, 1 or 0, and points.
"""


class SelectionHash:
    """Identity of a selection, fed case by case in the order of the ordinals."""

    def __init__(self, odd_digest: str, concept_digest: str, gate: str, judging: str) -> None:
        """Begin with what the campaign says about all its cases."""
        self._hash = hashlib.sha256(
            texts.json_text([odd_digest, concept_digest, gate, judging]).encode()
        )
        self.count = 0

    def add(self, values: Iterable[Any]) -> None:
        """Add a case: digests of test case and result, scenario, architecture, inside, point."""
        self._add([map(str, values)])

    def add_columns(self, columns: Columns) -> None:
        """Add cases in the order of their ordinals, by columns of what ``add`` takes."""
        test_cases, results, scenario, architecture, inside, points = columns
        names = repeat(scenario), repeat(architecture)
        # The names have no end.
        self._add(zip(test_cases, results, *names, map(str, inside), points, strict=False))

    def _add(self, cases: Iterable[Iterable[str]]) -> None:
        # No text of a database has a NUL, no JSON a line feed.
        lines = list(map("\0".join, cases))
        text = "\n".join(lines) + "\n"
        self._hash.update(text.encode("utf-8", "surrogatepass"))
        self.count += len(lines)

    @property
    def campaign_id(self) -> str:
        """The first 128 bits in hex."""
        return self._hash.hexdigest()[:32]


def selected(part: PlannedCases) -> Columns:
    """Return the columns of planned test cases that tell which they are, see ``Columns``."""
    return (
        list(part.test_cases),
        part.engine.result_digests(part.test_cases),
        part.scenario,
        part.architecture,
        list(map(int, part.inside_odd)),
        list(part.points),
    )


class Selection:
    """The cases of a selection, kept in a file until its identity is known.

    Attributes:
        identity: Over all that was added.
        counted: Cases by architecture, scenario and whether they lie inside the ODD.
        ends: Ordinals behind the last case of each stretch of one structure and one shape of JSON.
        groups: Cases by their names and faults, and which of them are pairs.
    """

    def __init__(self, identity: SelectionHash, file: TextIO) -> None:
        """Begin with no case."""
        self.identity = identity
        self.counted: Counter[tuple[str, str, bool]] = Counter()
        self.ends: list[int] = []
        self.groups = CaseGroups()
        self._alike: object = None
        self._file = file

    @classmethod
    @contextmanager
    def begin(cls, identity: SelectionHash) -> Iterator[Selection]:
        """Open the file; it is gone at the end."""
        with tempfile.TemporaryFile("w+", encoding="utf-8", newline="\n") as file:
            yield cls(identity, file)

    def add(self, part: PlannedCases) -> None:
        """Add test cases in the order of their ordinals."""
        columns = selected(part)
        self._file.write(json.dumps([self.identity.count, *columns]) + "\n")
        self.identity.add_columns(columns)
        for inside, count in Counter(columns[4]).items():
            self.counted[part.architecture, part.scenario, bool(inside)] += count
        self.groups.add(part.scenario, part.architecture, part.fault_entry, part.situations)
        alike = (part.structure, *_shape(part.parameters), None, *_shape(part.points))
        if alike != self._alike:
            self.ends.append(self.identity.count)
            self._alike = alike
        self.ends[-1] = self.identity.count

    def parts(self) -> Iterator[tuple[range, Columns]]:
        """Return everything that was added, in its order: ordinals and columns."""
        self._file.seek(0)
        for line in self._file:
            first, *columns = json.loads(line)
            yield range(first, first + len(columns[0])), tuple(columns)


def _shape(column: Sequence[str]) -> Iterator[tuple[str, type]]:
    """Names and types of a JSON object; those of the first tell them of all."""
    for name, value in json.loads(column[0]).items():
        yield name, type(value)


# --- Cut a plan into blocks of work: which ordinals, and whether anything is missing there --------


def block_bounds(ends: Iterable[int], block_size: int) -> Iterator[tuple[int, int]]:
    """Cut ordinals into blocks that cross no end of a stretch.

    Args:
        ends: Ordinals behind the last case of each stretch of one structure.
        block_size: Most ordinals in a block.

    Raises:
        ValueError: A block would have no ordinal.
    """
    if block_size < 1:
        raise ValueError(f"block_size is {block_size}, at least 1 is needed")
    start = 0
    for end in ends:
        for first in range(start, end, block_size):
            yield first, min(first + block_size, end)
        start = end


def save_work(
    connection: Connection, campaign_id: str, ends: Iterable[int], block_size: int
) -> None:
    """Save the blocks of a campaign; those that need nothing are done at once, with tallies."""
    for first, end in block_bounds(ends, block_size):
        if lacks_result(connection, campaign_id, first, end):
            kind = "execute"
        elif lacks_verdict(connection, campaign_id, first, end):
            kind = "judge"
        else:
            kind = "reused"
        state = "done" if kind == "reused" else "pending"
        work_id = add_block(connection, campaign_id, kind, (first, end), state=state)
        if kind == "reused":
            write_tallies(connection, work_id)
    # If everything is known already, no block comes to an end later.
    account_whole(connection, campaign_id)


# --- Save a campaign: its selection of test cases, what judges them, and the blocks of work -------

DEFAULT_BLOCK_SIZE: Final = 64
_CHUNK: Final = 8_192
"""Rows that are sorted and inserted together."""


def judging_hash(rows: Iterable[Row]) -> str:
    """Hash all rows of ``campaign_fsr`` of a campaign, in the order of their key."""
    return hashlib.sha256(" ".join(sorted(item[-1] for item in rows)).encode()).hexdigest()


def plan_campaign(
    connection: Connection,
    record: CampaignRecord,
    cases: Iterable[PlannedCases],
    *,
    block_size: int = DEFAULT_BLOCK_SIZE,
    report: Callable[[int], None] = lambda _: None,
) -> Plan:
    """Save a campaign with its content, test cases and work, before anything runs.

    The same selection again is the same campaign: no row changes. Results that exist are reused; a
    block in which nothing is missing is done at once. Cases may be an iterator; they are never held
    together.

    Args:
        connection: In a write transaction.
        record: The campaign.
        cases: Test cases in the order of their ordinals.
        block_size: Most ordinals in one block of work.
        report: Called with the number of test cases that are planned so far, now and then.

    Raises:
        InputError: There are no test cases.
        ValueError: The record does not say how each FSR of its concept is judged.
    """
    given = sorted(item.id for item in record.fsrs)
    expected = sorted(item.id for item in record.concept.requirements)
    if given != expected:
        raise ValueError(f"FSRs {given} are given, the concept has {expected}")
    odd_digest = save_content(connection, "odd", record.odd)
    save_concept(connection, record.concept)
    identity = _identity(record)
    with encoding.large_cache(connection), Selection.begin(identity) as selection:
        _save_test_cases(connection, cases, selection, odd_digest, report)
        if identity.count == 0:
            raise InputError(
                f"campaign of ODD {record.odd.id!r}: no test cases",
                remedy="An empty selection proves nothing; widen the sweep or its constraints.",
            )
        campaign_id = identity.campaign_id
        known = connection.exec_driver_sql(
            "SELECT 1 FROM campaign WHERE id = ?", (campaign_id,)
        ).first()
        if known is None:
            fsrs = fsr_rows(campaign_id, record, selection.counted)
            save_campaign(connection, campaign_id, record, identity.count, judging_hash(fsrs))
            table = tables.campaign_case
            with ExitStack() as inserting:
                if encoding.is_worth_rebuilding(
                    identity.count, encoding.size_of(connection, table)
                ):
                    inserting.enter_context(encoding.rebuilt_indexes(connection, table))
                for ordinals, columns in selection.parts():
                    rows = encoding.rows_of_columns(table, (campaign_id, ordinals, *columns))
                    insert_rows(connection, table, rows)
            insert_rows(connection, tables.campaign_fsr, fsrs)
            save_groups(connection, campaign_id, selection.groups)
            save_work(connection, campaign_id, selection.ends, block_size)
            ensure_scenario_views(connection)
        if latest_id(connection) != campaign_id:
            save_use(connection, campaign_id)
        to_execute, to_judge = count_open(connection, campaign_id)
        ends = tuple(selection.ends)
    return Plan(campaign_id, identity.count, to_execute, to_judge, known is None, ends)


def identify(record: CampaignRecord, cases: Iterable[PlannedCases]) -> str:
    """Give the id that a campaign has or would have, without a database.

    Args:
        record: The campaign.
        cases: Its test cases in the order of their ordinals.
    """
    identity = _identity(record)
    for part in cases:
        identity.add_columns(selected(part))
    return identity.campaign_id


def _identity(record: CampaignRecord) -> SelectionHash:
    concept = concept_record(record.concept).digest
    return SelectionHash(record.odd.digest, concept, _gate_text(record), _judging_text(record))


def save_use(connection: Connection, campaign_id: str, at: str = "") -> None:
    """Note when a campaign was planned again: now, so that it is the latest, unless said."""
    add_numbered(connection, tables.campaign_use, campaign_id, at or _now(connection))


def used_at(connection: Connection) -> dict[str, str]:
    """Read when each campaign was planned last."""
    found = connection.exec_driver_sql(
        "SELECT c.id, COALESCE(MAX(u.at), c.created_at) FROM campaign c "
        "LEFT JOIN campaign_use u ON u.campaign_id = c.id GROUP BY c.id, c.created_at"
    )
    return {row[0]: row[1] for row in found}


def _now(connection: Connection) -> str:
    """Tell the time, which goes on since what was planned before, whatever the clock says."""
    before = max(used_at(connection).values(), default="")
    now = texts.utc_text(None)
    if now > before:
        return now
    return texts.utc_text(datetime.fromisoformat(before) + timedelta(milliseconds=1))


def _save_test_cases(
    connection: Connection,
    cases: Iterable[PlannedCases],
    selection: Selection,
    odd_digest: str,
    report: Callable[[int], None],
) -> None:
    """Save test cases, with their content, and add them to the selection."""
    table, identity = tables.test_case, selection.identity
    size, saved = encoding.size_of(connection, table), set[str]()
    waiting: list[Row] = []
    with ExitStack() as inserting:
        is_rebuilding = False
        for part in cases:
            for kind, content in (
                ("scenario", part.scenario_content),
                ("architecture", part.architecture_content),
            ):
                if content.digest not in saved:
                    saved.add(save_content(connection, kind, content))
            selection.add(part)
            waiting += _test_cases(part, odd_digest)
            if len(waiting) < _CHUNK:
                continue
            if not is_rebuilding and encoding.is_worth_rebuilding(identity.count, size):
                inserting.enter_context(encoding.rebuilt_indexes(connection, table))
                is_rebuilding = True
            _insert_sorted(connection, waiting)
            report(identity.count)
        _insert_sorted(connection, waiting)


def _insert_sorted(connection: Connection, waiting: list[Row]) -> None:
    """Insert in the order of the key, which spares half of the work in its index."""
    # Of rows with one key the first stays, whatever the others say.
    waiting.sort(key=itemgetter(0))
    insert_rows(connection, tables.test_case, waiting, ignore_existing=True)
    waiting.clear()


def _gate_text(record: CampaignRecord) -> str:
    return texts.json_text(sorted(record.gate))


def _judging_text(record: CampaignRecord) -> str:
    # What is judged with a numeric uncertainty has a digest for each architecture and scenario.
    return texts.json_text(
        sorted(
            [item.id, item.digest, dict(item.not_applicable), *_with_uncertainty(item)]
            for item in record.fsrs
        )
    )


def _with_uncertainty(fsr: CampaignFsr) -> list[list[list[str]]]:
    return [sorted([*place, digest] for place, digest in fsr.judged.items())] if fsr.judged else []


def _test_cases(part: PlannedCases, odd_digest: str) -> list[Row]:
    return encoding.rows_of_columns(
        tables.test_case,
        (
            list(part.test_cases),
            list(part.situations),
            part.scenario_content.digest,
            part.architecture_content.digest,
            part.fault_entry,
            texts.json_text([dict(fault) for fault in part.faults]),
            list(part.parameters),
            list(part.replicates),
            part.seed,
            part.step_s,
            odd_digest,
            list(part.point_index),
        ),
    )


def save_campaign(
    connection: Connection, campaign_id: str, record: CampaignRecord, planned: int, hashed: str
) -> None:
    """Save the row of a campaign; what it refers to is saved."""
    add_numbered(
        connection,
        tables.campaign,
        campaign_id,
        _now(connection),
        record.odd.id,
        record.odd.digest,
        concept_record(record.concept).digest,
        record.title,
        planned,
        texts.json_text(record.factors),
        _gate_text(record),
        texts.json_text({name: dict(units) for name, units in record.units.items()}),
        _judging_text(record),
        hashed,
        texts.json_text(dict(record.provenance)),
    )


def fsr_rows(
    campaign_id: str, record: CampaignRecord, counted: Counter[tuple[str, str, bool]]
) -> list[Row]:
    """Make the rows of ``campaign_fsr``, from the cases by architecture, scenario and side."""
    requirements = {item.id: item for item in record.concept.requirements}
    return [
        encoding.row(tables.campaign_fsr, (campaign_id, *values))
        for fsr in sorted(record.fsrs, key=lambda item: item.id)
        for values in _judged(fsr, requirements[fsr.id], record, counted)
    ]


def _judged(
    fsr: CampaignFsr,
    requirement: Requirement,
    record: CampaignRecord,
    counted: Counter[tuple[str, str, bool]],
) -> Iterator[Row]:
    """Say on which cases an FSR is judged; a row also where that is none, so none is forgotten."""
    expiries = [item.expires for item in record.concept.waivers if item.requirement == fsr.id]
    waived_until = max(expiries).isoformat() if expiries else None
    for architecture in sorted({key[0] for key in counted} | set(record.gate)):
        applicable = architecture not in fsr.not_applicable
        scenarios = sorted({key[1] for key in counted if key[0] == architecture})
        if requirement.scenarios:
            scenarios = [name for name in scenarios if name in requirement.scenarios]
        for scenario in scenarios or [""]:
            sides = {"inside": (True,), "outside": (False,)}.get(requirement.applies, (True, False))
            planned = sum(counted[architecture, scenario, side] for side in sides)
            yield (
                fsr.id,
                architecture,
                scenario,
                fsr.judged.get((architecture, scenario), fsr.digest),
                requirement.asil,
                requirement.mandatory,
                requirement.min_exercised,
                requirement.applies,
                architecture in record.gate,
                applicable,
                fsr.not_applicable.get(architecture),
                waived_until,
                planned if applicable else 0,
            )
