"""How vehicles steer along their lanes and move, in two kinds of arithmetic for one model.

The *reference* goes through the formulas in highway-env's order: the steering angle of a lane
keeping controller, of which it keeps the tangent, then the slip angle of a bicycle. The *fast* one
keeps the sine of the slip angle instead, of which the steering angle is only a detour. Both turn
the sine and cosine that a vehicle's row has of its heading, so these must fit. A tick is: decide,
steer, move, locate; each for everybody before the next, as the long chains of arithmetic of
different vehicles overlap in a short loop.

Source:
    highway-env 1.12, ``vehicle/controller.py`` and ``vehicle/kinematics.py``; Polack, Altché,
    d'Andréa-Novel, de La Fortelle (2017), "The kinematic bicycle model".
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.elementary import asin, sin_cos, sin_cos_of_small
from adeye.kernel.jit import inlined
from adeye.kernel.motion import clip
from adeye.kernel.traffic.alongside import decide_alongside
from adeye.kernel.traffic.drivers import decide, not_zero
from adeye.kernel.traffic.lanes import ALONGSIDE, lane_heading, lane_local, straight_local, wrapped
from adeye.kernel.traffic.network import (
    ACCELERATION,
    CONTROL,
    COSINE,
    CRASHED,
    CRUISING,
    HEADING,
    LANE,
    LATERAL,
    LENGTH,
    ROLE,
    SINUS,
    SPEED,
    TARGET,
    TIMER,
    TOP_SPEED,
    Road,
    S,
    X,
    Y,
    is_alone_nearest,
    nearest_lane,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HEADING_TIME: Final = 0.2
"""In which the heading follows its reference [s]."""

LATERAL_TIME: Final = 0.6
"""In which the lateral place follows the lane's centre [s]."""

PURSUIT_TIME: Final = 0.5 * HEADING_TIME
"""How far ahead the lane's direction is taken [s]."""

MAX_STEERING_TANGENT: Final = math.sqrt(3.0)
"""At the wheels, either way: a third of pi."""

MAX_APPROACH: Final = math.pi / 4.0
"""Angle at which a lane is approached at most [rad]."""

_MAX_APPROACH_SINE: Final = math.sqrt(0.5)

MAX_SLIP_SINE: Final = math.sqrt(3.0 / 7.0)
"""Sine of the slip angle at the largest steering angle: its tangent is half of the other one's."""


@inlined
def steering_tangent(
    future_heading: float, lateral: float, heading: float, speed: float, length: float
) -> float:
    """Return the tangent of the steering angle that leads a vehicle to the centre of its lane.

    The angle itself, ``atan(2 tan(slip))``, is only ever asked for its tangent.

    Args:
        future_heading: Direction of the lane a little ahead [rad].
        lateral: Of the vehicle, to the left of the centre [m].
        heading: [rad].
        speed: [m/s].
        length: Of the vehicle; its axles are that far apart [m].
    """
    pace = 1.0 / not_zero(speed)
    approach = -(1.0 / LATERAL_TIME) * lateral * pace
    command = asin(clip(approach, -_MAX_APPROACH_SINE, _MAX_APPROACH_SINE))
    rate = 1.0 / HEADING_TIME * wrapped(future_heading + command - heading)
    slip = length / 2.0 * pace * rate
    if abs(slip) >= MAX_SLIP_SINE:
        return MAX_STEERING_TANGENT if slip > 0.0 else -MAX_STEERING_TANGENT
    # The tangent of an angle given by its sine.
    return 2.0 * slip / math.sqrt(1.0 - slip * slip)


@inlined
def slip_sine(
    future_heading: float, lateral: float, heading: float, speed: float, length: float
) -> float:
    """Return the sine of the slip angle that ``steering_tangent`` leads to.

    The limit of the steering angle is one of the slip's sine. Exactly zero on the centre of a lane
    in its direction.
    """
    pace = 1.0 / not_zero(speed)
    approach = -(1.0 / LATERAL_TIME) * lateral * pace
    command = asin(clip(approach, -_MAX_APPROACH_SINE, _MAX_APPROACH_SINE))
    rate = 1.0 / HEADING_TIME * wrapped(future_heading + command - heading)
    return clip(0.5 * length * pace * rate, -MAX_SLIP_SINE, MAX_SLIP_SINE)


@inlined
def _ahead(road: Road, who: int) -> tuple[float, float]:
    """Return the direction of the target lane a little ahead [rad] and the place beside it [m]."""
    s, lateral = road.vehicles[who, S], road.vehicles[who, LATERAL]
    target = road.marks[who, TARGET]
    if target != road.marks[who, LANE]:
        s, lateral = lane_local(road.lanes, target, road.vehicles[who, X], road.vehicles[who, Y])
    return lane_heading(road.lanes, target, s + road.vehicles[who, SPEED] * PURSUIT_TIME), lateral


@inlined
def _clip_actions(vehicles: Floats, who: int, crashed: int) -> None:
    """Brake a crashed vehicle, and one that is too fast."""
    if crashed != 0:
        vehicles[who, CONTROL] = 0.0
        vehicles[who, ACCELERATION] = -vehicles[who, SPEED]
    if vehicles[who, SPEED] > vehicles[who, TOP_SPEED]:
        vehicles[who, ACCELERATION] = min(
            vehicles[who, ACCELERATION], vehicles[who, TOP_SPEED] - vehicles[who, SPEED]
        )


@inlined
def _change_speed(vehicles: Floats, who: int, step: float) -> None:
    """Change the speed, braking no further than to standstill."""
    vehicles[who, SPEED] = max(0.0, vehicles[who, SPEED] + vehicles[who, ACCELERATION] * step)


@inlined
def _limit_braking(vehicles: Floats, who: int, step: float) -> None:
    if vehicles[who, SPEED] + vehicles[who, ACCELERATION] * step < 0.0:
        vehicles[who, ACCELERATION] = -vehicles[who, SPEED] / step


@inlined
def steer_reference(road: Road) -> None:
    """Let the drivers of a run steer for their target lanes; ``CONTROL`` is the steering tangent.

    Args:
        road: In and out: the control.
    """
    for who in range(road.vehicles.shape[0]):
        if road.marks[who, ROLE] >= CRUISING and road.marks[who, CRASHED] == 0:
            row = road.vehicles[who]
            future, lateral = _ahead(road, who)
            row[CONTROL] = steering_tangent(future, lateral, row[HEADING], row[SPEED], row[LENGTH])


@inlined
def steer_fast(road: Road) -> None:
    """Do what ``steer_reference`` does; ``CONTROL`` is the sine of the slip angle."""
    for who in range(road.vehicles.shape[0]):
        if road.marks[who, ROLE] >= CRUISING and road.marks[who, CRASHED] == 0:
            row = road.vehicles[who]
            future, lateral = _ahead(road, who)
            row[CONTROL] = slip_sine(future, lateral, row[HEADING], row[SPEED], row[LENGTH])


@inlined
def move_reference(vehicles: Floats, marks: Ints, step: float) -> None:
    """Move the vehicles that drivers steer over one tick; ``CONTROL`` is the steering tangent.

    Args:
        vehicles: (N, VEHICLE_WIDTH) in and out.
        marks: (N, MARK_WIDTH).
        step: [s].
    """
    for who in range(vehicles.shape[0]):
        if marks[who, ROLE] < CRUISING:
            continue
        vehicles[who, TIMER] += step
        _clip_actions(vehicles, who, marks[who, CRASHED])
        _limit_braking(vehicles, who, step)
        speed = vehicles[who, SPEED]
        # Sine and cosine of the slip angle, whose tangent this is, and of the course.
        slip = 0.5 * vehicles[who, CONTROL]
        cosine = 1.0 / math.sqrt(1.0 + slip * slip)
        sine = slip * cosine
        course_x = vehicles[who, COSINE] * cosine - vehicles[who, SINUS] * sine
        course_y = vehicles[who, SINUS] * cosine + vehicles[who, COSINE] * sine
        vehicles[who, X] += speed * course_x * step
        vehicles[who, Y] += speed * course_y * step
        vehicles[who, HEADING] += speed * sine / (vehicles[who, LENGTH] / 2.0) * step
        _change_speed(vehicles, who, step)
    for who in range(vehicles.shape[0]):
        if marks[who, ROLE] >= CRUISING:
            vehicles[who, SINUS], vehicles[who, COSINE] = sin_cos(vehicles[who, HEADING])


@inlined
def move_fast(vehicles: Floats, marks: Ints, step: float) -> None:
    """Do what ``move_reference`` does; ``CONTROL`` is the sine of the slip angle."""
    for who in range(vehicles.shape[0]):
        if marks[who, ROLE] < CRUISING:
            continue
        vehicles[who, TIMER] += step
        speed, acceleration = vehicles[who, SPEED], vehicles[who, ACCELERATION]
        slip = vehicles[who, CONTROL]
        if marks[who, CRASHED] != 0:
            slip = vehicles[who, CONTROL] = 0.0
            acceleration = -speed
        if speed > vehicles[who, TOP_SPEED]:
            acceleration = min(acceleration, vehicles[who, TOP_SPEED] - speed)
        if speed + acceleration * step < 0.0:
            acceleration = -speed / step
        vehicles[who, ACCELERATION] = acceleration
        vehicles[who, SPEED] = max(0.0, speed + acceleration * step)
        way = speed * step
        sine, cosine = vehicles[who, SINUS], vehicles[who, COSINE]
        if slip == 0.0:
            vehicles[who, X] += way * cosine
            vehicles[who, Y] += way * sine
            continue
        level = math.sqrt(1.0 - slip * slip)
        vehicles[who, X] += way * (cosine * level - sine * slip)
        vehicles[who, Y] += way * (sine * level + cosine * slip)
        heading = vehicles[who, HEADING] + 2.0 * way * slip / vehicles[who, LENGTH]
        vehicles[who, HEADING] = heading
    for who in range(vehicles.shape[0]):
        if marks[who, ROLE] >= CRUISING and vehicles[who, CONTROL] != 0.0:
            sine, cosine = sin_cos_of_small(vehicles[who, HEADING])
            vehicles[who, SINUS], vehicles[who, COSINE] = sine, cosine


@inlined
def locate(road: Road, who: int) -> None:
    """Find the lane that somebody is on, and the place beside it.

    Args:
        road: In and out: lane and place; the lane is that of a tick ago, or any.
        who: For whom.
    """
    lane, x, y = road.marks[who, LANE], road.vehicles[who, X], road.vehicles[who, Y]
    s, lateral = straight_local(road.lanes, lane, x, y)
    if not is_alone_nearest(road.lanes, lane, lateral):
        heading = road.vehicles[who, HEADING]
        road.marks[who, LANE], s, lateral = nearest_lane(
            road.lanes, road.links, lane, x, y, heading
        )
    road.vehicles[who, S], road.vehicles[who, LATERAL] = s, lateral


@inlined
def locate_drivers(road: Road) -> None:
    """Find the lanes of all vehicles that drivers steer."""
    for who in range(road.vehicles.shape[0]):
        if road.marks[who, ROLE] >= CRUISING:
            locate(road, who)


@inlined
def decide_fast(road: Road) -> None:
    """Do what ``drivers.decide`` does, in the fast arithmetic where there is one."""
    if road.lanes[0, ALONGSIDE] != 0.0:
        decide_alongside(road)
    else:
        decide(road)


@inlined
def advance_reference(road: Road, step: float) -> None:
    """Advance the vehicles of one run that drivers steer by one tick, in the reference arithmetic.

    Args:
        road: In and out.
        step: [s].
    """
    decide(road)
    steer_reference(road)
    move_reference(road.vehicles, road.marks, step)
    locate_drivers(road)


@inlined
def advance_fast(road: Road, step: float) -> None:
    """Do what ``advance_reference`` does, in the fast arithmetic."""
    decide_fast(road)
    steer_fast(road)
    move_fast(road.vehicles, road.marks, step)
    locate_drivers(road)
