"""The records of a report about faults, takeovers and trips."""

from typing import Self

from pydantic import model_validator

from adeye.evaluation.takeovers import TakeoverClass, precision_of, recall_of
from adeye.evaluation.timeline import InjectionClass
from adeye.report.parts import Command, Count, Id, Part


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
    """Runs with a fault entry."""
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


class FaultGroup(Part):
    """What became of one fault entry in one scenario and architecture."""

    scenario: Id
    fault_entry: Id
    architecture: Id
    counts: dict[InjectionClass, Count]
    detected: Count
    activated: Count
    low: float | None = None
    """Interval of the share that is detected (Wilson, 95 %), only for a random sample."""
    high: float | None = None
    least_ftti_s: float | None = None
    most_fhti_s: float | None = None
    worst: WorstInjection

    @model_validator(mode="after")
    def _adds_up(self) -> Self:
        inactive = self.counts.get("not_activated", 0)
        if sum(self.counts.values()) - inactive != self.activated or self.detected > self.activated:
            msg = f"{self.fault_entry}: {self.detected} of {self.activated} do not fit the classes"
            raise ValueError(msg)
        return self


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
        """See ``evaluation.takeovers.precision_of``."""
        return precision_of(self.counts)

    @property
    def recall(self) -> tuple[int, int]:
        """See ``evaluation.takeovers.recall_of``."""
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

    @model_validator(mode="after")
    def _is_measured(self) -> Self:
        told = sum(sum(group.counts.values()) for group in self.groups)
        if told != self.measured or self.measured > self.with_fault:
            msg = (
                f"{told} of {self.with_fault} runs with a fault are told, {self.measured} measured"
            )
            raise ValueError(msg)
        if (self.takeovers.runs if self.takeovers else 0) != self.forked:
            msg = f"{self.forked} runs are forked, and the classes count others"
            raise ValueError(msg)
        return self
