"""The switch: whose command acts, by fixed priority, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.jit import compiled, inlined
from adeye.signals import (
    FAULT,
    NO_CHANNEL,
    REASON_DEFAULT,
    REASON_LATCHED,
    REASON_NO_CHANNEL,
    REASON_REQUEST,
    REASON_STALENESS,
    REASON_STUCK,
    REQUESTS_AUTHORITY,
    Authority,
    Bools,
    ControlCommand,
    Floats,
    Ints,
    parameter_record,
    spec_columns,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.ports import SwitchContext, SwitchModel

TIME_TOLERANCE: Final = 1e-9
"""Slack of comparisons of times [s]: multiples of the step are not exact."""

_HOLDER, _HEARD = range(2)


def make_switch(context: SwitchContext) -> SwitchModel:
    """Build the switch of an architecture.

    Args:
        context: Spec of each run, channel ids and clock.
    """
    return PrioritySwitch(context)


class PrioritySwitch:
    """Fixed priority with debounce, latch and staleness watchdog; or stuck at the default.

    The default channel acts until another has requested authority for the debounce time, the first
    in order of priority if there are several, or until the acting channel is unusable: silent, in
    fault, not finite, or older than the staleness time. Then the first usable channel in order of
    priority acts. Authority that a channel above the default has taken is kept if the switch
    latches; a request of higher priority still overrides it. If no channel is usable the ego
    coasts: no acceleration, steering as last commanded.

    Start-up: a default that has not been usable yet hands over to nobody before the staleness time
    has passed since the start, because sensors with latency have not delivered by then.
    """

    def __init__(self, context: SwitchContext) -> None:
        specs, ids = context.specs, context.channels
        runs, count = len(specs), len(ids)
        self._order = np.full((runs, count), -1, dtype=np.int64)
        for run, spec in enumerate(specs):
            ranked = [ids.index(name) for name in spec.priority]
            self._order[run, : len(ranked)] = ranked
        self._records = parameter_record(
            spec_columns(
                specs,
                lambda spec: {
                    "stuck": spec.policy == "stuck",
                    "default": ids.index(spec.default),
                    "debounce": spec.debounce,
                    "latch": spec.latch,
                    "staleness": spec.staleness,
                },
            )
        )
        self._since = np.full((runs, count), np.nan)
        self._state = np.zeros((runs, 2), dtype=np.int64)
        self._state[:, _HOLDER] = NO_CHANNEL
        self._held = np.zeros(runs)
        self._usable = np.zeros(count, dtype=np.bool_)
        self._numbers = np.zeros((runs, count, 3))
        self._status = np.zeros((runs, count), dtype=np.int64)

    def arbitrate(
        self, time: float, proposals: Sequence[ControlCommand]
    ) -> tuple[Floats, Authority]:
        """Return the acting command (B, 2) and who has authority, why.

        Args:
            time: Of this tick [s].
            proposals: Newest command of every channel, in the architecture's order.
        """
        for index, proposal in enumerate(proposals):
            self._numbers[:, index, 0] = proposal.acceleration
            self._numbers[:, index, 1] = proposal.steering_angle
            self._numbers[:, index, 2] = proposal.stamp
            self._status[:, index] = proposal.status
        runs = self._held.shape[0]
        command = np.zeros((runs, 2))
        decision = np.zeros((runs, 2), dtype=np.int64)
        _arbitrate(
            self._records,
            self._order,
            time,
            self._numbers,
            self._status,
            self._since,
            self._state,
            self._held,
            self._usable,
            command,
            decision,
        )
        return command, Authority(decision[:, 0].copy(), decision[:, 1].copy())


@compiled
def _arbitrate(  # noqa: PLR0913, PLR0917 - a kernel
    records: Any,
    order: Ints,
    time: float,
    numbers: Floats,
    status: Ints,
    since: Floats,
    state: Ints,
    held: Floats,
    usable: Bools,
    command: Floats,
    decision: Ints,
) -> None:
    for run in range(records.shape[0]):
        chosen, reason = _step(
            records[run],
            order[run],
            time,
            numbers[run],
            status[run],
            since[run],
            state[run],
            usable,
        )
        decision[run, 0] = chosen
        decision[run, 1] = reason
        if chosen != NO_CHANNEL and usable[chosen]:
            command[run, 0] = numbers[run, chosen, 0]
            held[run] = numbers[run, chosen, 1]
        command[run, 1] = held[run]


@inlined
def _step(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    order: Ints,
    time: float,
    numbers: Floats,
    status: Ints,
    since: Floats,
    state: Ints,
    usable: Bools,
) -> tuple[int, int]:
    """Decide one run at one tick.

    Args:
        record: The switch's parameters.
        order: (C,) channels, highest priority first; -1 from where the list ends.
        time: [s].
        numbers: (C, 3) acceleration [m/s²], steering angle [rad], stamp [s].
        status: (C,).
        since: (C,) since when each requests without a break [s], NaN if it does not; updated.
        state: (2,) channel that holds latched authority, whether the default was usable; updated.
        usable: (C,) out.

    Returns:
        Acting channel and reason.
    """
    for channel in range(status.shape[0]):
        usable[channel] = _is_usable(record, time, numbers[channel], status[channel])
        if not usable[channel] or status[channel] != REQUESTS_AUTHORITY:
            since[channel] = np.nan
        elif np.isnan(since[channel]):
            since[channel] = time
    default = int(record["default"])
    if usable[default]:
        state[_HEARD] = 1
    if record["stuck"] > 0.0:
        return default, REASON_STUCK
    holder = _latched_or_requesting(record, order, time, since, state)
    wanted = default if holder == NO_CHANNEL else holder
    if usable[wanted]:
        chosen = wanted
    elif wanted == default and not state[_HEARD] and time <= record["staleness"] + TIME_TOLERANCE:
        return NO_CHANNEL, REASON_NO_CHANNEL
    else:
        chosen = _first_usable(order, usable)
    if chosen == NO_CHANNEL:
        return NO_CHANNEL, REASON_NO_CHANNEL
    if record["latch"] > 0.0 and _is_above(order, chosen, wanted, default):
        state[_HOLDER] = chosen
    return chosen, _reason(chosen, wanted, since, usable[default], default)


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
    record: Any, order: Ints, time: float, since: Floats, state: Ints
) -> int:
    """Return the first in order of priority that holds authority or was granted it."""
    for channel in order:
        if channel < 0:
            break
        if channel == state[_HOLDER]:
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
def _reason(chosen: int, wanted: int, since: Floats, default_usable: bool, default: int) -> int:  # noqa: FBT001 - a kernel
    if chosen != wanted:
        return REASON_STALENESS
    if not np.isnan(since[chosen]):
        return REASON_REQUEST
    if chosen == default:
        return REASON_DEFAULT
    return REASON_LATCHED if default_usable else REASON_STALENESS
