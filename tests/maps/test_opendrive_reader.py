"""OpenDRIVE files: what of them becomes records, what is repaired, and what is told of the rest."""

import math
import re
from collections import Counter
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from adeye.errors import InputError, InputErrors, SpecError
from adeye.maps import lanes
from adeye.maps.losses import Loss, Losses, require_none
from adeye.maps.opendrive import OpenDrive
from adeye.spec.places import read_map
from tests.refusals import refused

SMALL = (Path(__file__).parents[1] / "malformed" / "small.xodr").read_text("utf-8")
THIRD_PARTY = Path(__file__).resolve().parents[3] / "shared" / "data" / "openscenario"

CUBIC = 's="0" a="0.12" b="0" c="0" d="0"'


def read(
    tmp_path: Path, *changes: tuple[str, str], text: str = SMALL
) -> tuple[OpenDrive, list[Loss]]:
    """Read the small map with a text replaced wherever it stands."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "map.xodr"
    path.write_text(text, encoding="utf-8")
    drive, losses = read_map(path)
    return drive, list(losses)


def test_small_map_is_read_without_a_loss(tmp_path: Path) -> None:
    drive, losses = read(tmp_path)
    assert losses == []
    assert (drive.version, drive.name, drive.geo_reference) == (
        (1, 6),
        "small",
        "+proj=utm +zone=32",
    )
    assert {road.id: road.junction for road in drive.roads.values()} == {
        **dict.fromkeys("123", ""),
        "10": "1",
        "11": "1",
    }
    road = drive.roads["1"]
    assert [piece.kind for piece in road.geometries] == [
        *("line", "spiral", "arc", "poly3", "paramPoly3")
    ]
    assert [[lane.id for lane in section.lanes] for section in road.sections] == [
        [1, 0, -1],
        [1, 0, -1, -2],
    ]
    assert road.types[0].limit == pytest.approx(50 / 3.6)
    assert road.sections[0].lanes[2].speeds[0].limit == pytest.approx(30 * 0.44704)
    assert road.signals[0].lanes == ((-2, -1),)
    assert [link.lanes for link in drive.junctions["1"].connections] == [((-1, -1),), ((-2, -1),)]
    assert drive.junctions["1"].priorities == (("10", "11"),)


def test_line_of_each_record_is_where_it_begins(tmp_path: Path) -> None:
    drive, _ = read(tmp_path)
    lines = SMALL.splitlines()
    for road in drive.roads.values():
        assert f'<road id="{road.id}"' in lines[road.line - 1]
        for section in road.sections:
            assert "<laneSection" in lines[section.line - 1]
            assert all(f'<lane id="{item.id}"' in lines[item.line - 1] for item in section.lanes)


@pytest.mark.parametrize(
    ("old", "new", "kind", "said"),
    [
        ('length="100" junction', 'length="100.3" junction', "repaired", "its line ends at 100 m"),
        ('s="60" x', 's="60.3" x', "repaired", "the piece before ends at 60 m: s counts"),
        ('<laneSection s="0">', '<laneSection s="0.3">', "repaired", "its begin counts"),
        ('<laneOffset s="0"', '<laneOffset s="60"', "repaired", "put in order"),
        ('<laneOffset s="50"', '<laneOffset s="0"', "repaired", "a second one"),
        ('<laneOffset s="50"', '<laneOffset s="150"', "repaired", "behind the end"),
        ('<lane id="0" type="none" level="false"/>', "", "repaired", "lane 0 is missing"),
        ('<successor id="1"/>', '<successor id="7"/>', "repaired", "linked to lane 7"),
        ('<laneLink from="-1" to="-1"/>',
         '<laneLink from="-1" to="-1"/><laneLink from="1" to="-5"/>', "repaired", "no lane -5"),
        (' pRange="arcLength"', "", "guessed", "pRange is missing"),
        ('revMinor="6"', 'revMinor="9"', "guessed", "1.9 is read as if it were 1.8"),
        ('type="driving"', 'type="teleport"', "guessed", "'teleport' is not known"),
        ('<laneLink from="-1" to="-1"/>', "", "guessed", "those of one id, -1"),
        ("    <lanes>", f"<lateralProfile><superelevation {CUBIC}/></lateralProfile><lanes>",
         "approximated", "up to 12 %"),
        ("    <lanes>", f"<elevationProfile><elevation {CUBIC}/></elevationProfile><lanes>",
         "approximated", "grades pull"),
    ],
)  # fmt: skip
def test_what_is_not_taken_as_written_is_told(
    tmp_path: Path, old: str, new: str, kind: str, said: str
) -> None:
    drive, losses = read(tmp_path, (old, new))
    assert {loss.kind for loss in losses} == {kind}
    assert said in losses[0].message
    assert len(drive.roads) == 5


def test_unsorted_pieces_are_those_of_the_sorted_file(tmp_path: Path) -> None:
    lines = SMALL.splitlines(keepends=True)
    at = next(number for number, line in enumerate(lines) if "<spiral" in line)
    lines[at], lines[at + 1] = lines[at + 1], lines[at]
    drive, losses = read(tmp_path, text="".join(lines))
    assert [loss.message for loss in losses] == ["road '1': s is 40 after 60: put in order"]
    assert [piece.s for piece in drive.roads["1"].geometries] == [0, 40, 60, 80, 90]


def test_what_is_not_known_is_told_once_for_each_kind_with_its_count(tmp_path: Path) -> None:
    more = '<userData code="x"/><access sOffset="0" rule="allow"/>'
    _, losses = read(tmp_path, ("</lane>", f"{more}</lane>"), ('rule="RHT"', 'rule="RHT" fun="1"'))
    found = {loss.element: loss.count for loss in losses}
    assert found == Counter({
        "road.lanes.laneSection.left.lane.access": 4,
        "road.lanes.laneSection.right.lane.access": 7,
        "road@fun": 5,
    })  # fmt: skip
    assert losses[0].line == 1 + SMALL[: SMALL.index("<road")].count("\n")


def test_strict_refuses_each_loss_at_its_place(tmp_path: Path) -> None:
    path = tmp_path / "map.xodr"
    path.write_text(SMALL.replace('<laneOffset s="50"', '<laneOffset s="150"'), encoding="utf-8")
    with pytest.raises(InputErrors) as raised:
        read_map(path, strict=True)
    line = 1 + SMALL[: SMALL.index('<laneOffset s="50"')].count("\n")
    assert f"{path}:{line}:7: road.lanes.laneOffset" in str(raised.value)


@pytest.mark.parametrize("more", [0, 1, 20])
def test_strict_lists_a_hundred_losses_and_counts_the_others(more: int) -> None:
    losses = [Loss("repaired", line, "road", "put in order") for line in range(100 + more)]
    with pytest.raises(InputErrors) as raised:
        require_none(cast("Losses", losses), "map.xodr")
    assert (len(raised.value.errors), raised.value.unlisted) == (100, more)


RULES = """\
maps:
  map.xodr:
    lane_types: {teleport: driving}
    lanes: {"1/0": [[-2, -1]]}
"""
GUESSED = ('type="driving"', 'type="teleport"'), ('<laneLink from="-1" to="-1"/>', "")


def test_rules_beside_a_map_take_the_place_of_guesses(tmp_path: Path) -> None:
    (tmp_path / "rules.yaml").write_text(RULES, encoding="utf-8")
    drive, losses = read(tmp_path, *GUESSED)
    assert losses == []
    assert drive.roads["1"].sections[0].lanes[0].type == "driving"
    assert drive.junctions["1"].connections[0].lanes == ((-2, -1),)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("teleport: driving", "teleport: flying", "rules.yaml:3:18: lane_types: 'teleport'"),
        ("1/0", "1/1", "rules.yaml:4:13: lanes: '1/1': the map leaves nothing of that name"),
        ("[-2, -1]", "[-2]", "at least 2"),
        ("map.xodr:", "nap.xodr:", "there is no map 'nap.xodr' beside these rules"),
        ("map.xodr:", "./map.xodr:", "rules.yaml:2:3: maps: './map.xodr' is a path"),
        ("lanes:", "limits:", "limits"),
    ],
)
def test_rule_of_no_use_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    (tmp_path / "rules.yaml").write_text(RULES.replace(old, new), encoding="utf-8")
    with pytest.raises((SpecError, InputErrors), match=re.escape(said)):
        read(tmp_path, *GUESSED)


@pytest.mark.parametrize("kind", ["folder", "link"])
def test_rules_that_are_no_file_are_refused(tmp_path: Path, kind: str) -> None:
    rules = tmp_path / "rules.yaml"
    if kind == "folder":
        rules.mkdir()
    else:
        rules.symlink_to("nowhere.yaml")
    refused(InputError, read, tmp_path, says=r"rules\.yaml")


def test_widths_begin_with_their_section_and_borders_give_way(tmp_path: Path) -> None:
    drive, losses = read(
        tmp_path,
        ('<width sOffset="0" a="3.5"', '<width sOffset="0.2" a="3.5"'),
        ("<roadMark", '<border sOffset="0" a="9" b="0" c="0" d="0"/><roadMark'),
    )
    lane = drive.roads["2"].sections[0].lanes[0]
    assert lane.widths[:, :2].tolist() == [[0.0, 3.5], [0.2, 3.5]]
    assert lane.borders.shape == (0, 5)
    assert {loss.kind for loss in losses} == {"repaired", "ignored"}


ONE_SIDED = """
<lanes>
  <laneSection s="0">
    <left><lane id="1" type="driving">
      <link><successor id="2"/></link>
      <width sOffset="0" a="3" b="0.01" c="0" d="0"/>
      <width sOffset="60" a="3.6" b="0" c="0.0002" d="-0.000002"/>
      <roadMark sOffset="0" type="solid"/><roadMark sOffset="70" type="broken"/>
      <speed sOffset="0" max="20"/><speed sOffset="30" max="10"/>
    </lane></left>
    <center><lane id="0" type="none"/></center>
    <right><lane id="-1" type="driving"><link><successor id="-2"/></link>
      <width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
  </laneSection>
  <laneSection s="50" singleSide="true">
    <center><lane id="0" type="none"/></center>
    <right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
      <lane id="-2" type="driving"><link><predecessor id="-1"/></link>
        <width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
  </laneSection>
  <laneSection s="80" singleSide="true">
    <left><lane id="2" type="driving"><link><predecessor id="1"/></link>
      <width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
      <lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left>
    <center><lane id="0" type="none"/></center>
  </laneSection>
</lanes>
"""


def test_lanes_go_on_through_sections_of_the_other_side(tmp_path: Path) -> None:
    start, end = SMALL.index("<lanes>"), SMALL.index("</lanes>") + len("</lanes>")
    drive, losses = read(tmp_path, text=SMALL[:start] + ONE_SIDED + SMALL[end:])
    assert not [loss for loss in losses if "junction" not in loss.element]
    road = drive.roads["1"]
    sections = [{lane.id: lane for lane in section.lanes} for section in road.sections]
    assert [sorted(lanes) for lanes in sections] == [[-1, 0, 1], [-2, -1, 0, 1], [-2, -1, 0, 1, 2]]
    left = [lanes[1] for lanes in sections[:2]]
    assert [lane.predecessors + lane.successors for lane in left] == [(1,), (1, 2)]
    assert sections[2][-2].predecessors == (-2,)
    assert sections[1][-2].successors == (-2,)
    assert [(mark.s, mark.kind) for mark in left[1].marks] == [(0.0, "solid"), (20.0, "broken")]
    assert [(speed.s, speed.limit) for speed in left[1].speeds] == [(0.0, 10.0)]
    strips = [next(s for s in item if s.lane.id == 1) for item in lanes.laid(road).strips]
    for place, width in ((40.0, 3.4), (55.0, 3.55), (75.0, 3.6 + 0.0002 * 225 - 2e-6 * 3375)):
        found = lanes.width_at(strips[0 if place < 50.0 else 1], np.array([place]))
        assert found == pytest.approx(width)


def test_border_on_the_other_side_is_a_distance(tmp_path: Path) -> None:
    drive, losses = read(tmp_path, ("<width", "<border"))
    assert [lane.borders[:, 1].tolist() for lane in drive.roads["2"].sections[0].lanes] == [
        [3.5],
        [],
        [-3.5],
    ]
    assert {loss.kind for loss in losses} == {"repaired"}


def test_left_out_limit_is_nan_and_none_is_infinite(tmp_path: Path) -> None:
    drive, _ = read(tmp_path, ('max="50" unit="km/h"', 'max="no limit"'))
    assert drive.roads["1"].types[0].limit == math.inf
    drive, _ = read(tmp_path, ('<speed max="50" unit="km/h"/>', ""))
    assert math.isnan(drive.roads["1"].types[0].limit)


def test_error_names_file_line_and_column(tmp_path: Path) -> None:
    with pytest.raises(SpecError) as raised:
        read(tmp_path, ('<arc curvature="0.02"/>', '<arc curvature="soon"/>'))
    where = raised.value.where
    assert where is not None
    line = SMALL.splitlines()[where.line - 1]
    assert line[where.column - 1 :].startswith("<arc")
    assert "curvature is 'soon'" in str(raised.value)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_file_in_another_encoding_reads_the_same(tmp_path: Path, encoding: str) -> None:
    name = {"utf-8-sig": "UTF-8", "utf-16": "UTF-16", "latin-1": "ISO-8859-1"}[encoding]
    text = SMALL.replace("UTF-8", name).replace('name="small"', 'name="Köln"')
    path = tmp_path / "map.xodr"
    path.write_bytes(text.encode(encoding))
    assert read_map(path)[0].name == "Köln"


@pytest.mark.skipif(not THIRD_PARTY.is_dir(), reason="maps of others are not here")
def test_maps_of_others_are_read() -> None:
    files = sorted(THIRD_PARTY.rglob("*.xodr"))
    assert len(files) == 12
    for path in files:
        drive, losses = read_map(path)
        assert drive.roads
        # The crossing of Euro NCAP links lanes -2 that its connections do not have.
        is_wrong = "X-Intersection" in path.name
        assert [loss.kind for loss in losses if loss.kind != "ignored"] == [
            "repaired"
        ] * 4 * is_wrong
