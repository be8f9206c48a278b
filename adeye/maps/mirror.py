"""The mirror image of a map: y turned round, so that traffic that keeps to the left keeps right."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from adeye.maps import opendrive as records

_AHEAD: Final = {"paramPoly3": 4}
"""How many of its first parameters tell how far a piece leads ahead: the others lead it aside."""
_CHANGES: Final = {"increase": "decrease", "decrease": "increase"}


def mirrored(drive: records.OpenDrive) -> records.OpenDrive:
    """Return a map with what is to the left of a road on its right, and lanes so, too.

    Places along roads, ids of roads and directions of travel stay; the image of the image is the
    map. No zero becomes a negative one.
    """
    junctions = {key: _junction(item) for key, item in drive.junctions.items()}
    roads = {key: _road(road) for key, road in drive.roads.items()}
    return replace(drive, roads=roads, junctions=junctions)


def _road(road: records.Road) -> records.Road:
    signals = (
        replace(item, t=0.0 - item.t, lanes=tuple((-b, -a) for a, b in item.lanes))
        for item in road.signals
    )
    return replace(
        road,
        left_hand=not road.left_hand,
        geometries=tuple(map(_geometry, road.geometries)),
        superelevations=_turned(road.superelevations),
        offsets=_turned(road.offsets),
        sections=tuple(
            # From left to right.
            replace(section, lanes=tuple(map(_lane, reversed(section.lanes))))
            for section in road.sections
        ),
        signals=tuple(signals),
    )


def _geometry(piece: records.Geometry) -> records.Geometry:
    ahead = _AHEAD.get(piece.kind, 0)
    aside = (0.0 - number for number in piece.parameters[ahead:])
    parameters = (*piece.parameters[:ahead], *aside)
    return replace(piece, y=0.0 - piece.y, heading=0.0 - piece.heading, parameters=parameters)


def _turned(cubics: records.Floats) -> records.Floats:
    turned = 0.0 - cubics
    turned[:, 0] = cubics[:, 0]
    return turned


def _lane(lane: records.Lane) -> records.Lane:
    return replace(
        lane,
        id=-lane.id,
        borders=_turned(lane.borders),
        predecessors=tuple(-number for number in lane.predecessors),
        successors=tuple(-number for number in lane.successors),
        marks=tuple(
            replace(mark, lane_change=_CHANGES.get(mark.lane_change, mark.lane_change))
            for mark in lane.marks
        ),
    )


def _junction(junction: records.Junction) -> records.Junction:
    connections = (
        replace(item, lanes=tuple((-a, -b) for a, b in item.lanes)) for item in junction.connections
    )
    return replace(junction, connections=tuple(connections))
