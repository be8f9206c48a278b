"""What the detector makes of an image: range, bearing, size, parts."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import Floats, Scene, SceneContext
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.simulate.world.weather import MM_PER_HOUR
from tests.simulate.sensors.pictures import HEIGHT, PERSON, camera, focal, look, spec
from tests.simulate.sensors.scenes import (
    CAR,
    TRUCK,
    scene,
    scene_context,
    seen,
    sensor_context,
    sensor_spec,
)


def rear(distance: float, y: float = 0.0) -> tuple[float, float]:
    """Where a car is whose rear is so far away."""
    return distance + 0.5 * CAR[0], y


def rows(context: SceneContext, shown: Scene, **changes: Any) -> Floats:
    """Detections of one sample."""
    found = look(context, shown, **changes)
    return np.asarray(found.detections[0, found.mask[0]])


def test_car_is_reported_with_class_and_the_size_of_its_class() -> None:
    context = scene_context()
    (row,) = rows(context, scene(context, [rear(20.0)]))
    assert signals.OBJECT_CLASSES[int(row[signals.DETECTION_CLASS])] == "car"
    assert row[signals.DETECTION_LENGTH] == CAR[0]
    assert row[signals.DETECTION_WIDTH] == pytest.approx(CAR[1], abs=20.0 / focal(spec()))
    assert row[signals.DETECTION_HAS_RANGE_RATE] == 0.0


def test_range_errs_by_half_a_pixel_of_the_ground_at_most_and_to_both_sides() -> None:
    context = scene_context()
    # All phases of the edge of the car against the rows of the image.
    for distance in (10.0, 15.0, 22.0, 33.0, 50.0, 75.0, 100.0):
        errors = []
        for place in np.linspace(distance, 1.2 * distance, 25):
            (row,) = rows(context, scene(context, [rear(place)]))
            errors.append(row[signals.DETECTION_X] - 0.5 * CAR[0] - place)
            drop = focal(spec()) * HEIGHT / place
            bound = focal(spec()) * HEIGHT * (1.0 / (drop - 0.5) - 1.0 / drop)
            assert abs(errors[-1]) <= bound * (1.0 + 1e-9), place
            least = place**2 / focal(spec()) / HEIGHT / 2.0
            assert bound == pytest.approx(least, rel=0.5 / drop + 0.3), place
        if distance == 33.0:
            assert min(errors) < -1.0
            assert max(errors) > 1.0
            assert abs(np.mean(errors)) < 0.3


def test_more_pixels_make_range_and_bearing_sharper() -> None:
    context = scene_context()
    shown = scene(context, [rear(61.0, 2.3)])
    coarse, fine = (rows(context, shown, columns=n, rows=3 * n // 8)[0] for n in (160, 960))
    for row, limit in ((coarse, 12.0), (fine, 2.0)):
        assert abs(row[signals.DETECTION_X] - 0.5 * CAR[0] - 61.0) < limit
    assert abs(fine[signals.DETECTION_Y] - 2.3) < 0.15


def test_pitch_of_the_mount_is_reckoned_with() -> None:
    context = scene_context()
    fine = {"columns": 640, "rows": 480}
    for pitch in ("-2 deg", "3 deg", "10 deg"):
        (row,) = rows(context, scene(context, [rear(12.0)]), mount={"pitch": pitch}, **fine)
        assert row[signals.DETECTION_X] - 0.5 * CAR[0] == pytest.approx(12.0, abs=0.2), pitch


def test_camera_to_the_rear_or_side_places_what_is_there() -> None:
    context = scene_context()
    behind = scene(context, [(-20.0, 1.0)])
    found = look(context, behind, mount={"x": "-2 m", "yaw": "180 deg"}, columns=640)
    assert seen(found)[0] == pytest.approx((-20.0, 1.0), abs=1.0)
    # To the side it takes the width of the class for the depth.
    beside = scene(context, [(0.0, 12.0)])
    found = look(context, beside, mount={"yaw": "90 deg"}, columns=640, rows=240)
    assert seen(found)[0] == pytest.approx((0.0, 12.0), abs=0.4)
    row = found.detections[0, 0]
    assert (row[signals.DETECTION_LENGTH], row[signals.DETECTION_WIDTH]) == (CAR[0], CAR[1])


# --- where the contact with the ground cannot be seen ---------------------------------------------


def test_car_cut_at_the_lower_edge_is_ranged_by_its_width() -> None:
    context = scene_context()
    for distance in (2.5, 4.0, 6.0):
        (row,) = rows(context, scene(context, [rear(distance)]))
        assert row[signals.DETECTION_X] - 0.5 * CAR[0] == pytest.approx(distance, rel=0.05)


def test_what_fills_the_image_is_no_further_than_the_lower_edge() -> None:
    context = scene_context([TRUCK], kinds=["truck"])
    (row,) = rows(context, scene(context, [(1.0 + 5.0, 0.0)]))
    edge = focal(spec()) * HEIGHT / 30.0
    assert row[signals.DETECTION_X] - 6.0 == pytest.approx(edge)


def test_post_whose_foot_is_below_the_image_is_not_placed_at_its_edge() -> None:
    # What is placed there would go along with the ego, as if it drove ahead at its speed.
    context = scene_context([(0.15, 0.15, 0.8)], kinds=["barrier"])
    for distance in (2.5, 4.0):
        assert seen(look(context, scene(context, [(1.0 + distance, 0.0)]))) == {}, distance


def test_truck_behind_a_car_is_ranged_by_the_size_of_its_class() -> None:
    context = scene_context([CAR, (12.0, 2.5, 3.8)], kinds=["car", "truck"])
    found = look(context, scene(context, [rear(15.0), (40.0 + 6.0, 0.0)]))
    assert seen(found)[1][0] - 6.0 == pytest.approx(40.0, rel=0.1)


def test_truck_cut_by_the_side_of_the_image_errs_by_half_of_its_length_at_most() -> None:
    context = scene_context([(12.0, 2.5, 3.8)], kinds=["truck"])
    for x in np.arange(8.0, 16.0, 1.0):
        found = look(context, scene(context, [(x, 5.5)]), columns=640, rows=320)
        assert abs(seen(found)[0][0] - x) < 6.0, x


def test_sliver_at_the_side_of_the_image_is_no_detection() -> None:
    context = scene_context()
    edge = math.tan(math.radians(25.0))
    fine = {"columns": 640, "rows": 320}
    for pitch, inside in itertools.product(("-3 deg", "0 deg", "3 deg"), np.arange(0.0, 0.2, 0.02)):
        # The right front corner of a car to the left is just inside of the image.
        shown = scene(context, [((4.0 - 0.9) / edge - 0.5 * CAR[0] + inside, 4.0)])
        for near, _ in seen(look(context, shown, mount={"pitch": pitch}, **fine)).values():
            assert near < 12.0, (pitch, inside)


# --- what is seen at all --------------------------------------------------------------------------


def test_detection_needs_the_rows_and_columns_that_it_asks_for() -> None:
    context = scene_context()
    for least in (2, 4, 8):
        reach = focal(spec()) * CAR[2]
        sure, never = reach / (least + 1.0), reach / (least - 1.0)
        assert len(rows(context, scene(context, [rear(sure)]), min_pixel_height=least)) == 1
        assert len(rows(context, scene(context, [rear(never)]), min_pixel_height=least)) == 0
    context = scene_context([PERSON], kinds=["pedestrian"])
    for least, count in ((2, 1), (6, 0)):
        shown = scene(context, [(30.0, 0.0)])
        assert len(rows(context, shown, min_pixel_width=least)) == count


def test_cars_of_one_class_in_line_are_two_while_the_gap_can_be_seen() -> None:
    context = scene_context([CAR, TRUCK])
    near = look(context, scene(context, [rear(15.0), (15.0 + 4.5 + 5.0 + 5.0, 1.0)]))
    assert sorted(seen(near)) == [0, 1]
    far = look(context, scene(context, [rear(80.0), (80.0 + 4.5 + 2.0 + 5.0, 1.0)]))
    assert len(seen(far)) == 1


def test_pedestrians_side_by_side_are_one_and_apart_are_two() -> None:
    context = scene_context([PERSON] * 2, kinds=["pedestrian"] * 2)
    together = rows(context, scene(context, [(20.0, 0.3), (20.0, -0.35)]))
    apart = rows(context, scene(context, [(20.0, 1.0), (20.0, -1.0)]))
    assert len(together) == 1
    assert together[0, signals.DETECTION_WIDTH] == pytest.approx(1.25, abs=0.2)
    assert len(apart) == 2


def test_object_in_two_parts_is_named_once() -> None:
    # A pole before a car leaves a smaller part to the left.
    context = scene_context([(0.3, 0.3, 3.0), CAR], kinds=["barrier", "car"])
    found = look(context, scene(context, [(10.0, 0.15), rear(20.0, 0.0)]))
    cars = found.detections[0, :, signals.DETECTION_CLASS] == 0.0
    sources = found.source[0, found.mask[0] & cars].tolist()
    assert sorted(sources) == [-1, 1]


def test_largest_parts_are_kept_where_there_is_no_room_for_all() -> None:
    context = scene_context([CAR])
    shown = scene(context, [rear(10.0)])
    sensor = camera(context, noise=0.05, min_pixel_height=1)
    found = sensor.sense(shown)
    assert found.mask.all()
    assert 0 in found.source[0]


def test_ghosts_are_placed_on_the_ground_without_class_or_depth_and_in_the_sky_nowhere() -> None:
    context = scene_context([CAR])
    nothing = scene(context, [(-30.0, 0.0)])
    patch = {"column": 70, "row": 40, "columns": 20, "rows": 15, "noise": 0.2}
    found = look(context, nothing, patches={"broken": patch})
    ghosts = found.detections[0, found.mask[0]]
    assert len(ghosts) > 0
    assert (ghosts[:, signals.DETECTION_CLASS] == -1.0).all()
    assert (ghosts[:, signals.DETECTION_LENGTH] == 0.0).all()
    assert (found.source[0] == -1).all()
    # Between the lower edge of the image and row 40.
    focus = focal(spec()) * HEIGHT
    assert (ghosts[:, signals.DETECTION_X] >= focus / 26.0).all()
    assert (ghosts[:, signals.DETECTION_X] <= focus / 10.0).all()
    sky = {**patch, "row": 0, "rows": 25}
    assert not look(context, nothing, patches={"broken": sky}).mask.any()


# --- The physical camera as a whole: range, weather, dead pixels, agreement with the object level -


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


@pytest.mark.parametrize("side", [2.0, 5.0, 20.0])
def test_low_sun_on_the_left_takes_as_much_of_the_range_as_on_the_right(side: float) -> None:
    sun = {"sun_elevation": math.radians(5.0)}
    left, right = (reach_in({**sun, "sun_azimuth": math.radians(angle)}) for angle in (side, -side))
    assert left == right < reach_in({})


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
