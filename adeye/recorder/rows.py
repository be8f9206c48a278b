"""The rows of a trace in compiled loops: what a reading shows, and from the ring to the columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.signals import (
    DETECTION_X,
    DETECTION_Y,
    EGO_HEADING,
    EGO_X,
    EGO_Y,
    POINT_BEARING,
    POINT_ELEVATION,
    POINT_RANGE,
)
from adeye.spec.sensors import LOWEST_LIDAR

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints


@compiled
def mark_detected(mask: Bools, source: Ints, detected: Bools) -> None:
    """Mark the objects behind detections, for the record only.

    Args:
        mask: (B, M) detections that are there.
        source: (B, M) object behind each.
        detected: (B, M) out, by object.
    """
    for run in range(mask.shape[0]):
        for thing in range(detected.shape[1]):
            detected[run, thing] = False
        for slot in range(mask.shape[1]):
            thing = source[run, slot]
            if mask[run, slot] and thing >= 0:
                detected[run, thing] = True


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
def place_points(  # noqa: PLR0913, PLR0917 - a kernel
    runs: Bools,
    points: Floats,
    stamp: Floats,
    mounts: Floats,
    step: float,
    ego: Floats,
    places: Any,
) -> None:
    """Place the returns of a lidar in the map, evenly thinned; those of the ground are left out.

    Args:
        runs: (B,) runs to record.
        points: (B, P, 3).
        stamp: (B,) time of the sample [s]; before the first one there are no returns.
        mounts: (B, 4) x, y, z, yaw of the lidar.
        step: Master clock [s].
        ego: (B, T, 7) recorded ego states, which hold the pose at the sample's time.
        places: (B, K, 2) NaN in, out [m].
    """
    most = places.shape[1]
    for run in range(runs.shape[0]):
        if not runs[run] or stamp[run] < 0.0:
            continue
        row = round(stamp[run] / step)
        total = 0
        for beam in range(points.shape[1]):
            total += 1 if _rises(points[run, beam], mounts[run, 2]) else 0
        sine, cosine = sin_cos(ego[run, row, EGO_HEADING])
        count = 0
        for beam in range(points.shape[1]):
            if not _rises(points[run, beam], mounts[run, 2]):
                continue
            # The first one of each of equal parts.
            slot = count if total <= most else count * most // total
            is_first = total <= most or count == 0 or slot != (count - 1) * most // total
            count += 1
            if is_first:
                bearing = sin_cos(points[run, beam, POINT_BEARING])
                way = (
                    points[run, beam, POINT_RANGE] * sin_cos(points[run, beam, POINT_ELEVATION])[1]
                )
                x, y = mounts[run, 0] + way * bearing[1], mounts[run, 1] + way * bearing[0]
                places[run, slot, 0] = ego[run, row, EGO_X] + cosine * x - sine * y
                places[run, slot, 1] = ego[run, row, EGO_Y] + sine * x + cosine * y


@inlined
def _rises(point: Floats, height: float) -> bool:
    """Tell whether there is a return that is not of the ground."""
    way = point[POINT_RANGE]
    return bool(way > 0.0 and height + way * sin_cos(point[POINT_ELEVATION])[0] >= LOWEST_LIDAR)


@compiled
def clear(column: Any, length: Ints, rows: int) -> None:
    """Zero the rows of a column (B, T, W) beyond the length of each run."""
    for run in range(length.shape[0]):
        for row in range(length[run], rows):
            for place in range(column.shape[2]):
                column[run, row, place] = 0


@compiled
def move(ring: Any, first: int, length: Ints, column: Any) -> None:
    """Move what the ring has collected of one column.

    Args:
        ring: (RING, B, W) rows of all runs side by side.
        first: Row of the ring's first.
        length: (B,) rows that each run has so far.
        column: (B, T, W) out.
    """
    for run in range(ring.shape[1]):
        for row in range(min(length[run] - first, ring.shape[0])):
            for place in range(ring.shape[2]):
                column[run, first + row, place] = ring[row, run, place]
