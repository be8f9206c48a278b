"""What may be said about the probability of a violation: a bound, or why there is none.

The design decides. Only independent draws from a declared distribution are a sample; the drawn
point is the unit, for its runs share the situation. A point without a decided verdict counts as if
it had failed. Points that hold with the same result count once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Final, Literal, get_args

import numpy as np
from pydantic import Field

from adeye.errors import UsageError
from adeye.judge import statistics
from adeye.judge.pairing import FAILED, HELD, UNDECIDED, Groups, number_rows, severities
from adeye.judge.verdict import VACUOUS, VERDICTS
from adeye.packaged import packaged_yaml
from adeye.report.comparison.records import Range, Share
from adeye.report.model.part import Count, Id, Part
from adeye.signals import Ints
from adeye.store.read.bulk import Compared
from adeye.store.records import LEFT_OUT, CampaignInfo
from adeye.store.repository import Repository
from adeye.sweep.design import design_statement

# --- What may be said about the probability of a violation: a bound, or why there is none ---------

Method = Literal["clopper-pearson", "wilson", "jeffreys"]
METHODS: Final[tuple[Method, ...]] = get_args(Method)
WEIGHT_FACTOR: Final = 3.0
"""How far an exposure is varied: it is known to its order of magnitude at best."""

_INTERVALS: Final[dict[Method, Callable[[int, int, float], statistics.Interval]]] = {
    "clopper-pearson": statistics.clopper_pearson,
    "wilson": statistics.wilson,
    "jeffreys": statistics.jeffreys,
}


_TEXTS: Final[dict[str, Any]] = packaged_yaml("adeye.report", "statements.yaml")
SHARED: Final[str] = _TEXTS["shared"]
SAMPLE: Final[str] = _TEXTS["sample"]
GRID: Final[str] = _TEXTS["grid"]
REPORTED_SAMPLE: Final[str] = _TEXTS["reported_sample"]
REPORTED_GRID: Final[str] = _TEXTS["reported_grid"]


class Claim(Part):
    """What may be said of one FSR and architecture, in a scenario or weighted over all of them."""

    fsr: Id
    architecture: Id
    scenario: str
    """Empty: weighted over scenarios by exposure."""
    is_mandatory: bool
    is_in_gate: bool
    points: Count
    """Drawn points on which it is judged."""
    exercised: Count
    """Those in which its precondition held, or may have held; of equal results that hold, one."""
    failing: Count
    undecided: Count
    """Points that did not fail and have a run without a decided verdict."""
    refusal: str
    """Why there is no bound; empty where there is."""
    share: Share | None = None
    """Failing share of exercised points; over scenarios that of all points, weighted."""
    interval: Range | None = None
    """Two-sided, by the method; it holds whatever the undecided points are."""
    upper: Share | None = None
    """One-sided bound, always exact."""
    upper_varied: Range | None = None
    """Least and greatest bound with one exposure divided or multiplied; only over scenarios."""
    rate_per_h: Annotated[float, Field(ge=0.0)] | None = None
    """Bound of violations per hour of operation; only over scenarios."""
    needed: Count | None = None
    """Exercised points without a failure that the target takes."""

    @property
    def is_statement(self) -> bool:
        """Whether some point tells anything: a bound from undecided points alone is none."""
        return not self.refusal and (self.failing > 0 or self.exercised > self.undecided)


class Claims(Part):
    """What may be said about a campaign."""

    campaign: Id
    odd: Id
    title: str
    level: Share
    """Confidence of each statement."""
    method: Method
    target: Share | None
    is_joint: bool
    populations: dict[str, str]
    """What the points of each scenario are."""
    conditions: tuple[str, ...]
    claims: tuple[Claim, ...]

    @property
    def missing(self) -> tuple[tuple[str, str], ...]:
        """Mandatory FSRs and architectures of the gate about which nothing may be said."""
        wanted = [item for item in self.claims if item.is_mandatory and item.is_in_gate]
        said = {(item.fsr, item.architecture) for item in wanted if item.is_statement}
        pairs = dict.fromkeys((item.fsr, item.architecture) for item in wanted)
        return tuple(pair for pair in pairs if pair not in said)


@dataclass(frozen=True, slots=True)
class ClaimOptions:
    """How a claim is made.

    Attributes:
        level: Confidence of each statement.
        method: Of the two-sided interval; the upper bound is Clopper and Pearson's.
        target: Bound that is wanted, to tell how many points it takes.
        is_joint: Whether all bounds are to hold at once.
    """

    level: float = 0.95
    method: Method = "clopper-pearson"
    target: float | None = None
    is_joint: bool = False

    def check(self) -> None:
        """Refuse what is no level, method or target.

        Raises:
            UsageError: One of them is not.
        """
        shares = {"level": self.level} | ({} if self.target is None else {"target": self.target})
        if not 0.5 <= self.level < 1.0:
            raise UsageError(f"level is {self.level:g}", remedy="Give one from 0.5 to below 1.")
        for name, value in shares.items():
            if not 0.0 < value < 1.0:
                raise UsageError(
                    f"{name} is {value:g}", remedy="A share above 0 and below 1, such as 0.95."
                )
        if self.method not in METHODS:
            raise UsageError(f"there is no method {self.method!r}", remedy=f"{', '.join(METHODS)}.")


_UNTOLD: Final[Mapping[str, None]] = dict.fromkeys(
    ("share", "interval", "upper", "upper_varied", "rate_per_h", "needed")
)
"""What a claim has no number for before it is allowed."""


def _partly(
    counts: Mapping[tuple[str, str, str], _Counts], found: Sequence[Claim]
) -> Iterator[str]:
    """Say of which points bounds are not, where an FSR is not judged on all of a scenario."""
    told: dict[tuple[str, int, int], list[str]] = {}
    bounded = {(item.fsr, item.architecture) for item in found if not item.refusal}
    refused = {(item.fsr, item.architecture, item.scenario) for item in found if item.refusal}
    for key, count in counts.items():
        if count.points < count.everywhere and key[:2] in bounded and key not in refused:
            told.setdefault((key[2], count.points, count.everywhere), []).append(key[0])
    for (scenario, points, everywhere), fsrs in told.items():
        yield _TEXTS["partly" if points else "outside"].format(
            scenario=scenario,
            fsrs=", ".join(dict.fromkeys(fsrs)),
            points=points,
            everywhere=everywhere,
        )


@dataclass(frozen=True, slots=True)
class _Counts:
    points: int
    exercised: int
    failing: int
    undecided: int
    everywhere: int = 0
    """Points of the scenario, also those that the FSR is not judged on."""
    repeated: int = 0
    """Points that hold with the result of another one, exercised or not."""
    drawn: int = 0
    """Exercised points, also those that repeat a result."""
    results: Mapping[bytes, bool] = field(default_factory=dict)
    """What points hold with, as far as traces repeat at all, and whether it is exercised."""

    @property
    def worst(self) -> int:
        return self.failing + self.undecided

    def without(self, known: Mapping[bytes, bool]) -> _Counts:
        """Leave out results of other scenarios."""
        again = [is_exercised for key, is_exercised in self.results.items() if key in known]
        return replace(
            self, exercised=self.exercised - sum(again), repeated=self.repeated + len(again)
        )


def claims_of(
    repository: Repository, campaign: CampaignInfo, options: ClaimOptions | None = None
) -> Claims:
    """Make every claim that a campaign allows.

    Args:
        repository: The database.
        campaign: The campaign.
        options: Level, method, target.

    Raises:
        UsageError: An option is out of range.
    """
    options = options or ClaimOptions()
    options.check()
    odd: Mapping[str, Any] = repository.content("odd", campaign.odd_digest)
    return _Claimer(repository, campaign, odd, options).claims()


class _Claimer:
    def __init__(
        self,
        repository: Repository,
        campaign: CampaignInfo,
        odd: Mapping[str, Any],
        options: ClaimOptions,
    ) -> None:
        self._campaign = campaign
        self._options = options
        self._compared = repository.compared(campaign.id, list(odd["architectures"]))
        self._units = _units(self._compared)
        self._severity = severities(self._compared.verdict)
        trace = self._compared.trace
        self._is_repeated = np.bincount(trace[trace >= 0], minlength=1).max() > 1
        applicable = [
            item
            for item in repository.fsr_status(campaign.id)
            if item.scenario and item.is_applicable
        ]
        self._status = [item for item in applicable if item.planned]
        self._outside = [item for item in applicable if not item.planned]
        names = self._compared.scenario.words
        self._designs = {name: design_statement(odd, name, campaign.factors) for name in names}
        self._left_out = odd.get(LEFT_OUT, {})
        self._exposures = {name: use.get("exposure") for name, use in uses_of(odd).items()}

    def claims(self) -> Claims:
        options = self._options
        keys = [(item.fsr, item.architecture, item.scenario) for item in self._status]
        counts = {key: self._counts(*key) for key in keys}
        by_fsr: dict[tuple[str, str], list[str]] = {}
        for fsr, architecture, scenario in keys:
            by_fsr.setdefault((fsr, architecture), []).append(scenario)
        sampled = {
            key: names
            for key, names in by_fsr.items()
            if all(self._designs[name].is_random_sample for name in names)
        }
        bounds = sum(not self._refusal(key[2], counts[key]) for key in keys) + len(sampled)
        self._require_level(bounds, max(map(len, sampled.values()), default=1))
        level = 1.0 - (1.0 - options.level) / max(1, bounds) if options.is_joint else options.level
        found: list[Claim] = []
        for item in self._status:
            key = (item.fsr, item.architecture, item.scenario)
            names = ("fsr", "architecture", "is_mandatory", "is_in_gate")
            about = {name: getattr(item, name) for name in names}
            found.append(self._single(about, item.scenario, counts[key], level))
            pair = key[:2]
            if pair in sampled and item.scenario == sampled[pair][-1]:
                strata = {name: counts[*pair, name] for name in sampled[pair]}
                if len(strata) > 1:
                    found.append(self._weighted(about, strata, level))
        for item in self._outside:
            key = (item.fsr, item.architecture, item.scenario)
            counts[key] = self._counts(*key)
        return Claims.of(
            options,
            campaign=self._campaign.id,
            odd=self._campaign.odd,
            title=self._campaign.title,
            populations={
                name: f"{item.population}{self._at_one_place(name)}"
                for name, item in self._designs.items()
            },
            conditions=(*_partly(counts, found), *self._conditions(found, bounds)),
            claims=tuple(found),
        )

    def _at_one_place(self, scenario: str) -> str:
        first = self._left_out.get(scenario, {}).get("first")
        return f", all of them at {first} of the map" if first else ""

    def _conditions(self, found: Sequence[Claim], bounds: int) -> tuple[str, ...]:
        if all(item.refusal for item in found):
            return ()
        texts = list(_TEXTS["conditions"])
        if any(not item.scenario and not item.refusal for item in found):
            exposures = ", ".join(
                f"{name} {3600.0 * value:.4g} /h"
                for name, value in self._exposures.items()
                if value is not None
            )
            texts.append(_TEXTS["weighted"].format(exposures=exposures))
        said = _TEXTS["joint" if self._options.is_joint else "single"]
        texts.append(said.format(count=bounds))
        if self._options.method == "jeffreys":
            texts.append(_TEXTS["jeffreys"])
        return tuple(texts)

    def _counts(self, fsr: str, architecture: str, scenario: str) -> _Counts:
        """Fold the runs of each drawn point."""
        compared = self._compared
        column = compared.fsrs.index(fsr)
        planned = (compared.scenario.codes == _code(compared.scenario.words, scenario)) & (
            compared.architecture.codes == _code(compared.architecture.words, architecture)
        )
        rows = planned & (compared.verdict[:, column] >= 0)
        everywhere = len(np.unique(self._units[planned]))
        if not rows.any():
            return _Counts(0, 0, 0, 0, everywhere)
        groups = Groups.of(self._units[rows])
        worst = groups.worst(self._severity[rows, column])
        exercised = groups.worst((compared.verdict[rows, column] != VACUOUS).astype(np.int64))
        held = worst == HELD
        results: dict[bytes, bool] = {}
        if self._is_repeated:
            keys = self._results(np.flatnonzero(rows), groups, column)
            for place in np.flatnonzero(held).tolist():
                results.setdefault(keys[place], bool(exercised[place]))
        drawn = int(exercised.sum())
        again = int((exercised.astype(np.bool_) & held).sum()) - sum(results.values())
        return _Counts(
            points=len(worst),
            exercised=drawn - again if self._is_repeated else drawn,
            failing=int((worst == FAILED).sum()),
            undecided=int((worst == UNDECIDED).sum()),
            everywhere=everywhere,
            repeated=int(held.sum()) - len(results) if self._is_repeated else 0,
            drawn=drawn,
            results=results,
        )

    def _results(self, rows: Ints, groups: Groups, column: int) -> list[bytes]:
        """Name what the runs of each point (G,) ended with: their different traces and verdicts."""
        compared = self._compared
        ended = compared.trace[rows] * (len(VERDICTS) + 2) + compared.verdict[rows, column] + 1
        ended = ended[groups.order]
        ends = [*groups.starts[1:].tolist(), len(ended)]
        return [
            np.unique(ended[begin:end]).tobytes()
            for begin, end in zip(groups.starts.tolist(), ends, strict=True)
        ]

    def _refusal(self, scenario: str, counts: _Counts) -> str:
        design = self._designs[scenario]
        if not design.is_random_sample:
            return design.population
        return "" if counts.exercised else "its precondition never held"

    def _require_level(self, bounds: int, strata: int) -> None:
        """Refuse a level whose error, shared among bounds and strata, is no number any more.

        Raises:
            UsageError: It is.
        """
        parts = strata * (max(1, bounds) if self._options.is_joint else 1)
        if 1.0 - (1.0 - self._options.level) / parts >= 1.0:
            raise UsageError(
                f"level is {self._options.level!r}, and a part in {parts} of its error cannot be "
                "told from 0",
                remedy="Give a lower level, such as 0.999999.",
            )

    def _single(
        self, about: Mapping[str, Any], scenario: str, counts: _Counts, level: float
    ) -> Claim:
        refusal = self._refusal(scenario, counts)
        base = Claim.of(counts, **about, **_UNTOLD, scenario=scenario, refusal=refusal)
        if refusal:
            return base
        options = self._options
        interval = _INTERVALS[options.method]
        return base.model_copy(
            update={
                "share": counts.failing / counts.exercised,
                "interval": Range(
                    low=interval(counts.failing, counts.drawn, level).low,
                    high=interval(counts.worst, counts.exercised, level).high,
                ),
                "upper": statistics.upper_bound(counts.worst, counts.exercised, level),
                "needed": None
                if options.target is None
                else statistics.runs_without_failure(options.target, level),
            }
        )

    def _weighted(
        self, about: Mapping[str, Any], strata: Mapping[str, _Counts], level: float
    ) -> Claim:
        known: dict[bytes, bool] = {}
        different: dict[str, _Counts] = {}
        for name, item in strata.items():
            different[name] = item.without(known)
            known |= item.results
        total = _Counts(
            *(
                sum(getattr(item, name) for item in different.values())
                for name in ("points", "exercised", "failing", "undecided")
            )
        )
        unknown = [name for name in strata if self._exposures.get(name) is None]
        refusal = f"no exposure of {', '.join(unknown)}" if unknown else ""
        if not total.exercised:
            refusal = "its precondition never held"
        base = Claim.of(total, **about, **_UNTOLD, scenario="", refusal=refusal)
        if refusal:
            return base
        rates = [float(self._exposures[name] or 0.0) for name in strata]
        rate = math.fsum(rates)
        weights = [item / rate for item in rates]
        parts = list(zip(weights, different.values(), strict=True))
        seen = [statistics.Stratum(weight, item.failing, item.points) for weight, item in parts]
        worst = [
            statistics.Stratum(weight, item.worst, item.points - item.repeated)
            for weight, item in parts
        ]
        upper = statistics.stratified_bound(worst, level)
        varied = [upper]
        varied += [
            bound
            for pair in statistics.scaled_bounds(worst, level, WEIGHT_FACTOR)
            for bound in pair
        ]
        return base.model_copy(
            update={
                "share": statistics.stratified_estimate(seen).share,
                "upper": upper,
                "upper_varied": Range(low=min(varied), high=max(varied)),
                "rate_per_h": 3600.0 * rate * upper,
            }
        )


def _units(compared: Compared) -> Any:
    """Number the drawn points: what the scenario and what the architecture was given."""
    return number_rows(compared.point, *(item.codes for item in compared.axes.values()))


def _code(words: Sequence[str], word: str) -> int:
    return list(words).index(word) if word in words else -1


# --- What cannot be said about probabilities, reason by reason ------------------------------------


@dataclass(frozen=True, slots=True)
class Refusal:
    """One reason why there is no bound.

    Attributes:
        reason: Why.
        scenarios: It holds for; empty where all are meant together.
        fsrs: It holds for.
        is_all: Whether these are all FSRs.
        count: Of FSR and architecture and scenario.
    """

    reason: str
    scenarios: tuple[str, ...]
    fsrs: tuple[str, ...]
    is_all: bool
    count: int


def refusals_of(claims: Claims) -> tuple[Refusal, ...]:
    """Collect the refused claims by their reason, in the order of the first of each."""
    refused = [item for item in claims.claims if item.refusal]
    every = {item.fsr for item in claims.claims}
    found: list[Refusal] = []
    for reason in dict.fromkeys(item.refusal for item in refused):
        about = [item for item in refused if item.refusal == reason]
        fsrs = tuple(dict.fromkeys(item.fsr for item in about))
        found.append(
            Refusal(
                reason=reason,
                scenarios=tuple(dict.fromkeys(item.scenario for item in about if item.scenario)),
                fsrs=fsrs,
                is_all=len(fsrs) == len(every),
                count=len(about),
            )
        )
    return tuple(found)


# --- What the design of a sweep allows to say: a random sample, or chosen points ------------------

RANDOM: Final = "random"
"""The one design that is a sample: uniform between the ends, unless a distribution is declared."""

DECLARED: Final = "random, declared"
"""The same with a declared distribution of at least one axis."""


def uses_of(odd: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Return how an ODD uses its scenarios, by the id that each has in it.

    Args:
        odd: Stored content of the ODD.
    """
    return {str(use.get("as") or use["use"]): use for use in odd["odd"]["scenarios"]}


def designs_of(odd: Mapping[str, Any]) -> dict[str, str]:
    """Return the design of every scenario by its id in the ODD.

    Args:
        odd: Stored content of the ODD.
    """
    return {name: _design(use["sweep"]) for name, use in uses_of(odd).items()}


def _design(sweep: Mapping[str, Any]) -> str:
    axes = sweep.get("parameters", {}).values()
    declared = any(isinstance(axis, dict) and "from" not in axis for axis in axes)
    is_declared = sweep["design"] == RANDOM and declared
    return DECLARED if is_declared else str(sweep["design"])


def is_sample(design: str) -> bool:
    """Return whether the points of a design are a random sample of a declared distribution.

    >>> is_sample("random"), is_sample("full_factorial")
    (True, False)
    """
    return design in {RANDOM, DECLARED}


def spoken_of(
    designs: Mapping[str, str], scenarios: Iterable[str], *, drawn: str = SAMPLE, fixed: str = GRID
) -> tuple[str, ...]:
    """Return what may be concluded from the points of some scenarios.

    Args:
        designs: Design by scenario.
        scenarios: Those that are spoken of.
        drawn: What is said of a random sample; ``{scenarios}`` are their names.
        fixed: What is said of every other design.

    Returns:
        One statement for each kind of design that occurs.
    """
    stated = drawn.replace(_TEXTS["uniform"], _TEXTS["stated"])
    names: dict[str, list[str]] = {drawn: [], stated: [], fixed: []}
    for name in scenarios:
        text = {RANDOM: drawn, DECLARED: stated}.get(designs[name], fixed)
        names[text].append(name)
    return tuple(text.format(scenarios=", ".join(found)) for text, found in names.items() if found)
