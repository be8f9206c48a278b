"""Sensors that an FMU is: what it is told, what becomes of its detections, how it fails."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.errors import PluginError, SpecError
from adeye.signals import (
    DETECTION_HAS_RANGE_RATE,
    DETECTION_RANGE_RATE,
    DETECTION_X,
    DETECTION_Y,
    Measurement,
)
from adeye.simulate.sensors.fmu import wire_sensor
from adeye.simulate.sensors.rig import Rig
from adeye.spec.sensors import MOST_SENSED, FmuSensor
from tests.refusals import refused
from tests.simulate.bridges.fmus import SHIPPED, Var, build_fmu
from tests.simulate.sensors.scenes import CAR, RECORD, TRUCK, scene, scene_context
from tests.simulate.sensors.test_rig import rig_of

TOLD = {"there": "present", "x": "x", "y": "y", "vx": "vx", "vy": "vy"}

RADAR: dict[str, Any] = {
    "kind": "fmu",
    "file": "./short_radar.fmu",
    "rate": "20 Hz",
    "inputs": {
        "rain": "environment.rain",
        **{
            f"{name}{at}": f"objects.{at + 1}.{signal}"
            for at in range(4)
            for name, signal in TOLD.items()
        },
    },
    "detections": [
        {"present": f"found{at}", "x": f"rx{at}", "y": f"ry{at}", "range_rate": f"rate{at}"}
        for at in range(4)
    ],
    "start": {"noise": 0.0},
}
NOISY = {**RADAR, "start": {"noise": 0.5}, "seed": "seed"}


@contextmanager
def opened(rig: Rig) -> Iterator[Rig]:
    try:
        yield rig
    finally:
        rig.close()


def sense(
    record: Mapping[str, Any],
    objects: list[list[float]],
    *,
    ego: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0),
    runs: int = 1,
    ticks: int = 1,
    folder: Path = SHIPPED,
    **weather: Any,
) -> list[Measurement]:
    context = scene_context([CAR] * len(objects), runs=runs, **weather)
    suites = [{"eye": dict(record)}] * runs
    with opened(rig_of(context, *suites, folder=folder)) as rig:
        return [
            rig.sense(scene(context, objects, ego=ego, tick=tick))["eye"].copy()
            for tick in range(ticks)
        ]


def places(item: Measurement, run: int = 0) -> list[list[float]]:
    found: list[list[float]] = item.detections[run, item.mask[run]][:, :2].tolist()
    return found


def test_detections_are_packed_by_distance_with_the_object_behind_each() -> None:
    (item,) = sense(RADAR, [[60.0, 5.0], [20.0, -3.0], [90.0, 0.0], [30.0, 1.0]])
    assert places(item) == [[20.0, -3.0], [30.0, 1.0], [60.0, 5.0]]
    assert item.source[0].tolist() == [1, 3, 0, -1]
    assert (item.detections[0, 3] == 0.0).all()


@pytest.mark.parametrize("yaw", [0.0, 0.4, math.pi, -2.0])
def test_it_is_told_in_the_frame_of_the_sensor_and_answers_in_that(yaw: float) -> None:
    mount = {"x": 2.0, "y": -0.5, "yaw": yaw}
    mounted = {
        **RADAR,
        "mount": {k: f"{v} {'rad' if k == 'yaw' else 'm'}" for k, v in mount.items()},
    }
    pose, heading = np.array([100.0, 40.0]), 0.7
    ahead = np.array([math.cos(yaw), math.sin(yaw)])  # where it looks, in the vehicle frame
    place = np.array([2.0, -0.5]) + 30.0 * ahead
    turn = np.array(
        [[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]]
    )
    behind = np.array([2.0, -0.5]) - 30.0 * ahead
    things = [(pose + turn @ there).tolist() for there in (behind, place)]
    (item,) = sense(mounted, things, ego=(*pose, heading))
    assert places(item) == [pytest.approx(place.tolist(), abs=1e-9)]
    assert item.source[0, 0] == 1


def test_velocity_is_against_the_sensor() -> None:
    # The lead is overtaken at 5 m/s, on a road that points anywhere.
    heading = 0.9
    along = np.array([math.cos(heading), math.sin(heading)])
    thing = [*(30.0 * along), heading, 15.0]
    (item,) = sense(RADAR, [thing], ego=(0.0, 0.0, heading, 20.0))
    row = item.detections[0, 0]
    assert row[DETECTION_RANGE_RATE] == pytest.approx(-5.0, abs=1e-9)
    assert row[DETECTION_HAS_RANGE_RATE] == 1.0
    without = [{k: v for k, v in item.items() if k != "range_rate"} for item in RADAR["detections"]]
    (item,) = sense({**RADAR, "detections": without}, [thing])
    assert item.detections[0, 0, DETECTION_HAS_RANGE_RATE] == 0.0


def test_rain_that_it_is_told_of_shortens_its_range() -> None:
    near, far = [[20.0, 0.0], [60.0, 0.0]], [[20.0, 0.0]]
    assert places(sense(RADAR, near)[0]) == near
    assert places(sense(RADAR, near, rain=50e-3 / 3600)[0]) == far


def test_seed_is_another_one_in_each_run_and_the_same_in_each_repetition() -> None:
    first, second = (sense(NOISY, [[30.0, 0.0]], runs=2, ticks=3) for _ in range(2))
    seen = np.array([item.detections[:, 0, DETECTION_X] for item in first])
    assert np.array_equal(seen, [item.detections[:, 0, DETECTION_X] for item in second])
    assert len(np.unique(seen)) == seen.size
    assert np.abs(seen - 30.0).max() < 0.5 + 1e-9
    alone = sense(NOISY, [[30.0, 0.0]], ticks=3)
    assert [item.detections[0, 0, DETECTION_X] for item in alone] == seen[:, 0].tolist()


def test_latency_holds_a_sample_back_and_rate_makes_few() -> None:
    slow = {**RADAR, "rate": "10 Hz", "latency": "0.1 s"}
    items = sense(slow, [[30.0, 0.0]], ticks=5)
    assert [bool(item.mask.any()) for item in items] == [False, False, True, True, True]
    assert [float(item.stamp[0]) for item in items] == pytest.approx([-1, -1, 0, 0, 0.1])


def test_more_objects_than_it_can_be_told_of_are_the_farthest() -> None:
    # Sixteen inputs would be there; the FMU takes four: the nearest four.
    things = [[60.0 - 2.0 * at, 0.0] for at in range(MOST_SENSED + 4)]
    (item,) = sense(RADAR, things)
    assert item.source[0].tolist() == [19, 18, 17, 16]


def told(folder: Path, name: str, signal: str, unit: str = "") -> float:
    """Return the x of a detection that is what it is told by a signal."""
    variables = [Var("u", "input", unit=unit), Var("one", "output"), Var("out", "output")]
    build_fmu(folder, name, variables, "v[1] = 1; v[2] = v[0];", units={unit: ""} if unit else {})
    record = {
        "kind": "fmu",
        "file": f"./{name}.fmu",
        "rate": "20 Hz",
        "inputs": {"u": signal},
        "detections": [{"present": "one", "x": "out", "y": "one", "object": "one"}],
    }
    things = [[40.0, 0.0, 0.3, 7.0], [8.0, 1.0, 0.0, 0.0]]
    context = scene_context([TRUCK, CAR], kinds=["truck", "car"])
    with opened(rig_of(context, {"eye": record}, folder=folder)) as rig:
        ego = (0.0, 0.0, 0.0, 12.0, 1.5, 0.0, 0.1)
        item = rig.sense(scene(context, things, ego=ego))["eye"]
    assert item.source.tolist() == [[1]]
    return float(item.detections[0, 0, DETECTION_X])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("signal", "value"),
    [
        ("time", 0.0),
        ("ego.speed", 12.0),
        ("ego.acceleration", 1.5),
        ("ego.yaw_rate", 0.1),
        ("environment.fog_visibility", 1e9),
        ("objects.2.heading", 0.3),
        ("objects.2.length", TRUCK[0]),
        ("objects.2.width", TRUCK[1]),
        ("objects.2.height", TRUCK[2]),
        ("objects.2.class", 2.0),
        ("objects.3.present", 0.0),
    ],
)
def test_each_signal_says_what_it_says(tmp_path: Path, signal: str, value: float) -> None:
    assert told(tmp_path, "echo", signal) == pytest.approx(value, abs=1e-12)


def test_slots_are_of_one_number_in_a_batch_and_at_most_sixteen() -> None:
    def record(count: int) -> FmuSensor:
        one = RADAR["detections"][0]
        made: FmuSensor = RECORD.validate_python({**RADAR, "detections": [one] * count})
        return made

    assert record(3).slots == 3
    assert "slots" in FmuSensor.STRUCTURE
    for count in (0, MOST_SENSED + 1):
        with pytest.raises(ValueError, match="detections"):
            record(count)


def test_signal_that_is_not_there_is_refused_with_a_near_one() -> None:
    wrong = {**RADAR, "inputs": {"rain": "environment.rian"}}
    with pytest.raises(ValueError, match=r"no signal 'environment\.rian'.*environment\.rain"):
        RECORD.validate_python(wrong)


def test_unit_that_measures_something_else_is_refused() -> None:
    wrong = RECORD.validate_python({**RADAR, "inputs": {"rain": "objects.1.x"}})
    refused(SpecError, wire_sensor, wrong, SHIPPED, says="'rain' of the FMU has the unit 'm/s'")


@pytest.mark.parametrize(
    ("step", "says"),
    [
        ("v[2] = t > 0.01 ? NAN : 1;", "0.x nan (out) is no finite number"),
        ("if (t > 0.01) abort();", "killed: ended by SIGABRT"),
        ("v[3] = t > 0.01 ? -4 : 4;", "length of detection 1 is -4 m"),
        ("v[4] = t > 0.01 ? -1 : 1;", "width of detection 1 is -1 m"),
        ("v[5] = t > 0.01 ? 0.4 : 1;", "object of detection 1 is 0.4; it is told of 1"),
        ("v[5] = t > 0.01 ? 2 : 0;", "object of detection 1 is 2; it is told of 1"),
    ],
)
def test_fmu_that_fails_or_answers_nonsense_ends_the_campaign(
    tmp_path: Path, step: str, says: str
) -> None:
    outputs = ("one", "out", "length", "width", "object")
    variables = [Var("u", "input"), *(Var(name, "output") for name in outputs)]
    build_fmu(tmp_path, "bad", variables, f"v[1] = 1; {step}")
    own = {name: name for name in ("length", "width", "object")}
    record = {
        "kind": "fmu",
        "file": "./bad.fmu",
        "rate": "20 Hz",
        "inputs": {"u": "time"},
        "detections": [{"present": "one", "x": "out", "y": "one", **own}],
    }
    caught = refused(
        PluginError,
        lambda: sense(record, [[9.0, 0.0]], ticks=5, folder=tmp_path),
        says="sensors.eye: './bad.fmu' failed at 0.1 s: ",
    )
    assert says in str(caught)


def test_run_that_has_ended_is_asked_no_more() -> None:
    context = scene_context(runs=2)
    with opened(rig_of(context, {"eye": RADAR}, {"eye": RADAR}, folder=SHIPPED)) as rig:
        first = scene(context, [[30.0, 0.0]])
        assert rig.sense(first)["eye"].mask.any(axis=1).tolist() == [True, True]
        later = scene(context, [[30.0, 2.0]], tick=1)
        later.running[1] = False
        item = rig.sense(later)["eye"]
        assert item.mask.any(axis=1).tolist() == [True, False]
        assert item.detections[0, 0, DETECTION_Y] == 2.0
