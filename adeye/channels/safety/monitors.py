"""The safety channel's monitors: small functions of one interface, debounced by counters.

Every monitor takes the parameters and the evidence of one run at one tick, and tells whether it
fires. What is missing or no number makes a monitor fire, except evidence that is not linked.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from adeye.kernel.jit import inlined
from adeye.signals import FAULT, Bools, Floats, Ints

MONITOR_IDS: Final = ("nominal_silent", "nominal_implausible", "object_danger", "lane_departure")
OBJECT_DANGER: Final = 2
"""Names of the monitors, in the order of their columns."""

# Columns of the evidence.
(
    SEEN_CHANNELS,  # how many channels are linked
    SEEN_HEARD,  # whether every one of them has given a usable command yet
    SEEN_TIME,  # time since the start [s]
    SEEN_STATUS,  # worst state of a linked channel: 1 for silent or fault, else 0
    SEEN_AGE,  # age of the oldest of their commands [s]
    SEEN_ACCELERATION,  # largest magnitude of their accelerations [m/s²]
    SEEN_STEERING,  # largest magnitude of their steering angles [rad]
    SEEN_POSE,  # whether the ego knows where it is
    SEEN_REQUIRED,  # required deceleration for the objects in the path [m/s²]
    SEEN_OFFSET,  # distance from the nearest lane's centre [m]
    SEEN_D,  # lateral place from the right edge [m]
) = range(11)
EVIDENCE_WIDTH: Final = 11

# Columns of a monitor's state.
(
    STATE_COUNT,
    STATE_CONFIRMED,
    STATE_RAW,  # whether it fired when it was last asked
    STATE_FROZEN,  # whether a fault keeps it from being asked
) = range(4)
STATE_WIDTH: Final = 4

_TIME_TOLERANCE: Final = 1e-9


@inlined
def nominal_silent(record: Any, seen: Floats) -> bool:
    """Fire when a linked channel is silent or in fault, or its command is too old.

    A channel that has not given a command yet is given the staleness time from the start.

    Args:
        record: Has ``staleness`` [s].
        seen: (EVIDENCE_WIDTH,).
    """
    if seen[SEEN_CHANNELS] <= 0.0:
        return False
    if seen[SEEN_HEARD] <= 0.0:
        return bool(seen[SEEN_TIME] > record["staleness"] + _TIME_TOLERANCE)
    is_fresh = seen[SEEN_AGE] <= record["staleness"] + _TIME_TOLERANCE
    return bool(seen[SEEN_STATUS] > 0.0 or not is_fresh)


@inlined
def nominal_implausible(record: Any, seen: Floats) -> bool:
    """Fire when a linked channel commands no number or what the vehicle is not built for.

    Args:
        record: Has ``max_command`` [m/s²] and ``max_steering_angle`` [rad].
        seen: (EVIDENCE_WIDTH,).
    """
    if seen[SEEN_CHANNELS] <= 0.0:
        return False
    is_plausible = (
        seen[SEEN_ACCELERATION] <= record["max_command"]
        and seen[SEEN_STEERING] <= record["max_steering_angle"] + _TIME_TOLERANCE
    )
    return not is_plausible


@inlined
def object_danger(record: Any, seen: Floats) -> bool:
    """Fire when an object in the path requires a deceleration from the threshold on.

    Args:
        record: Has ``danger_threshold`` [m/s²].
        seen: (EVIDENCE_WIDTH,).
    """
    if seen[SEEN_POSE] <= 0.0:
        return False
    return not seen[SEEN_REQUIRED] < record["danger_threshold"]


@inlined
def lane_departure(record: Any, seen: Floats) -> bool:
    """Fire when the ego is too far from the centre of every lane, or off the lanes.

    Args:
        record: Has ``max_lane_offset``, ``lane_width`` [m] and ``lanes``.
        seen: (EVIDENCE_WIDTH,).
    """
    if seen[SEEN_POSE] <= 0.0:
        return False
    is_near = abs(seen[SEEN_OFFSET]) <= record["max_lane_offset"]
    return not (is_near and 0.0 <= seen[SEEN_D] <= record["lanes"] * record["lane_width"])


@inlined
def debounce(state: Ints, fires: bool, confirm_ticks: int, heal_ticks: int) -> None:  # noqa: FBT001 - a kernel
    """Count a monitor's firing up and its rest down, saturating, with one switching point each.

    Confirmed once it has fired for the confirm time: at the tick that lies that long after the
    first one, if it fired at all between; each rest takes one tick of firing back. Healed likewise
    after resting for the heal time.

    Args:
        state: (2,) count and whether it is confirmed; in and out.
        fires: Whether the monitor fires at this tick.
        confirm_ticks: Confirm time in ticks of the channel, rounded up.
        heal_ticks: Heal time in ticks, rounded up.
    """
    if state[STATE_CONFIRMED]:
        state[STATE_COUNT] = (
            min(heal_ticks + 1, state[STATE_COUNT] + 1) if fires else (state[STATE_COUNT] - 1)
        )
        if state[STATE_COUNT] <= 0:
            state[STATE_COUNT] = 0
            state[STATE_CONFIRMED] = 0
    else:
        state[STATE_COUNT] = state[STATE_COUNT] + 1 if fires else max(0, state[STATE_COUNT] - 1)
        if state[STATE_COUNT] > confirm_ticks:
            state[STATE_COUNT] = heal_ticks + 1
            state[STATE_CONFIRMED] = 1


@inlined
def run_monitors(record: Any, seen: Floats, states: Ints, shown: Bools) -> bool:
    """Run every monitor of one run at one tick.

    Args:
        record: Parameters.
        seen: (EVIDENCE_WIDTH,) evidence.
        states: (Q, STATE_WIDTH) state of each monitor; in and out. A frozen one keeps it.
        shown: (Q, 2) raw and confirmed, out.

    Returns:
        Whether any monitor is confirmed.
    """
    shown[0, 0] = nominal_silent(record, seen)
    shown[1, 0] = nominal_implausible(record, seen)
    shown[2, 0] = object_danger(record, seen)
    shown[3, 0] = lane_departure(record, seen)
    confirm, heal = int(record["confirm_ticks"]), int(record["heal_ticks"])
    is_any = False
    for monitor in range(states.shape[0]):
        if states[monitor, STATE_FROZEN]:
            shown[monitor, 0] = states[monitor, STATE_RAW] > 0
        else:
            states[monitor, STATE_RAW] = shown[monitor, 0]
            debounce(states[monitor], shown[monitor, 0], confirm, heal)
        shown[monitor, 1] = states[monitor, STATE_CONFIRMED] > 0
        is_any = is_any or states[monitor, STATE_CONFIRMED] > 0
    return is_any


@inlined
def gather_commands(time: float, numbers: Floats, status: Ints, heard: Bools, seen: Floats) -> None:
    """Put together what the linked channels commanded at the previous tick.

    Args:
        time: [s].
        numbers: (N, 3) acceleration [m/s²], steering angle [rad], stamp [s].
        status: (N,).
        heard: (N,) whether each has given a usable command yet; in and out.
        seen: (EVIDENCE_WIDTH,) out.
    """
    seen[SEEN_CHANNELS] = status.shape[0]
    seen[SEEN_TIME] = time
    seen[SEEN_HEARD] = 1.0
    seen[SEEN_STATUS] = seen[SEEN_AGE] = 0.0
    seen[SEEN_ACCELERATION] = seen[SEEN_STEERING] = 0.0
    for channel in range(status.shape[0]):
        # A silent channel says nothing, so only the age of its last command tells.
        is_down = status[channel] == FAULT
        if numbers[channel, 2] >= 0.0 and not is_down:
            heard[channel] = True
        if not heard[channel]:
            seen[SEEN_HEARD] = 0.0
            continue
        if is_down:
            seen[SEEN_STATUS] = 1.0
        seen[SEEN_AGE] = _worse(seen[SEEN_AGE], time - numbers[channel, 2])
        seen[SEEN_ACCELERATION] = _worse(seen[SEEN_ACCELERATION], abs(numbers[channel, 0]))
        seen[SEEN_STEERING] = _worse(seen[SEEN_STEERING], abs(numbers[channel, 1]))


@inlined
def _worse(one: float, other: float) -> float:
    """Return the larger number, NaN if either is none."""
    if np.isnan(one) or np.isnan(other):
        return np.nan
    return max(one, other)
