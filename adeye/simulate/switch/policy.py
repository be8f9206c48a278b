"""Compiled: who shall act in one run at one tick, by each policy, and why.

A voter agrees with another where both parts of their commands differ by no more than a tolerance.
The acting command is one that a majority agrees with, so with at most one voter of three, or two of
five, at fault in any way, it is within the tolerance of the command of a sound one.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from adeye.kernel.jit import inlined
from adeye.signals import (
    DEGRADED,
    FAULT,
    NO_CHANNEL,
    REASON_DEFAULT,
    REASON_LATCHED,
    REASON_NO_CHANNEL,
    REASON_NO_MAJORITY,
    REASON_REQUEST,
    REASON_RETURNED,
    REASON_STALENESS,
    REASON_STUCK,
    REASON_VOTED,
    REQUESTS_AUTHORITY,
    SILENT,
    Bools,
    Floats,
    Ints,
)

# --- Compiled: the majority among channels that vote with their commands --------------------------


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


# --- What the switch remembers of a run, and the policies, by number: shared by its compiled
# parts.

TIME_TOLERANCE: Final = 1e-9
"""Slack of comparisons of times [s]: multiples of the step are not exact."""

POLICIES: Final = ("fixed_priority", "hysteresis", "voting", "stuck")
FIXED_PRIORITY, HYSTERESIS, VOTING, STUCK = range(4)

START: Final = -2
"""Stands for a channel before the first one has acted."""

# What is remembered in whole numbers.
(
    HOLDER,  # channel that keeps the authority that it took, -1 for none
    HEARD,  # whether the default, or a majority, has been usable
    CONNECTED,  # channel that the switch lies at, START before the first
    PENDING,  # channel that it is being handed over to, -1 for none
    PENDING_REASON,  # why
    SOURCE,  # channel whose command acted last, -1 for nobody, START before the first
    BLENDING,  # whether the acting command is still on its way to that of its channel
) = range(7)
WORDS: Final = 7

# What is remembered in real numbers.
(
    QUIET,  # since when the default is healthy and nobody requests [s], NaN if it is not so
    DUE,  # when the pending handover takes effect [s]
    ACCELERATION,  # acting acceleration of the tick before [m/s²]
    STEERING,  # acting steering angle of the tick before [rad]
) = range(4)
NUMBERS: Final = 4


# --- Compiled: who shall act in one run at one tick, by each policy, and why ----------------------


@inlined
def decide(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    order: Ints,
    voters: Bools,
    time: float,
    numbers: Floats,
    status: Ints,
    since: Floats,
    words: Ints,
    memory: Floats,
    usable: Bools,
    group: Bools,
) -> tuple[int, int]:
    """Decide one run at one tick.

    Args:
        record: The switch's parameters.
        order: (C,) channels, highest priority first; -1 from where the list ends.
        voters: (C,) channels that vote: their commands count, their requests do not.
        time: [s].
        numbers: (C, 3) acceleration [m/s²], steering angle [rad], stamp [s]; the median takes the
            place of the command of the voter that acts.
        status: (C,).
        since: (C,) since when each requests without a break [s], NaN if it does not; updated.
        words: (WORDS,) see ``columns``; updated.
        memory: (NUMBERS,) see ``columns``; updated.
        usable: (C,) out.
        group: (C,) scratch.

    Returns:
        The channel that shall act and why.
    """
    for channel in range(status.shape[0]):
        usable[channel] = _is_usable(record, time, numbers[channel], status[channel])
        if not usable[channel] or status[channel] != REQUESTS_AUTHORITY or voters[channel]:
            since[channel] = np.nan
        elif np.isnan(since[channel]):
            since[channel] = time
    default = int(record["default"])
    policy = int(record["policy"])
    if policy == VOTING:
        return _by_vote(record, order, voters, time, numbers, since, words, usable, group)
    if usable[default]:
        words[HEARD] = 1
    if policy == STUCK:
        return default, REASON_STUCK
    returns = policy == HYSTERESIS and _returns(record, order, time, status, words, memory, usable)
    return _by_priority(record, order, time, since, words, usable, returns)


@inlined
def _by_priority(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    order: Ints,
    time: float,
    since: Floats,
    words: Ints,
    usable: Bools,
    returns: bool,  # noqa: FBT001 - a kernel
) -> tuple[int, int]:
    """Decide by requests and priority; ``returns`` says that the default acts again."""
    default = int(record["default"])
    holder = _latched_or_requesting(record, order, time, since, words)
    wanted = default if holder == NO_CHANNEL else holder
    if usable[wanted]:
        chosen = wanted
    elif wanted == default and _starts_up(record, time, words):
        return NO_CHANNEL, REASON_NO_CHANNEL
    else:
        chosen = _first_usable(order, usable)
    if chosen == NO_CHANNEL:
        return NO_CHANNEL, REASON_NO_CHANNEL
    if int(record["policy"]) == HYSTERESIS:
        if chosen != default and (
            words[HOLDER] == NO_CHANNEL or _precedes(order, chosen, words[HOLDER])
        ):
            words[HOLDER] = chosen
    elif record["latch"] > 0.0 and _is_above(order, chosen, wanted, default):
        words[HOLDER] = chosen
    if returns and chosen == default:
        return chosen, REASON_RETURNED
    return chosen, _reason(chosen, wanted, since, usable[default], default)


@inlined
def _by_vote(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    order: Ints,
    voters: Bools,
    time: float,
    numbers: Floats,
    since: Floats,
    words: Ints,
    usable: Bools,
    group: Bools,
) -> tuple[int, int]:
    """Decide by requests of those that do not vote, else by the majority of those that do."""
    default = int(record["default"])
    winner = majority(record, order, voters, numbers, usable, group)
    if winner != NO_CHANNEL:
        words[HEARD] = 1
    holder = _latched_or_requesting(record, order, time, since, words)
    if holder != NO_CHANNEL and usable[holder]:
        if record["latch"] > 0.0 and _precedes(order, holder, default):
            words[HOLDER] = holder
        is_asked = not np.isnan(since[holder])
        return holder, REASON_REQUEST if is_asked else REASON_LATCHED
    if winner != NO_CHANNEL:
        return winner, REASON_DEFAULT if winner == default else REASON_VOTED
    if _starts_up(record, time, words):
        return NO_CHANNEL, REASON_NO_CHANNEL
    fallback = int(record["fallback"])
    if fallback == NO_CHANNEL or not usable[fallback]:
        return NO_CHANNEL, REASON_NO_MAJORITY
    if record["latch"] > 0.0 and not voters[fallback] and _precedes(order, fallback, default):
        words[HOLDER] = fallback
    return fallback, REASON_NO_MAJORITY


@inlined
def _returns(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    order: Ints,
    time: float,
    status: Ints,
    words: Ints,
    memory: Floats,
    usable: Bools,
) -> bool:
    """Tell whether authority that was taken goes back to the default at this tick."""
    default = int(record["default"])
    is_quiet = (
        usable[default]
        and status[default] != SILENT
        and (status[default] != DEGRADED or record["return_degraded"] > 0.0)
    )
    for channel in order:
        # Also a request that does not stand long enough to be granted is no quiet.
        if (
            channel >= 0
            and channel != default
            and usable[channel]
            and status[channel] == REQUESTS_AUTHORITY
        ):
            is_quiet = False
    if not is_quiet:
        memory[QUIET] = np.nan
    elif np.isnan(memory[QUIET]):
        memory[QUIET] = time
    if words[HOLDER] == NO_CHANNEL:
        return False
    # NaN fails the comparison: without quiet nothing returns.
    if time - memory[QUIET] >= record["return_after"] - TIME_TOLERANCE:
        words[HOLDER] = NO_CHANNEL
        return True
    return False


@inlined
def _starts_up(record: Any, time: float, words: Ints) -> bool:
    # Sensors with latency have not delivered yet.
    return bool(not words[HEARD] and time <= record["staleness"] + TIME_TOLERANCE)


@inlined
def _is_usable(record: Any, time: float, numbers: Floats, status: int) -> bool:
    # A silent channel says nothing, so only the age of its last command tells; a fault it reports.
    if status == FAULT:
        return False
    if not (np.isfinite(numbers[0]) and np.isfinite(numbers[1])):
        return False
    # NaN fails every comparison, so a stamp that is no number is not usable.
    return bool(numbers[2] >= 0.0 and time - numbers[2] <= record["staleness"] + TIME_TOLERANCE)


@inlined
def _latched_or_requesting(
    record: Any, order: Ints, time: float, since: Floats, words: Ints
) -> int:
    """Return the first in order of priority that holds authority or was granted it."""
    for channel in order:
        if channel < 0:
            break
        if channel == words[HOLDER]:
            return int(channel)
        if time - since[channel] >= record["debounce"] - TIME_TOLERANCE:
            return int(channel)
    return NO_CHANNEL


@inlined
def _first_usable(order: Ints, usable: Bools) -> int:
    for channel in order:
        if channel >= 0 and usable[channel]:
            return int(channel)
    return NO_CHANNEL


@inlined
def _is_above(order: Ints, chosen: int, wanted: int, default: int) -> bool:
    """Tell whether the chosen channel stands above the default and the one that was wanted."""
    for channel in order:
        if channel == default:
            return False
        if channel == chosen:
            return True
        if channel == wanted:
            return False
    return False


@inlined
def _precedes(order: Ints, one: int, other: int) -> bool:
    """Tell whether one channel has the higher priority of two; not of one and itself."""
    for channel in order:
        if channel == other:
            return False
        if channel == one:
            return True
    return False


@inlined
def _reason(chosen: int, wanted: int, since: Floats, default_usable: bool, default: int) -> int:  # noqa: FBT001 - a kernel
    if chosen != wanted:
        return REASON_STALENESS
    if not np.isnan(since[chosen]):
        return REASON_REQUEST
    if chosen == default:
        return REASON_DEFAULT
    return REASON_LATCHED if default_usable else REASON_STALENESS
