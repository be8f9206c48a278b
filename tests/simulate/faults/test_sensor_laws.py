"""Laws that every fault of a sensor obeys, for every kind of sensor that can have it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.simulate.faults.sensor_faults import Pixels
from adeye.spec.fault import FAULT, MODELS, SensorFault, model_of
from adeye.spec.sensor_faults import SIGNALS, has_signal
from adeye.testing.sensors import moment
from adeye.units import Dimension
from tests.motorway import fault
from tests.simulate.faults.streams import (
    END,
    ONSET,
    RUNS,
    SENSORS,
    SIZELESS,
    STEP,
    SUITE,
    TICKS,
    made,
    played,
    same,
    streams,
    window,
)

SIZES = {
    Dimension.LENGTH: "0.7 m",
    Dimension.ANGLE: "2 deg",
    Dimension.SPEED: "3 m/s",
    Dimension.ACCELERATION: "0.5 m/s^2",
    Dimension.ANGULAR_RATE: "2 deg/s",
}
NO_SIZES = {
    Dimension.LENGTH: "0 m",
    Dimension.ANGLE: "0 deg",
    Dimension.SPEED: "0 m/s",
    Dimension.ACCELERATION: "0 m/s^2",
    Dimension.ANGULAR_RATE: "0 deg/s",
}
OF_SIGNALS: dict[str, dict[str, Any]] = {
    "bias": {},
    "scale": {"factor": 1.5},
    "drift": {"over": "1 s"},
    "noise": {},
    "quantise": {},
    "stuck_at": {},
    "spike": {"probability": 1.0},
    "bit_flip": {"bit": 51},
}
PLAIN: dict[str, dict[str, Any]] = {
    "drop_out": {},
    "power_loss": {"restart": "0.2 s"},
    "freeze": {},
    "stale": {},
    "stale_stamp": {},
    "clock_drift": {"offset": "-0.1 s"},
    "delay": {"by": "0.15 s", "jitter": "0.1 s"},
    "sample_loss": {"probability": 1.0},
    "jump": {"x": "2 m", "y": "-1 m"},
    "miss": {},
    "ghost": {"x": "15 m", "y": "1 m", "speed": "5 m/s"},
    "misclassify": {"taken_for": "building"},
    "split": {},
    "blind_sector": {"right": "-60 deg", "left": "60 deg"},
    "range_loss": {"factor": 0.1},
    "miscalibration": {"yaw": "3 deg", "x": "0.1 m", "y": "-0.2 m"},
}
NULL: dict[str, dict[str, Any]] = {
    "bias": {"size": "0"},
    "scale": {"factor": 1.0},
    "drift": {"size": "0", "over": "1 s"},
    "noise": {"size": "0"},
    "quantise": {"size": "0"},
    "spike": {"size": "0", "probability": 1.0},
    "clock_drift": {},
    "delay": {"by": "0 s"},
    "sample_loss": {},
    "jump": {},
    "miss": {"probability": 0.0},
    "misclassify": {"probability": 0.0, "taken_for": "car"},
    "split": {"probability": 0.0},
    "blind_sector": {"right": "10 deg", "left": "10 deg"},
    "range_loss": {"factor": 1.0},
    "miscalibration": {},
}
"""Of each model whose effect has a size, what has none."""

MEMORY = {"power_loss"}
LATER = {"drift"}
"""Models that do nothing to a sample made at the onset or before."""


def full(model: str, signal: str = "") -> dict[str, Any]:
    if model not in OF_SIGNALS:
        return PLAIN[model]
    size = SIZES[SIGNALS[signal].dimension]
    parameters = {"signal": signal, **OF_SIGNALS[model]}
    if model == "stuck_at":
        return {**parameters, "value": size}
    return parameters if model in ("scale", "bit_flip") else {**parameters, "size": size}


def null(model: str, signal: str = "") -> dict[str, Any]:
    parameters = dict(NULL[model])
    if signal:
        parameters["signal"] = signal
        if "size" in parameters:
            parameters["size"] = NO_SIZES[SIGNALS[signal].dimension]
    return parameters


def combinations() -> list[tuple[str, str, str]]:
    found = [
        (model, sensor, signal)
        for model in OF_SIGNALS
        for sensor in SENSORS
        for signal in SIGNALS
        if has_signal(signal, SUITE.sensors[sensor])
    ]
    for model, parameters in PLAIN.items():
        built: Any = FAULT.validate_python(fault("a", "sensors.a", model, **parameters))
        found += [
            (model, name, "") for name, spec in SUITE.sensors.items() if not built.misfits(spec)
        ]
    return found


EVERY = combinations()
FIRST = list(
    {(model, signal): item for item in reversed(EVERY) for model, _, signal in [item]}.values()
)
"""Of each model and signal one sensor, which is tried at every change."""


def by_model(items: list[tuple[str, str, str]]) -> pytest.MarkDecorator:
    """Try all of a model, those of ``FIRST`` always."""
    trials = []
    for model in dict.fromkeys(model for model, _, _ in items):
        own = [item for item in items if item[0] == model]
        trials.append(pytest.param([item for item in own if item in FIRST], id=model))
        rest = [item for item in own if item not in FIRST]
        trials.append(pytest.param(rest, id=f"{model} elsewhere", marks=pytest.mark.slow))
    return pytest.mark.parametrize("combinations", trials)


Combinations = list[tuple[str, str, str]]
every = by_model(EVERY)


def test_every_model_of_sensors_is_among_those_tested() -> None:
    models = {model_of(item) for item in MODELS if issubclass(item, SensorFault)}
    pixels = {"dead_pixels", "pixel_noise", "blackout"}
    assert models - pixels == {model for model, _, _ in EVERY}
    assert set(OF_SIGNALS) | set(PLAIN) == models - pixels


@every
def test_fault_acts_from_its_onset_to_its_end_and_in_its_runs_only(
    combinations: Combinations,
) -> None:
    for model, sensor, signal in combinations:
        pairs = played(made(model, sensor, full(model, signal)), sensor)
        for tick, (given, faulty) in enumerate(pairs):
            assert same(given, streams()[sensor][tick])
            assert same(given, faulty, 1)
            if tick < ONSET or (tick >= END and model not in MEMORY):
                assert faulty is given
        changed = [tick for tick, (given, faulty) in enumerate(pairs) if not same(given, faulty)]
        if is_without_size(model, sensor, signal):
            assert not changed
        elif model in LATER:
            assert changed[0] == first_made_after(ONSET, sensor)
        elif model == "freeze":
            assert changed[0] == first_unlike(ONSET - 1, sensor)
        else:
            assert changed[0] == ONSET


def is_without_size(model: str, sensor: str, signal: str) -> bool:
    """Whether it acts on a size that the sensor gives as 0, for unknown."""
    is_size = signal in ("length", "width") or model == "split"
    return is_size and sensor in SIZELESS and model in ("scale", "quantise", "split")


def first_made_after(tick: int, sensor: str) -> int:
    """The first tick with a sample that was made after a tick."""
    stamps = [item.stamp[0] for item in streams()[sensor]]
    return next(k for k, stamp in enumerate(stamps) if stamp > tick * STEP + 1e-9)


def first_unlike(tick: int, sensor: str) -> int:
    """The first tick after one whose sample says something else: an image may stay the same."""
    items = streams()[sensor]
    for later in range(tick + 1, TICKS):
        stamped = replace(items[tick], stamp=items[later].stamp, fresh=items[later].fresh)
        if not (same(stamped, items[later], 0) and same(stamped, items[later], 2)):
            return later
    raise AssertionError(sensor)


@pytest.mark.slow
@by_model([item for item in EVERY if item[0] in NULL])
def test_fault_of_no_size_changes_no_bit(combinations: Combinations) -> None:
    for model, sensor, signal in combinations:
        for given, faulty in played(made(model, sensor, null(model, signal)), sensor):
            assert same(given, faulty)


@every
def test_runs_do_not_know_of_each_other(combinations: Combinations) -> None:
    for model, sensor, signal in combinations:
        together = played(made(model, sensor, full(model, signal)), sensor)
        for run in range(RUNS):
            injector = made(model, sensor, full(model, signal), runs=[run])
            alone = played(injector, sensor, runs=[run])
            for (_, one), (_, other) in zip(together, alone, strict=True):
                assert same(one.map(lambda array, run=run: array[run : run + 1]), other)


@pytest.mark.slow
@pytest.mark.parametrize("sensor", list(SENSORS))
def test_never_present_is_the_very_same_object(sensor: str) -> None:
    for model, name, signal in EVERY:
        if name != sensor:
            continue
        quiet = played(
            made(model, sensor, full(model, signal)),
            sensor,
            lambda tick: window(tick, TICKS, TICKS),
        )
        assert all(faulty is given for given, faulty in quiet)


def test_pixel_faults_have_no_patches_where_they_are_not_present() -> None:
    for model, parameters in (
        ("dead_pixels", {"columns": 9, "rows": 7}),
        ("pixel_noise", {"columns": 9, "rows": 7, "noise": 0.1}),
        ("blackout", {}),
    ):
        injector = made(model, "pixel_camera", parameters)
        assert isinstance(injector, Pixels)
        assert injector.patches(moment(np.zeros(RUNS, dtype=np.bool_))) is None
        patches = injector.patches(moment(np.array([True, False, True])))
        assert patches is not None
        assert (patches[1] == 0.0).all()
        assert (patches[[0, 2]] != 0.0).any()
