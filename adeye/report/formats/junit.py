"""JUnit XML for CI: red exactly where the exit code is not 0.

- One suite per architecture of the gate, one test case per mandatory FSR and scenario. FAIL is a
  failure; every other state that is not PASS is an error, also a cell that is missing or not
  applicable. Nothing is ever skipped.
- What an FSR is over all scenarios stands in the suite's output. It is a test case of its own only
  where no scenario is red for the same reason, so that a dashboard counts each failure once.
- VACUOUS or a waived verdict in one scenario is neutral while the FSR passes over all scenarios:
  that is what a fold over runs means. The suite's output lists it as not exercised or waived there.
- A FAIL that the gate sets aside is green; the suite's output lists it with the reason.
- One test case for each way in which a channel of the architecture failed: an error where the gate
  refuses it.
- One suite ``campaign``: every planned test case accounted for; the exit code. One suite ``gate``
  where a baseline was compared with.
- FSRs that are not mandatory and architectures outside the gate decide nothing. They are no test
  cases, neither red nor green: the output and the properties of their suites list them.
"""

from __future__ import annotations

from typing import Final

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.formats.sarif import judged_in
from adeye.report.gate.baseline import deciding
from adeye.report.gate.decide import GateResult
from adeye.report.model.report import Architecture, Cell, Fsr, Report
from adeye.report.templates import xml_file, xml_of
from adeye.report.words import printable, quantity

EPOCH = "1970-01-01T00:00:00"
"""Time stamp of a report that has none; the schema asks for one."""
_KINDS: Final = {ExitCode.OK: None, ExitCode.FAILED: "failure"}
"""What an exit code is; every other one is an error."""


def render_junit(report: Report, result: GateResult | None = None) -> bytes:
    """Write the verdicts, and what a gate found, as JUnit XML.

    Args:
        report: Of the campaign.
        result: Of the gate, for a suite ``gate`` with a test case for each finding and one for the
            exit code. What does not decide is green.

    Returns:
        XML that the usual JUnit schema accepts, in UTF-8, the same bytes for the same report.
    """
    root = xml_of(
        "junit.xml.j2",
        report=report,
        result=result,
        deciding=[] if result is None else deciding(result.findings),
        created=report.created or EPOCH,
        red=lambda code: _KINDS.get(code, "error"),
        judged_in=judged_in,
        stands_alone=_stands_alone,
        verdict=_verdict_word,
        state=_state,
        token=_token,
    )
    names = [suite.get("name") for suite in root]
    for number, suite in enumerate(root):
        suite.set("id", str(number))
        # An architecture may be called like a suite of our own, and viewers join what has one name.
        if (name := names[number]) in names[:number]:
            suite.set("name", f"{name} of adeye")
        for count, cases in (
            ("tests", "testcase"),
            ("failures", "testcase/failure"),
            ("errors", "testcase/error"),
        ):
            suite.set(count, str(len(suite.findall(cases))))
    return xml_file(root)


def _stands_alone(report: Report, fsr: Fsr, architecture: Architecture) -> bool:
    """Whether no test case of a scenario says already what an FSR is over all of them."""
    overall = report.cell(fsr.id, architecture.id)
    cells = [report.cell(fsr.id, architecture.id, item.id) for item in judged_in(report, fsr)]
    if overall is not None and overall.in_gate is Verdict.PASS:
        return not cells
    red = {_verdict_word(cell) for cell in cells if cell is None or not cell.is_set_aside}
    return _verdict_word(overall) not in red


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


def _token(text: str) -> str:
    """Make a token of the schema: no control characters, single spaces, not empty."""
    return " ".join(printable(text).split()) or "-"
