"""Ultrasonic sensor: cone, blind zone, nearest echo, specular faces, cross-talk."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import Measurement, Scene, SceneContext
from adeye.simulate.sensors.ultrasonic import UltrasonicSensor
from adeye.spec.sensors import Sensor, Ultrasonic
from tests.simulate.sensors.scenes import CAR, scene, scene_context, sensor_context, sensor_spec

WALL = (0.2, 20.0, 2.0)
POST = (0.02, 0.02, 1.0)


def spec(**changes: Any) -> Ultrasonic:
    made: Ultrasonic = sensor_spec(
        "ultrasonic", **({"field_of_view": "60 deg", "range": "5 m"} | changes)
    )
    return made


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


def heard(
    objects: Sequence[Sequence[float]],
    sizes: Any,
    others: Mapping[str, Sensor] | None = None,
    **changes: Any,
) -> float | None:
    """Distance of the detection of one run from the origin, None for none."""
    context = scene_context(sizes)
    found = look(context, scene(context, objects), others, **changes)
    return float(found.detections[0, 0, 0]) if found.mask[0, 0] else None


def aside(distance: float, degrees: float) -> tuple[float, float, float]:
    """Place of what turns a face to the sensor, at a bearing."""
    bearing = math.radians(degrees)
    return distance * math.cos(bearing), distance * math.sin(bearing), bearing


def test_wall_ahead_is_a_point_on_the_axis_of_which_nothing_else_is_known() -> None:
    context = scene_context([WALL], kinds=["building"])
    found = look(context, scene(context, [(3.1, 4.0)]), mount={"x": "1 m"})
    assert found.detections.shape == (1, 1, 7)
    row = found.detections[0, 0]
    assert row[:2] == pytest.approx([3.0, 0.0])
    assert row[signals.DETECTION_CLASS] == -1.0
    assert not row[
        [signals.DETECTION_LENGTH, signals.DETECTION_WIDTH, signals.DETECTION_HAS_RANGE_RATE]
    ].any()


BLIND = {"blind_zone": "0.2 m"}
ECHOES: dict[str, tuple[list[tuple[float, ...]], list[Any], dict[str, Any], float | None]] = {
    "what is aside is reported on the axis": ([aside(3.0, 25.0)], [POST], {}, 2.99),
    "the cone ends to the left": ([aside(3.0, 31.0)], [POST], {}, None),
    "just inside of the cone to the left": ([aside(3.0, 29.0)], [POST], {}, 2.99),
    "just inside of the cone to the right": ([aside(3.0, -29.0)], [POST], {}, 2.99),
    "behind": ([(-2.0, 0.0)], [POST], {}, None),
    "just within the range": ([(5.09, 0.0)], [WALL], BLIND, 4.99),
    "beyond the range": ([(5.11, 0.0)], [WALL], BLIND, None),
    "in the blind zone": ([(0.29, 0.0)], [WALL], BLIND, None),
    "behind what is in the blind zone": ([(0.2, 0.0), (3.0, 0.0)], [WALL, WALL], {}, None),
    # A post there hides the way to a wall at right angles, but not to a post aside.
    "aside of what is in the blind zone": (
        [(0.11, 0.0), (3.0, 0.5)],
        [POST, POST],
        {},
        math.hypot(3.0, 0.5) - 0.012,
    ),
    # A wall echoes from the foot of its perpendicular only.
    "wall at right angles": ([aside(3.1, 0.0)], [WALL], {}, 3.0),
    "oblique wall": ([aside(3.1, 20.0)], [WALL], {}, 3.0),
    "very oblique wall": ([aside(3.1, 29.0)], [WALL], {}, 3.0),
    "wall whose perpendicular is outside": ([aside(3.1, 35.0)], [WALL], {}, None),
    # A box that turns a corner to the sensor, straight ahead.
    "corner between oblique faces": (
        [(3.0 + math.sqrt(0.5), 0.0, math.pi / 4.0)],
        [(1.0, 1.0, 1.0)],
        {},
        3.0,
    ),
    # The side of a car beside has no perpendicular in the cone, but its rear corner is in view.
    "near end of what is beside": ([(4.25, 1.5)], [CAR], {}, math.hypot(2.0, 0.6)),
    "touching, in the blind zone": ([(0.0, 0.0)], [CAR], {}, None),
    "touching, without one": ([(0.0, 0.0)], [CAR], {"blind_zone": "0 m"}, 0.0),
}
"""Objects and their sizes, fields of the record, and the distance that is heard."""


def test_echo_comes_from_the_nearest_point_that_reflects_in_the_cone_beyond_the_blind_zone() -> (
    None
):
    for name, (objects, sizes, changes, distance) in ECHOES.items():
        found = heard(objects, sizes, **changes)
        expected = None if distance is None else pytest.approx(distance, abs=0.005)
        assert found == expected, name


@pytest.mark.parametrize("yaw", [0.0, 90.0, -120.0, 180.0])
def test_detection_lies_on_the_axis_of_the_mount(yaw: float) -> None:
    context = scene_context([POST])
    found = look(context, scene(context, [aside(3.0, yaw)]), mount={"yaw": f"{yaw} deg"})
    expected = aside(2.99, yaw)[:2]
    assert found.detections[0, 0, :2] == pytest.approx(expected, abs=1e-9)


def test_nearest_of_several_is_heard_whatever_their_order() -> None:
    objects = [(3.0, 0.6), (2.0, -0.5), (4.0, 0.0)]
    context = scene_context([POST] * 3)
    found = look(context, scene(context, objects))
    turned = look(context, scene(context, objects[::-1]))
    assert (found.source[0, 0], turned.source[0, 0]) == (1, 1)
    np.testing.assert_array_equal(found.detections, turned.detections)


@pytest.mark.parametrize(("distance", "sigma"), [(3.0, 0.02), (0.01, 0.05)])
def test_noise_has_the_stated_mean_and_deviation_near_by_too(distance: float, sigma: float) -> None:
    context = scene_context([WALL], runs=4000)
    shown = scene(context, [(distance + 0.1, 0.0)])
    found = look(context, shown, range_noise=f"{sigma} m", blind_zone="0 m").detections[:, 0, 0]
    assert found.mean() == pytest.approx(distance, abs=4.0 * sigma / math.sqrt(4000.0))
    assert found.std() == pytest.approx(sigma, rel=4.0 / math.sqrt(8000.0))


# --- cross-talk -----------------------------------------------------------------------------------

OTHER = {"mount": {"x": "2 m", "y": "0 m"}}


SHARED: dict[str, tuple[tuple[float, float], Any, dict[str, str], float | None, float]] = {
    # This sensor at the origin, the other one 2 m nearer to the post: 4 m and 2 m of way.
    "nearer sender": ((4.01, 0.0), POST, {"x": "2 m"}, 4.0, 3.0),
    # Both look ahead; the other one is 1 m to the left and 1 m nearer.
    "mirror image": ((3.1, 0.0), WALL, {"x": "1 m", "y": "1 m"}, 3.0, 0.5 * math.hypot(5.0, 1.0)),
    "sender farther away": ((3.1, 0.0), WALL, {"x": "-1 m"}, 3.0, 3.0),
    "sender that looks elsewhere": ((4.01, 0.0), POST, {"x": "2 m", "yaw": "90 deg"}, 4.0, 4.0),
    "sender beyond": ((4.01, 0.0), POST, {"x": "8 m"}, 4.0, 4.0),
    "post beyond the own range": ((6.01, 0.0), POST, {"x": "4 m"}, None, 0.5 * (6.0 + 2.0)),
}
"""An object and its size, the mount of the sender, the distance alone and with cross-talk."""


def test_with_cross_talk_half_of_the_way_from_the_sender_is_taken_for_the_distance() -> None:
    for name, (place, size, mount, alone, shared) in SHARED.items():
        other = {"other": spec(mount=mount)}
        expected = None if alone is None else pytest.approx(alone)
        assert heard([place], [size], other) == expected, name
        assert heard([place], [size], other, cross_talk=True) == pytest.approx(shared), name


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
