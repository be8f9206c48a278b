"""A goal structure as SVG: a tree from left to right, a column per layer, evidence at the right.

Contexts and assumptions stand below the goal at the left, which they belong to. A goal that serves
several parents stands below the first and has lines from all.
"""

from __future__ import annotations

import textwrap
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.report.gsn import SIGNS
from adeye.report.words import printable

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.report.gsn import Argument, GsnNode, State

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
_COLOURS: Final[Mapping[State, tuple[str, str]]] = {
    "supported": ("#e4f4e8", "#1e7a3c"),
    "undeveloped": ("#f6f1df", "#8a6d00"),
    "defeated": ("#fbe4e2", "#b3261e"),
    "": ("#f2f3f5", "#6b7280"),
}
_LEGEND: Final = (
    "Rectangle: goal. Slanted: strategy. Round ends: evidence. Rounded: context. Oval: assumption. "
    "\N{CHECK MARK} supported by the evidence, \N{MULTIPLICATION X} defeated by it, "
    "\N{WHITE DIAMOND} undeveloped: no evidence that decides."
)


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
    boxes = place_boxes(argument)
    width = max(box.x + box.width for box in boxes.values()) + _MARGIN
    height = max(box.y + box.height / 2.0 for box in boxes.values()) + _MARGIN
    root = ET.Element(
        "svg",
        {
            "xmlns": "http://www.w3.org/2000/svg",
            "width": f"{width:.0f}",
            "height": f"{height:.0f}",
            "viewBox": f"0 0 {width:.0f} {height:.0f}",
            "font-family": "system-ui, sans-serif",
            "font-size": "12",
            "role": "img",
        },
    )
    ET.SubElement(root, "title").text = printable(argument.title)
    ET.SubElement(root, "rect", {"width": "100%", "height": "100%", "fill": "#ffffff"})
    _text(root, (_MARGIN, 22.0), printable(argument.title), {"font-size": "15", **_BOLD})
    _text(root, (_MARGIN, 40.0), _LEGEND, {"fill": "#4b5563"})
    for edge in argument.edges:
        _draw_edge(root, boxes[edge.source], boxes[edge.target], edge.relation)
    for box in boxes.values():
        _draw_box(root, box)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


_BOLD: Final = {"font-weight": "600"}


def place_boxes(argument: Argument) -> dict[str, Box]:
    """Give every node its place; no two overlap."""
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


def _draw_edge(root: ET.Element, source: Box, target: Box, relation: str) -> None:
    style = {"fill": "none", "stroke": "#6b7280", "stroke-width": "1.2"}
    if relation == "in_context_of":
        if source.x != target.x:
            # An assumption stands at the left once; the goals that rest on it name it in the JSON.
            return
        style |= {"stroke-dasharray": "4 3"}
        x = source.x + 6.0
        path = f"M{x:.1f},{source.y:.1f} L{x:.1f},{target.y:.1f}"
        ET.SubElement(root, "path", {"d": path, **style})
        return
    begin, end = source.x + source.width, target.x
    middle = end - _GAP_X / 2.0
    path = f"M{begin:.1f},{source.y:.1f} H{middle:.1f} V{target.y:.1f} H{end:.1f}"
    ET.SubElement(root, "path", {"d": path, **style})


def _draw_box(root: ET.Element, box: Box) -> None:
    fill, stroke = _COLOURS[box.node.state]
    group = ET.SubElement(root, "g", {"id": box.node.id})
    ET.SubElement(group, "title").text = printable(box.node.id)
    style = {"fill": fill, "stroke": stroke, "stroke-width": "1.3"}
    if box.node.state == "undeveloped":
        style |= {"stroke-dasharray": "5 3"}
    top = box.y - box.height / 2.0
    if box.node.kind == "strategy":
        x, end, low, slant = box.x, box.x + box.width, box.y + box.height / 2.0, 9.0
        points = f"{x + slant:.1f},{top:.1f} {end:.1f},{top:.1f} "
        points += f"{end - slant:.1f},{low:.1f} {x:.1f},{low:.1f}"
        ET.SubElement(group, "polygon", {"points": points, **style})
    else:
        round_ = {"goal": 0.0, "context": 10.0}.get(box.node.kind, box.height / 2.0)
        place = {
            "x": f"{box.x:.1f}",
            "y": f"{top:.1f}",
            "width": f"{box.width:.1f}",
            "height": f"{box.height:.1f}",
            "rx": f"{min(round_, 22.0):.1f}",
        }
        ET.SubElement(group, "rect", place | style)
    inset = 13.0 if box.node.kind in {"strategy", "solution", "assumption"} else _PAD
    for number, line in enumerate(box.lines):
        y = top + _PAD + _LINE * number + 11.0
        bold = _BOLD if line.startswith("\0") else {}
        _text(group, (box.x + inset, y), line.removeprefix("\0"), {"fill": "#111827", **bold})


def _text(parent: ET.Element, at: tuple[float, float], text: str, style: dict[str, str]) -> None:
    place = {"x": f"{at[0]:.1f}", "y": f"{at[1]:.1f}"}
    ET.SubElement(parent, "text", place | style).text = text
