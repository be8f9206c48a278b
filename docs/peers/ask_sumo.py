"""Ask the SSM device of SUMO for time to collision, decelerations and gaps of pairs that follow.

pip install libsumo==1.28.0 in an environment of its own; python -m docs.peers.ask_sumo

Each pair has a road of one lane to itself and keeps its speeds; the state is what SUMO says of it
when the device measures.
"""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ET
from importlib.metadata import version
from pathlib import Path
from typing import Any

import libsumo

from docs.peers.states import draw, write

COUNT = 1000
ROAD = 2000.0
STEP = 0.1
RESPONSE = 1.0
MEASURES = {"TTC": "ttc", "DRAC": "drac", "MDRAC": "mdrac", "SGAP": "gap", "TGAP": "time_gap"}


def network() -> str:
    """One road of one lane for each pair, all of them beside each other."""
    parts = []
    for k in range(COUNT):
        y = 50.0 * k
        parts.append(
            f'<edge id="r{k}" from="a{k}" to="b{k}" priority="1"><lane id="r{k}_0" index="0" '
            f'speed="100" length="{ROAD}" width="3.5" shape="0,{y} {ROAD},{y}"/></edge>'
        )
    for k in range(COUNT):
        y = 50.0 * k
        parts.append(
            f'<junction id="a{k}" type="dead_end" x="0" y="{y}" incLanes="" intLanes="" '
            f'shape="0,{y - 2} 0,{y + 2}"/>'
            f'<junction id="b{k}" type="dead_end" x="{ROAD}" y="{y}" incLanes="r{k}_0" '
            f'intLanes="" shape="{ROAD},{y - 2} {ROAD},{y + 2}"/>'
        )
    return f'<net version="1.20">{"".join(parts)}</net>'


def routes(rows: list[list[float]], log: Path) -> str:
    """Both vehicles of each pair: a leader of a length, and who follows it at a gap."""
    settings = {
        "measures": " ".join(MEASURES),
        "thresholds": "1e9 0 0 1e9 1e9",
        "mdrac.prt": RESPONSE,
        "range": 1000,
        "file": log,
        "trajectories": "true",
        "write-na": "true",
    }
    told = "".join(f'<param key="device.ssm.{k}" value="{v}"/>' for k, v in settings.items())
    parts = []
    for k, (gap, rear, front, length) in enumerate(rows):
        parts.append(
            f'<vType id="t{k}" length="{length}" minGap="0" maxSpeed="100" speedDev="0"/>'
            f'<route id="w{k}" edges="r{k}"/>'
            f'<vehicle id="f{k}" type="t{k}" route="w{k}" depart="0" '
            f'departPos="{200 + gap + length}" departSpeed="{front}" insertionChecks="none"/>'
            f'<vehicle id="e{k}" type="t{k}" route="w{k}" depart="0" departPos="200"'
            f' departSpeed="{rear}" insertionChecks="none">'
            f'<param key="has.ssm.device" value="true"/>{told}</vehicle>'
        )
    return f"<routes>{''.join(parts)}</routes>"


def drive(folder: Path, rows: list[list[float]]) -> dict[int, dict[str, float | None]]:
    """Drive two steps and read the device's log; the rows become what SUMO says of the state."""
    log = folder / "ssm.xml"
    (folder / "road.net.xml").write_text(network(), "utf-8")
    (folder / "cars.rou.xml").write_text(routes(rows, log), "utf-8")
    files = ["-n", str(folder / "road.net.xml"), "-r", str(folder / "cars.rou.xml")]
    quiet = ["--no-step-log", "--no-warnings", "--precision", "14", "--collision.action", "none"]
    libsumo.start(["sumo", *files, *quiet, "--step-length", str(STEP)])
    try:
        libsumo.simulationStep()
        for k, (_, rear, front, _) in enumerate(rows):
            for name, speed in ((f"f{k}", front), (f"e{k}", rear)):
                libsumo.vehicle.setSpeedMode(name, 0)
                libsumo.vehicle.setSpeed(name, speed)
        libsumo.simulationStep()
        for k, row in enumerate(rows):
            own, lead = f"e{k}", f"f{k}"
            places = [libsumo.vehicle.getLanePosition(name) for name in (lead, own)]
            row[0] = places[0] - row[3] - places[1]
            row[1], row[2] = (libsumo.vehicle.getSpeed(name) for name in (own, lead))
    finally:
        libsumo.close()
    return measured(log)


def measured(log: Path) -> dict[int, dict[str, float | None]]:
    """Read the last value of each measure by the number of its pair."""
    found: dict[int, dict[str, float | None]] = {}
    for part in ET.parse(log).getroot():  # noqa: S314 - SUMO's own file
        values = found.setdefault(int((part.get("ego") or "")[1:]), {})
        for child in part:
            measure = MEASURES.get(child.tag.removesuffix("Span"))
            if measure is not None and child.tag.endswith("Span"):
                last = (child.get("values") or "NA").split()[-1]
                values[measure] = None if last == "NA" else float(last)
    return found


def answers() -> dict[str, Any]:
    """Give the states of each measure with its value, null for none."""
    rows = draw(COUNT, [(0.5, 150), (0, 50), (0, 50), (2, 18)])
    with tempfile.TemporaryDirectory() as name:
        found = drive(Path(name), rows)
    names = ["gap", "v_rear", "v_front", "front_length"]
    return {
        measure: (names, [[*row, found[k][measure]] for k, row in enumerate(rows)])
        for measure in MEASURES.values()
    }


if __name__ == "__main__":
    write("sumo", version("libsumo"), answers())
