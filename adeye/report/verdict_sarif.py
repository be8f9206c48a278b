"""Verdicts as SARIF: every FSR is a rule, every scenario in which it does not hold a result.

A result stands at the scenario's line in the ODD, with the FSR's line in the concept beside it. It
is an error where it decides the gate, else a warning. An FSR whose precondition never held in one
scenario, but which passes over all of them, is ``notApplicable`` there, as for JUnit.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from adeye.evaluation.verdict import Verdict
from adeye.report.sarif import SarifResult, SarifRule, sarif_log
from adeye.report.words import binding_sentence, verdict_word

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from adeye.report.model import Architecture, Cell, Fsr, Report, Scenario
    from adeye.store.blocking import ChannelFailure


def render_sarif(report: Report) -> bytes:
    """Write the verdicts of a report as SARIF 2.1.0 in UTF-8, the same for the same report."""
    text = json.dumps(verdict_sarif(report), indent=1, ensure_ascii=False, allow_nan=False)
    return f"{text}\n".encode()


def verdict_sarif(report: Report) -> dict[str, Any]:
    """Make the log: all FSRs, and each that does not pass, by architecture and scenario."""
    rules, failures = [_rule(item) for item in report.fsrs], report.channel_failures
    rules += [_failure_rule(name) for name in sorted({item.outcome for item in failures})]
    return sarif_log(rules, (*_results(report), *(_failure(report, item) for item in failures)))


def judged_in(report: Report, fsr: Fsr) -> Iterable[Scenario]:
    """List the scenarios that an FSR is judged in."""
    return (item for item in report.scenarios if not fsr.scenarios or item.id in fsr.scenarios)


def _rule(fsr: Fsr) -> SarifRule:
    properties: tuple[tuple[str, Any], ...] = (
        ("asil", fsr.asil),
        ("goals", list(fsr.goals)),
        ("mandatory", fsr.mandatory),
        ("formula", fsr.formula),
        ("threshold_source", fsr.threshold_source),
        ("tags", [fsr.asil if fsr.asil == "QM" else f"ASIL {fsr.asil}"]),
    )
    return SarifRule(
        id=fsr.id,
        text=fsr.text.strip(),
        help=f"{fsr.formula} (threshold: {fsr.threshold_source})",
        level="error" if fsr.mandatory else "warning",
        properties=properties,
    )


def _failure_rule(outcome: str) -> SarifRule:
    return SarifRule(
        id=outcome,
        text="No channel of an architecture in the gate fails without an FSR that is about it.",
        help="Mend the channel, or allow it in the ODD: gate: {channel_failures: allow}",
    )


def _failure(report: Report, item: ChannelFailure) -> SarifResult:
    return SarifResult(
        rule=item.outcome,
        text=f"{item}.",
        name=f"{item.architecture}/{item.channel}",
        where=report.where,
        level="error" if item.refused else "note",
        key=(report.odd, item.outcome, item.architecture, item.channel),
        properties=(
            ("architecture", item.architecture),
            ("channel", item.channel),
            ("runs", item.runs),
            ("refused", item.refused),
            ("detail", item.detail),
        ),
    )


def _results(report: Report) -> Iterator[SarifResult]:
    for fsr in report.fsrs:
        for architecture in report.architectures:
            yield from _of_pair(report, fsr, architecture)


def _of_pair(report: Report, fsr: Fsr, architecture: Architecture) -> Iterator[SarifResult]:
    overall = report.cell(fsr.id, architecture.id)
    passes = overall is not None and overall.verdict is Verdict.PASS
    is_shown = False
    for scenario in judged_in(report, fsr):
        cell = report.cell(fsr.id, architecture.id, scenario.id)
        if cell is not None and cell.verdict is Verdict.PASS:
            continue
        is_neutral = passes and cell is not None and cell.verdict is Verdict.VACUOUS
        is_shown = is_shown or not is_neutral
        yield _result(report, (fsr, architecture, scenario), cell, is_neutral=is_neutral)
    if not passes and not is_shown:
        # Nothing is wrong in any one scenario, but all together are not enough.
        yield _result(report, (fsr, architecture, None), overall, is_neutral=False)


def _result(
    report: Report,
    of: tuple[Fsr, Architecture, Scenario | None],
    cell: Cell | None,
    *,
    is_neutral: bool,
) -> SarifResult:
    fsr, architecture, scenario = of
    name = "/".join((fsr.id, architecture.id, scenario.id if scenario else "all scenarios"))
    decides = fsr.mandatory and architecture.is_gate
    where = (scenario.where if scenario is not None else fsr.where) or fsr.where or report.where
    related = ((fsr.where, f"{fsr.id} in the concept"),) if fsr.where and scenario else ()
    verdict = Verdict.NOT_RUN if cell is None else cell.verdict
    return SarifResult(
        rule=fsr.id,
        text=_message(fsr, architecture, scenario, cell),
        name=name,
        where=where,
        related=related,
        level="none" if is_neutral else "error" if decides else "warning",
        kind="notApplicable" if is_neutral else "fail",
        key=(report.odd, fsr.id, architecture.id, scenario.id if scenario else ""),
        properties=(
            ("verdict", "NOT_APPLICABLE" if verdict is None else verdict.value),
            ("architecture", architecture.id),
            ("scenario", scenario.id if scenario else None),
            ("gate", architecture.is_gate),
            ("run", None if cell is None else cell.worst_run),
            ("command", None if cell is None else cell.command),
        ),
    )


def _message(
    fsr: Fsr, architecture: Architecture, scenario: Scenario | None, cell: Cell | None
) -> str:
    place = scenario.id if scenario else "all scenarios together"
    if cell is None:
        return f"{fsr.id} is NOT RUN for {architecture.id} in {place}: no result is recorded."
    text = f"{fsr.id} is {verdict_word(cell.verdict)} for {architecture.id} in {place}"
    text += f", exercised in {cell.exercised_text} runs."
    if cell.binding is not None:
        text += f" {binding_sentence(cell.binding)}."
    if cell.note:
        text += f" {cell.note}."
    if cell.worst_run is not None:
        text += f" Worst run {cell.worst_run}; reproduce: {cell.command}"
    return text
