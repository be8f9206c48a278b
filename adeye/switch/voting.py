"""Compiled: the majority among channels that vote with their commands.

A voter agrees with another where both parts of their commands differ by no more than a tolerance.
The acting command is one that a majority agrees with, so with at most one voter of three, or two of
five, at fault in any way, it is within the tolerance of the command of a sound one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from adeye.kernel.jit import inlined
from adeye.signals import NO_CHANNEL, Bools, Floats, Ints


@inlined
def majority(
    record: Any, order: Ints, voters: Bools, numbers: Floats, usable: Bools, group: Bools
) -> int:
    """Find the voter that acts: the default, else the first in order that a majority agrees with.

    Args:
        record: The switch's parameters.
        order: (C,) channels, highest priority first; -1 from where the list ends.
        voters: (C,) channels that vote.
        numbers: (C, 3) acceleration [m/s²], steering angle [rad], stamp [s]; where the median is
            to act, it takes the place of the command of the voter that is returned.
        usable: (C,) what is not usable agrees with nobody.
        group: (C,) scratch: who agrees.

    Returns:
        The channel, -1 without a majority.
    """
    winner = NO_CHANNEL
    default = int(record["default"])
    if _agree_with(record, voters, numbers, usable, default, group) >= record["quorum"]:
        winner = default
    for channel in order:
        if (
            winner == NO_CHANNEL
            and channel >= 0
            and (_agree_with(record, voters, numbers, usable, channel, group) >= record["quorum"])
        ):
            winner = int(channel)
    if winner != NO_CHANNEL and record["median"] > 0.0:
        _agree_with(record, voters, numbers, usable, winner, group)
        acceleration, steering = _median(numbers[:, 0], group), _median(numbers[:, 1], group)
        numbers[winner, 0], numbers[winner, 1] = acceleration, steering
    return winner


@inlined
def _agree_with(
    record: Any, voters: Bools, numbers: Floats, usable: Bools, channel: int, group: Bools
) -> int:
    """Mark and count the voters that agree with one, itself among them; none if it is no voter."""
    count = 0
    for other in range(group.shape[0]):
        # What is not finite was not usable, so the differences are numbers or infinite.
        group[other] = (
            voters[channel]
            and usable[channel]
            and voters[other]
            and usable[other]
            and abs(numbers[channel, 0] - numbers[other, 0]) <= record["acceleration_tolerance"]
            and abs(numbers[channel, 1] - numbers[other, 1]) <= record["steering_tolerance"]
        )
        count += group[other]
    return count


@inlined
def _median(values: Floats, group: Bools) -> float:
    """Return the median of the values of a group; the mean of the middle two of an even number."""
    count = 0
    for member in group:
        count += member
    return 0.5 * _ranked(values, group, (count - 1) // 2) + 0.5 * _ranked(values, group, count // 2)


@inlined
def _ranked(values: Floats, group: Bools, rank: int) -> float:
    """Return the value of a group that so many others lie below."""
    for index in range(group.shape[0]):
        if group[index]:
            below, same = 0, 0
            for other in range(group.shape[0]):
                below += group[other] and values[other] < values[index]
                same += group[other] and values[other] == values[index]
            if below <= rank < below + same:
                return float(values[index])
    return np.nan
