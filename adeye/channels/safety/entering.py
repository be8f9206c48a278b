"""Whether a safe stop cuts up somebody in a lane that it enters or crosses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.channels.pose import POSE_D
from adeye.channels.trajectory.obstacles import is_cut_up
from adeye.kernel.jit import inlined
from adeye.kernel.profiles import (
    PATH_LENGTH,
    PATH_TARGET,
    PROFILE_S,
    PROFILE_SPEED,
    at_path,
)
from adeye.kernel.stops import REFUGE, STOP_SAMPLES

if TYPE_CHECKING:
    from adeye.signals import Floats


@inlined
def cuts_up(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    pose: Floats,
    row: int,
    path: Floats,
    begun: float,
    profile: Floats,
    count: int,
    objects: Floats,
    ways: Floats,
) -> bool:
    """Tell whether a path to the right cuts up somebody in a lane that it enters or crosses.

    Args:
        record: See ``trajectory.obstacles.is_cut_up``.
        pose: (POSE_WIDTH,).
        row: Which of the paths it is.
        path: (PATH_ROW,).
        begun: Way along the path that is behind the ego [m].
        profile: (STOP_SAMPLES, PROFILE_ROW).
        count: How many objects there are.
        objects: (K, OBJECT_ROW).
        ways: (K, STOP_SAMPLES, WAY_ROW).
    """
    target, width = path[PATH_TARGET], record["lane_width"]
    speed = 0.0
    if np.isnan(target) or target < 0.0:
        # Only those who come before the ego has left the lane count.
        for sample in range(STOP_SAMPLES):
            way = begun + profile[sample, PROFILE_S]
            is_out = way >= path[PATH_LENGTH]
            if row == REFUGE:
                is_out = at_path(path, way)[0] <= -0.5 * record["width"]
            if is_out:
                speed = profile[sample, PROFILE_SPEED]
                break
        if is_cut_up(record, target, False, pose[POSE_D], 0.0, objects, ways, count):  # noqa: FBT003
            return True
    lane = 0.5 * width
    while lane < pose[POSE_D] - 0.5 * width:
        if lane >= target - 0.01 and is_cut_up(
            record,
            lane,
            True,  # noqa: FBT003 - a kernel
            pose[POSE_D],
            speed,
            objects,
            ways,
            count,
        ):
            return True
        lane += width
    return False


@inlined
def strays(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    center: float,
    path: Floats,
    begun: float,
    profile: Floats,
    count: int,
    objects: Floats,
    ways: Floats,
) -> bool:
    """Tell whether straight on leads into a lane in which it cuts up somebody.

    Args:
        record: See ``trajectory.obstacles.is_cut_up``.
        center: Centre of the ego's lane [m].
        path: (PATH_ROW,).
        begun: Way along the path that is behind the ego [m].
        profile: (STOP_SAMPLES, PROFILE_ROW).
        count: How many objects there are.
        objects: (K, OBJECT_ROW).
        ways: (K, STOP_SAMPLES, WAY_ROW).
    """
    end = at_path(path, begun + profile[STOP_SAMPLES - 1, PROFILE_S])[0]
    width = record["lane_width"]
    beside = 0.5 * (width + record["width"])
    for row in range(int(record["lanes"])):
        lane = (row + 0.5) * width
        # Beyond its own lane as far as the one in which it ends up, if only with its side. Whoever
        # is over the edge of its lane already can still come back, so that is asked, too.
        is_left = center + 0.5 * width < lane < end + beside
        is_right = end - beside < lane < center - 0.5 * width
        if (is_left or is_right) and is_cut_up(
            record,
            lane,
            True,  # noqa: FBT003 - a kernel
            center,
            0.0,
            objects,
            ways,
            count,
        ):
            return True
    return False
