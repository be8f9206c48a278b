"""The built-in safety channel on the batch: its monitors, and the in-lane stop.

Monitors are small functions of one interface, debounced by counters. Every one takes the parameters
and the evidence of one run at one tick, and tells whether it fires. What is missing or no number
makes a monitor fire, except evidence that is not linked.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye import signals
from adeye.kernel.criticality import required_deceleration
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import clip, limit_jerk
from adeye.kernel.road import center_at, ground_of, is_on_lanes, lane_left
from adeye.kernel.stops import BRAKES_AT_ONCE, ONSET_JERK
from adeye.signals import Bools, ControlCommand, Floats, Ints, Observation, spec_columns
from adeye.simulate.channels import corridor, driving
from adeye.simulate.channels.hooks import SAFETY_HOOKS, PerceivingChannel
from adeye.simulate.channels.links import SWITCH, linked_channels
from adeye.simulate.channels.perception.pose import (
    POSE_ACCELERATION,
    POSE_D,
    POSE_S,
    POSE_SPEED,
    has_pose,
)
from adeye.spec.channels import BESIDE_NUMBERS, SafetyParameters

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.simulate.channels.perception.step import Seen

# --- The safety channel's monitors: small functions of one interface, debounced by counters -------

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
    SEEN_ON_LANES,  # whether that is on the lanes, edges included
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
        record: Has ``max_lane_offset`` [m].
        seen: (EVIDENCE_WIDTH,).
    """
    if seen[SEEN_POSE] <= 0.0:
        return False
    is_near = abs(seen[SEEN_OFFSET]) <= record["max_lane_offset"]
    return not (is_near and seen[SEEN_ON_LANES] > 0.0)


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
        is_down = status[channel] == signals.FAULT
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


# --- The in-lane safe stop: how hard to brake, from its onset to standstill -----------------------

RESERVE: Final = 1.2
"""How much more than the required deceleration is commanded, for the lag of the brakes and for
what the object may still do. Our choice."""


STOPS_WITHIN: Final = 500.0
"""How far ahead the end of the lane is looked for [m]: more than any stop takes."""

LEFT_BEFORE_END: Final = 2.0
"""What a stop leaves of the lane before its end [m]. Our choice."""


@compiled
def stop_acceleration(
    record: Any,
    previous: float,
    speed: float,
    required: float,
    is_danger: bool,  # noqa: FBT001 - a kernel
) -> float:
    """Return the acceleration of the safe stop at this tick [m/s²].

    The stop deceleration if it is enough, up to the emergency deceleration if an object in the path
    needs more; then it is built up at once, else at limited jerk. What an object needed is kept as
    long as the danger is confirmed, because an object that has left the measurements may still be
    there; once the monitor has healed, the stop goes on with no more than its own deceleration, so
    that it does not endanger who follows.

    Args:
        record: Has ``stop_deceleration``, ``emergency_deceleration`` [m/s²] and ``period`` [s].
        previous: Acceleration of the stop at the previous tick, at its onset that of the ego
            [m/s²].
        speed: Of the ego [m/s].
        required: Required deceleration for the objects in the path [m/s²].
        is_danger: Whether an object ahead is a confirmed danger.
    """
    wanted = record["stop_deceleration"]
    return brake(record, previous, speed, wanted, ONSET_JERK, required, is_danger)


@compiled
def brake(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    previous: float,
    speed: float,
    wanted: float,
    jerk: float,
    required: float,
    is_danger: bool,  # noqa: FBT001 - a kernel
) -> float:
    """Return the acceleration on the way to a deceleration, or to what an object needs [m/s²].

    Args:
        record: See ``stop_acceleration``.
        previous: Acceleration of the stop at the previous tick [m/s²].
        speed: Of the ego [m/s].
        wanted: Deceleration if no object needs more [m/s²].
        jerk: How quickly that is built up [m/s³].
        required: Required deceleration for the objects in the path [m/s²].
        is_danger: Whether an object ahead is a confirmed danger.
    """
    hardest = max(record["emergency_deceleration"], record["stop_deceleration"])
    if speed < driving.STANDSTILL:
        return -float(min(driving.HOLD_DECELERATION, hardest))
    if RESERVE * required > wanted:
        wanted = min(RESERVE * required, hardest)
        jerk = BRAKES_AT_ONCE
    if is_danger:
        wanted = max(wanted, -previous)
    return clip(limit_jerk(previous, -wanted, jerk, record["period"]), -hardest, 0.0)


# --- The safety channel's decision at one tick: supervise, and the command that it would give -----

# Columns of what the channel remembers beside pose, tracks and monitors.
(
    MEMORY_PATH,  # lateral place of its lane's centre [m], NaN before it knows where it is
    MEMORY_STOPPING,  # whether it is on the way to a safe stop
    MEMORY_BRAKING,  # acceleration of the stop at the previous tick [m/s²]
) = range(3)
MEMORY_WIDTH: Final = 3

NO_SWITCH: Final = -1
"""Reason that stands for a switch that is not linked."""


class Batch(NamedTuple):
    """What a tick of the channel reads and writes, run by run.

    Attributes:
        seen: What the channel has perceived.
        numbers: (B, N, 3) acceleration, steering angle, stamp of the linked channels.
        channel_status: (B, N) their states.
        reason: (B,) why the acting channel acts, ``NO_SWITCH`` without link.
        heard: (B, N) whether each linked channel has given a usable command yet; in and out.
        states: (B, Q, STATE_WIDTH) debounce of the monitors; in and out.
        memory: (B, MEMORY_WIDTH) in and out.
        command: (B, 2) acceleration [m/s²] and steering angle [rad]; in and out.
        status: (B,) out.
        monitors: (B, Q, 2) raw and confirmed state of the monitors, out.
        path: (PATH_WIDTH,) scratch.
        evidence: (EVIDENCE_WIDTH,) scratch.
    """

    seen: Seen
    numbers: Floats
    channel_status: Ints
    reason: Ints
    heard: Bools
    states: Ints
    memory: Floats
    command: Floats
    status: Ints
    monitors: Bools
    path: Floats
    evidence: Floats


@inlined
def safety_step(batch: Batch, run: int, time: float) -> int:
    """Decide one run at one tick.

    Args:
        batch: What it reads and writes.
        run: Which row is meant.
        time: [s].

    Returns:
        OK, REQUESTS_AUTHORITY, or FAULT without a recent ego estimate: then it coasts with the
        steering held.
    """
    record, pose, memory = batch.seen.records[run], batch.seen.pose[run], batch.memory[run]
    shown = batch.monitors[run]
    knows_pose = perceive(batch, run, time)
    confirmed = run_monitors(record, batch.evidence, batch.states[run], shown)
    if not knows_pose:
        return coast(batch, run)
    update_stopping(memory, confirmed, batch.reason[run], pose[POSE_ACCELERATION])
    if memory[MEMORY_STOPPING] > 0.0:
        return stop_in_lane(batch, run, confirmed, shown[OBJECT_DANGER, 1])
    return shadow(batch, run, confirmed)


@inlined
def perceive(batch: Batch, run: int, time: float) -> bool:
    """Take the evidence of linked channels and scene; tell whether the ego knows where it is."""
    seen, path = batch.evidence, batch.path
    seen[:] = 0.0
    path[:] = 0.0
    gather_commands(time, batch.numbers[run], batch.channel_status[run], batch.heard[run], seen)
    pose = batch.seen.pose[run]
    if not has_pose(pose, time):
        return False
    look(batch, run)
    return True


@inlined
def coast(batch: Batch, run: int) -> int:
    """Coast with the steering held, for want of anything better."""
    batch.command[run, 0] = 0.0
    return signals.FAULT


@inlined
def answer(batch: Batch, run: int, acceleration: float, steering: float, requests: bool) -> int:  # noqa: FBT001 - a kernel
    """Give a command, unless it is no number.

    Args:
        batch: What is read and written.
        run: Which row is meant.
        acceleration: [m/s²].
        steering: [rad].
        requests: Whether authority is wanted.
    """
    if not driving.is_number(acceleration, steering):
        return coast(batch, run)
    batch.command[run, 0], batch.command[run, 1] = acceleration, steering
    return signals.REQUESTS_AUTHORITY if requests else signals.OK


@inlined
def tell(batch: Batch, run: int, state: int) -> None:
    """Write the state of the channel; one without all of its sensors is degraded."""
    batch.status[run] = (
        signals.DEGRADED if state == signals.OK and batch.seen.degraded[run] else state
    )


@inlined
def look(batch: Batch, run: int) -> None:
    """Take the evidence of the scene: the lane, and the objects in the path."""
    record, pose, memory = batch.seen.records[run], batch.seen.pose[run], batch.memory[run]
    path, seen, ground = batch.path, batch.evidence, ground_of(batch.seen.grounds, run)
    nearest = center_at(ground, pose[POSE_S], pose[POSE_D])
    offset = pose[POSE_D] - nearest
    # A lane is taken over once the ego is well inside it, so a departure leads back.
    if np.isnan(memory[MEMORY_PATH]) or abs(offset) <= 0.5 * record["max_lane_offset"]:
        memory[MEMORY_PATH] = nearest
    corridor.view_path(batch.seen, run, memory[MEMORY_PATH], path)
    seen[SEEN_POSE] = 1.0
    seen[SEEN_REQUIRED] = path[corridor.PATH_REQUIRED]
    seen[SEEN_OFFSET] = offset
    seen[SEEN_ON_LANES] = is_on_lanes(ground, pose[POSE_S], pose[POSE_D])


@inlined
def update_stopping(memory: Floats, confirmed: bool, reason: int, acceleration: float) -> None:  # noqa: FBT001 - a kernel
    """Begin a safe stop on a confirmed monitor; give it up once another channel acts by default.

    A stop goes on although its monitors have healed as long as authority was given on request, for
    staleness or is latched, and for good if the switch is not linked: to drive on from a safe stop
    is for somebody else to decide.
    """
    if confirmed:
        if memory[MEMORY_STOPPING] <= 0.0:
            memory[MEMORY_BRAKING] = min(0.0, acceleration)
        memory[MEMORY_STOPPING] = 1.0
    elif reason in (signals.REASON_NONE, signals.REASON_DEFAULT, signals.REASON_VOTED):
        memory[MEMORY_STOPPING] = 0.0


@inlined
def stop_in_lane(batch: Batch, run: int, requests: bool, is_danger: bool) -> int:  # noqa: FBT001 - a kernel
    """Give the command of the in-lane stop.

    Args:
        batch: What is read and written.
        run: Which row is meant.
        requests: Whether authority is wanted.
        is_danger: Whether an object ahead is a confirmed danger.
    """
    record, pose, memory = batch.seen.records[run], batch.seen.pose[run], batch.memory[run]
    memory[MEMORY_BRAKING] = stop_acceleration(
        record,
        memory[MEMORY_BRAKING],
        pose[POSE_SPEED],
        max(batch.path[corridor.PATH_REQUIRED], required_before_end(batch, run)),
        is_danger,
    )
    ground = ground_of(batch.seen.grounds, run)
    steering = driving.steer(record, ground, pose, memory[MEMORY_PATH])
    return answer(batch, run, float(memory[MEMORY_BRAKING]), steering, requests)


@inlined
def required_before_end(batch: Batch, run: int) -> float:
    """Return the deceleration that is required to stand before the lane ends [m/s²]."""
    record, pose, ground = (
        batch.seen.records[run],
        batch.seen.pose[run],
        ground_of(batch.seen.grounds, run),
    )
    room, _ = lane_left(ground, pose[POSE_S], batch.memory[run, MEMORY_PATH], STOPS_WITHIN)
    left = room - 0.5 * record["length"] - LEFT_BEFORE_END
    return required_deceleration(left, pose[POSE_SPEED], 0.0, 0.0)


@inlined
def shadow(batch: Batch, run: int, requests: bool) -> int:  # noqa: FBT001 - a kernel
    """Give the command while no stop is driven: car following in the lane."""
    record, pose = batch.seen.records[run], batch.seen.pose[run]
    ground = ground_of(batch.seen.grounds, run)
    steering = driving.steer(record, ground, pose, batch.memory[run, MEMORY_PATH])
    return answer(batch, run, follow_lane(batch, run), steering, requests)


@inlined
def follow_lane(batch: Batch, run: int) -> float:
    """Return the acceleration of car following in the lane [m/s²]."""
    record, pose, path = batch.seen.records[run], batch.seen.pose[run], batch.path
    ground, center, speed = (
        ground_of(batch.seen.grounds, run),
        batch.memory[run, MEMORY_PATH],
        pose[POSE_SPEED],
    )
    hardest = record["stop_deceleration"]
    wanted = driving.follow(
        record,
        ground,
        speed,
        driving.allowed_speed(record, ground, pose, center),
        path[corridor.PATH_GAP],
        path[corridor.PATH_SPEED],
        hardest,
    )
    room, _ = lane_left(ground, pose[POSE_S], center, STOPS_WITHIN)
    return driving.stand_before(record, speed, room, wanted, hardest)


PERCEPTION: Final = {"coast": 0.3, "gate": 4.0, "confirm_hits": 2.0, "confirm_window": 0.0}
"""Coasting [s], gate [m] and confirmation of the channel's own tracks. Two samples give a velocity,
which is all that ground truth needs; shorter coasting than the nominal channel's, because a ghost
would trigger a stop. Our choice."""

SHADOW: Final = {
    "time_gap": 2.0,
    "standstill_gap": 5.0,
    "max_acceleration": 1.0,
    "comfort_deceleration": 2.0,
}
"""Car following while no stop is asked for [s], [m], [m/s²]: gentler than the nominal channel. The
time gap is the headway of the careful and competent driver of UN R157."""


class SafetyChannel(PerceivingChannel):
    """Supervises nominal channel and scene, and brings the ego to an in-lane safe stop.

    It requests authority while a monitor is confirmed. Its command is computed at every tick, also
    without authority. Without a recent ego estimate its state is FAULT.
    """

    monitor_ids: tuple[str, ...] = MONITOR_IDS
    hooks: tuple[str, ...] = SAFETY_HOOKS
    _candidates = 0

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs, monitors = context.runs, len(self.monitor_ids)
        records = driving.channel_records(context, self._fields(context))
        self._prepare(context, records, self._candidates)
        self._supervised = linked_channels(context.links)
        self._has_switch = SWITCH in context.links
        linked = (runs, len(self._supervised))
        self._batch = Batch(
            seen=self._seen,
            numbers=np.zeros((*linked, 3)),
            channel_status=np.zeros(linked, dtype=np.int64),
            reason=np.full(runs, NO_SWITCH, dtype=np.int64),
            heard=np.zeros(linked, dtype=np.bool_),
            states=np.zeros((runs, monitors, STATE_WIDTH), dtype=np.int64),
            memory=np.zeros((runs, MEMORY_WIDTH)),
            command=self._command,
            status=self._status,
            monitors=np.zeros((runs, monitors, 2), dtype=np.bool_),
            path=np.zeros(corridor.PATH_WIDTH),
            evidence=np.zeros(EVIDENCE_WIDTH),
        )
        self._batch.memory[:, MEMORY_PATH] = np.nan

    def _fields(self, context: ChannelContext) -> dict[str, Any]:
        """List what the compiled steps read, for the parameter records."""
        numbers = spec_columns(
            context.parameters, lambda item: safety_numbers(item, context.period)
        )
        return numbers | PERCEPTION | SHADOW

    def _read(self, observation: Observation) -> None:
        super()._read(observation)
        batch = self._batch
        for index, name in enumerate(self._supervised):
            heard = observation.commands[name]
            batch.numbers[:, index, 0] = heard.acceleration
            batch.numbers[:, index, 1] = heard.steering_angle
            batch.numbers[:, index, 2] = heard.stamp
            batch.channel_status[:, index] = heard.status
        if self._has_switch and observation.authority is not None:
            batch.reason[:] = observation.authority.reason

    def _decide(self, time: float) -> None:
        self._batch.states[:, :, STATE_FROZEN] = self._hooks.monitors_frozen[:, np.newaxis]
        self._step(time)

    def _step(self, time: float) -> None:
        _act(self._batch, time)

    def _command_at(self, time: float) -> ControlCommand:
        return replace(super()._command_at(time), monitors=self._batch.monitors.copy())


def safety_numbers(item: SafetyParameters, period: float) -> dict[str, float]:
    """List what the compiled step reads of the channel's parameters, whichever way it stops."""
    names = [name for name in SafetyParameters.model_fields if name not in BESIDE_NUMBERS]
    numbers = {name: float(getattr(item, name)) for name in names}
    for name in ("confirm", "heal"):
        numbers[f"{name}_ticks"] = ticks_within(numbers[name], period)
    return numbers


def ticks_within(duration: float, period: float) -> int:
    """Return how many periods a duration takes, rounded up.

    Args:
        duration: [s].
        period: [s].

    >>> ticks_within(0.1, 0.05), ticks_within(0.12, 0.05), ticks_within(0.0, 0.05)
    (2, 3, 0)
    """
    return math.ceil(duration / period - 1e-6)


@compiled
def _act(batch: Batch, time: float) -> None:
    for run in range(batch.seen.records.shape[0]):
        if batch.seen.running[run]:
            tell(batch, run, safety_step(batch, run, time))
