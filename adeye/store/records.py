"""What enters the database, as frozen dataclasses without SQL."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from keyword import iskeyword
from typing import TYPE_CHECKING, Any, Final, TypeVar

from adeye.errors import InputError
from adeye.identity import canonical_json, digest, digest_bytes
from adeye.judge.verdict import Judgement, Verdict

if TYPE_CHECKING:
    from adeye.spec.concept import Concept

# --- What enters the database, as frozen dataclasses without SQL ----------------------------------

MAX_SEED: Final = 2**63 - 1
RAISED: Final = "PluginError: "
"""How the detail of a block begins in which code from outside raised where no run records it."""
LEFT_OUT: Final = "left_out"
"""Key of an ODD as it is stored: places of maps that no test case has, by scenario."""

Record = TypeVar("Record")


def of_row(record: Callable[..., Record], stored: Mapping[Any, Any], **others: Any) -> Record:
    """Read a record from a row whose columns are called as its fields, see ``values_of``.

    Args:
        record: Its class, a dataclass.
        stored: Values by column.
        others: Fields that the row has not, or not as they are.

    Raises:
        KeyError: A field is neither given nor in the row; none keeps its default unsaid.
    """
    names: list[str] = [item.name for item in fields(record)]  # type: ignore[arg-type]
    own = {name: stored[name.rstrip("_")] for name in names if name not in others}
    return record(**own, **others)


def of_fields(record: Callable[..., Record], source: object, **others: Any) -> Record:
    """Make a record from another one that has fields of the same names.

    Args:
        record: Its class, a dataclass.
        source: The other record.
        others: Fields that it has not, or not as they are.
    """
    names: list[str] = [item.name for item in fields(record)]  # type: ignore[arg-type]
    own = {name: getattr(source, name) for name in names if name not in others}
    return record(**own, **others)


def values_of(names: Iterable[str], record: object, **others: Any) -> list[Any]:
    """List what a record has for columns that are called as its fields.

    Args:
        names: Of the columns; a word of Python has an underscore behind it as a field.
        record: What has the fields.
        others: Values that it has not, or not as they are.
    """
    return [
        others[name] if name in others else getattr(record, f"{name}_" if iskeyword(name) else name)
        for name in names
    ]


@dataclass(frozen=True)
class EngineKey:
    """What a result depends on beside its test case.

    Attributes:
        backend: Name of the traffic implementation.
        variant: Arithmetic variant of it.
        numerics_version: Raised when the bits of a trace change on purpose.
        plugins_digest: Digest over code and version of the plug-ins in the architecture; empty
            without plug-ins.
    """

    backend: str
    variant: str
    numerics_version: int
    plugins_digest: str = ""

    def result_digest(self, test_case: str) -> str:
        """Identify the result that this engine gives for a test case (sha256 in hex)."""
        before, after = self._frame
        # A digest needs no escaping.
        is_plain = test_case.isascii() and test_case.isalnum()
        middle = f'"{test_case}"'.encode() if is_plain else canonical_json(test_case)
        return digest_bytes(before + middle + after)

    def result_digests(self, test_cases: Iterable[str]) -> list[str]:
        """Identify the results of many test cases, whose digests are hexadecimal."""
        before, after = self._frame
        head, tail = before + b'"', b'"' + after
        sha256 = hashlib.sha256
        return [sha256(head + case.encode() + tail).hexdigest() for case in test_cases]

    @cached_property
    def _frame(self) -> tuple[bytes, bytes]:
        """What stands before and behind the test case in the canonical JSON of the identity."""
        others = {
            "backend": self.backend,
            "numerics_version": self.numerics_version,
            "plugins": self.plugins_digest,
        }
        before = canonical_json(others)[:-1] + b',"test_case":'
        return before, canonical_json({"variant": self.variant}).replace(b"{", b",", 1)


@dataclass(frozen=True)
class ContentRecord:
    """Something a user wrote, kept by the digest of its content.

    Share one record between all test cases that have this content: its digest is computed once.

    Attributes:
        id: The name that users gave it.
        version: Version text of its provenance; may be empty.
        content: JSON-compatible content; its digest is the identity.
    """

    id: str
    version: str
    content: Mapping[str, Any]

    @cached_property
    def digest(self) -> str:
        """Digest of the content (sha256 in hex)."""
        return digest(self.content)


def require_seed(seed: int) -> None:
    """Refuse a seed that no database keeps.

    Raises:
        InputError: It is negative, or has more than 63 bits.
    """
    if not 0 <= seed <= MAX_SEED:
        raise InputError(f"seed: {seed} is not within 0 to {MAX_SEED}", remedy="Choose another.")


@dataclass(frozen=True)
class CampaignFsr:
    """How one FSR of the concept is judged in a campaign.

    Attributes:
        id: Id of the requirement in the concept.
        digest: Digest of everything that its verdict depends on beside the trace.
        not_applicable: Why it cannot be judged, by architecture id.
        judged: Digest that its verdicts have where it is judged with a numeric uncertainty, by
            architecture and scenario; elsewhere they have ``digest``.
    """

    id: str
    digest: str
    not_applicable: Mapping[str, str] = field(default_factory=dict)
    judged: Mapping[tuple[str, str], str] = field(default_factory=dict)


@dataclass(frozen=True)
class CampaignRecord:
    """A selection of test cases with the concept that judges them.

    Attributes:
        odd: The ODD with everything that it names.
        concept: The concept.
        fsrs: One entry for each requirement of the concept.
        gate: Architectures that decide the exit code.
        factors: How the test cases were counted, JSON-compatible.
        title: One line for people.
        units: SI suffix of a parameter (``mps``) by scenario and parameter, for column names.
        provenance: Tool, numerics version, packages, git state, who; JSON-compatible.
    """

    odd: ContentRecord
    concept: Concept
    fsrs: Sequence[CampaignFsr]
    gate: Sequence[str] = ()
    factors: Any = None
    title: str = ""
    units: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class MetricValue:
    """A metric of one run: a finite value, or the reason why there is none.

    Attributes:
        value: In the metric's unit; None unless the status is ``value``.
        status: ``value``, ``no_conflict``, ``not_applicable``, ``undefined``, ``incomplete`` or
            ``error``.
        time_s: Time of the worst case [s].
        actor: Actor of the worst case.
    """

    value: float | None
    status: str = "value"
    time_s: float | None = None
    actor: str | None = None

    def __post_init__(self) -> None:
        has_value = self.value is not None and math.isfinite(self.value)
        if (self.value is not None) != has_value or has_value != (self.status == "value"):
            raise ValueError(f"metric value {self.value!r} does not fit status {self.status!r}")


@dataclass(frozen=True)
class VerdictRecord(Judgement):
    """A verdict that is stored: never NOT_RUN, and no number that is not one; else ERROR."""

    def __post_init__(self) -> None:
        if self.verdict is Verdict.NOT_RUN:
            raise ValueError(f"{self.fsr_id}: a run that was executed cannot be NOT_RUN")
        numbers = (self.robustness_low, self.robustness_high, self.margin)
        if self.verdict is not Verdict.ERROR and any(
            number is not None and math.isnan(number) for number in numbers
        ):
            raise ValueError(f"{self.fsr_id}: NaN is never {self.verdict}, it is ERROR")


def verdict_record(stored: Mapping[Any, Any]) -> VerdictRecord:
    """Read a verdict from a row of ``verdict``."""
    verdict, is_exercised = Verdict(stored["verdict"]), bool(stored["exercised"])
    return of_row(VerdictRecord, stored, verdict=verdict, is_exercised=is_exercised)


@dataclass(frozen=True)
class EventRecord:
    """Something that happened in a run: contact, handover, fault, storyboard event.

    Attributes:
        time_s: When [s].
        kind: What kind of event.
        subject: Whom it concerns: actor, channel, fault or sensor id.
        text: One line for people.
    """

    time_s: float
    kind: str
    subject: str | None
    text: str


@dataclass(frozen=True)
class ForkRecord:
    """A run that is the same as another before a tick, and has another authority from it on.

    Attributes:
        result_digest: The fork.
        test_case: Its test case.
        origin: Result digest of the run that it is a fork of.
        from_tick: First tick at which the decision is another one.
        authority: Channel that acts from there on.
    """

    result_digest: str
    test_case: str
    origin: str
    from_tick: int
    authority: str


# --- What leaves the database, as frozen dataclasses without SQL ----------------------------------


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


UNJUDGED: Final = "to be judged"
"""State of a campaign that lacks no result, only verdicts."""


@dataclass(frozen=True)
class WorkState:
    """How many blocks of a campaign are in which state.

    Attributes:
        pending: Neither done nor held by a runner.
        leased: Held by a runner.
        done: Whose test cases all have what was asked for.
        quarantined: Given up.
        to_judge: Those of ``pending`` that have a result for each test case and lack verdicts only.
    """

    pending: int
    leased: int
    done: int
    quarantined: int
    to_judge: int = 0

    @property
    def text(self) -> str:
        """``complete``, ``running``, ``interrupted``, ``to be judged`` or ``quarantined``."""
        if self.leased:
            return "running"
        if self.pending:
            return "interrupted" if self.pending > self.to_judge else UNJUDGED
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
        """``complete``, ``running``, ``interrupted``, ``to be judged`` or ``quarantined``."""
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
        rows: Number of rows by table, as the ledger counts those that it knows.
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
