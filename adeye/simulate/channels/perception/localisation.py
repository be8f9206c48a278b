"""Where the ego is, from satellite fixes and an inertial unit.

This is the estimate of a channel that links a receiver and no sensor that gives one. There is a new
one with every sample of the inertial unit, or without such a unit at every tick of the channel, as
long as its lateral deviation is below ``MOST_DEVIATION``.

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

A fix is old when it arrives. So the filter stands at the time of the newest fix, with the inertial
samples since then in a queue; the estimate is its state carried along the queue. A new fix moves
the filter on to the time of the fix, sample by sample, corrects it there, and the estimate is
carried along what is left of the queue: what a filter without latency would have computed. A fix
that is newer than all samples waits for one of its time; another one that comes meanwhile is lost.

When fixes stay away the filter goes on by what the inertial unit says, and its covariance grows.
When the inertial unit stays away there is no new estimate, and after ``MOST_HELD`` the filter gives
up and begins anew with the first fix after the unit has come back.

A sample of the inertial unit is the mean of the time before it, and moves the filter over that.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

import numpy as np

from adeye import signals
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan, atan2, exp, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import Ground, Grounds, center_at, ground_of, lane_of, local, place_on
from adeye.signals import Floats, parameter_record, spec_columns

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.ports import ChannelContext

# --- The ego's motion from inertial samples, corrected by satellite fixes: an extended Kalman
# filter.

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
    rest = fix[signals.GNSS_X] - state[X] - arm_x
    total += _take(covariance, scratch, X, 1.0, -arm_y, 0.0, rest, place)
    rest = fix[signals.GNSS_Y] - state[Y] - arm_y
    total += _take(covariance, scratch, Y, 1.0, arm_x, 0.0, rest, place)
    rest = fix[signals.GNSS_VELOCITY_X] - velocity_x
    total += _take(
        covariance, scratch, SPEED, cosine, -speed * sine - rate * arm_x, arm_y, rest, velocity
    )
    rest = fix[signals.GNSS_VELOCITY_Y] - velocity_y
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
    velocity_x, velocity_y = fix[signals.GNSS_VELOCITY_X], fix[signals.GNSS_VELOCITY_Y]
    over_ground = math.sqrt(velocity_x * velocity_x + velocity_y * velocity_y)
    noise, lever = record["velocity_variance"], record["lever_x"]
    bias = record["yaw_rate_bias"]
    if over_ground > MOVING and over_ground * over_ground > 25.0 * noise:
        # The antenna slips with the turn.
        heading = atan2(velocity_y, velocity_x) - rate * lever / over_ground
        slip = lever * bias / over_ground
        turn = COURSE * COURSE + noise / (over_ground * over_ground) + slip * slip
    else:
        heading = local(segments, fix[signals.GNSS_X], fix[signals.GNSS_Y])[2]
        turn = MAP_HEADING * MAP_HEADING
    sine, cosine = sin_cos(heading)
    arm_x = cosine * lever - sine * record["lever_y"]
    arm_y = sine * lever + cosine * record["lever_y"]
    state[X], state[Y] = fix[signals.GNSS_X] - arm_x, fix[signals.GNSS_Y] - arm_y
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


# --- Fixes that come late: a filter at the time of the newest fix, and the samples since then -----

LATEST_FIX: Final = 0.5
"""Age from which a fix is not used [s]. Our choice: a receiver needs 0.1 to 0.2 s."""

# Columns of what is kept of a run beside the filter's state; times are -1 before the first.
(
    TIME,  # of the filter [s]
    ACCELERATION,  # of the rear axle, measured, up to that time [m/s²]; NaN before the first sample
    RATE,  # yaw rate, measured, up to that time [rad/s]
    NOW_TIME,  # to which the estimate is carried [s]
    NOW_ACCELERATION,  # measured up to that time [m/s²]
    NOW_RATE,  # [rad/s]
    NOW_X,
    NOW_Y,
    NOW_HEADING,
    NOW_SPEED,
    SEEN,  # of the newest sample of the unit [s]
    SEEN_RATE,  # its yaw rate [rad/s]
    FIX_TIME,  # of the newest fix that was looked at [s]
    WAITING,  # of the fix that waits [s], -1 if none does
    WAITING_FIX,  # the first of its four columns
    _,
    _,
    _,
    FIRST,  # place of the oldest sample in the queue
    COUNT,  # samples in the queue
    INNOVATION,  # normalised, squared, of the newest fix that was used
) = range(21)

# Columns of a sample in the queue.
SAMPLE_TIME, SAMPLE_ACCELERATION, SAMPLE_RATE = range(3)

NOTHING: Final = (
    *(-1.0, math.nan, math.nan),
    *(-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    *(-1.0, 0.0),
    *(-1.0, -1.0, 0.0, 0.0, 0.0, 0.0),
    *(0.0, 0.0, math.nan),
)
"""What is kept before the first sample."""


@inlined
def is_number(values: Floats) -> bool:
    """Tell whether all values are finite; zero times one that is not is NaN."""
    total = 0.0
    for index in range(values.shape[0]):
        total += 0.0 * values[index]
    return total == 0.0


class Filter(NamedTuple):
    """The filter of one run, and what is kept beside it.

    Attributes:
        record: What ``predict`` and ``correct`` read, and more.
        segments: (K, 5) reference line of the road.
        state: (STATES,) at its time; in and out.
        covariance: (STATES, STATES) in and out.
        row: What is kept beside them; in and out.
        queue: (N, 3) samples since its time; in and out.
        scratch: (SCRATCH,).
    """

    record: Any
    segments: Floats
    state: Floats
    covariance: Floats
    row: Floats
    queue: Floats
    scratch: Floats


@inlined
def add_sample(of: Filter, sample: Floats, time: float) -> None:
    """Put a sample into the queue and carry the estimate on to it."""
    record, row, queue = of.record, of.row, of.queue
    rate = sample[signals.IMU_YAW_RATE]
    # From the mount to the rear axle. What a faster turn adds at the side sums up to a change of
    # speed, so its noise does not sum up.
    acceleration = sample[signals.IMU_ACCELERATION_X] + rate * rate * record["unit_x"]
    if time - row[SEEN] > record["most_held"]:
        _give_up(row)
    else:
        acceleration += record["unit_y"] * (rate - row[SEEN_RATE]) / (time - row[SEEN])
    row[SEEN], row[SEEN_RATE] = time, rate
    if row[TIME] >= 0.0:
        _carry_now(of.state, row, time, acceleration, rate)
    if row[COUNT] > 0.0:
        oldest = queue[int(row[FIRST]), SAMPLE_TIME]
        if row[COUNT] >= queue.shape[0] or time - oldest > LATEST_FIX:
            # No fix comes for that time any more.
            _advance(of, oldest)
    place = (int(row[FIRST]) + int(row[COUNT])) % queue.shape[0]
    queue[place, SAMPLE_TIME] = time
    queue[place, SAMPLE_ACCELERATION], queue[place, SAMPLE_RATE] = acceleration, rate
    row[COUNT] += 1.0


@inlined
def _give_up(row: Floats) -> None:
    """Forget the filter and the samples: what is known of the ego's motion has a hole."""
    row[TIME] = row[NOW_TIME] = row[WAITING] = -1.0
    row[COUNT] = 0.0
    row[ACCELERATION] = row[RATE] = math.nan


@inlined
def _carry_now(state: Floats, row: Floats, time: float, acceleration: float, rate: float) -> None:
    """Carry the estimate on by a sample to its time [s]."""
    row[NOW_X], row[NOW_Y], row[NOW_HEADING], row[NOW_SPEED] = carry(
        row[NOW_X],
        row[NOW_Y],
        row[NOW_HEADING],
        row[NOW_SPEED],
        acceleration - state[ACCELERATION_BIAS],
        rate - state[YAW_RATE_BIAS],
        time - row[NOW_TIME],
    )
    row[NOW_TIME], row[NOW_ACCELERATION], row[NOW_RATE] = time, acceleration, rate


@compiled
def _advance(of: Filter, until: float) -> None:
    """Move the filter on along the queue to a time [s], not after its last sample."""
    row, queue = of.row, of.queue
    while row[COUNT] > 0.0:
        sample = queue[int(row[FIRST])]
        time = sample[SAMPLE_TIME]
        acceleration, rate = sample[SAMPLE_ACCELERATION], sample[SAMPLE_RATE]
        if row[TIME] >= 0.0:
            passed = min(time, until) - row[TIME]
            predict(of.record, of.state, of.covariance, acceleration, rate, passed)
            row[TIME] = min(time, until)
        row[ACCELERATION], row[RATE] = acceleration, rate
        if time > until:
            return
        row[FIRST] = (int(row[FIRST]) + 1) % queue.shape[0]
        row[COUNT] -= 1.0


@inlined
def add_fix(row: Floats, fix: Floats, time: float) -> None:
    """Let a fix wait, unless another one does."""
    row[FIX_TIME] = time
    if row[WAITING] < 0.0:
        row[WAITING] = time
        for column in range(fix.shape[0]):
            row[WAITING_FIX + column] = fix[column]


@inlined
def use_fix(of: Filter) -> None:
    """Use the fix that waits: the filter at its time is corrected, the estimate goes on from there.

    Without a fix in it, the filter is only moved on to its time.
    """
    record, state, covariance = of.record, of.state, of.covariance
    row, queue = of.row, of.queue
    time, fix = row[WAITING], row[WAITING_FIX : WAITING_FIX + 4]
    row[WAITING] = -1.0
    if row[TIME] > time:
        # Older than all samples in the queue.
        return
    if row[TIME] >= 0.0:
        _advance(of, time)
    if not is_number(fix):
        _carry_on(state, row, queue)
        return
    # NaN compares false: a filter that has broken down begins anew, too.
    if row[TIME] >= 0.0 and covariance[HEADING, HEADING] <= LOST_HEADING * LOST_HEADING:
        rate = row[RATE]
        if row[COUNT] > 0.0:
            # The time of the fix lies between that of the sample before and that of the next one.
            rate = 0.5 * (rate + queue[int(row[FIRST]), SAMPLE_RATE])
        row[INNOVATION] = correct(record, state, covariance, fix, rate, of.scratch)
    else:
        _begin_in_queue(row, queue, time)
        begin(record, of.segments, state, covariance, fix, row[RATE])
    _carry_on(state, row, queue)


@inlined
def _begin_in_queue(row: Floats, queue: Floats, time: float) -> None:
    """Set the filter's time and the sample of it: the last before, or the first after it."""
    row[TIME] = time
    while row[COUNT] > 0.0:
        sample = queue[int(row[FIRST])]
        is_later = sample[SAMPLE_TIME] > time
        if not is_later or math.isnan(row[RATE]):
            row[ACCELERATION], row[RATE] = sample[SAMPLE_ACCELERATION], sample[SAMPLE_RATE]
        if is_later:
            return
        row[FIRST] = (int(row[FIRST]) + 1) % queue.shape[0]
        row[COUNT] -= 1.0


@inlined
def _carry_on(state: Floats, row: Floats, queue: Floats) -> None:
    """Carry the estimate from the filter along the queue."""
    if row[TIME] < 0.0:
        return
    row[NOW_X], row[NOW_Y] = state[X], state[Y]
    row[NOW_HEADING], row[NOW_SPEED] = state[HEADING], state[SPEED]
    row[NOW_TIME] = row[TIME]
    row[NOW_ACCELERATION], row[NOW_RATE] = row[ACCELERATION], row[RATE]
    for index in range(int(row[COUNT])):
        sample = queue[(int(row[FIRST]) + index) % queue.shape[0]]
        _carry_now(
            state,
            row,
            sample[SAMPLE_TIME],
            sample[SAMPLE_ACCELERATION],
            sample[SAMPLE_RATE],
        )


# --- Where the ego is, from satellite fixes and an inertial unit ----------------------------------

MOST_DEVIATION: Final = 1.0
"""Standard deviation of the lateral place from which there is no estimate [m]. Our choice: a car of
1.9 m has 0.8 m to each side in a lane of 3.5 m, so beyond it the lane itself is in doubt."""

MOST_HELD: Final = 0.2
"""How long the last sample of an inertial unit stands for the next [s], three of its periods at
least. Our choice: an emergency braking begins within that time."""

# What is added to the deviations of a data sheet, so that no sensor is believed without end: place
# [m], velocity [m/s], acceleration [m/s²], yaw rate [rad/s]. Our choice, below what devices have.
_LEAST_PLACE: Final = 0.02
_LEAST_VELOCITY: Final = 0.02
_LEAST_ACCELERATION: Final = 0.01
_LEAST_YAW_RATE: Final = 1e-4

_MANOEUVRE: Final = {"acceleration_bias": 2.0, "yaw_rate_bias": 0.1, "bias_time": 2.0}
"""What an ego without inertial unit is taken to do: deviation of acceleration [m/s²] and yaw rate
[rad/s], how long it lasts [s]. Our choice: of the order of normal driving."""


class Localiser:
    """Estimates the ego's place and motion from a receiver's fixes and an inertial unit's samples.

    Attributes:
        estimate: (B, 13) newest estimate, see ``signals.ESTIMATE_COLUMNS``.
        stamp: (B,) its time [s], -1 before the first.
        states: (B, STATES) of the filters, at their time.
        covariances: (B, STATES, STATES) of these.
        rows: (B, 21) what is kept beside them.
    """

    def __init__(self, context: ChannelContext, gnss: str, imu: str | None) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Of the channel.
            gnss: Id of the linked receiver.
            imu: Id of the linked inertial unit, if there is one.
        """
        runs = context.runs
        self.gnss = gnss
        self.imu = imu
        self._records = _records(context, gnss, imu)
        self._grounds = context.road.grounds()
        # A unit has at most one sample a tick.
        self._queue: Floats = np.zeros((runs, int(LATEST_FIX / context.step) + 2, 3))
        self._scratch: Floats = np.zeros(SCRATCH)
        self.states: Floats = np.zeros((runs, STATES))
        self.covariances: Floats = np.zeros((runs, STATES, STATES))
        self.rows: Floats = np.tile(NOTHING, (runs, 1))
        self.estimate: Floats = np.zeros((runs, len(signals.ESTIMATE_COLUMNS)))
        self.stamp: Floats = np.full(runs, -1.0)

    @classmethod
    def of(cls, context: ChannelContext) -> Self | None:
        """Return the localiser of a channel; None if it needs none or has no receiver.

        The first linked receiver and the first linked inertial unit are used.
        """
        kinds = [(context.sensors[link], link) for link in context.links if link in context.sensors]
        if any(kind in {"localisation", "ground_truth"} for kind, _ in kinds):
            return None
        gnss = next((link for kind, link in kinds if kind == "gnss"), None)
        imu = next((link for kind, link in kinds if kind == "imu"), None)
        return None if gnss is None else cls(context, gnss, imu)

    def update(self, fix: Floats, fix_stamp: Floats, sample: Floats, sample_stamp: Floats) -> None:
        """Take over the newest samples of a tick.

        Args:
            fix: (B, 4) of the receiver, see ``signals.GNSS_COLUMNS``; NaN rows are no fix.
            fix_stamp: (B,) its time [s].
            sample: (B, 3) of the inertial unit, see ``signals.IMU_COLUMNS``; NaN rows are none.
            sample_stamp: (B,) its time [s]; without a unit, zeros at the time of the tick.
        """
        _update(
            self._records,
            self._grounds,
            (fix, fix_stamp, sample, sample_stamp),
            (self.states, self.covariances, self.rows, self._queue, self._scratch),
            self.estimate,
            self.stamp,
        )


def _records(context: ChannelContext, gnss: str, imu: str | None) -> Any:
    """Pack what the compiled steps read: what is assumed of the sensors, and levers."""
    receiver = context.data_sheets[gnss]
    unit: Mapping[str, Any] = {
        "acceleration_noise": 0.0,
        "yaw_rate_noise": 0.0,
        "rate": 1.0 / context.period,
        **_MANOEUVRE,
    }
    if imu is not None:
        unit = context.data_sheets[imu]
    nowhere = np.zeros((context.runs, 4))
    antenna, place = context.mounts.get(gnss, nowhere), context.mounts.get(imu or "", nowhere)
    columns = spec_columns(context.vehicles, lambda vehicle: {"wheelbase": vehicle.wheelbase})
    rear = 0.5 * columns["wheelbase"]
    # A channel that acts more seldom than the unit samples holds each sample for longer.
    held = np.maximum(context.period, 1.0 / np.asarray(unit["rate"]))
    return parameter_record(
        {
            "place_variance": receiver["position_noise"] ** 2
            + receiver["bias"] ** 2
            + _LEAST_PLACE**2,
            "velocity_variance": receiver["speed_noise"] ** 2 + _LEAST_VELOCITY**2,
            # No filter averages a bias out that lasts.
            "least_variance": receiver["bias"] ** 2,
            "acceleration_density": (unit["acceleration_noise"] ** 2 + _LEAST_ACCELERATION**2)
            * held,
            "yaw_rate_density": (unit["yaw_rate_noise"] ** 2 + _LEAST_YAW_RATE**2) * held,
            "acceleration_bias": unit["acceleration_bias"],
            "yaw_rate_bias": unit["yaw_rate_bias"],
            "bias_time": unit["bias_time"],
            "most_held": np.maximum(MOST_HELD, 3.0 * held),
            "lever_x": antenna[:, 0] + rear,
            "lever_y": antenna[:, 1],
            # Without a unit there is no place where the acceleration is measured.
            "unit_x": (place[:, 0] + rear) if imu is not None else np.zeros(context.runs),
            "unit_y": place[:, 1],
            "rear": rear,
            "wheelbase": columns["wheelbase"],
        }
    )


@compiled
def _update(
    records: Any,
    grounds: Grounds,
    newest: tuple[Floats, Floats, Floats, Floats],
    filters: tuple[Floats, Floats, Floats, Floats, Floats],
    estimate: Floats,
    stamp: Floats,
) -> None:
    fix, fix_stamp, sample, sample_stamp = newest
    states, covariances, rows, queue, scratch = filters
    for run in range(rows.shape[0]):
        record, state, covariance = records[run], states[run], covariances[run]
        row = rows[run]
        of = Filter(record, grounds.segments[run], state, covariance, row, queue[run], scratch)
        if sample_stamp[run] > row[SEEN] and is_number(sample[run]):
            add_sample(of, sample[run], sample_stamp[run])
        if fix_stamp[run] > row[FIX_TIME]:
            add_fix(row, fix[run], fix_stamp[run])
        if 0.0 <= row[WAITING] <= row[SEEN]:
            use_fix(of)
        if row[TIME] >= 0.0 and row[NOW_TIME] > stamp[run]:
            age = row[NOW_TIME] - row[TIME]
            variance = lateral_variance(state, covariance, record["rear"], age)
            # NaN compares false: it is no estimate.
            if variance + record["least_variance"] <= MOST_DEVIATION * MOST_DEVIATION:
                _write(record, ground_of(grounds, run), state, row, estimate[run])
                stamp[run] = row[NOW_TIME]


@inlined
def _write(record: Any, ground: Ground, state: Floats, row: Floats, estimate: Floats) -> None:
    """Write the estimate of the box centre and its place on the road."""
    heading, rate = row[NOW_HEADING], row[NOW_RATE] - state[YAW_RATE_BIAS]
    sine, cosine = sin_cos(heading)
    x, y = row[NOW_X] + record["rear"] * cosine, row[NOW_Y] + record["rear"] * sine
    speed = max(0.0, row[NOW_SPEED])
    estimate[signals.EGO_X], estimate[signals.EGO_Y], estimate[signals.EGO_HEADING] = x, y, heading
    estimate[signals.EGO_SPEED] = speed
    estimate[signals.EGO_ACCELERATION] = row[NOW_ACCELERATION] - state[ACCELERATION_BIAS]
    # The angle of wheels that roll where the ego goes; unknown, and so straight, at standstill.
    estimate[signals.EGO_STEERING] = (
        atan(record["wheelbase"] * rate / speed) if speed > MOVING else 0.0
    )
    estimate[signals.EGO_YAW_RATE] = rate
    s, d, road_heading, curvature = place_on(ground, x, y)
    place = estimate[signals.ESTIMATE_PLACE :]
    place[signals.PLACE_S], place[signals.PLACE_D] = s, d
    place[signals.PLACE_HEADING], place[signals.PLACE_CURVATURE] = road_heading, curvature
    place[signals.PLACE_LANE] = lane_of(ground, s, d)
    place[signals.PLACE_OFFSET] = d - center_at(ground, s, d)
