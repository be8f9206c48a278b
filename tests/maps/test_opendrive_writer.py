"""OpenDRIVE that is written: it reads as the same records, and lies where adeye's own road does."""

import math
import shutil
import subprocess
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.kernel import road as kernel_road
from adeye.maps import lanes as laid_lanes
from adeye.maps.opendrive import (
    LaneSpeed,
    OpenDrive,
    RoadMark,
    RoadType,
    Signal,
)
from adeye.maps.opendrive_reader import read_opendrive
from adeye.maps.opendrive_writer import losses_of, map_losses, parametric_map, write_opendrive
from adeye.signals import RoadMap
from adeye.simulate.world.roads import join_segments
from tests.drawn_roads import WIDE, crossing, cubics, lane, network, piece, road, section

THIRD_PARTY = sorted(
    (Path(__file__).resolve().parents[3] / "shared" / "data" / "openscenario").rglob("*.xodr")
)
IS_SIGN, IS_LIGHT = False, True


def content(record: Any) -> Any:
    """Return a record as plain values that compare, without the places in its file."""
    if is_dataclass(record):
        names = [item.name for item in fields(record) if item.name not in {"line", "path"}]
        return [(name, content(getattr(record, name))) for name in names]
    if isinstance(record, np.ndarray):
        return record.tolist()
    if isinstance(record, dict):
        return [(key, content(value)) for key, value in record.items()]
    if isinstance(record, tuple):
        return [content(item) for item in record]
    return repr(float(record) if isinstance(record, int) else record)


def again(drive: OpenDrive, folder: Path) -> OpenDrive:
    path = folder / "written.xodr"
    path.write_bytes(write_opendrive(drive))
    return read_opendrive(path)[0]


def everything() -> OpenDrive:
    """Return a map with each thing that records can say."""
    pieces = [
        piece("line", 10.0),
        piece("arc", 10.0, 0.01, pose=(10.0, 0.0, 0.0), s=10.0),
        piece("spiral", 10.0, 0.01, -0.02, pose=(19.98, 0.5, 0.1), s=20.0),
        piece("poly3", 10.0, 0.0, 0.0, 1e-3, 1e-5, pose=(29.9, 1.6, 0.05), s=30.0),
        piece("paramPoly3", 10.0, 0, 1, 0, 0, 0, 0, 1e-3, 0, pose=(39.9, 2.3, 0.05), s=40.0),
    ]
    lanes = section(
        lane(1, borders=cubics((0, 3, 0.1, 0, 0)), type="biking", direction="both"),
        lane(0, type="none", marks=(RoadMark(0.0, "solid", "", 0.12, 1),)),
        lane(
            -1,
            WIDE,
            (20.0, 3.0, -0.01, 0.0, 0.0),
            speeds=(LaneSpeed(0.0, 13.9, 1), LaneSpeed(25.0, 8.3, 1)),
            marks=(RoadMark(0.0, "broken", "both", 0.15, 1), RoadMark(9.0, "none", "", 0.2, 1)),
        ),
    )
    for_one = ((-1, -1),)
    sign = Signal("s<1>", 5.0, -2.5, "+", IS_SIGN, "DE", "274", "-1", 50.0, "km/h", for_one, 1)
    light = Signal("2", 9.0, 0.0, "none", IS_LIGHT, "DE", "1000001", "-1", math.nan, "", (), 1)
    drawn = road(
        pieces,
        lanes,
        id="first & only",
        name='a "name"',
        left_hand=True,
        types=(RoadType(0.0, "town", 13.9, 1), RoadType(20.0, "rural", math.inf, 1)),
        elevations=cubics((0, 100, 0.01, 0, 0)),
        superelevations=cubics((0, 0.02, 0, 0, 0)),
        offsets=cubics((0, 0.5, 0, 0, 0), (10.0, 0.5, 0.01, 0, 0)),
        signals=(sign, light),
    )
    return replace(network(drawn), name="m", geo_reference="+proj=utm +zone=32 <x>")


@pytest.mark.parametrize("drive", [everything(), crossing()], ids=["everything", "crossing"])
def test_what_is_written_reads_as_the_same_records(drive: OpenDrive, tmp_path: Path) -> None:
    assert content(again(drive, tmp_path)) == content(drive)


@pytest.mark.parametrize("path", THIRD_PARTY, ids=lambda path: path.stem)
def test_maps_of_others_read_as_the_same_records_again(path: Path, tmp_path: Path) -> None:
    drive = read_opendrive(path)[0]
    written = again(drive, tmp_path)
    assert content(written) == content(replace(drive, version=written.version))
    assert write_opendrive(written) == write_opendrive(drive)


@pytest.mark.parametrize(
    ("given", "kind", "direction", "minor"),
    [(4, "default", "standard", 6), (4, "direct", "standard", 7), (7, "default", "reversed", 8)],
)
def test_version_is_one_that_can_say_it(given: int, kind: str, direction: str, minor: int) -> None:
    drive = crossing()
    junctions = {"j": replace(drive.junctions["j"], type=kind)}
    only = road([piece("line", 9.0)], section(lane(-1, WIDE, direction=direction)))
    drive = replace(
        drive, version=(1, given), junctions=junctions, roads={**drive.roads, "1": only}
    )
    assert f'revMinor="{minor}"'.encode() in write_opendrive(drive)


# --- The parametric road of a scenario ------------------------------------------------------------


def parametric(
    *pieces: tuple[float, float], shoulder: float = 0.0, verge: float = 0.0, refuges: Any = ()
) -> RoadMap:
    """Return a road of two lanes; pieces are (length, curvature)."""
    segments = np.zeros((1, len(pieces), 5))
    segments[0, :, 3:] = pieces
    join_segments(segments)
    one = np.ones(1)
    return RoadMap(
        segments=segments,
        lane_width=3.5 * one,
        lanes=2,
        shoulder=shoulder * one,
        speed_limit=36.0 * one,
        verge=verge * one,
        refuges=np.array(refuges, float).reshape(1, -1, 5),
        length=1.0 * one,
    )


def as_map(road_map: RoadMap, markings: str = "full") -> OpenDrive:
    return parametric_map(road_map, markings=markings, road_type="motorway", path="s.yaml")


S_CURVE = (100.0, 0.0), (200.0, 1 / 250), (200.0, -1 / 250), (1000.0, 0.0)
BAYS = (0, 200.0, 60.0, 3.0, 30.0), (1, 400.0, 50.0, 5.0, 0.0)


def test_s_curve_lies_where_adeyes_own_road_does(tmp_path: Path) -> None:
    own = parametric(*S_CURVE, shoulder=2.0)
    laid = laid_lanes.laid(again(as_map(own), tmp_path).roads["0"])
    s = np.linspace(0.0, 1500.0, 301)
    centers = {strip.lane.id: strip.center for strip in laid.strips[0]}
    # Lane 0 of adeye is the rightmost one, 3.5 m wide beside the shoulder.
    for line, d in ((laid_lanes.REFERENCE, 0.0), (centers[-2], 1.75), (centers[-1], 5.25)):
        found = laid_lanes.along(laid, line, s)
        expected = np.array([kernel_road.position(own.segments[0], place, d) for place in s])
        assert np.hypot(found.x - expected[:, 0], found.y - expected[:, 1]).max() < 1e-6
        assert np.abs(np.sin(found.heading - expected[:, 2])).max() < 1e-9


@pytest.mark.parametrize("verge", [0.0, 4.0])
def test_bays_and_verge_reach_as_far_as_in_adeye(verge: float, tmp_path: Path) -> None:
    own = parametric((1000.0, 0.0), shoulder=2.0, verge=verge, refuges=BAYS)
    laid = laid_lanes.laid(again(as_map(own), tmp_path).roads["0"])
    s = np.arange(0.25, 1000.0, 0.5)
    strips = {strip.lane.type: strip for strip in laid.strips[0]}
    depth = np.array([kernel_road.refuge_depth(own.refuges[0], place) for place in s])
    assert np.abs(laid_lanes.width_at(strips["parking"], s) - depth).max() < 1e-9
    edge = laid_lanes.value_at(laid.strips[0][-1].outer, s)[0]
    expected = [kernel_road.right_edge(own.ground(0), place) for place in s]
    assert np.abs(edge - expected).max() < 1e-9


def test_what_opendrive_cannot_say_is_a_loss() -> None:
    own = parametric((1000.0, 0.0), verge=1.0, refuges=BAYS)
    assert [loss.element for loss in losses_of(own, "worn")] == [
        "world.road.markings",
        "world.road.bays",
        "world.road.verge",
    ]
    assert not list(losses_of(parametric(*S_CURVE), "full"))
    strips = replace(parametric(*S_CURVE), slabs=np.zeros((1, 1, 4)))
    assert [loss.element for loss in losses_of(strips, "full")] == ["world.road"]


@pytest.mark.parametrize(("kind", "count"), [("default", 0), ("virtual", 1), ("crossing", 1)])
def test_where_a_junction_lies_at_its_road_is_a_loss(kind: str, count: int) -> None:
    drive = crossing()
    drive = replace(drive, junctions={"j": replace(drive.junctions["j"], type=kind)})
    assert len(list(map_losses(drive))) == count


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("qc_opendrive") is None, reason="asam-qc-opendrive is not there")
@pytest.mark.parametrize("name", ["s_curve", "bays", "crossing"])
def test_asam_checker_finds_nothing(name: str, tmp_path: Path) -> None:
    drives = {
        "s_curve": as_map(parametric(*S_CURVE, shoulder=2.0)),
        "bays": as_map(parametric((1000.0, 0.0), verge=4.0, refuges=BAYS)),
        "crossing": replace(crossing(), version=(1, 7)),
    }
    path = tmp_path / "written.xodr"
    path.write_bytes(write_opendrive(drives[name]))
    (tmp_path / "config.xml").write_text(
        f'<Config><Param name="InputFile" value="{path}"/><CheckerBundle application="xodrBundle">'
        '<Param name="resultFile" value="found.xqar"/></CheckerBundle></Config>'
    )
    command = ["qc_opendrive", "-c", "config.xml"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    found = (tmp_path / "found.xqar").read_text()
    assert "<Issue " not in found
    assert found.count('status="completed"') >= 20
