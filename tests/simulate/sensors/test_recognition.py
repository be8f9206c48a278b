"""What the detector makes of an image: range, bearing, size, parts."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import Floats, Scene, SceneContext
from adeye.simulate.sensors.camera import SIZES
from tests.simulate.sensors.pictures import HEIGHT, PERSON, camera, focal, look, spec
from tests.simulate.sensors.scenes import CAR, TRUCK, scene, scene_context, seen


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


def test_wrong_mount_of_the_record_is_no_knowledge_of_the_detector() -> None:
    # The same image from a camera turned by 20 degrees gives a place turned by 20 degrees.
    context = scene_context([PERSON], kinds=["pedestrian"])
    turn = math.radians(20.0)
    c, s = math.cos(turn), math.sin(turn)
    x, y = seen(look(context, scene(context, [(20.0, 0.0, 0.0)])))[0]
    there = scene(context, [(20.0 * c, 20.0 * s, turn)])
    found = seen(look(context, there, mount={"yaw": "20 deg"}))[0]
    x -= 0.25
    assert found == pytest.approx((0.25 + x * c - y * s, x * s + y * c), abs=1e-6)


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


def test_typical_sizes_are_known_for_every_class_that_has_one() -> None:
    for kind, size in zip(signals.OBJECT_CLASSES, SIZES, strict=True):
        assert (size > 0.0).all() == (kind not in {"barrier", "building"}), kind


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


def test_occlusion_is_by_what_stands_before() -> None:
    # A car behind a truck: hidden while it is in the shadow, seen as far as it shows.
    context = scene_context([TRUCK, CAR], kinds=["truck", "car"])
    for aside, found in ((0.0, [0]), (1.0, [0]), (2.2, [0, 1]), (5.0, [0, 1])):
        shown = scene(context, [(20.0, 0.0), (30.0, aside)])
        assert sorted(seen(look(context, shown))) == found, aside


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
