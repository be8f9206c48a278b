"""What a report says, as one typed record: every page and file of it is written from this.

The record refuses to contradict itself: a green exit code beside a requirement that does not pass,
a PASS over a failed run, a number that belongs to nothing.
"""

from collections.abc import Hashable, Iterable, Iterator, Sequence
from functools import cached_property
from itertools import chain
from typing import Annotated, Self

from pydantic import Field

from adeye.analysis.dependence import Dependencies
from adeye.analysis.suite.records import Suite
from adeye.judge.verdict import (
    WAIVABLE,
    ExitCode,
    Outcome,
    Verdict,
    exercised_of,
    fold_fsrs,
    urgency,
)
from adeye.report.claims import Claims
from adeye.report.comparison.records import Comparison
from adeye.report.credibility import SelfTestResult
from adeye.report.model import concept as safety
from adeye.report.model.assessment import Assessment, FaultEvidence
from adeye.report.model.evidence import Impact, OddCoverage, StepUncertainty
from adeye.report.model.part import Binding, Command, Count, Id, Label, Margin, Part, Place, agrees
from adeye.report.page.replay import Replay, Undrawn
from adeye.report.where.records import FailureMaps
from adeye.spec.asil import RequirementAsil
from adeye.store.read.totals import ChannelFailure

SCHEMA = "adeye/report@1"


class Architecture(Part):
    """A candidate: sensors, channels, links, switch and vehicle."""

    id: Id
    title: str
    is_gate: bool
    """Whether it decides the exit code."""
    cost: float | None = None
    parts: tuple[Label, ...] = ()
    """What it is made of."""


class Scenario(Part):
    """A logical scenario of the ODD."""

    id: Id
    title: str
    text: str = ""
    tags: tuple[Label, ...] = ()
    exposure: str = ""
    where: Place | None = None
    """Its line in the ODD, where that still says what was run."""


class Factors(Part):
    """How the test cases of a scenario are counted."""

    scenario: Id
    points: Count
    fault_entries: tuple[str, ...]
    architectures: Count
    replicates: Count
    test_cases: Count
    """The product, unless an axis exists in some architectures only."""
    axes: tuple[Label, ...] = ()
    """Swept parameters and their values."""
    command: str = ""


class Fsr(Part):
    """A functional safety requirement in its measurable form."""

    id: Id
    text: str
    formula: str
    asil: RequirementAsil
    goals: tuple[str, ...]
    mandatory: bool = True
    allocation: tuple[str, ...] = ()
    threshold_source: str
    ftti_s: float | None = None
    """The shortest fault-tolerant time interval of its safety goals."""
    fdti_s: float | None = None
    frti_s: float | None = None
    min_exercised: Annotated[int, Field(ge=1)] = 1
    on_contact: str = "inconclusive"
    scenarios: tuple[str, ...] = ()
    """Scenarios that it is judged in; empty: all."""
    digest: str = ""
    """Of what its verdicts depend on."""
    assumptions: tuple[str, ...] = ()
    where: Place | None = None
    """Its line in the concept, where that still says what was judged."""


class Cell(Part):
    """One FSR for one architecture in one scenario, folded over the runs."""

    fsr: Id
    architecture: Id
    scenario: str | None = None
    """None for all scenarios together."""
    verdict: Verdict | None
    """None where the FSR is not applicable to the architecture."""
    counts: dict[Verdict, Count] = {}
    """Runs per verdict."""
    exercised: Count = 0
    runs: Count = 0
    min_exercised: Annotated[int, Field(ge=1)] = 1
    """Runs that must PASS here."""
    margin: Margin | None = None
    """Of the worst run."""
    binding: Binding | None = None
    worst_run: str | None = None
    command: str
    """Reproduces the worst run, or lists the runs."""
    note: str = ""
    is_set_aside: bool = False
    """Whether a FAIL does not block the gate; the note says why."""

    @property
    def in_gate(self) -> Verdict | None:
        """What the gate takes for the verdict."""
        return Verdict.PASS if self.is_set_aside else self.verdict

    @property
    def waived(self) -> tuple[Verdict, ...]:
        """Verdicts that a waiver lets the gate pass, which are no evidence."""
        found = sorted(verdict for verdict in WAIVABLE if self.counts.get(verdict))
        return tuple(found) if self.verdict is Verdict.PASS else ()

    def excuses(self, part: Self | None) -> bool:
        """Whether the cell of one scenario, not PASS, is neutral beside this one of all scenarios.

        It is where the FSR passes over all of them for the gate, and in the scenario was not
        exercised, is waived or is set aside: that is what a fold over runs means.
        """
        if part is None or self.in_gate is not Verdict.PASS:
            return False
        return part.is_set_aside or part.verdict in {Verdict.VACUOUS, *self.waived}

    @property
    def exercised_text(self) -> str:
        """Of how many runs, or of how many that are needed, it was exercised."""
        return exercised_of(self.verdict, self.exercised, self.runs, self.min_exercised)

    @agrees
    def _adds_up(self) -> Iterator[str]:
        where = f"{self.fsr}, {self.architecture}, {self.scenario or 'all scenarios'}"
        if sum(self.counts.values()) != self.runs or self.exercised > self.runs:
            yield f"{where}: {self.runs} runs, but counts {self.counts}, {self.exercised} exercised"
        if self.is_set_aside and self.verdict is not Verdict.FAIL:
            yield f"{where}: {self.verdict} is set aside"
        if self.verdict is not Verdict.FAIL and self.counts.get(Verdict.FAIL, 0) > 0:
            yield f"{where}: {self.verdict} over a failed run"
        if self.verdict is Verdict.PASS and self.counts.get(Verdict.PASS, 0) == 0:
            yield f"{where}: PASS without a run that passed"


class WorstCase(Part):
    """One run that an FSR holds in least, or not at all."""

    fsr: Id
    architecture: Id
    scenario: Id
    run: Id
    verdict: Verdict
    outcome: Outcome
    fault: str = "none"
    parameters: tuple[Label, ...] = ()
    margin: Margin | None = None
    binding: Binding | None = None
    command: str


class DeadAxis(Part):
    """A swept axis that moves no metric."""

    scenario: Id
    axis: str
    values: str
    command: str = ""


class Extreme(Part):
    """A value of a metric and the run that it comes from."""

    value: float
    run: Id
    command: str


class MetricSummary(Part):
    """A metric over the runs of one scenario and architecture."""

    metric: Id
    title: str
    unit: str
    scenario: Id
    architecture: Id
    runs: Count
    undefined: Count = 0
    """Runs without a value, such as no conflict."""
    minimum: Extreme | None = None
    median: Extreme | None = None
    """The run at the lower middle, so that it is one run."""
    maximum: Extreme | None = None


class MapNote(Part):
    """What was made of a map that scenarios take place on; it changes no digest of a test case."""

    name: Id
    given: Count
    """Rules beside the map that say what it leaves to a guess."""
    taken: Count
    """Elements that were taken."""
    approximated: Count
    repaired: Count
    guessed: Count
    """Among them lanes without a limit of speed."""
    ignored: Count


class Report(Part):
    """Everything that a report says about one campaign."""

    title: str
    odd: Id
    odd_digest: str
    tool_version: str
    numerics_version: str
    created: str | None = None
    """UTC, ``YYYY-MM-DDTHH:MM:SS``; None makes the same campaign give the same bytes."""
    campaign: Id
    database: str
    """Without a password."""
    concept: str = ""
    """Id of the concept: the item is what its hazards and requirements are about."""
    concept_title: str = ""
    concept_digest: str = ""
    evidence_digest: str = ""
    """Merkle root over plan, results and verdicts; equal for every execution of the plan."""
    exit_code: ExitCode
    message: str
    determinism: str
    """What is promised about running it again."""
    maps: tuple[MapNote, ...] = ()
    statements: tuple[str, ...] = ()
    """The conditions that the numbers hold under."""
    planned: Count
    accounted: Count
    outcomes: dict[Outcome, Count] = {}
    machine_dependent: Count = 0
    """Runs with a wall-clock deadline, a channel at an address or a pace: another machine may get
    other results."""
    contacts: dict[str, Count] = {}
    """Runs that a contact ended, by architecture."""
    channel_failures: tuple[ChannelFailure, ...] = ()
    """How channels failed, also where that is mastered; what is refused blocks the gate."""
    command: str
    """Reproduces the campaign."""
    commands: tuple[Command, ...] = ()
    where: Place | None = None
    """The ODD's file, also where it is not what was run any more."""
    architectures: tuple[Architecture, ...]
    scenarios: tuple[Scenario, ...]
    factors: tuple[Factors, ...] = ()
    fsrs: tuple[Fsr, ...]
    cells: tuple[Cell, ...]
    failing: FailureMaps | None = None
    """Where FSRs fail, by the axes that matter most; None if none fails."""
    comparison: Comparison | None = None
    """Of campaigns with several architectures."""
    worst_cases: tuple[WorstCase, ...] = ()
    """Worst first."""
    dead_axes: tuple[DeadAxis, ...] = ()
    metrics: tuple[MetricSummary, ...] = ()
    faults: FaultEvidence | None = None
    assessment: Assessment | None = None
    """What reference drivers avoid, timing, safe stops; None if it was not asked for."""
    impact: Impact | None = None
    """What changed since a baseline; None without one."""
    verification: tuple[safety.VerificationRow, ...] = ()
    """Every FSR for every architecture, from goal to evidence."""
    open_points: tuple[safety.OpenPoint, ...] = ()
    """What is not shown, and what it rests on; the gate's first."""
    realisations: tuple[safety.Realisation, ...] = ()
    confidence: Claims | None = None
    """Bounds of the probability of a violation, or why there is none."""
    confidence_command: str = ""
    """Says it again, with other levels and methods."""
    odd_coverage: OddCoverage | None = None
    step_uncertainty: StepUncertainty | None = None
    odd_attributes: tuple[Label, ...] = ()
    """Bounds of the ODD, as it states them."""
    hazards: tuple[safety.Hazard, ...] = ()
    goals: tuple[safety.SafetyGoal, ...] = ()
    elements: tuple[safety.Element, ...] = ()
    assumptions: tuple[safety.Assumption, ...] = ()
    waivers: tuple[safety.Waiver, ...] = ()
    decompositions: tuple[safety.Decomposition, ...] = ()
    dependent_failures: tuple[safety.DependentFailure, ...] = ()
    integrity_rules: Count = 0
    """How many integrity rules were asked; 0 for none."""
    findings: tuple[safety.IntegrityFinding, ...] = ()
    """What breaks them."""
    dependencies: tuple[Dependencies, ...] = ()
    """What the channels of each architecture share, read from the files."""
    suites: tuple[Suite, ...] = ()
    """What the sensors of each architecture see, without a simulation."""
    self_test: SelfTestResult | None = None
    """Which known-bad masters the version of the campaign detects; None if it was not tried."""
    replays: tuple[Replay, ...] = ()
    """The most important first; a page that grows too large leaves out the last."""
    undrawn: tuple[Undrawn, ...] = ()
    """Runs that are not drawn because they do not come out as they are stored."""

    def __repr__(self) -> str:
        """Name the campaign, and what came out."""
        counted = f"{self.accounted:,} of {self.planned:,} test cases"
        return f"<Report {self.campaign[:10]}: {counted}, {self.exit_code.name}>"

    def __bool__(self) -> bool:
        """Be as true as the gate."""
        return self.answer[0] is ExitCode.OK

    @agrees
    def _refers_to_what_it_has(self) -> Iterator[str]:
        fsrs = _unique("fsrs", (fsr.id for fsr in self.fsrs))
        architectures = _unique("architectures", (item.id for item in self.architectures))
        scenarios = _unique("scenarios", (item.id for item in self.scenarios))
        _unique("cells", ((cell.fsr, cell.architecture, cell.scenario) for cell in self.cells))
        suites = _unique("suites", (suite.architecture for suite in self.suites))
        _unique("replays", (replay.run for replay in self.replays))
        failing = [item.architecture for item in self.channel_failures]
        yield from _known("an architecture", [*suites, *failing, *self.contacts], architectures)
        claims = () if self.confidence is None else self.confidence.claims
        lines = () if self.step_uncertainty is None else self.step_uncertainty.lines
        maps = () if self.failing is None else self.failing.maps
        parts = (self.cells, self.worst_cases, self.dead_axes, self.metrics, self.replays, maps)
        for field, what, known in (
            ("fsr", "an FSR", fsrs),
            ("architecture", "an architecture", architectures),
            ("scenario", "a scenario", scenarios),
        ):
            # Whatever is about all scenarios names none.
            named = (getattr(item, field, None) for item in chain(*parts, claims, lines))
            yield from _known(what, filter(None, named), known)

    @agrees
    def _is_green_only_if_all_is(self) -> Iterator[str]:
        if self.exit_code is not ExitCode.OK:
            return
        if not 0 < self.planned == self.accounted:
            yield f"exit code 0, but {self.accounted} of {self.planned} test cases accounted for"
        gate = {item.id: self.verdict_of(item.id) for item in self.architectures if item.is_gate}
        refused = [str(item) for item in self.channel_failures if item.refused]
        if refused:
            yield f"exit code 0, but {'; '.join(refused)}"
        if not gate or any(verdict is not Verdict.PASS for verdict in gate.values()):
            yield f"exit code 0, but the gate is {gate}"

    @property
    def answer(self) -> tuple[ExitCode, str]:
        """Exit code and message of the gate, with the baseline that the report compares with."""
        if self.impact is not None and self.impact.exit_code is not ExitCode.OK:
            return self.impact.exit_code, self.impact.message
        return self.exit_code, self.message

    def cell(self, fsr: str, architecture: str, scenario: str | None = None) -> Cell | None:
        """Find one cell; None if nothing was recorded there."""
        if self._index[0] is not self.cells:
            # A copy with other cells begins with what was computed for the old ones.
            del self.__dict__["_index"]
        return self._index[1].get((fsr, architecture, scenario))

    @cached_property
    def _index(self) -> tuple[tuple[Cell, ...], dict[tuple[str, str, str | None], Cell]]:
        index = {(cell.fsr, cell.architecture, cell.scenario): cell for cell in self.cells}
        return self.cells, index

    @property
    def touching(self) -> dict[str, int]:
        """Count the runs that a contact ended, by architecture of the gate that has any."""
        names = [item.id for item in self.architectures if item.is_gate]
        return {name: self.contacts[name] for name in names if self.contacts.get(name)}

    @property
    def gate_first(self) -> list[Architecture]:
        """Architectures as they are listed: those of the gate, then the others."""
        return sorted(self.architectures, key=lambda item: not item.is_gate)

    def urgent_first(self, *groups: Iterable[Architecture]) -> list[Fsr]:
        """List the FSRs by ``judge.verdict.urgency``, in a group by the worst of its architectures.

        Args:
            groups: Where FSRs are as urgent by one group, the next one decides.
        """

        def worst(fsr: Fsr, group: Sequence[Architecture]) -> tuple[bool, int]:
            cells = [self.cell(fsr.id, item.id) for item in group]
            states = [Verdict.NOT_RUN if cell is None else cell.verdict for cell in cells]
            # Of no architecture nothing is worse than of another.
            return min(urgency(state, mandatory=fsr.mandatory) for state in states or [None])

        known = [list(group) for group in groups]
        return sorted(self.fsrs, key=lambda fsr: [worst(fsr, group) for group in known])

    def verdict_of(self, architecture: str) -> Verdict:
        """Fold the mandatory FSRs of an architecture, a FAIL that is set aside as PASS.

        An FSR without a cell is NOT_RUN; one that is not applicable is an ERROR for an architecture
        in the gate and NOT_RUN for the others: it never counts as PASS.
        """
        in_gate = any(item.is_gate for item in self.architectures if item.id == architecture)
        verdicts: list[Verdict] = []
        for fsr in self.fsrs:
            if not fsr.mandatory:
                continue
            cell = self.cell(fsr.id, architecture)
            if cell is None:
                verdicts.append(Verdict.NOT_RUN)
            elif cell.in_gate is None:
                verdicts.append(Verdict.ERROR if in_gate else Verdict.NOT_RUN)
            else:
                verdicts.append(cell.in_gate)
        return fold_fsrs(verdicts)


def _unique(what: str, keys: Iterable[Hashable]) -> set[Hashable]:
    seen: set[Hashable] = set()
    for key in keys:
        if key in seen:
            msg = f"{what}: {key!r} is there twice"
            raise ValueError(msg)
        seen.add(key)
    return seen


def _known(what: str, keys: Iterable[Hashable], known: set[Hashable]) -> Iterator[str]:
    for key in keys:
        if key not in known:
            yield f"{key!r} is not {what} of the report"
