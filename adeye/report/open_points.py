"""What a reader has to know before relying on verdicts: what is not shown, what it rests on.

Failing, undecided and vacuous FSRs, expired and valid waivers, assumptions, broken integrity rules.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from adeye.evaluation.verdict import Verdict
from adeye.report.concept_parts import OpenPoint
from adeye.report.words import binding_sentence, verdict_word

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from adeye.report.concept_parts import PointKind
    from adeye.report.model import Architecture, Cell, Fsr, Report

KINDS: Final[Mapping[Verdict | None, PointKind]] = {
    Verdict.FAIL: "failing",
    Verdict.ERROR: "error",
    Verdict.INVALID: "invalid",
    Verdict.INCONCLUSIVE: "inconclusive",
    Verdict.NOT_RUN: "not_run",
    Verdict.VACUOUS: "vacuous",
    None: "not_applicable",
}
ORDER: Final[tuple[PointKind, ...]] = (
    *KINDS.values(),
    "channel_failure",
    "finding",
    "waiver",
    "assumption",
)
"""The kinds as they are listed."""


def open_points_of(report: Report) -> tuple[OpenPoint, ...]:
    """List the open points of a report: what the gate hangs on first, then by kind."""
    found = [*_verdicts(report), *_failures(report), *_findings(report)]
    found += [*_waivers(report), *_assumptions(report)]
    return tuple(sorted(found, key=lambda item: (not item.decides, ORDER.index(item.kind))))


def _verdicts(report: Report) -> Iterator[OpenPoint]:
    for architecture in report.architectures:
        for fsr in report.fsrs:
            cell = report.cell(fsr.id, architecture.id)
            if cell is None or cell.verdict is not Verdict.PASS:
                yield _verdict(fsr, architecture, cell, report.command)
                continue
            for scenario in report.scenarios:
                part = report.cell(fsr.id, architecture.id, scenario.id)
                if part is not None and part.verdict is Verdict.VACUOUS:
                    yield OpenPoint(
                        kind="vacuous",
                        subject=fsr.id,
                        architecture=architecture.id,
                        scenario=scenario.id,
                        text=f"not exercised in any of {part.runs:,} runs of this scenario",
                        command=part.command,
                    )


def _verdict(fsr: Fsr, architecture: Architecture, cell: Cell | None, command: str) -> OpenPoint:
    verdict = Verdict.NOT_RUN if cell is None else cell.verdict
    text = verdict_word(verdict)
    if cell is not None:
        parts = [f"{count:,} {verdict_word(state)}" for state, count in cell.counts.items()]
        text += f": {', '.join(parts)}" if parts else ""
        if verdict is Verdict.VACUOUS and cell.min_exercised > 1:
            text += f", exercised in {cell.exercised_text}"
        text += f"; {binding_sentence(cell.binding)}" if cell.binding else ""
        text += f"; {cell.note}" if cell.note else ""
    return OpenPoint(
        kind=KINDS[verdict],
        subject=fsr.id,
        architecture=architecture.id,
        text=text,
        decides=fsr.mandatory and architecture.is_gate,
        command=command if cell is None else cell.command,
    )


def _failures(report: Report) -> Iterator[OpenPoint]:
    for item in report.channel_failures:
        yield OpenPoint(
            kind="channel_failure",
            subject=item.channel,
            architecture=item.architecture,
            text=str(item),
            decides=item.refused > 0,
            command=report.command,
        )


def _findings(report: Report) -> Iterator[OpenPoint]:
    for item in report.findings:
        text = f"{item.text} {item.detail}"
        yield OpenPoint(kind="finding", subject=item.id, text=text, command="adeye check")


def _waivers(report: Report) -> Iterator[OpenPoint]:
    for item in report.waivers:
        state = "expired on" if item.is_expired else "valid until"
        text = f"{item.reason} ({item.author}, {state} {item.expires}, {item.runs:,} runs)"
        yield OpenPoint(kind="waiver", subject=item.fsr, text=text)


def _assumptions(report: Report) -> Iterator[OpenPoint]:
    resting = {
        item.id: [fsr.id for fsr in report.fsrs if item.id in fsr.assumptions]
        for item in report.assumptions
    }
    for item in report.assumptions:
        state = "expired on" if item.is_expired else "valid until"
        text = f"{item.text.strip()} ({item.owner}, {state} {item.valid_until})"
        if resting[item.id]:
            text += f" {', '.join(resting[item.id])} rest on it."
        yield OpenPoint(kind="assumption", subject=item.id, text=text)
