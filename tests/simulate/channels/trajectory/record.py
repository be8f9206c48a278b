"""What the compiled steps of the trajectory channel read, and a pose, made up for tests."""

from typing import Any

import numpy as np

from adeye.signals import Floats, parameter_record
from adeye.simulate.channels.perception.pose import (
    POSE_D,
    POSE_S,
    POSE_SPEED,
    POSE_STAMP,
    POSE_WIDTH,
    POSE_X,
    POSE_Y,
)
from adeye.simulate.channels.trajectory.channel import MEMORY_LANE, MEMORY_WIDTH
from adeye.spec.channels import TrajectoryParameters

LANE = 5.25


def record(**changes: float) -> Any:
    """Return the default parameters with a car of 4.5 x 1.8 m on three lanes of 3.5 m."""
    parameters = {name: float(value) for name, value in TrajectoryParameters()}
    made = parameters | {
        "length": 4.5,
        "width": 1.8,
        "wheelbase": 2.7,
        "max_steering_angle": 0.6,
        "max_curvature": 0.25,
        "steering_lag": 0.1,
        "desired_speed": 30.0,
        "period": 0.05,
    }
    return parameter_record({name: np.array([value]) for name, value in (made | changes).items()})[
        0
    ]


def pose(*, d: float = LANE, speed: float = 30.0, s: float = 0.0) -> Floats:
    """Return the pose of an ego that drives along a straight road."""
    made = np.zeros(POSE_WIDTH)
    made[POSE_STAMP], made[POSE_S], made[POSE_D], made[POSE_SPEED] = 0.0, s, d, speed
    made[POSE_X], made[POSE_Y] = s, d
    return made


def memory(lane: float = LANE) -> Floats:
    """Return what the planner remembers while it drives in a lane."""
    made = np.zeros(MEMORY_WIDTH)
    made[MEMORY_LANE] = lane
    return made
