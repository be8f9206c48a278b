"""Write down where other readers of OpenDRIVE see the lanes of maps, to compare ours with.

    python write_golden.py lanelets MAP.xodr ...            # opendrive2lanelet 1.2.1 (TU Munich)
    python write_golden.py sumo NETCONVERT MAP.xodr ...     # netconvert of eclipse-sumo 1.28.0

Neither is a dependency of anything here; only what they say is kept, in the folder ``golden``.

``NAME.lanelets.csv``: centre and width of each lane at places in each section. It takes the
parameter of a poly3 and of a paramPoly3 for the length along it, so on those its points are on the
same line, but not at the same place of it. Borders are distances to it, to whichever side.

``NAME.sumo.csv``: points of the lanes' centre lines and their one width, which varies in ours where
the file's does; it looks at the lane offset only where the reference line has points. Roads within
junctions are not among its edges, and it knows no direct junctions: they are taken out before.

``sumo.csv``: how many lanes and junctions there are, and how long the roads are, along their slope.
"""

# mypy: ignore-errors
# What reads maps here is the libraries of others, which have no types.

import csv
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

GOLDEN = Path(__file__).resolve().parent / "golden"
PARTS = 40
POINTS = 3

NETCONVERT = (
    "--opendrive.import-all-lanes",
    "--opendrive.curve-resolution=0.2",
    "--opendrive.min-width=0",
    "--offset.disable-normalization",
    "--geometry.min-dist=0",
    "--no-turnarounds",
    "--no-internal-links",
    "--precision=6",
)


def write(name: str, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table."""
    with (GOLDEN / name).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def write_lanelets(path: Path) -> None:
    """Write what opendrive2lanelet makes of a map."""
    from lxml import etree
    from opendrive2lanelet.converter import OpenDriveConverter
    from opendrive2lanelet.opendriveparser.parser import parse_opendrive

    rows = []
    root = without_direct_junctions(path).getroot()
    for border in root.iterfind(".//right/lane/border"):
        # Borders are distances to it.
        border.attrib.update({name: str(-float(border.get(name))) for name in "abcd"})
    text = ET.tostring(root)
    roads = parse_opendrive(etree.fromstring(text)).roads
    spacing = sum(road.length for road in roads) / PARTS
    for road in roads:
        line = OpenDriveConverter.create_reference_border(road.planView, road.lanes.laneOffsets)
        for section in road.lanes.lane_sections:
            groups = OpenDriveConverter.lane_section_to_parametric_lanes(section, line)
            count = max(2, round(section.length / spacing))
            for group in groups:
                number = int(group.id_.split(".")[2])
                for i in range(count):
                    t = section.length * (i + 0.41) / count
                    back = section.length - t if number > 0 else t
                    inner, outer = (group.calc_border(side, back)[0] for side in ("inner", "outer"))
                    x, y = 0.5 * (inner + outer)
                    width = sum((outer - inner) ** 2) ** 0.5
                    values = (f"{v:.4f}" for v in (section.sPos + t, x, y, width))
                    rows.append((road.id, number, *values))
    write(f"{path.stem}.lanelets.csv", ("road", "lane", "s_m", "x_m", "y_m", "width_m"), rows)


def without_direct_junctions(path: Path) -> ET.ElementTree:
    """Return a map without its direct junctions."""
    tree = ET.parse(path)
    root = tree.getroot()
    direct = [joint for joint in root.findall("junction") if joint.get("type") == "direct"]
    numbers = {joint.get("id") for joint in direct}
    for joint in direct:
        root.remove(joint)
    for link in root.findall("road/link"):
        for end in list(link):
            if end.get("elementType") == "junction" and end.get("elementId") in numbers:
                link.remove(end)
    return tree


def write_sumo(netconvert: str, path: Path) -> tuple[str, int, int, str]:
    """Write what netconvert makes of a map, and return the counts."""
    with tempfile.TemporaryDirectory() as folder:
        source, net = Path(folder) / "map.xodr", Path(folder) / "map.net.xml"
        without_direct_junctions(path).write(source)
        command = [netconvert, *NETCONVERT, f"--opendrive-files={source}", f"--output={net}"]
        subprocess.run(command, check=True, capture_output=True)
        root = ET.parse(net).getroot()
    rows, lanes, lengths = [], 0, {}
    for edge in root.findall("edge"):
        if edge.get("function"):
            continue
        road, _, section = edge.get("id").partition("#")
        side = -1 if road.startswith("-") else 1
        road = road.removeprefix("-")
        across = edge.findall("lane")
        lanes += len(across)
        total = lengths.setdefault((road, side), [])
        total.append(float(across[-1].get("length")))
        for index, lane in enumerate(across):
            points = [point.split(",")[:2] for point in lane.get("shape").split()]
            # The ends are cut where edges meet.
            inside = points[1:-1] or [
                [(float(a) + float(b)) / 2 for a, b in zip(*points, strict=True)]
            ]
            for i in range(min(POINTS, len(inside))):
                x, y = inside[i * len(inside) // POINTS]
                number = side * (len(across) - index)
                values = (f"{float(v):.4f}" for v in (x, y, lane.get("width")))
                rows.append((road, int(section or 0), number, *values))
    write(f"{path.stem}.sumo.csv", ("road", "section", "lane", "x_m", "y_m", "width_m"), rows)
    known = {joint.get("id") for joint in ET.parse(path).getroot().findall("junction")}
    junctions = sum(joint.get("id") in known for joint in root.findall("junction"))
    length = sum(
        sum(lengths.get((road, -1), lengths.get((road, 1)))) for road in {r for r, _ in lengths}
    )
    return path.stem, lanes, junctions, f"{length:.2f}"


def main() -> None:
    """Write the tables that the command names."""
    kind, *names = sys.argv[1:]
    if kind == "lanelets":
        for name in names:
            write_lanelets(Path(name))
    else:
        counts = [write_sumo(names[0], Path(name)) for name in names[1:]]
        write("sumo.csv", ("map", "lanes", "junctions", "length_m"), counts)


if __name__ == "__main__":
    main()
