"""The physical camera as a whole: range, weather, dead pixels, agreement with the object level."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.simulate.sensors.camera import PhysicalCameraSensor
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.simulate.sensors.rig import BUILT_IN, Rig
from adeye.simulate.world.weather import MM_PER_HOUR
from adeye.spec.sensors import Camera
from adeye.testing import check_sensor
from tests.simulate.sensors.pictures import CONDITIONS, PERSON, camera, condition, focal, look, spec
from tests.simulate.sensors.scenes import (
    CAR,
    TRUCK,
    architecture,
    scene,
    scene_context,
    seen,
    sensor_context,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.signals import Measurement, SceneContext
    from adeye.sweep.case import TestCase

NOISY = {
    "noise": 0.03,
    "patches": {"dirt": {"column": 60, "row": 20, "columns": 30, "rows": 25, "noise": 0.1}},
}


def reach(context: Any, sensor: Any, length: float, *, step: float = 0.25) -> float:
    """Distance up to which the first object straight ahead is detected without a gap [m]."""
    distance = 3.0
    while seen(sensor.sense(scene(context, [(distance + 0.5 * length, 0.0)]))):
        distance += step
    return distance


def with_weather(context: "SceneContext", weather: "Mapping[str, float]") -> "SceneContext":
    """Return the context with other conditions, the same in every run."""
    columns = {name: np.full(context.runs, value) for name, value in weather.items()}
    return replace(context, surroundings=replace(context.surroundings, **columns))


@pytest.mark.parametrize("changes", [{}, NOISY, {"mount": {"yaw": "20 deg", "pitch": "2 deg"}}])
def test_camera_conforms(changes: dict[str, Any]) -> None:
    record = spec(**changes)
    check_sensor(BUILT_IN["camera/physical"], record)
    check_sensor(BUILT_IN["camera/physical"], record, every=1, latency=0)


@pytest.mark.parametrize("least", [2, 6, 12])
def test_range_by_day_is_where_the_object_fills_the_rows(least: int) -> None:
    context = scene_context()
    sensor = camera(context, min_pixel_height=least, columns=320, rows=120)
    scale = focal(spec(columns=320)) * CAR[2]
    found = reach(context, sensor, CAR[0])
    # A height between n - 1 and n + 1 pixels may fill n rows.
    assert scale / (least + 1.0) <= found <= scale / (least - 1.0) + 0.25


WEATHER: list[dict[str, Any]] = [
    {},
    {"rain": 7.5 * MM_PER_HOUR},
    {"rain": 60.0 * MM_PER_HOUR},
    {"fog_visibility": 400.0},
    {"fog_visibility": 150.0},
]


@pytest.mark.parametrize("weather", WEATHER)
def test_both_fidelities_reach_equally_far(weather: dict[str, Any]) -> None:
    context = scene_context(**weather)
    least = 16
    fine = camera(context, columns=1024, rows=256, min_pixel_height=least)
    scale = focal(spec(columns=1024)) * CAR[2]
    record = Camera.model_validate(
        {
            "kind": "camera",
            "mount": {"x": "0 m"},
            "field_of_view": "50 deg",
            "range": f"{scale / least} m",
            "rate": "20 Hz",
        }
    )
    coarse = RangingSensor(sensor_context(record, context))
    expected = reach(context, coarse, CAR[0], step=0.05)
    # One and a half of 16 rows: the phase of the edges and the rounding.
    assert reach(context, fine, CAR[0]) == pytest.approx(expected, rel=1.5 / 16.0)


def test_fog_and_night_shorten_the_reach_by_much_more_than_that() -> None:
    clear = reach(scene_context(), camera(scene_context()), CAR[0])
    for weather in ({"fog_visibility": 150.0}, {"illuminance": 0.1}):
        context = with_weather(scene_context(kinds=["parked_car"]), weather)
        assert reach(context, camera(context), CAR[0]) < 0.7 * clear


def test_car_with_lamps_is_seen_further_at_night_than_a_parked_one() -> None:
    night = {"illuminance": 0.1}
    driving, parked = (
        with_weather(scene_context(kinds=[kind]), night) for kind in ("car", "parked_car")
    )
    far, near = (reach(context, camera(context), CAR[0]) for context in (driving, parked))
    assert near < 0.7 * far
    assert far < reach(scene_context(), camera(scene_context()), CAR[0])


def test_pedestrian_at_night_is_detected_where_size_and_light_are_enough() -> None:
    context = scene_context([PERSON], kinds=["pedestrian"], illuminance=0.1)
    # Fine pixels: the light decides, 5 lx at 63.9 m. Coarse: fewer rows must be the brighter.
    fine = reach(context, camera(context, columns=1024, rows=256), PERSON[0])
    coarse = reach(context, camera(context), PERSON[0])
    assert fine == pytest.approx(math.sqrt(20_000.0 / 4.9), abs=0.5)
    assert 35.0 < coarse < 60.0
    # Rows times the share of contrast that is left, less the rounding.
    left = focal(spec()) * PERSON[2] / coarse / math.sqrt(1.0 + 120.0 / (0.1 + 2e4 / coarse**2))
    assert left == pytest.approx(1.5, abs=0.5)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(CONDITIONS),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(8.0, 100.0),
)
def test_what_is_detected_in_worse_conditions_is_so_in_better_ones(
    name: str, one: float, other: float, distance: float
) -> None:
    worse, better = sorted((one, other))
    found = []
    for share in (worse, better):
        value = {name: condition(name, share)}
        lens, weather = (value, {}) if name == "transmission" else ({}, value)
        context = with_weather(scene_context([CAR]), weather)
        found.append(bool(seen(look(context, scene(context, [(distance, 1.0)]), **lens))))
    assert found[1] or not found[0]


def test_dead_columns_lose_the_object_on_them_until_it_moves_off() -> None:
    context = scene_context()
    dead = {"dead": {"column": 70, "columns": 20, "rows": 60}}
    sensor = camera(context, patches=dead)
    detected = [
        bool(seen(sensor.sense(scene(context, [(40.0, y)], tick=tick))))
        for tick, y in enumerate(np.arange(0.0, 6.0, 0.5))
    ]
    # The middle of the first live column is 10.5 columns aside; the left edge of the car is at y +
    # 0.9 m, 37.75 m ahead.
    live = 10.5 * 37.75 / focal(spec())
    assert detected == [bool(y + 0.9 > live) for y in np.arange(0.0, 6.0, 0.5)]
    assert not any(detected[:3])


def test_blackout_detects_nothing_and_stays_alive() -> None:
    context = scene_context()
    found = look(context, scene(context, [(20.0, 0.0)]), transmission=0.0)
    assert not found.mask.any()
    assert found.alive.all()


def test_run_that_has_ended_detects_nothing() -> None:
    context = scene_context(runs=2)
    shown = scene(context, [(20.0, 0.0)])
    shown.running[0] = False
    assert look(context, shown).mask.any(axis=1).tolist() == [False, True]


def test_values_differ_from_run_to_run_of_a_batch() -> None:
    context = scene_context(runs=3)
    weather = replace(context.surroundings, fog_visibility=np.array([1e9, 20.0, 1e9]))
    context = replace(context, surroundings=weather)
    specs = [spec(), spec(), spec(transmission=0.0)]
    sensor = PhysicalCameraSensor(replace(sensor_context(specs[0], context), specs=specs))
    found = sensor.sense(scene(context, [(30.0, 0.0)]))
    assert found.mask.any(axis=1).tolist() == [True, False, False]


def played(sensors: dict[str, Any]) -> "list[dict[str, Measurement]]":
    context = scene_context([CAR, TRUCK, PERSON], kinds=["car", "truck", "pedestrian"], runs=2)
    cases = [SimpleNamespace(architecture=architecture(sensors))] * 2
    rig = Rig(cast("list[TestCase]", cases), context, Path())
    places = [(20.0, 1.0), (50.0, -3.0), (15.0, 4.0)]
    return [rig.sense(scene(context, places, tick=tick)) for tick in range(4)]


def test_second_camera_leaves_every_bit_of_the_first() -> None:
    record = {
        "kind": "camera",
        "fidelity": "physical",
        "mount": {"z": "1.3 m"},
        "field_of_view": "50 deg",
        "rate": "20 Hz",
        **NOISY,
    }
    alone = played({"front": record})
    both = played({"another": record | {"rate": "10 Hz"}, "front": record})
    for one, other in zip(alone, both, strict=True):
        for name in ("mask", "detections", "source", "stamp"):
            assert np.array_equal(getattr(one["front"], name), getattr(other["front"], name))
    differs = not np.array_equal(both[0]["another"].detections, both[0]["front"].detections)
    assert differs, "two cameras share their noise"


def test_broken_camera_sees_ghosts_where_there_is_no_object_at_all() -> None:
    context = scene_context([])
    found = look(context, scene(context, []), noise=0.03)
    assert found.mask.any()
    assert not look(context, scene(context, [])).mask.any()


@pytest.mark.slow
def test_detections_lie_where_their_objects_do() -> None:
    draw = np.random.default_rng(8)
    context = scene_context([CAR, TRUCK, PERSON], kinds=["car", "truck", "pedestrian"])
    errors = []
    for _ in range(200):
        things = [(draw.uniform(-20.0, 60.0), draw.uniform(-9.0, 9.0)) for _ in range(3)]
        mount = {"pitch": f"{draw.uniform(-3.0, 3.0)} deg"}
        sensor = camera(context, columns=640, rows=320, mount=mount)
        shown = scene(context, things)
        frame, found = sensor.frame(shown), sensor.sense(shown)
        for thing, (x, y) in seen(found).items():
            if thing >= 0:
                assert (frame.visible & (frame.objects == thing)).any()
                errors.append(math.hypot(x - things[thing][0], y - things[thing][1]))
    assert len(errors) > 250
    # What the side of the image cuts errs by half of its length; 12 m is that of the class.
    assert np.median(errors) < 1.0
    assert np.quantile(errors, 0.95) < 0.5 * 12.0
