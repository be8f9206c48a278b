"""What leaves the database, as frozen dataclasses without SQL."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.evaluation.verdict import Verdict
    from adeye.store.rows import EventRecord, ForkRecord, MetricValue, VerdictRecord


@dataclass(frozen=True)
class Plan:
    """What planning found.

    Attributes:
        campaign: Id of the campaign.
        planned: Number of test cases.
        to_execute: Test cases without a result.
        to_judge: Test cases with a result that lack a verdict of this campaign.
        is_new: Whether this selection was not in the database before.
        ends: Ordinals behind the last case of each stretch of cases that may share a block.
    """

    campaign: str
    planned: int
    to_execute: int
    to_judge: int
    is_new: bool
    ends: tuple[int, ...] = ()

    @property
    def reused(self) -> int:
        """Test cases whose result exists."""
        return self.planned - self.to_execute


@dataclass(frozen=True)
class BlockCase:
    """A test case of a claimed block and what it still needs.

    Attributes:
        ordinal: Its place in the campaign.
        test_case: Its digest.
        result_digest: Digest that its result must have.
        has_result: Whether the result exists already.
        missing_fsrs: Ids of FSRs without a verdict on it.
    """

    ordinal: int
    test_case: str
    result_digest: str
    has_result: bool
    missing_fsrs: tuple[str, ...]


@dataclass(frozen=True)
class Block:
    """A leased range of ordinals with the cases that need something.

    Attributes:
        id: Number of the block.
        campaign: Id of the campaign.
        attempt: The fencing token.
        cases: In the order of their ordinals, only those that lack a result or a verdict.
        bounds: Its first ordinal, and the one behind its last.
    """

    id: int
    campaign: str
    attempt: int
    cases: tuple[BlockCase, ...]
    bounds: tuple[int, int] = (0, 0)

    @property
    def to_execute(self) -> tuple[BlockCase, ...]:
        """Cases without a result; one of those that share a result."""
        missing = {case.result_digest: case for case in self.cases if not case.has_result}
        return tuple(missing.values())

    @property
    def to_judge(self) -> tuple[BlockCase, ...]:
        """Cases whose result exists but lacks verdicts."""
        judged = {
            case.result_digest: case for case in self.cases if case.has_result and case.missing_fsrs
        }
        return tuple(judged.values())


@dataclass(frozen=True)
class WorkState:
    """How many blocks of a campaign are in which state."""

    pending: int
    leased: int
    done: int
    quarantined: int

    @property
    def text(self) -> str:
        """``complete``, ``running``, ``interrupted`` or ``quarantined``."""
        if self.leased:
            return "running"
        if self.pending:
            return "interrupted"
        return "quarantined" if self.quarantined else "complete"


@dataclass(frozen=True)
class Finding:
    """Something in the database that is not as it was written.

    Attributes:
        table: Where.
        row: Key of the row; empty for the database as a whole.
        problem: What is wrong with it.
    """

    table: str
    row: str
    problem: str

    def __str__(self) -> str:
        """Write it as ``table row: problem``."""
        return f"{' '.join(filter(None, (self.table, self.row)))}: {self.problem}"


@dataclass(frozen=True)
class CampaignInfo:
    """A campaign with the state of its work.

    Attributes:
        id: Digest of its selection.
        number: Campaigns are numbered in the order in which they were first planned.
        created_at: UTC time at which it was first planned.
        odd: Id of the ODD.
        odd_digest: Its content.
        concept_digest: Content of the concept.
        title: One line for people.
        planned: Number of test cases.
        gate: Architectures that decide the exit code.
        factors: How the test cases were counted.
        provenance: Tool, packages, git state, who.
        work: Blocks by state.
    """

    id: str
    number: int
    created_at: str
    odd: str
    odd_digest: str
    concept_digest: str
    title: str
    planned: int
    gate: tuple[str, ...]
    factors: Any
    provenance: Mapping[str, Any]
    work: WorkState

    @property
    def state(self) -> str:
        """``complete``, ``running``, ``interrupted`` or ``quarantined``."""
        return self.work.text


@dataclass(frozen=True)
class FsrStatus:
    """Verdicts of one FSR for an architecture, in one scenario or over all (scenario empty).

    Attributes:
        fsr: Id of the FSR.
        architecture: Id of the architecture.
        scenario: Id of the scenario; empty over all scenarios.
        asil: ASIL of the FSR.
        is_mandatory: Whether the gate needs it.
        is_in_gate: Whether the architecture decides the exit code.
        is_applicable: Whether the architecture has the signals that it names.
        reason: Why not.
        counts: Runs by verdict, NOT_RUN among them.
        exercised: Different results in which its precondition held.
        runs_exercised: Runs in which it held.
        repeated: Of these, over all scenarios, the ones that repeat the result of another.
        repeated_passes: The same of the runs that PASS.
        planned: Runs planned.
        min_exercised: Different results that must PASS.
        waived_until: Expiry date of its waiver.
        worst_margin: Margin of the worst run, in ``unit``.
        worst_robustness: Robustness of that run.
        unit: Unit of the margin.
        worst_run: Result digest of that run.
        verdict: Folded; None where it is not applicable.
    """

    fsr: str
    architecture: str
    scenario: str
    asil: str
    is_mandatory: bool
    is_in_gate: bool
    is_applicable: bool
    reason: str | None
    counts: Mapping[Verdict, int]
    exercised: int
    runs_exercised: int
    repeated: int
    repeated_passes: int
    planned: int
    min_exercised: int
    waived_until: str | None
    worst_margin: float | None
    worst_robustness: float | None
    unit: str | None
    worst_run: str | None
    verdict: Verdict | None


@dataclass(frozen=True, slots=True)
class NeverHeld:
    """An implication below the top level of an FSR that no run of an architecture asked for.

    Attributes:
        antecedent: What never held.
        decides: Whether a run satisfies the FSR only because of that.
    """

    antecedent: str
    decides: bool


@dataclass(frozen=True)
class RunRef:
    """A run in a campaign.

    ``point`` holds the swept values by the name that the sweep uses, quantities in SI. A reference
    drive (``is_drive``) is in no campaign and judged by no FSR.
    """

    campaign: str
    ordinal: int
    result_digest: str
    test_case: str
    scenario: str
    architecture: str
    inside_odd: bool
    is_done: bool
    point: Mapping[str, float | str] = field(default_factory=dict, compare=False)
    is_drive: bool = False


@dataclass(frozen=True)
class StoredRun:
    """A result as the database holds it.

    Attributes:
        row: Columns of ``run`` by name.
        metrics: By id.
        verdicts: Every verdict that was ever given on it.
        events: In order.
        plugin_metrics: By table of the plug-in and id of the metric.
        links: Of the digest chain, before the trace digest; None where none were kept.
    """

    row: Mapping[str, Any]
    metrics: Mapping[str, MetricValue]
    verdicts: tuple[VerdictRecord, ...]
    events: tuple[EventRecord, ...]
    plugin_metrics: Mapping[str, Mapping[str, MetricValue]]
    links: tuple[str, ...] | None = None

    @property
    def trace_digest(self) -> str:
        """Digest of the trace in hex."""
        return str(self.row["trace_digest"])


@dataclass(frozen=True)
class StoredCase:
    """A test case as the database holds it: enough to make it again.

    Attributes:
        test_case: Its digest.
        situation: Digest of its situation.
        scenario: Executable content of the scenario, overrides applied.
        architecture: Executable content of the architecture, overrides applied.
        faults: Executable content of the faults.
        fault_entry: Name of the fault entry.
        parameters: Resolved scenario parameters in SI.
        replicate: Number of the replicate.
        seed: Seed of the ODD.
        step_s: Master clock [s].
        odd_digest: ODD whose plan made it first.
        point_index: Place of its point in that plan.
        fork: What its runs are forks of; None for the test case of a plan.
    """

    test_case: str
    situation: str
    scenario: Mapping[str, Any]
    architecture: Mapping[str, Any]
    faults: tuple[Mapping[str, Any], ...]
    fault_entry: str
    parameters: Mapping[str, float]
    replicate: int
    seed: int
    step_s: float
    odd_digest: str
    point_index: int
    fork: ForkRecord | None = None


@dataclass(frozen=True)
class ResultTable:
    """Rows with their column names, ready for a data frame."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]


@dataclass(frozen=True)
class DatabaseInfo:
    """What a database file holds.

    Attributes:
        path: Where it is.
        schema: Version of its schema.
        size_bytes: Size of the file.
        rows: Number of rows by table.
    """

    path: str
    schema: str
    size_bytes: int
    rows: Mapping[str, int]


@dataclass(frozen=True)
class Progress:
    """Test cases of a campaign: planned, with a result, and in a completed block."""

    planned: int
    executed: int
    accounted: int
