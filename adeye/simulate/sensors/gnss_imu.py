"""A satellite receiver: place and velocity over ground of its antenna, with bias and outages.

Its values are normal with one standard deviation for ever, and two of them are correlated by
``exp(-time between / correlation time)``. A long correlation time is a constant unknown offset, a
short one is white noise.

Source:
    Maybeck (1979), "Stochastic models, estimation, and control", volume 1, section 4.11.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from adeye import signals
from adeye.delivery import no_measurement
from adeye.fields import fields_of
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import exp, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal_pairs
from adeye.signals import Bools, Floats, Measurement, Scene, parameter_record, spec_columns
from adeye.simulate.sensors.sampling import Sampling, rear_axles, sample_like, velocity_at

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from adeye.ports import SensorContext
    from adeye.spec.sensors import Gnss, Imu

# --- A slowly changing bias: a first-order Gauss-Markov process, sampled --------------------------


def share_kept(period: float, correlation_time: float) -> float:
    """Return the share of a bias that is left at the next sample.

    Args:
        period: Time between two samples [s].
        correlation_time: > 0 [s].
    """
    return float(exp(-period / correlation_time))


def share_new(kept: float) -> float:
    """Return the share of its deviation that comes anew, so that the deviation stays as it is."""
    return math.sqrt((1.0 - kept) * (1.0 + kept))


@inlined
def next_bias(
    bias: float,
    sigma: float,
    kept: float,
    new: float,
    draw: float,
    is_first: bool,  # noqa: FBT001 - a kernel
) -> float:
    """Return the bias of a sample from that of the sample before.

    Args:
        bias: Of the sample before; it does not matter for the first.
        sigma: Standard deviation of the bias.
        kept: ``share_kept``.
        new: ``share_new``.
        draw: A standard normal number.
        is_first: Whether this is the first sample, which is drawn from the stationary distribution.
    """
    if is_first:
        return sigma * draw
    return kept * bias + new * sigma * draw


# --- A satellite receiver: place and velocity over ground of its antenna, with bias and outages ---

TOLERANCE = 1e-9
"""Slack of comparisons of times [s]: multiples of the step are not exact."""


class _MotionSensor(Sampling):
    """What a sensor of the ego's motion has beside its model: draws, biases and its samples."""

    def __init__(
        self,
        context: SensorContext,
        numbers: Callable[[Any, float], dict[str, float]],
        columns: Sequence[str],
        biases: int,
    ) -> None:
        """Pack the parameters of every run.

        Args:
            context: What the sensor is built with.
            numbers: Lists what the compiled step reads of a record and the time between samples.
            columns: Of its values.
            biases: How many of them drift.
        """
        runs = context.scene.runs
        self._period = context.every * context.scene.step
        self._parameters = parameter_record(
            {
                **spec_columns(context.specs, lambda spec: numbers(spec, self._period)),
                "rear": rear_axles(context),
            }
        )
        self._draws = tuple(np.zeros(runs) for _ in range(6))
        self._bias: Floats = np.zeros((runs, biases))
        # Before its first sample its values are NaN; it never detects an object.
        objects = len(context.scene.object_ids)
        self._empty = no_measurement(runs, objects, with_estimate=False)
        self._empty.values = np.full((runs, len(columns)), np.nan)
        super().__init__(context, self._empty)

    def _sample(self, scene: Scene) -> Measurement:
        truth = self._truth(scene)
        for pair in range(3):
            first, second = self._draws[2 * pair : 2 * pair + 2]
            normal_pairs(truth.seeds, truth.owner, truth.number, pair, first, second)
        assert self._empty.values is not None
        values: Floats = np.empty_like(self._empty.values)
        self._measure(scene, values)
        return sample_like(self._empty, scene.time, values=values)

    def _measure(self, scene: Scene, values: Floats) -> None:
        """Write the values of a sample (B, V)."""
        raise NotImplementedError


class GnssSensor(_MotionSensor):
    """Place and velocity of the antenna in the map, with white noise and a slowly changing bias.

    In an outage the receiver goes on and delivers samples without a fix: their stamp is new, their
    values are NaN. The bias goes on, too.
    """

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        super().__init__(context, _gnss_numbers, signals.GNSS_COLUMNS, 2)
        self._outages = _outages([cast("Gnss", spec) for spec in context.specs])

    def _measure(self, scene: Scene, values: Floats) -> None:
        _sample_gnss(
            self._parameters,
            self._outages,
            scene.time,
            self._sample_number == 0,
            scene.running,
            scene.ego,
            self._draws,
            self._bias,
            values,
        )


def _gnss_numbers(spec: Gnss, period: float) -> dict[str, float]:
    """List what the compiled step reads of a receiver."""
    kept = share_kept(period, spec.bias_time)
    return {
        **fields_of(spec.mount, "x", "y"),
        **fields_of(spec, "position_noise", "speed_noise", "bias"),
        "kept": kept,
        "new": share_new(kept),
    }


def _outages(specs: Sequence[Gnss]) -> Floats:
    """Return begin and end of each outage (B, K, 2) [s]; all runs have the same number."""
    rows = [
        [(outage.begin, outage.begin + outage.duration) for outage in spec.outages.values()]
        for spec in specs
    ]
    return np.array(rows, dtype=np.float64).reshape(len(specs), -1, 2)


@compiled
def _sample_gnss(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    outages: Floats,
    time: float,
    is_first: bool,  # noqa: FBT001 - a kernel
    running: Bools,
    ego: Floats,
    draws: tuple[Floats, ...],
    bias: Floats,
    values: Floats,
) -> None:
    """Measure place and velocity of every antenna; NaN in an outage and where the run has ended.

    Args:
        parameters: (B,) records.
        outages: (B, K, 2) begin and end [s].
        time: [s].
        is_first: Whether this is the first sample.
        running: (B,).
        ego: (B, 7) states.
        draws: Standard normal numbers (B,): place x, y, velocity x, y, bias x, y.
        bias: (B, 2) in and out [m].
        values: (B, 4) out.
    """
    for run in range(ego.shape[0]):
        record, state, row = parameters[run], ego[run], values[run]
        for axis in range(2):
            bias[run, axis] = next_bias(
                bias[run, axis],
                record["bias"],
                record["kept"],
                record["new"],
                draws[4 + axis][run],
                is_first,
            )
        if not running[run] or _is_out(outages[run], time):
            row[:] = math.nan
            continue
        s, c = sin_cos(state[signals.EGO_HEADING])
        x, y = record["x"], record["y"]
        ahead, aside = velocity_at(state, x + record["rear"], y)
        noise, speed_noise = record["position_noise"], record["speed_noise"]
        row[signals.GNSS_X] = (
            state[signals.EGO_X] + c * x - s * y + bias[run, 0] + noise * draws[0][run]
        )
        row[signals.GNSS_Y] = (
            state[signals.EGO_Y] + s * x + c * y + bias[run, 1] + noise * draws[1][run]
        )
        row[signals.GNSS_VELOCITY_X] = c * ahead - s * aside + speed_noise * draws[2][run]
        row[signals.GNSS_VELOCITY_Y] = s * ahead + c * aside + speed_noise * draws[3][run]


@compiled
def _is_out(outages: Floats, time: float) -> bool:
    """Tell whether a time [s] is in one of the outages (K, 2), which end before their end."""
    for row in range(outages.shape[0]):
        if outages[row, 0] - TOLERANCE <= time < outages[row, 1] - TOLERANCE:
            return True
    return False


# --- An inertial unit: acceleration of its place and turning rate of the ego, with bias -----------


class ImuSensor(_MotionSensor):
    """Acceleration along the vehicle's axes at the mount and yaw rate, means since the last sample.

    Units integrate what they measure and hand out the increments, so nothing that happens between
    two samples is lost (Groves 2013, section 4.3). Only the first sample is of a moment. The road
    is level, so gravity does not enter. The unit is taken to be aligned with the vehicle: the
    angles of its mount are not looked at.
    """

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        super().__init__(context, _imu_numbers, signals.IMU_COLUMNS, 3)
        self._before: Floats | None = None

    def _measure(self, scene: Scene, values: Floats) -> None:
        _sample_imu(
            self._parameters,
            self._period,
            self._sample_number == 0,
            scene.running,
            scene.ego,
            scene.ego if self._before is None else self._before,
            self._draws,
            self._bias,
            values,
        )
        self._before = scene.ego.copy()


def _imu_numbers(spec: Imu, period: float) -> dict[str, float]:
    """List what the compiled step reads of an inertial unit."""
    kept = share_kept(period, spec.bias_time)
    return {
        **fields_of(spec.mount, "x", "y"),
        **fields_of(spec, "acceleration_noise", "acceleration_bias"),
        **fields_of(spec, "yaw_rate_noise", "yaw_rate_bias"),
        "kept": kept,
        "new": share_new(kept),
    }


@compiled
def _sample_imu(  # noqa: PLR0913, PLR0917 - a kernel
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
        row[signals.IMU_ACCELERATION_X] = along + bias[run, 0] + noise * draws[0][run]
        row[signals.IMU_ACCELERATION_Y] = across + bias[run, 1] + noise * draws[1][run]
        row[signals.IMU_YAW_RATE] = rate + bias[run, 2] + record["yaw_rate_noise"] * draws[2][run]


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
    rate = ego[signals.EGO_YAW_RATE]
    along, across = ego[signals.EGO_SPEED] - rate * aside, rate * ahead
    if is_first:
        return ego[signals.EGO_ACCELERATION] - rate * across, rate * along, rate
    old_rate = before[signals.EGO_YAW_RATE]
    old_along, old_across = before[signals.EGO_SPEED] - old_rate * aside, old_rate * ahead
    return (
        (along - old_along) / period - 0.5 * (rate * across + old_rate * old_across),
        (across - old_across) / period + 0.5 * (rate * along + old_rate * old_along),
        wrap_to_pi(ego[signals.EGO_HEADING] - before[signals.EGO_HEADING]) / period,
    )
