"""The reference channel: a reference driver of UN R157 in closed loop, on ground truth.

A sample of ground truth gives places and no velocities, so these are differences of places. Without
noise and latency they are exact but for half a period, which is taken into account.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye import signals
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import idm_acceleration
from adeye.kernel.profiles import MIN_LATERAL_SPEED
from adeye.kernel.reference_drivers import drivers
from adeye.kernel.reference_drivers import reactions as columns
from adeye.kernel.road import Ground, Grounds, center_at, ground_of, lane_way, lane_width, local
from adeye.signals import Bools, ControlCommand, Floats, Ints, Observation
from adeye.simulate.channels import driving
from adeye.simulate.channels.perception.pose import (
    POSE_ALIGN,
    POSE_D,
    POSE_HEADING,
    POSE_REAR,
    POSE_S,
    POSE_SPEED,
    POSE_X,
    POSE_Y,
    POSE_YAW_RATE,
    clear_pose,
    first_poses,
    has_pose,
    update_pose,
)
from adeye.simulate.channels.perception.step import Sight

if TYPE_CHECKING:
    from adeye.ports import ChannelContext
    from adeye.spec.channels import ReferenceParameters

# --- What a reference driver sees: the objects of ground truth from tick to tick, and their
# motion.

THINGS: Final = 32
"""Objects that a driver keeps in mind; the sample lists the nearest first."""

# Columns of what is known of an object, before what the driver remembers of it.
(
    THING_HITS,  # samples that have it, 0 for a free row
    THING_FOUND,  # 1 if the newest has it
    THING_S,  # centre along the road [m]
    THING_D,  # from the right edge to the left [m]
    THING_ROAD,  # heading of the road there [rad]
    THING_MEAN,  # speed along the ego's lane over the last period [m/s]
    THING_FORWARD,  # speed along the ego's lane now [m/s]
    THING_ACCELERATION,  # [m/s²]
    THING_SIDEWAYS,  # speed to the left [m/s]
    THING_LENGTH,  # [m]
    THING_WIDTH,
    THING_IS_NEW,  # 1 from when it is not in the path, or hidden, until it is followed
    THING_LED,  # 1 if it was the vehicle ahead, until it has left the lane
) = range(13)
THING_STATE: Final = 13
THING_SIZE: Final = THING_STATE + columns.STATE_SIZE

VISIBLE: Final = -1
UNSEEN: Final = -2

_SURE: Final = 2.0
"""Samples from which on its motion is known."""

_GATE: Final = 1.0
_GATE_SPEED: Final = 5.0
"""How far from where it should be an object is looked for [m], and per length of a period [m/s]:
more than anything changes its velocity in a period, and less than the distance of two objects."""

_AHEAD: Final = 0.5
"""Cosine of the bearing from which on the range rate of a first sample tells the speed."""


@inlined
def update_things(  # noqa: PLR0913, PLR0917 - a kernel
    things: Floats,
    pose: Floats,
    segments: Floats,
    path_d: float,
    mask: Bools,
    detections: Floats,
    period: float,
) -> None:
    """Take in a sample: objects that are seen again get a velocity, those that are not are free.

    Args:
        things: (THINGS, THING_SIZE) in and out.
        pose: (POSE_WIDTH,) of the ego at the sample.
        segments: (K, 5) reference line of the road.
        path_d: Lateral place of the centre of the ego's lane [m].
        mask: (M,) which detections there are.
        detections: (M, 7), see ``signals.DETECTION_COLUMNS``.
        period: Since the sample before [s].
    """
    for row in range(things.shape[0]):
        things[row, THING_FOUND] = 0.0
    sine, cosine = sin_cos(pose[POSE_HEADING])
    for number in range(mask.shape[0]):
        if not mask[number]:
            continue
        seen = detections[number]
        x = pose[POSE_X] + cosine * seen[signals.DETECTION_X] - sine * seen[signals.DETECTION_Y]
        y = pose[POSE_Y] + sine * seen[signals.DETECTION_X] + cosine * seen[signals.DETECTION_Y]
        s, d, road, _ = local(segments, x, y)
        length, width = seen[signals.DETECTION_LENGTH], seen[signals.DETECTION_WIDTH]
        row = _row_of(things, s, d, road, path_d, length, width, period)
        if row >= 0:
            _see_again(things[row], s, d, road, path_d, period)
            continue
        row = _free_row(things)
        if row >= 0:
            _see_first(things[row], s, d, road, seen, pose)
    for row in range(things.shape[0]):
        if things[row, THING_FOUND] == 0.0:
            things[row, THING_HITS] = 0.0


@inlined
def _row_of(  # noqa: PLR0913, PLR0917 - a kernel
    things: Floats,
    s: float,
    d: float,
    road: float,
    path_d: float,
    length: float,
    width: float,
    period: float,
) -> int:
    """Return the row of the object of that size that should be nearest to a place, -1 for none."""
    best = -1
    least = _GATE + _GATE_SPEED * period
    for row in range(things.shape[0]):
        thing = things[row]
        if thing[THING_HITS] == 0.0 or thing[THING_FOUND] > 0.0:
            continue
        if thing[THING_LENGTH] != length or thing[THING_WIDTH] != width:
            continue
        along = lane_way(thing[THING_S], thing[THING_ROAD], path_d, s, road)
        along -= thing[THING_FORWARD] * period
        across = d - thing[THING_D] - thing[THING_SIDEWAYS] * period
        distance = math.sqrt(along * along + across * across)
        if distance < least:
            best, least = row, distance
    return best


@inlined
def _free_row(things: Floats) -> int:
    for row in range(things.shape[0]):
        if things[row, THING_HITS] == 0.0:
            return row
    return -1


@inlined
def _see_first(thing: Floats, s: float, d: float, road: float, seen: Floats, pose: Floats) -> None:
    """Begin with an object; of its velocity only the range rate is known."""
    thing[:] = 0.0
    x, y = seen[signals.DETECTION_X], seen[signals.DETECTION_Y]
    distance = math.sqrt(x * x + y * y)
    thing[THING_HITS] = 1.0
    thing[THING_FOUND] = 1.0
    thing[THING_S] = s
    thing[THING_D] = d
    thing[THING_ROAD] = road
    thing[THING_LENGTH] = seen[signals.DETECTION_LENGTH]
    thing[THING_WIDTH] = seen[signals.DETECTION_WIDTH]
    thing[THING_MEAN] = pose[POSE_SPEED]
    if seen[signals.DETECTION_HAS_RANGE_RATE] > 0.0 and abs(x) > _AHEAD * distance:
        # The box centre swings across as the ego turns.
        aside = pose[POSE_YAW_RATE] * pose[POSE_REAR]
        thing[THING_MEAN] += (seen[signals.DETECTION_RANGE_RATE] * distance + aside * y) / x
        thing[THING_HITS] = _SURE
    thing[THING_FORWARD] = thing[THING_MEAN]


@inlined
def _see_again(
    thing: Floats, s: float, d: float, road: float, path_d: float, period: float
) -> None:
    mean = lane_way(thing[THING_S], thing[THING_ROAD], path_d, s, road) / period
    change = mean - thing[THING_MEAN]
    if thing[THING_HITS] < _SURE:
        change = 0.0
    thing[THING_SIDEWAYS] = (d - thing[THING_D]) / period
    thing[THING_ACCELERATION] = change / period
    # A mean speed is that of half a period ago.
    thing[THING_FORWARD] = mean + 0.5 * change
    thing[THING_MEAN] = mean
    thing[THING_S] = s
    thing[THING_D] = d
    thing[THING_ROAD] = road
    thing[THING_HITS] += 1.0
    thing[THING_FOUND] = 1.0


@inlined
def look_at(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    ground: Ground,
    things: Floats,
    row: int,
    pose: Floats,
    path_d: float,
    view: Floats,
) -> int:
    """Fill in what the driver sees of one object, except the ego's own acceleration.

    Args:
        record: Has ``length`` and ``width`` of the ego.
        ground: The road.
        things: (THINGS, THING_SIZE).
        row: Of the object.
        pose: (POSE_WIDTH,).
        path_d: Lateral place of the centre of the ego's lane [m].
        view: (VIEW_SIZE,) out, see ``kernel.reference_drivers.reactions``.

    Returns:
        VISIBLE, else the row of the vehicle that hides it, or UNSEEN for what is behind or not
        known well enough.
    """
    thing = things[row]
    lengths = record["length"] + thing[THING_LENGTH]
    road = pose[POSE_HEADING] - pose[POSE_ALIGN]
    apart = lane_way(pose[POSE_S], road, pose[POSE_D], thing[THING_S], thing[THING_ROAD])
    gap = apart - 0.5 * lengths
    if thing[THING_HITS] < _SURE or gap <= -lengths:
        return UNSEEN
    aside = thing[THING_D] - pose[POSE_D]
    lateral = abs(aside)
    half = 0.5 * (record["width"] + thing[THING_WIDTH])
    inward = -thing[THING_SIDEWAYS] if aside > 0.0 else thing[THING_SIDEWAYS]
    lane = lane_width(ground, pose[POSE_S], path_d)
    if inward < MIN_LATERAL_SPEED and lateral > 0.5 * lane:
        thing[THING_LED] = 0.0 if inward > -MIN_LATERAL_SPEED else thing[THING_LED]
    is_in_path = lateral <= half
    revealed, hider = _revealed(things, row, pose) if is_in_path else (0.0, VISIBLE)
    if hider >= 0 or not is_in_path or revealed > 0.0:
        thing[THING_IS_NEW] = 1.0
    if hider >= 0:
        return hider
    _, align = sin_cos(pose[POSE_ALIGN])
    view[columns.EGO_SPEED] = pose[POSE_SPEED] * align
    # Oncoming: to stop before the place is what the ego can do about it.
    view[columns.OTHER_SPEED] = max(0.0, thing[THING_FORWARD])
    view[columns.OTHER_ACCELERATION] = thing[THING_ACCELERATION] if thing[THING_MEAN] > 0.0 else 0.0
    view[columns.GAP] = gap
    view[columns.LENGTHS] = lengths
    view[columns.LATERAL_GAP] = lateral - half
    view[columns.LATERAL_SPEED] = inward
    smaller = min(record["width"], thing[THING_WIDTH])
    view[columns.OVERLAP] = min(max(half - lateral, 0.0), smaller) / smaller
    from_centre = abs(thing[THING_D] - path_d)
    view[columns.INTRUSION] = 0.5 * (lane + thing[THING_WIDTH]) - from_centre
    view[columns.CUE] = revealed
    if inward >= MIN_LATERAL_SPEED:
        view[columns.CUE] = max(revealed, lane - lateral)
    if is_in_path and revealed == 0.0:
        if view[columns.EGO_SPEED] <= view[columns.OTHER_SPEED]:
            thing[THING_IS_NEW] = 0.0
        if lateral <= drivers.REVEALED:
            thing[THING_LED] = 1.0
    return VISIBLE


@inlined
def _revealed(things: Floats, row: int, pose: Floats) -> tuple[float, int]:
    """Return how far the vehicle that reveals an object is aside [m], and the row of what hides it.

    Returns:
        0 m if none was before the object; VISIBLE if nothing hides it.
    """
    most = 0.0
    for other in range(things.shape[0]):
        nearer = things[other]
        if other == row or nearer[THING_HITS] < _SURE:
            continue
        is_between = pose[POSE_S] < nearer[THING_S] < things[row, THING_S]
        if not is_between or nearer[THING_WIDTH] < 0.5 * things[row, THING_WIDTH]:
            continue
        aside = abs(nearer[THING_D] - pose[POSE_D])
        if aside <= drivers.REVEALED:
            return 0.0, other
        if nearer[THING_LED] > 0.0:
            most = max(most, aside)
    return most, VISIBLE


# --- The built-in reference channel on the batch --------------------------------------------------

# Columns of what the driver remembers beside the objects.
(
    MEMORY_PATH,  # lateral place of its lane's centre [m], NaN before it knows where it is
    MEMORY_SPEED,  # at the previous tick [m/s], NaN before
) = range(2)
MEMORY_WIDTH: Final = 2

_NUMBERS: Final = ("standstill_gap", "max_acceleration", "comfort_deceleration")

_BRAKES: Final = 0.5
"""Deceleration of a lead from which on it brakes, and the model alone answers [m/s²]."""

_LATE: Final = 1e-6
"""Age from which on a sample is not that of the tick [s]."""


class ReferenceChannel:
    """Keeps its lane and brakes as a reference driver of UN R157 does, on ground truth.

    It links one sensor of ground truth; without a sample of the tick its state is FAULT. Where the
    model asks for nothing it drives at the desired speed and follows at the model's distance.
    """

    monitor_ids: tuple[str, ...] = ()

    def reset(self, context: ChannelContext) -> None:
        """Prepare for the runs of a batch."""
        runs = context.runs
        fields = driving.parameter_columns(context, _NUMBERS)
        self._channel_id = context.channel_id
        self._sight = Sight(context)
        specs: list[ReferenceParameters] = list(context.parameters)
        found = [columns.parameters_of(item.model, item.edition, item.variant) for item in specs]
        self._drivers = Drivers(
            records=driving.channel_records(context, fields),
            models=np.array([columns.MODELS[item.model] for item in specs], dtype=np.int64),
            parameters=np.array([columns.vector(item) for item in found]),
            grounds=context.road.grounds(),
            running=np.zeros(runs, dtype=np.bool_),
            pose=first_poses(context.vehicles),
            things=np.zeros((runs, THINGS, THING_SIZE)),
            memory=np.full((runs, MEMORY_WIDTH), np.nan),
            command=np.zeros((runs, 2)),
            status=np.full(runs, signals.FAULT, dtype=np.int64),
            scene=np.zeros(columns.VIEW_SIZE),
        )

    def act(self, observation: Observation) -> ControlCommand:
        """Answer one observation with one command per run."""
        samples = self._sight.take(observation.measurements, observation.time)
        batch = self._drivers
        batch.running[:] = observation.running
        _act(
            batch,
            observation.time,
            samples.estimate,
            samples.estimate_stamp,
            samples.masks[0],
            samples.detections[0],
        )
        return ControlCommand(
            self._channel_id,
            batch.command[:, 0].copy(),
            batch.command[:, 1].copy(),
            np.full(batch.status.shape, observation.time),
            batch.status.copy(),
        )


class Drivers(NamedTuple):
    """What a tick of the channel reads and writes, run by run.

    Attributes:
        records: (B,) see ``driving.channel_records``.
        models: (B,) of the drivers.
        parameters: (B, PARAMETER_SIZE) of these.
        grounds: The roads.
        running: (B,) runs that have not ended; the others are left alone.
        pose: (B, POSE_WIDTH).
        things: (B, THINGS, THING_SIZE) objects; in and out.
        memory: (B, MEMORY_WIDTH) in and out.
        command: (B, 2) acceleration [m/s²] and steering angle [rad]; in and out.
        status: (B,) out.
        scene: (VIEW_SIZE,) what the driver sees of one object, scratch.
    """

    records: Any
    models: Ints
    parameters: Floats
    grounds: Grounds
    running: Bools
    pose: Floats
    things: Floats
    memory: Floats
    command: Floats
    status: Ints
    scene: Floats


@compiled
def _act(
    batch: Drivers,
    time: float,
    estimate: Floats,
    stamp: Floats,
    masks: Bools,
    detections: Floats,
) -> None:
    for run in range(batch.records.shape[0]):
        if not batch.running[run]:
            continue
        record, ground = batch.records[run], ground_of(batch.grounds, run)
        pose, memory, command = batch.pose[run], batch.memory[run], batch.command[run]
        # The filter of the pose takes noise out, and here is none.
        clear_pose(pose)
        if time - stamp[run] <= _LATE:
            update_pose(pose, ground.segments, estimate[run], stamp[run], time, record["period"])
        batch.status[run] = signals.FAULT
        if not has_pose(pose, time):
            command[0] = 0.0
            memory[MEMORY_SPEED] = math.nan
            continue
        if math.isnan(memory[MEMORY_PATH]):
            memory[MEMORY_PATH] = center_at(ground, pose[POSE_S], pose[POSE_D])
        memory[MEMORY_PATH] = driving.path_in_lane(ground, pose[POSE_S], memory[MEMORY_PATH])
        path_d = memory[MEMORY_PATH]
        update_things(
            batch.things[run],
            pose,
            ground.segments,
            path_d,
            masks[run],
            detections[run],
            record["period"],
        )
        acceleration = _longitudinal(batch, run)
        steering = driving.steer(record, ground, pose, path_d)
        command[0] = 0.0
        if driving.is_number(acceleration, steering):
            command[0] = acceleration
            command[1] = steering
            batch.status[run] = signals.OK


@inlined
def _longitudinal(batch: Drivers, run: int) -> float:
    """Return the acceleration of the driver [m/s²], NaN if something is no number."""
    record, model, parameters = batch.records[run], batch.models[run], batch.parameters[run]
    pose, things, memory = batch.pose[run], batch.things[run], batch.memory[run]
    view = batch.scene
    ground, speed, path_d = ground_of(batch.grounds, run), pose[POSE_SPEED], memory[MEMORY_PATH]
    before = memory[MEMORY_SPEED]
    memory[MEMORY_SPEED] = speed
    view[columns.EGO_ACCELERATION] = (
        0.0 if math.isnan(before) else (speed - before) / record["period"]
    )
    limit = math.inf
    lead, nearest = -1, math.inf
    for row in range(things.shape[0]):
        seen = look_at(record, ground, things, row, pose, path_d, view)
        if seen != VISIBLE:
            for column in range(THING_STATE, THING_SIZE):
                # Who brakes for the vehicle ahead does not begin anew with what it reveals.
                things[row, column] = things[seen, column] if seen >= 0 else 0.0
            continue
        wanted = drivers.reference_limit(
            model, view, parameters, things[row, THING_STATE:], record["period"]
        )
        if math.isnan(wanted):
            return math.nan
        limit = min(limit, wanted)
        if view[columns.LATERAL_GAP] <= 0.0 and 0.0 <= view[columns.GAP] < nearest:
            lead, nearest = row, view[columns.GAP]
    room = columns.following_distance(model, parameters, speed) - record["standstill_gap"]
    allowed = driving.allowed_speed(record, ground, pose, path_d)
    wanted = idm_acceleration(
        speed,
        nearest,
        things[lead, THING_FORWARD] if lead >= 0 else 0.0,
        allowed[0],
        max(room, 0.0) / max(speed, 1.0),
        record["standstill_gap"],
        record["max_acceleration"],
        record["comfort_deceleration"],
        driving.IDM_EXPONENT,
        record["comfort_deceleration"],
    )
    wanted = driving.slow_down(
        record, ground, wanted, speed, allowed, record["comfort_deceleration"]
    )
    if lead >= 0:
        is_new = things[lead, THING_IS_NEW] > 0.0
        # What is new in the path, and a lead that brakes, is the model's own business: a driver
        # who eased off meanwhile would be better than the model.
        if is_new or things[lead, THING_ACCELERATION] < -_BRAKES:
            wanted = 0.0
    wanted = min(wanted, limit)
    if speed < driving.STANDSTILL and wanted <= 0.0:
        return -driving.HOLD_DECELERATION
    return wanted
