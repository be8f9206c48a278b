"""What a candidate costs by itself: progress, comfort, limits of vehicle and road.

Costs are sums of terms >= 0, so that a candidate can be dropped as soon as it costs more than the
best so far. The terms and their weights are our choice; what they are made of is cited where used.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from adeye.channels.trajectory.prediction import SAMPLES
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.profiles import PROFILE_ACCELERATION, PROFILE_S, PROFILE_SPEED, at_path

if TYPE_CHECKING:
    from adeye.signals import Floats

# Columns of the sample of a candidate.
(
    LINE_D,  # lateral place [m]
    LINE_SLOPE,  # its change along the road
) = range(2)
LINE_ROW: Final = 2

_SPEEDING: Final = 200.0
_SPEEDING_FROM: Final = 0.5
"""What it costs to become faster than allowed by more than this [m/s], against being slower. Our
choice."""

PROGRESS_KNEE: Final = 1.0
"""Error of the speed from which the cost grows with its amount, no longer squared [m/s]."""


@inlined
def rounded_square(error: float, knee: float) -> float:
    """Return the square up to a knee, and go on with its slope beyond (Huber's function).

    >>> rounded_square(0.5, 1.0), rounded_square(-3.0, 1.0)
    (0.25, 5.0)
    """
    size = abs(error)
    return size * size if size <= knee else knee * (2.0 * size - knee)


@compiled
def profile_cost(
    record: Any, profile: Floats, wanted: float, previous: float, speed: float, allowed: float
) -> float:
    """Return what a speed profile costs on any path: progress and comfort.

    Args:
        record: Has the weights of progress, comfort and jerk.
        profile: (SAMPLES, PROFILE_ROW).
        wanted: Acceleration that it leads to [m/s²].
        previous: That of the previous choice [m/s²].
        speed: Of the ego now [m/s].
        allowed: Speed that desire, limit and curves allow [m/s].
    """
    progress = 0.0
    for sample in range(SAMPLES):
        missing = allowed - profile[sample, PROFILE_SPEED]
        cost = rounded_square(missing, PROGRESS_KNEE)
        progress += cost if missing > 0.0 else 2.0 * cost
        # To escape by speeding up is for no one to rely on.
        faster = profile[sample, PROFILE_SPEED] - max(allowed, speed) - _SPEEDING_FROM
        progress += _SPEEDING * rounded_square(max(0.0, faster), PROGRESS_KNEE)
    share = wanted / record["comfort_deceleration"]
    change = wanted - previous
    total = record["weight_progress"] * progress / SAMPLES
    total += record["weight_comfort"] * share * share
    return float(total + record["weight_jerk"] * change * change)


@compiled
def drive_line(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    path: Floats,
    profile: Floats,
    begun: float,
    curvature: float,
    lowest: float,
    highest: float,
    is_last_resort: bool,  # noqa: FBT001 - a kernel
    line: Floats,
) -> float:
    """Return what driving a path at a speed costs; infinity where limits or road do not allow it.

    Args:
        record: Parameters, see ``channel.TrajectoryChannel``.
        path: (PATH_ROW,).
        profile: (SAMPLES, PROFILE_ROW).
        begun: Way along the path that is behind the ego [m].
        curvature: Of the road [1/m].
        lowest: Lateral places that the ego's centre may be at [m].
        highest: [m].
        is_last_resort: Whether it is to be had in any case; the vehicle then does what it can.
        line: (SAMPLES, LINE_ROW) out, up to what is not allowed.
    """
    along = 1.0 / (record["emergency_deceleration"] * record["emergency_deceleration"])
    across = 1.0 / (record["max_lateral_acceleration"] * record["max_lateral_acceleration"])
    comfort = 0.0
    for sample in range(SAMPLES):
        d, slope, bend = at_path(path, begun + profile[sample, PROFILE_S])
        line[sample, LINE_D], line[sample, LINE_SLOPE] = d, slope
        square = profile[sample, PROFILE_SPEED] * profile[sample, PROFILE_SPEED]
        aside = square * bend
        lateral = square * curvature + aside
        braking = profile[sample, PROFILE_ACCELERATION]
        # The ellipse of what the tyres are taken to hold.
        used = along * braking * braking + across * lateral * lateral
        if not is_last_resort and (used > 1.0 or d < lowest or d > highest):
            return math.inf
        comfort += aside * aside
    scale = record["comfort_deceleration"] * record["comfort_deceleration"]
    return float(record["weight_comfort"] * comfort / (scale * SAMPLES))
