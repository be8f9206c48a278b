"""Maps of many lanes: the shipped motorway again and again, each copy beside the one before."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from xml.etree import ElementTree as ET

MAP = Path(__file__).resolve().parents[2] / "scenarios_db" / "maps" / "ramp.xodr"
LANES = 642
"""Of the shipped map, as ``adeye map show`` counts them."""
APART_M = 50_000.0
NUMBERS = 100_000
"""Between the ids of a copy and of the next; none of the map is as large."""
REFERENCES = {
    "road": ("id", "junction"),
    "junction": ("id",),
    "predecessor": ("elementId",),
    "successor": ("elementId",),
    "connection": ("incomingRoad", "connectingRoad", "linkedRoad"),
}
"""By element the attributes that name a road or a junction; ids of lanes stand elsewhere."""


def write_wide(path: Path, least: int) -> int:
    """Write a map of at least so many lanes and return how many it has.

    The first copy has the ids of the shipped map, so that its places keep their keys.
    """
    tree = ET.parse(MAP)  # noqa: S314 - our own map
    root = tree.getroot()
    parts = [part for part in root if part.tag in ("road", "junction")]
    copies = -(-least // LANES)
    for number in range(1, copies):
        for part in parts:
            root.append(_moved(part, number))
    tree.write(path, "utf-8", xml_declaration=True)
    return copies * LANES


def _moved(part: ET.Element, number: int) -> ET.Element:
    """Return a road or a junction as it is in a copy."""
    made = deepcopy(part)
    for element in made.iter():
        for name in REFERENCES.get(element.tag, ()):
            value = element.get(name, "-1")
            if value != "-1":
                element.set(name, str(int(value) + number * NUMBERS))
        if element.tag == "geometry":
            element.set("y", repr(float(element.attrib["y"]) + number * APART_M))
    return made
