"""The switch on a batch: proposals of all channels in, the acting command and its holder out.

A voter agrees with another where both parts of their commands differ by no more than a tolerance.
The acting command is one that a majority agrees with, so with at most one voter of three, or two of
five, at fault in any way, it is within the tolerance of the command of a sound one.

A fork may override who acts from a tick on, around what the switch decides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye import signals
from adeye.kernel.jit import compiled, inlined
from adeye.ports import SwitchContext
from adeye.signals import (
    Authority,
    Bools,
    ControlCommand,
    Floats,
    Ints,
    SwitchFaults,
    parameter_record,
    spec_columns,
)
from adeye.spec.architecture import Switch
from adeye.spec.quantity import SI

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.ports import SwitchModel
    from adeye.sweep.case import TestCase

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
    winner = signals.NO_CHANNEL
    default = int(record["default"])
    if _agree_with(bench, run, default) >= record["quorum"]:
        winner = default
    for channel in bench.order[run]:
        if (
            winner == signals.NO_CHANNEL
            and channel >= 0
            and _agree_with(bench, run, channel) >= record["quorum"]
        ):
            winner = int(channel)
    if winner != signals.NO_CHANNEL and record["median"] > 0.0:
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
        asks = status[channel] == signals.REQUESTS_AUTHORITY and not bench.voters[run, channel]
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
        return default, signals.REASON_STUCK
    returns = policy == HYSTERESIS and _returns(bench, run, time)
    return _by_priority(bench, run, time, returns)


@inlined
def _by_priority(bench: Bench, run: int, time: float, returns: bool) -> tuple[int, int]:  # noqa: FBT001 - a kernel
    """Decide by requests and priority; ``returns`` says that the default acts again."""
    record, order, words = bench.records[run], bench.order[run], bench.words[run]
    since, usable = bench.since[run], bench.usable
    default = int(record["default"])
    holder = _latched_or_requesting(bench, run, time)
    wanted = default if holder == signals.NO_CHANNEL else holder
    if usable[wanted]:
        chosen = wanted
    elif wanted == default and _starts_up(record, time, words):
        return signals.NO_CHANNEL, signals.REASON_NO_CHANNEL
    else:
        chosen = _first_usable(order, usable)
    if chosen == signals.NO_CHANNEL:
        return signals.NO_CHANNEL, signals.REASON_NO_CHANNEL
    if int(record["policy"]) == HYSTERESIS:
        if chosen != default and (
            words[HOLDER] == signals.NO_CHANNEL or _precedes(order, chosen, words[HOLDER])
        ):
            words[HOLDER] = chosen
    elif record["latch"] > 0.0 and _is_above(order, chosen, wanted, default):
        words[HOLDER] = chosen
    if returns and chosen == default:
        return chosen, signals.REASON_RETURNED
    return chosen, _reason(chosen, wanted, since, usable[default], default)


@inlined
def _by_vote(bench: Bench, run: int, time: float) -> tuple[int, int]:
    """Decide by requests of those that do not vote, else by the majority of those that do."""
    record, order, words = bench.records[run], bench.order[run], bench.words[run]
    since, usable = bench.since[run], bench.usable
    default = int(record["default"])
    winner = majority(bench, run)
    if winner != signals.NO_CHANNEL:
        words[HEARD] = 1
    holder = _latched_or_requesting(bench, run, time)
    if holder != signals.NO_CHANNEL and usable[holder]:
        if record["latch"] > 0.0 and _precedes(order, holder, default):
            words[HOLDER] = holder
        is_asked = not np.isnan(since[holder])
        return holder, signals.REASON_REQUEST if is_asked else signals.REASON_LATCHED
    if winner != signals.NO_CHANNEL:
        return winner, signals.REASON_DEFAULT if winner == default else signals.REASON_VOTED
    if _starts_up(record, time, words):
        return signals.NO_CHANNEL, signals.REASON_NO_CHANNEL
    fallback = int(record["fallback"])
    if fallback == signals.NO_CHANNEL or not usable[fallback]:
        return signals.NO_CHANNEL, signals.REASON_NO_MAJORITY
    if (
        record["latch"] > 0.0
        and not bench.voters[run, fallback]
        and _precedes(order, fallback, default)
    ):
        words[HOLDER] = fallback
    return fallback, signals.REASON_NO_MAJORITY


@inlined
def _returns(bench: Bench, run: int, time: float) -> bool:
    """Tell whether authority that was taken goes back to the default at this tick."""
    record, status, words = bench.records[run], bench.status[run], bench.words[run]
    memory, usable = bench.memory[run], bench.usable
    default = int(record["default"])
    is_quiet = (
        usable[default]
        and status[default] != signals.SILENT
        and (status[default] != signals.DEGRADED or record["return_degraded"] > 0.0)
    )
    for channel in bench.order[run]:
        # Also a request that does not stand long enough to be granted is no quiet.
        if (
            channel >= 0
            and channel != default
            and usable[channel]
            and status[channel] == signals.REQUESTS_AUTHORITY
        ):
            is_quiet = False
    if not is_quiet:
        memory[QUIET] = np.nan
    elif np.isnan(memory[QUIET]):
        memory[QUIET] = time
    if words[HOLDER] == signals.NO_CHANNEL:
        return False
    # NaN fails the comparison: without quiet nothing returns.
    if time - memory[QUIET] >= record["return_after"] - TIME_TOLERANCE:
        words[HOLDER] = signals.NO_CHANNEL
        return True
    return False


@inlined
def _starts_up(record: Any, time: float, words: Ints) -> bool:
    # Sensors with latency have not delivered yet.
    return bool(not words[HEARD] and time <= record["staleness"] + TIME_TOLERANCE)


@inlined
def _is_usable(record: Any, time: float, numbers: Floats, status: int) -> bool:
    # A silent channel says nothing, so only the age of its last command tells; a fault it reports.
    if status == signals.FAULT:
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
    return signals.NO_CHANNEL


@inlined
def _first_usable(order: Ints, usable: Bools) -> int:
    for channel in order:
        if channel >= 0 and usable[channel]:
            return int(channel)
    return signals.NO_CHANNEL


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
        return signals.REASON_STALENESS
    if not np.isnan(since[chosen]):
        return signals.REASON_REQUEST
    if chosen == default:
        return signals.REASON_DEFAULT
    return signals.REASON_LATCHED if default_usable else signals.REASON_STALENESS


# --- Compiled: how a decision takes effect: its latency, and the way from one command to the other


@inlined
def connect(  # noqa: PLR0913, PLR0917 - a kernel
    bench: Bench,
    run: int,
    time: float,
    chosen: int,
    reason: int,
    is_stuck: bool,  # noqa: FBT001 - a kernel
    delay: float,
) -> tuple[int, int]:
    """Give authority as was decided, after the latency of a handover.

    The first channel to act does so at once, and so does nobody. A decision that changes before it
    takes effect is withdrawn, and the latency of the new one begins.

    Args:
        bench: What is read and written.
        run: Which row is meant.
        time: [s].
        chosen: Channel that shall act, -1 for none.
        reason: Why.
        is_stuck: Whether a fault keeps the switch where it lies.
        delay: How much later a change takes effect by a fault, if decided now [s].

    Returns:
        The channel that has authority and why; during a handover the old one, or nobody where it is
        not usable or is to coast meanwhile. The reason is the fault only while that keeps the
        switch from what was decided.
    """
    record, words, memory = bench.records[run], bench.words[run], bench.memory[run]
    if is_stuck:
        if words[CONNECTED] == START:
            words[CONNECTED] = int(record["default"])
        words[PENDING] = signals.NO_CHANNEL
        # Where it lies at what was chosen it is kept from nothing: two faults that keep it from
        # nothing at different times give one and the same result.
        acting = int(words[CONNECTED])
        return acting, reason if acting == chosen else signals.REASON_STUCK
    if chosen == signals.NO_CHANNEL:
        words[PENDING] = signals.NO_CHANNEL
        return signals.NO_CHANNEL, reason
    connected = int(words[CONNECTED])
    if connected in (START, chosen):
        words[CONNECTED] = chosen
        words[PENDING] = signals.NO_CHANNEL
        return chosen, reason
    if words[PENDING] != chosen:
        words[PENDING] = chosen
        words[PENDING_REASON] = reason
        memory[DUE] = time + record["handover"] + delay
    if time >= memory[DUE] - TIME_TOLERANCE:
        words[CONNECTED] = chosen
        words[PENDING] = signals.NO_CHANNEL
        return chosen, int(words[PENDING_REASON])
    if record["coasts"] > 0.0 or not bench.usable[connected]:
        return signals.NO_CHANNEL, signals.REASON_HANDOVER
    return connected, signals.REASON_HANDOVER


@inlined
def blend(bench: Bench, run: int, acting: int) -> None:
    """Write the acting command into the memory, with limited rates after a change of channel.

    Nobody acts where the channel with authority is not usable: then the ego coasts at once, with
    the steering as it was.

    Args:
        bench: What is read and written.
        run: Which row is meant.
        acting: Channel with authority, -1 for none.
    """
    record, words, memory = bench.records[run], bench.words[run], bench.memory[run]
    if acting == signals.NO_CHANNEL or not bench.usable[acting]:
        memory[ACCELERATION] = 0.0
        if words[SOURCE] != START:
            words[SOURCE] = signals.NO_CHANNEL
        return
    if words[SOURCE] != acting:
        words[BLENDING] = words[SOURCE] != START and record["is_bumpless"] > 0.0
        words[SOURCE] = acting
    acceleration, steering = bench.numbers[run, acting, 0], bench.numbers[run, acting, 1]
    if words[BLENDING]:
        memory[ACCELERATION] = _towards(memory[ACCELERATION], acceleration, record["most_jerk"])
        memory[STEERING] = _towards(memory[STEERING], steering, record["most_steering"])
        words[BLENDING] = memory[ACCELERATION] != acceleration or memory[STEERING] != steering
    else:
        memory[ACCELERATION], memory[STEERING] = acceleration, steering


@inlined
def _towards(before: float, target: float, most: float) -> float:
    """Move towards a target by so much at most; without a limit, to the very same bits."""
    if abs(target - before) <= most:
        return target
    return before + most if target > before else before - most


# --- The switch on a batch: proposals of all channels in, the acting command and its holder out ---


def make_switch(context: SwitchContext) -> SwitchModel:
    """Build the switch of an architecture.

    Args:
        context: Spec of each run, channel ids and clock.
    """
    return Arbiter(context)


class Arbiter:
    """Decides by the policy of each run, and hands authority over as it says.

    A channel is usable unless it is in fault, its command is not finite, or it is older than the
    staleness time. Only a usable channel's command acts; without one the ego coasts: no
    acceleration, steering as last commanded.

    *Fixed priority*: the default channel acts until another has requested authority for the
    debounce time, the first in order of priority if there are several, or until the acting channel
    is unusable. Then the first usable channel in order of priority acts. Authority that a channel
    above the default has taken is kept if the switch latches; a request of higher priority still
    overrides it.

    *Hysteresis*: the same, but authority that any channel has taken from the default goes back once
    the default has been usable, neither silent nor degraded, and nobody has requested authority,
    for ``return_after`` without a break.

    *Voting*: the default acts while a majority of the voters agrees with it, else the first voter
    in order of priority that one agrees with. Requests count of those only that do
    not vote. Without a majority ``without_majority`` acts, or nobody.

    *Stuck*: the default, whatever happens.

    Start-up: a default that has not been usable yet, or a majority that has not been there yet,
    hands over to nobody before the staleness time has passed since the start, because sensors with
    latency have not delivered by then.
    """

    def __init__(self, context: SwitchContext) -> None:
        specs, ids = context.specs, context.channels
        runs, count = len(specs), len(ids)
        self._bench = Bench(
            records=parameter_record(
                spec_columns(specs, lambda spec: _numbers(spec, ids, context.step))
            ),
            order=np.full((runs, count), -1, dtype=np.int64),
            voters=np.zeros((runs, count), dtype=np.bool_),
            numbers=np.zeros((runs, count, 3)),
            status=np.zeros((runs, count), dtype=np.int64),
            since=np.full((runs, count), np.nan),
            words=np.zeros((runs, WORDS), dtype=np.int64),
            memory=np.zeros((runs, NUMBERS)),
            usable=np.zeros(count, dtype=np.bool_),
            group=np.zeros(count, dtype=np.bool_),
        )
        self._bench.words[:, [HOLDER, PENDING]] = signals.NO_CHANNEL
        self._bench.words[:, [CONNECTED, SOURCE]] = START
        self._bench.memory[:, QUIET] = np.nan
        for run, spec in enumerate(specs):
            ranked = [ids.index(name) for name in spec.priority]
            self._bench.order[run, : len(ranked)] = ranked
            if spec.policy == "voting":
                self._bench.voters[run, [ids.index(name) for name in spec.voters or ()]] = True
        self._sound = SwitchFaults.none(runs)

    def arbitrate(
        self,
        time: float,
        proposals: Sequence[ControlCommand],
        faults: SwitchFaults | None = None,
    ) -> tuple[Floats, Authority]:
        """Return the acting command (B, 2) and who has authority, why; as the port says."""
        bench = self._bench
        for index, proposal in enumerate(proposals):
            bench.numbers[:, index, 0] = proposal.acceleration
            bench.numbers[:, index, 1] = proposal.steering_angle
            bench.numbers[:, index, 2] = proposal.stamp
            bench.status[:, index] = proposal.status
        wrong = self._sound if faults is None else faults
        runs = bench.words.shape[0]
        command = np.zeros((runs, 2))
        decision = np.zeros((runs, 2), dtype=np.int64)
        _arbitrate(bench, time, wrong.stuck, wrong.delay, command, decision)
        return command, Authority(decision[:, 0].copy(), decision[:, 1].copy())


def _numbers(spec: Switch, ids: tuple[str, ...], step: float) -> dict[str, float]:
    fallback = spec.without_majority
    bumpless = spec.bumpless
    return {
        "policy": POLICIES.index(spec.policy),
        "default": ids.index(spec.default),
        "debounce": spec.debounce,
        "latch": spec.latch,
        "staleness": spec.staleness,
        "return_after": np.inf if spec.return_after is None else spec.return_after,
        "return_degraded": spec.return_degraded,
        "acceleration_tolerance": spec.acceleration_tolerance or 0.0,
        "steering_tolerance": spec.steering_tolerance or 0.0,
        "quorum": spec.agreeing,
        "median": spec.vote == "median",
        "fallback": signals.NO_CHANNEL if fallback is None else ids.index(fallback),
        "handover": spec.handover,
        "coasts": spec.meanwhile == "coast",
        "is_bumpless": bumpless is not None,
        "most_jerk": np.inf if bumpless is None else bumpless.jerk * step,
        "most_steering": np.inf if bumpless is None else bumpless.steering_rate * step,
    }


@compiled
def _arbitrate(
    bench: Bench, time: float, stuck: Bools, delay: Floats, command: Floats, decision: Ints
) -> None:
    for run in range(bench.records.shape[0]):
        chosen, why = decide(bench, run, time)
        acting, reason = connect(bench, run, time, chosen, why, stuck[run], delay[run])
        blend(bench, run, acting)
        decision[run, 0] = acting
        decision[run, 1] = reason
        command[run, 0] = bench.memory[run, ACCELERATION]
        command[run, 1] = bench.memory[run, STEERING]


# --- The authority override of a fork: who acts from a tick on, around what the switch decides ----

_NEVER = np.iinfo(np.int64).max


def overriding(
    switch: SwitchModel, cases: Sequence[TestCase], context: SwitchContext
) -> SwitchModel:
    """Put the overrides of some test cases around their switch.

    Args:
        switch: Decides for all runs.
        cases: B test cases of one structure.
        context: What the switch was built with.

    Returns:
        The same switch if no test case has an override.
    """
    if all(case.override is None for case in cases):
        return switch
    return OverriddenSwitch(switch, cases, context)


class OverriddenSwitch:
    """A switch whose decision is replaced in some runs from a tick on.

    Before that tick, and where the switch gives authority to the same channel, its decision stands
    with command and reason: a fork with the original decisions is the original, bit for bit. The
    channel acts under the conditions of every switch: one that is silent, in fault, not finite or
    stale cannot, and then the ego coasts, with no acceleration and the steering last commanded.
    """

    def __init__(
        self, switch: SwitchModel, cases: Sequence[TestCase], context: SwitchContext
    ) -> None:
        """Prepare the overrides, see ``overriding``."""
        self._switch = switch
        overrides = [case.override for case in cases]
        self._from: Ints = np.array(
            [_NEVER if item is None else item.from_tick for item in overrides], dtype=np.int64
        )
        # A switch that knows one channel tells whether it can act, and gives its command if so.
        alone = [
            _only(spec, spec.default if item is None else item.channel)
            for spec, item in zip(context.specs, overrides, strict=True)
        ]
        self._forced = make_switch(SwitchContext(alone, context.channels, context.step))
        self._channel: Ints = np.array(
            [context.channels.index(spec.default) for spec in alone], dtype=np.int64
        )
        self._held = np.zeros(len(overrides))
        self._tick = 0

    def arbitrate(
        self,
        time: float,
        proposals: Sequence[ControlCommand],
        faults: SwitchFaults | None = None,
    ) -> tuple[Floats, Authority]:
        """Return the acting command (B, 2) and who has authority, why; as the port says.

        Where the authority is overridden, nothing that is wrong with the switch matters.
        """
        command, authority = self._switch.arbitrate(time, proposals, faults)
        forced, own = self._forced.arbitrate(time, proposals)
        can_act = own.channel != signals.NO_CHANNEL
        channel = np.where(can_act, self._channel, signals.NO_CHANNEL)
        agrees = (authority.channel == self._channel) | (authority.channel == channel)
        is_changed: Bools = (self._from <= self._tick) & ~agrees
        coasting = np.stack([np.zeros_like(self._held), self._held], axis=1)
        other = np.where(can_act[:, np.newaxis], forced, coasting)
        command = np.where(is_changed[:, np.newaxis], other, command)
        self._held = command[:, 1].copy()
        self._tick += 1
        return command, Authority(
            np.where(is_changed, channel, authority.channel),
            np.where(is_changed, signals.REASON_OVERRIDE, authority.reason),
        )


def _only(spec: Switch, channel: str) -> Switch:
    """Make the switch that knows one channel, which is stale as it is for the real one."""
    content = {
        "policy": "fixed_priority",
        "priority": (channel,),
        "default": channel,
        "staleness": spec.staleness,
    }
    return Switch.model_validate(content, context=SI)
