"""Fixes that come late: a filter at the time of the newest fix, and the samples since then.

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
from typing import TYPE_CHECKING, Any, Final

from adeye.channels.inertial import (
    ACCELERATION_BIAS,
    HEADING,
    LOST_HEADING,
    SPEED,
    YAW_RATE_BIAS,
    X,
    Y,
    begin,
    carry,
    correct,
    predict,
)
from adeye.kernel.jit import compiled, inlined
from adeye.signals import IMU_ACCELERATION_X, IMU_YAW_RATE

if TYPE_CHECKING:
    from adeye.signals import Floats

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


@inlined
def add_sample(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    state: Floats,
    covariance: Floats,
    row: Floats,
    queue: Floats,
    sample: Floats,
    time: float,
) -> None:
    """Put a sample into the queue and carry the estimate on to it."""
    rate = sample[IMU_YAW_RATE]
    # From the mount to the rear axle. What a faster turn adds at the side sums up to a change of
    # speed, so its noise does not sum up.
    acceleration = sample[IMU_ACCELERATION_X] + rate * rate * record["unit_x"]
    if time - row[SEEN] > record["most_held"]:
        _give_up(row)
    else:
        acceleration += record["unit_y"] * (rate - row[SEEN_RATE]) / (time - row[SEEN])
    row[SEEN], row[SEEN_RATE] = time, rate
    if row[TIME] >= 0.0:
        _carry_now(state, row, time, acceleration, rate)
    if row[COUNT] > 0.0:
        oldest = queue[int(row[FIRST]), SAMPLE_TIME]
        if row[COUNT] >= queue.shape[0] or time - oldest > LATEST_FIX:
            # No fix comes for that time any more.
            _advance(record, state, covariance, row, queue, oldest)
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
def _advance(
    record: Any, state: Floats, covariance: Floats, row: Floats, queue: Floats, until: float
) -> None:
    """Move the filter on along the queue to a time [s], not after its last sample."""
    while row[COUNT] > 0.0:
        sample = queue[int(row[FIRST])]
        time = sample[SAMPLE_TIME]
        acceleration, rate = sample[SAMPLE_ACCELERATION], sample[SAMPLE_RATE]
        _step(record, state, covariance, row, min(time, until), acceleration, rate)
        if time > until:
            return
        row[FIRST] = (int(row[FIRST]) + 1) % queue.shape[0]
        row[COUNT] -= 1.0


@inlined
def _step(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    state: Floats,
    covariance: Floats,
    row: Floats,
    time: float,
    acceleration: float,
    rate: float,
) -> None:
    """Move the filter on by a sample to a time [s]; before it has begun it only learns that."""
    if row[TIME] >= 0.0:
        predict(record, state, covariance, acceleration, rate, time - row[TIME])
        row[TIME] = time
    row[ACCELERATION], row[RATE] = acceleration, rate


@inlined
def add_fix(row: Floats, fix: Floats, time: float) -> None:
    """Let a fix wait, unless another one does."""
    row[FIX_TIME] = time
    if row[WAITING] < 0.0:
        row[WAITING] = time
        for column in range(fix.shape[0]):
            row[WAITING_FIX + column] = fix[column]


@inlined
def use_fix(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    segments: Floats,
    state: Floats,
    covariance: Floats,
    row: Floats,
    queue: Floats,
    scratch: Floats,
) -> None:
    """Use the fix that waits: the filter at its time is corrected, the estimate goes on from there.

    Without a fix in it, the filter is only moved on to its time.
    """
    time, fix = row[WAITING], row[WAITING_FIX : WAITING_FIX + 4]
    row[WAITING] = -1.0
    if row[TIME] > time:
        # Older than all samples in the queue.
        return
    if row[TIME] >= 0.0:
        _advance(record, state, covariance, row, queue, time)
    if not is_number(fix):
        _carry_on(state, row, queue)
        return
    # NaN compares false: a filter that has broken down begins anew, too.
    if row[TIME] >= 0.0 and covariance[HEADING, HEADING] <= LOST_HEADING * LOST_HEADING:
        rate = row[RATE]
        if row[COUNT] > 0.0:
            # The time of the fix lies between that of the sample before and that of the next one.
            rate = 0.5 * (rate + queue[int(row[FIRST]), SAMPLE_RATE])
        row[INNOVATION] = correct(record, state, covariance, fix, rate, scratch)
    else:
        _begin_in_queue(row, queue, time)
        begin(record, segments, state, covariance, fix, row[RATE])
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
