"""When a track counts: enough detections among the last samples that could have shown it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from adeye.channels.tracks import TRACK_BEGUN_BY, TRACK_COST, TRACK_HISTORY, TRACK_HITS
from adeye.kernel.jit import inlined

if TYPE_CHECKING:
    from adeye.signals import Floats

CONFIRM_HITS, CONFIRM_WINDOW, CONFIRM_SENSOR = range(3)
"""What confirms a track, as kernels hand it on: detections, samples among which they must be (0 for
any), number of the sensor whose sample is being used."""

_HIT: Final = -1.0
"""Mark of a track that this sample has shown, in the column of its cost, which is not negative."""


@inlined
def count_hit(track: Floats, confirm: tuple[float, float, float]) -> None:
    """Count a detection of a track, by any sensor.

    With a window, the hits of a track that is not confirmed yet are those among its last samples;
    a confirmed track stays so.

    Args:
        track: (TRACK_STATE,) in and out.
        confirm: See ``CONFIRM_HITS``.
    """
    hits, window = confirm[CONFIRM_HITS], confirm[CONFIRM_WINDOW]
    track[TRACK_COST] = _HIT
    if window > 0.0 and track[TRACK_HITS] < hits:
        track[TRACK_HITS] = _remembered(track, 1, int(window))
    else:
        track[TRACK_HITS] += 1.0


@inlined
def count_misses(tracks: Floats, end: int, confirm: tuple[float, float, float]) -> None:
    """Count a sample that did not show tracks, which are not confirmed yet.

    A sensor that has not begun a track may look elsewhere, so only the one that did can miss it. A
    track whose last hit is forgotten is free.

    Args:
        tracks: (K, TRACK_STATE) in and out.
        end: Of the tracks.
        confirm: See ``CONFIRM_HITS``.
    """
    hits, window = confirm[CONFIRM_HITS], confirm[CONFIRM_WINDOW]
    if not window > 0.0:
        return
    for row in range(end):
        track = tracks[row]
        was_hit = track[TRACK_COST] == _HIT
        # The next sample may be empty, and then nobody asks for the cost.
        track[TRACK_COST] = 0.0
        is_tentative = 0.0 < track[TRACK_HITS] < hits
        if is_tentative and not was_hit and track[TRACK_BEGUN_BY] == confirm[CONFIRM_SENSOR]:
            track[TRACK_HITS] = _remembered(track, 0, int(window))


@inlined
def _remembered(track: Floats, newest: int, window: int) -> float:
    """Remember whether the newest sample shows the track; return the hits among the last ones."""
    history = (2 * int(track[TRACK_HISTORY]) + newest) % (1 << window)
    track[TRACK_HISTORY] = float(history)
    hits = 0
    while history > 0:
        hits += history & 1
        history >>= 1
    return float(hits)
