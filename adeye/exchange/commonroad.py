"""A run as CommonRoad: a scenario in XML, and what the ego drove as the solution of its problem.

The library of CommonRoad cannot stand beside that of OSI, so the XML is written here.

Source:
    CommonRoad 2020a, schemas of scenarios and of solutions.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye import signals as columns

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from adeye.exchange.road_lines import RoadLane
    from adeye.exchange.view import Account, RunView

VERSION: Final = "2020a"
_DAY: Final = "1970-01-01"
"""Simulated time has no day, and no clock is read."""
_MODEL: Final = "KS2:SM1"
"""Kinematic single-track model, the middle one of the three known vehicles, first cost function."""
_KINDS: Final = {
    "car": "car",
    "van": "car",
    "truck": "truck",
    "bus": "bus",
    "motorcycle": "motorcycle",
    "cyclist": "bicycle",
    "pedestrian": "pedestrian",
    "building": "building",
    "parked_truck": "parkedVehicle",
    "parked_car": "parkedVehicle",
}
_MARKINGS: Final = {"solid": "solid", "dashed": "dashed", "none": "no_marking"}
NAMES: Final = re.compile(r"(solution_)?ZAM_\w+-1_1_T-1\.xml")
_OWN: Final = re.compile(rb'author="adeye"|<CommonRoadSolution [^>]*date="1970-01-01T00:00:00"')
"""How files begin that were written here."""
_HEAD: Final = 1_000
"""What the files are called that are written."""
_MEET: Final = 1e-3
"""Distance up to which the end of a lane is the beginning of another [m]."""


def benchmark_of(account: Account) -> str:
    """Name the scenario as CommonRoad asks for: a made-up country, and the run as its map."""
    return f"ZAM_Run{account.run[:12]}-1_1_T-1"


def write_commonroad(view: RunView, account: Account, folder: Path) -> None:
    """Write a run into a folder, always the same bytes: the scenario, and the solution.

    Args:
        view: The run.
        account: What is known of it beside its trace.
        folder: It gets both files.
    """
    name = f"{benchmark_of(account)}.xml"
    (folder / name).write_bytes(render_scenario(view, account))
    (folder / f"solution_{name}").write_bytes(render_solution(view, account))


def is_own(file: Path) -> bool:
    """Tell whether a file was written here."""
    with file.open("rb") as stream:
        return _OWN.search(stream.read(_HEAD)) is not None


def render_scenario(view: RunView, account: Account) -> bytes:
    """Write the road, who else is there, and the problem: to come as far as the ego did in time.

    Args:
        view: The run.
        account: What is known of it beside its trace.
    """
    root = ET.Element(
        "commonRoad",
        {
            "timeStepSize": repr(view.trace.layout.context.step),
            "commonRoadVersion": VERSION,
            "author": "adeye",
            "affiliation": "",
            "source": f"run {account.run}",
            "benchmarkID": benchmark_of(account),
            "date": _DAY,
        },
    )
    where = ET.SubElement(root, "location")
    for name, value in (("geoNameId", "-999"), ("gpsLatitude", "999"), ("gpsLongitude", "999")):
        ET.SubElement(where, name).text = value
    ET.SubElement(ET.SubElement(root, "scenarioTags"), "simulated")
    lanes = len(view.road.lanes)
    for number in range(lanes):
        root.append(_lanelet(view, number))
    for index in range(len(view.objects_of)):
        root.append(_obstacle(view, index, 1 + lanes + index))
    root.append(_problem(view, _problem_id(view)))
    return _text(root)


def render_solution(view: RunView, account: Account) -> bytes:
    """Write what the ego drove, told of the middle of its rear axle as the model asks for.

    Args:
        view: The run.
        account: What is known of it beside its trace.
    """
    root = ET.Element(
        "CommonRoadSolution",
        {"benchmark_id": f"{_MODEL}:{benchmark_of(account)}:{VERSION}", "date": f"{_DAY}T00:00:00"},
    )
    driven = ET.SubElement(root, "ksTrajectory", planningProblem=str(_problem_id(view)))
    for row, state in enumerate(view.ego.tolist()):
        x, y, heading, speed, _, steering, _ = state
        added = ET.SubElement(driven, "ksState")
        for name, value in (
            ("x", x - view.rear_axle * math.cos(heading)),
            ("y", y - view.rear_axle * math.sin(heading)),
            ("steeringAngle", steering),
            ("velocity", speed),
            ("orientation", heading),
        ):
            ET.SubElement(added, name).text = repr(value)
        ET.SubElement(added, "time").text = str(row)
    return _text(root)


def _text(root: ET.Element) -> bytes:
    ET.indent(root, " ")
    content: bytes = ET.tostring(root, "UTF-8", xml_declaration=True)
    return content + b"\n"


def _problem_id(view: RunView) -> int:
    return 1 + len(view.road.lanes) + len(view.objects_of)


# --- Lanes ----------------------------------------------------------------------------------------


def _bounds(view: RunView, lane: RoadLane) -> tuple[Any, Any]:
    """Return the left and the right line of a lane (N, 2), in the direction of travel."""
    left, right = (view.road.boundaries[line].places for line in (lane.left, lane.right))
    return (left, right) if lane.is_ahead else (right[::-1], left[::-1])


def _lanelet(view: RunView, number: int) -> ET.Element:
    road, lane = view.road, view.road.lanes[number]
    added = ET.Element("lanelet", id=str(1 + number))
    lines = (lane.left, lane.right) if lane.is_ahead else (lane.right, lane.left)
    for name, places, line in zip(
        ("leftBound", "rightBound"), _bounds(view, lane), lines, strict=True
    ):
        bound = ET.SubElement(added, name)
        for place in places.tolist():
            _point(bound, *place)
        ET.SubElement(bound, "lineMarking").text = _MARKINGS[road.boundaries[line].marking]
    for name, others in (
        ("predecessor", _meeting(view, lane, ends=False)),
        ("successor", _meeting(view, lane, ends=True)),
    ):
        for other in others:
            ET.SubElement(added, name, ref=str(1 + other))
    for name, line in zip(("adjacentLeft", "adjacentRight"), lines, strict=True):
        for other, beside in enumerate(road.lanes):
            if other != number and line in {beside.left, beside.right}:
                way = "same" if beside.is_ahead == lane.is_ahead else "opposite"
                ET.SubElement(added, name, ref=str(1 + other), drivingDir=way)
    ET.SubElement(added, "laneletType").text = "unknown"
    return added


def _meeting(view: RunView, lane: RoadLane, *, ends: bool) -> Iterator[int]:
    """Yield the lanes that go on where a lane ends, or that lead to where it begins."""
    own, theirs = (-1, 0) if ends else (0, -1)
    corners = [bound[own] for bound in _bounds(view, lane)]
    for number, other in enumerate(view.road.lanes):
        if other is not lane and other.is_ahead == lane.is_ahead:
            found = [bound[theirs] for bound in _bounds(view, other)]
            if np.allclose(found, corners, rtol=0.0, atol=_MEET):
                yield number


def _point(parent: ET.Element, x: float, y: float) -> None:
    added = ET.SubElement(parent, "point")
    ET.SubElement(added, "x").text = repr(x)
    ET.SubElement(added, "y").text = repr(y)


# --- Who is there, and where the ego begins -------------------------------------------------------


def _obstacle(view: RunView, index: int, number: int) -> ET.Element:
    is_actor = index < view.actors
    added = ET.Element("dynamicObstacle" if is_actor else "staticObstacle", id=str(number))
    ET.SubElement(added, "type").text = _KINDS.get(view.kind(index), "unknown")
    box = ET.SubElement(ET.SubElement(added, "shape"), "rectangle")
    length, width, _ = view.size(index)
    ET.SubElement(box, "length").text = repr(length)
    ET.SubElement(box, "width").text = repr(width)
    states = view.objects[:, index].tolist()
    if is_actor:
        _state(added, "initialState", 0, states[0])
        driven = ET.SubElement(added, "trajectory")
        for row, state in enumerate(states[1:], 1):
            _state(driven, "state", row, state)
    else:
        _state(added, "initialState", 0, states[0][: columns.OBJECT_HEADING + 1])
    return added


def _state(parent: ET.Element, name: str, row: int, state: list[float]) -> ET.Element:
    """Add a state: x, y and heading, and how it moves where that is known."""
    added = ET.SubElement(parent, name)
    x, y, heading, *motion = state
    _point(ET.SubElement(added, "position"), x, y)
    _exact(added, "orientation", repr(heading))
    _exact(added, "time", str(row))
    for what, value in zip(("velocity", "acceleration"), motion, strict=False):
        _exact(added, what, repr(value))
    return added


def _exact(parent: ET.Element, name: str, text: str) -> None:
    ET.SubElement(ET.SubElement(parent, name), "exact").text = text


def _problem(view: RunView, number: int) -> ET.Element:
    added = ET.Element("planningProblem", id=str(number))
    x, y, heading, speed, _, _, rate = view.ego[0].tolist()
    ahead = view.rear_axle
    rear = [x - ahead * math.cos(heading), y - ahead * math.sin(heading), heading, speed]
    start = _state(added, "initialState", 0, rear)
    _exact(start, "yawRate", repr(rate))
    _exact(start, "slipAngle", "0.0")
    goal = ET.SubElement(added, "goalState")
    time = ET.SubElement(goal, "time")
    ET.SubElement(time, "intervalStart").text = str(view.rows - 1)
    ET.SubElement(time, "intervalEnd").text = str(view.rows - 1)
    return added
