"""The physical camera as a whole: range, weather, dead pixels, agreement with the object level."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.simulate.sensors.ranging import RangingSensor
from adeye.simulate.world.weather import MM_PER_HOUR
from tests.simulate.sensors.pictures import PERSON, camera, focal, look, spec
from tests.simulate.sensors.scenes import (
    CAR,
    TRUCK,
    scene,
    scene_context,
    seen,
    sensor_context,
    sensor_spec,
)


def reach(context: Any, sensor: Any, length: float, *, step: float = 0.25) -> float:
    """Distance up to which the first object straight ahead is detected without a gap [m]."""
    distance = 3.0
    while seen(sensor.sense(scene(context, [(distance + 0.5 * length, 0.0)]))):
        distance += step
    return distance


def reach_in(weather: dict[str, Any], kind: str = "car") -> float:
    """Distance up to which a physical camera detects a car of a kind in some weather [m]."""
    context = scene_context(kinds=[kind], **weather)
    return reach(context, camera(context), CAR[0])


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
    record = sensor_spec("camera", field_of_view="50 deg", range=f"{scale / least} m")
    coarse = RangingSensor(sensor_context(record, context))
    expected = reach(context, coarse, CAR[0], step=0.05)
    # One and a half of 16 rows: the phase of the edges and the rounding.
    assert reach(context, fine, CAR[0]) == pytest.approx(expected, rel=1.5 / 16.0)


def test_fog_and_night_shorten_the_reach_by_much_more_than_that_and_lamps_lengthen_it() -> None:
    clear, night = reach_in({}), {"illuminance": 0.1}
    parked = reach_in(night, "parked_car")
    assert reach_in({"fog_visibility": 150.0}, "parked_car") < 0.7 * clear
    assert parked < 0.7 * clear
    assert parked < 0.7 * reach_in(night) < 0.7 * clear


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


def test_broken_camera_sees_ghosts_where_there_is_no_object_at_all() -> None:
    context = scene_context([])
    found = look(context, scene(context, []), noise=0.03)
    assert found.mask.any()
    assert not look(context, scene(context, [])).mask.any()
    blind = look(scene_context(), scene(scene_context(), [(20.0, 0.0)]), transmission=0.0)
    assert not blind.mask.any()
    assert blind.alive.all()


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
