"""The records of a report about what reference drivers avoid, timing budgets and safe stops."""

from collections.abc import Iterator

from adeye.judge.preventability import CELLS, Cell, TakeoverClass, precision_of, recall_of
from adeye.judge.timeline import InjectionClass
from adeye.judge.verdict import Verdict
from adeye.report.model.part import Command, Count, Id, Part, agrees

# --- The records of a report about what reference drivers avoid, timing budgets and safe stops ----


class CellTally(Part):
    """Who avoids a contact: an architecture beside one reference driver in one scenario."""

    scenario: Id
    architecture: Id
    model: Id
    edition: Id
    counts: dict[Cell, Count]
    """Runs by cell."""

    @property
    def runs(self) -> int:
        """Runs that were compared."""
        return sum(self.counts.values())


class AvoidableRun(Part):
    """A contact that only the reference driver avoids: a finding."""

    run: Id
    drive: Id
    """Result digest of the reference driver's drive."""
    scenario: Id
    architecture: Id
    fault_entry: Id
    model: Id
    edition: Id
    impact_speed_mps: float | None = None
    command: str
    drive_command: str


class Preventability(Part):
    """Runs beside the drives of reference drivers in the same situations."""

    executed: Count
    compared: Count
    """Runs that at least one reference driver's drive is held against."""
    open_contacts: Count
    """Runs with a contact, or of which it is not known, that no drive is held against."""
    tallies: tuple[CellTally, ...] = ()
    findings: Count = 0
    """Pairs of a run and a model in which only the model avoids a contact."""
    listed: tuple[AvoidableRun, ...] = ()
    """The first of them, the hardest contact first."""
    command: str
    """Evaluates the conflicts of the campaign."""

    @agrees
    def _adds_up(self) -> Iterator[str]:
        only_model = sum(item.counts.get("only_model", 0) for item in self.tallies)
        if only_model != self.findings or len(self.listed) > self.findings:
            yield f"{only_model} runs are avoided by the model only, {self.findings} are findings"
        if bool(self.tallies) != bool(self.compared):
            yield f"{self.compared} runs are compared, in {len(self.tallies)} tallies"
        if any(set(item.counts) != set(CELLS) for item in self.tallies):
            yield "a tally does not count every cell"


class GoalTiming(Part):
    """The FTTI that a safety goal assumes, and the budgets of its FSRs."""

    goal: Id
    ftti_s: float
    rationale: str = ""
    fsrs: tuple[str, ...] = ()
    """FSRs with a budget."""
    fdti_s: float | None = None
    """Largest budget of detection."""
    frti_s: float | None = None
    fhti_s: float | None = None
    """Largest budget of handling; None where one of its two parts is not stated."""
    margin_s: float | None = None
    """FTTI less what is budgeted."""
    verdict: Verdict
    note: str = ""


class BudgetTiming(Part):
    """A budget of an FSR beside what was measured where a fault exercised the FSR."""

    fsr: Id
    scenario: str = ""
    """Empty where no measured run with a fault exercised the FSR."""
    fault_entry: str = ""
    architecture: str = ""
    runs: Count = 0
    """Measured runs that exercised the FSR."""
    fdti_budget_s: float | None = None
    frti_budget_s: float | None = None
    fdti_s: float | None = None
    """Largest that was measured."""
    frti_s: float | None = None
    margin_s: float | None = None
    """The least by which a budget is kept; negative where one is exceeded."""
    verdict: Verdict
    note: str = ""
    run: str | None = None
    command: str = ""


class _Entry(Part):
    """One fault entry in one scenario and architecture."""

    scenario: Id
    fault_entry: Id
    architecture: Id


class FaultTiming(_Entry):
    """FHTI beside FTTI of one fault entry in one scenario and architecture."""

    runs: Count
    """Executed with this fault entry."""
    measured: Count
    handled: Count = 0
    """Detected, and handled before the run ended."""
    fdti_s: float | None = None
    """Largest that was measured, so also below."""
    frti_s: float | None = None
    fhti_s: float | None = None
    ftti_s: float | None = None
    """Least that was measured, of runs whose twin without the fault violates nothing."""
    margin_s: float | None = None
    """Least FTTI, measured or assumed, less FHTI, of one run."""
    verdict: Verdict
    note: str = ""
    run: str | None = None
    command: str = ""

    @agrees
    def _is_measured_where_it_passes(self) -> Iterator[str]:
        if self.verdict is Verdict.PASS and not 0 < self.handled <= self.measured == self.runs:
            yield f"{self.fault_entry}: PASS, but {self.measured} of {self.runs} runs are measured"


class Timing(Part):
    """Fault-tolerant against fault-handling times."""

    assumed_s: float | None = None
    """Shortest FTTI of the safety goals."""
    goals: tuple[GoalTiming, ...] = ()
    budgets: tuple[BudgetTiming, ...] = ()
    faults: tuple[FaultTiming, ...] = ()
    command: str
    """Measures what is not."""


class StopPlace(Part):
    """Runs that stand in one kind of place."""

    rating: Count
    place: Id
    """On the scale of places to stand in."""
    runs: Count


class SafeStop(_Entry):
    """Safe stops of one architecture in one scenario with one fault entry."""

    runs: Count
    asked: Count
    """Runs in which another channel than the default took over."""
    unknown: Count = 0
    """Runs of which it is not known."""
    reached: Count = 0
    """Of those asked: stands at the end, and touched nothing."""
    contact: Count = 0
    moving: Count = 0
    """Of those asked: does not stand at the end."""
    slowest_s: float | None = None
    """Longest time from emergency operation to the safe state."""
    from_fault_s: float | None = None
    """Longest time from the fault to the safe state."""
    deceleration_mps2: float | None = None
    """Largest of the runs in which it was asked, also before it was."""
    places: tuple[StopPlace, ...] = ()
    """Where they stand, the worst first."""
    regret: float | None = None
    """Largest difference to the best place that was reachable at the fault, in steps."""
    run: str | None = None
    command: str = ""

    @agrees
    def _adds_up(self) -> Iterator[str]:
        if self.reached + self.contact + self.moving != self.asked:
            yield f"{self.scenario}, {self.fault_entry}: {self.asked} safe stops do not add up"
        if sum(place.runs for place in self.places) != self.reached + self.contact:
            yield f"{self.scenario}, {self.fault_entry}: not every stop has a place"

    @property
    def verdict(self) -> Verdict:
        """What the ends of these runs say."""
        if self.contact:
            return Verdict.FAIL
        if self.moving or self.unknown:
            return Verdict.INCONCLUSIVE
        return Verdict.PASS if self.reached else Verdict.VACUOUS


class SafeStops(Part):
    """Safe stops of a campaign."""

    runs: Count
    asked: Count
    unknown: Count
    rows: tuple[SafeStop, ...] = ()
    """Where a safe stop was asked for, or is not known to have been; the worst first."""

    @agrees
    def _adds_up(self) -> Iterator[str]:
        told = (sum(r.asked for r in self.rows), sum(r.unknown for r in self.rows))
        if told != (self.asked, self.unknown):
            yield f"{self.asked} safe stops are asked, {self.unknown} unknown; the rows say {told}"


class Assessment(Part):
    """What a report tells beyond verdicts: preventability, timing and safe stops."""

    preventability: Preventability
    timing: Timing
    safe_stops: SafeStops


# --- The records of a report about faults, takeovers and trips ------------------------------------


class Rate(Part):
    """Trips of runs without a fault."""

    runs: Count
    hours: float
    """Simulated driving."""
    trips: Count
    per_hour: float | None
    """None without driving."""
    low: float | None = None
    """Exact Poisson interval of 95 %, only where all points are a random sample."""
    high: float | None = None


class TradePoint(Part):
    """One value of the axis."""

    value: str
    calm: Rate
    faulty: Count
    """Runs with a fault that began before they ended."""
    detected: Count
    median_fdti_s: float | None = None
    """Lower middle of those that were detected."""
    worst_fdti_s: float | None = None


class TradeCurve(Part):
    """One architecture over the values of one axis."""

    axis: Id
    architecture: Id
    scenarios: tuple[str, ...]
    points: tuple[TradePoint, ...]

    @property
    def title(self) -> str:
        """The axis without what all such axes begin with."""
        return self.axis.removeprefix("architecture.channels.").replace(".parameters.", ".")


class WorstInjection(Part):
    """The worst run of a group: by class, then by least margin, then by largest FHTI."""

    run: Id
    class_: InjectionClass
    fdti_s: float | None = None
    frti_s: float | None = None
    fhti_s: float | None = None
    ftti_s: float | None = None
    """None where nothing is violated without the mechanism."""
    margin_s: float | None = None
    command: str


class FaultGroup(_Entry):
    """What became of one fault entry in one scenario and architecture."""

    counts: dict[InjectionClass, Count]
    detected: Count
    activated: Count
    low: float | None = None
    """Interval of the share that is detected (Wilson, 95 %), only for a random sample."""
    high: float | None = None
    least_ftti_s: float | None = None
    most_fhti_s: float | None = None
    worst: WorstInjection

    @agrees
    def _adds_up(self) -> Iterator[str]:
        inactive = self.counts.get("not_activated", 0)
        if sum(self.counts.values()) - inactive != self.activated or self.detected > self.activated:
            yield f"{self.fault_entry}: {self.detected} of {self.activated} do not fit the classes"


class TakeoverRun(Part):
    """A takeover that came late or was not needed, or one that is missing."""

    run: Id
    fork: Id
    class_: TakeoverClass
    scenario: Id
    architecture: Id
    fault_entry: Id
    takeover_s: float | None = None
    command: str


class Takeovers(Part):
    """Decisions in hindsight: what would have happened with the other one."""

    counts: dict[TakeoverClass, Count]
    avoidable: Count
    """Missed ones that would not violate with a takeover."""
    harmful: Count
    """Ones that were not needed and violate."""
    listed: tuple[TakeoverRun, ...] = ()

    @property
    def runs(self) -> int:
        """Runs that were forked."""
        return sum(self.counts.values())

    @property
    def precision(self) -> tuple[int, int]:
        """See ``judge.preventability.precision_of``."""
        return precision_of(self.counts)

    @property
    def recall(self) -> tuple[int, int]:
        """See ``judge.preventability.recall_of``."""
        return recall_of(self.counts, self.avoidable)


class Calm(Part):
    """The runs of an architecture without a fault."""

    architecture: Id
    rate: Rate
    takeovers: Count
    availability: float | None
    """Share of their time at which the default channel acts; None where it was not measured."""
    not_measured: Count = 0
    """Runs of an older release, which counted no trips."""
    forked: Count = 0
    """Takeovers whose fork tells whether they were needed."""
    not_needed: Count = 0


class FaultEvidence(Part):
    """Faults, takeovers and trips of a campaign."""

    with_fault: Count
    """Executed runs with a fault entry."""
    measured: Count
    """Those whose twins were executed."""
    executed: Count
    forked: Count
    """Runs whose other decision was executed."""
    commands: tuple[Command, ...]
    """They measure faults and takeovers."""
    groups: tuple[FaultGroup, ...] = ()
    takeovers: Takeovers | None = None
    calm: tuple[Calm, ...] = ()
    curves: tuple[TradeCurve, ...] = ()

    @agrees
    def _is_measured(self) -> Iterator[str]:
        told = sum(sum(group.counts.values()) for group in self.groups)
        if told != self.measured or self.measured > self.with_fault:
            count = self.with_fault
            yield f"{told} of {count} runs with a fault are told, {self.measured} measured"
        if (self.takeovers.runs if self.takeovers else 0) != self.forked:
            yield f"{self.forked} runs are forked, and the classes count others"
