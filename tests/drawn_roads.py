"""Roads of a map as a reader would hand them over, written in a line."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from adeye.maps.opendrive import (
    Geometry,
    GeometryKind,
    Lane,
    OpenDrive,
    Road,
    Section,
    no_cubics,
)

Rows = Sequence[tuple[float, float, float, float, float]]


def cubics(*rows: tuple[float, float, float, float, float]) -> Any:
    return np.array(rows, float) if rows else no_cubics()


def piece(
    kind: GeometryKind,
    length: float,
    *parameters: float,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    s: float = 0.0,
    normalized: bool = False,
) -> Geometry:
    return Geometry(kind, s, *pose, length, parameters, normalized, 1)


def lane(number: int, *widths: tuple[float, float, float, float, float], **changed: Any) -> Lane:
    fields = {
        "type": "driving",
        "direction": "standard",
        "widths": cubics(*widths),
        "borders": no_cubics(),
        "predecessors": (),
        "successors": (),
        "speeds": (),
        "marks": (),
        "line": 1,
    }
    return Lane(id=number, **{**fields, **changed})


def section(*lanes: Lane, s: float = 0.0) -> Section:
    return Section(s, lanes, 1)


def road(geometries: Sequence[Geometry], *sections: Section, **changed: Any) -> Road:
    fields = {
        "id": "1",
        "name": "",
        "length": sum(geometry.length for geometry in geometries),
        "junction": "",
        "left_hand": False,
        "predecessor": None,
        "successor": None,
        "types": (),
        "elevations": no_cubics(),
        "superelevations": no_cubics(),
        "offsets": no_cubics(),
        "signals": (),
        "line": 1,
    }
    return Road(geometries=tuple(geometries), sections=sections, **{**fields, **changed})


def network(*roads: Road) -> OpenDrive:
    return OpenDrive("drawn.xodr", (1, 8), "", "", {road.id: road for road in roads}, {})
