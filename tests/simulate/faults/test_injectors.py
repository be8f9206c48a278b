from typing import Any

import numpy as np

from adeye.signals import OK, SILENT, ControlCommand, Measurement
from adeye.testing.sensors import injector, moment

FIRST = np.array([True, False])
NONE = np.zeros(2, dtype=np.bool_)
TARGETS = {"drop_out": "sensors.front", "silent": "channels.nominal"}


def made(model: str) -> Any:
    return injector(model, TARGETS[model], runs=2)


def measurement(time: float) -> Measurement:
    return Measurement(
        np.full(2, time),
        np.ones(2, dtype=np.bool_),
        np.ones(2, dtype=np.bool_),
        np.ones((2, 3), dtype=np.bool_),
        np.full((2, 3, 7), time),
        np.ones((2, 3), dtype=np.int64),
        np.full((2, 13), time),
    )


def command(time: float) -> ControlCommand:
    return ControlCommand(
        "nominal",
        np.full(2, time),
        np.full(2, -time),
        np.full(2, time),
        np.full(2, OK, dtype=np.int64),
    )


def test_inactive_drop_out_is_the_very_same_measurement() -> None:
    given = measurement(1.0)
    assert made("drop_out").apply(given, moment(NONE)) is given


def test_dropped_out_sensor_keeps_its_last_sample_but_shows_nothing() -> None:
    fault = made("drop_out")
    fault.apply(measurement(1.0), moment(NONE))
    given = measurement(1.1)
    faulty = fault.apply(given, moment(FIRST))
    assert faulty.alive.tolist() == [False, True]
    assert faulty.fresh.tolist() == [False, True]
    assert faulty.stamp.tolist() == [1.0, 1.1]
    assert faulty.mask.sum(axis=1).tolist() == [0, 3]
    assert faulty.source[0].tolist() == [-1, -1, -1]
    assert faulty.estimate is not None
    assert faulty.estimate[:, 0].tolist() == [1.0, 1.1]
    assert given.alive.all()
    assert given.stamp.tolist() == [1.1, 1.1]


def test_dropped_out_receiver_has_no_values_and_leaves_those_of_other_runs() -> None:
    fault = made("drop_out")
    given = measurement(1.1)
    given.values = np.ones((2, 4))
    faulty = fault.apply(given, moment(FIRST))
    assert faulty.values is not None
    assert np.isnan(faulty.values).tolist() == [[True] * 4, [False] * 4]
    assert (given.values == 1.0).all()


def test_stamp_stands_for_the_whole_drop_out_and_runs_on_after_it() -> None:
    fault = made("drop_out")
    fault.apply(measurement(1.0), moment(NONE))
    stamps = [fault.apply(measurement(1.0 + 0.1 * k), moment(FIRST)).stamp[0] for k in range(1, 4)]
    assert stamps == [1.0, 1.0, 1.0]
    after = measurement(1.5)
    assert fault.apply(after, moment(NONE)) is after


def test_run_that_drops_out_later_keeps_its_own_last_sample() -> None:
    fault = made("drop_out")
    fault.apply(measurement(1.0), moment(FIRST))
    fault.apply(measurement(2.0), moment(FIRST))
    assert fault.apply(measurement(3.0), moment(~FIRST)).stamp.tolist() == [3.0, 2.0]


def test_sensor_dead_from_the_start_never_delivers() -> None:
    faulty = made("drop_out").apply(measurement(0.0), moment(FIRST))
    assert faulty.stamp.tolist() == [-1.0, 0.0]


def test_inactive_silence_is_the_very_same_command() -> None:
    given = command(1.0)
    assert made("silent").apply(given, moment(NONE)) is given


def test_silent_channel_says_nothing_new() -> None:
    fault = made("silent")
    fault.apply(command(1.0), moment(NONE))
    given = command(1.1)
    for _ in range(3):
        faulty = fault.apply(given, moment(FIRST))
        assert faulty.status.tolist() == [SILENT, OK]
        assert faulty.stamp.tolist() == [1.0, 1.1]
        assert faulty.acceleration.tolist() == [1.0, 1.1]
    assert given.status.tolist() == [OK, OK]


def test_channel_silent_from_the_start_has_no_command() -> None:
    faulty = made("silent").apply(command(1.0), moment(FIRST))
    assert faulty.stamp.tolist() == [-1.0, 1.0]
    assert faulty.acceleration.tolist() == [0.0, 1.0]
