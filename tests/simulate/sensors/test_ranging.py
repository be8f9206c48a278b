"""Object-level camera, radar and lidar on hand-made scenes."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.delivery import sample_at
from adeye.kernel.random import normal_pair
from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    DETECTION_WIDTH,
    ILLUMINANCE,
    Measurement,
    Scene,
    SceneContext,
    parameter_record,
)
from adeye.simulate.sensors.ranging import (
    BLOCK,
    CAMERA,
    DRAWS,
    LIDAR,
    RADAR,
    SEEN_RATE,
    RangingSensor,
    Seen,
    measure,
    memory_for,
    note,
    write,
)
from adeye.simulate.sensors.sampling import Found, Truth
from adeye.simulate.world.weather import MM_PER_HOUR, camera_range, lidar_range
from adeye.spec.sensors import Camera, Lidar, Radar
from tests.simulate.sensors.scenes import (
    CAR,
    TRUCK,
    places,
    scene,
    scene_context,
    seen,
    sensor_context,
)

KINDS: dict[str, Any] = {"camera": Camera, "radar": Radar, "lidar": Lidar}


def spec(kind: str, **changes: Any) -> Any:
    fields: dict[str, Any] = {
        "kind": kind,
        "mount": {"x": "0 m"},
        "field_of_view": "90 deg",
        "range": "100 m",
        "rate": "20 Hz",
    }
    return KINDS[kind].model_validate({**fields, **changes})


def look(kind: str, context: SceneContext, shown: Scene, **changes: Any) -> Measurement:
    """Sample one scene with one new sensor."""
    return RangingSensor(sensor_context(spec(kind, **changes), context)).sense(shown)


@pytest.fixture(params=sorted(KINDS))
def kind(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    return name


def test_car_ahead_is_reported_at_its_centre_with_its_size(kind: str) -> None:
    context = scene_context([TRUCK], kinds=["truck"])
    found = look(kind, context, scene(context, [(40.0, 3.0)]))
    assert seen(found)[0] == pytest.approx((40.0, 3.0))
    row = found.detections[0, 0]
    assert (row[DETECTION_LENGTH], row[DETECTION_WIDTH], row[DETECTION_CLASS]) == (10.0, 2.5, 2.0)
    assert row[DETECTION_HAS_RANGE_RATE] == (kind == "radar")


def test_place_is_in_the_vehicle_frame_wherever_the_ego_is(kind: str) -> None:
    context = scene_context()
    ego = (100.0, 50.0, math.pi / 2.0, 0.0)
    found = look(kind, context, scene(context, [(97.0, 70.0)], ego=ego))
    assert seen(found)[0] == pytest.approx((20.0, 3.0))


def test_range_is_to_the_nearest_point_of_the_body(kind: str) -> None:
    context = scene_context()
    # The lidar's reference is the reflectivity of the car, so that its range is the nominal one.
    changes = {"reference_reflectivity": 0.5} if kind == "lidar" else {}
    nose = 0.5 * CAR[0]
    near = look(kind, context, scene(context, [(100.0 + nose - 0.01, 0.0)]), **changes)
    far = look(kind, context, scene(context, [(100.0 + nose + 0.01, 0.0)]), **changes)
    assert (list(seen(near)), list(seen(far))) == ([0], [])


def test_range_counts_from_the_mount(kind: str) -> None:
    context = scene_context()
    changes = {"reference_reflectivity": 0.5} if kind == "lidar" else {}
    shown = scene(context, [(103.0, 0.0)])
    assert not seen(look(kind, context, shown, **changes, mount={"x": "-1 m"}))
    assert seen(look(kind, context, shown, **changes, mount={"x": "1 m"}))


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


# --- weather --------------------------------------------------------------------------------------


def first_lost(kind: str, context: SceneContext, **changes: Any) -> float:
    """Distance of the nearest point from which on a car straight ahead is not reported [m]."""
    low, high = 1.0, 400.0
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        shown = scene(context, [(middle + 0.5 * CAR[0], 0.0)])
        low, high = (middle, high) if seen(look(kind, context, shown, **changes)) else (low, middle)
    return low


def test_lidar_reaches_as_far_as_the_rain_formula_says() -> None:
    rain = 7.5 * MM_PER_HOUR
    context = scene_context(rain=rain, fog_visibility=10_000.0)
    reach = first_lost("lidar", context, range="150 m", reference_reflectivity=0.9)
    assert reach == pytest.approx(lidar_range(150.0, 0.5, 0.9, rain, 10_000.0), abs=1e-5)
    assert reach < 45.0


def test_camera_reaches_as_far_as_the_rain_formula_says() -> None:
    rain = 7.5 * MM_PER_HOUR
    context = scene_context(rain=rain, fog_visibility=10_000.0)
    reach = first_lost("camera", context)
    assert reach == pytest.approx(camera_range(100.0, rain, 10_000.0, 1.0), abs=1e-5)
    assert reach < 100.0


def test_camera_loses_its_share_of_range_at_night() -> None:
    by_night = scene_context(night=True, illuminance=ILLUMINANCE["night"])
    assert first_lost("camera", by_night, night_range=0.5) == pytest.approx(50.0, abs=1e-4)
    assert first_lost("radar", by_night) == pytest.approx(100.0, abs=1e-4)


def test_rain_leaves_the_radar_alone() -> None:
    context = scene_context(rain=40.0 * MM_PER_HOUR)
    assert first_lost("radar", context) == pytest.approx(100.0, abs=1e-4)


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


def test_camera_reports_the_cutter_once_its_left_edge_leaves_the_trucks_shadow() -> None:
    # Its near left corner (40, y + 0.9) crosses the line through the truck's corner.
    y = 40.0 * CORNER[1] / CORNER[0] - 0.9
    assert first_tick(1e-9) == math.ceil(y / (SIDEWAYS * STEP))


def test_camera_that_wants_all_of_the_cutter_waits_for_its_far_right_corner() -> None:
    y = 44.5 * CORNER[1] / CORNER[0] + 0.9
    assert first_tick(1.0) == math.ceil(y / (SIDEWAYS * STEP))


def test_camera_that_wants_half_of_the_cutter_waits_for_half_of_its_angle() -> None:
    def share(y: float) -> float:
        left = math.atan2(y + 0.9, 40.0)
        right = math.atan2(y - 0.9, 44.5 if y > 0.9 else 40.0)
        return (left - max(right, math.atan2(CORNER[1], CORNER[0]))) / (left - right)

    tick = first_tick(0.5)
    assert share(SIDEWAYS * STEP * tick) >= 0.5 > share(SIDEWAYS * STEP * (tick - 1))


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
    at = places(found, 0)
    return (
        np.hypot(at[:, 0], at[:, 1]),
        np.arctan2(at[:, 1], at[:, 0]),
        found.detections[:, 0, DETECTION_RANGE_RATE],
    )


def assert_normal(values: Any, mean: float, sigma: float) -> None:
    """Mean, standard deviation and correlation with the run within four standard errors."""
    assert values.mean() == pytest.approx(mean, abs=4.0 * sigma / math.sqrt(RUNS))
    assert values.std() == pytest.approx(sigma, rel=4.0 / math.sqrt(2.0 * RUNS))
    assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 4.0 / math.sqrt(RUNS)


def test_radar_noise_has_the_stated_deviations() -> None:
    distance, bearing, rate = spread(
        "radar", 50.0, range_noise="0.3 m", bearing_noise="0.2 deg", range_rate_noise="0.1 m/s"
    )
    assert_normal(distance, 50.0, 0.3)
    assert_normal(bearing, 0.0, math.radians(0.2))
    assert_normal(rate, 0.0, 0.1)
    for one, other in ((distance, bearing), (distance, rate), (bearing, rate)):
        assert abs(np.corrcoef(one, other)[0, 1]) < 4.0 / math.sqrt(RUNS)


def test_noise_of_what_is_near_keeps_mean_and_deviation() -> None:
    context = scene_context([(0.2, 0.2, 1.0)], runs=RUNS)
    for kind in ("radar", "lidar"):
        at = places(look(kind, context, scene(context, [(0.4, 0.0)]), range_noise="0.5 m"), 0)
        assert_normal(at[:, 0], 0.4, 0.5)


def test_camera_distance_error_grows_with_the_distance_squared() -> None:
    for distance in (25.0, 50.0):
        measured, bearing, _ = spread(
            "camera", distance, distance_noise=0.02, bearing_noise="0.1 deg"
        )
        assert_normal(measured, distance, 0.02 * distance**2 / 100.0)
        assert_normal(bearing, 0.0, math.radians(0.1))


def test_without_noise_every_run_measures_the_truth(kind: str) -> None:
    distance, bearing, rate = spread(kind, 50.0)
    assert np.ptp(distance) == np.ptp(bearing) == np.ptp(rate) == 0.0


NOISE = {"range_noise": "0.3 m", "bearing_noise": "0.2 deg", "range_rate_noise": "0.1 m/s"}


def measured_over_time(context: SceneContext, shown: Any, name: str = "front") -> list[Any]:
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


# --- range rate and latency -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("target", "ego", "rate"),
    [(30.0, 20.0, 10.0), (20.0, 30.0, -10.0), (0.0, 25.0, -25.0), (25.0, 25.0, 0.0)],
)
def test_range_rate_is_negative_when_the_ego_closes_in(
    target: float, ego: float, rate: float
) -> None:
    context = scene_context()
    shown = scene(context, [(50.0, 0.0, 0.0, target)], ego=(0.0, 0.0, 0.0, ego))
    found = look("radar", context, shown)
    assert found.detections[0, 0, DETECTION_RANGE_RATE] == pytest.approx(rate)


def test_range_rate_is_along_the_line_of_sight() -> None:
    context = scene_context()
    across = scene(context, [(50.0, 0.0, math.pi / 2.0, 10.0)])
    assert look("radar", context, across).detections[0, 0, DETECTION_RANGE_RATE] == pytest.approx(
        0.0, abs=1e-12
    )
    oncoming = scene(context, [(50.0, 0.0, math.pi, 10.0)], ego=(0.0, 0.0, 0.0, 10.0))
    assert look("radar", context, oncoming).detections[0, 0, DETECTION_RANGE_RATE] == pytest.approx(
        -20.0
    )


def test_latency_delivers_what_was_true_then(kind: str) -> None:
    context = scene_context()
    sensor = RangingSensor(sensor_context(spec(kind), context, every=2, latency=3))
    delivered = []
    for tick in range(8):
        found = sensor.sense(scene(context, [(40.0 + tick, 0.0)], tick=tick))
        delivered.append((round(float(found.stamp[0]), 9), seen(found).get(0, (None,))[0]))
    at = [(0.0, 40.0), (0.1, 42.0), (0.2, 44.0)]
    expected = [(-1.0, None)] * 3 + [at[0]] * 2 + [at[1]] * 2 + [at[2]]
    assert delivered == [(stamp, None if x is None else pytest.approx(x)) for stamp, x in expected]


# --- Noise of object-level sensors: the same draws, whoever stands beside a run in its block ------

OWNER = np.uint64(7)
NUMBER = 3


NAMES = ("distance_noise", "range_noise", "range_rate_noise", "bearing_noise", "range")
RECORD = parameter_record(
    {key: np.array([value]) for key, value in zip(NAMES, (0.5, 0.5, 0.2, 0.0, 100.0), strict=True)}
)[0]
AHEAD, LEFT = (1.0, 0.0), (0.0, 1.0)


def noted(kind: int, wanted: list[tuple[int, int]]) -> Seen:
    """Note pairs of a seed and an object; object 0 is 10 m to the left, the others 20 m ahead."""
    seen = memory_for(4)
    for item, (seed, thing) in enumerate(wanted):
        direction, distance = (AHEAD, 20.0) if thing else (LEFT, 10.0)
        note(kind, RECORD, seen, item, np.uint64(seed), thing, *direction, distance, 0.0)
    return seen


def measured(kind: int, wanted: list[tuple[int, int]]) -> Seen:
    seen = noted(kind, wanted)
    measure(kind, seen, len(wanted), OWNER, NUMBER)
    return seen


def test_each_item_has_the_draws_of_its_run_and_its_object() -> None:
    wanted = [(seed, thing) for seed in (5, 9, 2**60) for thing in (0, 2, 3)]
    seen = measured(RADAR, wanted)
    for item, (seed, thing) in enumerate(wanted):
        for draw in range(DRAWS):
            pair = normal_pair(np.uint64(seed), OWNER, NUMBER, DRAWS * thing + draw)
            assert tuple(seen.noise[2 * draw : 2 * draw + 2, item]) == pair


def test_only_a_radar_draws_for_the_range_rate() -> None:
    assert not measured(CAMERA, [(5, 1)]).noise[2:].any()
    seen = measured(RADAR, [(5, 1)])
    assert seen.items[SEEN_RATE, 0] == 0.2 * seen.noise[2, 0] != 0.0


def test_there_is_room_for_every_object_of_a_block() -> None:
    assert memory_for(4).items.shape[1] == 4 * BLOCK


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "sigma"), [(LIDAR, 0.5), (CAMERA, 0.5 * 20.0 * 20.0 / 100.0)])
def test_place_is_off_along_the_line_of_sight_by_its_draw(kind: int, sigma: float) -> None:
    seen = measured(kind, [(5, 1), (5, 0)])
    seen.poses[0] = 1.0, 0.0, 100.0, 50.0
    seen.ends[0] = 2
    ego = np.array([98.0, 50.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    truth = Truth(
        running=np.ones(1, dtype=np.bool_),
        ego=ego[None],
        objects=np.zeros((1, 4, 5)),
        sizes=np.ones((1, 4, 3)),
        classes=np.zeros(4, dtype=np.int64),
        seeds=np.array([5], dtype=np.uint64),
        owner=OWNER,
        number=NUMBER,
    )
    sample = sample_at(0.0, 1, 4)
    write(kind, truth, 0, seen, 0, 0, np.zeros(4, dtype=np.int64), Found.of(sample))
    detections = sample.detections[0]
    # The nearer one comes first.
    assert sample.source[0].tolist() == [0, 1, -1, -1]
    assert sample.mask[0].tolist() == [True, True, False, False]
    assert detections[1, 0] == pytest.approx(22.0 + sigma * seen.noise[0, 0])
    assert detections[1, 1] == pytest.approx(0.0)
    assert detections[0, 0] == pytest.approx(2.0)
