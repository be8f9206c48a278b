"""What the detector makes of an image: range, bearing, size, parts."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    OBJECT_CLASSES,
    Floats,
    Scene,
    SceneContext,
)
from adeye.simulate.sensors.recognition import SIZES
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
    assert OBJECT_CLASSES[int(row[DETECTION_CLASS])] == "car"
    assert row[DETECTION_LENGTH] == CAR[0]
    assert row[DETECTION_WIDTH] == pytest.approx(CAR[1], abs=20.0 / focal(spec()))
    assert row[DETECTION_HAS_RANGE_RATE] == 0.0


@pytest.mark.parametrize("distance", [10.0, 15.0, 22.0, 33.0, 50.0, 75.0, 100.0])
def test_range_errs_by_half_a_pixel_of_the_ground_at_most(distance: float) -> None:
    context = scene_context()
    # All phases of the edge of the car against the rows of the image.
    for place in np.linspace(distance, 1.2 * distance, 25):
        (row,) = rows(context, scene(context, [rear(place)]))
        error = row[DETECTION_X] - 0.5 * CAR[0] - place
        drop = focal(spec()) * HEIGHT / place
        bound = focal(spec()) * HEIGHT * (1.0 / (drop - 0.5) - 1.0 / drop)
        assert abs(error) <= bound * (1.0 + 1e-9)
        assert bound == pytest.approx(place**2 / focal(spec()) / HEIGHT / 2.0, rel=0.5 / drop + 0.3)


def test_range_errs_to_both_sides() -> None:
    context = scene_context()
    errors = []
    for place in np.linspace(30.0, 40.0, 60):
        (row,) = rows(context, scene(context, [rear(place)]))
        errors.append(row[DETECTION_X] - 0.5 * CAR[0] - place)
    assert min(errors) < -1.0
    assert max(errors) > 1.0
    assert abs(np.mean(errors)) < 0.3


def test_more_pixels_make_range_and_bearing_sharper() -> None:
    context = scene_context()
    shown = scene(context, [rear(61.0, 2.3)])
    coarse, fine = (rows(context, shown, columns=n, rows=3 * n // 8)[0] for n in (160, 960))
    for row, limit in ((coarse, 12.0), (fine, 2.0)):
        assert abs(row[DETECTION_X] - 0.5 * CAR[0] - 61.0) < limit
    assert abs(fine[DETECTION_Y] - 2.3) < 0.15


@pytest.mark.parametrize("pitch", ["-2 deg", "3 deg", "10 deg"])
def test_pitch_of_the_mount_is_reckoned_with(pitch: str) -> None:
    context = scene_context()
    (row,) = rows(
        context, scene(context, [rear(12.0)]), mount={"pitch": pitch}, columns=640, rows=480
    )
    assert row[DETECTION_X] - 0.5 * CAR[0] == pytest.approx(12.0, abs=0.2)


@pytest.mark.parametrize("yaw", [-20.0, 0.0, 20.0])
def test_yaw_of_the_mount_turns_the_bearing_by_as_much(yaw: float) -> None:
    context = scene_context([PERSON], kinds=["pedestrian"])
    bearing = math.radians(yaw + 10.0)
    place = (20.0 * math.cos(bearing), 20.0 * math.sin(bearing))
    found = look(context, scene(context, [place]), mount={"yaw": f"{yaw} deg"})
    x, y = seen(found)[0]
    assert math.degrees(math.atan2(y, x)) == pytest.approx(yaw + 10.0, abs=0.6)


def test_wrong_mount_of_the_record_is_no_knowledge_of_the_detector() -> None:
    # The same image from a camera turned by 20 degrees gives a place turned by 20 degrees.
    context = scene_context([PERSON], kinds=["pedestrian"])
    turn = math.radians(20.0)
    ahead = look(context, scene(context, [(20.0, 0.0, 0.0)]))
    aside = look(
        context,
        scene(context, [(20.0 * math.cos(turn), 20.0 * math.sin(turn), turn)]),
        mount={"yaw": "20 deg"},
    )
    x, y = seen(ahead)[0]
    x -= 0.25
    other_x, other_y = seen(aside)[0]
    assert (other_x - 0.25, other_y) == pytest.approx(
        (x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)), abs=1e-6
    )


def test_camera_to_the_rear_places_what_is_behind() -> None:
    context = scene_context()
    found = look(
        context, scene(context, [(-20.0, 1.0)]), mount={"x": "-2 m", "yaw": "180 deg"}, columns=640
    )
    assert seen(found)[0] == pytest.approx((-20.0, 1.0), abs=1.0)


def test_camera_to_the_side_takes_the_width_of_the_class_for_the_depth() -> None:
    context = scene_context()
    found = look(
        context,
        scene(context, [(0.0, 12.0)]),
        mount={"yaw": "90 deg"},
        columns=640,
        rows=240,
    )
    assert seen(found)[0] == pytest.approx((0.0, 12.0), abs=0.4)
    row = found.detections[0, 0]
    assert (row[DETECTION_LENGTH], row[DETECTION_WIDTH]) == (CAR[0], CAR[1])


# --- where the contact with the ground cannot be seen ---------------------------------------------


@pytest.mark.parametrize("distance", [2.5, 4.0, 6.0])
def test_car_cut_at_the_lower_edge_is_ranged_by_its_width(distance: float) -> None:
    context = scene_context()
    (row,) = rows(context, scene(context, [rear(distance)]))
    assert row[DETECTION_X] - 0.5 * CAR[0] == pytest.approx(distance, rel=0.05)


def test_what_fills_the_image_is_no_further_than_the_lower_edge() -> None:
    context = scene_context([TRUCK], kinds=["truck"])
    (row,) = rows(context, scene(context, [(1.0 + 5.0, 0.0)]))
    edge = focal(spec()) * HEIGHT / 30.0
    assert row[DETECTION_X] - 6.0 == pytest.approx(edge)


@pytest.mark.parametrize("distance", [2.5, 4.0])
def test_post_whose_foot_is_below_the_image_is_not_placed_at_its_edge(distance: float) -> None:
    # What is placed there would go along with the ego, as if it drove ahead at its speed.
    context = scene_context([(0.15, 0.15, 0.8)], kinds=["barrier"])
    found = look(context, scene(context, [(1.0 + distance, 0.0)]))
    assert seen(found) == {}


def test_truck_behind_a_car_is_ranged_by_the_size_of_its_class() -> None:
    context = scene_context([CAR, (12.0, 2.5, 3.8)], kinds=["car", "truck"])
    found = look(context, scene(context, [rear(15.0), (40.0 + 6.0, 0.0)]))
    assert seen(found)[1][0] - 6.0 == pytest.approx(40.0, rel=0.1)


def test_typical_sizes_are_known_for_every_class_that_has_one() -> None:
    for kind, size in zip(OBJECT_CLASSES, SIZES, strict=True):
        assert (size > 0.0).all() == (kind not in {"barrier", "building"}), kind


def test_truck_cut_by_the_side_of_the_image_errs_by_half_of_its_length_at_most() -> None:
    context = scene_context([(12.0, 2.5, 3.8)], kinds=["truck"])
    for x in np.arange(8.0, 16.0, 1.0):
        found = look(context, scene(context, [(x, 5.5)]), columns=640, rows=320)
        assert abs(seen(found)[0][0] - x) < 6.0, x


@pytest.mark.parametrize("pitch", ["-3 deg", "0 deg", "3 deg"])
def test_sliver_at_the_side_of_the_image_is_no_detection(pitch: str) -> None:
    context = scene_context()
    edge = math.tan(math.radians(25.0))
    for inside in np.arange(0.0, 0.2, 0.02):
        # The right front corner of a car to the left is just inside of the image.
        x = (4.0 - 0.9) / edge - 0.5 * CAR[0] + inside
        found = look(
            context, scene(context, [(x, 4.0)]), mount={"pitch": pitch}, columns=640, rows=320
        )
        for near, _ in seen(found).values():
            assert near < 12.0


# --- what is seen at all --------------------------------------------------------------------------


def test_detection_needs_the_rows_that_it_asks_for() -> None:
    context = scene_context()
    for least in (2, 4, 8):
        reach = focal(spec()) * CAR[2]
        sure, never = reach / (least + 1.0), reach / (least - 1.0)
        assert len(rows(context, scene(context, [rear(sure)]), min_pixel_height=least)) == 1
        assert len(rows(context, scene(context, [rear(never)]), min_pixel_height=least)) == 0


def test_detection_needs_the_columns_that_it_asks_for() -> None:
    context = scene_context([PERSON], kinds=["pedestrian"])
    shown = scene(context, [(30.0, 0.0)])
    assert len(rows(context, shown, min_pixel_width=2)) == 1
    assert len(rows(context, shown, min_pixel_width=6)) == 0


@pytest.mark.parametrize(
    ("aside", "found"),
    [(0.0, [0]), (1.0, [0]), (2.2, [0, 1]), (5.0, [0, 1])],
)
def test_occlusion_is_by_what_stands_before(aside: float, found: list[int]) -> None:
    # A car behind a truck: hidden while it is in the shadow, seen as far as it shows.
    context = scene_context([TRUCK, CAR], kinds=["truck", "car"])
    shown = scene(context, [(20.0, 0.0), (30.0, aside)])
    assert sorted(seen(look(context, shown))) == found


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
    assert together[0, DETECTION_WIDTH] == pytest.approx(1.25, abs=0.2)
    assert len(apart) == 2


def test_object_in_two_parts_is_named_once() -> None:
    # A pole before a car leaves a smaller part to the left.
    context = scene_context([(0.3, 0.3, 3.0), CAR], kinds=["barrier", "car"])
    found = look(context, scene(context, [(10.0, 0.15), rear(20.0, 0.0)]))
    cars = found.detections[0, :, DETECTION_CLASS] == 0.0
    sources = found.source[0, found.mask[0] & cars].tolist()
    assert sorted(sources) == [-1, 1]


def test_largest_parts_are_kept_where_there_is_no_room_for_all() -> None:
    context = scene_context([CAR])
    shown = scene(context, [rear(10.0)])
    sensor = camera(context, noise=0.05, min_pixel_height=1)
    found = sensor.sense(shown)
    assert found.mask.all()
    assert 0 in found.source[0]


def test_ghosts_are_placed_on_the_ground_without_class_or_depth() -> None:
    context = scene_context([CAR])
    patch = {"column": 70, "row": 40, "columns": 20, "rows": 15, "noise": 0.2}
    found = look(context, scene(context, [(-30.0, 0.0)]), patches={"broken": patch})
    ghosts = found.detections[0, found.mask[0]]
    assert len(ghosts) > 0
    assert (ghosts[:, DETECTION_CLASS] == -1.0).all()
    assert (ghosts[:, DETECTION_LENGTH] == 0.0).all()
    assert (found.source[0] == -1).all()
    # Between the lower edge of the image and row 40.
    focus = focal(spec()) * HEIGHT
    assert (ghosts[:, DETECTION_X] >= focus / 26.0).all()
    assert (ghosts[:, DETECTION_X] <= focus / 10.0).all()


def test_ghosts_in_the_sky_are_nowhere() -> None:
    context = scene_context([CAR])
    patch = {"column": 70, "row": 0, "columns": 20, "rows": 25, "noise": 0.2}
    assert not look(context, scene(context, [(-30.0, 0.0)]), patches={"broken": patch}).mask.any()


def test_detections_come_nearest_first() -> None:
    context = scene_context([CAR] * 4)
    shown = scene(context, [rear(60.0, 8.0), rear(20.0, -6.0), rear(-40.0), rear(40.0)])
    found = look(context, shown)
    assert found.source[0, found.mask[0]].tolist() == [1, 3, 0]
