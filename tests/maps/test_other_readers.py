"""Our lanes against what other readers see, kept in ``tests/content/maps/golden``.

How the tables came about, and where these readers differ on purpose, says ``write_golden.py``.
"""

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from adeye.maps import lanes
from adeye.maps.opendrive_reader import read_opendrive

ROOT = Path(__file__).resolve().parents[2]
CONTENT = ROOT / "tests" / "content" / "maps"
THIRD_PARTY = ROOT.parent / "shared" / "data" / "openscenario"
LIMIT = 0.02

with (CONTENT / "golden" / "sumo.csv").open(encoding="utf-8") as file:
    COUNTS = {row["map"]: row for row in csv.DictReader(file)}


@cache
def laid(name: str) -> dict[str, lanes.LaidRoad]:
    """Return the roads of a map by id; skip if it is one of others that is not there."""
    folders = (ROOT / "scenarios_db" / "maps", CONTENT)
    found = [path for folder in folders if (path := folder / f"{name}.xodr").exists()]
    found += sorted(THIRD_PARTY.rglob(f"{name}.xodr"))
    if not found:
        pytest.skip(f"{name}.xodr of ASAM's examples is not beside this repository")
    roads = read_opendrive(found[0])[0].roads
    return {number: lanes.laid(road) for number, road in roads.items()}


def golden(name: str, reader: str) -> list[dict[str, str]]:
    with (CONTENT / "golden" / f"{name}.{reader}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def off_line(road: lanes.LaidRoad, strip: lanes.Strip, x: float, y: float) -> float:
    """Return how far a point is from a lane's centre line."""
    start, end = strip.start, strip.end
    for _ in range(4):
        places = np.linspace(start, end, 400)
        line = lanes.along(road, strip.center, places)
        nearest = int(np.hypot(line.x - x, line.y - y).argmin())
        start, end = places[max(nearest - 1, 0)], places[min(nearest + 1, 399)]
    return float(np.hypot(line.x - x, line.y - y).min())


@pytest.mark.parametrize("name", COUNTS)
def test_lanes_are_where_opendrive2lanelet_sees_them(name: str) -> None:
    for row in golden(name, "lanelets"):
        road, s = laid(name)[row["road"]], np.array([float(row["s_m"])])
        (strip,) = (
            strip
            for strips in road.strips
            for strip in strips
            if strip.lane.id == int(row["lane"]) and strip.start <= s[0] < strip.end
        )
        x, y = float(row["x_m"]), float(row["y_m"])
        assert lanes.width_at(strip, s)[0] == pytest.approx(float(row["width_m"]), abs=1e-3)
        if any("oly3" in piece.kind for piece in road.road.geometries):
            assert off_line(road, strip, x, y) < LIMIT, row
        else:
            line = lanes.along(road, strip.center, s)
            assert np.hypot(line.x[0] - x, line.y[0] - y) < 1e-3, row


def is_parallel(road: lanes.LaidRoad, strip: lanes.Strip) -> bool:
    """Tell whether a lane and those within stay as wide as they are, without a lane offset."""
    beside = [
        other
        for other in road.strips[strip.section]
        if abs(other.lane.id) <= abs(strip.lane.id) and other.lane.id * strip.lane.id > 0
    ]
    return not road.road.offsets[:, 1:].any() and not any(s.outer[:, 2:].any() for s in beside)


@pytest.mark.parametrize("name", COUNTS)
def test_lanes_of_one_width_are_where_sumo_sees_them(name: str) -> None:
    seen = 0
    for row in golden(name, "sumo"):
        road = laid(name)[row["road"]]
        strips = {strip.lane.id: strip for strip in road.strips[int(row["section"])]}
        strip = strips[int(row["lane"])]
        if not is_parallel(road, strip):
            continue
        seen += 1
        assert lanes.width_at(strip, np.array([strip.start]))[0] == pytest.approx(
            float(row["width_m"]), abs=1e-3
        )
        assert off_line(road, strip, float(row["x_m"]), float(row["y_m"])) < LIMIT, row
    assert seen or name in {"borders", "sections"}


@pytest.mark.parametrize("name", COUNTS)
def test_counts_and_lengths_are_those_of_sumo(name: str) -> None:
    # It makes no edges of the roads within junctions.
    roads = [road for road in laid(name).values() if not road.road.junction]
    assert sum(len(strips) for road in roads for strips in road.strips) == int(
        COUNTS[name]["lanes"]
    )
    length = 0.0
    for road in roads:
        places = np.linspace(0.0, road.road.length, 1000)
        slope = lanes.value_at(road.road.elevations, places)[1]
        length += float(np.sqrt(1.0 + slope**2).mean()) * road.road.length
    if any(road.road.successor and road.road.successor.element == "junction" for road in roads):
        # Edges end in the middle of their junction.
        return
    # Along a lane offset it goes to and fro between the points of the reference line.
    within = 2e-2 if any(len(road.road.offsets) for road in roads) else 1e-4
    assert float(COUNTS[name]["length_m"]) == pytest.approx(length, rel=within)
