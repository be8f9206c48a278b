"""SARIF, which code hosts show beside the lines of the files: the log that every finding goes into.

Source:
    OASIS, Static Analysis Results Interchange Format (SARIF) 2.1.0.

A result stands at the scenario's line in the ODD, with the FSR's line in the concept beside it. It
is an error where it decides the gate, else a warning. An FSR whose precondition never held in one
scenario, but which passes over all of them, is ``notApplicable`` there, as for JUnit; so is one
whose FAIL the gate sets aside.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from adeye.errors import SourceLocation, amount
from adeye.identity import digest
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.concept import uri_of
from adeye.report.model.part import Place
from adeye.report.model.report import Architecture, Cell, Fsr, Report, Scenario
from adeye.report.words import binding_sentence, verdict_word
from adeye.spec.load import odd_of
from adeye.store.read.checking import Checked
from adeye.store.read.totals import ChannelFailure
from adeye.version import __version__

# --- SARIF, which code hosts show beside the lines of the files: the log that every finding goes
# into.

SCHEMA: Final = "https://json.schemastore.org/sarif-2.1.0.json"
FINGERPRINT: Final = "adeye/v1"
"""Name of the fingerprint by which a result is known again."""
HOSTS_FINGERPRINT: Final = "primaryLocationLineHash"
"""Name of the one that code hosts look at; they would compute it from the line otherwise."""
ROOT: Final = "%SRCROOT%"
"""What places are relative to. Where it lies is left out: it differs from machine to machine."""

Level = Literal["error", "warning", "note", "none"]
Kind = Literal["fail", "notApplicable"]


@dataclass(frozen=True, slots=True)
class SarifRule:
    """What is checked.

    Attributes:
        id: Its name.
        text: What it asks for.
        help: What to do where it is broken.
        level: How bad that is unless a result says otherwise.
        properties: More about it.
    """

    id: str
    text: str
    help: str
    level: Level = "error"
    properties: tuple[tuple[str, Any], ...] = ()


@dataclass(frozen=True, slots=True)
class SarifResult:
    """Where a rule is broken.

    Attributes:
        rule: Id of the rule.
        text: What is wrong.
        name: What it is about, as ``kind/id``.
        where: Its place in a file, if that is known; code hosts take no result without one.
        related: Other places with what they are.
        level: How bad it is.
        kind: ``fail``, or ``notApplicable`` where nothing could be evaluated.
        key: What makes it the same result in the next log; none for no fingerprint.
        properties: More about it.
    """

    rule: str
    text: str
    name: str
    where: SourceLocation | Place | None
    related: tuple[tuple[SourceLocation | Place, str], ...] = ()
    level: Level = "error"
    kind: Kind = "fail"
    key: tuple[str, ...] = ()
    properties: tuple[tuple[str, Any], ...] = ()


def sarif_log(rules: Sequence[SarifRule], results: Sequence[SarifResult]) -> dict[str, Any]:
    """Write a log of one run of this program.

    Args:
        rules: Every rule that was asked, each id once.
        results: What was found, in the order in which it is listed.
    """
    numbers = {rule.id: number for number, rule in enumerate(rules)}
    driver = {"name": "adeye", "version": __version__, "rules": [_rule(item) for item in rules]}
    run = {
        "tool": {"driver": driver},
        "originalUriBaseIds": {ROOT: {"description": {"text": "The root of the repository."}}},
        "results": [_result(numbers[item.rule], item) for item in results],
    }
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}


def _rule(item: SarifRule) -> dict[str, Any]:
    made: dict[str, Any] = {
        "id": item.id,
        "shortDescription": {"text": item.text},
        "help": {"text": item.help},
        "defaultConfiguration": {"level": item.level},
    }
    return made | _properties(item.properties)


def _result(number: int, item: SarifResult) -> dict[str, Any]:
    made: dict[str, Any] = {
        "ruleId": item.rule,
        "ruleIndex": number,
        "level": item.level,
        "message": {"text": item.text},
    }
    if item.where is not None:
        name = [{"fullyQualifiedName": item.name}]
        place = {"logicalLocations": name, "physicalLocation": _physical(item.where)}
        made["locations"] = [place]
    if item.kind != "fail":
        made["kind"] = item.kind
    if item.related:
        made["relatedLocations"] = [
            {"id": at, "message": {"text": text}, "physicalLocation": _physical(where)}
            for at, (where, text) in enumerate(item.related)
        ]
    if item.key:
        known = digest(list(item.key))
        made["partialFingerprints"] = {FINGERPRINT: known, HOSTS_FINGERPRINT: f"{known[:16]}:1"}
    return made | _properties(item.properties)


def _physical(where: SourceLocation | Place) -> dict[str, Any]:
    return {
        "artifactLocation": {"uri": uri_of(where.path), "uriBaseId": ROOT},
        "region": {"startLine": where.line, "startColumn": where.column},
    }


def _properties(found: tuple[tuple[str, Any], ...]) -> dict[str, Any]:
    return {"properties": dict(found)} if found else {}


# --- Findings of the integrity rules as SARIF -----------------------------------------------------


def check_sarif(checked: Checked) -> dict[str, Any]:
    """Write what was found as a SARIF log: every rule that was asked, every finding as an error."""
    path = checked.path
    if path is None and checked.campaign is not None:
        provenance = checked.campaign.provenance
        path = odd_of(provenance) if provenance.get("odd_path") else None
    file = None if path is None else SourceLocation(str(path), 1, 1)
    rules = [SarifRule(rule.name, rule.text, rule.remedy) for rule in checked.rules]
    results = [
        SarifResult(
            rule=finding.rule,
            text=f"{finding.id}: {finding.detail}",
            name=f"{finding.part}/{finding.id}",
            where=finding.where or file,
            key=(checked.odd, finding.rule, finding.part, finding.id, finding.detail),
        )
        for rule in checked.rules
        for finding in checked.findings
        if finding.rule == rule.name
    ]
    return sarif_log(rules, results)


# --- Verdicts as SARIF: every FSR is a rule, every scenario in which it does not hold a result ----


def render_sarif(report: Report) -> bytes:
    """Write the verdicts of a report as SARIF 2.1.0 in UTF-8, the same for the same report."""
    text = json.dumps(verdict_sarif(report), indent=1, ensure_ascii=False, allow_nan=False)
    return f"{text}\n".encode()


def verdict_sarif(report: Report) -> dict[str, Any]:
    """Make the log: all FSRs, and each that does not pass, by architecture and scenario."""
    rules, failures = [_fsr_rule(item) for item in report.fsrs], report.channel_failures
    rules += [_failure_rule(name) for name in sorted({item.outcome for item in failures})]
    results = [*_results(report), *(_failure(report, item) for item in failures)]
    if found := [_contact(report, *item) for item in report.touching.items()]:
        rules.append(SarifRule(id=_CONTACT, text="No run ends by a contact.", help=_FORBID))
        results += found
    if report.answer[0] is not ExitCode.OK and all(item.level != "error" for item in results):
        # Whoever sees no result takes it for green.
        rules.append(SarifRule(id=_GATE, text="The gate lets the campaign pass.", help=_ASK))
        results.append(_refusal(report))
    return sarif_log(rules, results)


def _refusal(report: Report) -> SarifResult:
    code, message = report.answer
    # Code hosts take no result without a place.
    where = report.where or next((item.where for item in report.fsrs if item.where), None)
    return SarifResult(
        rule=_GATE,
        text=f"The gate answers {int(code)}: {message}.",
        name=report.odd,
        where=where,
        key=(report.odd, _GATE),
        properties=(("exit_code", int(code)),),
    )


def _contact(report: Report, architecture: str, runs: int) -> SarifResult:
    """Tell of contacts, which are no failure where no FSR forbids them."""
    return SarifResult(
        rule=_CONTACT,
        text=f"Contact in {amount(runs, 'run')} of {architecture}.",
        name=f"{architecture}/{_CONTACT}",
        where=report.where,
        level="note",
        key=(report.odd, _CONTACT, architecture),
        properties=(("architecture", architecture), ("runs", runs)),
    )


_CONTACT: Final = "contact"
_FORBID: Final = "Where none may be, let an FSR say so: always(not contact)"
_GATE: Final = "gate"
_ASK: Final = "Ask adeye gate, which says what to do."


def judged_in(report: Report, fsr: Fsr) -> Iterable[Scenario]:
    """List the scenarios that an FSR is judged in."""
    return (item for item in report.scenarios if not fsr.scenarios or item.id in fsr.scenarios)


def _fsr_rule(fsr: Fsr) -> SarifRule:
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
    of_twins = ("twins",) if item.is_twin else ()
    return SarifResult(
        rule=item.outcome,
        text=f"{item}.",
        name=f"{item.architecture}/{item.channel}",
        where=report.where,
        level="error" if item.refused else "note",
        key=(report.odd, item.outcome, item.architecture, item.channel, *of_twins),
        properties=(
            ("architecture", item.architecture),
            ("channel", item.channel),
            ("runs", item.runs),
            ("refused", item.refused),
            ("detail", item.detail),
        ),
    )


def _results(report: Report) -> Iterator[SarifResult]:
    for architecture in report.gate_first:
        for fsr in report.urgent_first([architecture]):
            yield from _of_pair(report, fsr, architecture)


def _of_pair(report: Report, fsr: Fsr, architecture: Architecture) -> Iterator[SarifResult]:
    overall = report.cell(fsr.id, architecture.id)
    passes = overall is not None and overall.in_gate is Verdict.PASS
    is_shown = False
    for scenario in judged_in(report, fsr):
        cell = report.cell(fsr.id, architecture.id, scenario.id)
        if cell is not None and cell.verdict is Verdict.PASS:
            continue
        if cell is None and overall is not None and overall.verdict is None:
            # It is not run there because it cannot be judged.
            cell = overall
        is_neutral = overall is not None and overall.excuses(cell)
        is_shown = is_shown or not is_neutral
        yield _verdict_result(report, (fsr, architecture, scenario), cell, is_neutral=is_neutral)
    if not passes and not is_shown:
        # Nothing is wrong in any one scenario, but all together are not enough.
        yield _verdict_result(report, (fsr, architecture, None), overall, is_neutral=False)


def _verdict_result(
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
