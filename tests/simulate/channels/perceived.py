"""What a channel has perceived, made up for tests of what is decided by it."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from adeye.ports import Observation
from adeye.signals import Bools, Floats, RoadMap, parameter_record
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.perception.step import NOTE_END, NOTE_WIDTH, Seen
from adeye.simulate.channels.perception.tracking import Sample
from adeye.testing.scenes import object_measurement, pose_measurement, straight_road

LINKS = ("front", "pose")
SENSORS = {"front": "radar", "pose": "localisation", "truth": "ground_truth"}


def shown(  # noqa: PLR0913 - each is one thing that a test may want to set
    ego: Any,
    objects: Any = (),
    time: float = 0.0,
    *,
    links: Sequence[str] = LINKS,
    road: RoadMap | None = None,
    stamp: float | None = None,
    alive: bool = True,
    sight: float = math.inf,
    protect: bool = False,
) -> Observation:
    """Show an ego and objects to a channel that is linked to sensors without error.

    Args:
        ego: x, y, heading, speed and what else is not zero of its state; or a row for each run.
        objects: x, y, heading, speed and acceleration of each, the same in every run.
        time: Of the tick [s].
        links: ``pose``, ``truth``, or any other name of a radar.
        road: A straight one unless given.
        stamp: Time of the pose, if it is another one [s].
        alive: Whether the radars are.
        sight: Of the radars [m].
        protect: As for a plug-in.
    """
    given = np.atleast_2d(np.asarray(ego, dtype=np.float64))
    runs = len(given)
    egos = np.zeros((runs, 7))
    egos[:, : given.shape[1]] = given
    things = np.tile(np.asarray(objects, dtype=np.float64).reshape(1, -1, 5), (runs, 1, 1))
    where = road or straight_road(runs)
    readings = {}
    for link in links:
        if link == "pose":
            readings[link] = pose_measurement(where, egos, time if stamp is None else stamp)
        elif link == "truth":
            readings[link] = object_measurement(egos, things, time, road=where)
        else:
            readings[link] = object_measurement(egos, things, time, sight=sight)
            readings[link].alive[:] = alive
    running = np.ones(runs, dtype=np.bool_)
    return observe(links, time, readings, {}, None, running, protect=protect)


def perceived(
    fields: dict[str, Any], pose: Floats, tracks: Floats, road: RoadMap | None = None
) -> Seen:
    """Return what is known in one run, of as many tracks as there are rows."""
    notes = np.zeros((1, NOTE_WIDTH))
    notes[0, NOTE_END] = len(tracks)
    return Seen(
        parameter_record({name: np.array([value]) for name, value in fields.items()}),
        (road or straight_road()).grounds(),
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
