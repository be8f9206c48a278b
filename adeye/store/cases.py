"""What a campaign still needs: results that do not exist and verdicts that were never given."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import and_, case, distinct, exists, func, select

from adeye.store.evidence_tables import is_true
from adeye.store.records import BlockCase
from adeye.store.tables import campaign_case, campaign_fsr, run, verdict, work

if TYPE_CHECKING:
    from sqlalchemy import ColumnElement, Connection, FromClause, Select


JUDGED: Final = """f.campaign_id = c.campaign_id AND f.architecture = c.architecture
    AND f.scenario = c.scenario AND f.applicable = 1
    AND f.applies IN ('everywhere', CASE c.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END)"""
"""``is_judged`` as text, of an FSR ``f`` of a campaign and a case ``c``."""


def is_judged() -> ColumnElement[bool]:
    """Whether an FSR of a campaign is judged on a case of it, inside or outside the ODD."""
    return and_(
        campaign_fsr.c.campaign_id == campaign_case.c.campaign_id,
        campaign_fsr.c.architecture == campaign_case.c.architecture,
        campaign_fsr.c.scenario == campaign_case.c.scenario,
        is_true(campaign_fsr.c.applicable),
        campaign_fsr.c.applies.in_(
            ["everywhere", case((is_true(campaign_case.c.inside_odd), "inside"), else_="outside")]
        ),
    )


def with_gaps() -> FromClause:
    """Join the results that exist with the FSRs that they are judged on and their verdicts."""
    return (
        campaign_case.join(run, run.c.result_digest == campaign_case.c.result_digest)
        .join(campaign_fsr, is_judged())
        .outerjoin(
            verdict,
            and_(
                verdict.c.run_number == run.c.number,
                verdict.c.fsr_digest == campaign_fsr.c.fsr_digest,
            ),
        )
    )


def is_gap() -> ColumnElement[bool]:
    """Whether a verdict is missing where ``with_gaps`` looks for one."""
    return verdict.c.run_number.is_(None)


def lacks_result(connection: Connection, campaign_id: str, first: int, end: int) -> bool:
    """Tell whether a case of an ordinal range has no result."""
    found = _in_range(select(campaign_case.c.ordinal), campaign_id, first, end)
    return connection.execute(found.where(~_has_result()).limit(1)).first() is not None


def lacks_verdict(connection: Connection, campaign_id: str, first: int, end: int) -> bool:
    """Tell whether a case of an ordinal range has a result that was not judged on every FSR."""
    found = _in_range(
        select(campaign_case.c.ordinal).select_from(with_gaps()), campaign_id, first, end
    )
    return connection.execute(found.where(is_gap()).limit(1)).first() is not None


def _in_range(query: Select[Any], campaign_id: str, first: int, end: int) -> Select[Any]:
    return query.where(
        campaign_case.c.campaign_id == campaign_id,
        campaign_case.c.ordinal >= first,
        campaign_case.c.ordinal < end,
    )


def _has_result() -> ColumnElement[bool]:
    return exists().where(run.c.result_digest == campaign_case.c.result_digest)


def open_cases(
    connection: Connection, campaign_id: str, first: int, end: int
) -> tuple[BlockCase, ...]:
    """Find the cases of an ordinal range that lack a result or a verdict."""
    cases = connection.execute(
        _in_range(
            select(
                campaign_case.c.ordinal,
                campaign_case.c.test_case_digest,
                campaign_case.c.result_digest,
                _has_result(),
                campaign_case.c.architecture,
                campaign_case.c.scenario,
                campaign_case.c.inside_odd,
            ),
            campaign_id,
            first,
            end,
        ).order_by(campaign_case.c.ordinal)
    ).all()
    missing: dict[int, tuple[str, ...]] = {}
    if any(case[3] for case in cases):
        missing = _missing_fsrs(connection, campaign_id, first, end)
    judged: dict[tuple[Any, ...], tuple[str, ...]] = {}
    found: list[BlockCase] = []
    for ordinal, test_case, result, has_result, architecture, scenario, inside in cases:
        names = ordinal, test_case, result
        if has_result:
            if ordinal in missing:
                found.append(BlockCase(*names, has_result=True, missing_fsrs=missing[ordinal]))
            continue
        # Nothing was judged yet, so everything is missing.
        key = architecture, scenario, inside
        if key not in judged:
            judged[key] = _judged_fsrs(connection, campaign_id, ordinal)
        found.append(BlockCase(*names, has_result=False, missing_fsrs=judged[key]))
    return tuple(found)


def _missing_fsrs(
    connection: Connection, campaign_id: str, first: int, end: int
) -> dict[int, tuple[str, ...]]:
    """Find the FSRs that existing results of an ordinal range were not judged on, by ordinal."""
    query = select(campaign_case.c.ordinal, campaign_fsr.c.fsr_id).select_from(with_gaps())
    rows = connection.execute(
        _in_range(query, campaign_id, first, end)
        .where(is_gap())
        .order_by(campaign_case.c.ordinal, campaign_fsr.c.fsr_id)
    )
    return {
        ordinal: tuple(item.fsr_id for item in items)
        for ordinal, items in groupby(rows, key=lambda item: int(item.ordinal))
    }


def _judged_fsrs(connection: Connection, campaign_id: str, ordinal: int) -> tuple[str, ...]:
    """List the FSRs that a case is judged on."""
    query = select(campaign_fsr.c.fsr_id).select_from(campaign_case.join(campaign_fsr, is_judged()))
    found = _in_range(query, campaign_id, ordinal, ordinal + 1).order_by(campaign_fsr.c.fsr_id)
    return tuple(connection.execute(found).scalars())


def count_open(connection: Connection, campaign_id: str) -> tuple[int, int]:
    """Count the cases without a result, and those with a result that lack a verdict."""
    unexecuted = connection.execute(
        select(func.count()).where(campaign_case.c.campaign_id == campaign_id, ~_has_result())
    ).scalar_one()
    if connection.execute(select(run.c.number).limit(1)).first() is None:
        return unexecuted, 0
    unjudged = connection.execute(
        select(func.count(distinct(campaign_case.c.ordinal)))
        .select_from(with_gaps())
        .where(campaign_case.c.campaign_id == campaign_id, is_gap())
    ).scalar_one()
    return unexecuted, unjudged


def missing_of_block(connection: Connection, work_id: int) -> frozenset[str]:
    """List the FSRs of which a block lacks a verdict."""
    block = connection.execute(work.select().where(work.c.id == work_id)).one()
    found = open_cases(connection, block.campaign_id, block.from_ordinal, block.to_ordinal)
    return frozenset(fsr for item in found for fsr in item.missing_fsrs)
