"""An inertial unit: acceleration of its place and turning rate of the ego, with bias."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from adeye.kernel.geometry import wrap_to_pi
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal_pairs
from adeye.sensors.bias import next_bias, share_kept, share_new
from adeye.sensors.delivery import Delivery
from adeye.sensors.gnss import no_values, rear_axles, with_values
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    EGO_YAW_RATE,
    IMU_ACCELERATION_X,
    IMU_ACCELERATION_Y,
    IMU_COLUMNS,
    IMU_YAW_RATE,
    Bools,
    Floats,
    Measurement,
    Scene,
    parameter_record,
    spec_columns,
)

if TYPE_CHECKING:
    from adeye.ports import SensorContext
    from adeye.spec.sensors import Imu

ACCELERATION_DRAWS, YAW_RATE_DRAWS, BIAS_DRAWS = 0, 1, 2
"""Pairs of random numbers of a sample: noise along and across; noise and bias of the yaw rate;
bias along and across."""


class ImuSensor:
    """Acceleration along the vehicle's axes at the mount and yaw rate, means since the last sample.

    Units integrate what they measure and hand out the increments, so nothing that happens between
    two samples is lost (Groves 2013, section 4.3). Only the first sample is of a moment. The road
    is level, so gravity does not enter. The unit is taken to be aligned with the vehicle: the
    angles of its mount are not looked at.
    """

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        self._context = context
        runs = context.scene.runs
        specs = [cast("Imu", spec) for spec in context.specs]
        period = context.every * context.scene.step
        self._parameters = parameter_record(
            {
                **spec_columns(specs, lambda spec: _numbers(spec, period)),
                "rear": rear_axles(context),
            }
        )
        self._draws = tuple(np.zeros(runs) for _ in range(6))
        self._bias: Floats = np.zeros((runs, 3))
        self._before: Floats | None = None
        self._sample_number = 0
        self._empty = no_values(runs, len(context.scene.object_ids), len(IMU_COLUMNS))
        self._delivery = Delivery.of(context, self._empty)

    def sense(self, scene: Scene) -> Measurement:
        """Sample if it is time to, and return the newest delivered sample."""
        if self._delivery.is_due(scene.tick):
            self._delivery.push(scene.tick, self._sample(scene))
        return self._delivery.newest(scene.tick)

    def _sample(self, scene: Scene) -> Measurement:
        context = self._context.scene
        owner = np.uint64(self._context.owner)
        for pair in (ACCELERATION_DRAWS, YAW_RATE_DRAWS, BIAS_DRAWS):
            first, second = self._draws[2 * pair : 2 * pair + 2]
            normal_pairs(context.stream_seeds, owner, self._sample_number, pair, first, second)
        values: Floats = np.empty((context.runs, len(IMU_COLUMNS)))
        _sample_batch(
            self._parameters,
            self._context.every * context.step,
            self._sample_number == 0,
            scene.running,
            scene.ego,
            scene.ego if self._before is None else self._before,
            self._draws,
            self._bias,
            values,
        )
        self._sample_number += 1
        self._before = scene.ego.copy()
        return with_values(self._empty, scene.time, values)


def _numbers(spec: Imu, period: float) -> dict[str, float]:
    """List what the compiled step reads of an inertial unit."""
    kept = share_kept(period, spec.bias_time)
    return {
        "x": spec.mount.x,
        "y": spec.mount.y,
        "acceleration_noise": spec.acceleration_noise,
        "acceleration_bias": spec.acceleration_bias,
        "yaw_rate_noise": spec.yaw_rate_noise,
        "yaw_rate_bias": spec.yaw_rate_bias,
        "kept": kept,
        "new": share_new(kept),
    }


@compiled
def _sample_batch(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    period: float,
    is_first: bool,  # noqa: FBT001 - a kernel
    running: Bools,
    ego: Floats,
    before: Floats,
    draws: tuple[Floats, ...],
    bias: Floats,
    values: Floats,
) -> None:
    """Measure the motion of every ego; NaN where the run has ended.

    Args:
        parameters: (B,) records.
        period: Time since the last sample [s].
        is_first: Whether this is the first sample.
        running: (B,).
        ego: (B, 7) states.
        before: (B, 7) states at the last sample.
        draws: Standard normal numbers (B,): noise along, across, of the yaw rate; bias of the yaw
            rate, along, across.
        bias: (B, 3) along, across [m/s²], of the yaw rate [rad/s]; in and out.
        values: (B, 3) out.
    """
    for run in range(ego.shape[0]):
        record, row = parameters[run], values[run]
        for axis in range(3):
            bias[run, axis] = next_bias(
                bias[run, axis],
                record["yaw_rate_bias"] if axis == 2 else record["acceleration_bias"],
                record["kept"],
                record["new"],
                draws[3][run] if axis == 2 else draws[4 + axis][run],
                is_first,
            )
        if not running[run]:
            row[:] = math.nan
            continue
        along, across, rate = _motion(record, before[run], ego[run], period, is_first)
        noise = record["acceleration_noise"]
        row[IMU_ACCELERATION_X] = along + bias[run, 0] + noise * draws[0][run]
        row[IMU_ACCELERATION_Y] = across + bias[run, 1] + noise * draws[1][run]
        row[IMU_YAW_RATE] = rate + bias[run, 2] + record["yaw_rate_noise"] * draws[2][run]


@inlined
def _motion(
    record: Any,
    before: Floats,
    ego: Floats,
    period: float,
    is_first: bool,  # noqa: FBT001 - a kernel
) -> tuple[float, float, float]:
    """Return mean acceleration of the mount along and across [m/s²] and mean yaw rate [rad/s].

    The change of its velocity in axes that turn, and what their turning adds, by the trapezoid.
    """
    # The rear axle moves along the heading, the mount with it as of a rigid body.
    ahead, aside = record["x"] + record["rear"], record["y"]
    rate = ego[EGO_YAW_RATE]
    along, across = ego[EGO_SPEED] - rate * aside, rate * ahead
    if is_first:
        return ego[EGO_ACCELERATION] - rate * across, rate * along, rate
    old_rate = before[EGO_YAW_RATE]
    old_along, old_across = before[EGO_SPEED] - old_rate * aside, old_rate * ahead
    return (
        (along - old_along) / period - 0.5 * (rate * across + old_rate * old_across),
        (across - old_across) / period + 0.5 * (rate * along + old_rate * old_along),
        wrap_to_pi(ego[EGO_HEADING] - before[EGO_HEADING]) / period,
    )
