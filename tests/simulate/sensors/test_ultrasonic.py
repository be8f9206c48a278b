"""Ultrasonic sensor: cone, blind zone, nearest echo, specular faces, cross-talk."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_WIDTH,
    Measurement,
    Scene,
    SceneContext,
)
from adeye.simulate.sensors.ultrasonic import UltrasonicSensor
from adeye.spec.sensors import Sensor, Ultrasonic
from tests.simulate.sensors.scenes import scene, scene_context, sensor_context

WALL = (0.2, 20.0, 2.0)
POST = (0.02, 0.02, 1.0)


def spec(**changes: Any) -> Ultrasonic:
    fields: dict[str, Any] = {
        "kind": "ultrasonic",
        "mount": {"x": "0 m"},
        "field_of_view": "60 deg",
        "range": "5 m",
        "rate": "20 Hz",
    }
    return Ultrasonic.model_validate({**fields, **changes})


def look(
    context: SceneContext,
    shown: Scene,
    others: Mapping[str, Sensor] | None = None,
    **changes: Any,
) -> Measurement:
    """Sample one scene with one new sensor."""
    about = sensor_context(spec(**changes), context)
    beside = {name: [other] * context.runs for name, other in (others or {}).items()}
    return UltrasonicSensor(replace(about, others=beside)).sense(shown)


def heard(objects: Sequence[Sequence[float]], sizes: Any, **changes: Any) -> float | None:
    """Distance of the detection of one run from the origin, None for none."""
    others = changes.pop("others", None)
    context = scene_context(sizes)
    found = look(context, scene(context, objects), others, **changes)
    return float(found.detections[0, 0, 0]) if found.mask[0, 0] else None


def test_wall_ahead_is_a_point_on_the_axis_of_which_nothing_else_is_known() -> None:
    context = scene_context([WALL], kinds=["building"])
    found = look(context, scene(context, [(3.1, 4.0)]), mount={"x": "1 m"})
    assert found.detections.shape == (1, 1, 7)
    row = found.detections[0, 0]
    assert row[:2] == pytest.approx([3.0, 0.0])
    assert row[DETECTION_CLASS] == -1.0
    assert not row[[DETECTION_LENGTH, DETECTION_WIDTH, DETECTION_HAS_RANGE_RATE]].any()


def test_echo_from_aside_is_reported_on_the_axis() -> None:
    bearing = math.radians(25.0)
    distance = heard([(3.0 * math.cos(bearing), 3.0 * math.sin(bearing), bearing)], [POST])
    assert distance == pytest.approx(3.0 - 0.01)


@pytest.mark.parametrize("yaw", [0.0, 90.0, -120.0, 180.0])
def test_detection_lies_on_the_axis_of_the_mount(yaw: float) -> None:
    context = scene_context([POST])
    angle = math.radians(yaw)
    at = (3.0 * math.cos(angle), 3.0 * math.sin(angle), angle)
    found = look(context, scene(context, [at]), mount={"yaw": f"{yaw} deg"})
    expected = (2.99 * math.cos(angle), 2.99 * math.sin(angle))
    assert found.detections[0, 0, :2] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("degrees", "inside"), [(29.0, True), (31.0, False), (-29.0, True)])
def test_cone_ends_at_half_the_field_of_view(degrees: float, *, inside: bool) -> None:
    bearing = math.radians(degrees)
    at = (3.0 * math.cos(bearing), 3.0 * math.sin(bearing), bearing)
    assert (heard([at], [POST]) is not None) is inside


def test_nothing_behind_is_heard() -> None:
    assert heard([(-2.0, 0.0)], [POST]) is None


@pytest.mark.parametrize(("distance", "found"), [(4.99, True), (5.01, False), (0.19, False)])
def test_echo_comes_from_between_blind_zone_and_range(distance: float, *, found: bool) -> None:
    assert (heard([(distance + 0.1, 0.0)], [WALL], blind_zone="0.2 m") is not None) is found


def test_echo_of_what_is_behind_is_hidden_by_what_is_in_the_blind_zone() -> None:
    assert heard([(0.2, 0.0), (3.0, 0.0)], [WALL, WALL]) is None
    # A post there hides the way to a wall at right angles, but not to a post aside.
    posts = [(0.11, 0.0), (3.0, 0.5)]
    assert heard(posts, [POST, POST]) == pytest.approx(math.hypot(3.0, 0.5) - 0.012, abs=0.005)


def test_nearest_of_several_is_heard_whatever_their_order() -> None:
    objects = [(3.0, 0.6), (2.0, -0.5), (4.0, 0.0)]
    context = scene_context([POST] * 3)
    found = look(context, scene(context, objects))
    turned = look(context, scene(context, objects[::-1]))
    assert (found.source[0, 0], turned.source[0, 0]) == (1, 1)
    np.testing.assert_array_equal(found.detections, turned.detections)


@pytest.mark.parametrize(
    ("degrees", "distance"), [(0.0, 3.0), (20.0, 3.0), (29.0, 3.0), (35.0, None)]
)
def test_wall_echoes_from_the_foot_of_its_perpendicular_only(
    degrees: float, distance: float | None
) -> None:
    normal = math.radians(degrees)
    centre = (3.1 * math.cos(normal), 3.1 * math.sin(normal), normal)
    found = heard([centre], [WALL])
    assert found == (None if distance is None else pytest.approx(distance))


def test_corner_echoes_although_its_faces_are_oblique() -> None:
    # A box that turns a corner to the sensor, straight ahead.
    side = 1.0
    at = (3.0 + side / math.sqrt(2.0), 0.0, math.pi / 4.0)
    assert heard([at], [(side, side, 1.0)]) == pytest.approx(3.0)


def test_near_end_of_a_wall_beside_the_cone_is_heard_from_within_the_cone() -> None:
    # A car beside: its side has no perpendicular in the cone, but its rear corner is in view.
    found = heard([(4.25, 1.5)], [(4.5, 1.8, 1.5)])
    assert found == pytest.approx(math.hypot(2.0, 0.6))


def test_touching_sensor_hears_nothing_but_its_blind_zone() -> None:
    assert heard([(0.0, 0.0)], [(4.5, 1.8, 1.5)]) is None
    assert heard([(0.0, 0.0)], [(4.5, 1.8, 1.5)], blind_zone="0 m") == 0.0


@pytest.mark.parametrize(("distance", "sigma"), [(3.0, 0.02), (0.01, 0.05)])
def test_noise_has_the_stated_mean_and_deviation_near_by_too(distance: float, sigma: float) -> None:
    context = scene_context([WALL], runs=4000)
    shown = scene(context, [(distance + 0.1, 0.0)])
    found = look(context, shown, range_noise=f"{sigma} m", blind_zone="0 m").detections[:, 0, 0]
    assert found.mean() == pytest.approx(distance, abs=4.0 * sigma / math.sqrt(4000.0))
    assert found.std() == pytest.approx(sigma, rel=4.0 / math.sqrt(8000.0))


def test_object_that_is_no_number_is_not_heard_and_hides_nothing_behind_it() -> None:
    assert heard([(math.nan, 0.0)], [POST]) is None


def test_ended_run_hears_nothing() -> None:
    context = scene_context([WALL], runs=2)
    shown = scene(context, [(3.1, 0.0)])
    shown.running[0] = False
    assert look(context, shown).mask[:, 0].tolist() == [False, True]


# --- cross-talk -----------------------------------------------------------------------------------

OTHER = {"mount": {"x": "2 m", "y": "0 m"}}


def test_with_cross_talk_a_nearer_sender_makes_a_post_seem_nearer() -> None:
    # This sensor at the origin, the other one 2 m nearer to the post: 4 m and 2 m of way.
    objects, sizes = [(4.01, 0.0)], [POST]
    other = {"other": spec(**OTHER)}
    assert heard(objects, sizes, others=other) == pytest.approx(4.0)
    assert heard(objects, sizes, others=other, cross_talk=True) == pytest.approx(3.0)


def test_shared_echo_of_a_wall_takes_the_way_to_the_mirror_image() -> None:
    # Both look ahead; the other one is 1 m to the left and 1 m nearer.
    objects, sizes = [(3.1, 0.0)], [WALL]
    other = {"other": spec(mount={"x": "1 m", "y": "1 m"})}
    found = heard(objects, sizes, others=other, cross_talk=True)
    assert found == pytest.approx(0.5 * math.hypot(3.0 + 2.0, 1.0))


def test_sender_that_is_farther_away_changes_nothing() -> None:
    other = {"other": spec(mount={"x": "-1 m"})}
    assert heard([(3.1, 0.0)], [WALL], others=other, cross_talk=True) == pytest.approx(3.0)


@pytest.mark.parametrize(
    "sender",
    [
        spec(mount={"x": "2 m", "yaw": "90 deg"}),
        spec(mount={"x": "8 m"}),
    ],
    ids=["looks elsewhere", "is beyond"],
)
def test_object_must_be_in_both_cones(sender: Ultrasonic) -> None:
    found = heard([(4.01, 0.0)], [POST], others={"other": sender}, cross_talk=True)
    assert found == pytest.approx(4.0)


def test_post_beyond_the_own_range_is_heard_by_a_shared_echo() -> None:
    objects, sizes = [(6.01, 0.0)], [POST]
    sender = {"other": spec(mount={"x": "4 m"})}
    assert heard(objects, sizes) is None
    found = heard(objects, sizes, others=sender, cross_talk=True)
    assert found == pytest.approx(0.5 * (6.0 + 2.0))


def test_slower_sender_is_heard_only_when_it_fires() -> None:
    context = scene_context([POST])
    about = sensor_context(spec(cross_talk=True), context)
    slow = {"other": [spec(**OTHER, rate="10 Hz")]}
    sensor = UltrasonicSensor(replace(about, others=slow))
    found = [
        float(sensor.sense(scene(context, [(4.01, 0.0)], tick=tick)).detections[0, 0, 0])
        for tick in range(4)
    ]
    assert found == pytest.approx([3.0, 4.0, 3.0, 4.0])


def test_without_cross_talk_other_sensors_do_not_change_a_bit() -> None:
    context = scene_context([POST, WALL], runs=16)
    shown = scene(context, [(2.5, 0.3), (4.0, 0.0)])
    others = {"b": spec(**OTHER), "a": spec(mount={"x": "1 m"})}
    alone = look(context, shown, range_noise="2 cm")
    among = look(context, shown, others, range_noise="2 cm")
    for name in ("mask", "detections", "source"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(among, name))


def test_order_of_the_other_sensors_does_not_change_a_bit() -> None:
    context = scene_context([POST, POST])
    shown = scene(context, [(3.0, 0.3), (3.2, -0.4)])
    others = {"b": spec(mount={"x": "1 m"}), "a": spec(mount={"x": "0.7 m", "y": "0.4 m"})}
    one = look(context, shown, others, cross_talk=True)
    two = look(context, shown, dict(reversed(others.items())), cross_talk=True)
    np.testing.assert_array_equal(one.detections, two.detections)
