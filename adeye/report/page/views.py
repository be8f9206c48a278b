"""What the page shows, in the order in which it shows it: worst first."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from adeye.analysis.suite.records import matching
from adeye.judge.verdict import WORST_FIRST, Verdict
from adeye.report import words
from adeye.report.claims import Claim, Claims, Refusal, refusals_of
from adeye.report.formats.gsn import argument_of, drawing_of
from adeye.report.formats.matrix import By, TraceGroup, grouped, matrix_of
from adeye.report.model.report import Architecture, Cell, Fsr, Report

# --- What the page shows, in the order in which it shows it: worst first --------------------------

_NO_MARGIN = float("inf")


@dataclass(frozen=True, slots=True)
class Badge:
    """A verdict as a sign, a word and a class of the style sheet."""

    word: str
    symbol: str
    style: str


@dataclass(frozen=True, slots=True)
class ArchitectureCard:
    """One architecture in the headline."""

    architecture: Architecture
    badge: Badge
    counts: tuple[tuple[Badge, int], ...]
    """Mandatory FSRs per verdict."""
    worst: str
    cost: str


@dataclass(frozen=True, slots=True)
class MatrixCell:
    """One cell of the verdict matrix."""

    number: int
    architecture: str
    scenario: str
    """Empty for all scenarios together."""
    badge: Badge
    margin: str
    exercised: str
    hint: str
    run: str


@dataclass(frozen=True, slots=True)
class MatrixRow:
    """One FSR of the verdict matrix."""

    number: int
    """Its place in the concept, from 1."""
    fsr: Fsr
    cells: tuple[MatrixCell, ...]


@dataclass(frozen=True, slots=True)
class Page:
    """The matrix of a report, ready for the template and the script."""

    gate: Badge
    cards: tuple[ArchitectureCard, ...]
    architectures: tuple[Architecture, ...]
    """Those in the gate first."""
    rows: tuple[MatrixRow, ...]
    details: tuple[dict[str, Any], ...]
    """What the script shows for each cell, by its number."""


def badge(verdict: Verdict | None) -> Badge:
    """Return the sign, word and style class of a verdict; None is "not applicable"."""
    style = "NOT_APPLICABLE" if verdict is None else verdict.value
    return Badge(words.verdict_word(verdict), words.SYMBOLS[verdict], style)


def arrange(report: Report) -> Page:
    """Put a report into the order of the page.

    Rows are FSRs, the worst for the gate first: by verdict, then by robustness; then what is worst
    for the compared architectures; then as the concept lists them.
    """
    architectures = sorted(report.architectures, key=lambda item: not item.is_gate)
    fsrs = sorted(report.fsrs, key=lambda fsr: _rank(report, fsr))
    rows: list[MatrixRow] = []
    details: list[dict[str, Any]] = []
    for fsr in fsrs:
        cells: list[MatrixCell] = []
        for architecture in architectures:
            for scenario in (None, *(item.id for item in report.scenarios)):
                cell = report.cell(fsr.id, architecture.id, scenario)
                cells.append(_matrix_cell(len(details), fsr, architecture, scenario, cell))
                details.append(_detail(fsr, architecture, scenario, cell))
        rows.append(MatrixRow(report.fsrs.index(fsr) + 1, fsr, tuple(cells)))
    cards = tuple(_card(report, architecture) for architecture in architectures)
    gates = [report.verdict_of(item.id) for item in architectures if item.is_gate]
    gate = min(gates, key=WORST_FIRST.index) if gates else Verdict.NOT_RUN
    return Page(badge(gate), cards, tuple(architectures), tuple(rows), tuple(details))


def filters() -> dict[str, Any]:
    """Functions that the template calls."""
    return {
        "badge": badge,
        "binding": words.binding_sentence,
        "margin": words.margin_text,
        "counted": words.counted,
        "claims_page": arrange_claims,
        "number": words.number,
        "quantity": words.quantity,
        "unit": words.unit_text,
        "degrees": math.degrees,
        "matching": matching,
        "forward_text": words.forward_text,
        "left_speed": words.left_speed,
        "metres": words.metres,
        "percent": words.percent,
        "speed_text": words.speed_text,
    }


def _robustness(cell: Cell | None) -> float:
    if cell is None or cell.margin is None or cell.margin.robustness is None:
        return _NO_MARGIN
    return cell.margin.robustness


def _rank(report: Report, fsr: Fsr) -> tuple[Any, ...]:
    def worst(*, in_gate: bool) -> tuple[int, float]:
        ids = [item.id for item in report.architectures if item.is_gate is in_gate]
        cells = [report.cell(fsr.id, architecture) for architecture in ids]
        states = [Verdict.NOT_RUN if cell is None else cell.verdict for cell in cells]
        severity = min((WORST_FIRST.index(state) for state in states), default=len(WORST_FIRST))
        return severity, min((_robustness(cell) for cell in cells), default=_NO_MARGIN)

    return (not fsr.mandatory, *worst(in_gate=True), *worst(in_gate=False))


def _matrix_cell(
    position: int, fsr: Fsr, architecture: Architecture, scenario: str | None, cell: Cell | None
) -> MatrixCell:
    is_judged = scenario is None or not fsr.scenarios or scenario in fsr.scenarios
    verdict = Verdict.NOT_RUN if cell is None and is_judged else None
    mark = badge(verdict if cell is None else cell.verdict)
    if cell is None and not is_judged:
        mark = Badge("not judged here", words.SYMBOLS[None], "NOT_APPLICABLE")
    place = "all scenarios" if scenario is None else scenario
    hint = f"{fsr.id}, {architecture.id}, {place}: {mark.word}"
    if cell is not None and cell.binding is not None:
        hint += f"\n{words.binding_sentence(cell.binding)}"
    if cell is not None:
        hint += f"\n{cell.command}"
    return MatrixCell(
        number=position,
        architecture=architecture.id,
        scenario=scenario or "",
        badge=mark,
        # Beside any other verdict a margin would read as if it meant something.
        margin=words.margin_text(cell)
        if cell is not None and cell.verdict in {Verdict.PASS, Verdict.FAIL}
        else "",
        exercised="" if cell is None else cell.exercised_text.replace(" of ", "/"),
        hint=hint,
        run="" if cell is None or cell.worst_run is None else cell.worst_run,
    )


def _detail(
    fsr: Fsr, architecture: Architecture, scenario: str | None, cell: Cell | None
) -> dict[str, Any]:
    lines: list[tuple[str, str]] = []
    if cell is None:
        lines.append(("Runs", "no result is recorded here"))
    else:
        counts = [
            f"{words.counted(runs)} {words.verdict_word(verdict)}"
            for verdict, runs in cell.counts.items()
        ]
        lines.append(("Runs", f"{words.counted(cell.runs)}: " + (", ".join(counts) or "none")))
        lines.append(("Exercised", cell.exercised_text))
        if cell.margin is not None:
            text = words.quantity(cell.margin.value, cell.margin.unit, signed=True)
            if cell.margin.robustness is not None:
                text += f" (robustness {words.number(cell.margin.robustness, signed=True)})"
            lines.append(("Worst margin", text))
        if cell.binding is not None:
            lines.append(("Binding predicate", words.binding_sentence(cell.binding)))
        if cell.worst_run is not None:
            lines.append(("Worst run", cell.worst_run))
        if cell.note:
            lines.append(("Note", cell.note))
    return {
        "title": f"{fsr.id} \N{MIDDLE DOT} {architecture.id} \N{MIDDLE DOT} "
        f"{scenario or 'all scenarios'}",
        "style": badge(Verdict.NOT_RUN if cell is None else cell.verdict).style,
        "text": fsr.text,
        "lines": lines,
        "run": "" if cell is None else cell.worst_run or "",
        "time": None if cell is None or cell.binding is None else cell.binding.time_s,
        "command": "" if cell is None else cell.command,
    }


def _card(report: Report, architecture: Architecture) -> ArchitectureCard:
    cells = [report.cell(fsr.id, architecture.id) for fsr in report.fsrs if fsr.mandatory]
    states = Counter(Verdict.NOT_RUN if cell is None else cell.verdict for cell in cells)
    counts = tuple((badge(state), states[state]) for state in WORST_FIRST if states[state])
    worst = min((cell for cell in cells if cell is not None), key=_robustness, default=None)
    text = ""
    if worst is not None and _robustness(worst) < _NO_MARGIN:
        text = f"{worst.fsr} {words.margin_text(worst) or words.verdict_word(worst.verdict)}"
    cost = "" if architecture.cost is None else f"{architecture.cost:,g}"
    verdict = report.verdict_of(architecture.id)
    return ArchitectureCard(architecture, badge(verdict), counts, text, cost)


# --- What the page shows of confidence, coverage of the ODD and the step, placed and put in order -


@dataclass(frozen=True, slots=True)
class ClaimRow:
    """One bound.

    Attributes:
        claim: As it was made.
        dot: Where the share lies on the axis [%]; None without one.
        low: Where the interval begins on the axis [%]; None without one.
        high: Where it ends [%].
        bound: Where the one-sided bound lies [%].
    """

    claim: Claim
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


def arrange_claims(claims: Claims) -> ConfidencePage:
    """Put bounds and refusals into the order of the page."""
    said = sorted(
        (item for item in claims.claims if not item.refusal),
        key=lambda item: (not item.is_in_gate, item.architecture),
    )
    end = _axis_end(said)
    scenarios = dict.fromkeys(item.scenario for item in said if item.scenario)
    return ConfidencePage(
        rows=tuple(_claim(item, end) for item in said),
        percent=f"{100.0 * claims.level:g} %",
        end=words.number(end),
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

    interval = claim.interval
    return ClaimRow(
        claim=claim,
        dot=at(claim.share),
        low=None if interval is None else at(interval.low),
        high=None if interval is None else at(interval.high),
        bound=at(claim.upper),
    )


# --- The traceability matrix both ways and the goal structure, as the page shows them -------------

_WAYS: Final[tuple[tuple[By, str, tuple[By, ...]], ...]] = (
    ("hazard", "Forwards: what answers a hazardous event", ("goal", "fsr", "element", "scenario")),
    ("element", "Backwards: what an element is there for", ("fsr", "goal", "hazard", "scenario")),
    ("scenario", "Backwards: what a scenario is there for", ("fsr", "goal", "hazard", "element")),
)


@dataclass(frozen=True, slots=True)
class TraceLine:
    """One thing of a matrix, ready for the template.

    Attributes:
        id: Of the thing; empty for what belongs to none.
        links: Ids by the columns of the way.
        verdicts: Verdict and how many cells have it, the worst first; None is "not applicable".
        gaps: What is missing, each once.
    """

    id: str
    links: tuple[tuple[str, ...], ...]
    verdicts: tuple[tuple[Verdict | None, int], ...]
    gaps: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TraceWay:
    """The matrix from one of its columns.

    Attributes:
        by: The column that the rows are about.
        title: For people.
        columns: The others that are shown.
        lines: One for each thing.
    """

    by: By
    title: str
    columns: tuple[By, ...]
    lines: tuple[TraceLine, ...]


def ways_of(report: Report) -> tuple[TraceWay, ...]:
    """Turn the matrix of a report: from hazardous events on, and back from what was built."""
    return tuple(
        TraceWay(
            by,
            title,
            columns,
            tuple(_line(group, columns) for group in grouped(matrix_of(report, by), by)),
        )
        for by, title, columns in _WAYS
    )


def _line(group: TraceGroup, columns: tuple[By, ...]) -> TraceLine:
    counts = [
        (None if name == "NOT_APPLICABLE" else Verdict(name), count)
        for name, count in group.verdicts.items()
    ]
    counts.sort(key=lambda item: WORST_FIRST.index(item[0]))
    links = tuple(group.links[column] for column in columns)
    return TraceLine(group.id, links, tuple(counts), group.gaps)


def goal_structure(report: Report) -> str:
    """Draw the argument of a report as an SVG that can stand inside of a page.

    Its ids get a beginning of their own, so that none is one of the page.
    """
    return drawing_of(argument_of(report), "gsn-")
