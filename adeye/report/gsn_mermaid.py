"""A goal structure as Mermaid text, which code hosts draw in Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from adeye.report.gsn import SIGNS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.report.gsn import Argument, GsnNode, NodeKind

_SHAPES: Final[Mapping[NodeKind, tuple[str, str]]] = {
    "goal": ("[", "]"),
    "strategy": ("[/", "/]"),
    "solution": ("((", "))"),
    "context": ("(", ")"),
    "assumption": ("([", "])"),
}
"""Brackets by kind: rectangle, parallelogram, circle, rounded, ellipse."""
_STYLES: Final = (
    "classDef supported fill:#e4f4e8,stroke:#1e7a3c,color:#10301b",
    "classDef undeveloped fill:#f6f1df,stroke:#8a6d00,color:#3a2f00,stroke-dasharray:5 3",
    "classDef defeated fill:#fbe4e2,stroke:#b3261e,color:#410e0b",
    "classDef plain fill:#f2f3f5,stroke:#6b7280,color:#1f2937",
)


def render_mermaid(argument: Argument) -> str:
    """Write an argument as a Mermaid flowchart from left to right."""
    names = {node.id: f"n{number}" for number, node in enumerate(argument.nodes)}
    lines = ["flowchart LR"]
    lines += [f"  {names[node.id]}{_box(node)}" for node in argument.nodes]
    for edge in argument.edges:
        arrow = "-->" if edge.relation == "supported_by" else "-.-"
        lines.append(f"  {names[edge.source]} {arrow} {names[edge.target]}")
    lines += [f"  {style}" for style in _STYLES]
    lines += [f"  class {names[node.id]} {node.state or 'plain'}" for node in argument.nodes]
    return "\n".join(lines) + "\n"


def _box(node: GsnNode) -> str:
    begin, end = _SHAPES[node.kind]
    sign = f"{SIGNS[node.state]} " if node.state else ""
    return f'{begin}"<b>{sign}{quoted(node.title)}</b><br>{quoted(node.text)}"{end}'


def quoted(text: str) -> str:
    """Write text so that Mermaid neither ends the label nor reads markup in it.

    >>> quoted('a "b" <c> #1;')
    'a #quot;b#quot; #lt;c#gt; #35;1;'
    """
    for sign, code in (("#", "#35;"), ('"', "#quot;"), ("<", "#lt;"), (">", "#gt;")):
        text = text.replace(sign, code)
    return " ".join(text.replace("&", "#amp;").split())
