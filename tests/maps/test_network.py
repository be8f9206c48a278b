"""The graph of lanes: laws, and hand-made maps with the answer in the name."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.maps.network import NONE, Network, Rows, build_network
from adeye.maps.opendrive import LaneSpeed, OpenDrive, RoadType
from adeye.maps.opendrive_reader import read_opendrive
from adeye.maps.outlines import points_along, strips_of
from tests.drawn_roads import WIDE, crossing, lane, network, piece, road, section

THIRD_PARTY = sorted(
    (Path(__file__).resolve().parents[3] / "shared" / "data" / "openscenario").rglob("*.xodr")
)


def named(graph: Network) -> dict[str, dict[str, Any]]:
    """Return what each lane's row says, with lanes by name in place of numbers."""
    names = [graph.name(row) for row in range(len(graph))]

    def of(row: int) -> str:
        return "" if row == NONE else names[row]

    return {
        name: {
            "after": sorted(of(other) for other in graph.following(row)),
            "before": sorted(of(other) for other in graph.preceding(row)),
            "beside": [of(side[row]) for side in (graph.left, graph.right, graph.opposite)],
            "plain": [
                repr(column[row])
                for column in (graph.kind, graph.way, graph.limit, graph.start, graph.end)
            ],
            "connection": int(graph.connection[row]),
        }
        for row, name in enumerate(names)
    }


def require_laws(graph: Network) -> None:
    for row in range(len(graph)):
        assert all(row in graph.preceding(other) for other in graph.following(row))
        assert all(row in graph.following(other) for other in graph.preceding(row))
        left, right, opposite = graph.left[row], graph.right[row], graph.opposite[row]
        assert left == NONE or graph.right[left] == row or graph.left[left] == row
        assert right == NONE or graph.left[right] == row or graph.right[right] == row
        assert opposite == NONE or graph.opposite[opposite] == row


def test_lanes_follow_through_a_junction_whichever_end_they_meet_at() -> None:
    graph = build_network(crossing())
    require_laws(graph)
    rows = named(graph)
    assert rows["road a, section 0, lane -1"]["after"] == ["road c, section 0, lane -1"]
    assert rows["road c, section 0, lane -1"]["after"] == ["road b, section 0, lane 1"]
    assert rows["road b, section 0, lane -1"]["after"] == ["road d, section 0, lane 1"]
    assert rows["road d, section 0, lane 1"]["after"] == ["road a, section 0, lane 1"]
    assert rows["road c, section 0, lane -1"]["connection"] == 0
    assert graph.junctions[graph.junction[graph.roads.index("c") + 2]] == "j"


def test_neighbours_are_beside_in_the_direction_of_driving() -> None:
    drawn = road([piece("line", 50.0)], section(*(lane(k, WIDE) for k in (2, 1, 0, -1, -2))))
    name = "road 1, section 0, lane "
    beside = {key.removeprefix(name): row["beside"] for key, row in named_of(drawn).items()}
    assert beside == {
        "-2": [f"{name}-1", "", ""],
        "-1": ["", f"{name}-2", f"{name}1"],
        "1": ["", f"{name}2", f"{name}-1"],
        "2": [f"{name}1", "", ""],
    }


def test_all_neighbours_of_a_road_of_one_direction_are_the_same_way() -> None:
    reverse = {"direction": "reversed"}
    drawn = road([piece("line", 9.0)], section(lane(1, WIDE, **reverse), lane(0), lane(-1, WIDE)))
    rows = named_of(drawn)
    assert rows["road 1, section 0, lane -1"]["beside"] == ["road 1, section 0, lane 1", "", ""]


def named_of(drawn: Any) -> dict[str, dict[str, Any]]:
    return named(build_network(network(drawn)))


def test_left_hand_traffic_drives_the_left_lanes_along_s() -> None:
    links = {"successors": (1,)}, {"predecessors": (1,)}
    drawn = road(
        [piece("line", 50.0)],
        section(lane(1, WIDE, **links[0])),
        section(lane(1, WIDE, **links[1]), s=20.0),
        left_hand=True,
    )
    rows = named_of(drawn)
    assert rows["road 1, section 0, lane 1"]["after"] == ["road 1, section 1, lane 1"]


def test_one_word_of_a_link_is_enough() -> None:
    drawn = road(
        [piece("line", 50.0)],
        section(lane(-1, WIDE)),
        section(lane(-1, WIDE, predecessors=(-1,)), s=20.0),
    )
    assert named_of(drawn)["road 1, section 0, lane -1"]["after"] == ["road 1, section 1, lane -1"]


def test_limit_is_the_least_along_a_lane_and_the_roads_where_the_lane_is_silent() -> None:
    speeds = (LaneSpeed(10.0, 8.0, 1), LaneSpeed(20.0, 14.0, 1))
    drawn = road(
        [piece("line", 50.0)],
        section(lane(1, WIDE), lane(0), lane(-1, WIDE, speeds=speeds)),
        types=(RoadType(0.0, "town", 13.0, 1), RoadType(40.0, "town", 5.0, 1)),
    )
    assert build_network(network(drawn)).limit.tolist() == [8.0, 5.0]
    silent = build_network(network(road([piece("line", 50.0)], section(lane(-1, WIDE)))))
    assert math.isnan(silent.limit[0])


def test_a_road_far_away_changes_no_row_but_its_number() -> None:
    drive = crossing()
    far = road([piece("line", 5.0, pose=(9e3, 0, 0))], section(lane(-1, WIDE)), id="aa")
    wider = replace(drive, roads={"aa": far, **drive.roads})
    rows, more = named(build_network(drive)), named(build_network(wider))
    assert {name: more[name] for name in rows} == rows


def test_order_of_roads_in_the_file_changes_nothing() -> None:
    drive = crossing()
    turned = replace(drive, roads=dict(reversed(drive.roads.items())))
    graphs = [build_network(item).arrays() for item in (drive, turned)]
    assert all(np.array_equal(graphs[0][key], graphs[1][key], equal_nan=key == "limit")
               for key in graphs[0])  # fmt: skip


def test_ten_thousand_lanes_take_less_than_ten_megabytes() -> None:
    sections = [
        section(*(lane(-k, WIDE, successors=(-k,)) for k in range(1, 11)), s=float(number))
        for number in range(1000)
    ]
    graph = build_network(network(road([piece("line", 1000.0)], *sections)))
    assert len(graph) == 10_000
    assert sum(column.nbytes for column in graph.arrays().values()) < 10_000_000


@pytest.mark.parametrize("path", THIRD_PARTY, ids=lambda path: path.stem)
def test_lanes_of_others_meet_what_follows_them(path: Path) -> None:
    drive: OpenDrive = read_opendrive(path)[0]
    graph, points = build_network(drive), points_along(strips_of(Rows(drive)), 10.0)
    require_laws(graph)
    for row in np.flatnonzero(graph.kind == 0).tolist():
        for other in graph.following(row).tolist():
            here = (points.last if graph.way[row] > 0 else points.first)[row]
            there = (points.first if graph.way[other] > 0 else points.last)[other]
            gap = math.hypot(points.x[here] - points.x[there], points.y[here] - points.y[there])
            assert gap < 0.5
