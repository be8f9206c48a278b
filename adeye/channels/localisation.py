"""Where the ego is, from satellite fixes and an inertial unit.

This is the estimate of a channel that links a receiver and no sensor that gives one. There is a new
one with every sample of the inertial unit, or without such a unit at every tick of the channel, as
long as its lateral deviation is below ``MOST_DEVIATION``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from adeye.channels.fixes import (
    FIX_TIME,
    LATEST_FIX,
    NOTHING,
    NOW_ACCELERATION,
    NOW_HEADING,
    NOW_RATE,
    NOW_SPEED,
    NOW_TIME,
    NOW_X,
    NOW_Y,
    SEEN,
    TIME,
    WAITING,
    add_fix,
    add_sample,
    is_number,
    use_fix,
)
from adeye.channels.inertial import (
    ACCELERATION_BIAS,
    MOVING,
    SCRATCH,
    STATES,
    YAW_RATE_BIAS,
    lateral_variance,
)
from adeye.kernel.elementary import atan, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.road import lane_center, lane_of, local
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    EGO_STEERING,
    EGO_X,
    EGO_Y,
    EGO_YAW_RATE,
    ESTIMATE_COLUMNS,
    ESTIMATE_PLACE,
    PLACE_CURVATURE,
    PLACE_D,
    PLACE_HEADING,
    PLACE_LANE,
    PLACE_OFFSET,
    PLACE_S,
    Floats,
    parameter_record,
    spec_columns,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.ports import ChannelContext

MOST_DEVIATION: Final = 1.0
"""Standard deviation of the lateral place from which there is no estimate [m]. Our choice: a car of
1.9 m has 0.8 m to each side in a lane of 3.5 m, so beyond it the lane itself is in doubt."""

MOST_HELD: Final = 0.2
"""How long the last sample of an inertial unit stands for the next [s], three of its periods at
least. Our choice: an emergency braking begins within that time."""

# What is added to the deviations of a data sheet, so that no sensor is believed without end: place
# [m], velocity [m/s], acceleration [m/s²], yaw rate [rad/s]. Our choice, below what devices have.
_LEAST_PLACE: Final = 0.02
_LEAST_VELOCITY: Final = 0.02
_LEAST_ACCELERATION: Final = 0.01
_LEAST_YAW_RATE: Final = 1e-4

_MANOEUVRE: Final = {"acceleration_bias": 2.0, "yaw_rate_bias": 0.1, "bias_time": 2.0}
"""What an ego without inertial unit is taken to do: deviation of acceleration [m/s²] and yaw rate
[rad/s], how long it lasts [s]. Our choice: of the order of normal driving."""


class Localiser:
    """Estimates the ego's place and motion from a receiver's fixes and an inertial unit's samples.

    Attributes:
        estimate: (B, 13) newest estimate, see ``signals.ESTIMATE_COLUMNS``.
        stamp: (B,) its time [s], -1 before the first.
        states: (B, STATES) of the filters, at their time.
        covariances: (B, STATES, STATES) of these.
        rows: (B, 21) what is kept beside them, see ``fixes``.
    """

    def __init__(self, context: ChannelContext, gnss: str, imu: str | None) -> None:
        """Prepare for the runs of a batch.

        Args:
            context: Of the channel.
            gnss: Id of the linked receiver.
            imu: Id of the linked inertial unit, if there is one.
        """
        runs = context.runs
        self.gnss = gnss
        self.imu = imu
        self._records = _records(context, gnss, imu)
        self._segments: Floats = np.ascontiguousarray(context.road.segments)
        # A unit has at most one sample a tick.
        self._queue: Floats = np.zeros((runs, int(LATEST_FIX / context.step) + 2, 3))
        self._scratch: Floats = np.zeros(SCRATCH)
        self.states: Floats = np.zeros((runs, STATES))
        self.covariances: Floats = np.zeros((runs, STATES, STATES))
        self.rows: Floats = np.tile(NOTHING, (runs, 1))
        self.estimate: Floats = np.zeros((runs, len(ESTIMATE_COLUMNS)))
        self.stamp: Floats = np.full(runs, -1.0)

    @classmethod
    def of(cls, context: ChannelContext) -> Self | None:
        """Return the localiser of a channel; None if it needs none or has no receiver.

        The first linked receiver and the first linked inertial unit are used.
        """
        kinds = [(context.sensors[link], link) for link in context.links if link in context.sensors]
        if any(kind in {"localisation", "ground_truth"} for kind, _ in kinds):
            return None
        gnss = next((link for kind, link in kinds if kind == "gnss"), None)
        imu = next((link for kind, link in kinds if kind == "imu"), None)
        return None if gnss is None else cls(context, gnss, imu)

    def update(self, fix: Floats, fix_stamp: Floats, sample: Floats, sample_stamp: Floats) -> None:
        """Take over the newest samples of a tick.

        Args:
            fix: (B, 4) of the receiver, see ``signals.GNSS_COLUMNS``; NaN rows are no fix.
            fix_stamp: (B,) its time [s].
            sample: (B, 3) of the inertial unit, see ``signals.IMU_COLUMNS``; NaN rows are none.
            sample_stamp: (B,) its time [s]; without a unit, zeros at the time of the tick.
        """
        _update(
            self._records,
            self._segments,
            fix,
            fix_stamp,
            sample,
            sample_stamp,
            self.states,
            self.covariances,
            self.rows,
            self._queue,
            self._scratch,
            self.estimate,
            self.stamp,
        )


def _records(context: ChannelContext, gnss: str, imu: str | None) -> Any:
    """Pack what the compiled steps read: what is assumed of the sensors, levers, lanes."""
    receiver = context.data_sheets[gnss]
    unit: Mapping[str, Any] = {
        "acceleration_noise": 0.0,
        "yaw_rate_noise": 0.0,
        "rate": 1.0 / context.period,
        **_MANOEUVRE,
    }
    if imu is not None:
        unit = context.data_sheets[imu]
    nowhere = np.zeros((context.runs, 4))
    antenna, place = context.mounts.get(gnss, nowhere), context.mounts.get(imu or "", nowhere)
    columns = spec_columns(context.vehicles, lambda vehicle: {"wheelbase": vehicle.wheelbase})
    rear = 0.5 * columns["wheelbase"]
    # A channel that acts more seldom than the unit samples holds each sample for longer.
    held = np.maximum(context.period, 1.0 / np.asarray(unit["rate"]))
    return parameter_record(
        {
            "place_variance": receiver["position_noise"] ** 2
            + receiver["bias"] ** 2
            + _LEAST_PLACE**2,
            "velocity_variance": receiver["speed_noise"] ** 2 + _LEAST_VELOCITY**2,
            # No filter averages a bias out that lasts.
            "least_variance": receiver["bias"] ** 2,
            "acceleration_density": (unit["acceleration_noise"] ** 2 + _LEAST_ACCELERATION**2)
            * held,
            "yaw_rate_density": (unit["yaw_rate_noise"] ** 2 + _LEAST_YAW_RATE**2) * held,
            "acceleration_bias": unit["acceleration_bias"],
            "yaw_rate_bias": unit["yaw_rate_bias"],
            "bias_time": unit["bias_time"],
            "most_held": np.maximum(MOST_HELD, 3.0 * held),
            "lever_x": antenna[:, 0] + rear,
            "lever_y": antenna[:, 1],
            # Without a unit there is no place where the acceleration is measured.
            "unit_x": (place[:, 0] + rear) if imu is not None else np.zeros(context.runs),
            "unit_y": place[:, 1],
            "rear": rear,
            "wheelbase": columns["wheelbase"],
            "lane_width": context.road.lane_width,
            "lanes": context.road.lanes,
        }
    )


@compiled
def _update(  # noqa: PLR0913, PLR0917 - a kernel
    records: Any,
    segments: Floats,
    fix: Floats,
    fix_stamp: Floats,
    sample: Floats,
    sample_stamp: Floats,
    states: Floats,
    covariances: Floats,
    rows: Floats,
    queue: Floats,
    scratch: Floats,
    estimate: Floats,
    stamp: Floats,
) -> None:
    for run in range(rows.shape[0]):
        record, state, covariance = records[run], states[run], covariances[run]
        row, samples = rows[run], queue[run]
        if sample_stamp[run] > row[SEEN] and is_number(sample[run]):
            add_sample(record, state, covariance, row, samples, sample[run], sample_stamp[run])
        if fix_stamp[run] > row[FIX_TIME]:
            add_fix(row, fix[run], fix_stamp[run])
        if 0.0 <= row[WAITING] <= row[SEEN]:
            use_fix(record, segments[run], state, covariance, row, samples, scratch)
        if row[TIME] >= 0.0 and row[NOW_TIME] > stamp[run]:
            age = row[NOW_TIME] - row[TIME]
            variance = lateral_variance(state, covariance, record["rear"], age)
            # NaN compares false: it is no estimate.
            if variance + record["least_variance"] <= MOST_DEVIATION * MOST_DEVIATION:
                _write(record, segments[run], state, row, estimate[run])
                stamp[run] = row[NOW_TIME]


@inlined
def _write(record: Any, segments: Floats, state: Floats, row: Floats, estimate: Floats) -> None:
    """Write the estimate of the box centre and its place on the road."""
    heading, rate = row[NOW_HEADING], row[NOW_RATE] - state[YAW_RATE_BIAS]
    sine, cosine = sin_cos(heading)
    x, y = row[NOW_X] + record["rear"] * cosine, row[NOW_Y] + record["rear"] * sine
    speed = max(0.0, row[NOW_SPEED])
    estimate[EGO_X], estimate[EGO_Y], estimate[EGO_HEADING] = x, y, heading
    estimate[EGO_SPEED] = speed
    estimate[EGO_ACCELERATION] = row[NOW_ACCELERATION] - state[ACCELERATION_BIAS]
    # The angle of wheels that roll where the ego goes; unknown, and so straight, at standstill.
    estimate[EGO_STEERING] = atan(record["wheelbase"] * rate / speed) if speed > MOVING else 0.0
    estimate[EGO_YAW_RATE] = rate
    s, d, road_heading, curvature = local(segments, x, y)
    width, lanes = record["lane_width"], int(record["lanes"])
    lane = lane_of(d, width, lanes)
    nearest = lane if lane >= 0 else (0 if d < 0.0 else lanes - 1)
    place = estimate[ESTIMATE_PLACE:]
    place[PLACE_S], place[PLACE_D] = s, d
    place[PLACE_HEADING], place[PLACE_CURVATURE] = road_heading, curvature
    place[PLACE_LANE], place[PLACE_OFFSET] = lane, d - lane_center(nearest, width)
