"""Judging results again: what lacks a verdict, what is known of it, and where verdicts go."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from adeye.store import basis, pending, recording, tables
from adeye.store.encoding import insert_rows
from adeye.store.leasing import is_held

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.store.block import JudgedBlock
    from adeye.store.database import Database
    from adeye.store.stored import Block


@dataclass(frozen=True, slots=True)
class Gap:
    """A result that lacks verdicts.

    Attributes:
        ordinal: Its place in the campaign, the first of several.
        result: Its digest.
        number: Of the run in this database.
        scenario: Id in the ODD.
        architecture: Id.
        trace_digest: Of its trace.
        fsrs: Ids of the FSRs that it was not judged on.
    """

    ordinal: int
    result: str
    number: int
    scenario: str
    architecture: str
    trace_digest: str
    fsrs: tuple[str, ...]


class Again:
    """Reads and keeps what judging again takes, each method in one transaction."""

    def __init__(self, database: Database) -> None:
        """Use an open database of the current schema."""
        self._database = database

    def gaps(self, campaign: str) -> list[Gap]:
        """List the results of a campaign that lack verdicts, in the order of the plan."""
        cases, fsrs, run = tables.campaign_case, tables.campaign_fsr, tables.run
        query = (
            select(
                cases.c.ordinal,
                cases.c.result_digest,
                run.c.number,
                cases.c.scenario,
                cases.c.architecture,
                run.c.trace_digest,
                fsrs.c.fsr_id,
            )
            .select_from(pending.with_gaps())
            .where(cases.c.campaign_id == campaign, pending.is_gap())
            .order_by(cases.c.ordinal, fsrs.c.fsr_id)
        )
        found: dict[str, tuple[Any, ...]] = {}
        missing: dict[str, dict[str, None]] = defaultdict(dict)
        with self._database.read() as connection:
            for *names, fsr in connection.execute(query):
                found.setdefault(names[1], tuple(names))
                missing[names[1]][fsr] = None
        return [Gap(*names, tuple(missing[result])) for result, names in found.items()]

    def bases(
        self, numbers: Sequence[int], version: int
    ) -> dict[int, tuple[bool, str | None, Mapping[str, str]]]:
        """Read whether contact ended runs, why they are invalid, and the uids of their metrics."""
        with self._database.read() as connection:
            uids = basis.read_uids(connection)
            found = basis.read_bases(connection, numbers, version)
        return {number: (item[0], item[1], uids[item[2]]) for number, item in found.items()}

    def metric(self, numbers: Sequence[int], name: str) -> dict[int, tuple[Any, ...]]:
        """Read value, status, time and actor of a metric, by number of the run."""
        with self._database.read() as connection:
            return basis.read_metric(connection, numbers, name)

    def extremes(self, numbers: Sequence[int], measure: str, version: int) -> dict[int, Any]:
        """Read the samples that decide formulas of one comparison, by number of the run."""
        with self._database.read() as connection:
            return basis.read_extremes(connection, numbers, measure, version)

    def files(self, numbers: Sequence[int]) -> list[tuple[int, str, int]]:
        """Read where traces are kept: number of the run, name of the file, place in it."""
        with self._database.read() as connection:
            return basis.read_files(connection, numbers)

    def add(self, judged: JudgedBlock) -> int:
        """Add verdicts to results; where traces were judged, they must be those of the results.

        Returns:
            How many were not there yet.

        Raises:
            IntegrityError: A result was judged otherwise before, or its trace is another one.
        """
        with self._database.write() as connection:
            if judged.trace_digests:
                recording.require_same_traces(connection, judged)
            basis.record_basis(connection, judged.result_digests, judged.basis)
            return recording.record_verdicts(connection, judged)

    def tally(self, block: Block) -> None:
        """Count, in a block that is not done, the FSRs that all of its cases are judged on.

        So a summary tells them, and only what is missing is NOT_RUN.
        """
        missing = {fsr for case in block.cases for fsr in case.missing_fsrs}
        with self._database.write() as connection:
            if not is_held(connection, block):
                return
            known = recording.tallied(connection, block.id)
            rows = [
                item
                for item in recording.tally_rows(connection, block.id)
                if item[2] not in missing and (item[2], item[4], item[5]) not in known
            ]
            insert_rows(connection, tables.tally, rows)
