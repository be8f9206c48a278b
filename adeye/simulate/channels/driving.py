"""How both built-in channels steer along a lane and choose a speed; their own rules differ."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.fields import fields_of
from adeye.kernel.criticality import required_deceleration
from adeye.kernel.elementary import tan
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.motion import idm_acceleration, lane_keeping_steering
from adeye.kernel.road import (
    Ground,
    center_at,
    curvature_at,
    has_strips,
    limit_at,
    local,
    offset_curvature,
    position,
)
from adeye.kernel.strips import LIMIT_ALL, LIMIT_NEXT, SLAB_BEGIN, limit_in, slab_at
from adeye.signals import parameter_record, spec_columns
from adeye.simulate.channels.perception.pose import (
    POSE_ALIGN,
    POSE_CURVATURE,
    POSE_D,
    POSE_S,
    POSE_SPEED,
)
from adeye.simulate.channels.perception.tracks import BEHIND
from adeye.spec import channels as specs

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from adeye.ports import ChannelContext
    from adeye.signals import Floats
    from adeye.spec.architecture import Vehicle

STANDSTILL: Final = 0.05
"""Speed below which the ego stands [m/s]."""

HOLD_DECELERATION: Final = 2.0
"""Commanded while the ego is to stand [m/s²]: holds on a grade of 20 %."""

PREVIEW_TIME: Final = 0.8
LEAST_PREVIEW: Final = 6.0
"""Preview of the lane keeping [s], [m]: what its law recommends."""

MAX_LATERAL: Final = 3.0
"""Lateral acceleration that is planned for [m/s²]: the table of UN R79, 5.6.2.1.3 allows lane
keeping systems of passenger cars at most 3 m/s²."""

IDM_EXPONENT: Final = 4.0
LATE: Final = 0.4
"""How much sooner a speed is asked for on roads whose limits and bends are looked for [s]: what
sensing, command and brake are late. Our choice."""
_TRACKING: Final = 1.5
"""Acceleration for a speed that is missing there [1/s]: what is 0.4 s late follows without
swinging. Our choice."""
_MOST_BRAKING: Final = 1.5
"""How many times the comfortable deceleration that may brake. Our choice."""
_WHEELS_LATE: Final = 0.2
"""How much later than the pose the wheels have turned [s]: there the bend of such a road is read,
for it grows along a spiral. Our choice, after the lag of steering and the delay of commands."""
CHANGE_TIME: Final = 10.0
CHANGE_WAY: Final = 50.0
"""For each change that leads out of a lane that ends, the way of this time [s] and this way more
[m] are looked ahead, and the changes are wished for from there on. Our choice."""
MOST_CHANGES: Final = 3.0
"""As many changes are looked ahead for."""
BRAKES_LATE: Final = 0.7
"""Share of the comfortable deceleration that the end of a lane requires before the ego brakes for
it. Our choice."""
ROOM_TO_TURN: Final = 25.0
"""So far before the end of its lane the ego stands, so that it can still leave it [m]."""
_CURVE_PREVIEWS: Final = (0.0, 1.0, 2.0, 4.0)
"""Where the curvature ahead is read, in seconds at the present speed."""


_FIELDS: Final = (
    *specs.NominalParameters.model_fields,
    *specs.TrajectoryParameters.model_fields,
    *(name for name in specs.SafetyParameters.model_fields if name not in specs.BESIDE_NUMBERS),
    "confirm_ticks",
    "heal_ticks",
)


def vehicle_fields(context: ChannelContext) -> dict[str, Any]:
    """List what the compiled steps read of vehicle and clock, for the parameter record."""
    return {
        **spec_columns(context.vehicles, _limits),
        "desired_speed": context.desired_speed,
        "period": context.period,
    }


def _limits(vehicle: Vehicle) -> dict[str, float]:
    names = ("length", "width", "wheelbase", "max_steering_angle")
    lags = ("steering_lag", "acceleration_lag")
    curvature = tan(vehicle.max_steering_angle) / vehicle.wheelbase
    return fields_of(vehicle, *names, *lags) | {"max_curvature": curvature}


def channel_records(context: ChannelContext, fields: dict[str, Any]) -> NDArray[np.void]:
    """Pack what the compiled steps of a channel read, one record a run.

    All built-in channels have the same fields, so that a function which several of them call is
    compiled once; what a channel lacks is NaN.

    Args:
        context: Of the channel.
        fields: Scalars or (B,) columns by name, beside the names of ``vehicle_fields``.

    Returns:
        (B,) structured array, see ``parameter_record``.
    """
    unset = dict.fromkeys(_FIELDS, math.nan) | {"behind": BEHIND}
    return parameter_record(unset | fields | vehicle_fields(context))


def parameter_columns(context: ChannelContext, names: Iterable[str]) -> dict[str, Any]:
    """Return some numbers of the parameters of each run as columns."""
    listed = tuple(names)
    return spec_columns(context.parameters, lambda item: fields_of(item, *listed))


@inlined
def path_in_lane(ground: Ground, s: float, kept: float) -> float:
    """Return the lateral place of a path that keeps to a lane: on an imported road lanes shift [m].

    Args:
        ground: The road.
        s: Along it [m].
        kept: That of the path before [m].
    """
    return center_at(ground, s, kept) if has_strips(ground) else kept


@inlined
def road_bend(ground: Ground, pose: Floats) -> float:
    """Return the curvature of the reference line that is to be steered for [1/m]."""
    if has_strips(ground):
        way = _WHEELS_LATE * pose[POSE_SPEED]
        return curvature_at(ground.segments, pose[POSE_S] + way)
    return float(pose[POSE_CURVATURE])


@inlined
def steer(record: Any, ground: Ground, pose: Floats, path_d: float) -> float:
    """Return the steering angle that keeps the ego on a line beside the reference line [rad].

    Args:
        record: Has ``wheelbase`` and ``max_steering_angle``.
        ground: The road.
        pose: (POSE_WIDTH,).
        path_d: Lateral place of the path [m].
    """
    return lane_keeping_steering(
        pose[POSE_D] - path_d,
        pose[POSE_ALIGN],
        offset_curvature(road_bend(ground, pose), path_d),
        pose[POSE_SPEED],
        record["wheelbase"],
        0.5 * record["wheelbase"],
        PREVIEW_TIME,
        LEAST_PREVIEW,
        # What is planned for in curves, and room to correct.
        1.5 * MAX_LATERAL,
        record["max_steering_angle"],
    )


@inlined
def allowed_speed(record: Any, ground: Ground, pose: Floats, path_d: float) -> tuple[float, float]:
    """Return the speed that desire, speed limit and the curves ahead allow.

    Args:
        record: Has ``desired_speed`` and ``comfort_deceleration``.
        ground: The road.
        pose: (POSE_WIDTH,).
        path_d: Lateral place of the path [m].

    Returns:
        Speed [m/s], and the deceleration with which it falls from now on [m/s²], 0 where limits
        and bends ahead are not planned for.
    """
    segments = ground.segments
    if has_strips(ground):
        braking = record["comfort_deceleration"]
        now = allowed_ahead(ground, pose[POSE_S], path_d, record["desired_speed"], braking)
        ahead = pose[POSE_S] + LATE * pose[POSE_SPEED]
        later = allowed_ahead(ground, ahead, path_d, record["desired_speed"], braking)
        return later if later[0] < now[0] else now
    allowed = min(record["desired_speed"], limit_at(ground, pose[POSE_S], path_d))
    if segments.shape[0] == 1 and segments[0, 4] == 0.0:
        return float(allowed), 0.0
    for seconds in _CURVE_PREVIEWS:
        way = seconds * pose[POSE_SPEED]
        x, y, _ = position(segments, pose[POSE_S] + way, 0.0)
        bend = abs(offset_curvature(local(segments, x, y)[3], path_d))
        if bend > 0.0:
            square = MAX_LATERAL / bend + record["comfort_deceleration"] * way
            allowed = min(allowed, math.sqrt(square))
    return float(allowed), 0.0


@compiled
def allowed_ahead(
    ground: Ground, s: float, d: float, desired: float, braking: float
) -> tuple[float, float]:
    """Return the speed that lets a vehicle keep to every limit and bend ahead of it.

    Args:
        ground: A road with strips.
        s: Of the vehicle [m].
        d: Of its path [m].
        desired: [m/s].
        braking: Deceleration that is comfortable [m/s²].

    Returns:
        Speed [m/s] and the deceleration with which it falls there [m/s²].
    """
    square, falls = desired * desired, 0.0
    begin = 0.0
    for k in range(ground.segments.shape[0]):
        length, curvature = ground.segments[k, 3], ground.segments[k, 4]
        way = max(0.0, begin - s)
        if 2.0 * braking * way >= square:
            break
        # Straight pieces, and those behind, bound nothing.
        if begin + length > s and curvature != 0.0:
            bend = abs(offset_curvature(curvature, d))
            if bend > 0.0:
                there = MAX_LATERAL / bend + 2.0 * braking * way
                if there < square:
                    square, falls = there, braking if way > 0.0 else 0.0
        begin += length
    slab = slab_at(ground.slabs, s)
    while slab < ground.slabs.shape[0]:
        begin = ground.slabs[slab, SLAB_BEGIN]
        way = max(0.0, begin - s)
        if 2.0 * braking * way >= square:
            break
        limit = ground.limits[slab, LIMIT_ALL]
        if math.isnan(limit):
            limit = limit_in(ground.slabs, ground.strips, slab, max(s, begin), d)
        there = limit * limit + 2.0 * braking * way
        if there < square:
            square, falls = there, braking if way > 0.0 else 0.0
        slab = int(ground.limits[slab, LIMIT_NEXT])
    return math.sqrt(square), falls


@inlined
def slow_down(
    record: Any,
    ground: Ground,
    wanted: float,
    speed: float,
    allowed: tuple[float, float],
    hardest: float,
) -> float:
    """Return an acceleration that also keeps to an allowed speed that falls [m/s²].

    The fall is what is commanded, and what is missing is corrected: who only chases a speed brakes
    once it is faster, and downhill stays so.

    Args:
        record: Has ``comfort_deceleration``.
        ground: The road; only limits and bends of one with strips are planned for.
        wanted: Acceleration otherwise [m/s²].
        speed: [m/s].
        allowed: See ``allowed_speed``.
        hardest: Largest deceleration [m/s²].
    """
    if not has_strips(ground):
        return wanted
    slower = _TRACKING * (allowed[0] - speed) - allowed[1]
    slower = max(slower, -min(hardest, _MOST_BRAKING * record["comfort_deceleration"]))
    return slower if slower < wanted else wanted


@inlined
def follow(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    ground: Ground,
    speed: float,
    allowed: tuple[float, float],
    gap: float,
    front_speed: float,
    hardest: float,
) -> float:
    """Return the acceleration of car following, and hold the ego where it is to stand [m/s²].

    Args:
        record: Has ``time_gap``, ``standstill_gap``, ``max_acceleration`` and
            ``comfort_deceleration``.
        ground: The road.
        speed: Of the ego [m/s].
        allowed: On a free road, see ``allowed_speed``.
        gap: To the object in the path [m], inf for none.
        front_speed: Its speed [m/s].
        hardest: Largest deceleration [m/s²].
    """
    wanted = idm_acceleration(
        speed,
        gap,
        front_speed,
        allowed[0],
        record["time_gap"],
        record["standstill_gap"],
        record["max_acceleration"],
        record["comfort_deceleration"],
        IDM_EXPONENT,
        hardest,
    )
    wanted = slow_down(record, ground, wanted, speed, allowed, hardest)
    if speed < STANDSTILL and wanted <= 0.0:
        return -min(HOLD_DECELERATION, hardest)
    return wanted


@inlined
def way_to_change(speed: float) -> float:
    """Return how long before the end of a lane a change out of it is wished for [m]."""
    return CHANGE_TIME * speed + CHANGE_WAY


@inlined
def room_to_stand(record: Any, room: float) -> float:
    """Return the way to where the ego stands before its lane ends [m].

    Args:
        record: Has ``length`` and ``standstill_gap``.
        room: What is left of the lane [m].
    """
    return float(room - 0.5 * record["length"] - max(record["standstill_gap"], ROOM_TO_TURN))


@inlined
def stand_before(record: Any, speed: float, room: float, wanted: float, hardest: float) -> float:
    """Return an acceleration with which the ego does not drive over the end of its lane [m/s²].

    Args:
        record: See ``room_to_stand``; has ``comfort_deceleration``.
        speed: Of the ego [m/s].
        room: What is left of the lane [m], infinity where it goes on.
        wanted: Acceleration without that [m/s²].
        hardest: Largest deceleration [m/s²].
    """
    left = room_to_stand(record, room)
    if left <= STANDSTILL and speed < STANDSTILL:
        return min(wanted, -min(HOLD_DECELERATION, hardest))
    required = required_deceleration(left, speed, 0.0, 0.0)
    # Late, so that as much as possible of the lane is there to find a gap from.
    if required < BRAKES_LATE * record["comfort_deceleration"]:
        return wanted
    return min(wanted, -min(required, hardest))


@inlined
def is_number(one: float, other: float) -> bool:
    """Tell whether two numbers are finite."""
    return bool(np.isfinite(one) and np.isfinite(other))
