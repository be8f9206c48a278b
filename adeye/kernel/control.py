"""Control laws: keep a lane, follow a vehicle, hold a speed without jerking."""

from __future__ import annotations

import math

from adeye.kernel.elementary import asin, atan, power, sin
from adeye.kernel.jit import compiled
from adeye.kernel.motion import clip

#: Largest angle [rad] at which a lane is approached from afar.
MAX_APPROACH = 0.3


@compiled
def lane_keeping_steering(
    lateral_error: float,
    heading_error: float,
    curvature: float,
    speed: float,
    wheelbase: float,
    rear_axle: float,
    preview_time: float,
    least_preview: float,
    max_lateral_acceleration: float,
    max_steering_angle: float,
) -> float:
    """Return the steering angle that brings the box centre onto a path and keeps it there [rad].

    Per metre driven the errors obey ``e'' + (2/p) e' + e/p**2 = 0`` with the preview way p, so the
    approach is critically damped at every speed; a small lag of the steering (up to about a
    quarter of the preview time) leaves it well damped. Far from the path it is approached at
    ``MAX_APPROACH``. The curvature is fed forward, so there is no standing error in a curve.

    Args:
        lateral_error: Of the box centre, left of the path > 0 [m].
        heading_error: Heading minus that of the path, in (-pi, pi] [rad].
        curvature: Of the path itself (see ``road.offset_curvature``) [1/m].
        speed: >= 0 [m/s].
        wheelbase: [m].
        rear_axle: Distance of the box centre ahead of the rear axle [m].
        preview_time: Preview way per speed [s]; about 0.8.
        least_preview: Preview way at low speed [m]; about 6.
        max_lateral_acceleration: That the law asks for at most [m/s^2].
        max_steering_angle: At the wheels [rad].
    """
    if math.isnan(lateral_error + heading_error + curvature + speed):
        return math.nan
    preview = max(least_preview, preview_time * speed)
    rear_curvature = curvature
    slip = 0.0
    if curvature != 0.0:
        # The rear axle runs on a tighter circle than the centre, which drifts outwards by `slip`.
        drift = clip(rear_axle * curvature, -0.9, 0.9)
        rear_curvature = curvature / math.sqrt(1.0 - drift * drift)
        slip = asin(drift)
    approach = clip(-0.5 * lateral_error / preview, -MAX_APPROACH, MAX_APPROACH)
    deviation = clip(heading_error + slip - approach, -0.5 * math.pi, 0.5 * math.pi)
    wanted = rear_curvature - 2.0 / preview * sin(deviation)
    if speed > 0.0:
        largest = max_lateral_acceleration / (speed * speed)
        wanted = clip(wanted, -largest, largest)
    return clip(atan(wheelbase * wanted), -max_steering_angle, max_steering_angle)


@compiled
def idm_acceleration(
    speed: float,
    gap: float,
    front_speed: float,
    desired_speed: float,
    time_gap: float,
    least_gap: float,
    max_acceleration: float,
    comfortable_deceleration: float,
    exponent: float,
    max_deceleration: float,
) -> float:
    """Return the acceleration of the intelligent driver model [m/s^2].

    Args:
        speed: >= 0 [m/s].
        gap: Bumper-to-bumper distance to the front vehicle [m]; infinity on a free road.
        front_speed: [m/s]; not read on a free road.
        desired_speed: [m/s]; at 0 or below the vehicle brakes to a stop and stays.
        time_gap: [s].
        least_gap: At standstill [m].
        max_acceleration: > 0 [m/s^2].
        comfortable_deceleration: > 0, a magnitude [m/s^2].
        exponent: Of the speed ratio; 4 in the source.
        max_deceleration: What the result is cut at, a magnitude [m/s^2].

    Source:
        Treiber, Hennecke, Helbing (2000), "Congested traffic states in empirical observations and
        microscopic simulations", eq. 2 and 3, the dynamic part of the desired gap cut at zero.
    """
    if math.isnan(speed + desired_speed):
        return math.nan
    if desired_speed <= 0.0:
        free = 1.0 if speed <= 0.0 else math.inf
    else:
        free = power(clip(speed, 0.0, math.inf) / desired_speed, exponent)
    interaction = 0.0
    if gap <= 0.0:
        interaction = math.inf
    elif gap != math.inf:
        closing = speed - front_speed
        scale = 2.0 * math.sqrt(max_acceleration * comfortable_deceleration)
        dynamic = speed * time_gap + speed * closing / scale
        desired_gap = least_gap + clip(dynamic, 0.0, math.inf)
        interaction = (desired_gap / gap) * (desired_gap / gap)
    wanted = max_acceleration * (1.0 - free - interaction)
    return clip(wanted, -max_deceleration, max_acceleration)


@compiled
def limit_jerk(previous: float, wanted: float, max_jerk: float, step: float) -> float:
    """Return the acceleration next to the wanted one that jerk lets follow the previous [m/s^2].

    Args:
        previous: Acceleration a step before [m/s^2].
        wanted: [m/s^2].
        max_jerk: > 0 [m/s^3].
        step: [s].
    """
    change = max_jerk * step
    return clip(wanted, previous - change, previous + change)
