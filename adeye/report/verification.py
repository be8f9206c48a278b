"""The verification table: every FSR for every architecture, from its goals to its evidence.

Failing, undecided and vacuous FSRs, expired and valid waivers, assumptions, broken integrity rules.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from adeye.judge.verdict import WORST_FIRST, Outcome, Verdict
from adeye.report.claims import is_sample
from adeye.report.model.concept import OpenPoint, PointKind, Realisation, VerificationRow
from adeye.report.model.part import Binding, Margin, RunVerdict
from adeye.report.model.report import Architecture, Cell, Factors, Fsr, Report
from adeye.report.page.replay import Event
from adeye.report.words import binding_sentence, margin_text, unit_text, value_text, verdict_word
from adeye.spec.concept import Requirement
from adeye.store.read.bulk import Figures
from adeye.store.records import EventRecord, VerdictRecord

# --- The verification table: every FSR for every architecture, from its goals to its evidence -----


def design_words(design: str) -> str:
    """Name a design of points for people.

    >>> design_words("full_factorial"), design_words("random")
    ('full factorial', 'random sample')
    """
    return f"{design} sample" if is_sample(design) else design.replace("_", " ")


def verification_of(
    report: Report, requirements: Mapping[str, Requirement], designs: Mapping[str, str]
) -> Iterator[VerificationRow]:
    """Write a row for each FSR and architecture, those of the gate first.

    Args:
        report: With its cells.
        requirements: FSRs by id.
        designs: Design of the points by scenario.
    """
    for architecture in sorted(report.architectures, key=lambda item: not item.is_gate):
        for fsr in report.fsrs:
            cell = report.cell(fsr.id, architecture.id)
            item = requirements.get(fsr.id)
            yield VerificationRow.of(
                fsr,
                fsr=fsr.id,
                architecture=architecture.id,
                is_gate=architecture.is_gate,
                metric=_metric(cell, item),
                threshold=fsr.formula if item is None else item.measure,
                value=_value(cell),
                margin=cell.margin if cell is not None and margin_text(cell) else None,
                verdict=None if cell is None else cell.verdict,
                runs=0 if cell is None else cell.runs,
                exercised=0 if cell is None else cell.exercised,
                min_exercised=1 if cell is None else cell.min_exercised,
                design=_design(report, fsr, designs),
                run=None if cell is None else cell.worst_run,
                command=report.command if cell is None else cell.command,
            )


def realisations_of(
    factors: tuple[Factors, ...], designs: Mapping[str, str], figures: Figures
) -> Iterator[Realisation]:
    """Count what became of the planned test cases of each scenario."""
    for item in factors:
        own: Any = figures.of_scenario(item.scenario)
        words = own.outcome.words
        counts = np.bincount(own.outcome.codes, minlength=len(words)).tolist()
        yield Realisation(
            scenario=item.scenario,
            design=design_words(designs.get(item.scenario, "")),
            planned=item.test_cases,
            executed=len(own),
            outcomes={Outcome(word): n for word, n in zip(words, counts, strict=True) if n},
        )


def _metric(cell: Cell | None, item: Requirement | None) -> str:
    if item is not None and item.bound is not None:
        return item.bound.metric
    return "" if cell is None or cell.binding is None else cell.binding.signal


def _value(cell: Cell | None) -> str:
    # Without a margin the value is a truth or a word, and says nothing beside a threshold.
    if cell is None or not margin_text(cell) or cell.binding is None or cell.binding.value is None:
        return ""
    return value_text(cell.binding.value, unit_text(cell.binding.unit))


def _design(report: Report, fsr: Fsr, designs: Mapping[str, str]) -> str:
    names = [item.id for item in report.scenarios if not fsr.scenarios or item.id in fsr.scenarios]
    kinds = dict.fromkeys(design_words(designs[name]) for name in names if name in designs)
    return ", ".join(kinds)


# --- What a reader has to know before relying on verdicts: what is not shown, what it rests on ----

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
    *(KINDS[verdict] for verdict in WORST_FIRST if verdict in KINDS),
    "channel_failure",
    "finding",
    "waiver",
    "assumption",
)
"""The kinds as they are listed."""


def open_points_of(report: Report) -> tuple[OpenPoint, ...]:
    """List the open points of a report: what the gate hangs on first, then by kind."""
    found = [*_verdicts(report), *_others(report)]
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
        decides=fsr.mandatory
        and architecture.is_gate
        and not (cell is not None and cell.is_set_aside),
        command=command if cell is None else cell.command,
    )


def _others(report: Report) -> Iterator[OpenPoint]:
    """List failures of channels, findings, waivers and assumptions."""
    for failure in report.channel_failures:
        yield OpenPoint(
            kind="channel_failure",
            subject=failure.channel,
            architecture=failure.architecture,
            text=str(failure),
            decides=failure.refused > 0,
            command=report.command,
        )
    for item in report.findings:
        text = f"{item.text} {item.detail}"
        yield OpenPoint(kind="finding", subject=item.id, text=text, command="adeye check")
    state = {True: "expired on", False: "valid until"}
    for waiver in report.waivers:
        until = f"{state[waiver.is_expired]} {waiver.expires}"
        text = f"{waiver.reason} ({waiver.author}, {until}, {waiver.runs:,} runs)"
        yield OpenPoint(kind="waiver", subject=waiver.fsr, text=text)
    for part in report.assumptions:
        until = f"{state[part.is_expired]} {part.valid_until}"
        text = f"{part.text.strip()} ({part.owner}, {until})"
        if resting := [fsr.id for fsr in report.fsrs if part.id in fsr.assumptions]:
            text += f" {', '.join(resting)} rest on it."
        yield OpenPoint(kind="assumption", subject=part.id, text=text)


def margin_of(record: VerdictRecord) -> Margin | None:
    """Margin of a verdict, None where there is no number."""
    if record.margin is None:
        return None
    return Margin(value=record.margin, unit=record.unit or "", robustness=record.robustness_low)


def binding_of(record: VerdictRecord) -> Binding | None:
    """Binding predicate of a verdict, None where there is none."""
    if record.predicate is None:
        return None
    return Binding.of(
        record,
        signal=record.signal or "",
        difference=record.margin,
        unit=record.unit or "",
        note=record.detail or "",
        obligation_time_s=None,
    )


def run_verdicts(records: Iterable[VerdictRecord]) -> tuple[RunVerdict, ...]:
    """Verdicts of one run for its replay."""
    return tuple(
        RunVerdict(
            fsr=record.fsr_id,
            verdict=record.verdict,
            margin=margin_of(record),
            binding=binding_of(record),
            note=record.detail or "",
        )
        for record in records
    )


def replay_events(records: Iterable[EventRecord]) -> tuple[Event, ...]:
    """Events of one run for its replay."""
    return tuple(Event.of(item) for item in records)
