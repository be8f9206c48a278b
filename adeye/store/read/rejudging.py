"""Judging results again: what lacks a verdict, what is known of it, and where verdicts go."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any, Final

from adeye.store import tables
from adeye.store.block import JudgedBlock
from adeye.store.cases import GAPS, JUDGED
from adeye.store.catalogue import rows_of_runs
from adeye.store.database import Door, reading
from adeye.store.read.campaigns import plain_digests
from adeye.store.records import Block, EngineKey
from adeye.store.write import results
from adeye.store.write.queue import is_held


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


@dataclass(frozen=True, slots=True)
class StoredEvidence:
    """A run of a campaign with the FSRs that it was judged on.

    Attributes:
        result: Digest of the result.
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        point: Swept values as JSON.
        replicate: Number of the replicate.
        scenario_content: As JSON.
        architecture_content: As JSON.
        faults: As JSON.
        parameters: As JSON.
        seed: Of the ODD.
        step_s: Master clock [s].
        engine: What executed it.
        fsrs: Digest of what each FSR was judged by, numeric uncertainty included, by its id.
    """

    result: str
    scenario: str
    architecture: str
    fault_entry: str
    point: str
    replicate: int
    scenario_content: str
    architecture_content: str
    faults: str
    parameters: str
    seed: int
    step_s: float
    engine: EngineKey
    fsrs: Mapping[str, str]


_EVIDENCE: Final = f"""
    SELECT c.ordinal, c.result_digest, c.scenario, c.architecture, t.fault_entry, c.point,
        t.replicate, s.content, a.content, t.faults, t.parameters, t.seed, t.step_s, r.backend,
        r.variant, r.numerics_version, r.plugins_digest, f.fsr_id,
        f.fsr_digest
    FROM campaign_case c
    JOIN test_case t ON t.digest = c.test_case_digest
    JOIN scenario s ON s.digest = t.scenario_digest
    JOIN architecture a ON a.digest = t.architecture_digest
    JOIN run r ON r.result_digest = c.result_digest
    JOIN campaign_fsr f ON {JUDGED}
    JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
    WHERE c.campaign_id = ? ORDER BY c.ordinal, f.fsr_id
"""  # noqa: S608 - the condition is a constant of this package


class Again(Door):
    """Reads and keeps what judging again takes, each method in one transaction."""

    bases = reading(results.read_bases)
    metric = reading(results.read_metric)
    extremes = reading(results.read_extremes)
    files = reading(results.read_files)
    fsr_digests = reading(plain_digests)
    numbers = reading(results.numbers_of)

    def gaps(self, campaign: str) -> list[Gap]:
        """List the results of a campaign that lack verdicts, in the order of the plan."""
        query = (
            "SELECT c.ordinal, c.result_digest, r.number, c.scenario, c.architecture, "  # noqa: S608 - own names
            f"r.trace_digest, f.fsr_id FROM {GAPS} ORDER BY c.ordinal, f.fsr_id"
        )
        found: dict[str, Any] = {}
        missing: dict[str, dict[str, None]] = defaultdict(dict)
        with self._database.read() as connection:
            for *names, fsr in connection.exec_driver_sql(query, (campaign,)):
                found.setdefault(names[1], names)
                missing[names[1]][fsr] = None
        return [Gap(*(*found[result], tuple(missing[result]))) for result in found]

    def evidence(self, campaign: str) -> Iterator[StoredEvidence]:
        """Read the runs of a campaign that were judged, in the order of the plan."""
        with self._database.read() as connection:
            found = connection.exec_driver_sql(
                _EVIDENCE, (campaign,), execution_options={"yield_per": results.CHUNK}
            )
            for _, items in groupby(found, key=itemgetter(0)):
                rows = list(items)
                _, *names, backend, variant, version, plugins, _, _ = rows[0]
                engine = EngineKey(backend, variant, version, plugins)
                told: Any = (*names, engine, {row[-2]: row[-1] for row in rows})
                yield StoredEvidence(*told)

    def judged(self, numbers: Sequence[int]) -> dict[int, set[str]]:
        """Read the digests of the FSRs that runs were judged on."""
        judged: dict[int, set[str]] = defaultdict(set)
        with self._database.read() as connection:
            for number, digest in rows_of_runs(connection, tables.verdict, "fsr_digest", numbers):
                judged[number].add(digest)
        return dict(judged)

    def add(self, judged: JudgedBlock) -> int:
        """Add verdicts to results; where traces were judged, they must be those of the results.

        Returns:
            How many were not there yet.

        Raises:
            IntegrityError: A result was judged otherwise before, or its trace is another one.
        """
        with self._database.write() as connection:
            if judged.trace_digests:
                results.require_same_traces(connection, judged)
            results.record_basis(connection, judged.result_digests, judged.basis)
            return results.record_verdicts(connection, judged)

    def tally(self, block: Block) -> None:
        """Count, in a block that is not done, the FSRs that all of its cases are judged on.

        So a summary tells them, and only what is missing is NOT_RUN.
        """
        missing = {fsr for case in block.cases for fsr in case.missing_fsrs}
        with self._database.write() as connection:
            if is_held(connection, block):
                results.add_tallies(connection, block.id, missing)
