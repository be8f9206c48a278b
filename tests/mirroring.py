"""The mirror image of a file of OpenDRIVE, made of its text: nothing of the product takes part."""

import xml.etree.ElementTree as ET
from pathlib import Path

CUBIC = "abcd"
TURNED = {
    "geometry": ("y", "hdg"),
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "poly3": CUBIC,
    "paramPoly3": ("aV", "bV", "cV", "dV"),
    "laneOffset": CUBIC,
    "border": CUBIC,
    "superelevation": CUBIC,
    "lane": ("id",),
    "predecessor": ("id",),
    "successor": ("id",),
    "laneLink": ("from", "to"),
    "signal": ("t",),
}
OTHERS = {"left": "right", "right": "left"}
RULES = {"RHT": "LHT", "LHT": "RHT"}


def mirror(source: Path, target: Path) -> Path:
    """Write the mirror image of a map, in which traffic keeps to the other side."""
    tree = ET.parse(source)  # noqa: S314 - our own
    for element in tree.iter():
        for name in TURNED.get(element.tag, ()):
            if name in element.attrib:
                element.set(name, _turned(element.attrib[name]))
        element.tag = OTHERS.get(element.tag, element.tag)
        if element.tag == "road":
            element.set("rule", RULES[element.get("rule", "RHT")])
    tree.write(target, "UTF-8")
    return target


def _turned(text: str) -> str:
    return text if float(text) == 0.0 else text[1:] if text.startswith("-") else f"-{text}"
