"""Check that all that a map names is there: roads, junctions and lanes that links lead to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from adeye.errors import SourceLocation, SpecError, suggest
from adeye.maps.losses import Loss, Losses, LossKind
from adeye.maps.opendrive import (
    Connection,
    Junction,
    Lane,
    OpenDrive,
    Road,
    RoadLink,
    Section,
)
from adeye.maps.xml_source import listed
from adeye.units import shown

_CONNECTION: Final = "junction.connection"


def linked(drive: OpenDrive, columns: Mapping[int, int], losses: Losses) -> OpenDrive:
    """Check the links of a map, and put in those that the file leaves to its reader.

    Args:
        drive: What was read.
        columns: Of links, lanes and connections, by the identity of their records.
        losses: Takes what is guessed.

    Returns:
        The same, with lanes for each connection.

    Raises:
        SpecError: A link leads to what is not there.
    """
    return _Links(drive, columns, losses).checked()


class _Links:
    def __init__(self, drive: OpenDrive, columns: Mapping[int, int], losses: Losses) -> None:
        self._drive = drive
        self._columns = columns
        self._losses = losses

    def checked(self) -> OpenDrive:
        drive = self._drive
        for road in drive.roads.values():
            if road.junction and road.junction not in drive.junctions:
                raise self._missing("junction", road.junction, drive.junctions, road)
            for link in (road.predecessor, road.successor):
                if link is not None:
                    known = drive.roads if link.element == "road" else drive.junctions
                    if link.id not in known:
                        raise self._missing(link.element, link.id, known, link)
        roads = {key: self._with_kept(road) for key, road in drive.roads.items()}
        junctions = {
            key: replace(
                item, connections=tuple(self._connection(item, each) for each in item.connections)
            )
            for key, item in drive.junctions.items()
        }
        return replace(drive, roads=roads, junctions=junctions)

    def _with_kept(self, road: Road) -> Road:
        """Keep the links of lanes to lanes of the next section, or of the next road."""
        last = len(road.sections) - 1
        sections = []
        for number, section in enumerate(road.sections):
            before = road.sections[number - 1] if number else self._touched(road.predecessor)
            behind = road.sections[number + 1] if number < last else self._touched(road.successor)
            lanes = []
            for lane in section.lanes:
                predecessors = self._kept(road, lane, lane.predecessors, before)
                successors = self._kept(road, lane, lane.successors, behind)
                is_whole = (predecessors, successors) == (lane.predecessors, lane.successors)
                lanes.append(
                    lane
                    if is_whole
                    else replace(lane, predecessors=predecessors, successors=successors)
                )
            sections.append(replace(section, lanes=tuple(lanes)))
        return replace(road, sections=tuple(sections))

    def _touched(self, link: RoadLink | None) -> Section | None:
        """Return the section that a link leads to, if it leads to one."""
        if link is None or not link.contact:
            return None
        return _end(self._drive.roads[link.id], link.contact)

    def _kept(
        self, road: Road, lane: Lane, ids: tuple[int, ...], section: Section | None
    ) -> tuple[int, ...]:
        """Keep the links that lead to a lane; at junctions and open ends, ids say nothing."""
        if not ids or section is None:
            return ids
        known = {item.id for item in section.lanes} - {0}
        for number in ids:
            # Centres may be linked to centres; nobody drives there.
            if number not in known and lane.id:
                self._repair(
                    f"road {shown(road.id)}: lane {lane.id} is linked to lane {number}, which the "
                    f"section in line {section.line} has not: left out",
                    lane,
                    "road.lanes.laneSection.lane.link",
                )
        return tuple(number for number in ids if number in known)

    def _connection(self, junction: Junction, connection: Connection) -> Connection:
        roads = self._drive.roads
        for name in (connection.incoming, connection.connecting):
            if name not in roads:
                raise self._missing("road", name, roads, connection)
        incoming, connecting = roads[connection.incoming], roads[connection.connecting]
        sections = _at(incoming, junction)
        start = _end(connecting, connection.contact)
        if not connection.lanes:
            return self._with_lanes(junction, connection, sections, start)
        ends = {lane.id for _, section in sections for lane in section.lanes} - {0}
        starts = {lane.id for lane in start.lanes} - {0}
        name = f"connection {shown(connection.id)} of junction {shown(junction.id)}"
        kept = []
        for pair in connection.lanes:
            for number, known, road in zip(
                pair, (ends, starts), (incoming, connecting), strict=True
            ):
                if number not in known:
                    message = f"{name}: road {shown(road.id)} has no lane {number} there"
                    self._repair(f"{message}: left out", connection, _CONNECTION)
                    break
            else:
                kept.append(pair)
        if not kept:
            raise self._error(
                f"{name}: none of its lanes is there",
                connection,
                f"Lanes of road {shown(incoming.id)}: {listed(sorted(ends))}; of road "
                f"{shown(connecting.id)}: {listed(sorted(starts))}.",
            )
        return replace(connection, lanes=tuple(kept))

    def _with_lanes(
        self,
        junction: Junction,
        connection: Connection,
        sections: list[tuple[str, Section]],
        start: Section,
    ) -> Connection:
        """Link the lanes of a connection that names none: those of one id, by the standard."""
        left_hand = self._drive.roads[connection.incoming].left_hand
        known = {lane.id for lane in start.lanes}
        found = tuple(
            dict.fromkeys(
                (lane.id, lane.id)
                for end, section in sections
                for lane in section.lanes
                # Only lanes that lead into the junction.
                if lane.id in known and lane.id * (1 if (end == "start") != left_hand else -1) > 0
            )
        )
        message = (
            f"connection {shown(connection.id)} of junction {shown(junction.id)} names no lanes: "
            f"{f'those of one id, {listed(one for one, _ in found)}' if found else 'it has none'}"
        )
        self._repair(message, connection, _CONNECTION, kind="guessed")
        return replace(connection, lanes=found)

    def _repair(
        self,
        message: str,
        record: Connection | Lane,
        element: str,
        *,
        kind: LossKind = "repaired",
    ) -> None:
        column = self._columns.get(id(record), 1)
        self._losses.append(Loss(kind, record.line, element, message, column=column))

    def _missing(
        self,
        what: str,
        name: str,
        known: Mapping[str, object],
        record: RoadLink | Connection | Road,
    ) -> SpecError:
        remedy = suggest(name, known) if len(known) <= 12 else "Is the map cut off there?"
        return self._error(f"there is no {what} {shown(name)}", record, remedy)

    def _error(
        self, message: str, record: RoadLink | Connection | Road | Lane, remedy: str
    ) -> SpecError:
        where = SourceLocation(self._drive.path, record.line, self._columns.get(id(record), 1))
        return SpecError(message, where=where, remedy=remedy)


def _end(road: Road, contact: str) -> Section:
    return road.sections[0 if contact == "start" else -1]


def _at(road: Road, junction: Junction) -> list[tuple[str, Section]]:
    """Return the sections where a road touches a junction, with the ends that they are at."""
    ends = {"start": road.predecessor, "end": road.successor}
    found = [
        (end, _end(road, end))
        for end, link in ends.items()
        if link is not None and (link.element, link.id) == ("junction", junction.id)
    ]
    # A virtual junction lies beside its road, and some files link only one way.
    return found or [("end", section) for section in road.sections]
