"""The rows of a trace in compiled loops: what a reading shows, and from the ring to the columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled
from adeye.signals import DETECTION_X, DETECTION_Y, EGO_HEADING, EGO_X, EGO_Y

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
