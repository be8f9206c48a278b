"""What a channel has perceived, made up for tests of what is decided by it."""

from typing import Any

import numpy as np

from adeye.signals import Bools, Floats, parameter_record
from adeye.simulate.channels.perception.step import NOTE_END, NOTE_WIDTH, Seen
from adeye.simulate.channels.perception.tracking import Sample


def perceived(fields: dict[str, Any], pose: Floats, tracks: Floats, segments: Floats) -> Seen:
    """Return what is known in one run, of as many tracks as there are rows."""
    notes = np.zeros((1, NOTE_WIDTH))
    notes[0, NOTE_END] = len(tracks)
    return Seen(
        parameter_record({name: np.array([value]) for name, value in fields.items()}),
        segments[np.newaxis],
        np.ones(1, dtype=np.bool_),
        pose[np.newaxis],
        tracks[np.newaxis],
        notes,
        np.zeros(1, dtype=np.bool_),
        np.zeros((1, len(tracks), 6)),
    )


def sample_of(
    accuracy: Floats,
    detections: Floats,
    stamp: float,
    age: float = 0.0,
    mask: Bools | None = None,
) -> Sample:
    """Return a sample of a sensor in the origin."""
    size = len(detections)
    return Sample(
        accuracy,
        np.zeros(2),
        stamp,
        age,
        np.ones(size, dtype=np.bool_) if mask is None else mask,
        detections,
        np.zeros((size, 2)),
        np.zeros(size, dtype=np.int64),
    )
