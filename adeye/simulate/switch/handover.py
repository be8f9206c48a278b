"""Compiled: how a decision takes effect: its latency, and the way from one command to the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.kernel.jit import inlined
from adeye.signals import NO_CHANNEL, REASON_HANDOVER, REASON_STUCK
from adeye.simulate.switch.policy import (
    ACCELERATION,
    BLENDING,
    CONNECTED,
    DUE,
    PENDING,
    PENDING_REASON,
    SOURCE,
    START,
    STEERING,
    TIME_TOLERANCE,
)

if TYPE_CHECKING:
    from adeye.simulate.switch.policy import Bench


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
        words[PENDING] = NO_CHANNEL
        # Where it lies at what was chosen it is kept from nothing: two faults that keep it from
        # nothing at different times give one and the same result.
        acting = int(words[CONNECTED])
        return acting, reason if acting == chosen else REASON_STUCK
    if chosen == NO_CHANNEL:
        words[PENDING] = NO_CHANNEL
        return NO_CHANNEL, reason
    connected = int(words[CONNECTED])
    if connected in (START, chosen):
        words[CONNECTED] = chosen
        words[PENDING] = NO_CHANNEL
        return chosen, reason
    if words[PENDING] != chosen:
        words[PENDING] = chosen
        words[PENDING_REASON] = reason
        memory[DUE] = time + record["handover"] + delay
    if time >= memory[DUE] - TIME_TOLERANCE:
        words[CONNECTED] = chosen
        words[PENDING] = NO_CHANNEL
        return chosen, int(words[PENDING_REASON])
    if record["coasts"] > 0.0 or not bench.usable[connected]:
        return NO_CHANNEL, REASON_HANDOVER
    return connected, REASON_HANDOVER


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
    if acting == NO_CHANNEL or not bench.usable[acting]:
        memory[ACCELERATION] = 0.0
        if words[SOURCE] != START:
            words[SOURCE] = NO_CHANNEL
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
