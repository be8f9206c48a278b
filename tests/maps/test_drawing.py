"""Pictures of maps: whole, told in words too, the same bytes, and small."""

import itertools
import math
import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from adeye.maps.drawing import WIDTH, draw_map
from adeye.maps.opendrive import Signal
from tests.drawn_roads import WIDE, crossing, cubics, lane, network, piece, road, section
from tests.frozen import assert_frozen

IS_LIGHT = True
SVG = "{http://www.w3.org/2000/svg}"


def test_every_lane_is_drawn_and_told() -> None:
    light = Signal("7", 90.0, -4.0, "+", IS_LIGHT, "DE", "1000001", "-1", math.nan, "", (), 1)
    drive = crossing()
    roads = {**drive.roads, "a": replace(drive.roads["a"], signals=(light,))}
    text = draw_map(replace(drive, roads=roads), "a & b")
    root = ET.fromstring(text)  # noqa: S314 - written by us
    assert root.get("aria-labelledby") == "title desc"
    assert root.findtext(f"{SVG}title") == "a & b"
    assert "junctions: 1, lanes: 6" in (root.findtext(f"{SVG}desc") or "")
    told = [item.findtext(f"{SVG}title") for item in root if item.findtext(f"{SVG}title")]
    assert told[0] == "road a, section 0, lane -1: driving, 3.00 m wide half-way"
    assert (len(told), told[-1]) == (7, "signal 7: light 1000001")
    words = {item.text for item in root.iter(f"{SVG}text")}
    assert {"road a", "junction j", "drive", "light", "N"} <= words
    assert draw_map(replace(drive, roads=roads), "a & b") == text


def test_arrows_point_where_lanes_are_driven_to() -> None:
    drawn = road([piece("line", 40.0)], section(lane(1, WIDE), lane(0), lane(-1, WIDE)))
    turned = re.findall(r'#a" transform="[^"]*rotate\((-?\d+)\)', draw_map(network(drawn), ""))
    assert [abs(int(turn)) for turn in turned] == [0, 180]


def test_words_of_a_road_too_narrow_for_them_are_in_its_cross_section() -> None:
    wide = road([piece("line", 40.0)], section(lane(1, WIDE), lane(0), lane(-1, WIDE)))
    long = replace(wide, geometries=(piece("line", 4000.0),), length=4000.0)
    assert "\N{MINUS SIGN}1 \N{MIDDLE DOT} 3.00 m<" in draw_map(network(wide), "")
    assert "Lanes as seen" not in draw_map(network(wide), "")
    text = draw_map(network(long), "")
    assert "Such as road 1, section 0: 4,000 m in all" in text
    assert "\N{MINUS SIGN}1\N{UPWARDS ARROW}<" in text
    assert "1\N{DOWNWARDS ARROW}<" in text


@pytest.mark.parametrize("width", [(0.0, 3.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0)])
def test_one_road_without_height_is_drawn(width: tuple[float, float, float, float, float]) -> None:
    drawn = road([piece("line", 0.5)], section(lane(0), lane(-1, width)))
    assert "nan" not in draw_map(network(drawn), "")


@pytest.mark.parametrize("heading", [0.0, 0.5 * math.pi])
def test_map_is_in_the_middle_of_its_picture(heading: float) -> None:
    straight = piece("line", 40.0, pose=(300.0, -70.0, heading))
    drawn = road([straight], section(lane(1, WIDE), lane(0), lane(-1, WIDE)))
    text = draw_map(network(drawn), "")
    arrows = re.findall(r'#a" transform="translate\(([\d.]+)', text)
    assert np.mean([float(place) for place in arrows]) == pytest.approx(0.5 * WIDTH, abs=0.1)


def test_words_do_not_lie_on_one_another() -> None:
    roads = [
        road(
            [piece("line", 30.0, pose=(30.0 * column, 9.0 * row, 0.0))],
            section(lane(0), lane(-1, WIDE)),
            id=f"{column} {row}",
        )
        for column in range(30)
        for row in range(3)
    ]
    text = draw_map(network(*roads), "")
    words = re.findall(r'class="h m" x="([\d.]+)" y="([\d.]+)">road', text)
    places = [(float(x), float(y)) for x, y in words]
    # At 14 px, eight letters are 50 px long at least.
    for (x, y), (other_x, other_y) in itertools.combinations(places, 2):
        assert abs(x - other_x) > 50.0 or abs(y - other_y) > 12.0
    assert 9 < len(places) < 60


def sign(name: str, s: float, t: float, *, is_light: bool) -> Signal:
    return Signal(name, s, t, "+", is_light, "DE", "274", "50", math.nan, "", (), 1)


def test_picture_of_a_crossing_is_frozen() -> None:
    """Lanes with words, arrows each way, a light, a sign that lies beyond its road, a junction."""
    drive = crossing()
    signals = (sign("7", 90.0, -4.0, is_light=True), sign("8", 130.0, 4.5, is_light=False))
    roads = {**drive.roads, "a": replace(drive.roads["a"], signals=signals)}
    assert_frozen("crossing.svg", draw_map(replace(drive, roads=roads), "a & b"))


def test_picture_of_a_winding_road_is_frozen() -> None:
    """It bends, widens at once, goes up, and has lanes of all kinds; words have room beside it."""
    pieces = [
        piece("line", 23.0, pose=(5.0, -7.0, 1.1)),
        piece("arc", 31.0, 1 / 29, pose=(5.0 + 23.0 * 0.4535961, -7.0 + 23.0 * 0.8912074, 1.1)),
    ]
    pieces[1] = replace(pieces[1], s=23.0)
    jumping = ((0.0, 2.5, 0.0, 0.0, 0.0), (11.0, 3.3, 0.013, 0.0, 0.0))
    lanes = (
        lane(2, (0.0, 1.9, 0.0, 0.0, 0.0), type="sidewalk"),
        lane(1, WIDE),
        lane(0),
        lane(-1, *jumping),
        lane(-2, (0.0, 1.2, 0.0, 0.0, 0.0), type="biking"),
        lane(-3, (0.0, 0.4, 0.0, 0.0, 0.0), type="shoulder"),
    )
    offsets = cubics((0.0, 0.35, 0.0, 0.0, 0.0))
    winding = road(pieces, section(*lanes), id="w", offsets=offsets)
    down = road(
        [piece("line", 41.3, pose=(60.0, 30.0, -1.5))],
        section(lane(0), lane(-1, WIDE, type="bus"), lane(-2, WIDE)),
        section(lane(0), lane(-1, WIDE), s=17.0),
        id="d",
    )
    assert_frozen("winding_road.svg", draw_map(network(winding, down), "winding"))


def test_picture_of_long_roads_with_their_cross_sections_is_frozen() -> None:
    """Thin lanes, nine kinds of cross-sections of which eight are shown, the longest first."""
    roads = [
        road(
            [piece("line", 5000.0 + 100.0 * number, pose=(0.0, 300.0 * number, 0.02 * number))],
            section(
                lane(1, WIDE),
                lane(0),
                *(lane(-k, (0.0, 2.5 + 0.25 * number, 0.0, 0.0, 0.0)) for k in range(1, number)),
                lane(-max(number, 1), (0.0, 0.3, 0.0, 0.0, 0.0), type="shoulder"),
            ),
            id=f"r{number}",
        )
        for number in range(9)
    ]
    assert_frozen("long_roads.svg", draw_map(network(*roads), "long"))


@pytest.mark.slow
def test_ten_thousand_lanes_are_less_than_twenty_megabytes() -> None:
    roads = [
        road(
            [piece("arc", 120.0, 1 / 90, pose=(150.0 * (k % 20), 150.0 * (k // 20), 0.3 * k))],
            section(*(lane(-number, WIDE) for number in range(1, 21))),
            id=str(k),
        )
        for k in range(500)
    ]
    assert len(draw_map(network(*roads), "").encode()) < 20_000_000
