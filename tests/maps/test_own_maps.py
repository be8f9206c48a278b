"""The maps of the catalogue and of the tests: sound, and what their script draws."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from adeye.maps.carriageway import Lanes
from adeye.maps.opendrive_reader import read_opendrive
from adeye.maps.places import Asked, places_of
from adeye.maps.topology import check_topology

ROOT = Path(__file__).resolve().parents[2]
CATALOGUE = ROOT / "scenarios_db" / "maps"
CONTENT = ROOT / "tests" / "content" / "maps"
MAPS = [
    path
    for folder in (CATALOGUE, CONTENT)
    for path in sorted(folder.glob("*.xodr"))
    if 'vendor="adeye"' in path.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("path", MAPS, ids=lambda path: path.stem)
def test_map_is_taken_whole_and_holds_together(path: Path) -> None:
    drive, losses = read_opendrive(path)
    assert [loss for loss in losses if loss.kind == "repaired"] == []
    assert {finding.severity for finding in check_topology(drive)} <= {"note"}


def test_motorway_has_fifty_places() -> None:
    names = [road.name for road in read_opendrive(CATALOGUE / "ramp.xodr")[0].roads.values()]
    kinds = ("exit", "entry", "works", "a lane ends", "a lane begins", "weaving")
    counts = {kind: sum(kind in name for name in names) for kind in kinds}
    assert sum(counts.values()) >= 50
    assert min(counts.values()) >= 2


@pytest.mark.parametrize(("ramp", "far"), [("exit", (340.0, 120.0)), ("entry", (80.0, 500.0))])
def test_every_ramp_of_the_motorway_has_a_road_over_it(ramp: Any, far: tuple[float, float]) -> None:
    lanes = Lanes.of(read_opendrive(CATALOGUE / "ramp.xodr")[0])
    found = places_of(lanes, "ramp", Asked(ramp, *far, route=ramp))
    assert len(found.places) == 28
    assert not found.refused
    for place in found.places:
        counts = [sum(strip[3] >= 0 for strip in strips) for _, strips in place.road.slabs]
        # The ramp alone at one end, the carriageway at the other.
        assert (counts if ramp == "entry" else counts[::-1])[0] == 1
        assert max(counts) >= 3


def test_maps_are_what_their_script_draws(tmp_path: Path) -> None:
    pytest.importorskip("scenariogeneration")
    script = CATALOGUE / "draw_maps.py"
    subprocess.run([sys.executable, script, tmp_path, tmp_path], check=True)
    drawn = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert drawn == {path.name: path.read_bytes() for path in MAPS}
