"""What the page shows, in the order in which it shows it: worst first."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from adeye.evaluation.verdict import Verdict
from adeye.report.words import (
    SYMBOLS,
    binding_sentence,
    counted,
    margin_text,
    number,
    quantity,
    unit_text,
    verdict_word,
)

if TYPE_CHECKING:
    from adeye.report.model import Architecture, Cell, Fsr, Report

SEVERITY: tuple[Verdict | None, ...] = (
    Verdict.FAIL,
    Verdict.ERROR,
    Verdict.INVALID,
    Verdict.INCONCLUSIVE,
    Verdict.NOT_RUN,
    None,
    Verdict.VACUOUS,
    Verdict.PASS,
)
"""Verdicts from the worst; None is "not applicable"."""
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
    """Give the sign, word and style class of a verdict; None is "not applicable"."""
    style = "NOT_APPLICABLE" if verdict is None else verdict.value
    return Badge(verdict_word(verdict), SYMBOLS[verdict], style)


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
    gate = min(gates, key=SEVERITY.index) if gates else Verdict.NOT_RUN
    return Page(badge(gate), cards, tuple(architectures), tuple(rows), tuple(details))


def filters() -> dict[str, Any]:
    """Functions that the template calls."""
    return {
        "badge": badge,
        "binding": binding_sentence,
        "margin": margin_text,
        "counted": counted,
        "number": number,
        "quantity": quantity,
        "unit": unit_text,
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
        severity = min((SEVERITY.index(state) for state in states), default=len(SEVERITY))
        return severity, min((_robustness(cell) for cell in cells), default=_NO_MARGIN)

    return (not fsr.mandatory, *worst(in_gate=True), *worst(in_gate=False))


def _matrix_cell(
    position: int, fsr: Fsr, architecture: Architecture, scenario: str | None, cell: Cell | None
) -> MatrixCell:
    is_judged = scenario is None or not fsr.scenarios or scenario in fsr.scenarios
    verdict = Verdict.NOT_RUN if cell is None and is_judged else None
    mark = badge(verdict if cell is None else cell.verdict)
    if cell is None and not is_judged:
        mark = Badge("not judged here", SYMBOLS[None], "NOT_APPLICABLE")
    place = "all scenarios" if scenario is None else scenario
    hint = f"{fsr.id}, {architecture.id}, {place}: {mark.word}"
    if cell is not None and cell.binding is not None:
        hint += f"\n{binding_sentence(cell.binding)}"
    if cell is not None:
        hint += f"\n{cell.command}"
    return MatrixCell(
        number=position,
        architecture=architecture.id,
        scenario=scenario or "",
        badge=mark,
        # Beside any other verdict a margin would read as if it meant something.
        margin=margin_text(cell)
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
            f"{counted(runs)} {verdict_word(verdict)}" for verdict, runs in cell.counts.items()
        ]
        lines.append(("Runs", f"{counted(cell.runs)}: " + (", ".join(counts) or "none")))
        lines.append(("Exercised", cell.exercised_text))
        if cell.margin is not None:
            text = quantity(cell.margin.value, cell.margin.unit, signed=True)
            if cell.margin.robustness is not None:
                text += f" (robustness {number(cell.margin.robustness, signed=True)})"
            lines.append(("Worst margin", text))
        if cell.binding is not None:
            lines.append(("Binding predicate", binding_sentence(cell.binding)))
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
    counts = tuple((badge(state), states[state]) for state in SEVERITY if states[state])
    worst = min((cell for cell in cells if cell is not None), key=_robustness, default=None)
    text = ""
    if worst is not None and _robustness(worst) < _NO_MARGIN:
        text = f"{worst.fsr} {margin_text(worst) or verdict_word(worst.verdict)}"
    cost = "" if architecture.cost is None else f"{architecture.cost:,g}"
    verdict = report.verdict_of(architecture.id)
    return ArchitectureCard(architecture, badge(verdict), counts, text, cost)
