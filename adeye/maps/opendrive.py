"""A road network as an OpenDRIVE file says it: its records, with the lines that they stand in.

Numbers are SI; angles are radians; ids are the texts of the file. A cubic is a row
``(s, a, b, c, d)``: from place s on, ``a + b t + c t² + d t³`` at ``t = place - s``.

Source:
    ASAM OpenDRIVE 1.4 to 1.8.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FASTEST: Final = 150.0
"""Highest speed limit of any road [m/s]. Our choice."""
FASTEST_POSTED: Final = 160.0 / 3.6
"""Highest speed limit that is posted anywhere [m/s]; one without a unit is in m/s."""
STEEPEST: Final = 0.5
"""Grade of no street: the steepest rise by 0.35 [1]."""

GeometryKind = Literal["line", "arc", "spiral", "poly3", "paramPoly3"]


def no_cubics() -> Floats:
    """Return a function along the road that is zero everywhere: no rows (0, 5)."""
    return np.zeros((0, 5))


@dataclass(frozen=True, slots=True)
class Geometry:
    """A piece of a road's reference line.

    Attributes:
        kind: Which curve.
        s: Where it begins on the road [m].
        x: Of its start [m].
        y: Of its start [m].
        heading: At its start [rad].
        length: [m].
        parameters: line: none; arc: (curvature,); spiral: (curvature at start, at end) [1/m];
            poly3: (a, b, c, d); paramPoly3: (aU, bU, cU, dU, aV, bV, cV, dV).
        normalized: paramPoly3 only: whether its parameter ends at 1 instead of at the length.
        line: In the file.
    """

    kind: GeometryKind
    s: float
    x: float
    y: float
    heading: float
    length: float
    parameters: tuple[float, ...]
    normalized: bool
    line: int


@dataclass(frozen=True, slots=True)
class RoadMark:
    """A marking at a lane's outer border (of lane 0: the centre), from a place in its section on.

    Attributes:
        s: Within the section [m].
        kind: Such as ``solid`` or ``broken``; ``none`` where there is none.
        lane_change: ``increase``, ``decrease``, ``both`` or ``none``; empty if the file is silent.
        width: [m], NaN if the file is silent.
        line: In the file.
    """

    s: float
    kind: str
    lane_change: str
    width: float
    line: int


@dataclass(frozen=True, slots=True)
class LaneSpeed:
    """A speed limit of a lane, from a place in its section on [m/s]; infinite for none."""

    s: float
    limit: float
    line: int


@dataclass(frozen=True, slots=True)
class Lane:
    """A lane of a section.

    Attributes:
        id: Positive to the left of the reference line, negative to the right, 0 the line itself.
        type: As the file says, such as ``driving``, ``shoulder``, ``sidewalk``.
        direction: ``standard``, ``reversed`` or ``both`` (1.8).
        widths: Cubics (N, 5) within the section [m]; none if ``borders`` are given.
        borders: Cubics (N, 5) of its outer border against the lane offset's line [m].
        predecessors: Ids of lanes before it.
        successors: Ids of lanes behind it.
        speeds: In the order of s.
        marks: In the order of s.
        line: In the file.
    """

    id: int
    type: str
    direction: str
    widths: Floats
    borders: Floats
    predecessors: tuple[int, ...]
    successors: tuple[int, ...]
    speeds: tuple[LaneSpeed, ...]
    marks: tuple[RoadMark, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Section:
    """A lane section: from ``s`` to the next one's, with the same lanes all along.

    Attributes:
        s: Where it begins on the road [m].
        lanes: From left to right: ids descend.
        line: In the file.
    """

    s: float
    lanes: tuple[Lane, ...]
    line: int


@dataclass(frozen=True, slots=True)
class RoadLink:
    """What a road is joined to at one of its ends.

    Attributes:
        element: ``road`` or ``junction``.
        id: Of that.
        contact: ``start`` or ``end`` of that road; empty for a junction.
        line: In the file.
    """

    element: str
    id: str
    contact: str
    line: int


@dataclass(frozen=True, slots=True)
class RoadType:
    """A kind of road such as ``motorway``, from a place on, with its limit [m/s], NaN if silent."""

    s: float
    type: str
    limit: float
    line: int


@dataclass(frozen=True, slots=True)
class Signal:
    """A sign or light at a road.

    Attributes:
        id: As written.
        s: On the road [m].
        t: To the left of the reference line [m].
        orientation: ``+``, ``-`` or ``none``: for traffic along or against s.
        dynamic: Whether it changes, as a light.
        country: Whose catalogue ``type`` is from.
        type: Such as ``206``.
        subtype: As written.
        value: Such as a speed, NaN if none.
        unit: Of the value.
        lanes: First and last lane that it is for, for each ``validity``.
        line: In the file.
    """

    id: str
    s: float
    t: float
    orientation: str
    dynamic: bool
    country: str
    type: str
    subtype: str
    value: float
    unit: str
    lanes: tuple[tuple[int, int], ...]
    line: int


@dataclass(frozen=True, slots=True)
class Road:
    """A road: a reference line and the lanes along it.

    Attributes:
        id: As written.
        name: As written.
        length: As the file says [m].
        junction: Id of the junction that it is a connection of; empty if none.
        left_hand: Whether traffic keeps to the left (``rule="LHT"``).
        predecessor: What it is joined to at its start.
        successor: What it is joined to at its end.
        types: In the order of s.
        geometries: In the order of s, at least one.
        elevations: Cubics (N, 5) [m].
        superelevations: Cubics (N, 5) [rad].
        offsets: Cubics (N, 5) of the lane offset [m].
        sections: In the order of s, at least one.
        signals: In the order of the file.
        line: In the file.
    """

    id: str
    name: str
    length: float
    junction: str
    left_hand: bool
    predecessor: RoadLink | None
    successor: RoadLink | None
    types: tuple[RoadType, ...]
    geometries: tuple[Geometry, ...]
    elevations: Floats
    superelevations: Floats
    offsets: Floats
    sections: tuple[Section, ...]
    signals: tuple[Signal, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Connection:
    """A way through a junction.

    Attributes:
        id: As written.
        incoming: Id of the road that it leaves.
        connecting: Id of the road that it follows (default, virtual) or goes on to (direct).
        contact: End of the connecting road where it begins: ``start`` or ``end``.
        lanes: (from, to) ids of lanes.
        line: In the file.
    """

    id: str
    incoming: str
    connecting: str
    contact: str
    lanes: tuple[tuple[int, int], ...]
    line: int


@dataclass(frozen=True, slots=True)
class Junction:
    """A junction.

    Attributes:
        id: As written.
        name: As written.
        type: ``default``, ``virtual``, ``direct`` or ``crossing``.
        connections: In the order of the file.
        priorities: (high, low) ids of connecting roads.
        line: In the file.
    """

    id: str
    name: str
    type: str
    connections: tuple[Connection, ...]
    priorities: tuple[tuple[str, str], ...]
    line: int


@dataclass(frozen=True, slots=True)
class OpenDrive:
    """A file.

    Attributes:
        path: Where it was read.
        version: (major, minor).
        name: Of the map, as written.
        geo_reference: As written, empty if none.
        roads: By id, in the order of the file.
        junctions: By id, in the order of the file.
    """

    path: str
    version: tuple[int, int]
    name: str
    geo_reference: str
    roads: dict[str, Road] = field(default_factory=dict)
    junctions: dict[str, Junction] = field(default_factory=dict)
