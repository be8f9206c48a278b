"""Object-level camera, radar and lidar on hand-made scenes."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.simulate.sensors.ranging import (
    RangingSensor,
)
from tests.simulate.sensors.scenes import (
    CAR,
    TRUCK,
    places,
    scene,
    scene_context,
    seen,
    sensor_context,
    sensor_spec,
)

KINDS = ("camera", "lidar", "radar")


def spec(kind: str, **changes: Any) -> Any:
    return sensor_spec(kind, **({"field_of_view": "90 deg", "range": "100 m"} | changes))


def look(
    kind: str, context: signals.SceneContext, shown: signals.Scene, **changes: Any
) -> signals.Measurement:
    """Sample one scene with one new sensor."""
    return RangingSensor(sensor_context(spec(kind, **changes), context)).sense(shown)


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    return name


def test_car_ahead_is_reported_at_its_centre_with_its_size_wherever_the_ego_is(kind: str) -> None:
    context = scene_context([TRUCK], kinds=["truck"])
    turned = (100.0, 50.0, math.pi / 2.0, 0.0)
    for ego, place in (((0.0, 0.0, 0.0, 0.0), (40.0, 3.0)), (turned, (97.0, 90.0))):
        found = look(kind, context, scene(context, [(*place, ego[2])], ego=ego))
        assert seen(found)[0] == pytest.approx((40.0, 3.0))
        row = found.detections[0, 0]
        size = (row[signals.DETECTION_LENGTH], row[signals.DETECTION_WIDTH])
        assert (*size, row[signals.DETECTION_CLASS]) == (10.0, 2.5, 2.0)
        assert row[signals.DETECTION_HAS_RANGE_RATE] == (kind == "radar")


def test_range_is_from_the_mount_to_the_nearest_point_of_the_body(kind: str) -> None:
    context = scene_context()
    # The lidar's reference is the reflectivity of the car, so that its range is the nominal one.
    changes = {"reference_reflectivity": 0.5} if kind == "lidar" else {}
    for mount in (-1.0, 0.0, 1.0):
        for away, is_seen in ((-0.01, True), (0.01, False)):
            shown = scene(context, [(mount + 100.0 + 0.5 * CAR[0] + away, 0.0)])
            found = seen(look(kind, context, shown, **changes, mount={"x": f"{mount} m"}))
            assert list(found) == [0] * is_seen, (mount, away)


@pytest.mark.parametrize("yaw", [0.0, 20.0, -20.0, 180.0])
def test_field_of_view_ends_where_half_of_the_object_is_outside(yaw: float, kind: str) -> None:
    context = scene_context([(1e-3, 2.0, 1.0)])
    distance = 30.0
    # A plate facing the sensor: its extent is symmetric about its centre's bearing.
    for degrees, inside in ((44.9, True), (45.1, False), (-44.9, True), (-45.1, False)):
        bearing = math.radians(yaw + degrees)
        plate = (distance * math.cos(bearing), distance * math.sin(bearing), bearing)
        found = look(kind, context, scene(context, [plate]), mount={"yaw": f"{yaw} deg"})
        assert bool(seen(found)) is inside, (yaw, degrees)


def test_full_circle_sees_behind(kind: str) -> None:
    context = scene_context()
    shown = scene(context, [(-30.0, 0.0)])
    assert not seen(look(kind, context, shown))
    assert seen(look(kind, context, shown, field_of_view="360 deg"))


def test_detections_are_packed_from_near_to_far(kind: str) -> None:
    context = scene_context([CAR] * 4)
    shown = scene(context, [(60.0, 10.0), (20.0, -8.0), (-40.0, 0.0), (40.0, 0.0)])
    found = look(kind, context, shown)
    assert found.source[0].tolist() == [1, 3, 0, -1]
    assert found.mask[0].tolist() == [True, True, True, False]


# --- occlusion ------------------------------------------------------------------------------------

STEP = 0.05
SIDEWAYS = 1.5
"""Speed at which the cutter comes out from behind the truck [m/s]."""
CORNER = (20.0, 1.25)
"""Corner of the truck that bounds its shadow, seen from the camera at the origin."""


def first_tick(min_visible: float) -> int:
    """Drive the cutter out from behind the truck; return the tick of its first report."""
    context = scene_context([TRUCK, CAR])
    camera = RangingSensor(sensor_context(spec("camera", min_visible=min_visible), context))
    for tick in range(200):
        cutter = (42.25, SIDEWAYS * STEP * tick)
        found = seen(camera.sense(scene(context, [(25.0, 0.0), cutter], tick=tick)))
        assert 0 in found, "the truck hides nothing of itself"
        if 1 in found:
            return tick
    raise AssertionError("never seen")


@pytest.mark.parametrize("least", [1e-9, 0.5, 1.0])
def test_camera_reports_the_cutter_once_enough_is_out_of_the_shadow(least: float) -> None:
    def share(tick: int) -> float:
        y = SIDEWAYS * STEP * tick
        left = math.atan2(y + 0.9, 40.0)
        right = math.atan2(y - 0.9, 44.5 if y > 0.9 else 40.0)
        return (left - max(right, math.atan2(CORNER[1], CORNER[0]))) / (left - right)

    tick = first_tick(least)
    assert share(tick) >= least > share(tick - 1)


def test_a_truck_beyond_the_cutter_hides_nothing_of_it() -> None:
    context = scene_context([TRUCK, CAR])
    found = seen(look("camera", context, scene(context, [(60.0, 4.0), (30.0, 0.0)])))
    assert set(found) == {0, 1}


# --- noise ----------------------------------------------------------------------------------------

RUNS = 4000


def spread(kind: str, distance: float, **noise: Any) -> tuple[Any, Any, Any]:
    """Distances, bearings and range rates of one car in many runs."""
    context = scene_context(runs=RUNS)
    found = look(kind, context, scene(context, [(distance, 0.0)]), **noise)
    x, y = places(found, 0).T
    return np.hypot(x, y), np.arctan2(y, x), found.detections[:, 0, signals.DETECTION_RANGE_RATE]


def assert_normal(values: Any, mean: float, sigma: float) -> None:
    """Mean, standard deviation and correlation with the run within four standard errors."""
    assert values.mean() == pytest.approx(mean, abs=4.0 * sigma / math.sqrt(RUNS))
    assert values.std() == pytest.approx(sigma, rel=4.0 / math.sqrt(2.0 * RUNS))
    assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 4.0 / math.sqrt(RUNS)


NOISE = {"range_noise": "0.3 m", "bearing_noise": "0.2 deg", "range_rate_noise": "0.1 m/s"}


def test_radar_noise_has_the_stated_deviations() -> None:
    distance, bearing, rate = spread("radar", 50.0, **NOISE)
    assert_normal(distance, 50.0, 0.3)
    assert_normal(bearing, 0.0, math.radians(0.2))
    assert_normal(rate, 0.0, 0.1)
    for one, other in itertools.combinations((distance, bearing, rate), 2):
        assert abs(np.corrcoef(one, other)[0, 1]) < 4.0 / math.sqrt(RUNS)


def test_noise_of_what_is_near_keeps_mean_and_deviation() -> None:
    context = scene_context([(0.2, 0.2, 1.0)], runs=RUNS)
    for kind in ("radar", "lidar"):
        at = places(look(kind, context, scene(context, [(0.4, 0.0)]), range_noise="0.5 m"), 0)
        assert_normal(at[:, 0], 0.4, 0.5)


def test_camera_distance_error_grows_with_the_distance_squared() -> None:
    noise: dict[str, Any] = {"distance_noise": 0.02, "bearing_noise": "0.1 deg"}
    for distance in (25.0, 50.0):
        measured, bearing, _ = spread("camera", distance, **noise)
        assert_normal(measured, distance, 0.02 * distance**2 / 100.0)
        assert_normal(bearing, 0.0, math.radians(0.1))


def measured_over_time(context: signals.SceneContext, shown: Any, name: str = "front") -> list[Any]:
    sensor = RangingSensor(sensor_context(spec("radar", **NOISE), context, name=name))
    return [places(sensor.sense(shown(tick)), 0).tolist() for tick in range(5)]


def test_another_object_leaves_the_noise_of_the_first_as_it_was() -> None:
    one, two = scene_context([CAR], runs=3), scene_context([CAR, CAR], runs=3)
    alone = measured_over_time(one, lambda tick: scene(one, [(50.0, 0.0)], tick=tick))
    # The other one is nearer, so it comes before the first in the list.
    both = measured_over_time(two, lambda tick: scene(two, [(50.0, 0.0), (30.0, 9.0)], tick=tick))
    assert alone == both


def test_every_sample_object_run_and_sensor_has_a_noise_of_its_own() -> None:
    context = scene_context([CAR, CAR], runs=2)
    shown = scene(context, [(50.0, 0.0), (50.0, 9.0)])
    drawn: list[float] = []
    for name in ("front", "rear"):
        sensor = RangingSensor(sensor_context(spec("radar", **NOISE), context, name=name))
        for tick in range(3):
            shown.tick = tick
            found = sensor.sense(shown)
            for thing, true in ((0, 50.0), (1, math.hypot(50.0, 9.0))):
                at = places(found, thing)
                drawn += (np.hypot(at[:, 0], at[:, 1]) - true).tolist()
    assert len(set(drawn)) == len(drawn) == 2 * 3 * 2 * 2
