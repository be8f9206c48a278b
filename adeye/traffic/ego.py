"""The ego stage: commands become motion within the limits of vehicle and road."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.jit import compiled
from adeye.kernel.motion import advance_ego_fading, fade

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.signals import Bools, Floats, SceneContext
    from adeye.world.formulas import Situation


FRICTION: Final = 8
"""Column of the limits of an ego that holds the friction coefficient."""


class Ego:
    """The vehicles of a batch; the centre of each box lies half-way between the axles."""

    def __init__(self, cases: Sequence[Situation], context: SceneContext) -> None:
        """Take the limits of each run's vehicle and the friction of its road."""
        self._step = context.step
        vehicles = [case.architecture.vehicle for case in cases]
        step = context.step
        self._friction = context.surroundings.friction
        self._limits = np.array(
            [
                [
                    vehicle.wheelbase,
                    0.5 * vehicle.wheelbase,
                    vehicle.max_acceleration,
                    vehicle.max_deceleration,
                    vehicle.max_steering_angle,
                    vehicle.max_steering_rate,
                    vehicle.acceleration_lag,
                    vehicle.steering_lag,
                    friction,
                    fade(step, vehicle.acceleration_lag),
                    fade(0.5 * step, vehicle.acceleration_lag),
                    fade(step, vehicle.steering_lag),
                    fade(0.5 * step, vehicle.steering_lag),
                ]
                for vehicle, friction in zip(vehicles, context.surroundings.friction, strict=True)
            ]
        )

    def move(
        self,
        running: Bools,
        command: Floats,
        states: Floats,
        friction: Floats | None = None,
    ) -> None:
        """Advance the ego of every run that has not ended by one tick.

        Args:
            running: (B,).
            command: (B, 2) acting acceleration [m/s²] and steering angle [rad].
            states: (B, 7) in and out, see ``signals.EGO_COLUMNS``.
            friction: (B,) of the tyres at this tick; None for that of the road.
        """
        limits = self._limits
        if friction is not None and friction is not self._friction:
            limits = limits.copy()
            limits[:, FRICTION] = friction
        move_egos(running, command, limits, self._step, states)


@compiled
def move_egos(running: Bools, command: Floats, limits: Floats, step: float, states: Floats) -> None:
    """Advance the ego of every run that has not ended by one tick.

    Args:
        running: (B,).
        command: (B, 2) acceleration [m/s²] and steering angle [rad].
        limits: (B, 13) arguments of ``kernel.motion.advance_ego_fading`` from the wheelbase on.
        step: Master clock [s].
        states: (B, 7) in and out.
    """
    for run in range(running.shape[0]):
        if running[run]:
            row = limits[run]
            advance_ego_fading(
                states[run],
                command[run, 0],
                command[run, 1],
                step,
                row[0],
                row[1],
                row[2],
                row[3],
                row[4],
                row[5],
                row[6],
                row[7],
                row[8],
                row[9],
                row[10],
                row[11],
                row[12],
                states[run],
            )
