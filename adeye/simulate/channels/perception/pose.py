"""Where the ego is, as a channel knows it: its ego estimate, filtered and carried to the tick.

A sample is old when it arrives. It is carried forward at its own speed, acceleration and yaw rate,
and a fixed-gain filter in road coordinates takes the noise out of lateral place and heading.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye import signals
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.relation import TIME_SLACK
from adeye.kernel.road import local, position
from adeye.signals import Floats

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.spec.architecture import Vehicle

# Columns of an ego pose row.
(
    POSE_STAMP,  # time of the newest sample that is in it [s], -1 before the first
    POSE_S,  # along the road [m]
    POSE_D,  # from the right edge to the left [m]
    POSE_ALIGN,  # heading relative to the road [rad]
    POSE_SPEED,  # [m/s]
    POSE_ACCELERATION,  # [m/s²]
    POSE_YAW_RATE,  # [rad/s]
    POSE_CURVATURE,  # of the road at its place [1/m]
    POSE_X,  # in the map [m]
    POSE_Y,  # [m]
    POSE_HEADING,  # [rad]
    POSE_REAR,  # how far the rear axle is behind the box centre [m], which is no estimate
) = range(12)
POSE_WIDTH: Final = 12

LATERAL_GAIN: Final = 0.5
HEADING_GAIN: Final = 0.3
SPEED_GAIN: Final = 0.5
"""Share of a sample's innovation that is taken over.

Of white noise a gain g leaves the share sqrt(g / (2 - g)): 0.58 at 0.5, 0.42 at 0.3. Our choice:
the lane keeping of both channels is slower than the filter by a factor of ten.
"""

_COLUMNS: Final = len(signals.ESTIMATE_COLUMNS)

MAX_AGE: Final = 0.5
"""Age of the newest sample from which the ego does not know where it is [s].

At 0.5 s and 36 m/s an unknown yaw rate of 0.01 rad/s has moved the ego 0.045 m aside and an unknown
deceleration of 8 m/s² has changed its place by 1 m; our choice.
"""


@compiled
def clear_pose(pose: Floats) -> None:
    """Set a pose (POSE_WIDTH,) to what is known before the first sample: the vehicle only."""
    rear = pose[POSE_REAR]
    pose[:] = 0.0
    pose[POSE_REAR] = rear
    pose[POSE_STAMP] = -1.0


def first_poses(vehicles: Sequence[Vehicle]) -> Floats:
    """Return the poses (B, POSE_WIDTH) of vehicles before the first sample."""
    poses = np.zeros((len(vehicles), POSE_WIDTH))
    poses[:, POSE_REAR] = [0.5 * vehicle.wheelbase for vehicle in vehicles]
    poses[:, POSE_STAMP] = -1.0
    return poses


@inlined
def has_pose(pose: Floats, time: float) -> bool:
    """Tell whether a pose (POSE_WIDTH,) rests on a sample that is recent enough."""
    return bool(pose[POSE_STAMP] >= 0.0 and time - pose[POSE_STAMP] <= MAX_AGE + TIME_SLACK)


@inlined
def update_pose(
    pose: Floats, segments: Floats, estimate: Floats, stamp: float, time: float, period: float
) -> None:
    """Carry a pose on by one tick of the channel and correct it by a new sample, if there is one.

    Args:
        pose: (POSE_WIDTH,) in and out.
        segments: (K, 5) reference line of the road.
        estimate: (13,) newest sample, see ``signals.ESTIMATE_COLUMNS``.
        stamp: Its time [s], -1 before the first.
        time: Now [s].
        period: Time since the previous call [s].
    """
    is_new = stamp > pose[POSE_STAMP] and _is_finite(estimate)
    is_first = pose[POSE_STAMP] < 0.0
    if is_first and not is_new:
        return
    if not is_first:
        _carry(pose, period)
    if is_new:
        _correct(pose, estimate, time - stamp, is_first)
        pose[POSE_STAMP] = stamp
    x, y, road_heading = position(segments, pose[POSE_S], pose[POSE_D])
    pose[POSE_X], pose[POSE_Y] = x, y
    pose[POSE_HEADING] = wrap_to_pi(road_heading + pose[POSE_ALIGN])
    pose[POSE_CURVATURE] = local(segments, x, y)[3]


@inlined
def _is_finite(estimate: Floats) -> bool:
    """Tell whether all numbers are finite; zero times one that is not is NaN."""
    total = 0.0
    for column in range(_COLUMNS):
        total += 0.0 * estimate[column]
    return total == 0.0


@inlined
def _carry(pose: Floats, duration: float) -> None:
    """Move a pose on at constant acceleration and yaw rate, stopping at standstill."""
    pose[POSE_S], pose[POSE_D], pose[POSE_ALIGN], pose[POSE_SPEED] = _carried(
        pose[POSE_S],
        pose[POSE_D],
        pose[POSE_ALIGN],
        pose[POSE_CURVATURE],
        pose[POSE_SPEED],
        pose[POSE_ACCELERATION],
        pose[POSE_YAW_RATE],
        pose[POSE_REAR],
        duration,
    )


@inlined
def _carried(  # noqa: PLR0913, PLR0917 - a kernel; numbers, because an array costs more than it
    s: float,
    d: float,
    align: float,
    curvature: float,
    speed: float,
    acceleration: float,
    yaw_rate: float,
    rear: float,
    duration: float,
) -> tuple[float, float, float, float]:
    """Return s, d, heading relative to the road and speed some time later."""
    later = max(0.0, speed + acceleration * duration)
    way = 0.5 * (speed + later) * duration
    turn = yaw_rate * duration
    # The rear axle moves along the heading, the box centre swings around it.
    slip = rear * turn
    # A way on the inside of a curve is longer in terms of the reference line.
    scale = max(0.1, 1.0 - d * curvature)
    sine, cosine = sin_cos(align + 0.5 * (turn - curvature * way / scale))
    along = (way * cosine - slip * sine) / scale
    return (
        s + along,
        d + (way * sine + slip * cosine),
        wrap_to_pi(align + turn - curvature * along),
        later,
    )


@inlined
def _correct(pose: Floats, estimate: Floats, age: float, is_first: bool) -> None:  # noqa: FBT001 - a kernel
    s, d, align, now = _carried(
        estimate[signals.ESTIMATE_PLACE + signals.PLACE_S],
        estimate[signals.ESTIMATE_PLACE + signals.PLACE_D],
        wrap_to_pi(
            estimate[signals.EGO_HEADING] - estimate[signals.ESTIMATE_PLACE + signals.PLACE_HEADING]
        ),
        estimate[signals.ESTIMATE_PLACE + signals.PLACE_CURVATURE],
        estimate[signals.EGO_SPEED],
        estimate[signals.EGO_ACCELERATION],
        estimate[signals.EGO_YAW_RATE],
        pose[POSE_REAR],
        age,
    )
    lateral, heading, speed = LATERAL_GAIN, HEADING_GAIN, SPEED_GAIN
    if is_first:
        lateral = heading = speed = 1.0
    pose[POSE_S] = s
    pose[POSE_D] += lateral * (d - pose[POSE_D])
    turn = heading * wrap_to_pi(align - pose[POSE_ALIGN])
    pose[POSE_ALIGN] = wrap_to_pi(pose[POSE_ALIGN] + turn)
    pose[POSE_SPEED] += speed * (now - pose[POSE_SPEED])
    pose[POSE_ACCELERATION] = estimate[signals.EGO_ACCELERATION]
    pose[POSE_YAW_RATE] = estimate[signals.EGO_YAW_RATE]
