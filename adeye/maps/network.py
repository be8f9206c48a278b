"""The lanes of a map as a graph: which follows which in the direction of driving, which lie beside.

A row is a lane of one section of one road. Rows are sorted by their keys (road, section, lane), as
texts and numbers of the file, so that another road far away changes no row but its number.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.maps.lanes import section_end, way_of
from adeye.maps.opendrive import Connection, Floats, Junction, OpenDrive, Road, RoadLink

Ints = NDArray[np.int32]

KINDS: Final = (
    "drive", "bus", "bicycle", "shoulder", "parking", "sidewalk", "rail", "other",
)  # fmt: skip
"""Kinds of lanes, by number."""

DRIVE, BUS = 0, 1

_KINDS: Final = {
    **dict.fromkeys(
        ("driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "bidirectional"),
        "drive",
    ),
    **dict.fromkeys(("mwyEntry", "mwyExit", "HOV", "slipLane"), "drive"),
    **dict.fromkeys(("bus", "taxi"), "bus"),
    "biking": "bicycle",
    **dict.fromkeys(("shoulder", "stop"), "shoulder"),
    "parking": "parking",
    **dict.fromkeys(("sidewalk", "walking"), "sidewalk"),
    **dict.fromkeys(("rail", "tram"), "rail"),
}

NONE: Final = -1


@dataclass(frozen=True, slots=True)
class Network:
    """Lanes N as a graph; -1 stands for none.

    Attributes:
        roads: Ids of roads, sorted.
        junctions: Ids of junctions, sorted.
        road: (N,) of ``roads``.
        section: (N,) number of the section in its road.
        lane: (N,) id of the lane in its section.
        line: (N,) of the lane in the file.
        kind: (N,) of ``KINDS``.
        way: (N,) 1 if it is driven along s, -1 against it, 0 both ways.
        start: (N,) where its section begins on the road [m].
        end: (N,) where it ends [m].
        limit: (N,) least speed limit along it [m/s], infinite for none, NaN if the file is silent.
        left: (N,) lane beside it on the left that is driven the same way; of what is driven both
            ways, as s goes.
        right: (N,) on the right.
        opposite: (N,) lane beside it that is driven the other way.
        junction: (N,) of ``junctions``, that its road is a connection of.
        connection: (N,) number of the connection in the file's order in that junction.
        after: (E,) lanes that follow, in the order of rows; see ``following``.
        after_start: (N + 1,) where those of each row begin.
        before: (E,) lanes that it follows.
        before_start: (N + 1,).
    """

    roads: tuple[str, ...]
    junctions: tuple[str, ...]
    road: Ints
    section: Ints
    lane: Ints
    line: Ints
    kind: Ints
    way: Ints
    start: Floats
    end: Floats
    limit: Floats
    left: Ints
    right: Ints
    opposite: Ints
    junction: Ints
    connection: Ints
    after: Ints
    after_start: Ints
    before: Ints
    before_start: Ints

    def __len__(self) -> int:
        """Count the lanes."""
        return len(self.road)

    def following(self, row: int) -> Ints:
        """Return the rows that follow a lane in its direction of driving."""
        return self.after[self.after_start[row] : self.after_start[row + 1]]

    def preceding(self, row: int) -> Ints:
        """Return the rows that a lane follows."""
        return self.before[self.before_start[row] : self.before_start[row + 1]]

    def name(self, row: int) -> str:
        """Name a lane for people."""
        road = self.roads[self.road[row]]
        return f"road {road}, section {self.section[row]}, lane {self.lane[row]}"

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """Return everything as arrays that do not depend on anything but the map."""
        return {field.name: np.asarray(getattr(self, field.name)) for field in fields(self)}


# --- What the file says of ends that meet ---------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Joint:
    """One lane's word that its end meets another's: 0 where s of its road is least, 1 at the other.

    Attributes:
        row: The lane that says so; of a junction's connection, the incoming one.
        end: Of it.
        other: The lane that it meets.
        other_end: Of that.
        line: In the file.
        is_mutual: Whether the other one is expected to say so too.
    """

    row: int
    end: int
    other: int
    other_end: int
    line: int
    is_mutual: bool


class Rows:
    """Lanes of a map by their keys.

    Attributes:
        keys: (road, section, lane) of each row.
        lanes: Record of each row.
    """

    def __init__(self, network: OpenDrive) -> None:
        self.map = network
        found = {
            (road.id, number, lane.id): lane
            for road in network.roads.values()
            for number, section in enumerate(road.sections)
            for lane in section.lanes
            if lane.id != 0
        }
        self.keys = sorted(found)
        self.lanes = [found[key] for key in self.keys]
        self._numbers = {key: row for row, key in enumerate(self.keys)}

    def find(self, road: str, section: int, lane: int) -> int | None:
        """Return the row of a lane, None if there is none."""
        return self._numbers.get((road, section, lane))

    def at(self, road: str, end: int, lane: int) -> int | None:
        """Return the row of a lane at an end of a road."""
        sections = self.map.roads[road].sections
        return self.find(road, len(sections) - 1 if end else 0, lane)


def joints(rows: Rows) -> Iterator[Joint]:
    """Yield what lanes and junctions say of lanes that meet; what is not there is passed over."""
    for row, (road_id, number, _) in enumerate(rows.keys):
        road, lane = rows.map.roads[road_id], rows.lanes[row]
        for end in (0, 1):
            numbers = lane.successors if end else lane.predecessors
            inner = number + (1 if end else -1)
            for other_id in numbers:
                if 0 <= inner < len(road.sections):
                    other, other_end, mutual = rows.find(road_id, inner, other_id), 1 - end, True
                else:
                    link = road.successor if end else road.predecessor
                    if link is None or link.element != "road" or link.id not in rows.map.roads:
                        continue
                    other_end = 1 if link.contact == "end" else 0
                    other = rows.at(link.id, other_end, other_id)
                    back = link_at(rows.map.roads[link.id], other_end)
                    # Towards a junction a road names no lanes: connections do, of what leads in.
                    mutual = (
                        back is None
                        or back.element == "road"
                        or (back.id == road.junction and enters_by(_way(rows, row), end))
                    )
                if other is not None:
                    yield Joint(row, end, other, other_end, lane.line, mutual)
    for junction in rows.map.junctions.values():
        for connection in junction.connections:
            yield from _connected(rows, junction.id, connection)


def link_at(road: Road, end: int) -> RoadLink | None:
    """Return what a road is linked to at an end."""
    return road.successor if end else road.predecessor


def is_joined(network: OpenDrive, junction: Junction, connection: Connection) -> bool:
    """Tell whether the incoming road of a connection meets the connecting one."""
    roads = network.roads
    if connection.incoming not in roads or connection.connecting not in roads:
        return False
    contact = 1 if connection.contact == "end" else 0
    incoming, connecting = roads[connection.incoming], roads[connection.connecting]
    return _met_end(incoming, connecting, contact, junction.id) is not None


def _connected(rows: Rows, junction: str, connection: Connection) -> Iterator[Joint]:
    roads = rows.map.roads
    if connection.incoming not in roads or connection.connecting not in roads:
        return
    incoming, connecting = roads[connection.incoming], roads[connection.connecting]
    contact = 1 if connection.contact == "end" else 0
    end = _met_end(incoming, connecting, contact, junction)
    if end is None:
        return
    is_direct = connecting.junction != junction
    for first, second in connection.lanes:
        row, other = rows.at(incoming.id, end, first), rows.at(connecting.id, contact, second)
        if row is not None and other is not None:
            yield Joint(row, end, other, contact, connection.line, not is_direct)


def _met_end(incoming: Road, connecting: Road, contact: int, junction: str) -> int | None:
    """Return which end of an incoming road a connecting road begins at."""
    back = link_at(connecting, contact)
    if back is not None and back.element == "road" and back.id == incoming.id and back.contact:
        return 1 if back.contact == "end" else 0
    for end in (1, 0):
        link = link_at(incoming, end)
        if link is not None and link.element == "junction" and link.id == junction:
            return end
    return None


def leaves_by(way: int, end: int) -> bool:
    """Tell whether who drives on a lane leaves it at that end."""
    return way == 0 or (way > 0) == (end == 1)


def enters_by(way: int, end: int) -> bool:
    """Tell whether who drives on a lane comes in at that end."""
    return leaves_by(-way, end)


# --- The graph ------------------------------------------------------------------------------------


def build_network(network: OpenDrive) -> Network:
    """Build the graph of all lanes of a map."""
    return build_of_rows(Rows(network))


def build_of_rows(rows: Rows) -> Network:
    """Build the graph of lanes."""
    count = len(rows.keys)
    roads, junctions = sorted(rows.map.roads), sorted(rows.map.junctions)
    of_road = {key: number for number, key in enumerate(roads)}
    way = _ints([_way(rows, row) for row in range(count)])
    edges = set()
    for joint in joints(rows):
        for row, end, other, other_end in (
            (joint.row, joint.end, joint.other, joint.other_end),
            (joint.other, joint.other_end, joint.row, joint.end),
        ):
            if leaves_by(way[row], end) and enters_by(way[other], other_end):
                edges.add((row, other))
    after_start, after = _rows_of(edges, count)
    before_start, before = _rows_of({(other, row) for row, other in edges}, count)
    left, right, opposite = _neighbours(rows, way)
    junction, connection = _memberships(rows, {key: n for n, key in enumerate(junctions)})
    ends = [_span(rows, row) for row in range(count)]
    return Network(
        roads=tuple(roads),
        junctions=tuple(junctions),
        road=_ints([of_road[key[0]] for key in rows.keys]),
        section=_ints([key[1] for key in rows.keys]),
        lane=_ints([key[2] for key in rows.keys]),
        line=_ints([lane.line for lane in rows.lanes]),
        kind=_ints([KINDS.index(_KINDS.get(lane.type, "other")) for lane in rows.lanes]),
        way=way,
        start=np.array([start for start, _ in ends], dtype=np.float64),
        end=np.array([end for _, end in ends], dtype=np.float64),
        limit=np.array([_limit(rows, row, *ends[row]) for row in range(count)], dtype=np.float64),
        left=left,
        right=right,
        opposite=opposite,
        junction=junction,
        connection=connection,
        after=after,
        after_start=after_start,
        before=before,
        before_start=before_start,
    )


def _ints(values: list[int]) -> Ints:
    return np.array(values, dtype=np.int32)


def _way(rows: Rows, row: int) -> int:
    lane = rows.lanes[row]
    is_both = lane.type == "bidirectional"
    return 0 if is_both else way_of(rows.map.roads[rows.keys[row][0]], lane)


def _rows_of(edges: set[tuple[int, int]], count: int) -> tuple[Ints, Ints]:
    """Return compressed rows: where those of each begin (N + 1,), and what they hold (E,)."""
    table = np.array(sorted(edges), dtype=np.int32).reshape(-1, 2)
    start = np.searchsorted(table[:, 0], np.arange(count + 1)).astype(np.int32)
    return start, np.ascontiguousarray(table[:, 1])


def _neighbours(rows: Rows, way: Ints) -> tuple[Ints, Ints, Ints]:
    left, right, opposite = (np.full(len(rows.keys), NONE, dtype=np.int32) for _ in range(3))
    for row, (road, section, lane) in enumerate(rows.keys):
        # The next one to the left as s goes; lane 0 is a line.
        other = rows.find(road, section, lane + 1 if lane != -1 else 1)
        if other is None:
            continue
        if way[row] * way[other] < 0:
            opposite[row], opposite[other] = other, row
        elif way[row] != way[other]:
            continue
        elif way[row] >= 0:
            left[row], right[other] = other, row
        else:
            right[row], left[other] = other, row
    return left, right, opposite


def _memberships(rows: Rows, numbers: Mapping[str, int]) -> tuple[Ints, Ints]:
    """Return of each lane the junction that its road belongs to, and the connection to it."""
    known = {
        (junction.id, item.connecting, to): number
        for junction in rows.map.junctions.values()
        for number, item in reversed(list(enumerate(junction.connections)))
        for _, to in item.lanes
    }
    junctions = [rows.map.roads[key[0]].junction for key in rows.keys]
    connections = [
        known.get((junction, key[0], key[2]), NONE)
        for junction, key in zip(junctions, rows.keys, strict=True)
    ]
    return _ints([numbers.get(junction, NONE) for junction in junctions]), _ints(connections)


def _span(rows: Rows, row: int) -> tuple[float, float]:
    road_id, number, _ = rows.keys[row]
    road = rows.map.roads[road_id]
    return road.sections[number].s, section_end(road, number)


def limits_along(rows: Rows, row: int, start: float, end: float) -> list[tuple[float, float]]:
    """Return from where along the road [m] on which limit holds in a lane [m/s].

    Its own, where it is silent that of its road; infinite for none, NaN where both are silent.

    Args:
        rows: Lanes of the map.
        row: The lane.
        start: Where its section begins [m].
        end: Where that ends [m].
    """
    lane, road = rows.lanes[row], rows.map.roads[rows.keys[row][0]]
    own = [(start + speed.s, speed.limit) for speed in lane.speeds]
    until = own[0][0] if own else end
    if until <= start and own:
        return own
    first = max((kind.s for kind in road.types if kind.s <= start), default=start)
    kinds = (kind for kind in road.types if first <= kind.s < until)
    return [(max(kind.s, start), kind.limit) for kind in kinds] + own


def _limit(rows: Rows, row: int, start: float, end: float) -> float:
    """Return the least limit along a lane, see ``limits_along``."""
    limits = (limit for _, limit in limits_along(rows, row, start, end))
    return min((limit for limit in limits if not np.isnan(limit)), default=np.nan)
