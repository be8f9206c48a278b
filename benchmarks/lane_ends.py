"""Do drivers on rails pass the end of a lane, and a narrow bend, as those of SUMO do?

Both have IDM with the same parameters, the same vehicles at the same places, and steps of 0.1 s. At
the end of a lane 40 vehicles on two lanes become one row; in the bend 30 vehicles follow each other
on one lane. Where two ramps come in a row, 12 vehicles on each join 28 on two lanes. *Flow* is that
behind the narrow place; *queue* the most vehicles at once that drive at less than half of the speed
that they want; *crawl* those of less than 5 m/s; *time* what the mean vehicle takes to get there.

SUMO slows down for a limit of the bend, as it knows nothing of bends, and changes lanes by LC2013.
Its drivers fit themselves together further upstream, at higher speeds: half as many crawl at the
end of a lane. Flow, queue and time are the same within 10 %.

Needs sumo and netconvert: pip install eclipse-sumo

    python benchmarks/lane_ends.py            the whole measurement
    python benchmarks/lane_ends.py --smoke    the same, as it is short
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from adeye.kernel.traffic import network as n
from adeye.kernel.traffic import rails as k
from benchmarks.support.rail_scenes import WIDTH, Car, Lines, Strip, lanes, lay

STEP_S = 0.1
SECONDS = 240.0
QUEUE_MPS = 12.5
CRAWL_MPS = 5.0
RADIUS_M = 50.0
BEND_MPS = (k.LATERAL_COMFORT * (RADIUS_M - 0.5 * WIDTH)) ** 0.5


@dataclass(frozen=True)
class Place:
    """A narrow place.

    Attributes:
        lines: For drivers on rails.
        edges: For SUMO: lanes, length [m] and limit [m/s] of each piece, one behind the other.
        cars: That come to it.
        behind: Where the flow is counted [m].
        ramps: From where to which piece each leads that comes in from the right [m], and its limit
            [m/s]; who starts in the rightmost lane is on one.
    """

    lines: Lines
    edges: tuple[tuple[int, float, float], ...]
    cars: tuple[Car, ...]
    behind: float
    ramps: tuple[tuple[float, int, float], ...] = ()


APART = Strip(WIDTH, WIDTH, way=0.0)
"""Between a ramp and the lanes that it is not yet beside."""
RAMPS = ((0.0, 1, 20.0), (900.0, 3, 8.0))


def _ramp(limit: float) -> list[Strip]:
    return [*lanes(0, limit=limit), APART, *lanes(1, 2)]


PLACES = {
    "lane end": Place(
        Lines([(2000.0, 0.0)], [(0.0, lanes(0, 1)), (1200.0, lanes(1))]),
        ((2, 1200.0, 60.0), (1, 800.0, 60.0)),
        tuple(
            Car(20.0 + 15.0 * i, (i % 2 + 0.5) * WIDTH, 20.0, 25.0, timer=i * 0.37 % 1.0)
            for i in range(40)
        ),
        1500.0,
    ),
    "bend": Place(
        Lines([(1000.0, 0.0), (100.0, 1.0 / RADIUS_M), (900.0, 0.0)], [(0.0, lanes(0))]),
        ((1, 1000.0, 60.0), (1, 100.0, BEND_MPS), (1, 900.0, 60.0)),
        tuple(Car(20.0 + 30.0 * i, 0.5 * WIDTH, 20.0, 25.0) for i in range(30)),
        1400.0,
    ),
    "two ramps": Place(
        Lines(
            [(2500.0, 0.0)],
            [
                (0.0, _ramp(RAMPS[0][2])),
                (600.0, lanes(0, 1, 2)),
                (850.0, lanes(1, 2)),
                (900.0, _ramp(RAMPS[1][2])),
                (1400.0, lanes(0, 1, 2)),
                (1650.0, lanes(1, 2)),
            ],
        ),
        ((2, 600.0, 60.0), (3, 250.0, 60.0), (2, 550.0, 60.0), (3, 250.0, 60.0), (2, 850.0, 60.0)),
        tuple(
            Car(20.0 + 20.0 * i, (i % 2 + 1.5) * WIDTH, 20.0, 25.0, timer=i * 0.37 % 1.0)
            for i in range(28)
        )
        + tuple(
            Car(begin + 40.0 * i, 0.5 * WIDTH, speed, 25.0, timer=i * 0.37 % 1.0)
            for begin, speed in ((20.0, 15.0), (920.0, 8.0))
            for i in range(12)
        ),
        1900.0,
        RAMPS,
    ),
}


class Count:
    """What is counted of a place."""

    def __init__(self, place: Place) -> None:
        self._behind = place.behind
        self._passed: dict[int, float] = {}
        self._queue = self._crawl = 0

    def look(self, tick: int, places: list[tuple[int, float, float]]) -> None:
        """Look at number, place [m] and speed [m/s] of all vehicles."""
        self._queue = max(self._queue, sum(bool(speed < QUEUE_MPS) for _, _, speed in places))
        self._crawl = max(self._crawl, sum(bool(speed < CRAWL_MPS) for _, _, speed in places))
        for who, s, _ in places:
            if s >= self._behind:
                self._passed.setdefault(who, tick * STEP_S)

    def figures(self) -> dict[str, float]:
        """Return what has been counted."""
        times = sorted(self._passed.values())
        return {
            "passed": len(times),
            "flow_per_h": 3600.0 * (len(times) - 1) / (times[-1] - times[0]),
            "queue": self._queue,
            "crawl": self._crawl,
            "time_s": sum(times) / len(times),
        }


def count_rails(place: Place) -> dict[str, float]:
    """Let drivers on rails pass a place."""
    rails = lay(place.lines, place.cars)
    count = Count(place)
    for tick in range(1, round(SECONDS / STEP_S) + 1):
        k.advance_rails(rails, STEP_S)
        vehicles = rails.vehicles
        count.look(
            tick,
            [(who, row[n.S], row[n.SPEED]) for who, row in enumerate(vehicles)],
        )
    return count.figures()


def write_files(folder: Path, place: Place) -> None:
    """Write the road and the vehicles for SUMO."""
    ends = np.cumsum([0.0, *(length for _, length, _ in place.edges)])
    nodes = "".join(f'<node id="n{i}" x="{x}" y="0"/>' for i, x in enumerate(ends))
    edges = "".join(
        f'<edge id="e{i}" from="n{i}" to="n{i + 1}" numLanes="{count}" speed="{limit}"/>'
        for i, (count, _, limit) in enumerate(place.edges)
    )
    joined = "".join(
        f'<connection from="e{i}" to="e{i + 1}" fromLane="{before[0] - 1 - lane}" '
        f'toLane="{after[0] - 1 - lane}"/>'
        for i, (before, after) in enumerate(zip(place.edges, place.edges[1:], strict=False))
        for lane in range(min(before[0], after[0]))
    )
    for i, (begin, into, limit) in enumerate(place.ramps):
        nodes += f'<node id="m{i}" x="{begin}" y="-20"/>'
        edges += f'<edge id="r{i}" from="m{i}" to="n{into}" numLanes="1" speed="{limit}"/>'
        joined += f'<connection from="r{i}" to="e{into}" fromLane="0" toLane="0"/>'
    parts = {"nodes": ("nod", nodes), "edges": ("edg", edges), "connections": ("con", joined)}
    files = ["netconvert", "--no-internal-links", "--no-turnarounds"]
    for kind, (ending, text) in parts.items():
        (folder / f"road.{ending}.xml").write_text(f"<{kind}>{text}</{kind}>", "utf-8")
    for option, what in zip("nexo", ("nod", "edg", "con", "net"), strict=True):
        files += [f"-{option}", f"road.{what}.xml"]
    subprocess.run(files, cwd=folder, check=True, capture_output=True)  # noqa: S603 - as written
    pieces = [f"e{i}" for i in range(len(place.edges))]
    ways = {"along": pieces} | {
        f"ramp{i}": [f"r{i}", *pieces[into:]] for i, (_, into, _) in enumerate(place.ramps)
    }
    routes = "".join(f'<route id="{way}" edges="{" ".join(w)}"/>' for way, w in ways.items())
    kind = (
        '<vType id="car" carFollowModel="IDM" accel="3" decel="5" emergencyDecel="6" tau="1.5" '
        f'minGap="5" length="4.5" maxSpeed="{place.cars[0].desired}" speedDev="0"/>'
    )
    # SUMO's place is that of the front.
    cars = ""
    for i, car in enumerate(place.cars):
        way, lane, begin = "along", int(car.d / WIDTH) - bool(place.ramps), 0.0
        if lane < 0:
            ramp = sum(begin <= car.s for begin, _, _ in place.ramps) - 1
            way, lane, begin = f"ramp{ramp}", 0, place.ramps[ramp][0]
        cars += (
            f'<vehicle id="{i}" type="car" route="{way}" depart="0" departLane="{lane}" '
            f'departPos="{car.s - begin + 0.5 * car.length}" departSpeed="{car.speed}" '
            'insertionChecks="none"/>'
        )
    text = f"<routes>{kind}{routes}{cars}</routes>"
    (folder / "cars.rou.xml").write_text(text, "utf-8")


def count_sumo(place: Place) -> dict[str, float]:
    """Let SUMO's drivers pass a place."""
    count = Count(place)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_files(folder, place)
        files = ["sumo", "-n", "road.net.xml", "-r", "cars.rou.xml", "--fcd-output", "seen.xml"]
        steps = ["--step-length", str(STEP_S), "--end", str(SECONDS), "--time-to-teleport", "-1"]
        subprocess.run([*files, *steps], cwd=folder, check=True, capture_output=True)  # noqa: S603
        for tick, at in enumerate(ET.parse(folder / "seen.xml").getroot()):  # noqa: S314
            # SUMO's place is that of the front; its road lies along x.
            half = 0.5 * place.cars[0].length
            seen = [(int(c["id"]), float(c["x"]) - half, float(c["speed"])) for c in map(_of, at)]
            count.look(tick, seen)
    return count.figures()


def _of(element: ET.Element) -> dict[str, str]:
    return element.attrib


def measure(_rounds: int, _smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Let both pass every place; nothing is left to chance, so once is enough."""
    if shutil.which("sumo") is None or shutil.which("netconvert") is None:
        sys.exit("lane_ends.py needs sumo and netconvert: pip install eclipse-sumo")
    return [
        {"place": name, "who": who, **count(place)}
        for name, place in PLACES.items()
        for who, count in (("SUMO", count_sumo), ("rails", count_rails))
    ]


FIGURES = ("passed", "flow_per_h", "queue", "crawl", "time_s")
HEADERS = ("place", "vehicles passed", "flow [1/h]", "queue", "crawl", "time [s]")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    figures = (f"{item[name]:,.0f}" for name in FIGURES)
    return [f"{item['place']}, {item['who']}", *figures]


if __name__ == "__main__":
    from support.command import drive

    sys.exit(drive("lane_ends", __doc__, measure, HEADERS, row))
