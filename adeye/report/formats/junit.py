"""JUnit XML for CI: red exactly where the exit code is not 0.

- One suite per architecture of the gate, one test case per mandatory FSR over all scenarios and one
  per mandatory FSR and scenario. FAIL is a failure; every other state that is not PASS is an error,
  also a cell that is missing or not applicable. Nothing is ever skipped.
- VACUOUS in one scenario is neutral while the FSR passes over all scenarios: that is what a fold
  over runs means. The suite's output lists it as not exercised there.
- One test case for each way in which a channel of the architecture failed: an error where the gate
  refuses it.
- One suite ``campaign``: every planned test case accounted for; the exit code.
- FSRs that are not mandatory and architectures outside the gate decide nothing. They are no test
  cases, neither red nor green: the output and the properties of their suites list them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.formats.sarif import judged_in
from adeye.report.gate.baseline import deciding
from adeye.report.gate.decide import GateResult
from adeye.report.model.report import Architecture, Cell, Fsr, Report
from adeye.report.words import binding_sentence, printable, quantity

EPOCH = "1970-01-01T00:00:00"
"""Time stamp of a report that has none; the schema asks for one."""
_Red = Literal["failure", "error"]
_KINDS: Final[dict[ExitCode, _Red | None]] = {ExitCode.OK: None, ExitCode.FAILED: "failure"}
"""What an exit code is; every other one is an error."""


@dataclass(frozen=True, slots=True)
class _Case:
    """One test case; ``kind`` None is green."""

    name: str
    classname: str
    kind: _Red | None
    type: str = ""
    message: str = ""
    text: str = ""


@dataclass(slots=True)
class _Suite:
    name: str
    properties: list[tuple[str, str]] = field(default_factory=list)
    cases: list[_Case] = field(default_factory=list)
    output: list[str] = field(default_factory=list)


def render_junit(report: Report) -> bytes:
    """Write the verdicts as JUnit XML.

    Args:
        report: The report.

    Returns:
        XML that the usual JUnit schema accepts, in UTF-8, the same bytes for the same report.
    """
    return _render(report, _suites(report))


def _suites(report: Report) -> list[_Suite]:
    suites = [_campaign(report)]
    suites += [_gate_suite(report, item) for item in report.architectures if item.is_gate]
    suites += [_compared_suite(report, item) for item in report.architectures if not item.is_gate]
    return suites


def _render(report: Report, suites: Sequence[_Suite]) -> bytes:
    root = ET.Element("testsuites")
    for number, suite in enumerate(suites):
        _write(root, suite, number, report)
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def render_gate(report: Report, result: GateResult) -> bytes:
    """Write the verdicts and what a gate found as JUnit XML.

    Args:
        report: Of the campaign.
        result: Of the gate.

    Returns:
        As of ``render_junit``, with a suite ``gate``: a test case for each finding and one for the
        exit code. What does not decide is green.
    """
    suite = _Suite("gate", [("baseline", result.baseline), ("exit_code", str(result.exit_code))])
    suite.cases.append(_exit_code("gate", result.exit_code, result.message))
    counted = set(deciding(result.findings))
    for item in result.findings:
        kind = _KINDS.get(item.kind.code, "error") if item in counted else None
        name = " ".join(filter(None, (str(item.kind), item.where))) or str(item.kind)
        runs = "\n".join(f"adeye show {run}" for run in item.runs)
        suite.cases.append(_Case(name, "gate", kind, item.kind.name, item.text, runs))
        suite.output.append(str(item))
    return _render(report, [*_suites(report), suite])


def _exit_code(suite: str, code: ExitCode, message: str) -> _Case:
    return _Case("exit_code", suite, _KINDS.get(code, "error"), code.name, message)


def _campaign(report: Report) -> _Suite:
    suite = _Suite("campaign")
    suite.properties = [
        ("odd", report.odd),
        ("odd_digest", report.odd_digest),
        ("campaign", report.campaign),
        ("tool_version", report.tool_version),
        ("numerics_version", report.numerics_version),
        ("exit_code", str(int(report.exit_code))),
        ("command", report.command),
    ]
    complete = 0 < report.planned == report.accounted
    text = f"{report.accounted} of {report.planned} planned test cases are accounted for"
    suite.cases.append(
        _Case("accounted", "campaign", None if complete else "error", "NOT_RUN", text)
    )
    suite.cases.append(_exit_code("campaign", report.exit_code, report.message))
    suite.output = [report.message, text, report.determinism, *report.statements]
    return suite


def _gate_suite(report: Report, architecture: Architecture) -> _Suite:
    suite = _Suite(architecture.id, [("gate", "true"), ("title", architecture.title)])
    for fsr in report.fsrs:
        if not fsr.mandatory:
            cell = report.cell(fsr.id, architecture.id)
            suite.output.append(f"not mandatory: {fsr.id}: {_state(cell)}")
            continue
        overall = report.cell(fsr.id, architecture.id)
        suite.cases.append(_case(architecture.id, fsr, None, overall))
        passes = overall is not None and overall.verdict is Verdict.PASS
        for scenario in (item.id for item in judged_in(report, fsr)):
            cell = report.cell(fsr.id, architecture.id, scenario)
            if passes and cell is not None and cell.verdict is Verdict.VACUOUS:
                suite.output.append(f"not exercised: {fsr.id} in {scenario}")
                suite.cases.append(_Case(fsr.id, f"{architecture.id}.{scenario}", None))
            else:
                suite.cases.append(_case(architecture.id, fsr, scenario, cell))
    for item in report.channel_failures:
        if item.architecture == architecture.id:
            name, place = f"channel {item.channel}", f"{architecture.id}.channels"
            kind: _Red | None = "error" if item.refused else None
            suite.cases.append(_Case(name, place, kind, item.outcome, str(item), item.detail))
    suite.output += _failing(report, architecture)
    return suite


def _failing(report: Report, architecture: Architecture) -> list[str]:
    return [str(item) for item in report.channel_failures if item.architecture == architecture.id]


def _compared_suite(report: Report, architecture: Architecture) -> _Suite:
    suite = _Suite(architecture.id, [("gate", "false"), ("title", architecture.title)])
    suite.output.append(
        f"{architecture.id} is compared and not in the gate: {report.verdict_of(architecture.id)}"
    )
    for fsr in report.fsrs:
        cell = report.cell(fsr.id, architecture.id)
        word = "mandatory" if fsr.mandatory else "not mandatory"
        suite.output.append(f"{fsr.id} ({word}): {_state(cell)}")
        suite.properties.append((f"verdict.{fsr.id}", _verdict_word(cell)))
    suite.output += _failing(report, architecture)
    return suite


def _case(architecture: str, fsr: Fsr, scenario: str | None, cell: Cell | None) -> _Case:
    classname = architecture if scenario is None else f"{architecture}.{scenario}"
    if cell is not None and cell.verdict is Verdict.PASS:
        return _Case(fsr.id, classname, None)
    kind: _Red = "error"
    if cell is not None and cell.verdict is Verdict.FAIL:
        kind = "failure"
    lines = [fsr.text, fsr.formula]
    lines += [f"requirement: {fsr.where}"] if fsr.where else []
    if cell is not None:
        lines += [binding_sentence(cell.binding)] if cell.binding else []
        lines += [cell.note] if cell.note else []
        lines += [f"reproduce: {cell.command}"]
    return _Case(fsr.id, classname, kind, _verdict_word(cell), _state(cell), "\n".join(lines))


def _verdict_word(cell: Cell | None) -> str:
    if cell is None:
        return str(Verdict.NOT_RUN)
    return "NOT_APPLICABLE" if cell.verdict is None else str(cell.verdict)


def _state(cell: Cell | None) -> str:
    if cell is None:
        return "NOT_RUN, no result is recorded"
    text = f"{_verdict_word(cell)}, exercised in {cell.exercised_text} runs"
    if cell.margin is not None:
        text += f", worst margin {quantity(cell.margin.value, cell.margin.unit, signed=True)}"
    if cell.worst_run is not None:
        text += f", run {cell.worst_run}"
    return text


def _write(root: ET.Element, suite: _Suite, number: int, report: Report) -> None:
    kinds = [case.kind for case in suite.cases]
    element = ET.SubElement(
        root,
        "testsuite",
        {
            "name": _token(suite.name),
            "package": _token(report.odd),
            "id": str(number),
            "timestamp": report.created or EPOCH,
            "hostname": "localhost",
            "tests": str(len(kinds)),
            "failures": str(kinds.count("failure")),
            "errors": str(kinds.count("error")),
            "time": "0",
        },
    )
    properties = ET.SubElement(element, "properties")
    for name, value in suite.properties:
        ET.SubElement(properties, "property", {"name": _token(name), "value": printable(value)})
    for case in suite.cases:
        _write_case(element, case)
    ET.SubElement(element, "system-out").text = printable("\n".join(_lines(suite.output)))
    ET.SubElement(element, "system-err").text = ""


def _write_case(suite: ET.Element, case: _Case) -> None:
    names = {"name": _token(case.name), "classname": _token(case.classname), "time": "0"}
    element = ET.SubElement(suite, "testcase", names)
    if case.kind is not None:
        details = {"type": _token(case.type), "message": printable(case.message)}
        ET.SubElement(element, case.kind, details).text = printable(case.text)


def _lines(texts: Iterable[str]) -> list[str]:
    return [text for text in texts if text]


def _token(text: str) -> str:
    """Make a token of the schema: no control characters, single spaces, not empty."""
    return " ".join(printable(text).split()) or "-"
