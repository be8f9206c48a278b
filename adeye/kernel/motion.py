"""How the ego moves over one tick: actuators with lag and limits, friction, kinematic bicycle.

The state is one row (7,): x, y [m] of the box centre, heading [rad], speed [m/s], acceleration
[m/s^2], steering angle at the wheels [rad], yaw rate [rad/s]. Speed is the component along the
heading; it never falls below zero.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import asin, atan, exp, log, power, sin, sin_cos, tan
from adeye.kernel.jit import compiled, inlined

Floats = NDArray[np.float64]

#: Standard gravity [m/s^2].
GRAVITY = 9.80665
_BISECTIONS = 60


@inlined
def point_velocity(
    speed: float, yaw_rate: float, ahead: float, aside: float
) -> tuple[float, float]:
    """Return the velocity of a point of the ego in its own frame, forward and to the left [m/s].

    That of a rigid body whose rear axle moves along the heading: v + ω × r. So the box centre moves
    across the heading, too, while the ego turns.

    Args:
        speed: Along the heading [m/s].
        yaw_rate: [rad/s].
        ahead: Of the point, from the rear axle [m].
        aside: Of the point, to the left [m].
    """
    return speed - yaw_rate * aside, yaw_rate * ahead


@compiled
def clip(value: float, low: float, high: float) -> float:
    """Return the value within its limits; NaN stays NaN."""
    if value < low:
        return low
    return high if value > high else value


@compiled
def coupled_curvature(speed: float, tangent: float, wheelbase: float, friction: float) -> float:
    """Return the curvature of the rear axle's path that the tyres can hold [1/m].

    Args:
        speed: >= 0 [m/s].
        tangent: Tangent of the steering angle.
        wheelbase: [m].
        friction: Tyre-road friction coefficient.

    Returns:
        ``tangent / wheelbase``, cut where ``speed**2 * curvature`` would exceed friction times
        gravity: the ego then runs wide.
    """
    curvature = tangent / wheelbase
    square = speed * speed
    grip = friction * GRAVITY
    if square * abs(curvature) <= grip:
        return curvature
    return clip(curvature, -grip / square, grip / square)


@compiled
def friction_limited_acceleration(lateral_acceleration: float, friction: float) -> float:
    """Return the largest longitudinal acceleration that cornering leaves to the tyres [m/s^2].

    The friction circle with the lateral demand served first.
    """
    grip = friction * GRAVITY
    rest = grip * grip - lateral_acceleration * lateral_acceleration
    return 0.0 if rest <= 0.0 else math.sqrt(rest)


@compiled
def lagged_steering(
    angle: float, command: float, largest_rate: float, lag: float, time: float
) -> float:
    """Return the steering angle a time after it started towards a constant command [rad].

    A first-order response whose rate is limited: far from the command it runs at the largest
    rate, near it decays exponentially. Exact for any time.

    Args:
        angle: At the start [rad].
        command: [rad].
        largest_rate: > 0 [rad/s].
        lag: Time constant [s]; 0 follows the command as fast as the rate allows.
        time: >= 0 [s].
    """
    return _steering_after(angle, command, largest_rate, lag, time, fade(time, lag))


@compiled
def fade(time: float, lag: float) -> float:
    """Return what is left of an error after a time [s] of a first-order response; 0 without lag."""
    return exp(-time / lag) if lag > 0.0 else 0.0


@inlined
def _steering_after(
    angle: float, command: float, largest_rate: float, lag: float, time: float, faded: float
) -> float:
    """Return what ``lagged_steering`` does, of a fade that is known."""
    error = command - angle
    # The response falls below the largest rate when this error is left.
    knee = largest_rate * lag
    running = (abs(error) - knee) / largest_rate
    if running >= time:
        return angle + math.copysign(largest_rate * time, error)
    if lag <= 0.0:
        return command
    if running > 0.0:
        return command - math.copysign(knee * exp(-(time - running) / lag), error)
    return command - error * faded


@inlined
def _speed_after(
    speed: float, acceleration: float, command: float, lag: float, time: float, faded: float
) -> float:
    """Return the speed after a first-order response of the acceleration, without limits [m/s]."""
    if lag <= 0.0:
        return speed + command * time
    return speed + command * time + (acceleration - command) * lag * (1.0 - faded)


@inlined
def _acceleration_after(acceleration: float, command: float, lag: float, faded: float) -> float:
    """Return the first-order response of the acceleration to a constant command [m/s^2]."""
    if lag <= 0.0:
        return command
    return command + (acceleration - command) * faded


@compiled
def _time_to_standstill(
    speed: float, acceleration: float, command: float, lag: float, step: float, faded: float
) -> float:
    """Return when the speed first reaches zero within the step [s]; the step if it does not."""
    if lag <= 0.0:
        if speed + command * step > 0.0:
            return step
        return speed / -command if command < 0.0 else 0.0
    # A vehicle that is asked to pull away while still braking may stand in between.
    last = step
    if acceleration < 0.0 < command:
        last = min(step, lag * log((command - acceleration) / command))
        faded = fade(last, lag)
    if _speed_after(speed, acceleration, command, lag, last, faded) > 0.0:
        return step
    early = 0.0
    late = last
    for _ in range(_BISECTIONS):
        middle = 0.5 * (early + late)
        faded = fade(middle, lag)
        if _speed_after(speed, acceleration, command, lag, middle, faded) > 0.0:
            early = middle
        else:
            late = middle
    return late


@inlined
def _drive_straight(
    state: Floats, speed_half: float, speed_end: float, time: float, out: Floats
) -> None:
    """Do what ``_drive`` does with the wheels straight: exact, and the common case."""
    sine, cosine = sin_cos(state[2])
    way = time / 6.0 * (state[3] + 4.0 * speed_half + speed_end)
    out[0] = state[0] + way * cosine
    out[1] = state[1] + way * sine
    out[2] = state[2]


@inlined
def _drive(
    state: Floats,
    speed_half: float,
    speed_end: float,
    start: float,
    half: float,
    end: float,
    time: float,
    rear_axle: float,
    out: Floats,
) -> None:
    """Move the pose along the rear axle's path, by Simpson's rule on speed, yaw rate, heading.

    ``start``, ``half`` and ``end`` are the yaw rates. The box centre follows rigidly,
    ``rear_axle`` ahead of the axle. Order four in the time.
    """
    heading = state[2]
    sine, cosine = sin_cos(heading)
    # Integrals of the parabola through the three yaw rates, up to the middle and to the end.
    sine_half, cosine_half = sin_cos(heading + time / 24.0 * (5.0 * start + 8.0 * half - end))
    turned = wrap_to_pi(heading + time / 6.0 * (start + 4.0 * half + end))
    sine_end, cosine_end = sin_cos(turned)
    share = time / 6.0
    way_x = share * (state[3] * cosine + 4.0 * speed_half * cosine_half + speed_end * cosine_end)
    way_y = share * (state[3] * sine + 4.0 * speed_half * sine_half + speed_end * sine_end)
    out[0] = state[0] + way_x + rear_axle * (cosine_end - cosine)
    out[1] = state[1] + way_y + rear_axle * (sine_end - sine)
    out[2] = turned


@inlined
def _roll(
    speed: float,
    before: float,
    command: float,
    lag: float,
    step: float,
    faded: float,
    faded_half: float,
) -> tuple[float, float, float, float]:
    """Return how long the ego rolls in a tick, its speed half-way and at the end, and what changes.

    That is: time [s], two speeds [m/s], the acceleration at the end [m/s^2]; 0 once it stands.
    """
    if not (speed > 0.0 or before > 0.0 or command > 0.0):
        return step, 0.0, 0.0, 0.0
    time = _time_to_standstill(speed, before, command, lag, step, faded)
    if time != step:
        faded_half = fade(0.5 * time, lag)
    speed_half = _speed_after(speed, before, command, lag, 0.5 * time, faded_half)
    speed_half = clip(speed_half, 0.0, math.inf)
    speed_end = acceleration_end = 0.0
    if time >= step:
        speed_end = _speed_after(speed, before, command, lag, step, faded)
        acceleration_end = _acceleration_after(before, command, lag, faded)
    if speed_end <= 0.0:
        speed_end = acceleration_end = 0.0
    return time, speed_half, speed_end, acceleration_end


# Columns of the limits of an ego.
(
    WHEELBASE,
    REAR_AXLE,
    MAX_ACCELERATION,
    MAX_DECELERATION,
    MAX_STEERING_ANGLE,
    MAX_STEERING_RATE,
    ACCELERATION_LAG,
    STEERING_LAG,
    FRICTION,
    ACCELERATION_FADED,
    ACCELERATION_FADED_HALF,
    STEERING_FADED,
    STEERING_FADED_HALF,
) = range(13)


@compiled
def advance_ego(
    state: Floats,
    acceleration_command: float,
    steering_command: float,
    step: float,
    wheelbase: float,
    rear_axle: float,
    max_acceleration: float,
    max_deceleration: float,
    max_steering_angle: float,
    max_steering_rate: float,
    acceleration_lag: float,
    steering_lag: float,
    friction: float,
    out: Floats,
) -> None:
    """Advance the ego by one tick under a command that is held constant.

    In this order: the steering angle follows its command within angle and rate; the command for
    the acceleration is cut to the vehicle's limits and to what the lateral demand at the start of
    the tick leaves of the friction circle; acceleration and speed follow it exactly, and end at
    exactly zero when the ego comes to rest within the tick, where it stays until the next; the
    pose follows the kinematic bicycle. A NaN command or state gives a NaN state.

    Args:
        state: (7,), see the module.
        acceleration_command: [m/s^2].
        steering_command: [rad].
        step: Length of the tick [s].
        wheelbase: [m].
        rear_axle: Distance of the box centre ahead of the rear axle [m].
        max_acceleration: >= 0 [m/s^2].
        max_deceleration: >= 0, a magnitude [m/s^2].
        max_steering_angle: At the wheels, below pi/2 [rad].
        max_steering_rate: > 0 [rad/s].
        acceleration_lag: Time constant [s], 0 for none.
        steering_lag: Time constant [s], 0 for none.
        friction: Tyre-road friction coefficient.
        out: (7,) the state a step later; may be ``state``.

    Source:
        Rajamani (2012), "Vehicle dynamics and control", section 2.2, for the rear axle, which
        needs no slip angle.
    """
    limits = (
        wheelbase,
        rear_axle,
        max_acceleration,
        max_deceleration,
        max_steering_angle,
        max_steering_rate,
        acceleration_lag,
        steering_lag,
        friction,
        fade(step, acceleration_lag),
        fade(0.5 * step, acceleration_lag),
        fade(step, steering_lag),
        fade(0.5 * step, steering_lag),
    )
    advance_ego_fading(state, acceleration_command, steering_command, step, limits, out)


@inlined
def advance_ego_fading(
    state: Floats,
    acceleration_command: float,
    steering_command: float,
    step: float,
    limits: Any,
    out: Floats,
) -> None:
    """Do what ``advance_ego`` does, of fades that are known: they are the same at every tick.

    Args:
        state: (7,), see the module.
        acceleration_command: [m/s^2].
        steering_command: [rad].
        step: Length of the tick [s].
        limits: (13,) the arguments of ``advance_ego`` from the wheelbase on, then the ``fade`` of
            the acceleration over a tick and over half of one, and the same of the steering.
        out: (7,) the state a step later; may be ``state``.
    """
    wheelbase, friction = limits[WHEELBASE], limits[FRICTION]
    max_steering_rate, steering_lag = limits[MAX_STEERING_RATE], limits[STEERING_LAG]
    if math.isnan(state.sum() + acceleration_command + steering_command + friction):
        # Otherwise a search for the standstill would take NaN for one.
        out[:] = math.nan
        return
    speed, angle = state[3], state[5]
    target = clip(steering_command, -limits[MAX_STEERING_ANGLE], limits[MAX_STEERING_ANGLE])
    steering_end = _steering_after(
        angle, target, max_steering_rate, steering_lag, step, limits[STEERING_FADED]
    )
    curvature = coupled_curvature(speed, tan(angle), wheelbase, friction)
    grip = friction_limited_acceleration(speed * speed * curvature, friction)
    command = clip(acceleration_command, -limits[MAX_DECELERATION], limits[MAX_ACCELERATION])
    command = clip(command, -grip, grip)
    before = clip(state[4], -grip, grip)
    if speed <= 0.0:
        before = clip(before, 0.0, math.inf)
    time, speed_half, speed_end, acceleration_end = _roll(
        speed,
        before,
        command,
        limits[ACCELERATION_LAG],
        step,
        limits[ACCELERATION_FADED],
        limits[ACCELERATION_FADED_HALF],
    )
    steering_stop = steering_end
    tangent_end = tangent_stop = tan(steering_end)
    if time < step:
        steering_half = lagged_steering(angle, target, max_steering_rate, steering_lag, 0.5 * time)
        steering_stop = lagged_steering(angle, target, max_steering_rate, steering_lag, time)
        tangent_stop = tan(steering_stop)
    else:
        steering_half = _steering_after(
            angle, target, max_steering_rate, steering_lag, 0.5 * time, limits[STEERING_FADED_HALF]
        )
    if angle == 0.0 and steering_half == 0.0 and steering_stop == 0.0:
        _drive_straight(state, speed_half, speed_end, time, out)
    else:
        tangent_half = tan(steering_half)
        _drive(
            state,
            speed_half,
            speed_end,
            speed * curvature,
            speed_half * coupled_curvature(speed_half, tangent_half, wheelbase, friction),
            speed_end * coupled_curvature(speed_end, tangent_stop, wheelbase, friction),
            time,
            limits[REAR_AXLE],
            out,
        )
    out[3] = speed_end
    out[4] = acceleration_end
    out[5] = steering_end
    out[6] = speed_end * coupled_curvature(speed_end, tangent_end, wheelbase, friction)


# --- Control laws: keep a lane, follow a vehicle, hold a speed without jerking --------------------

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
