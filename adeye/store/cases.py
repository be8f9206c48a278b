"""What a campaign still needs: results that do not exist and verdicts that were never given."""

from __future__ import annotations

from itertools import groupby
from operator import itemgetter
from typing import Any, Final

from sqlalchemy import Connection

from adeye.store.records import BlockCase

JUDGED: Final = """f.campaign_id = c.campaign_id AND f.architecture = c.architecture
    AND f.scenario = c.scenario AND f.applicable = 1
    AND f.applies IN ('everywhere', CASE c.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END)"""
"""That an FSR ``f`` of a campaign is judged on a case ``c`` of it, inside or outside the ODD."""


def standing(*digests: str) -> str:
    """Write the condition that nobody has withdrawn the results that some columns name."""
    return (
        "NOT EXISTS (SELECT 1 FROM withdrawal x "  # noqa: S608 - own names
        f"WHERE x.result_digest IN ({', '.join(digests)}))"
    )


JUDGED_CASES: Final = f"""campaign_case c JOIN campaign_fsr f ON {JUDGED}
    JOIN run r ON r.result_digest = c.result_digest
    JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest"""
"""The cases of campaigns with the verdicts that the campaigns ask for."""
TWINS: Final = """half_step h CROSS JOIN campaign_case c ON c.result_digest = h.origin_digest
    AND EXISTS (SELECT 1 FROM uncertainty u WHERE u.campaign_id = c.campaign_id
        AND u.scenario = c.scenario AND u.architecture = c.architecture)"""
"""Twins with half the step that verdicts of campaigns rest on, with the cases that they are of."""
GAPS: Final = f"""campaign_case c JOIN run r ON r.result_digest = c.result_digest
    JOIN campaign_fsr f ON {JUDGED}
    LEFT JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
    WHERE c.campaign_id = ? AND v.run_number IS NULL"""
"""Results of a campaign with the FSRs that they are judged on and lack a verdict of."""
_RANGE: Final = "AND c.ordinal >= ? AND c.ordinal < ?"
_LACKS_RESULT: Final = (
    "c.campaign_id = ? AND NOT EXISTS (SELECT 1 FROM run r WHERE r.result_digest = c.result_digest)"
)


def lacks_result(connection: Connection, campaign_id: str, first: int, end: int) -> bool:
    """Return whether a case of an ordinal range has no result."""
    query = f"SELECT 1 FROM campaign_case c WHERE {_LACKS_RESULT} {_RANGE} LIMIT 1"  # noqa: S608
    return connection.exec_driver_sql(query, (campaign_id, first, end)).first() is not None


def lacks_verdict(connection: Connection, campaign_id: str, first: int, end: int) -> bool:
    """Return whether a case of an ordinal range has a result that was not judged on every FSR."""
    query = f"SELECT 1 FROM {GAPS} {_RANGE} LIMIT 1"  # noqa: S608 - own names
    return connection.exec_driver_sql(query, (campaign_id, first, end)).first() is not None


def gaps_of_done(connection: Connection, campaign_id: str) -> list[tuple[str, str]]:
    """List results of blocks that are done with the FSRs that they lack a verdict of."""
    query = f"""SELECT c.result_digest, f.fsr_id FROM {GAPS} AND EXISTS (
        SELECT 1 FROM work w WHERE w.campaign_id = c.campaign_id AND w.state = 'done'
            AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal)"""  # noqa: S608
    return [(item[0], item[1]) for item in connection.exec_driver_sql(query, (campaign_id,))]


def open_cases(
    connection: Connection, campaign_id: str, first: int, end: int
) -> tuple[BlockCase, ...]:
    """Find the cases of an ordinal range that lack a result or a verdict."""
    cases = connection.exec_driver_sql(
        "SELECT c.ordinal, c.test_case_digest, c.result_digest, r.number, c.architecture, "  # noqa: S608 - own names
        "c.scenario, c.inside_odd FROM campaign_case c "
        "LEFT JOIN run r ON r.result_digest = c.result_digest "
        f"WHERE c.campaign_id = ? {_RANGE} ORDER BY c.ordinal",
        (campaign_id, first, end),
    ).all()
    missing: dict[int, tuple[str, ...]] = {}
    if any(case[3] is not None for case in cases):
        rows = connection.exec_driver_sql(
            f"SELECT c.ordinal, f.fsr_id FROM {GAPS} {_RANGE} ORDER BY c.ordinal, f.fsr_id",  # noqa: S608
            (campaign_id, first, end),
        )
        missing = {
            place: tuple(fsr for _, fsr in items) for place, items in groupby(rows, itemgetter(0))
        }
    judged: dict[tuple[Any, ...], tuple[str, ...]] = {}
    found: list[BlockCase] = []
    for ordinal, test_case, result, run, *group in cases:
        names = ordinal, test_case, result
        if run is not None:
            if ordinal in missing:
                found.append(BlockCase(*names, has_result=True, missing_fsrs=missing[ordinal]))
            continue
        # Nothing was judged yet, so everything is missing.
        key = tuple(group)
        if key not in judged:
            fsrs = connection.exec_driver_sql(
                f"SELECT f.fsr_id FROM campaign_case c JOIN campaign_fsr f ON {JUDGED} "  # noqa: S608
                "WHERE c.campaign_id = ? AND c.ordinal = ? ORDER BY f.fsr_id",
                (campaign_id, ordinal),
            )
            judged[key] = tuple(fsrs.scalars())
        found.append(BlockCase(*names, has_result=False, missing_fsrs=judged[key]))
    return tuple(found)


def count_open(connection: Connection, campaign_id: str) -> tuple[int, int]:
    """Count the cases without a result, and those with a result that lack a verdict."""
    unexecuted = connection.exec_driver_sql(
        f"SELECT COUNT(*) FROM campaign_case c WHERE {_LACKS_RESULT}",  # noqa: S608 - own names
        (campaign_id,),
    ).scalar_one()
    if connection.exec_driver_sql("SELECT 1 FROM run LIMIT 1").first() is None:
        return unexecuted, 0
    unjudged = connection.exec_driver_sql(
        f"SELECT COUNT(DISTINCT c.ordinal) FROM {GAPS}",  # noqa: S608 - own names
        (campaign_id,),
    ).scalar_one()
    return unexecuted, unjudged


def missing_of_block(connection: Connection, work_id: int) -> frozenset[str]:
    """List the FSRs of which a block lacks a verdict."""
    block = connection.exec_driver_sql(
        "SELECT campaign_id, from_ordinal, to_ordinal FROM work WHERE id = ?", (work_id,)
    ).one()
    return frozenset(fsr for item in open_cases(connection, *block) for fsr in item.missing_fsrs)
