"""Compiled: what a channel believes, compared with what was true when it looked.

The recorder does this, with the truth; no channel ever sees it. A confirmed track belongs to the
object whose body is nearest to the track's centre, if that is no farther than a gate; of several
tracks of an object the nearest one counts, and the others are no false ones.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.reachable import reachable_distance
from adeye.kernel.road import lane_way, local
from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    OBJECT_HEADING,
    OBJECT_X,
    OBJECT_Y,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
)
from adeye.trace import NO_TRACKS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.signals import Bools, Floats

GATE: Final = 2.5
GATE_GROWTH: Final = 0.05
"""Largest distance of a track's centre from the body of its object [m], and its growth with the
distance from the ego. Our choice: above the distance error of a camera, below that to a neighbour
in the next lane."""


@compiled
def compare_tracks(  # noqa: PLR0913, PLR0917 - a kernel over scene and beliefs
    running: Bools,
    tracks: Floats,
    stamp: Floats,
    step: float,
    tick: int,
    first: int,
    recent: tuple[Floats, Floats, Floats],
    ego: Floats,
    places: Floats,
    objects: Floats,
    sizes: Floats,
    ego_size: Floats,
    friction: Floats,
    segments: Floats,
    error: Floats,
    false: NDArray[Any],
) -> None:
    """Compare the tracks of a channel with the objects at the time of its observation.

    Args:
        running: (B,) runs that have not ended.
        tracks: (B, K, 6) in the vehicle frame of that time; NaN rows are empty.
        stamp: (B,) time of the observation behind the command [s], -1 before the first.
        step: Master clock [s].
        tick: Of now.
        first: Row of the ring's first.
        recent: The rows from there on: ego (R, B, 7), its place (R, B, 6), objects (R, B, M, 5).
        ego: (B, T, 7) the rows before.
        places: (B, T, 6) of the ego.
        objects: (B, T, M, 5).
        sizes: (B, M, 3).
        ego_size: (B, 3).
        friction: (B,) of the road.
        segments: (B, S, 5) reference lines of the roads.
        error: (B, M, 2) out: track minus object along and across the line of sight from the ego
            [m], NaN for an object without a confirmed track.
        false: (B,) out: confirmed tracks that belong to no object and lie within what the ego
            reaches before it can stand.
    """
    for run in range(running.shape[0]):
        false[run] = 0
        for thing in range(error.shape[1]):
            error[run, thing, 0] = error[run, thing, 1] = math.nan
        if not (running[run] and stamp[run] >= 0.0):
            continue
        row = min(round(stamp[run] / step), tick)
        if row >= first:
            own, place = recent[0][row - first, run], recent[1][row - first, run]
            others = recent[2][row - first, run]
        else:
            own, place, others = ego[run, row], places[run, row], objects[run, row]
        sine, cosine = sin_cos(own[EGO_HEADING])
        for track in range(tracks.shape[1]):
            x, y = tracks[run, track, 0], tracks[run, track, 1]
            # NaN compares false, so an empty row is no track.
            if not math.isfinite(x + y):
                continue
            map_x = own[EGO_X] + cosine * x - sine * y
            map_y = own[EGO_Y] + sine * x + cosine * y
            thing = _owner(map_x, map_y, math.sqrt(x * x + y * y), others, sizes[run])
            if thing >= 0:
                _keep_nearest(map_x, map_y, own, others[thing], error[run, thing])
            elif _is_reachable(
                map_x, map_y, tracks[run, track, 4], tracks[run, track, 5], own, place,
                ego_size[run], friction[run], segments[run],
            ):  # fmt: skip
                false[run] += 1


@compiled
def show_nothing(error: Floats, false: NDArray[Any]) -> None:
    """Say that a channel shows no tracks: NaN for every object, ``NO_TRACKS`` false ones."""
    for run in range(error.shape[0]):
        false[run] = NO_TRACKS
        for thing in range(error.shape[1]):
            error[run, thing, 0] = error[run, thing, 1] = math.nan


@inlined
def _owner(x: float, y: float, distance: float, objects: Floats, sizes: Floats) -> int:
    """Return the object whose body is nearest to a track's centre, -1 if none is in the gate."""
    nearest, owner = GATE + GATE_GROWTH * distance, -1
    for thing in range(objects.shape[0]):
        dx, dy = x - objects[thing, OBJECT_X], y - objects[thing, OBJECT_Y]
        half = 0.5 * (sizes[thing, 0] + sizes[thing, 1])
        within = nearest + half
        if dx * dx + dy * dy > within * within:
            continue
        sine, cosine = sin_cos(objects[thing, OBJECT_HEADING])
        along = max(0.0, abs(cosine * dx + sine * dy) - 0.5 * sizes[thing, 0])
        across = max(0.0, abs(cosine * dy - sine * dx) - 0.5 * sizes[thing, 1])
        apart = math.sqrt(along * along + across * across)
        if apart < nearest:
            nearest, owner = apart, thing
    return owner


@inlined
def _keep_nearest(x: float, y: float, own: Floats, other: Floats, error: Floats) -> None:
    """Keep the error of the track whose centre is nearest to that of its object."""
    ux, uy = other[OBJECT_X] - own[EGO_X], other[OBJECT_Y] - own[EGO_Y]
    distance = math.sqrt(ux * ux + uy * uy)
    if distance > 0.0:
        ux, uy = ux / distance, uy / distance
    dx, dy = x - other[OBJECT_X], y - other[OBJECT_Y]
    along, across = ux * dx + uy * dy, ux * dy - uy * dx
    before = error[0] * error[0] + error[1] * error[1]
    if not before <= along * along + across * across:
        error[0], error[1] = along, across


@inlined
def _is_reachable(  # noqa: PLR0913, PLR0917 - a part of the kernel
    x: float,
    y: float,
    length: float,
    width: float,
    own: Floats,
    place: Floats,
    ego_size: Floats,
    friction: float,
    segments: Floats,
) -> bool:
    """Tell whether a body lies in the ego's corridor, no farther than it gets before it stands."""
    s, d, heading, _ = local(segments, x, y)
    apart = lane_way(place[PLACE_S], place[PLACE_HEADING], place[PLACE_D], s, heading)
    gap = apart - 0.5 * (length + ego_size[0])
    beside = abs(d - place[PLACE_D]) - 0.5 * (width + ego_size[1])
    is_ahead = s > place[PLACE_S]
    return bool(is_ahead and beside < 0.0 and gap <= reachable_distance(own[EGO_SPEED], friction))
