"""The argument of a campaign in the Goal Structuring Notation (GSN): from goals to evidence.

Safety goals and FSRs are goals, the ways to argue for them strategies, verdicts of scenarios are
solutions; ODD, versions and assumptions are contexts and assumptions. The argument is about the
architectures of the gate. It says what the evidence supports, not that it is enough: a safety case
needs more.

Source:
    Assurance Case Working Group, GSN Community Standard, version 3 (2021).

Contexts and assumptions stand below the goal at the left, which they belong to. A goal that serves
several parents stands below the first and has lines from all.
"""

from __future__ import annotations

import json
import textwrap
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Final, Literal

from adeye.errors import amount
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.formats.sarif import judged_in
from adeye.report.model.concept import SafetyGoal
from adeye.report.model.report import Cell, Fsr, Report
from adeye.report.templates import environment, xml_of
from adeye.report.words import binding_sentence, margin_text, printable, verdict_word

# --- The argument of a campaign in the Goal Structuring Notation (GSN): from goals to evidence ----

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
    """Return what a folded verdict does to the claim that the FSR holds."""
    if cell is None or cell.verdict is None:
        return "undeveloped"
    if cell.waived:
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
        # Nothing is wholly argued for on files that do not fit together, or where a gate refuses.
        is_refused = report.answer[0] is not ExitCode.OK
        states += ["undeveloped"] if report.findings or is_refused else []
        gate = ", ".join(self._gate) or "no architecture"
        title = report.concept_title or report.title
        text = f"The functional safety requirements hold for {gate} in the ODD {report.odd}."
        self._add(GsnNode("G-top", "goal", title, text, fold_states(states)))
        for node in self._contexts():
            self._add(node, "G-top", "in_context_of")
        text = "Each goal of the concept."
        self._add(GsnNode("S-top", "strategy", "Argue over safety goals", text), "G-top")
        for goal in report.goals:
            self._goal(goal)
        return Argument(report.title, tuple(self._nodes.values()), tuple(self._edges))

    def _add(self, node: GsnNode, above: str = "", relation: Relation = "supported_by") -> None:
        self._nodes.setdefault(node.id, node)
        if above:
            self._edges.append(GsnEdge(above, node.id, relation))

    def _contexts(self) -> Iterator[GsnNode]:
        report = self._report
        bounds = "; ".join(f"{item.label} {item.value}" for item in report.odd_attributes)
        yield GsnNode("C-odd", "context", f"ODD {report.odd}", bounds or "No bounds are stated.")
        versions = f"adeye {report.tool_version}, numerics {report.numerics_version}"
        text = f"campaign {report.campaign[:12]}, ODD {report.odd_digest[:12]}, "
        text += f"concept {report.concept_digest[:12]}"
        yield GsnNode("C-versions", "context", versions, text)
        code, message = report.answer
        if code is not ExitCode.OK or report.touching:
            title = f"The gate answers {code.value}"
            yield GsnNode("C-gate", "context", title, printable(message))
        if report.findings:
            text = f"{amount(len(report.findings), 'finding')} by adeye check."
            yield GsnNode("C-findings", "context", "Integrity of concept and evidence", text)
        for item in report.assumptions:
            expired = f" Expired on {item.valid_until}." if item.is_expired else ""
            yield GsnNode(f"A-{item.id}", "assumption", item.id, f"{item.text.strip()}{expired}")

    def _serving(self, goal: SafetyGoal) -> list[Fsr]:
        return [item for item in self._report.fsrs if goal.id in item.goals]

    def _goal_state(self, goal: SafetyGoal) -> State:
        """Fold the FSRs that a goal hangs on: the mandatory ones."""
        needed = [item for item in self._serving(goal) if item.mandatory]
        return fold_states([self._fsr_state(item) for item in needed])

    def _fsr_state(self, fsr: Fsr) -> State:
        cells = [self._report.cell(fsr.id, name) for name in self._gate]
        return fold_states([self._state_of(cell) for cell in cells])

    def _state_of(self, cell: Cell | None) -> State:
        """Return the state of a claim; what was altered since supports none, and defeats none."""
        is_altered = self._report.exit_code is ExitCode.INTEGRITY
        return "undeveloped" if is_altered else state_of(cell)

    def _goal(self, goal: SafetyGoal) -> None:
        title = f"{goal.id} ({_asil(goal.asil)})"
        node = GsnNode(f"G-{goal.id}", "goal", title, goal.text, self._goal_state(goal))
        self._add(node, "S-top")
        serving = self._serving(goal)
        if not serving:
            return
        strategy = f"S-{goal.id}"
        text = "Each requirement that the goal was refined into."
        self._add(GsnNode(strategy, "strategy", "Argue over FSRs", text), f"G-{goal.id}")
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
        text = self._faults(fsr)
        self._add(GsnNode(strategy, "strategy", "Argue over scenarios and faults", text), name)
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
        state = self._state_of(cell)
        place = f"{fsr.id}-{architecture}-{scenario}"
        title = f"{architecture} in {scenario}"
        if cell is None:
            node = GsnNode(f"E-{place}", "goal", title, "No result is recorded.", state)
        elif state == "undeveloped":
            text = f"{verdict_word(cell.verdict)}: exercised in {cell.exercised_text}"
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
            node = GsnNode(f"E-{place}", "solution", title, f"{text}.", state, found)
        self._add(node, strategy)


def _asil(asil: str) -> str:
    return "QM" if asil == "QM" else f"ASIL {asil}"


# --- A goal structure as SVG: a tree from left to right, a column per layer, evidence at the
# right.

WIDTHS: Final = (250.0, 190.0, 240.0, 170.0, 320.0, 220.0, 300.0)
"""Of the columns: top goal, strategy, safety goal, strategy, FSR, strategy, evidence."""
_GAP_X: Final = 34.0
_GAP_Y: Final = 10.0
_LINE: Final = 15.0
_PAD: Final = 9.0
_CHARACTER: Final = 6.3
"""Width of a letter of 12 px; a little more than the mean, so that lines fit."""
_MARGIN: Final = 16.0
_HEAD: Final = 54.0


@dataclass(slots=True)
class Box:
    """A node with its place; y is its middle."""

    node: GsnNode
    lines: tuple[str, ...]
    x: float
    width: float
    y: float = 0.0

    @property
    def height(self) -> float:
        """Of the outline."""
        return _LINE * len(self.lines) + 2.0 * _PAD


def render_svg(argument: Argument) -> str:
    """Draw an argument as one SVG that needs nothing else."""
    namespace = '<svg xmlns="http://www.w3.org/2000/svg"'
    return drawing_of(argument).replace("<svg", namespace, 1) + "\n"


def drawing_of(argument: Argument, prefix: str = "") -> str:
    """Draw an argument as an SVG that can stand inside of a page: it names no address.

    Args:
        argument: What is drawn.
        prefix: Beginning of its ids, so that none is one of the page.
    """
    boxes = place_boxes(argument)
    root = xml_of(
        "argument.svg.j2",
        argument=argument,
        boxes=boxes,
        width=max(box.x + box.width for box in boxes.values()) + _MARGIN,
        height=max(box.y + box.height / 2.0 for box in boxes.values()) + _MARGIN,
        signs=SIGNS,
        margin=_MARGIN,
        gap=_GAP_X,
        pad=_PAD,
        leading=_LINE,
        prefix=prefix,
    )
    return ET.tostring(root, encoding="unicode")


def place_boxes(argument: Argument) -> dict[str, Box]:
    """Return the place of every node; no two overlap."""
    children = argument.children()
    nodes = {node.id: node for node in argument.nodes}
    top = argument.nodes[0].id
    depth = {top: 0}
    owned: dict[str, list[str]] = {}
    for node in argument.nodes:
        if node.id not in depth:
            continue
        own = [name for name in children.get(node.id, []) if name not in depth]
        depth |= dict.fromkeys(own, depth[node.id] + 1)
        owned[node.id] = own
    boxes = {name: _box(nodes[name], at) for name, at in depth.items()}
    beside = argument.children("in_context_of").get(top, [])
    _place(top, owned, boxes, _HEAD)
    bottom = boxes[top].y + boxes[top].height / 2.0 + _GAP_Y
    needed = bottom
    for name in beside:
        box = _box(nodes[name], 0)
        box.y = needed + box.height / 2.0
        needed += box.height + _GAP_Y
        boxes[name] = box
    return boxes


def _place(name: str, owned: Mapping[str, list[str]], boxes: dict[str, Box], top: float) -> float:
    """Place a subtree from a height on; returns where it ends."""
    box, own = boxes[name], owned.get(name, [])
    end = top
    for child in own:
        end = _place(child, owned, boxes, end)
    if own:
        first, last = boxes[own[0]], boxes[own[-1]]
        box.y = (first.y + last.y) / 2.0
        lack = top - (box.y - box.height / 2.0)
        if lack > 0.0:
            _shift(name, owned, boxes, lack)
            end += lack
        return max(end, box.y + box.height / 2.0 + _GAP_Y)
    box.y = top + box.height / 2.0
    return top + box.height + _GAP_Y


def _shift(name: str, owned: Mapping[str, list[str]], boxes: dict[str, Box], down: float) -> None:
    boxes[name].y += down
    for child in owned.get(name, []):
        _shift(child, owned, boxes, down)


def _box(node: GsnNode, column: int) -> Box:
    at = min(column, len(WIDTHS) - 1)
    x = _MARGIN + sum(WIDTHS[:at]) + _GAP_X * at
    sign = f"{SIGNS[node.state]} " if node.state else ""
    inset = 26.0 if node.kind in {"strategy", "solution", "assumption"} else 2.0 * _PAD
    letters = int((WIDTHS[at] - inset) / _CHARACTER)
    title = textwrap.wrap(printable(f"{sign}{node.title}"), letters - letters // 10) or [""]
    text = textwrap.wrap(printable(node.text), letters)
    return Box(node, (f"\0{title[0]}", *(f"\0{part}" for part in title[1:]), *text), x, WIDTHS[at])


# --- A goal structure as Mermaid text, which code hosts draw in Markdown --------------------------


def render_mermaid(argument: Argument) -> str:
    """Write an argument as a Mermaid flowchart from left to right."""
    names = {node.id: f"n{number}" for number, node in enumerate(argument.nodes)}
    template = environment("formats", quoted).get_template("argument.mmd.j2")
    return template.render(argument=argument, names=names, signs=SIGNS)


def quoted(text: str) -> str:
    """Write text so that Mermaid neither ends the label nor reads markup in it.

    >>> quoted('a "b" <c> #1;')
    'a #quot;b#quot; #lt;c#gt; #35;1;'
    """
    for sign, code in (("#", "#35;"), ('"', "#quot;"), ("<", "#lt;"), (">", "#gt;")):
        text = text.replace(sign, code)
    return " ".join(text.replace("&", "#amp;").split())
