"""Made-up drives of an ego with a satellite receiver and an inertial unit, for tests."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from adeye.kernel.motion import advance_ego
from adeye.kernel.random import owner_id
from adeye.ports import SensorContext
from adeye.signals import EGO_SPEED, EGO_STEERING, EGO_X, EGO_Y, EGO_YAW_RATE, Floats
from adeye.simulate.channels.perception.localisation import Localiser
from adeye.simulate.sensors.gnss_imu import GnssSensor, ImuSensor
from adeye.simulate.sensors.rig import DATA_SHEETS
from adeye.spec.sensors import Gnss, Imu
from adeye.testing.scenes import channel_context, passenger_car, straight_road
from tests.simulate.sensors.scenes import scene, scene_context

STEP = 0.05
CAR = passenger_car()


VEHICLE = (
    CAR.wheelbase,
    0.5 * CAR.wheelbase,
    CAR.max_acceleration,
    CAR.max_deceleration,
    CAR.max_steering_angle,
    CAR.max_steering_rate,
    CAR.acceleration_lag,
    CAR.steering_lag,
    1.0,
)


def drive(
    ticks: int,
    speed: float,
    command: Callable[[float], tuple[float, float]] = lambda _: (0.0, 0.0),
    *,
    step: float = STEP,
) -> Floats:
    """Drive the ego of a kinematic bicycle and return its states (T, 7), one per tick.

    Args:
        ticks: T.
        speed: At the start [m/s].
        command: Gives acceleration and steering angle by time [s].
        step: [s].
    """
    states = np.zeros((ticks, 7))
    states[0, [EGO_X, EGO_Y, EGO_SPEED]] = 50.0, 5.25, speed
    states[0, EGO_STEERING] = command(0.0)[1]
    states[0, EGO_YAW_RATE] = speed * np.tan(states[0, EGO_STEERING]) / CAR.wheelbase
    for tick in range(1, ticks):
        asked = command((tick - 1) * step)
        advance_ego(states[tick - 1], *asked, step, *VEHICLE, states[tick])
    return states


def gnss(**fields: Any) -> Gnss:
    return Gnss.model_validate({"kind": "gnss", "rate": "10 Hz", **fields})


def imu(**fields: Any) -> Imu:
    return Imu.model_validate({"kind": "imu", "rate": "20 Hz", **fields})


@dataclass
class Estimated:
    """What was estimated of a drive, by tick and run.

    Attributes:
        stamps: (T, B) [s].
        estimates: (T, B, 13).
        deviations: (T, B) of the lateral place at the filter's time, as it believes [m].
        innovations: (T, B) normalised innovation squared of the newest fix.
        states: (T, B, 6) of the filters.
    """

    stamps: Floats
    estimates: Floats
    deviations: Floats
    innovations: Floats
    states: Floats


def estimate(  # noqa: PLR0913 - each is one thing that a test may want to set
    states: Floats,
    receiver: Gnss,
    unit: Imu | None,
    *,
    runs: int = 1,
    latency: float = 0.1,
    unit_latency: float = 0.0,
    step: float = STEP,
    blind: Mapping[int, tuple[int, int]] | None = None,
) -> Estimated:
    """Let receiver and unit measure a drive in every run, and a channel estimate it.

    Args:
        states: (T, 7) of the ego.
        receiver: Satellite receiver.
        unit: Inertial unit, if there is one.
        runs: B; each with a stream seed of its own.
        latency: Of the receiver [s].
        unit_latency: Of the unit [s].
        step: [s].
        blind: By number of the sensor (0 receiver, 1 unit): ticks from, to which it is dead.
    """
    context = scene_context([], runs=runs, step=step)
    specs: dict[str, Gnss | Imu] = {"gnss": receiver, **({} if unit is None else {"imu": unit})}
    sensors: dict[str, Any] = {}
    for name, spec in specs.items():
        late = latency if name == "gnss" else unit_latency
        made = SensorContext(
            name,
            [spec] * runs,
            context,
            round(1.0 / (spec.rate * step)),
            round(late / step),
            owner_id(f"sensor/{name}"),
            vehicles=[CAR] * runs,
        )
        sensors[name] = GnssSensor(made) if name == "gnss" else ImuSensor(made)
    localiser = Localiser.of(
        replace(
            channel_context(
                None,
                links=list(specs),
                sensors={name: name for name in specs},
                runs=runs,
                road=straight_road(runs),
                step=step,
            ),
            mounts={
                name: np.tile([spec.mount.x, spec.mount.y, 0.0, 0.0], (runs, 1))
                for name, spec in specs.items()
            },
            data_sheets={
                name: {key: np.full(runs, getattr(spec, key)) for key in DATA_SHEETS[spec.kind]}
                for name, spec in specs.items()
            },
        )
    )
    assert localiser is not None
    rows: list[tuple[Floats, ...]] = []
    frozen: dict[str, Any] = {}
    shown = scene(context, [])
    for tick, state in enumerate(states):
        shown.tick, shown.time = tick, tick * step
        shown.ego[:] = state
        items = {name: sensor.sense(shown).copy() for name, sensor in sensors.items()}
        for index, (begin, end) in (blind or {}).items():
            name = ("gnss", "imu")[index]
            if begin <= tick < end:
                items[name].values[:] = np.nan
                items[name].stamp = frozen[name].copy()
            frozen[name] = items[name].stamp
        if unit is None:
            sample, stamp = np.zeros((runs, 3)), np.full(runs, tick * step)
        else:
            sample, stamp = items["imu"].values, items["imu"].stamp
        localiser.update(items["gnss"].values, items["gnss"].stamp, sample, stamp)
        rows.append(
            (
                localiser.stamp.copy(),
                localiser.estimate.copy(),
                np.sqrt(localiser.covariances[:, 1, 1]),
                localiser.rows[:, -1].copy(),
                localiser.states.copy(),
            )
        )
    return Estimated(*(np.array(column) for column in zip(*rows, strict=True)))
