"""Ask ad-rss, Intel's library of responsibility-sensitive safety, for its safe distances.

pip install ad-rss==5.0.0 in an environment of its own; python -m docs.peers.ask_rss
"""

from __future__ import annotations

from importlib.metadata import version
from typing import Any, NamedTuple

from ad_rss import physics, rss

from docs.peers.states import draw, write

COUNT = 1000


class Mover(NamedTuple):
    """What ad-rss is to know of one of two."""

    along: float
    aside: float
    response: float
    acceleration: float
    braking: float
    """Least [m/s^2]."""
    most: float
    """Most [m/s^2]."""
    is_correct: bool = True
    margin: float = 0.0
    least_distance: float = 0.0
    fastest: float = 100.0


def relative(mover: Mover) -> Any:
    """Build the object of ad-rss; what the question does not need gets any valid value."""
    made = rss.core.RelativeObjectState()
    made.object_type = rss.world.ObjectType.OtherVehicle
    rules = made.dynamics
    least, most = physics.Acceleration(-mover.braking), physics.Acceleration(-mover.most)
    rules.alpha_lon.accel_max = physics.Acceleration(mover.acceleration)
    rules.alpha_lon.brake_max = most
    rules.alpha_lon.brake_min = least
    rules.alpha_lon.brake_min_correct = least
    rules.alpha_lat.accel_max = physics.Acceleration(mover.acceleration)
    rules.alpha_lat.brake_min = least
    rules.lateral_fluctuation_margin = physics.Distance(mover.margin)
    rules.response_time = physics.Duration(mover.response)
    rules.min_longitudinal_safety_distance = physics.Distance(mover.least_distance)
    rules.max_speed_on_acceleration = physics.Speed(mover.fastest)
    free = rules.unstructured_settings
    free.pedestrian_turning_radius = physics.Distance(2.0)
    free.drive_away_max_angle = physics.Angle(2.4)
    free.vehicle_yaw_rate_change = physics.AngularAcceleration(0.3)
    free.vehicle_min_radius = physics.Distance(3.5)
    free.vehicle_trajectory_calculation_step = physics.Duration(0.2)
    state = made.unstructured_object_state
    state.yaw = physics.Angle(0.0)
    state.steering_angle = physics.Angle(0.0)
    state.yaw_rate = physics.AngularVelocity(0.0)
    state.dimension.length = physics.Distance(4.0)
    state.dimension.width = physics.Distance(2.0)
    state.center_point.x = physics.Distance(0.0)
    state.center_point.y = physics.Distance(0.0)
    state.speed_range.minimum = physics.Speed(0.0)
    state.speed_range.maximum = physics.Speed(100.0)
    place = made.structured_object_state
    place.is_in_correct_lane = mover.is_correct
    place.has_priority = False
    place.distance_to_enter_intersection = physics.Distance(10.0)
    place.distance_to_leave_intersection = physics.Distance(20.0)
    speed = place.velocity
    speed.speed_lon_min = speed.speed_lon_max = physics.Speed(mover.along)
    speed.speed_lat_min = speed.speed_lat_max = physics.Speed(mover.aside)
    return made


def asked(function: Any, first: Mover, second: Mover) -> float:
    """Return the distance [m] that a function of ad-rss writes into its last argument."""
    distance = physics.Distance(0.0)
    if not function(relative(first), relative(second), distance):
        raise RuntimeError(f"{function.__name__} refuses {first} {second}")
    return float(distance.mDistance)


LIMITS = ["least_distance", "fastest"]
"""Last columns along the road, and the ranges of their values: distance [m], speed [m/s]."""
LIMIT_RANGES = [(0, 4), (5, 80)]


def same_direction(count: int = COUNT) -> Any:
    """The distance behind who goes the same way."""
    names = ["v_rear", "v_front", "response", "acceleration", "least_braking", "most_braking"]
    ranges = [(0, 50), (0, 50), (0.2, 2), (0, 5), (2, 6), (6, 10), *LIMIT_RANGES]
    rows = draw(count, ranges)
    for row in rows:
        rear, front, response, acceleration, least, most, apart, fastest = row
        own = Mover(rear, 0.0, response, acceleration, least, most)
        own = own._replace(least_distance=apart, fastest=fastest)
        other = Mover(front, 0.0, response, acceleration, least, most)
        ask = rss.structured.calculateSafeLongitudinalDistanceSameDirection
        row.append(asked(ask, other, own))
    return [*names, *LIMITS], rows


def opposite(count: int = COUNT) -> Any:
    """The distance to who comes towards."""
    names = ["v", "v_oncoming", "response", "acceleration", "correct_braking", "other_braking"]
    rows = draw(count, [(0, 50), (0, 50), (0.2, 2), (0, 5), (2, 6), (2, 6), *LIMIT_RANGES])
    for row in rows:
        speed, oncoming, response, acceleration, correct, braking, apart, fastest = row
        own = Mover(speed, 0.0, response, acceleration, correct, 9.0)
        other = Mover(oncoming, 0.0, response, acceleration, braking, 9.0, is_correct=False)
        own, other = (
            mover._replace(least_distance=apart, fastest=fastest) for mover in (own, other)
        )
        ask = rss.structured.calculateSafeLongitudinalDistanceOppositeDirection
        row.append(asked(ask, own, other))
    return [*names, *LIMITS], rows


def lateral(count: int = COUNT) -> Any:
    """The distance beside each other; of ad-rss the left one moves to the right with speed > 0."""
    names = ["v_1", "v_2", "response_1", "response_2", "acceleration", "braking", "margin"]
    rows = draw(count, [(-3, 3), (-3, 3), (0.2, 2), (0.2, 2), (0, 1), (0.4, 2), (0, 0.5)])
    for row in rows:
        v_1, v_2, rho_1, rho_2, acceleration, braking, margin = row
        left = Mover(10.0, v_1, rho_1, acceleration, braking, 9.0, margin=margin)
        right = Mover(10.0, v_2, rho_2, acceleration, braking, 9.0, margin=margin)
        row.append(asked(rss.structured.calculateSafeLateralDistance, left, right))
    return names, rows


if __name__ == "__main__":
    found = {"rss_same": same_direction(), "rss_opposite": opposite(), "rss_lateral": lateral()}
    write("ad-rss", version("ad-rss"), found)
