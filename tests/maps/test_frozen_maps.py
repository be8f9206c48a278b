"""Maps as they are read, compiled and written again, pinned: lanes, links, findings, files."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.maps.carriageway import Lanes
from adeye.maps.lanes import along
from adeye.maps.network import KINDS, Rows, build_of_rows
from adeye.maps.opendrive_reader import read_opendrive
from adeye.maps.outlines import strips_of
from adeye.maps.places import Asked, Place, places_of
from adeye.maps.topology import check_topology
from tests.frozen import assert_frozen, masked
from tests.project import ROOT

CONTENT = ROOT / "tests" / "content" / "maps"
SMALL = ("borders", "direct", "left_hand", "param_poly3", "poly3", "sections")


def numbers(*values: float) -> str:
    """Write numbers to a tenth of a micrometre."""
    return " ".join(f"{round(float(value), 7) + 0.0:.10g}" for value in values)


@pytest.mark.parametrize("name", [*SMALL, "town"])
def test_lanes_of_a_map_are_frozen(name: str) -> None:
    """Each lane with its neighbours and ends, and where its middle and its borders are."""
    folder = CONTENT if name in SMALL else ROOT / "scenarios_db" / "maps"
    drive, losses = read_opendrive(folder / f"{name}.xodr")
    rows = Rows(drive)
    network = build_of_rows(rows)
    lines = [f"loss: {loss}" for loss in losses]
    lines += [f"finding: {finding}" for finding in check_topology(drive)]
    for row, (road, strip) in enumerate(strips_of(rows)):
        if name not in SMALL and row % 7:
            continue
        lines.append(
            f"{network.name(row)}: {KINDS[network.kind[row]]} way {network.way[row]} "
            f"beside {network.left[row]} {network.right[row]} junction {network.junction[row]} "
            f"from {numbers(network.start[row], network.end[row])}"
        )
        at = np.linspace(strip.start, strip.end, 4)
        for word, line in (
            ("middle", strip.center), ("inner", strip.inner), ("outer", strip.outer),
        ):  # fmt: skip
            found = along(road, line, at)
            for x, y, turn, bend in zip(
                found.x, found.y, found.heading, found.curvature, strict=True
            ):
                lines.append(f"  {word} {numbers(x, y, turn, bend)}")
    assert_frozen(f"map_{name}.txt", masked("\n".join(lines), ROOT))


ASKED = {
    "road": Asked("carriageway", 40.0, 120.0),
    "two-way and narrow": Asked("carriageway", 30.0, 90.0, two_way=True, max_radius=120.0),
    "wide, one lane": Asked("carriageway", 60.0, 150.0, lanes=1, min_radius=100.0),
    "of a kind and limit": Asked(
        "carriageway", 50.0, 100.0, road_type="rural", min_speed_limit=20.0
    ),
    "slow": Asked("carriageway", 30.0, 40.0, max_speed_limit=15.0),
    "works": Asked("work_zone", 60.0, 100.0),
    "lane drop": Asked("lane_end", 60.0, 100.0),
    "lane more": Asked("lane_begin", 60.0, 100.0),
    "entry": Asked("entry", 50.0, 100.0, route="entry"),
    "exit": Asked("exit", 100.0, 50.0, route="exit"),
}


def told(place: Place) -> str:
    """Write what a place and its road are."""
    road = place.road
    slabs = [
        f"    from {numbers(start)}: {' | '.join(numbers(*strip) for strip in strips)}"
        for start, strips in road.slabs
    ]
    return "\n".join(
        [
            f"  {place.key}: {place.lanes} lanes {place.road_type}, shoulder and width "
            f"{numbers(place.shoulder, place.lane_width)}, limits "
            f"{numbers(place.speed_limit, place.fastest)}, radius {numbers(place.radius)}, "
            f"guessed {place.is_guessed} {place.is_type_guessed}, heading {numbers(road.heading)}",
            f"    line {' | '.join(numbers(*part) for part in road.line)}",
            *slabs,
        ]
    )


@pytest.mark.parametrize("name", ["rural", "ramp", "town", "sections", "left_hand"])
def test_places_of_a_map_are_frozen(name: str) -> None:
    """Where a stretch of so many metres before and behind is, and why others are none."""
    folder = CONTENT if name in SMALL else ROOT / "scenarios_db" / "maps"
    lanes = Lanes.of(read_opendrive(folder / f"{name}.xodr")[0])
    lines = []
    for word, asked in ASKED.items():
        found = places_of(lanes, name, asked)
        lines.append(f"{word}: {len(found.places)} places, {len(found.refused)} refused")
        lines += [told(place) for place in found.places[:: max(1, len(found.places) // 3)]]
        lines += [f"  no: {item}" for item in list(found.refused)[:6]]
    assert_frozen(f"places_{name}.txt", masked("\n".join(lines), ROOT))
