"""From the returns of a lidar to detections: what stands together is an object.

Returns of the ground are left out. Two of the others belong together if they are no further apart
in plan view than the cluster distance or, far away, than two beams: so one lost beam parts nothing.
Each is compared with the few before it in its layer, and with the one below it. A side that beams
meet at a flat angle falls into pieces inside of its object: to join them would join, with a parked
car, whoever steps out behind it.

Source:
    Rusu (2009), "Semantic 3D object maps for everyday manipulation in human living environments",
    section 6.2, for clusters by Euclidean distance; Borges and Aldon (2004), "Line extraction in 2D
    range images for mobile robotics", J. Intelligent and Robotic Systems 40, for a distance that
    grows with the range along the order of the beams. The factors are our choice.

Boxes stand along the axes of the vehicle, as those of tracks do. What is measured is the face that
looks at the sensor; a side tells the depth only where its beams are close enough to show its end.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye import signals
from adeye.fields import fields_of
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.signals import Bools, Floats, Ints, Measurement, parameter_record, spec_columns
from adeye.simulate.channels.perception.tracks import CAR_WIDTH
from adeye.spec.sensors import LOWEST_LIDAR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.spec.sensors import PhysicalLidar

# --- The box of a cluster of returns: its nearest face, and its depth where a side shows it -------

SLOTS: Final = 32
"""Detections of a sample: the nearest clusters. Four times as many as a channel has tracks."""

_UNKNOWN: Final = -1.0
"""Class of what only its outline is known of."""

_DEEP: Final = 1.0
"""Least depth that a side must show to count [m]: a face that stands aslant shows less."""

_SHARP: Final = 0.5
"""Most that beams may be apart at the end of a side whose depth counts [m]."""

_THIN: Final = 0.5
"""Width below which a deep cluster is a side alone [m]."""

_SIDE_SHARE: Final = 0.25
"""Share of the width, from its nearer edge, in which returns may be of a side."""

Row = tuple[float, float, float, float]
"""Place along and across, length, width of a detection [m]; 0 is unknown."""


@inlined
def fit_box(  # noqa: PLR0913, PLR0917 - a kernel
    mount_x: float,
    mount_y: float,
    spacing: float,
    head: int,
    following: Ints,
    xs: Floats,
    ys: Floats,
    cut: float = 0.0,
) -> Row:
    """Find the box of a cluster of returns.

    Args:
        mount_x: Of the sensor in the vehicle frame [m].
        mount_y: [m].
        spacing: Angle between two beams [rad].
        head: First return of the cluster.
        following: (P,) the next return of the cluster, -1 after the last.
        xs: (P,) places in the vehicle frame [m].
        ys: (P,) [m].
        cut: Where the field of view ends on it: 1 if at its left edge, seen from the sensor, -1 if
            at its right one, 0 if it does not.

    Returns:
        Place along and across, length and width, see ``signals.DETECTION_COLUMNS``.
    """
    low_x = low_y = math.inf
    high_x = high_y = -math.inf
    place = head
    while place >= 0:
        low_x, high_x = min(low_x, xs[place]), max(high_x, xs[place])
        low_y, high_y = min(low_y, ys[place]), max(high_y, ys[place])
        place = following[place]
    # The side of the box that looks at the sensor: 1 if that is its right one, -1 its left one.
    side = 1.0 if low_y > mount_y else (-1.0 if high_y < mount_y else 0.0)
    edge = low_y if side > 0.0 else high_y
    if low_x <= mount_x <= high_x:
        return _beside(side, edge, low_x, high_x, low_y, high_y)
    # Ahead of the sensor the face is the rear one, and depth goes forward; behind it, backward.
    ahead = 1.0 if low_x > mount_x else -1.0
    nearest = low_x if ahead > 0.0 else high_x
    width, depth = high_y - low_y, high_x - low_x
    if cut != 0.0 and width < CAR_WIDTH:
        return _cut_short(nearest, ahead * cut, low_y, high_y)
    if side != 0.0 and depth > _DEEP and width < _THIN:
        # A side alone: its rear is hidden or too far for a beam to meet it.
        middle = edge + side * 0.5 * CAR_WIDTH
        return nearest + 0.5 * ahead * depth, middle, depth, 0.0
    face, deepest = _face(ahead, side, edge, width, head, following, xs, ys)
    away_x, away_y = face - mount_x, 0.5 * (low_y + high_y) - mount_y
    seen = width + spacing * math.sqrt(away_x * away_x + away_y * away_y)
    depth = ahead * (deepest - face)
    # How far apart two beams meet the side at its end.
    off = abs(edge - mount_y)
    end_x = deepest - mount_x
    apart = spacing * (end_x * end_x + off * off)
    if side != 0.0 and depth > _DEEP and apart <= _SHARP * off:
        return face + 0.5 * ahead * depth, 0.5 * (low_y + high_y), depth, seen
    return face, 0.5 * (low_y + high_y), 0.0, seen


@inlined
def _cut_short(nearest: float, towards: float, low_y: float, high_y: float) -> Row:
    """Return the box of what the field of view shows a part of: a car's, from the edge in view.

    A part is no narrow object: a track that took over its width and its middle would leave the
    path of the ego with them.
    """
    middle = low_y + 0.5 * CAR_WIDTH if towards > 0.0 else high_y - 0.5 * CAR_WIDTH
    return nearest, middle, 0.0, 0.0


@inlined
def _beside(
    side: float, edge: float, low_x: float, high_x: float, low_y: float, high_y: float
) -> Row:
    """Return the box of what stands beside the sensor, whose side is its nearest face."""
    width = high_y - low_y
    middle = 0.5 * (low_y + high_y)
    if side != 0.0 and width < _THIN:
        middle, width = edge + side * 0.5 * CAR_WIDTH, 0.0
    return 0.5 * (low_x + high_x), middle, high_x - low_x, width


@inlined
def _face(  # noqa: PLR0913, PLR0917 - a kernel
    ahead: float,
    side: float,
    edge: float,
    width: float,
    head: int,
    following: Ints,
    xs: Floats,
    ys: Floats,
) -> tuple[float, float]:
    """Return where along x the face is, the mean of its returns, and where its side ends [m].

    A mean is not drawn towards the sensor by noise as the nearest return is.
    """
    total, count, nearest = 0.0, 0, math.inf
    deepest = -math.inf
    place = head
    while place >= 0:
        x = ahead * xs[place]
        nearest = min(nearest, x)
        if side == 0.0 or side * (ys[place] - edge) > _SIDE_SHARE * width:
            total += x
            count += 1
        else:
            deepest = max(deepest, x)
        place = following[place]
    face = total / count if count > 0 else nearest
    return ahead * face, ahead * max(deepest, face)


@inlined
def insert_box(count: int, row: Row, thing: int, detections: Floats, source: Ints) -> int:
    """Insert a box into a list by increasing distance; the farthest falls off a full list.

    Args:
        count: How many are in the list.
        row: The box.
        thing: Object behind it.
        detections: (SLOTS, 7) in and out.
        source: (SLOTS,) object behind each, in and out.

    Returns:
        How many are in the list now.
    """
    x, y, length, width = row
    distance = x * x + y * y
    slot = count
    while slot > 0:
        before = detections[slot - 1]
        if before[signals.DETECTION_X] ** 2 + before[signals.DETECTION_Y] ** 2 <= distance:
            break
        slot -= 1
    if slot == SLOTS:
        return count
    for later in range(min(count, SLOTS - 1), slot, -1):
        source[later] = source[later - 1]
        for column in range(len(signals.DETECTION_COLUMNS)):
            detections[later, column] = detections[later - 1, column]
    detections[slot] = 0.0
    detections[slot, signals.DETECTION_X], detections[slot, signals.DETECTION_Y] = x, y
    detections[slot, signals.DETECTION_LENGTH], detections[slot, signals.DETECTION_WIDTH] = (
        length,
        width,
    )
    detections[slot, signals.DETECTION_CLASS] = _UNKNOWN
    source[slot] = thing
    return min(count + 1, SLOTS)


# --- From the returns of a lidar to detections: what stands together is an object -----------------

GROUND_HEIGHT: Final = LOWEST_LIDAR
"""Returns below this height are of the ground [m]. Our choice: lower than any bumper."""

_NEIGHBOURS: Final = 8
"""How many returns before it in its layer one is compared with. Our choice: noise in range and a
pole in front of a car do not part it."""

_BEAMS_APART: Final = 2.2
"""How many beams apart neighbours may be, far away: two, and a face that stands aslant."""

_WHOLE_TURN: Final = 2.0 * math.pi - 1e-6
"""Field of view from which on the last beam stands beside the first [rad]."""

# Rows of what is known of the returns of a sample; the last is scratch by object.
_X, _Y, _WAY = range(3)
_LABEL, _NEXT, _HEAD, _SIZE, _PARENT, _BEAM = range(6)


class Clustering:
    """Makes the detections of one lidar, once per sample, whoever is linked to it."""

    def __init__(self, specs: Sequence[PhysicalLidar], objects: int) -> None:
        """Prepare for the runs of a batch.

        Args:
            specs: (B) record of the lidar in each run.
            objects: How many there are; behind which one a cluster is, is for the recorder only.
        """
        runs, size = len(specs), specs[0].beams * specs[0].layers
        self._parameters = parameter_record(spec_columns(specs, _numbers))
        self._mask: Bools = np.zeros((runs, SLOTS), dtype=np.bool_)
        self._detections: Floats = np.zeros((runs, SLOTS, len(signals.DETECTION_COLUMNS)))
        self._source: Ints = np.full((runs, SLOTS), -1, dtype=np.int64)
        self._stamp: Floats = np.full(runs, -1.0)
        self._alive: Bools = np.ones(runs, dtype=np.bool_)
        self._room = Room(
            np.zeros((3, size)),
            np.zeros((6, size), dtype=np.int64),
            np.zeros(specs[0].beams, dtype=np.int64),
            np.zeros(objects, dtype=np.int64),
        )

    def detect(self, reading: Measurement) -> Measurement:
        """Return a reading with the detections in its returns; those of old returns stay.

        Args:
            reading: Newest measurement of the lidar, after faults. It is not altered; the
                detections are overwritten at a later tick.
        """
        if reading.points is None or reading.hits is None:
            msg = "a lidar that is to be clustered delivers points and hits"
            raise TypeError(msg)
        todo = reading.fresh | (reading.stamp != self._stamp) | (reading.alive != self._alive)
        if todo.any():
            _cluster_batch(
                todo,
                self._parameters,
                reading.points,
                reading.hits,
                self._room,
                self._mask,
                self._detections,
                self._source,
            )
            self._stamp[:], self._alive[:] = reading.stamp, reading.alive
        return replace(reading, mask=self._mask, detections=self._detections, source=self._source)


def _numbers(spec: PhysicalLidar) -> dict[str, float]:
    return {
        **fields_of(spec.mount, "x", "y", "z"),
        "layers": float(spec.layers),
        "spacing": spec.field_of_view / spec.beams,
        "is_closed": float(spec.field_of_view >= _WHOLE_TURN),
        "cluster_distance": spec.cluster_distance,
        "min_points": float(spec.min_points),
    }


class Room(NamedTuple):
    """Scratch of a sample.

    Attributes:
        places: (3, P) see ``_X``.
        lists: (6, P) see ``_LABEL``.
        below: (beams,) of a layer.
        votes: (M,) by object, zero before and after.
    """

    places: Floats
    lists: Ints
    below: Ints
    votes: Ints


@compiled
def _cluster_batch(  # noqa: PLR0913, PLR0917 - a kernel
    todo: Bools,
    parameters: Any,
    points: Floats,
    hits: Ints,
    room: Room,
    mask: Bools,
    detections: Floats,
    source: Ints,
) -> None:
    """Cluster the returns of some runs.

    Args:
        todo: (B,) which runs; the others are left as they are.
        parameters: (B,) records of the lidar.
        points: (B, P, 3) returns.
        hits: (B, P) object behind each.
        room: Scratch.
        mask: (B, SLOTS) out.
        detections: (B, SLOTS, 7) out.
        source: (B, SLOTS) out.
    """
    places, lists, beams = room.places, room.lists, room.below.shape[0]
    for run in range(todo.shape[0]):
        if not todo[run]:
            continue
        record = parameters[run]
        count = _keep_returns(record, points[run], places, lists[_BEAM])
        labels = _link(record, count, room)
        _gather(count, labels, lists)
        found = 0
        for label in range(labels):
            if lists[_SIZE, label] > 0 and lists[_SIZE, label] >= record["min_points"]:
                row = fit_box(
                    record["x"],
                    record["y"],
                    record["spacing"],
                    lists[_HEAD, label],
                    lists[_NEXT],
                    places[_X],
                    places[_Y],
                    _cut(record, beams, lists[_HEAD, label], lists),
                )
                thing = _behind(lists[_HEAD, label], lists, hits[run], room.votes)
                found = insert_box(found, row, thing, detections[run], source[run])
        for slot in range(found, SLOTS):
            if mask[run, slot]:
                source[run, slot] = -1
                detections[run, slot] = 0.0
        for slot in range(SLOTS):
            mask[run, slot] = slot < found


@inlined
def _keep_returns(record: Any, points: Floats, places: Floats, kept: Ints) -> int:
    """Place the returns that are not of the ground in the vehicle frame; return their number."""
    # Most beams are empty; without a jump, they are soon skipped. NaN compares false.
    found = 0
    for beam in range(points.shape[0]):
        kept[found] = beam
        found += 1 if points[beam, signals.POINT_RANGE] > 0.0 else 0
    count = 0
    for entry in range(found):
        beam = kept[entry]
        way = points[beam, signals.POINT_RANGE]
        if way == math.inf:
            continue
        elevation = points[beam, signals.POINT_ELEVATION]
        rise, level = sin_cos(elevation) if elevation != 0.0 else (0.0, 1.0)
        if not record["z"] + way * rise >= GROUND_HEIGHT:
            continue
        sine, cosine = sin_cos(points[beam, signals.POINT_BEARING])
        places[_X, count] = record["x"] + way * level * cosine
        places[_Y, count] = record["y"] + way * level * sine
        places[_WAY, count] = way * level
        kept[count] = beam
        count += 1
    return count


@inlined
def _link(record: Any, count: int, room: Room) -> int:
    """Label the returns so that those that belong together have labels of one root.

    Returns:
        Number of labels.
    """
    places, lists, below = room.places, room.lists, room.below
    beams = below.shape[0]
    if record["layers"] > 1.0:
        for beam in range(beams):
            below[beam] = -1
    labels, first, layer = 0, 0, -1
    # From there on, the returns before have one label.
    alike = 0
    for place in range(count):
        beam = lists[_BEAM, place]
        if beam // beams != layer:
            if record["is_closed"] > 0.0:
                _close(record, first, place, places, lists)
            first, layer = place, beam // beams
        lists[_LABEL, place] = -1
        _join_before(record, place, max(first, place - _NEIGHBOURS), alike, places, lists)
        if record["layers"] > 1.0:
            _join_below(record, place, beam - layer * beams, places, lists, below)
        if lists[_LABEL, place] < 0:
            lists[_LABEL, place] = lists[_PARENT, labels] = labels
            labels += 1
        if place == first or lists[_LABEL, place] != lists[_LABEL, place - 1]:
            alike = place
    if record["is_closed"] > 0.0:
        _close(record, first, count, places, lists)
    return labels


@inlined
def _join_before(
    record: Any, place: int, begin: int, alike: int, places: Floats, lists: Ints
) -> None:
    """Compare a return with those before it, from one on; since ``alike`` all have one label."""
    if begin == place:
        return
    _join(record, place, place - 1, places, lists)
    # In the midst of an object, whoever has met the last one has met all before.
    if alike > begin or lists[_LABEL, place] != lists[_LABEL, place - 1]:
        for other in range(begin, place - 1):
            _join(record, place, other, places, lists)


@inlined
def _join_below(
    record: Any, place: int, column: int, places: Floats, lists: Ints, below: Ints
) -> None:
    """Compare a return with the one below it on its bearing, and put it in its place."""
    if below[column] >= 0:
        _join(record, place, below[column], places, lists)
    below[column] = place


@inlined
def _close(record: Any, first: int, stop: int, places: Floats, lists: Ints) -> None:
    """Compare the first returns of a layer that goes all around with its last ones."""
    for place in range(first, min(stop, first + _NEIGHBOURS)):
        for other in range(max(place + 1, stop - _NEIGHBOURS), stop):
            _join(record, place, other, places, lists)


@inlined
def _join(record: Any, place: int, other: int, places: Floats, lists: Ints) -> None:
    """Give two returns labels of one root if they are near enough; the second one has a label."""
    label, mine = lists[_LABEL, other], lists[_LABEL, place]
    # Most are: whoever has met one of an object has met the others.
    if label == mine:
        return
    dx = places[_X, place] - places[_X, other]
    dy = places[_Y, place] - places[_Y, other]
    way = max(places[_WAY, place], places[_WAY, other])
    limit = max(record["cluster_distance"], _BEAMS_APART * record["spacing"] * way)
    if not dx * dx + dy * dy <= limit * limit:
        return
    if mine < 0:
        lists[_LABEL, place] = label
    elif mine != label:
        one, two = _root(mine, lists[_PARENT]), _root(label, lists[_PARENT])
        lists[_PARENT, max(one, two)] = min(one, two)


@inlined
def _root(label: int, parent: Ints) -> int:
    """Return the label that stands for all that belong together."""
    while parent[label] != label:
        label = parent[label]
    return label


@inlined
def _gather(count: int, labels: int, lists: Ints) -> None:
    """Chain the returns of each root, in order."""
    for label in range(labels):
        lists[_HEAD, label] = -1
        lists[_SIZE, label] = 0
    for back in range(count):
        place = count - 1 - back
        root = _root(lists[_LABEL, place], lists[_PARENT])
        lists[_NEXT, place] = lists[_HEAD, root]
        lists[_HEAD, root] = place
        lists[_SIZE, root] += 1


@inlined
def _cut(record: Any, beams: int, head: int, lists: Ints) -> float:
    """Tell where the field of view ends on a cluster, see ``fit_box``."""
    if record["is_closed"] > 0.0:
        return 0.0
    left = right = 0.0
    place = head
    while place >= 0:
        column = lists[_BEAM, place] % beams
        if column == 0:
            right = 1.0
        elif column == beams - 1:
            left = 1.0
        place = lists[_NEXT, place]
    return left - right


@inlined
def _behind(head: int, lists: Ints, hits: Ints, votes: Ints) -> int:
    """Return the object of most returns of a cluster, -1 for none; for the recorder only."""
    best, most = -1, 0
    place = head
    while place >= 0:
        thing = hits[lists[_BEAM, place]]
        if 0 <= thing < votes.shape[0]:
            votes[thing] += 1
        place = lists[_NEXT, place]
    for thing in range(votes.shape[0]):
        if votes[thing] > most:
            best, most = thing, votes[thing]
        votes[thing] = 0
    return best
