"""The rows of a trace in compiled loops: into the ring, and from the ring to the columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.signals import DETECTION_X, DETECTION_Y, EGO_HEADING, EGO_X, EGO_Y

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints

# Places of the columns in ``at``, the beginnings of their parts of a ring's row.
(
    _EGO,
    _EGO_PLACE,
    _OBJECTS,
    _OBJECT_PLACES,
    _BEGUN,
    _CONTACT,
    _IMPACT_SPEED,
    _FOREIGN_CONTACT,
    _SENSOR_STAMP,
    _SENSOR_ALIVE,
    _DETECTED,
    _ACCELERATION,
    _STEERING_ANGLE,
    _STAMP,
    _STATUS,
    _MONITORS,
    _AUTHORITY,
    _REASON,
    _COMMAND,
    _FAULT_ACTIVE,
) = range(20)


@compiled
def add_scene(  # noqa: C901, PLR0913, PLR0917 - a kernel
    is_open: Bools,
    running: Bools,
    row: int,
    ego: Floats,
    ego_place: Floats,
    objects: Floats,
    object_places: Floats,
    begun: Floats,
    contact: Ints,
    impact_speed: Floats,
    foreign_contact: Bools,
    out: Floats,
    length: Ints,
) -> None:
    """Write the scene of every run that is open, and close those that have ended in it.

    Its parts lie one after the other at the beginning of a row; what was decided is zeroed.
    """
    for run in range(is_open.shape[0]):
        if not is_open[run]:
            continue
        is_open[run] = running[run]
        length[run] = row + 1
        place = 0
        for column in range(ego.shape[1]):
            out[run, place + column] = ego[run, column]
        place += ego.shape[1]
        for column in range(ego_place.shape[1]):
            out[run, place + column] = ego_place[run, column]
        place += ego_place.shape[1]
        for thing in range(objects.shape[1]):
            for column in range(objects.shape[2]):
                out[run, place + column] = objects[run, thing, column]
            place += objects.shape[2]
        for thing in range(object_places.shape[1]):
            for column in range(object_places.shape[2]):
                out[run, place + column] = object_places[run, thing, column]
            place += object_places.shape[2]
        for event in range(begun.shape[1]):
            out[run, place + event] = begun[run, event]
        place += begun.shape[1]
        out[run, place] = contact[run]
        out[run, place + 1] = impact_speed[run]
        out[run, place + 2] = foreign_contact[run]
        for column in range(place + 3, out.shape[1]):
            out[run, column] = 0.0


@compiled
def add_reading(  # noqa: PLR0913, PLR0917 - a kernel
    runs: Bools,
    sensor: int,
    sensors: int,
    stamp: Floats,
    alive: Bools,
    mask: Bools,
    source: Ints,
    at: Ints,
    out: Floats,
) -> None:
    """Write a reading: detections are sorted by true object, for the record only.

    Args:
        runs: (B,) runs to record.
        sensor: Its index.
        sensors: How many there are.
        stamp: (B,) time of the sample [s].
        alive: (B,) whether the sensor delivers.
        mask: (B, M) detections that are there.
        source: (B, M) object behind each.
        at: Beginnings of the columns in a row of the ring.
        out: (B, W) row of the present tick, out.
    """
    objects = (at[_DETECTED + 1] - at[_DETECTED]) // sensors
    for run in range(runs.shape[0]):
        if not runs[run]:
            continue
        out[run, at[_SENSOR_STAMP] + sensor] = stamp[run]
        out[run, at[_SENSOR_ALIVE] + sensor] = alive[run]
        for slot in range(mask.shape[1]):
            thing = source[run, slot]
            if mask[run, slot] and thing >= 0:
                out[run, at[_DETECTED] + sensor * objects + thing] = 1.0


@compiled
def place_detections(  # noqa: PLR0913, PLR0917 - a kernel
    runs: Bools,
    mask: Bools,
    detections: Floats,
    source: Ints,
    stamp: Floats,
    step: float,
    ego: Floats,
    places: Floats,
) -> None:
    """Place detections in the map, sorted by true object.

    Args:
        runs: (B,) runs to record.
        mask: (B, M) detections that are there.
        detections: (B, M, 7).
        source: (B, M) object behind each.
        stamp: (B,) time of the sample [s].
        step: Master clock [s].
        ego: (B, T, 7) recorded ego states, which hold the pose at the sample's time.
        places: (B, M, 2) out [m].
    """
    for run in range(runs.shape[0]):
        if not runs[run]:
            continue
        row = round(stamp[run] / step)
        for slot in range(mask.shape[1]):
            thing = source[run, slot]
            if not mask[run, slot] or thing < 0:
                continue
            x = detections[run, slot, DETECTION_X]
            y = detections[run, slot, DETECTION_Y]
            sine, cosine = sin_cos(ego[run, row, EGO_HEADING])
            places[run, thing, 0] = ego[run, row, EGO_X] + cosine * x - sine * y
            places[run, thing, 1] = ego[run, row, EGO_Y] + sine * x + cosine * y


@compiled
def add_proposal(  # noqa: PLR0913, PLR0917 - a kernel
    runs: Bools,
    channel: int,
    first_monitor: int,
    acceleration: Floats,
    steering_angle: Floats,
    stamp: Floats,
    status: Ints,
    monitors: Bools,
    at: Ints,
    out: Floats,
) -> None:
    """Write what one channel proposes."""
    for run in range(runs.shape[0]):
        if not runs[run]:
            continue
        out[run, at[_ACCELERATION] + channel] = acceleration[run]
        out[run, at[_STEERING_ANGLE] + channel] = steering_angle[run]
        out[run, at[_STAMP] + channel] = stamp[run]
        out[run, at[_STATUS] + channel] = status[run]
        for monitor in range(monitors.shape[1]):
            for side in range(2):
                place = at[_MONITORS] + 2 * (first_monitor + monitor) + side
                out[run, place] = monitors[run, monitor, side]


@compiled
def add_decision(  # noqa: PLR0913, PLR0917 - a kernel
    runs: Bools,
    channel: Ints,
    reason: Ints,
    command: Floats,
    active: Bools,
    at: Ints,
    out: Floats,
) -> None:
    """Write who acts, why, how, and which faults are present."""
    for run in range(runs.shape[0]):
        if not runs[run]:
            continue
        out[run, at[_AUTHORITY]] = channel[run]
        out[run, at[_REASON]] = reason[run]
        out[run, at[_COMMAND]] = command[run, 0]
        out[run, at[_COMMAND] + 1] = command[run, 1]
        for fault in range(active.shape[1]):
            out[run, at[_FAULT_ACTIVE] + fault] = active[run, fault]


@compiled
def clear(column: Any, length: Ints, rows: int) -> None:
    """Zero the rows of a column (B, T, W) beyond the length of each run."""
    for run in range(length.shape[0]):
        for row in range(length[run], rows):
            for place in range(column.shape[2]):
                column[run, row, place] = 0


@inlined
def move_column(ring: Floats, run: int, first: int, end: int, begin: int, column: Any) -> None:
    """Move one column of one run."""
    for row in range(first, end):
        for place in range(column.shape[2]):
            column[run, row, place] = ring[run, row - first, begin + place]


@compiled
def move(  # noqa: PLR0913, PLR0917 - a kernel over all columns
    ring: Floats,
    first: int,
    length: Ints,
    at: Ints,
    ego: Floats,
    ego_place: Floats,
    objects: Floats,
    object_places: Floats,
    begun: Floats,
    contact: Any,
    impact_speed: Floats,
    foreign_contact: Bools,
    sensor_stamp: Floats,
    sensor_alive: Bools,
    detected: Bools,
    acceleration: Floats,
    steering_angle: Floats,
    stamp: Floats,
    status: Any,
    monitors: Bools,
    authority: Any,
    reason: Any,
    command: Floats,
    fault_active: Bools,
) -> None:
    """Move what the ring (B, RING, W) has collected to the columns (B, T, ...).

    ``first`` is the row of the ring's first, ``length`` (B,) the rows that each run has so far,
    ``at`` where the columns begin in a row of the ring.
    """
    for run in range(length.shape[0]):
        end = min(length[run], first + ring.shape[1])
        if end <= first:
            continue
        move_column(ring, run, first, end, at[_EGO], ego)
        move_column(ring, run, first, end, at[_EGO_PLACE], ego_place)
        move_column(ring, run, first, end, at[_OBJECTS], objects)
        move_column(ring, run, first, end, at[_OBJECT_PLACES], object_places)
        move_column(ring, run, first, end, at[_BEGUN], begun)
        move_column(ring, run, first, end, at[_CONTACT], contact)
        move_column(ring, run, first, end, at[_IMPACT_SPEED], impact_speed)
        move_column(ring, run, first, end, at[_FOREIGN_CONTACT], foreign_contact)
        move_column(ring, run, first, end, at[_SENSOR_STAMP], sensor_stamp)
        move_column(ring, run, first, end, at[_SENSOR_ALIVE], sensor_alive)
        move_column(ring, run, first, end, at[_DETECTED], detected)
        move_column(ring, run, first, end, at[_ACCELERATION], acceleration)
        move_column(ring, run, first, end, at[_STEERING_ANGLE], steering_angle)
        move_column(ring, run, first, end, at[_STAMP], stamp)
        move_column(ring, run, first, end, at[_STATUS], status)
        move_column(ring, run, first, end, at[_MONITORS], monitors)
        move_column(ring, run, first, end, at[_AUTHORITY], authority)
        move_column(ring, run, first, end, at[_REASON], reason)
        move_column(ring, run, first, end, at[_COMMAND], command)
        move_column(ring, run, first, end, at[_FAULT_ACTIVE], fault_active)
