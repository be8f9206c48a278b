"""The records of how far evidence reaches: what it covers of the ODD, what its step is worth."""

from collections.abc import Iterator
from typing import Literal

from adeye.judge.verdict import ExitCode
from adeye.report.gate.baseline import Kind
from adeye.report.model.part import Count, Id, Part, agrees

# --- The records of how far evidence reaches: what it covers of the ODD, what its step is worth ---


class BinCoverage(Part):
    """One bin of an attribute of the ODD."""

    label: str
    state: Literal["covered", "uncovered", "impossible"]
    """Impossible: no scenario of the ODD can have it, so that it is no gap of the plan."""
    test_cases: Count
    """Counted ones that have it."""


class AttributeCoverage(Part):
    """What is covered of one attribute of the ODD."""

    attribute: Id
    bins: tuple[BinCoverage, ...]

    @property
    def covered(self) -> int:
        """Bins that a test case has."""
        return sum(item.state == "covered" for item in self.bins)

    @property
    def feasible(self) -> int:
        """Bins that some scenario can have."""
        return sum(item.state != "impossible" for item in self.bins)


class UncoveredPair(Part):
    """Bins of two attributes that some scenario can have together, and no test case has."""

    attributes: tuple[str, str]
    bins: tuple[str, str]


class Exclusion(Part):
    """What the plan leaves out of a scenario."""

    scenario: Id
    relations: tuple[str, ...]
    """Those of the sweep, as written."""


class OddCoverage(Part):
    """What the executed test cases of a campaign cover of its ODD."""

    planned: Count
    counted: Count
    """Executed inside the ODD, and the scenario came about."""
    without_result: Count = 0
    not_judged: Count = 0
    """In which the scenario did not come about, or that could not be executed."""
    outside_odd: Count = 0
    in_no_bin: Count = 0
    """Counted ones with an attribute in no bin, which count for the others only."""
    attributes: tuple[AttributeCoverage, ...] = ()
    pairs: Count = 0
    feasible_pairs: Count = 0
    """Pairs of bins that some scenario can have."""
    covered_pairs: Count = 0
    uncovered_pairs: tuple[UncoveredPair, ...] = ()
    """The first of them; the command lists all."""
    exclusions: tuple[Exclusion, ...] = ()
    refusal: str = ""
    """Why nothing was counted; empty where it was."""
    command: str

    @agrees
    def _adds_up(self) -> Iterator[str]:
        if self.refusal:
            return
        parts = self.counted + self.without_result + self.not_judged + self.outside_odd
        if parts != self.planned:
            yield f"coverage: {self.planned} test cases, but {parts} are told of"
        missing = self.feasible_pairs - self.covered_pairs
        if not len(self.uncovered_pairs) <= missing <= self.pairs:
            yield f"coverage: {len(self.uncovered_pairs)} uncovered pairs are listed of {missing}"


class StepLine(Part):
    """What halving the step changes in one number of a scenario and architecture."""

    kind: Literal["fsr", "metric"]
    """Margin of an FSR, or value of a metric."""
    scenario: Id
    architecture: Id
    name: Id
    unit: str
    sampled: Count
    """Situations that were executed with the whole and with half the step."""
    pairs: Count
    """Those with a value in both."""
    uncertainty: float | None
    """95th percentile of the differences; None of too few pairs, which is not zero."""
    largest: float | None
    differing: Count
    """Situations with another verdict, or another status of the metric."""
    changes: dict[str, Count]

    @property
    def is_told(self) -> bool:
        """Whether a pair has a value, or anything differs."""
        return self.pairs > 0 or self.differing > 0


class StepUncertainty(Part):
    """The numeric uncertainty of a campaign, by halving its step."""

    step_s: float
    situations: Count | None
    """Asked for by the ODD, for each scenario and architecture; None: it asks for none."""
    lines: tuple[StepLine, ...] = ()
    """Empty, though asked for: not all twins are executed yet."""
    command: str


# --- The records of a report about what changed since a baseline, and what became stale -----------


class Change(Part):
    """One difference from the baseline."""

    kind: Kind
    decides: bool
    """Whether a gate with this baseline hangs on it."""
    fsr: str = ""
    architecture: str = ""
    scenario: str = ""
    text: str
    runs: tuple[str, ...] = ()
    """Result digests of runs to look at, the worst first."""
    command: str = ""


class StaleEvidence(Part):
    """Evidence that no longer counts under the files as they are, for one reason."""

    cause: Id
    subject: str
    text: str
    evidence: Count
    """Runs with a verdict of an FSR."""
    runs: Count
    fsrs: tuple[str, ...]
    architectures: tuple[str, ...]


class StaleFiles(Part):
    """The evidence of a campaign under the files as they were when the report was written."""

    odd: Id
    """Path of the ODD."""
    evidence: Count
    counts: Count
    """Of these, the ones that still count."""
    causes: tuple[StaleEvidence, ...] = ()
    to_judge: Count
    """Results that judging again completes."""
    to_replay: Count
    to_execute: Count

    @agrees
    def _adds_up(self) -> Iterator[str]:
        stale = sum(item.evidence for item in self.causes)
        if self.counts + stale != self.evidence:
            yield f"{self.counts} of {self.evidence} count, and {stale} are stale"


class Impact(Part):
    """What changed since a baseline."""

    baseline: Id
    """Path of its file."""
    campaign: Id
    """That the baseline was written from."""
    exit_code: ExitCode
    """Of a gate with this baseline."""
    message: str
    changes: tuple[Change, ...] = ()
    """What decides first."""
    stale: StaleFiles | None = None
    not_asked: str = ""
    """Why nothing is said of stale evidence; empty if it is."""
    command: str

    @agrees
    def _says_what_it_can(self) -> Iterator[str]:
        if (self.stale is None) != bool(self.not_asked):
            yield "either stale evidence is told, or why it is not"

    @property
    def deciding(self) -> int:
        """Differences that a gate hangs on."""
        return sum(item.decides for item in self.changes)
