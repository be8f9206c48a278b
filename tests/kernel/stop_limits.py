"""What the kernels of stops read of a car, its road and its channel, with changes."""

from typing import Any

from adeye.signals import parameter_record

LIMITS = {
    "stop_deceleration": [4.0],
    "emergency_deceleration": 8.0,
    "length": 4.5,
    "width": 1.8,
    "lane_width": 3.5,
    "lanes": 3.0,
    "shoulder": 2.5,
    "verge": 0.0,
    "speed_limit": 36.1,
    "max_curvature": 0.25,
    "acceleration_lag": 0.15,
    "lateral_margin": 0.2,
    "uncertainty_growth": 0.1,
    "follower_deceleration": 3.0,
    "rear_sight": 0.0,
}


def limits(**changes: float) -> Any:
    return parameter_record(LIMITS | changes)[0]
