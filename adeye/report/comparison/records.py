"""What a comparison of architectures says, as one typed record: tables, JSON and page show it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Annotated, Final, Literal

from pydantic import Field

from adeye.errors import UsageError, require_known, suggest
from adeye.judge.verdict import Verdict
from adeye.report.model.part import Count, Id, Part, agrees
from adeye.units import shown

# --- What a comparison of architectures says, as one typed record: tables, JSON and page show it --

ClusterKind = Literal["all", "scenario", "category"]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Range(Part):
    """A confidence interval."""

    low: float
    high: float


class Inference(Part):
    """What a random design allows to say about the distribution that it was drawn from."""

    units: Count
    """Drawn points; they are the sample."""
    only_a_fails: Count
    """Points in which a run of A failed, and none of B."""
    only_b_fails: Count
    undecided: Count
    """Points with an undecided run or without one of its runs, and no failed one, of either."""
    difference: float
    """Share of failing points, B minus A; an undecided one counts as no difference."""
    interval: Range
    """It holds whatever the undecided points are."""
    p: Share
    """Exact McNemar test, two-sided, as if the undecided points spoke against a difference."""
    p_adjusted: Share
    """The same adjusted (Holm) over all FSRs and pairs of this cluster."""


class MarginDifference(Part):
    """How the margin changes from A to B where both PASS or FAIL."""

    unit: str
    """Of the margin; "1" where it is normalised by the scale of its signal."""
    is_normalised: bool
    pairs: Annotated[int, Field(ge=1)]
    mean: float
    median: float
    """Of an even number the lower middle."""
    interval: Range | None = None
    """Of the mean; only for a random design, and where no pair is undecided or incomplete."""
    least: float
    """Of all pairs; below zero it is the largest loss of B against A."""
    greatest: float
    least_run_a: Id
    """Result digest of the pair with the least change."""
    least_run_b: Id

    @property
    def loss(self) -> float | None:
        """The largest loss of B against A; None where B loses in no pair."""
        return self.least if self.least < 0.0 else None


class Difference(Part):
    """One FSR for two architectures on the same test cases of a cluster."""

    fsr: Id
    a: Id
    b: Id
    kind: ClusterKind
    cluster: str
    """Scenario or category; empty for all."""
    pairs: Count
    """Pairs that were both executed and are judged."""
    both_pass: Count
    only_a_fails: Count
    only_b_fails: Count
    both_fail: Count
    neutral: Count
    """No FAIL, at least one VACUOUS."""
    undecided: Count
    """At least one INCONCLUSIVE, INVALID or ERROR."""
    verdicts: dict[str, Count]
    """Every combination that occurs, as ``PASS/FAIL`` for A and B."""
    difference: float | None
    """Share of failing test cases among the decided, B minus A; None without any."""
    inference: Inference | None = None
    margin: MarginDifference | None = None

    @agrees
    def _adds_up(self) -> Iterator[str]:
        parts = (
            self.both_pass, self.only_a_fails, self.only_b_fails, self.both_fail, self.neutral,
            self.undecided,
        )  # fmt: skip
        if sum(parts) != self.pairs or sum(self.verdicts.values()) != self.pairs:
            yield f"{self.fsr}, {self.a} and {self.b}: {parts} are not {self.pairs} pairs"

    @property
    def is_different(self) -> bool:
        """Whether anything differs between the two."""
        moved = self.margin is not None and (self.margin.least, self.margin.greatest) != (0, 0)
        return self.only_a_fails + self.only_b_fails > 0 or moved


class Pair(Part):
    """Two architectures and the test cases that they share."""

    a: Id
    b: Id
    pairs: Count
    """Pairs that were both executed; every count is over them."""
    incomplete: Count
    """Planned pairs beside them, of which at least one was not executed."""
    only_a: Count
    """Test cases of A without a partner, such as a fault in a part that B lacks."""
    only_b: Count
    not_comparable: tuple[str, ...] = ()
    """FSRs that are not applicable to one of them."""


class Cost(Part):
    """What an architecture costs, in the unit of its file."""

    total: float
    declared: float
    """The architecture's own ``cost``; 0: not declared."""
    parts: dict[str, float]
    """Cost of sensors and channels, those that have one."""


class Unmet(Part):
    """A mandatory FSR that is not green for an architecture over all its planned runs."""

    fsr: Id
    verdict: Verdict | None
    """None where it is not applicable."""
    failing: dict[str, Count] = Field(default_factory=dict)
    """Compared test cases that fail it, by scenario; those without a failure are left out."""

    @property
    def text(self) -> str:
        """FSR, verdict and where it fails, for tables."""
        word = self.verdict.value if self.verdict else "not applicable"
        where = ", ".join(f"{name} {count}" for name, count in self.failing.items())
        return f"{self.fsr} {word}" + (f" ({where})" if where else "")


class Unexecuted(Part):
    """Planned test cases of an architecture in one scenario that have no result."""

    scenario: Id
    planned: Annotated[int, Field(ge=1)]
    missing: Annotated[int, Field(ge=1)]

    @property
    def text(self) -> str:
        """Scenario and count, for tables."""
        return f"{self.scenario} {self.missing:,} of {self.planned:,}"


class Candidate(Part):
    """One architecture of the comparison."""

    id: Id
    title: str
    is_gate: bool
    cost: Cost | None
    """None if nothing is declared."""
    sensors: dict[str, Count] = Field(default_factory=dict)
    """How many of each kind measure and feed a channel."""
    mandatory: Count
    unmet: tuple[Unmet, ...]
    """Mandatory FSRs that do not PASS over all planned runs of it."""
    refused: tuple[str, ...] = ()
    """Failures of its channels that block a gate which has it."""
    cases: Count
    """Test cases that all compared architectures share and that were executed for all of them."""
    left_out: Count = 0
    """Those that they share and that were not executed for all of them; counted nowhere."""
    unexecuted: tuple[Unexecuted, ...] = ()
    """Its own planned test cases without a result, shared or not."""
    failing: Count
    """Those in which a mandatory FSR fails that is applicable to all."""
    undecided: Count
    """Those in which none fails and one is undecided."""
    worst_margin: float | None
    """Least robustness of these FSRs in these test cases."""
    worst_fsr: str = ""
    worst_run: str = ""
    availability: Share | None
    """Share of fault-free test cases without a takeover; None without such a one."""
    fault_free: Count
    """Fault-free ones among ``cases``."""
    values: dict[str, float]
    """By objective."""
    is_on_front: bool
    dominated_by: str | None = None

    @property
    def is_good(self) -> bool:
        """Whether a gate that has it lets it pass."""
        return self.mandatory > 0 and not self.unmet and not self.refused

    @property
    def is_open(self) -> bool:
        """Whether it may yet meet every mandatory FSR: none fails, and not all was executed."""
        failed = {Verdict.FAIL, None}
        return bool(self.unmet and self.unexecuted) and all(
            item.verdict not in failed for item in self.unmet
        )

    @property
    def suite(self) -> str:
        """How many sensors of which kind, for tables."""
        return " + ".join(
            f"{count} {kind}{'s' if count > 1 and kind != 'ultrasonic' else ''}"
            for kind, count in self.sensors.items()
        )


class Objective(Part):
    """A way to measure candidates."""

    name: Id
    better: Literal["lower", "higher"]
    epsilon: Annotated[float, Field(ge=0.0)] = 0.0


class Contribution(Part):
    """What a sensor adds: an architecture of the campaign equals another without it."""

    sensor: Id
    with_it: Id
    without_it: Id
    cost: float
    """Of the sensor alone."""
    pairs: Count
    """Test cases that were executed for both."""
    rescued: Count
    """Test cases in which a mandatory FSR fails without it and none fails or is open with it."""
    harmed: Count
    """The other way round."""


class Sighting(Part):
    """How often a sensor is the first to detect the object that matters."""

    architecture: Id
    sensor: Id
    runs: Count
    """Compared test cases with such an object."""
    first: Count
    """Alone."""
    shared: Count
    """At the same tick as another."""
    only: Count
    """No other sensor ever does; also counted as first."""
    never: Count
    lead_s: float | None
    """Median lead over the next sensor where it is first and another follows."""


class Comparison(Part):
    """Architectures of one campaign on the same test cases."""

    campaign: Id
    odd: Id
    title: str
    baseline: str | None
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)]
    designs: dict[str, str]
    """By scenario."""
    statements: tuple[str, ...]
    """What may be concluded and what may not."""
    objectives: tuple[Objective, ...]
    left_out: tuple[str, ...]
    """Objectives that could not be used, and why."""
    candidates: tuple[Candidate, ...]
    fsrs: tuple[str, ...]
    """Mandatory FSRs that are applicable to all."""
    pairs: tuple[Pair, ...]
    differences: tuple[Difference, ...]
    contributions: tuple[Contribution, ...]
    sightings: tuple[Sighting, ...]
    cheapest: tuple[str, ...]
    """The cheapest of those for which every mandatory FSR passes; several at one price."""

    def __repr__(self) -> str:
        """Name the campaign and the architectures."""
        names = ", ".join(item.id for item in self.candidates)
        return f"<Comparison {self.campaign[:10]}: {names}>"

    @agrees
    def _holds_together(self) -> Iterator[str]:
        known = {item.id for item in self.candidates}
        named = {name for item in self.pairs for name in (item.a, item.b)}
        if not named <= known or not set(self.cheapest) <= known:
            yield f"{sorted(named | set(self.cheapest))} are not all among {sorted(known)}"
        for item in self.candidates:
            if item.id in self.cheapest and not item.is_good:
                why = [*item.unmet, *item.refused]
                yield f"{item.id} is named as meeting everything, and does not: {why}"
            if item.failing + item.undecided > item.cases or item.fault_free > item.cases:
                yield f"{item.id} has more failing, undecided or fault-free cases than {item.cases}"
            if item.is_on_front and item.dominated_by is not None:
                yield f"{item.id} is on the front and dominated by {item.dominated_by}"

    @property
    def is_complete(self) -> bool:
        """Whether every planned test case of every architecture was executed."""
        return not any(item.unexecuted for item in self.candidates)

    @property
    def by_cost(self) -> list[Candidate]:
        """The candidates, the cheapest first; at the end those whose cost is not known."""
        return sorted(
            self.candidates, key=lambda item: math.inf if item.cost is None else item.cost.total
        )

    def candidate(self, name: str) -> Candidate:
        """Find an architecture."""
        return next(item for item in self.candidates if item.id == name)


# --- What a comparison is asked: which architectures, measured by what; refused where it is wrong -

CONFIDENCE: Final = 0.95
DEFAULT_OBJECTIVES: Final = ("failures", "availability", "cost")
OBJECTIVES: Final = {
    "failures": "lower",
    "margin": "higher",
    "availability": "higher",
    "cost": "lower",
}
"""What candidates can be measured by, and which way is better.

``failures``: shared test cases in which a mandatory FSR fails or is undecided. ``margin``: least
robustness of those FSRs. ``availability``: share of fault-free runs without a takeover. ``cost``.
"""


@dataclass(frozen=True)
class CompareOptions:
    """What is compared and how.

    Attributes:
        architectures: Ids; none: all of the campaign.
        baseline: The one that all others are compared with; None: every pair.
        confidence: Of intervals.
        objectives: What the front is made of.
        epsilon: Difference that does not count, by objective.
    """

    architectures: Sequence[str] = ()
    baseline: str | None = None
    confidence: float = CONFIDENCE
    objectives: Sequence[str] = DEFAULT_OBJECTIVES
    epsilon: Mapping[str, float] = field(default_factory=dict)

    def chosen(self, known: Sequence[str]) -> list[str]:
        """Return the architectures to compare in the order of the ODD, the baseline first.

        Args:
            known: Those of the ODD.

        Raises:
            UsageError: One is unknown, or there are fewer than two.
        """
        _require_names("architectures", self.architectures)
        if not isinstance(self.baseline, str | None):
            raise UsageError(
                f"baseline is {shown(self.baseline)}", remedy="Give the id of an architecture."
            )
        wanted = list(dict.fromkeys(self.architectures)) or list(known)
        if self.baseline is not None and self.baseline not in wanted:
            wanted.append(self.baseline)
        but = f"but {', '.join(known)}"
        require_known(wanted, known, lambda it: f"the campaign has no architecture {it!r}, {but}")
        if len(wanted) < 2:
            raise UsageError(
                f"there is nothing to compare {wanted[0]!r} with"
                if wanted
                else "the campaign has no architecture",
                remedy="Name two architectures of one campaign, or list more of them in the ODD.",
            )
        return sorted(wanted, key=lambda name: (name != self.baseline, known.index(name)))

    def check(self) -> None:
        """Refuse what cannot be computed.

        Raises:
            UsageError: Confidence, an objective or an epsilon is unknown, repeated or out of
                range.
        """
        if not _is_number(self.confidence) or not 0.5 <= self.confidence < 1.0:
            raise UsageError(
                f"confidence is {shown(self.confidence)}", remedy="Give one from 0.5 to below 1."
            )
        _require_names("objectives", self.objectives)
        if not isinstance(self.epsilon, Mapping):
            raise UsageError(
                f"epsilon is {shown(self.epsilon)}", remedy="Give differences by objective."
            )
        if not self.objectives:
            raise UsageError(
                "no objective is given", remedy=f"Give some of {', '.join(OBJECTIVES)}."
            )
        for number, name in enumerate(self.objectives):
            _check_objective(name)
            if name in self.objectives[:number]:
                raise UsageError(
                    f"objective {name!r} is given twice",
                    remedy="Give each once; the first decides between equals.",
                )
        for name, value in self.epsilon.items():
            _check_objective(name)
            if not _is_number(value) or not 0.0 <= value < float("inf"):
                raise UsageError(
                    f"epsilon of {name} is {shown(value)}",
                    remedy="Give a finite number, 0 or more.",
                )
            if name not in self.objectives:
                raise UsageError(
                    f"epsilon of {name} has no effect: the objectives are "
                    f"{', '.join(self.objectives)}",
                    remedy=f"Leave it out, or add {name} to the objectives.",
                )


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _require_names(what: str, names: object) -> None:
    """Refuse what is no sequence of texts; a text would be taken letter by letter."""
    listed = names if isinstance(names, Sequence) and not isinstance(names, str | bytes) else [None]
    if not all(isinstance(name, str) for name in listed):
        raise UsageError(f"{what} are {shown(names)}", remedy="Give a list of texts.")


def _check_objective(name: str) -> None:
    if name not in OBJECTIVES:
        allowed = f"Allowed: {', '.join(OBJECTIVES)}."
        near = suggest(name, OBJECTIVES)
        raise UsageError(
            f"there is no objective {name!r}",
            remedy=near if near == allowed else f"{near} {allowed}",
        )
