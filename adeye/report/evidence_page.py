"""What the page shows of confidence, coverage of the ODD and the step, placed and put in order."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.report.refusals import refusals_of
from adeye.report.words import counted, number

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from adeye.report.claims import Claim, Claims
    from adeye.report.evidence_parts import OddCoverage, StepLine, StepUncertainty
    from adeye.report.model import Report
    from adeye.report.refusals import Refusal

MAX_LINES: Final = 1_000
"""Metrics of which the page shows what the step changes."""


@dataclass(frozen=True, slots=True)
class ClaimRow:
    """One bound.

    Attributes:
        claim: As it was made.
        share: Failing share, in words; empty where there is none.
        interval: Two-sided interval, in words.
        upper: One-sided bound, in words.
        dot: Where the share lies on the axis [%]; None without one.
        low: Where the interval begins on the axis [%]; None without one.
        high: Where it ends [%].
        bound: Where the one-sided bound lies [%].
    """

    claim: Claim
    share: str
    interval: str
    upper: str
    dot: float | None
    low: float | None
    high: float | None
    bound: float | None


@dataclass(frozen=True, slots=True)
class ConfidencePage:
    """Bounds and refusals.

    Attributes:
        rows: Bounds, those of the gate first.
        percent: Level of confidence, in words.
        end: Where the axis of the intervals ends, in words.
        has_rates: Whether any bound is weighted to a rate.
        refusals: Why there is no other bound.
        populations: What the points are in scenarios with a bound.
        is_silent: Whether nothing may be said about some mandatory FSR of the gate.
        silent: Those, with the architecture where the gate has several.
    """

    rows: tuple[ClaimRow, ...]
    percent: str
    end: str
    has_rates: bool
    refusals: tuple[Refusal, ...]
    populations: tuple[tuple[str, str], ...]
    is_silent: bool
    silent: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BinBox:
    """One bin.

    Attributes:
        label: Of the bin.
        state: ``covered``, ``uncovered`` or ``impossible``.
        text: How many test cases, or why none.
        share: Of the counted test cases [%], at least a visible one where there is any.
    """

    label: str
    state: str
    text: str
    share: float


@dataclass(frozen=True, slots=True)
class AttributeRow:
    """One attribute: how many of its feasible bins are covered, and each of them."""

    attribute: str
    covered: int
    feasible: int
    boxes: tuple[BinBox, ...]


@dataclass(frozen=True, slots=True)
class CoveragePage:
    """Coverage of the ODD.

    Attributes:
        rows: By attribute.
        bins: Feasible bins of all attributes.
        covered_bins: Those that a test case has.
        not_counted: How many test cases do not count, and why.
        pairs: Uncovered pairs by their attributes.
        unlisted: Uncovered pairs that are not listed.
    """

    rows: tuple[AttributeRow, ...]
    bins: int
    covered_bins: int
    not_counted: tuple[str, ...]
    pairs: tuple[tuple[str, tuple[str, ...]], ...]
    unlisted: int


@dataclass(frozen=True, slots=True)
class StepPage:
    """What halving the step changes.

    Attributes:
        margins: Lines of FSRs with a value in some pair, or another verdict.
        metrics: The same of metrics, as far as they are shown.
        without: Lines in which no pair has a value.
        unlisted: Lines of metrics that are not shown.
        known: Margins with an uncertainty.
        differing: Verdicts that are others with half the step.
    """

    margins: tuple[StepLine, ...]
    metrics: tuple[StepLine, ...]
    without: int
    unlisted: int
    known: int
    differing: int


@dataclass(frozen=True, slots=True)
class EvidencePage:
    """The three sections; None where the report says nothing."""

    confidence: ConfidencePage | None
    coverage: CoveragePage | None
    step: StepPage | None


def arrange_evidence(report: Report) -> EvidencePage:
    """Put what a report says of confidence, coverage and step into the order of the page."""
    claims, coverage, step = report.confidence, report.odd_coverage, report.step_uncertainty
    return EvidencePage(
        None if claims is None else _confidence(claims),
        None if coverage is None else _coverage(coverage),
        None if step is None else _step(step),
    )


def _confidence(claims: Claims) -> ConfidencePage:
    said = sorted(
        (item for item in claims.claims if not item.refusal),
        key=lambda item: (not item.is_in_gate, item.architecture),
    )
    end = _axis_end(said)
    scenarios = dict.fromkeys(item.scenario for item in said if item.scenario)
    return ConfidencePage(
        rows=tuple(_claim(item, end) for item in said),
        percent=f"{100.0 * claims.level:g} %",
        end=number(end),
        has_rates=any(item.rate_per_h is not None for item in said),
        refusals=refusals_of(claims),
        populations=tuple((name, claims.populations[name]) for name in scenarios),
        is_silent=bool(claims.missing) or not claims.claims,
        silent=_silent(claims),
    )


def _silent(claims: Claims) -> tuple[str, ...]:
    gate = {item.architecture for item in claims.claims if item.is_in_gate}
    return tuple(
        fsr if len(gate) == 1 else f"{fsr} for {architecture}"
        for fsr, architecture in claims.missing
    )


def _axis_end(said: Sequence[Claim]) -> float:
    """Choose a round end that every bound is left of: 1, 2 or 5 times a power of ten, at most 1."""
    largest = max((end for item in said for end in _ends(item)), default=0.0)
    if largest <= 0.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(largest))
    end = next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= largest)
    return min(1.0, end)


def _ends(claim: Claim) -> Iterator[float]:
    for value in (claim.share, claim.upper):
        if value is not None:
            yield value
    for span in (claim.interval, claim.upper_varied):
        if span is not None:
            yield span.high


def _claim(claim: Claim, end: float) -> ClaimRow:
    def at(value: float | None) -> float | None:
        return None if value is None else round(100.0 * value / end, 2)

    interval, varied = claim.interval, claim.upper_varied
    upper = "" if claim.upper is None else number(claim.upper)
    if varied is not None:
        upper += f" ({number(varied.low)} to {number(varied.high)})"
    return ClaimRow(
        claim=claim,
        share="" if claim.share is None else number(claim.share),
        interval="" if interval is None else f"{number(interval.low)} to {number(interval.high)}",
        upper=upper,
        dot=at(claim.share),
        low=None if interval is None else at(interval.low),
        high=None if interval is None else at(interval.high),
        bound=at(claim.upper),
    )


def _coverage(found: OddCoverage) -> CoveragePage:
    rows = tuple(
        AttributeRow(
            item.attribute,
            item.covered,
            item.feasible,
            tuple(
                BinBox(
                    label=own.label,
                    state=own.state,
                    text=_words(own.state, own.test_cases),
                    # A few of many test cases are not to be taken for none.
                    share=round(max(2.0, 100.0 * own.test_cases / found.counted), 2)
                    if own.test_cases
                    else 0.0,
                )
                for own in item.bins
            ),
        )
        for item in found.attributes
    )
    counts = (
        (found.without_result, "without a result"),
        (found.not_judged, "in which the scenario did not come about"),
        (found.outside_odd, "outside the ODD"),
        (found.in_no_bin, "with an attribute in no bin, counted for the others only"),
    )
    pairs: dict[str, list[str]] = {}
    for pair in found.uncovered_pairs:
        pairs.setdefault(" × ".join(pair.attributes), []).append(" × ".join(pair.bins))
    return CoveragePage(
        rows=rows,
        bins=sum(row.feasible for row in rows),
        covered_bins=sum(row.covered for row in rows),
        not_counted=tuple(f"{counted(count)} {why}" for count, why in counts if count),
        pairs=tuple((names, tuple(labels)) for names, labels in pairs.items()),
        unlisted=found.missing_pairs - len(found.uncovered_pairs),
    )


def _words(state: str, test_cases: int) -> str:
    if state == "covered":
        return counted(test_cases)
    return "uncovered" if state == "uncovered" else "no scenario"


def _step(found: StepUncertainty) -> StepPage:
    shown = [line for line in found.lines if line.pairs or line.differing]
    margins = tuple(_of_kind(shown, "fsr"))
    metrics = tuple(_of_kind(shown, "metric"))
    return StepPage(
        margins=margins,
        metrics=metrics[:MAX_LINES],
        without=len(found.lines) - len(shown),
        unlisted=max(0, len(metrics) - MAX_LINES),
        known=sum(line.uncertainty is not None for line in margins),
        differing=sum(line.differing for line in margins),
    )


def _of_kind(lines: Iterable[StepLine], kind: str) -> Iterator[StepLine]:
    return (line for line in lines if line.kind == kind)
