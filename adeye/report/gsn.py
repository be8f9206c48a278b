"""The argument of a campaign in the Goal Structuring Notation (GSN): from goals to evidence.

Safety goals and FSRs are goals, the ways to argue for them strategies, verdicts of scenarios are
solutions; ODD, versions and assumptions are contexts and assumptions. The argument is about the
architectures of the gate. It says what the evidence supports, not that it is enough: a safety case
needs more.

Source:
    Assurance Case Working Group, GSN Community Standard, version 3 (2021).
"""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Final, Literal

from adeye.evaluation.verdict import Verdict
from adeye.report.verdict_sarif import judged_in
from adeye.report.words import binding_sentence, margin_text, verdict_word

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from adeye.report.concept_parts import SafetyGoal
    from adeye.report.model import Cell, Fsr, Report

SCHEMA: Final = "adeye/gsn@1"

NodeKind = Literal["goal", "strategy", "solution", "context", "assumption"]
State = Literal["supported", "undeveloped", "defeated", ""]
Relation = Literal["supported_by", "in_context_of"]
SIGNS: Final[dict[State, str]] = {
    "supported": "\N{CHECK MARK}",
    "undeveloped": "\N{WHITE DIAMOND}",
    "defeated": "\N{MULTIPLICATION X}",
    "": "",
}


@dataclass(frozen=True, slots=True)
class GsnNode:
    """An element of the argument.

    Attributes:
        id: Stable from one campaign to the next.
        kind: What it is.
        title: A few words.
        text: What it says.
        state: Of what is claimed: supported by the evidence, defeated by it, or undeveloped (no
            evidence that decides); empty where nothing is claimed.
        evidence: Digest and command of a solution.
    """

    id: str
    kind: NodeKind
    title: str
    text: str
    state: State = ""
    evidence: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class GsnEdge:
    """A relation between two elements, from the claim to what it rests on."""

    source: str
    target: str
    relation: Relation = "supported_by"


@dataclass(frozen=True, slots=True)
class Argument:
    """A goal structure.

    Attributes:
        title: Of the campaign.
        nodes: The top goal first; a node comes after what it supports.
        edges: By source, in the order in which they are drawn.
    """

    title: str
    nodes: tuple[GsnNode, ...]
    edges: tuple[GsnEdge, ...]

    def children(self, relation: Relation = "supported_by") -> dict[str, list[str]]:
        """Targets by source, in order."""
        found: dict[str, list[str]] = defaultdict(list)
        for edge in self.edges:
            if edge.relation == relation:
                found[edge.source].append(edge.target)
        return found


def argument_of(report: Report) -> Argument:
    """Build the argument of a report."""
    return _Builder(report).build()


def render_gsn_json(argument: Argument) -> str:
    """Write an argument as JSON."""
    document = {"schema": SCHEMA, **asdict(argument)}
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def fold_states(states: Sequence[State]) -> State:
    """Fold what a claim rests on: one that is defeated defeats it, nothing supports nothing."""
    if "defeated" in states:
        return "defeated"
    return "undeveloped" if not states or "undeveloped" in states else "supported"


def state_of(cell: Cell | None) -> State:
    """Say what a folded verdict does to the claim that the FSR holds."""
    if cell is None or cell.verdict is None:
        return "undeveloped"
    return {Verdict.PASS: "supported", Verdict.FAIL: "defeated"}.get(  # type: ignore[return-value]
        cell.verdict, "undeveloped"
    )


class _Builder:
    """Collects nodes and edges."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._gate = [item.id for item in report.architectures if item.is_gate]
        self._nodes: dict[str, GsnNode] = {}
        self._edges: list[GsnEdge] = []

    def build(self) -> Argument:
        report = self._report
        states = [self._goal_state(goal) for goal in report.goals]
        # Nothing is wholly argued for on files that do not fit together.
        states += ["undeveloped"] if report.findings else []
        gate = ", ".join(self._gate) or "no architecture"
        self._add(
            GsnNode(
                "G-top",
                "goal",
                report.concept_title or report.title,
                f"The functional safety requirements hold for {gate} in the ODD {report.odd}.",
                fold_states(states),
            )
        )
        for node in self._contexts():
            self._add(node)
            self._edges.append(GsnEdge("G-top", node.id, "in_context_of"))
        self._add(
            GsnNode("S-top", "strategy", "Argue over safety goals", "Each goal of the concept.")
        )
        self._edges.append(GsnEdge("G-top", "S-top"))
        for goal in report.goals:
            self._goal(goal)
        return Argument(report.title, tuple(self._nodes.values()), tuple(self._edges))

    def _add(self, node: GsnNode) -> None:
        self._nodes.setdefault(node.id, node)

    def _contexts(self) -> Iterator[GsnNode]:
        report = self._report
        bounds = "; ".join(f"{item.label} {item.value}" for item in report.odd_attributes)
        yield GsnNode("C-odd", "context", f"ODD {report.odd}", bounds or "No bounds are stated.")
        versions = f"adeye {report.tool_version}, numerics {report.numerics_version}"
        text = f"campaign {report.campaign[:12]}, ODD {report.odd_digest[:12]}, "
        text += f"concept {report.concept_digest[:12]}"
        yield GsnNode("C-versions", "context", versions, text)
        if report.findings:
            yield GsnNode(
                "C-findings",
                "context",
                "Integrity of concept and evidence",
                f"{len(report.findings)} findings by adeye check.",
            )
        for item in report.assumptions:
            expired = f" Expired on {item.valid_until}." if item.is_expired else ""
            yield GsnNode(f"A-{item.id}", "assumption", item.id, f"{item.text.strip()}{expired}")

    def _serving(self, goal: SafetyGoal) -> list[Fsr]:
        return [item for item in self._report.fsrs if goal.id in item.goals]

    def _goal_state(self, goal: SafetyGoal) -> State:
        return fold_states([self._fsr_state(item) for item in self._needed(goal)])

    def _needed(self, goal: SafetyGoal) -> list[Fsr]:
        """FSRs that a goal hangs on: the mandatory ones."""
        return [item for item in self._serving(goal) if item.mandatory]

    def _fsr_state(self, fsr: Fsr) -> State:
        cells = [self._report.cell(fsr.id, name) for name in self._gate]
        return fold_states([state_of(cell) for cell in cells])

    def _goal(self, goal: SafetyGoal) -> None:
        title = f"{goal.id} ({_asil(goal.asil)})"
        self._add(GsnNode(f"G-{goal.id}", "goal", title, goal.text, self._goal_state(goal)))
        self._edges.append(GsnEdge("S-top", f"G-{goal.id}"))
        serving = self._serving(goal)
        if not serving:
            return
        strategy = f"S-{goal.id}"
        text = "Each requirement that the goal was refined into."
        self._add(GsnNode(strategy, "strategy", "Argue over FSRs", text))
        self._edges.append(GsnEdge(f"G-{goal.id}", strategy))
        for fsr in serving:
            self._edges.append(GsnEdge(strategy, f"G-{fsr.id}"))
            if f"G-{fsr.id}" not in self._nodes:
                self._fsr(fsr)

    def _fsr(self, fsr: Fsr) -> None:
        name, word = f"G-{fsr.id}", "" if fsr.mandatory else ", optional"
        title = f"{fsr.id} ({_asil(fsr.asil)}{word})"
        text = f"{' '.join(fsr.text.split())} Allocated to {', '.join(fsr.allocation)}."
        self._add(GsnNode(name, "goal", title, text, self._fsr_state(fsr)))
        for item in fsr.assumptions:
            self._edges.append(GsnEdge(name, f"A-{item}", "in_context_of"))
        scenarios = [item.id for item in judged_in(self._report, fsr)]
        if not scenarios or not self._gate:
            return
        strategy = f"S-{fsr.id}"
        self._add(
            GsnNode(strategy, "strategy", "Argue over scenarios and faults", self._faults(fsr))
        )
        self._edges.append(GsnEdge(name, strategy))
        for architecture in self._gate:
            for scenario in scenarios:
                self._evidence(fsr, architecture, scenario, strategy)

    def _faults(self, fsr: Fsr) -> str:
        names = {item.id for item in judged_in(self._report, fsr)}
        entries = dict.fromkeys(
            entry
            for item in self._report.factors
            if item.scenario in names
            for entry in item.fault_entries
        )
        rows = [row for row in self._report.verification if row.fsr == fsr.id]
        design = f"Design: {rows[0].design}. " if rows and rows[0].design else ""
        return f"{design}Fault entries: {', '.join(entries) or 'none'}."

    def _evidence(self, fsr: Fsr, architecture: str, scenario: str, strategy: str) -> None:
        cell = self._report.cell(fsr.id, architecture, scenario)
        state = state_of(cell)
        place = f"{fsr.id}-{architecture}-{scenario}"
        self._edges.append(GsnEdge(strategy, f"E-{place}"))
        if cell is None:
            text = "No result is recorded."
            node = GsnNode(f"E-{place}", "goal", f"{architecture} in {scenario}", text, state)
        elif state == "undeveloped":
            text = f"{verdict_word(cell.verdict)}: exercised in {cell.exercised_text}"
            title = f"{architecture} in {scenario}"
            node = GsnNode(f"E-{place}", "goal", title, f"{text} runs.", state)
        else:
            text = f"{verdict_word(cell.verdict)}, exercised in {cell.exercised_text} runs"
            text += f", worst margin {margin_text(cell)}" if margin_text(cell) else ""
            found = {
                "evidence_digest": self._report.evidence_digest,
                "fsr_digest": fsr.digest,
                "worst_run": cell.worst_run or "",
                "command": cell.command,
                "binding": binding_sentence(cell.binding) if cell.binding else "",
            }
            title = f"{architecture} in {scenario}"
            node = GsnNode(f"E-{place}", "solution", title, f"{text}.", state, found)
        self._add(node)


def _asil(asil: str) -> str:
    return "QM" if asil == "QM" else f"ASIL {asil}"
