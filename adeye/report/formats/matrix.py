"""The traceability matrix: hazardous event, goal, FSR, element, measure, scenario and verdict.

Forwards it shows what a hazardous event is answered by, backwards what a scenario or an element is
there for. Each row is one way through the chain; where the chain ends too soon, the row says so.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Final, Literal, get_args

from adeye.judge.verdict import Verdict
from adeye.report.cells import csv_cell
from adeye.report.formats.sarif import judged_in
from adeye.report.model.concept import Hazard, SafetyGoal
from adeye.report.model.report import Architecture, Fsr, Report
from adeye.report.words import margin_text

By = Literal["hazard", "goal", "fsr", "element", "measure", "scenario", "architecture"]
BY: Final[tuple[By, ...]] = get_args(By)
"""What a matrix can begin with."""


@dataclass(frozen=True, slots=True)
class TraceRow:
    """One way through the chain; what is not there is empty.

    Attributes:
        hazard: Id of the hazardous event.
        hazard_asil: Derived ASIL; ``none`` where none is assigned.
        goal: Id of the safety goal.
        goal_asil: Its ASIL.
        fsr: Id of the FSR.
        fsr_asil: Its ASIL.
        element: Id of an element that it is allocated to.
        realised_by: Parts of the architecture that realise the element.
        measure: Formula or bound.
        threshold_source: Where the threshold comes from.
        scenario: Id of a scenario that it is judged in.
        architecture: Id of the architecture.
        verdict: Of the FSR for the architecture in the scenario.
        margin: Of the worst run; None where there is no number.
        unit: Of the margin.
        runs: Runs planned.
        exercised: Runs in which the precondition held.
        worst_run: Result digest of the worst run.
        gap: What is missing; empty where the chain reaches a PASS.
    """

    hazard: str = ""
    hazard_asil: str = ""
    goal: str = ""
    goal_asil: str = ""
    fsr: str = ""
    fsr_asil: str = ""
    element: str = ""
    realised_by: str = ""
    measure: str = ""
    threshold_source: str = ""
    scenario: str = ""
    architecture: str = ""
    verdict: str = ""
    margin: float | None = None
    unit: str = ""
    runs: int | None = None
    exercised: int | None = None
    worst_run: str = ""
    gap: str = ""


COLUMNS: Final = tuple(field.name for field in fields(TraceRow))


@dataclass(frozen=True, slots=True)
class TraceGroup:
    """What one thing of the matrix is linked to.

    Attributes:
        id: Of the thing.
        links: Ids by the other columns.
        verdicts: How many rows' cells have which verdict.
        gaps: What is missing, each once.
    """

    id: str
    links: dict[By, tuple[str, ...]]
    verdicts: dict[str, int]
    gaps: tuple[str, ...]


def matrix_of(report: Report, by: By = "hazard") -> tuple[TraceRow, ...]:
    """List every way through the chain, ordered by one of its columns.

    Args:
        report: The report.
        by: Column that the rows are ordered by; within it they keep the order of the concept.
    """
    rows = [*_forwards(report), *_orphans(report)]
    order = _order(report, rows, by)
    rows.sort(key=lambda row: order[getattr(row, by)])
    return tuple(rows)


def grouped(rows: Iterable[TraceRow], by: By) -> tuple[TraceGroup, ...]:
    """Gather what each thing of a column is linked to."""
    groups: dict[str, list[TraceRow]] = {}
    for row in rows:
        groups.setdefault(getattr(row, by), []).append(row)
    return tuple(_group(name, found, by) for name, found in groups.items())


def render_csv(rows: Sequence[TraceRow], by: By) -> str:
    """Write the rows as comma-separated values, the column that they are ordered by first."""
    names = (by, *(name for name in COLUMNS if name != by))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    for row in rows:
        writer.writerow([csv_cell(getattr(row, name)) for name in names])
    return text.getvalue()


def _forwards(report: Report) -> Iterator[TraceRow]:
    for hazard in report.hazards:
        goals = [goal for goal in report.goals if hazard.id in goal.hazards]
        start = TraceRow(hazard=hazard.id, hazard_asil=hazard.asil or "none")
        if not goals:
            needs = hazard.asil not in {None, "QM"}
            gap = "no safety goal" if needs else ""
            yield _with(start, gap=gap)
        for goal in goals:
            yield from _of_goal(report, start, goal)


def _of_goal(report: Report, start: TraceRow, goal: SafetyGoal) -> Iterator[TraceRow]:
    row = _with(start, goal=goal.id, goal_asil=goal.asil)
    serving = [item for item in report.fsrs if goal.id in item.goals]
    if not serving:
        yield _with(row, gap="no FSR")
    for fsr in serving:
        yield from _of_fsr(report, row, fsr)


def _of_fsr(report: Report, start: TraceRow, fsr: Fsr) -> Iterator[TraceRow]:
    row = _with(
        start,
        fsr=fsr.id,
        fsr_asil=fsr.asil,
        measure=fsr.formula,
        threshold_source=fsr.threshold_source,
    )
    for element in fsr.allocation or ("",):
        for scenario in judged_in(report, fsr):
            for architecture in report.architectures:
                yield _judged(report, row, (fsr, element, scenario.id, architecture))


def _judged(report: Report, row: TraceRow, at: tuple[Fsr, str, str, Architecture]) -> TraceRow:
    fsr, element, scenario, architecture = at
    parts = [
        part
        for item in report.elements
        if item.id == element
        for part in item.realised_by
        if part.startswith(f"{architecture.id}.")
    ]
    cell = report.cell(fsr.id, architecture.id, scenario)
    row = _with(
        row,
        element=element,
        realised_by=" ".join(parts),
        scenario=scenario,
        architecture=architecture.id,
    )
    if cell is None:
        return _with(row, verdict=Verdict.NOT_RUN.value, gap="not run")
    verdict = "NOT_APPLICABLE" if cell.verdict is None else cell.verdict.value
    gaps = [] if element else ["no element"]
    if cell.verdict is not Verdict.PASS:
        gaps.append(verdict.lower().replace("_", " "))
    elif waived := [word.lower().replace("_", " ") for word in cell.waived]:
        gaps.append(f"{' and '.join(waived)}, waived")
    gaps += _over_all(report, fsr, architecture)
    return _with(
        row,
        verdict=verdict,
        margin=cell.margin.value if cell.margin and margin_text(cell) else None,
        unit=cell.margin.unit if cell.margin and margin_text(cell) else "",
        runs=cell.runs,
        exercised=cell.exercised,
        worst_run=cell.worst_run or "",
        gap=", ".join(gaps),
    )


def _over_all(report: Report, fsr: Fsr, architecture: Architecture) -> list[str]:
    """Say what an FSR is over all scenarios where each by itself is enough."""
    whole = report.cell(fsr.id, architecture.id)
    cells = [report.cell(fsr.id, architecture.id, item.id) for item in judged_in(report, fsr)]
    if whole is None or whole.verdict in {None, Verdict.PASS}:
        return []
    if any(item is None or item.verdict is not Verdict.PASS for item in cells):
        return []
    return [f"{str(whole.verdict).lower()} over all scenarios ({whole.exercised_text})"]


def _orphans(report: Report) -> Iterator[TraceRow]:
    """Find what no chain from a hazardous event passes through."""
    for goal in report.goals:
        if not any(hazard.id in goal.hazards for hazard in report.hazards):
            empty = TraceRow(gap="no hazardous event")
            yield from _of_goal(report, empty, goal)
    allocated = {name for item in report.fsrs for name in item.allocation}
    for element in report.elements:
        if element.id not in allocated:
            parts = " ".join(element.realised_by)
            yield TraceRow(element=element.id, realised_by=parts, gap="no FSR is allocated to it")
    judged = {item.id for fsr in report.fsrs for item in judged_in(report, fsr)}
    for scenario in report.scenarios:
        if scenario.id not in judged:
            yield TraceRow(scenario=scenario.id, gap="no FSR is judged in it")


def _with(row: TraceRow, **changes: str | float | None) -> TraceRow:
    known = {name: getattr(row, name) for name in COLUMNS}
    gaps = [text for text in (row.gap, str(changes.get("gap", ""))) if text]
    return TraceRow(**(known | changes | {"gap": ", ".join(dict.fromkeys(gaps))}))


def _order(report: Report, rows: Sequence[TraceRow], by: By) -> dict[str, int]:
    parts: dict[By, Sequence[Hazard | SafetyGoal | Fsr | Architecture | object]] = {
        "hazard": report.hazards,
        "goal": report.goals,
        "fsr": report.fsrs,
        "element": report.elements,
        "scenario": report.scenarios,
        "architecture": report.architectures,
    }
    names = [str(getattr(item, "id", "")) for item in parts.get(by, ())]
    names += [getattr(row, by) for row in rows]
    # What belongs to nothing of the column stands at its end.
    order = {name: at for at, name in enumerate(dict.fromkeys(filter(None, names)))}
    return order | {"": len(order)}


def _group(name: str, rows: Sequence[TraceRow], by: By) -> TraceGroup:
    links = {
        column: tuple(dict.fromkeys(filter(None, (getattr(row, column) for row in rows))))
        for column in BY
        if column != by
    }
    cells = dict.fromkeys((r.fsr, r.scenario, r.architecture, r.verdict) for r in rows if r.verdict)
    verdicts: dict[str, int] = {}
    for *_, verdict in cells:
        verdicts[verdict] = verdicts.get(verdict, 0) + 1
    gaps = tuple(dict.fromkeys(_gap(row) for row in rows if row.gap))
    return TraceGroup(name, links, verdicts, gaps)


def _gap(row: TraceRow) -> str:
    at = "/".join(filter(None, (row.fsr, row.architecture, row.scenario)))
    return f"{row.gap} ({at})" if at else row.gap
