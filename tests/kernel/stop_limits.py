"""What the kernels of stops read of a car, its road and its channel, with changes."""

from typing import Any

import numpy as np

from adeye.kernel.road import Ground
from adeye.signals import parameter_record

BODY = {
    "stop_deceleration": [4.0],
    "emergency_deceleration": 8.0,
    "length": 4.5,
    "width": 1.8,
    "acceleration_lag": 0.15,
    "max_curvature": 0.25,
}
"""What the judge knows of a car, in its order: in another one, the kernels compile again."""

LIMITS = {
    **BODY,
    "lateral_margin": 0.2,
    "uncertainty_growth": 0.1,
    "follower_deceleration": 3.0,
    "rear_sight": 0.0,
}


STRAIGHT = np.array([[0.0, 0.0, 0.0, 3000.0, 0.0]])
GROUND = Ground(STRAIGHT, np.zeros((0, 5)), 3.5, 3, 2.5, 0.0, 36.1)
"""Three lanes of 3.5 m and a shoulder of 2.5 m, without bays."""


def body() -> Any:
    return parameter_record(BODY)[0]


def limits(**changes: float) -> Any:
    return parameter_record(LIMITS | changes)[0]
