"""Compiled: who shall act in one run at one tick, by each policy, and why.

A voter agrees with another where both parts of their commands differ by no more than a tolerance.
The acting command is one that a majority agrees with, so with at most one voter of three, or two of
five, at fault in any way, it is within the tolerance of the command of a sound one.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

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


class Bench(NamedTuple):
    """What a tick of the switch reads and writes, run by run.

    Attributes:
        records: (B,) the switch's parameters.
        order: (B, C) channels, highest priority first; -1 from where the list ends.
        voters: (B, C) channels that vote: their commands count, their requests do not.
        numbers: (B, C, 3) acceleration [m/s²], steering angle [rad], stamp [s]; where the median is
            to act, it takes the place of the command of the voter that acts.
        status: (B, C).
        since: (B, C) since when each requests without a break [s], NaN if it does not; updated.
        words: (B, WORDS) updated.
        memory: (B, NUMBERS) updated.
        usable: (C,) which channels can act, out; what is not usable agrees with nobody.
        group: (C,) scratch: who agrees.
    """

    records: Any
    order: Ints
    voters: Bools
    numbers: Floats
    status: Ints
    since: Floats
    words: Ints
    memory: Floats
    usable: Bools
    group: Bools


# --- Compiled: the majority among channels that vote with their commands --------------------------


@inlined
def majority(bench: Bench, run: int) -> int:
    """Find the voter that acts: the default, else the first in order that a majority agrees with.

    Returns:
        The channel, -1 without a majority.
    """
    record, numbers, group = bench.records[run], bench.numbers[run], bench.group
    winner = NO_CHANNEL
    default = int(record["default"])
    if _agree_with(bench, run, default) >= record["quorum"]:
        winner = default
    for channel in bench.order[run]:
        if (
            winner == NO_CHANNEL
            and channel >= 0
            and _agree_with(bench, run, channel) >= record["quorum"]
        ):
            winner = int(channel)
    if winner != NO_CHANNEL and record["median"] > 0.0:
        _agree_with(bench, run, winner)
        acceleration, steering = _median(numbers[:, 0], group), _median(numbers[:, 1], group)
        numbers[winner, 0], numbers[winner, 1] = acceleration, steering
    return winner


@inlined
def _agree_with(bench: Bench, run: int, channel: int) -> int:
    """Mark and count the voters that agree with one, itself among them; none if it is no voter."""
    record, numbers, voters = bench.records[run], bench.numbers[run], bench.voters[run]
    usable, group = bench.usable, bench.group
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


# --- Compiled: who shall act in one run at one tick, by each policy, and why ----------------------


@inlined
def decide(bench: Bench, run: int, time: float) -> tuple[int, int]:
    """Decide one run at one tick.

    Returns:
        The channel that shall act and why.
    """
    record, status = bench.records[run], bench.status[run]
    since, usable = bench.since[run], bench.usable
    for channel in range(status.shape[0]):
        usable[channel] = _is_usable(record, time, bench.numbers[run, channel], status[channel])
        asks = status[channel] == REQUESTS_AUTHORITY and not bench.voters[run, channel]
        if not usable[channel] or not asks:
            since[channel] = np.nan
        elif np.isnan(since[channel]):
            since[channel] = time
    default = int(record["default"])
    policy = int(record["policy"])
    if policy == VOTING:
        return _by_vote(bench, run, time)
    if usable[default]:
        bench.words[run, HEARD] = 1
    if policy == STUCK:
        return default, REASON_STUCK
    returns = policy == HYSTERESIS and _returns(bench, run, time)
    return _by_priority(bench, run, time, returns)


@inlined
def _by_priority(bench: Bench, run: int, time: float, returns: bool) -> tuple[int, int]:  # noqa: FBT001 - a kernel
    """Decide by requests and priority; ``returns`` says that the default acts again."""
    record, order, words = bench.records[run], bench.order[run], bench.words[run]
    since, usable = bench.since[run], bench.usable
    default = int(record["default"])
    holder = _latched_or_requesting(bench, run, time)
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
def _by_vote(bench: Bench, run: int, time: float) -> tuple[int, int]:
    """Decide by requests of those that do not vote, else by the majority of those that do."""
    record, order, words = bench.records[run], bench.order[run], bench.words[run]
    since, usable = bench.since[run], bench.usable
    default = int(record["default"])
    winner = majority(bench, run)
    if winner != NO_CHANNEL:
        words[HEARD] = 1
    holder = _latched_or_requesting(bench, run, time)
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
    if (
        record["latch"] > 0.0
        and not bench.voters[run, fallback]
        and _precedes(order, fallback, default)
    ):
        words[HOLDER] = fallback
    return fallback, REASON_NO_MAJORITY


@inlined
def _returns(bench: Bench, run: int, time: float) -> bool:
    """Tell whether authority that was taken goes back to the default at this tick."""
    record, status, words = bench.records[run], bench.status[run], bench.words[run]
    memory, usable = bench.memory[run], bench.usable
    default = int(record["default"])
    is_quiet = (
        usable[default]
        and status[default] != SILENT
        and (status[default] != DEGRADED or record["return_degraded"] > 0.0)
    )
    for channel in bench.order[run]:
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
def _latched_or_requesting(bench: Bench, run: int, time: float) -> int:
    """Return the first in order of priority that holds authority or was granted it."""
    debounce = bench.records[run]["debounce"]
    for channel in bench.order[run]:
        if channel < 0:
            break
        if channel == bench.words[run, HOLDER]:
            return int(channel)
        if time - bench.since[run, channel] >= debounce - TIME_TOLERANCE:
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
