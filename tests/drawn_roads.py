"""Roads of a map as a reader would hand them over, written in a line."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from adeye.maps.opendrive import (
    Connection,
    Geometry,
    GeometryKind,
    Junction,
    Lane,
    OpenDrive,
    Road,
    RoadLink,
    Section,
    no_cubics,
)

WIDE = (0.0, 3.0, 0.0, 0.0, 0.0)


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


def crossing() -> OpenDrive:
    """Return two roads a and b that end at a junction j, with a road each way, c and d, in it.

    All lie on a straight line along x; b comes from the other side, d has its way against s.
    """
    two = section(lane(1, WIDE), lane(0), lane(-1, WIDE))
    at_junction = RoadLink("junction", "j", "", 1)
    a = road([piece("line", 100.0)], two, id="a", successor=at_junction)
    b = road([piece("line", 100.0, pose=(220.0, 0.0, np.pi))], two, id="b", successor=at_junction)
    between = {
        "junction": "j",
        "predecessor": RoadLink("road", "a", "end", 1),
        "successor": RoadLink("road", "b", "end", 1),
    }
    inside = [piece("line", 20.0, pose=(100.0, 0.0, 0.0))]
    to = section(lane(0), lane(-1, WIDE, predecessors=(-1,), successors=(1,)))
    back = section(lane(1, WIDE, predecessors=(1,), successors=(-1,)), lane(0))
    c, d = road(inside, to, id="c", **between), road(inside, back, id="d", **between)
    junction = Junction(
        "j",
        "",
        "default",
        (
            Connection("0", "a", "c", "start", ((-1, -1),), 1),
            Connection("1", "b", "d", "end", ((-1, 1),), 1),
        ),
        (),
        1,
    )
    roads = {item.id: item for item in (a, b, c, d)}
    return OpenDrive("drawn.xodr", (1, 8), "", "", roads, {"j": junction})
