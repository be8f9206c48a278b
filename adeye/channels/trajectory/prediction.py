"""Where the tracks will be: in road coordinates, at the sample times of the candidates.

What is predicted of an object is in ``kernel.prediction``. Road coordinates are taken as straight
over the length of a body.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.channels.corridor import MAX_SPEED_VARIANCE
from adeye.channels.pose import POSE_HEADING, POSE_S, POSE_X, POSE_Y
from adeye.channels.tracks import (
    TRACK_BRAKING,
    TRACK_CLASS,
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_VAR_VX,
    TRACK_VAR_VY,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
)
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.prediction import (
    MIN_LATERAL_SPEED,
    OBJECT_BEHIND,
    OBJECT_D,
    OBJECT_LENGTH,
    OBJECT_S,
    OBJECT_SPEED,
    OBJECT_WIDTH,
    predict_body,
)
from adeye.kernel.road import local
from adeye.signals import FIRST_FREE, LAST_FREE

if TYPE_CHECKING:
    from adeye.signals import Floats

SAMPLES: Final = 16
"""Times at which candidates and predictions are compared, evenly over the horizon."""


@compiled
def predict_objects(  # noqa: PLR0913, PLR0917 - a kernel
    tracks: Floats,
    end: int,
    pose: Floats,
    segments: Floats,
    ego_length: float,
    lane_width: float,
    lanes: int,
    confirm_hits: float,
    interval: float,
    objects: Floats,
    ways: Floats,
) -> int:
    """Predict the confirmed tracks.

    Args:
        tracks: (K, TRACK_STATE).
        end: Rows of tracks from here on are free places.
        pose: (POSE_WIDTH,).
        segments: (R, 5) reference line of the road.
        ego_length: [m].
        lane_width: [m].
        lanes: How many there are.
        confirm_hits: Detections that confirm a track.
        interval: Time between two samples [s]; the first is one interval ahead.
        objects: (K, OBJECT_ROW) out.
        ways: (K, N, WAY_ROW) out, N samples.

    Returns:
        How many objects there are.
    """
    count = 0
    sine, cosine = sin_cos(pose[POSE_HEADING])
    for row in range(end):
        track = tracks[row]
        if track[TRACK_HITS] < confirm_hits or track[TRACK_VAR_VX] > MAX_SPEED_VARIANCE:
            continue
        x = pose[POSE_X] + cosine * track[TRACK_X] - sine * track[TRACK_Y]
        y = pose[POSE_Y] + sine * track[TRACK_X] + cosine * track[TRACK_Y]
        s, d, heading, _ = local(segments, x, y)
        turn_sine, turn_cosine = sin_cos(pose[POSE_HEADING] - heading)
        forward = turn_cosine * track[TRACK_VX] - turn_sine * track[TRACK_VY]
        sideways = turn_sine * track[TRACK_VX] + turn_cosine * track[TRACK_VY]
        if not np.isfinite(s + d + forward + sideways):
            continue
        body = objects[count]
        body[OBJECT_LENGTH], body[OBJECT_WIDTH] = track[TRACK_LENGTH], track[TRACK_WIDTH]
        body[OBJECT_S], body[OBJECT_D] = s - pose[POSE_S], d
        body[OBJECT_SPEED] = forward
        reach = 0.5 * (ego_length + track[TRACK_LENGTH])
        body[OBJECT_BEHIND] = 1.0 if body[OBJECT_S] <= -reach else 0.0
        is_free = FIRST_FREE <= track[TRACK_CLASS] <= LAST_FREE
        is_sure = abs(sideways) - math.sqrt(track[TRACK_VAR_VY]) >= MIN_LATERAL_SPEED
        if not is_free and not is_sure:
            sideways = 0.0
        predict_body(
            body, sideways, is_free, track[TRACK_BRAKING], lane_width, lanes, interval, ways[count]
        )
        count += 1
    return count
