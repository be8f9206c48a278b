"""What a campaign still needs: results that do not exist and verdicts that were never given."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

from sqlalchemy import and_, case, distinct, func, or_, select

from adeye.store.encoding import chunks
from adeye.store.stored import BlockCase
from adeye.store.tables import campaign_case, campaign_fsr, run, verdict

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sqlalchemy import ColumnElement, Connection, FromClause


def is_judged() -> ColumnElement[bool]:
    """Whether an FSR of a campaign is judged on a case of it, inside or outside the ODD."""
    inside = campaign_case.c.inside_odd
    return and_(
        campaign_fsr.c.campaign_id == campaign_case.c.campaign_id,
        campaign_fsr.c.architecture == campaign_case.c.architecture,
        campaign_fsr.c.scenario == campaign_case.c.scenario,
        campaign_fsr.c.applicable,
        case(
            (campaign_fsr.c.applies == "everywhere", True),
            (campaign_fsr.c.applies == "inside", inside),
            else_=~inside,
        ),
    )


def _with_gaps() -> FromClause:
    return (
        campaign_case.outerjoin(run, run.c.result_digest == campaign_case.c.result_digest)
        .outerjoin(campaign_fsr, is_judged())
        .outerjoin(
            verdict,
            and_(
                verdict.c.result_digest == run.c.result_digest,
                verdict.c.fsr_digest == campaign_fsr.c.fsr_digest,
            ),
        )
    )


def _is_open() -> ColumnElement[bool]:
    return or_(
        run.c.result_digest.is_(None),
        and_(campaign_fsr.c.fsr_id.is_not(None), verdict.c.result_digest.is_(None)),
    )


def open_cases(
    connection: Connection, campaign_id: str, first: int, end: int
) -> tuple[BlockCase, ...]:
    """Find the cases of an ordinal range that lack a result or a verdict."""
    found = connection.execute(
        select(
            campaign_case.c.ordinal,
            campaign_case.c.test_case_digest,
            campaign_case.c.result_digest,
            run.c.result_digest.is_not(None).label("has_result"),
            campaign_fsr.c.fsr_id,
        )
        .select_from(_with_gaps())
        .where(
            campaign_case.c.campaign_id == campaign_id,
            campaign_case.c.ordinal >= first,
            campaign_case.c.ordinal < end,
            _is_open(),
        )
        .order_by(campaign_case.c.ordinal, campaign_fsr.c.fsr_id)
    )
    return tuple(
        BlockCase(
            ordinal=ordinal,
            test_case=test_case,
            result_digest=result,
            has_result=bool(has_result),
            missing_fsrs=tuple(item.fsr_id for item in items if item.fsr_id is not None),
        )
        for (ordinal, test_case, result, has_result), items in groupby(
            found, key=lambda item: tuple(item[:4])
        )
    )


def count_open(connection: Connection, campaign_id: str) -> tuple[int, int]:
    """Count the cases without a result, and those with a result that lack a verdict."""
    counted: dict[bool, int] = {}
    grouped = connection.execute(
        select(
            run.c.result_digest.is_not(None).label("has_result"),
            func.count(distinct(campaign_case.c.ordinal)),
        )
        .select_from(_with_gaps())
        .where(campaign_case.c.campaign_id == campaign_id, _is_open())
        .group_by("has_result")
    )
    for has_result, cases in grouped:
        counted[bool(has_result)] = cases
    return counted.get(False, 0), counted.get(True, 0)


def missing_verdicts(
    connection: Connection, campaign_id: str, fsr_digests: Iterable[str]
) -> dict[str, tuple[str, ...]]:
    """Find the results of a campaign that were never judged on given FSRs.

    Returns:
        Digests of the missing FSRs by result digest, in the order of the ordinals.
    """
    wanted = sorted(set(fsr_digests))
    results: Sequence[str] = (
        connection.execute(
            select(campaign_case.c.result_digest)
            .join(run, run.c.result_digest == campaign_case.c.result_digest)
            .where(campaign_case.c.campaign_id == campaign_id)
            .order_by(campaign_case.c.ordinal)
        )
        .scalars()
        .all()
    )
    known: set[Any] = set()
    for part in chunks(wanted):
        known |= {
            tuple(pair)
            for pair in connection.execute(
                select(verdict.c.result_digest, verdict.c.fsr_digest)
                .join(campaign_case, campaign_case.c.result_digest == verdict.c.result_digest)
                .where(campaign_case.c.campaign_id == campaign_id, verdict.c.fsr_digest.in_(part))
            )
        }
    gaps = {
        result: tuple(fsr for fsr in wanted if (result, fsr) not in known)
        for result in dict.fromkeys(results)
    }
    return {result: missing for result, missing in gaps.items() if missing}
