"""From the chosen trajectory to the command, and to the places that are shown of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from adeye.channels.driving import HOLD_DECELERATION, LEAST_PREVIEW, PREVIEW_TIME, STANDSTILL
from adeye.channels.pose import POSE_ALIGN, POSE_CURVATURE, POSE_D, POSE_S, POSE_SPEED
from adeye.channels.trajectory.candidates import CANDIDATES, PROFILES
from adeye.channels.trajectory.prediction import SAMPLES
from adeye.channels.trajectory.scoring import LINE_D, LINE_SLOPE
from adeye.kernel.control import lane_keeping_steering
from adeye.kernel.elementary import atan
from adeye.kernel.geometry import wrap_to_pi
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import clip
from adeye.kernel.profiles import PATH_EXISTS, PATH_START, PROFILE_S, PROFILE_SPEED, at_path
from adeye.kernel.road import offset_curvature, position

if TYPE_CHECKING:
    from adeye.signals import Floats

# Columns of a plan.
PLAN_X, PLAN_Y, PLAN_HEADING, PLAN_SPEED = range(4)
PLAN_ROW: Final = 4

SHOWN: Final = (3, 7, 11, 15)
"""Samples of a candidate that are shown, behind the place of the ego itself."""

POINTS: Final = len(SHOWN) + 1

_STARTING: Final = 0.2
"""Acceleration below which a standing ego stays [m/s²], so that it does not creep."""

_ROOM: Final = 1.3
"""How much more lateral acceleration than planned may be used to correct. Our choice."""


@inlined
def steer_along(record: Any, pose: Floats, path: Floats) -> float:
    """Return the steering angle that keeps the ego on a path [rad].

    The curvature is fed forward from where the ego will be when the wheels have turned.

    Args:
        record: Has ``wheelbase``, ``max_steering_angle``, ``steering_lag``, ``period`` and
            ``max_lateral_acceleration``.
        pose: (POSE_WIDTH,).
        path: (PATH_ROW,).
    """
    way = pose[POSE_S] - path[PATH_START]
    d, slope, _ = at_path(path, way)
    ahead = way + pose[POSE_SPEED] * (record["steering_lag"] + 0.5 * record["period"])
    bend = at_path(path, ahead)[2]
    return lane_keeping_steering(
        pose[POSE_D] - d,
        wrap_to_pi(pose[POSE_ALIGN] - atan(slope)),
        offset_curvature(pose[POSE_CURVATURE], d) + bend,
        pose[POSE_SPEED],
        record["wheelbase"],
        0.5 * record["wheelbase"],
        PREVIEW_TIME,
        LEAST_PREVIEW,
        _ROOM * record["max_lateral_acceleration"],
        record["max_steering_angle"],
    )


@inlined
def accelerate(record: Any, speed: float, previous: float, wanted: float) -> float:
    """Return the commanded acceleration on the way to the wanted one [m/s²].

    The command is ahead of the profile by the period that it stands for; the brake's own lag is
    left to the next plan, which begins at the measured speed.

    Args:
        record: Has ``max_jerk`` and ``period``.
        speed: Of the ego [m/s].
        previous: Command at the previous tick [m/s²].
        wanted: By the chosen profile [m/s²].
    """
    if speed < STANDSTILL and wanted < _STARTING:
        return -HOLD_DECELERATION
    if speed < STANDSTILL:
        previous = max(0.0, previous)
    change = record["max_jerk"] * record["period"]
    return clip(wanted, previous - change, previous + change)


@compiled
def show_plan(pose: Floats, segments: Floats, profile: Floats, line: Floats, plan: Floats) -> None:
    """Write the chosen trajectory in the map.

    Args:
        pose: (POSE_WIDTH,).
        segments: (R, 5) reference line of the road.
        profile: (SAMPLES, PROFILE_ROW).
        line: (SAMPLES, LINE_ROW).
        plan: (SAMPLES, PLAN_ROW) out.
    """
    for sample in range(SAMPLES):
        s = pose[POSE_S] + profile[sample, PROFILE_S]
        x, y, heading = position(segments, s, line[sample, LINE_D])
        plan[sample, PLAN_X], plan[sample, PLAN_Y] = x, y
        plan[sample, PLAN_HEADING] = wrap_to_pi(heading + atan(line[sample, LINE_SLOPE]))
        plan[sample, PLAN_SPEED] = profile[sample, PROFILE_SPEED]


@compiled
def show_candidates(
    pose: Floats, segments: Floats, paths: Floats, profiles: Floats, candidates: Floats
) -> None:
    """Write the places of the fan in the map; rows of candidates that cannot be had are NaN.

    Args:
        pose: (POSE_WIDTH,).
        segments: (R, 5) reference line of the road.
        paths: (PATHS, PATH_ROW).
        profiles: (PROFILES + 1, SAMPLES, PROFILE_ROW).
        candidates: (CANDIDATES, POINTS, 2) out.
    """
    for place in range(CANDIDATES):
        path, profile = paths[place // PROFILES], profiles[place % PROFILES]
        candidates[place] = float("nan")
        if path[PATH_EXISTS] == 0.0:
            continue
        for point in range(POINTS):
            way = 0.0
            if point > 0:
                way = profile[SHOWN[point - 1], PROFILE_S]
            d = at_path(path, pose[POSE_S] + way - path[PATH_START])[0]
            x, y, _ = position(segments, pose[POSE_S] + way, d)
            candidates[place, point, 0], candidates[place, point, 1] = x, y
