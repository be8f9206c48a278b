"""What the ego of each run is able to do on its road."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.motion import GRAVITY

if TYPE_CHECKING:
    from adeye.signals import Floats
    from adeye.trace import Trace


def abilities(trace: Trace) -> Floats:
    """Give the largest braking, lateral acceleration and acceleration (B, 3) of the egos [m/s²].

    Braking and acceleration are those of the vehicle, and all three no more than friction allows.
    """
    grip = trace.layout.context.surroundings.friction * GRAVITY
    vehicles = [item.vehicle for item in trace.layout.architectures]
    braking = np.array([vehicle.max_deceleration for vehicle in vehicles])
    acceleration = np.array([vehicle.max_acceleration for vehicle in vehicles])
    return np.stack([np.minimum(braking, grip), grip, np.minimum(acceleration, grip)], axis=1)
