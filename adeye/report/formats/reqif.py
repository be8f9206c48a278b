"""Goals and FSRs with their verdicts as ReqIF, the exchange format of requirement tools.

An object's identifier depends on the concept's id and its own only, so that an import of the next
campaign updates what the last one brought.

Source:
    OMG, Requirements Interchange Format (ReqIF) 1.2, formal/2016-07-01.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from adeye.identity import digest
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.model.concept import SafetyGoal
from adeye.report.model.report import Fsr, Report
from adeye.report.templates import xml_file, xml_of
from adeye.report.words import margin_text, verdict_word

NAMESPACE: Final = "http://www.omg.org/spec/ReqIF/20110401/reqif.xsd"
EPOCH: Final = "1970-01-01T00:00:00"

GOAL: Final[Mapping[str, Callable[[SafetyGoal], str]]] = {
    "ReqIF.ForeignID": lambda goal: goal.id,
    "ReqIF.Text": lambda goal: goal.text,
    "ASIL": lambda goal: goal.asil,
    "Hazardous events": lambda goal: ", ".join(goal.hazards),
    "Safe state": lambda goal: goal.safe_state,
    "FTTI": lambda goal: "" if goal.ftti_s is None else f"{goal.ftti_s:g} s",
}
FSR: Final[Mapping[str, Callable[[Fsr], str]]] = {
    "ReqIF.ForeignID": lambda fsr: fsr.id,
    "ReqIF.Text": lambda fsr: fsr.text.strip(),
    "ASIL": lambda fsr: fsr.asil,
    "Safety goals": lambda fsr: ", ".join(fsr.goals),
    "Mandatory": lambda fsr: "yes" if fsr.mandatory else "no",
    "Allocation": lambda fsr: ", ".join(fsr.allocation),
    "Measure": lambda fsr: fsr.formula,
    "Threshold from": lambda fsr: fsr.threshold_source,
    "Place": lambda fsr: str(fsr.where or ""),
}
"""Attributes of an FSR; one for the verdict of each architecture follows."""


def render_reqif(report: Report) -> bytes:
    """Write safety goals with their FSRs as ReqIF in UTF-8, the same for the same report.

    An FSR that serves several goals is one object, listed below each of them.
    """
    verdicts = {
        verdict_attribute(item.id): partial(_verdict, report, item.id)
        for item in report.architectures
    }
    serving = {
        goal.id: [item for item in report.fsrs if goal.id in item.goals] for goal in report.goals
    }
    root = xml_of(
        "requirements.reqif.j2",
        report=report,
        when=f"{report.created or EPOCH}Z",
        attributes={"goal": GOAL, "fsr": {**FSR, **verdicts}},
        serving=serving,
        key=lambda *parts: f"_{digest([report.concept, *parts])[:32]}",
    )
    root.set("xmlns", NAMESPACE)
    return xml_file(root)


def verdict_attribute(architecture: str) -> str:
    """Name the attribute that holds the verdict for an architecture."""
    return f"Verdict {architecture}"


def _verdict(report: Report, architecture: str, fsr: Fsr) -> str:
    cell = report.cell(fsr.id, architecture)
    if report.exit_code is ExitCode.INTEGRITY:
        return "not known: the results are not as they were written"
    if cell is None:
        return verdict_word(Verdict.NOT_RUN)
    margin = f", worst margin {margin_text(cell)}" if margin_text(cell) else ""
    told = f"{verdict_word(cell.verdict)}, exercised in {cell.exercised_text} runs{margin}"
    waived = [f"{cell.counts[word]:,} {verdict_word(word)}" for word in cell.waived]
    return f"{told}; waived: {', '.join(waived)}" if waived else told
