"""The ego's motion from inertial samples, corrected by satellite fixes: an extended Kalman filter.

The state is that of the middle of the rear axle, which moves along the heading and nowhere else, so
no slip angle is needed: place, heading, speed, and the biases of acceleration and yaw rate. A
sample of the inertial unit is an input, not a measurement: it moves the state on. A fix is four
measurements: place and velocity of the antenna, wherever it is mounted.

Without an inertial unit the inputs are zero and the biases, with another standard deviation and
correlation time, are what the ego does: minus its acceleration and yaw rate (Singer's model).

Source:
    Groves (2013), "Principles of GNSS, inertial, and multisensor integrated navigation systems",
    2nd edition, chapters 3 and 14, for the filter with bias states and lever arms.
    Singer (1970), "Estimating optimal tracking filter performance for manned maneuvering targets",
    IEEE Transactions on Aerospace and Electronic Systems AES-6(4), for unknown manoeuvres.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from adeye.kernel.elementary import atan2, exp, sin_cos
from adeye.kernel.geometry import wrap_to_pi
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import local
from adeye.signals import GNSS_VELOCITY_X, GNSS_VELOCITY_Y, GNSS_X, GNSS_Y

if TYPE_CHECKING:
    from adeye.signals import Floats

# Columns of a filter's state, as numbered in its covariance.
(
    X,  # of the middle of the rear axle in the map [m]
    Y,  # [m]
    HEADING,  # [rad]
    SPEED,  # along the heading [m/s]; noise may make it negative at standstill
    ACCELERATION_BIAS,  # [m/s²]
    YAW_RATE_BIAS,  # [rad/s]
) = range(6)
STATES: Final = 6

SCRATCH: Final = 2 * STATES

MOVING: Final = 1.0
"""Speed over ground from which its direction is better than the map's [m/s]. Our choice."""

MAP_HEADING: Final = 0.1
"""Standard deviation of the heading against the lane's where the ego starts standing [rad]. Our
choice."""

COURSE: Final = 0.01
"""Standard deviation that is added to that of a first direction of motion [rad]. Our choice."""

LOST_HEADING: Final = 0.3
"""Standard deviation of the heading from which the filter begins anew with the next fix [rad]: the
linearised steps of the filter are wrong by 4 % of a cosine there. Our choice."""


@inlined
def carry(  # noqa: PLR0913, PLR0917 - a kernel
    x: float, y: float, heading: float, speed: float, acceleration: float, rate: float, time: float
) -> tuple[float, float, float, float]:
    """Return place, heading and speed after a time at constant acceleration and yaw rate.

    Args:
        x: [m].
        y: [m].
        heading: [rad].
        speed: [m/s].
        acceleration: [m/s²].
        rate: Yaw rate [rad/s].
        time: [s].
    """
    turn = rate * time
    # The chord of an arc, to second order.
    way = (speed + 0.5 * acceleration * time) * time * (1.0 - turn * turn / 24.0)
    sine, cosine = sin_cos(heading + 0.5 * turn)
    return (
        x + way * cosine,
        y + way * sine,
        wrap_to_pi(heading + turn),
        speed + acceleration * time,
    )


@inlined
def predict(
    record: Any, state: Floats, covariance: Floats, acceleration: float, rate: float, time: float
) -> None:
    """Move a state and its covariance on.

    Args:
        record: Has the densities ``acceleration_density`` [m²/s³] and ``yaw_rate_density``
            [rad²/s], the deviations ``acceleration_bias`` [m/s²] and ``yaw_rate_bias`` [rad/s] of
            the biases and their ``bias_time`` [s].
        state: (STATES,) in and out.
        covariance: (STATES, STATES) in and out.
        acceleration: Measured, mean over the time [m/s²].
        rate: Measured yaw rate, mean over the time [rad/s].
        time: >= 0 [s].
    """
    x, y = state[X], state[Y]
    rate -= state[YAW_RATE_BIAS]
    # Of the chord as it was: its length changes next to nothing with the rate.
    sine, cosine = sin_cos(state[HEADING] + 0.5 * rate * time)
    state[X], state[Y], state[HEADING], state[SPEED] = carry(
        x,
        y,
        state[HEADING],
        state[SPEED],
        acceleration - state[ACCELERATION_BIAS],
        rate,
        time,
    )
    kept = exp(-time / record["bias_time"])
    state[ACCELERATION_BIAS] *= kept
    state[YAW_RATE_BIAS] *= kept
    for column in range(STATES):
        _mix(covariance[:, column], state[X] - x, state[Y] - y, cosine, sine, time, kept)
    for row in range(STATES):
        _mix(covariance[row], state[X] - x, state[Y] - y, cosine, sine, time, kept)
    lost = 1.0 - kept * kept
    covariance[HEADING, HEADING] += record["yaw_rate_density"] * time
    covariance[SPEED, SPEED] += record["acceleration_density"] * time
    bias = record["acceleration_bias"]
    covariance[ACCELERATION_BIAS, ACCELERATION_BIAS] += bias * bias * lost
    bias = record["yaw_rate_bias"]
    covariance[YAW_RATE_BIAS, YAW_RATE_BIAS] += bias * bias * lost


@inlined
def _mix(  # noqa: PLR0913, PLR0917 - a kernel
    vector: Floats,
    way_x: float,
    way_y: float,
    cosine: float,
    sine: float,
    time: float,
    kept: float,
) -> None:
    """Multiply a vector (STATES,) by the derivatives of the new state with respect to the old."""
    turn = vector[HEADING] - 0.5 * time * vector[YAW_RATE_BIAS]
    faster = time * (vector[SPEED] - 0.5 * time * vector[ACCELERATION_BIAS])
    vector[X] += cosine * faster - way_y * turn
    vector[Y] += sine * faster + way_x * turn
    vector[HEADING] -= time * vector[YAW_RATE_BIAS]
    vector[SPEED] -= time * vector[ACCELERATION_BIAS]
    vector[ACCELERATION_BIAS] *= kept
    vector[YAW_RATE_BIAS] *= kept


@inlined
def correct(
    record: Any, state: Floats, covariance: Floats, fix: Floats, rate: float, scratch: Floats
) -> float:
    """Correct a state by a fix of its time.

    Args:
        record: Has the lever ``lever_x``, ``lever_y`` from the rear axle to the antenna [m] and the
            variances ``place_variance`` [m²] and ``velocity_variance`` [m²/s²] of the fix.
        state: (STATES,) in and out.
        covariance: (STATES, STATES) in and out.
        fix: (4,), see ``signals.GNSS_COLUMNS``.
        rate: Measured yaw rate [rad/s].
        scratch: (SCRATCH,).

    Returns:
        The normalised innovation squared: chi-squared with four degrees of freedom if all is as
        assumed.
    """
    sine, cosine = sin_cos(state[HEADING])
    speed = state[SPEED]
    rate -= state[YAW_RATE_BIAS]
    arm_x = cosine * record["lever_x"] - sine * record["lever_y"]
    arm_y = sine * record["lever_x"] + cosine * record["lever_y"]
    velocity_x, velocity_y = speed * cosine - rate * arm_y, speed * sine + rate * arm_x
    place, velocity = record["place_variance"], record["velocity_variance"]
    change = scratch[STATES:]
    change[:] = 0.0
    total = 0.0
    # One after the other: their errors are independent, so no matrix need be inverted.
    rest = fix[GNSS_X] - state[X] - arm_x
    total += _take(covariance, scratch, X, 1.0, -arm_y, 0.0, rest, place)
    rest = fix[GNSS_Y] - state[Y] - arm_y
    total += _take(covariance, scratch, Y, 1.0, arm_x, 0.0, rest, place)
    rest = fix[GNSS_VELOCITY_X] - velocity_x
    total += _take(
        covariance, scratch, SPEED, cosine, -speed * sine - rate * arm_x, arm_y, rest, velocity
    )
    rest = fix[GNSS_VELOCITY_Y] - velocity_y
    total += _take(
        covariance, scratch, SPEED, sine, speed * cosine - rate * arm_y, -arm_x, rest, velocity
    )
    for index in range(STATES):
        state[index] += change[index]
    state[HEADING] = wrap_to_pi(state[HEADING])
    return total


@inlined
def _take(  # noqa: PLR0913, PLR0917 - a kernel
    covariance: Floats,
    scratch: Floats,
    own: int,
    by_own: float,
    by_heading: float,
    by_rate_bias: float,
    rest: float,
    variance: float,
) -> float:
    """Take over one number, a linear function of one state, the heading and the yaw rate's bias.

    Returns:
        The square of its innovation over the variance of that.
    """
    shared, change = scratch[:STATES], scratch[STATES:]
    for index in range(STATES):
        row = covariance[index]
        shared[index] = (
            by_own * row[own] + by_heading * row[HEADING] + by_rate_bias * row[YAW_RATE_BIAS]
        )
    expected = (
        by_own * shared[own]
        + by_heading * shared[HEADING]
        + by_rate_bias * shared[YAW_RATE_BIAS]
        + variance
    )
    # The derivatives are those before the first correction of the fix.
    rest -= (
        by_own * change[own] + by_heading * change[HEADING] + by_rate_bias * change[YAW_RATE_BIAS]
    )
    weight = 1.0 / expected
    for index in range(STATES):
        change[index] += shared[index] * (weight * rest)
        for other in range(STATES):
            covariance[index, other] -= shared[index] * shared[other] * weight
    return float(weight * rest * rest)


@compiled
def begin(
    record: Any, segments: Floats, state: Floats, covariance: Floats, fix: Floats, rate: float
) -> None:
    """Set a state by its first fix: the heading from the motion, or along the lane when standing.

    Args:
        record: What ``predict`` and ``correct`` read of it.
        segments: (K, 5) reference line of the road.
        state: (STATES,) out.
        covariance: (STATES, STATES) out.
        fix: (4,), see ``signals.GNSS_COLUMNS``.
        rate: Measured yaw rate [rad/s].
    """
    velocity_x, velocity_y = fix[GNSS_VELOCITY_X], fix[GNSS_VELOCITY_Y]
    over_ground = math.sqrt(velocity_x * velocity_x + velocity_y * velocity_y)
    noise, lever = record["velocity_variance"], record["lever_x"]
    bias = record["yaw_rate_bias"]
    if over_ground > MOVING and over_ground * over_ground > 25.0 * noise:
        # The antenna slips with the turn.
        heading = atan2(velocity_y, velocity_x) - rate * lever / over_ground
        slip = lever * bias / over_ground
        turn = COURSE * COURSE + noise / (over_ground * over_ground) + slip * slip
    else:
        heading = local(segments, fix[GNSS_X], fix[GNSS_Y])[2]
        turn = MAP_HEADING * MAP_HEADING
    sine, cosine = sin_cos(heading)
    arm_x = cosine * lever - sine * record["lever_y"]
    arm_y = sine * lever + cosine * record["lever_y"]
    state[X], state[Y] = fix[GNSS_X] - arm_x, fix[GNSS_Y] - arm_y
    state[HEADING] = wrap_to_pi(heading)
    state[SPEED] = cosine * velocity_x + sine * velocity_y + rate * record["lever_y"]
    state[ACCELERATION_BIAS] = state[YAW_RATE_BIAS] = 0.0
    covariance[:] = 0.0
    place = record["place_variance"]
    covariance[X, X] = place + arm_y * arm_y * turn
    covariance[Y, Y] = place + arm_x * arm_x * turn
    covariance[X, Y] = covariance[Y, X] = -arm_x * arm_y * turn
    covariance[X, HEADING] = covariance[HEADING, X] = arm_y * turn
    covariance[Y, HEADING] = covariance[HEADING, Y] = -arm_x * turn
    covariance[HEADING, HEADING] = turn
    covariance[SPEED, SPEED] = noise
    covariance[YAW_RATE_BIAS, YAW_RATE_BIAS] = bias * bias
    bias = record["acceleration_bias"]
    covariance[ACCELERATION_BIAS, ACCELERATION_BIAS] = bias * bias


@inlined
def lateral_variance(state: Floats, covariance: Floats, ahead: float, age: float) -> float:
    """Return how unsure the place across the heading is some time later [m²].

    Args:
        state: (STATES,).
        covariance: (STATES, STATES).
        ahead: How far ahead of the rear axle the place is [m].
        age: >= 0, how much later [s].

    Returns:
        The variance from place, heading and yaw rate, to first order; what the yaw rate shares with
        the others is left out.
    """
    sine, cosine = sin_cos(state[HEADING])
    way = state[SPEED] * age
    lever = way + ahead
    bent = 0.5 * way * age
    across = (
        sine * sine * covariance[X, X]
        - 2.0 * sine * cosine * covariance[X, Y]
        + cosine * cosine * covariance[Y, Y]
    )
    shared = cosine * covariance[Y, HEADING] - sine * covariance[X, HEADING]
    return float(
        across
        + 2.0 * lever * shared
        + lever * lever * covariance[HEADING, HEADING]
        + bent * bent * covariance[YAW_RATE_BIAS, YAW_RATE_BIAS]
    )
