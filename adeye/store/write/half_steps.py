"""Save twins with half the step and the numeric uncertainty they told, and judge runs with it.

A twin belongs to a run and is in no selection, like a fork. A verdict with the uncertainty is the
verdict without it and one rule more (``judge.uncertainty.verdict_with``), so that it is made
from the row of that verdict: no run is executed for it.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from sqlalchemy import Connection

from adeye.errors import IntegrityError
from adeye.judge.uncertainty import Difference, NumericUncertainty, uncertain_detail, verdict_with
from adeye.store import tables
from adeye.store.block import JudgedBlock, RunBlock
from adeye.store.cases import JUDGED, count_open
from adeye.store.database import Door, reading, writing
from adeye.store.encoding import Row, row
from adeye.store.ledger import insert_rows, row_of
from adeye.store.records import RunRef, StoredRun, VerdictRecord, of_row, verdict_record
from adeye.store.texts import json_text
from adeye.store.write.results import changed_case, numbers_of, record_judged_runs, record_verdicts

_PART: Final = 2_048
"""Cases that are judged together."""

_PLAIN: Final = f"""SELECT r.result_digest, c.scenario, c.architecture, u.judged_digest, v.*
FROM campaign_case c
JOIN run r ON r.result_digest = c.result_digest
JOIN campaign_fsr f ON {JUDGED}
JOIN (SELECT DISTINCT scenario, architecture, name, fsr_digest, judged_digest
    FROM uncertainty WHERE campaign_id = ? AND kind = 'fsr') u
    ON u.scenario = c.scenario AND u.architecture = c.architecture AND u.name = f.fsr_id
    AND u.judged_digest = f.fsr_digest
JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = u.fsr_digest
LEFT JOIN verdict w ON w.run_number = r.number AND w.fsr_digest = f.fsr_digest
WHERE c.campaign_id = ? AND c.ordinal >= ? AND c.ordinal < ? AND w.run_number IS NULL
ORDER BY c.ordinal, f.fsr_id"""  # noqa: S608 - the condition is a constant of this package


@dataclass(frozen=True)
class HalfStepRecord:
    """A run that is the same as another but for its step, which is half as long.

    Attributes:
        result_digest: The twin.
        test_case: Its test case.
        origin: Result digest of the run with the whole step.
        origin_case: Test case of that run.
        step_s: Step of the twin [s].
    """

    result_digest: str
    test_case: str
    origin: str
    origin_case: str
    step_s: float


@dataclass(frozen=True)
class UncertaintyRecord:
    """One line of what halving the step changed in a scenario and architecture of a campaign.

    Attributes:
        scenario: Id in the ODD.
        architecture: Id.
        difference: What changed.
        fsr_digest: Of an FSR, identity of what is judged; empty for a metric.
        judged_digest: Of an FSR, identity of judging it with the uncertainty.
    """

    scenario: str
    architecture: str
    difference: Difference
    fsr_digest: str = ""
    judged_digest: str = ""


def judge_with_uncertainty(connection: Connection, campaign: str, first: int, end: int) -> int:
    """Add the verdicts with numeric uncertainty that results of an ordinal range lack.

    Args:
        connection: In a write transaction.
        campaign: Id.
        first: First ordinal.
        end: Behind the last.

    Returns:
        Number of rows added; results that were not judged without it are left out.
    """
    numeric = _numeric(connection, campaign)
    if not numeric:
        return 0
    found = connection.exec_driver_sql(_PLAIN, (campaign, campaign, first, end)).mappings().all()
    if not found:
        return 0
    verdicts: dict[str, dict[str, VerdictRecord]] = defaultdict(dict)
    for item in found:
        least = numeric[item["scenario"], item["architecture"], item["fsr_id"]]
        judged = _with_uncertainty(verdict_record(item), least)
        # Two cases of a campaign may be one test case.
        verdicts[item["result_digest"]][judged.fsr_digest] = judged
    block = JudgedBlock.of({run: tuple(of.values()) for run, of in verdicts.items()})
    return record_verdicts(connection, block)


def _with_uncertainty(plain: VerdictRecord, uncertainty: NumericUncertainty) -> VerdictRecord:
    """Judge a verdict again, as ``rulings.Frame.judge`` does with the same uncertainty."""
    judged = replace(plain, fsr_digest=uncertainty.digest)
    verdict = verdict_with(plain.verdict, plain.margin, plain.unit, uncertainty)
    if verdict is plain.verdict:
        return judged
    detail = uncertain_detail(float(uncertainty.of([plain.unit])[0]), plain.unit)
    return replace(judged, verdict=verdict, detail=detail)


def _uncertainty_row(campaign: str, item: UncertaintyRecord) -> Row:
    return row_of(
        tables.uncertainty,
        item.difference,
        campaign_id=campaign,
        scenario=item.scenario,
        architecture=item.architecture,
        changes=json_text(dict(item.difference.changes)),
        fsr_digest=item.fsr_digest or None,
        judged_digest=item.judged_digest or None,
    )


def read_uncertainty(connection: Connection, campaign: str) -> tuple[UncertaintyRecord, ...]:
    """Return what halving the step changed; empty if the campaign did not ask.

    Of a sample with a withdrawn run the uncertainty is unknown.
    """
    found = connection.exec_driver_sql(
        "SELECT v.*, u.fsr_digest, u.judged_digest FROM v_uncertainty v "
        "JOIN uncertainty u ON u.campaign_id = v.campaign AND u.scenario = v.scenario "
        "AND u.architecture = v.architecture AND u.kind = v.kind AND u.name = v.name "
        "AND u.unit = v.unit WHERE v.campaign = ? "
        "ORDER BY v.scenario, v.architecture, v.kind, v.name, v.unit",
        (campaign,),
    ).mappings()
    return tuple(
        of_row(
            UncertaintyRecord,
            item,
            difference=of_row(Difference, item, changes=json.loads(item["changes"])),
            fsr_digest=item["fsr_digest"] or "",
            judged_digest=item["judged_digest"] or "",
        )
        for item in found
    )


def _numeric(
    connection: Connection, campaign: str
) -> dict[tuple[str, str, str], NumericUncertainty]:
    """Give the numeric uncertainty by scenario, architecture and FSR."""
    found = connection.exec_driver_sql(
        "SELECT scenario, architecture, name, judged_digest, unit, uncertainty FROM uncertainty "
        "WHERE campaign_id = ? AND kind = 'fsr'",
        (campaign,),
    )
    least: dict[tuple[str, str, str, str], dict[str, float]] = defaultdict(dict)
    for *key, unit, value in found:
        units = least[key[0], key[1], key[2], key[3]]
        if value is not None:
            units[unit] = value
    return {key[:3]: NumericUncertainty(key[3], units) for key, units in least.items()}


class HalfSteps(Door):
    """Reads and keeps twins and what they told, each method in one transaction."""

    known = reading(numbers_of)
    save_runs = writing(record_judged_runs)
    uncertainty = reading(read_uncertainty)
    count_open = reading(count_open)

    def judged(self, results: Sequence[str]) -> frozenset[tuple[str, str]]:
        """Tell on which FSRs results were judged: pairs of result digest and FSR digest."""
        found = self._ask(
            "SELECT r.result_digest, v.fsr_digest FROM run r "
            "JOIN verdict v ON v.run_number = r.number "
            "WHERE r.result_digest IN (SELECT value FROM json_each(?))",
            json.dumps(list(results)),
        )
        return frozenset((item[0], item[1]) for item in found)

    def save_twins(self, twins: Sequence[HalfStepRecord], block: RunBlock) -> None:
        """Save twins with their test cases, results and verdicts; known ones stay.

        Args:
            twins: What each is the twin of.
            block: Their results, in the same order.

        Raises:
            IntegrityError: A result or verdict contradicts one that exists.
            ValueError: The results are not those of the twins.
        """
        if block.result_digests != tuple(twin.result_digest for twin in twins):
            raise ValueError("the results are not those of the twins")
        table = tables.half_step
        with self._database.write() as connection:
            cases = [
                changed_case(
                    connection, twin.origin_case, digest=twin.test_case, step_s=twin.step_s
                )
                for twin in twins
            ]
            insert_rows(connection, tables.test_case, cases, ignore_existing=True)
            record_judged_runs(connection, block)
            rows = [row(table, (twin.result_digest, twin.test_case, twin.origin)) for twin in twins]
            insert_rows(connection, table, rows, ignore_existing=True)

    def save_uncertainty(self, campaign: str, found: Sequence[UncertaintyRecord]) -> None:
        """Keep what halving the step changed.

        Raises:
            IntegrityError: Something else was found before.
        """
        rows = [_uncertainty_row(campaign, item) for item in found]
        with self._database.write() as connection:
            hashes = connection.exec_driver_sql(
                "SELECT row_hash FROM uncertainty WHERE campaign_id = ?", (campaign,)
            )
            known = set(hashes.scalars())
            if known and known != {item[-1] for item in rows}:
                raise IntegrityError(
                    f"campaign {campaign[:12]}: halving the step changed something else before. "
                    "A result of the sample is not what it was; `adeye db verify` looks for it."
                )
            if not known:
                insert_rows(connection, tables.uncertainty, rows)

    def judge(self, campaign: str) -> None:
        """Judge with it every result that is there and was judged without it."""
        (found,) = self._ask("SELECT planned FROM campaign WHERE id = ?", campaign)
        for first in range(0, found.planned, _PART):
            # Part by part, so that no transaction is long; asked again it goes on.
            with self._database.write() as connection:
                judge_with_uncertainty(connection, campaign, first, first + _PART)

    def judged_with(self, run: RunRef, stored: StoredRun) -> dict[str, NumericUncertainty]:
        """Give the numeric uncertainty that a run was judged with, by FSR.

        Forks and twins are judged without any.
        """
        with self._database.read() as connection:
            found = _numeric(connection, run.campaign)
        judged = {verdict.fsr_digest for verdict in stored.verdicts}
        return {
            fsr: item
            for (scenario, architecture, fsr), item in found.items()
            if (scenario, architecture) == (run.scenario, run.architecture)
            and item.digest in judged
        }
