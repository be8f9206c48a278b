"""Save a campaign: its selection of test cases, what judges them, and the blocks of work.

A campaign is a selection, so its id is the digest of what is selected: the ODD, the concept, how
FSRs are judged, and for every ordinal the test case with the result that it must have. Planning
the same selection again finds the same campaign and changes no row. Another threshold or another
version of a plug-in is another campaign, which reuses whatever results it still can.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from itertools import groupby
from typing import TYPE_CHECKING, Final

from sqlalchemy import Column, Integer, MetaData, String, Table, Text, func, select

from adeye.errors import InputError
from adeye.store import tables
from adeye.store.content import concept_record, save_concept, save_content
from adeye.store.encoding import Row, insert_rows, json_text, row, utc_text
from adeye.store.pending import count_open, open_cases
from adeye.store.recording import write_tallies
from adeye.store.stored import Plan

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from sqlalchemy import Connection

    from adeye.spec.concept import Concept, Requirement
    from adeye.store.rows import CampaignFsr, CampaignRecord, PlannedCase

_CHUNK: Final = 1000

_STAGED: Final = Table(
    "staged_case",
    MetaData(),
    Column("ordinal", Integer, primary_key=True, autoincrement=False),
    Column("test_case_digest", String(64)),
    Column("result_digest", String(64)),
    Column("scenario", Text),
    Column("architecture", Text),
    Column("inside_odd", Integer),
    Column("point", Text),
    Column("structure", Text),
    prefixes=["TEMPORARY"],
)


class SelectionHash:
    """Identity of a selection, fed case by case in the order of the ordinals."""

    def __init__(self, odd_digest: str, concept_digest: str, gate: str, judging: str) -> None:
        """Begin with what the campaign says about all its cases."""
        self._hash = hashlib.sha256(json_text([odd_digest, concept_digest, gate, judging]).encode())
        self.count = 0

    def add(self, values: Row) -> None:
        """Add a case: digests of test case and result, scenario, architecture, inside, point."""
        self._hash.update(json_text(values).encode())
        self.count += 1

    @property
    def campaign_id(self) -> str:
        """The first 128 bits in hex."""
        return self._hash.hexdigest()[:32]


def judging_hash(rows: Iterable[Row]) -> str:
    """Hash all rows of ``campaign_fsr`` of a campaign, in the order of their key."""
    return hashlib.sha256(" ".join(sorted(item[-1] for item in rows)).encode()).hexdigest()


def plan_campaign(
    connection: Connection,
    record: CampaignRecord,
    cases: Iterable[PlannedCase],
    block_size: int,
) -> Plan:
    """Save a campaign and its work unless it is there already.

    Cases may be an iterator; they are staged in a temporary table, never held together.

    Args:
        connection: In a write transaction.
        record: The campaign.
        cases: Test cases in the order of their ordinals.
        block_size: Most ordinals in one block of work.

    Raises:
        InputError: There are no test cases.
        ValueError: The record does not say how each FSR of its concept is judged.
    """
    _require_all_fsrs(record)
    odd_digest = save_content(connection, "odd", record.odd)
    save_concept(connection, record.concept)
    connection.exec_driver_sql("DROP TABLE IF EXISTS temp.staged_case")
    _STAGED.create(connection)
    campaign_id, planned = _stage(connection, record, cases, odd_digest)
    if planned == 0:
        raise InputError(
            f"campaign of ODD {record.odd.id!r}: no test cases",
            remedy="An empty selection proves nothing; widen the sweep or its constraints.",
        )
    known = connection.execute(
        select(tables.campaign.c.id).where(tables.campaign.c.id == campaign_id)
    ).first()
    if known is None:
        fsrs = _fsr_rows(connection, campaign_id, record)
        hashed = judging_hash(fsrs)
        _save_campaign(connection, campaign_id, record, planned, hashed)
        _save_cases(connection, campaign_id)
        insert_rows(connection, tables.campaign_fsr, fsrs)
        _save_work(connection, campaign_id, block_size)
    _STAGED.drop(connection)
    to_execute, to_judge = count_open(connection, campaign_id)
    return Plan(campaign_id, planned, to_execute, to_judge, is_new=known is None)


def _require_all_fsrs(record: CampaignRecord) -> None:
    given = sorted(item.id for item in record.fsrs)
    expected = sorted(item.id for item in record.concept.requirements)
    if given != expected:
        msg = f"FSRs {given} are given, the concept has {expected}"
        raise ValueError(msg)


def _stage(
    connection: Connection, record: CampaignRecord, cases: Iterable[PlannedCase], odd_digest: str
) -> tuple[str, int]:
    """Save test cases and stage the selection; return the campaign's id and its size."""
    identity = SelectionHash(
        odd_digest, concept_record(record.concept).digest, _gate_text(record), _judging_text(record)
    )
    saved: set[str] = set()
    for chunk in _chunked(cases):
        staged: list[Row] = []
        for case in chunk:
            for kind, content in (
                ("scenario", case.scenario_content),
                ("architecture", case.architecture_content),
            ):
                if content.digest not in saved:
                    saved.add(save_content(connection, kind, content))
            values = _selected(case)
            staged.append((identity.count, *values, case.structure))
            identity.add(values)
        insert_rows(
            connection,
            tables.test_case,
            [_test_case(case, odd_digest) for case in chunk],
            ignore_existing=True,
        )
        insert_rows(connection, _STAGED, staged)
    return identity.campaign_id, identity.count


def _gate_text(record: CampaignRecord) -> str:
    return json_text(sorted(record.gate))


def _judging_text(record: CampaignRecord) -> str:
    return json_text(
        sorted([item.id, item.digest, dict(item.not_applicable)] for item in record.fsrs)
    )


def _selected(case: PlannedCase) -> Row:
    return (
        case.test_case,
        case.result_digest,
        case.scenario,
        case.architecture,
        int(case.inside_odd),
        json_text(dict(case.point)),
    )


def _test_case(case: PlannedCase, odd_digest: str) -> Row:
    return row(
        tables.test_case,
        (
            case.test_case,
            case.situation,
            case.scenario_content.digest,
            case.architecture_content.digest,
            case.fault_entry,
            json_text([dict(fault) for fault in case.faults]),
            json_text(dict(case.parameters)),
            case.replicate,
            case.seed,
            case.step_s,
            odd_digest,
            case.point_index,
        ),
    )


def _chunked(cases: Iterable[PlannedCase]) -> Iterator[list[PlannedCase]]:
    chunk: list[PlannedCase] = []
    for case in cases:
        chunk.append(case)
        if len(chunk) == _CHUNK:
            yield chunk
            chunk = []
    if chunk:
        yield chunk


def _save_campaign(
    connection: Connection, campaign_id: str, record: CampaignRecord, planned: int, hashed: str
) -> None:
    number = connection.execute(
        select(func.coalesce(func.max(tables.campaign.c.number), 0) + 1)
    ).scalar_one()
    values = (
        number,
        campaign_id,
        utc_text(None),
        record.odd.id,
        record.odd.digest,
        concept_record(record.concept).digest,
        record.title,
        planned,
        json_text(record.factors),
        _gate_text(record),
        json_text({name: dict(units) for name, units in record.units.items()}),
        _judging_text(record),
        hashed,
        json_text(dict(record.provenance)),
    )
    insert_rows(connection, tables.campaign, [row(tables.campaign, values)])


def _save_cases(connection: Connection, campaign_id: str) -> None:
    staged = connection.execute(
        select(*list(_STAGED.c)[:-1]).order_by(_STAGED.c.ordinal),
        execution_options={"yield_per": _CHUNK},
    )
    for chunk in staged.partitions(_CHUNK):
        insert_rows(
            connection,
            tables.campaign_case,
            [row(tables.campaign_case, (campaign_id, *values)) for values in chunk],
        )


def _fsr_rows(connection: Connection, campaign_id: str, record: CampaignRecord) -> list[Row]:
    counted: Counter[tuple[str, str, bool]] = Counter()
    grouped = connection.execute(
        select(
            _STAGED.c.architecture, _STAGED.c.scenario, _STAGED.c.inside_odd, func.count()
        ).group_by(_STAGED.c.architecture, _STAGED.c.scenario, _STAGED.c.inside_odd)
    )
    for architecture, scenario, inside_odd, cases in grouped:
        counted[architecture, scenario, bool(inside_odd)] += cases
    requirements = {item.id: item for item in record.concept.requirements}
    return [
        row(tables.campaign_fsr, (campaign_id, *values))
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
    waived_until = _waived_until(record.concept, fsr.id)
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
                fsr.digest,
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


def _waived_until(concept: Concept, fsr_id: str) -> str | None:
    expiries = [item.expires for item in concept.waivers if item.requirement == fsr_id]
    return max(expiries).isoformat() if expiries else None


def _save_work(connection: Connection, campaign_id: str, block_size: int) -> None:
    """Cut the ordinals into blocks; those that need nothing are done at once, with tallies."""
    if block_size < 1:
        msg = f"block_size is {block_size}, at least 1 is needed"
        raise ValueError(msg)
    structures = connection.execute(
        select(_STAGED.c.structure, _STAGED.c.ordinal).order_by(_STAGED.c.ordinal),
        execution_options={"yield_per": _CHUNK},
    )
    start = 0
    for _structure, group in groupby(structures, key=lambda item: str(item.structure)):
        end = start + sum(1 for _ in group)
        for first in range(start, end, block_size):
            _save_block(connection, campaign_id, first, min(first + block_size, end))
        start = end


def _save_block(connection: Connection, campaign_id: str, first: int, end: int) -> None:
    missing = open_cases(connection, campaign_id, first, end)
    if any(not case.has_result for case in missing):
        kind = "execute"
    else:
        kind = "judge" if missing else "reused"
    inserted = connection.execute(
        tables.work.insert()
        .values(
            campaign_id=campaign_id,
            kind=kind,
            from_ordinal=first,
            to_ordinal=end,
            state="pending" if missing else "done",
            attempt=0,
            failures=0,
        )
        .returning(tables.work.c.id)
    )
    work_id = inserted.scalar_one()
    if not missing:
        write_tallies(connection, work_id)
