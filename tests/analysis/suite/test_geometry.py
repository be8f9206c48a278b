"""Zones, views and reaches of mounted sensors."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.analysis.suite import geometry
from adeye.analysis.suite.conditions import CLEAR_AIR, TARGETS, Condition, target
from adeye.kernel.sight import DISTANCE, DX, OUTLINE_WIDTH
from adeye.signals import ILLUMINANCE, parameter_record
from adeye.simulate.sensors.ranging import reach_in_glare
from adeye.simulate.world.weather import MM_PER_HOUR, camera_range, lidar_range
from adeye.spec.sensors import Sensor
from tests.analysis.suite.rigs import BUMPER, FRONT, LENGTH, ROOF, WIDTH, architecture, view
from tests.stored import known

ZONES = {zone.id: zone for zone in geometry.zones_of(LENGTH, WIDTH)}


def test_area_of_a_rectangle_is_exact_and_of_a_triangle_half_of_its_box() -> None:
    assert geometry.cells_of(ZONES["front_near"], LENGTH, WIDTH).area == pytest.approx(46.0 * 3.5)
    assert geometry.cells_of(ZONES["rear_left"], LENGTH, WIDTH).area == pytest.approx(55.0 * 3.5)
    triangle = geometry.Zone("t", "t", "car", ((10.0, 0.0), (40.0, 0.0), (10.0, 20.0)))
    assert geometry.cells_of(triangle, LENGTH, WIDTH).area == pytest.approx(300.0, rel=0.02)


def test_near_field_is_a_ring_around_the_body() -> None:
    cells = geometry.cells_of(ZONES["near_field"], LENGTH, WIDTH)
    ring = (LENGTH + 4.0) * (WIDTH + 4.0) - LENGTH * WIDTH
    assert cells.area == pytest.approx(ring, rel=0.02)
    x, y = cells.points
    assert not ((np.abs(x) < 0.5 * LENGTH) & (np.abs(y) < 0.5 * WIDTH)).any()


def test_lanes_do_not_overlap() -> None:
    lanes = [zone for name, zone in ZONES.items() if name != "near_field"]
    for one, other in itertools.combinations(lanes, 2):
        x, y = geometry.cells_of(one, LENGTH, WIDTH).points
        assert not geometry.within(np.array(other.outline_m), x, y).any(), (one.id, other.id)


def test_zones_ahead_end_at_the_ranges_of_the_regulation() -> None:
    ends = [max(x for x, _ in ZONES[f"front_{name}"].outline_m) for name in ("near", "mid", "far")]
    assert [end - FRONT for end in ends] == pytest.approx([46.0, 90.0, 150.0])


def test_left_and_right_mirror_each_other() -> None:
    for name, zone in ZONES.items():
        if name.endswith("_left"):
            other = ZONES[name.replace("_left", "_right")]
            assert {(x, -y) for x, y in zone.outline_m} == set(other.outline_m)


TURN = 2.0 * math.pi


def looks(eye: geometry.View, x: float, y: float) -> bool:
    return bool(geometry.looks_at(eye, np.array([x]), np.array([y]))[0])


def mount(x: float, y: float, z: float, yaw: float = 0.0) -> dict[str, float]:
    return {"x": x, "y": y, "z": z, "yaw": yaw}


def test_edge_of_the_field_of_view_is_half_of_it_to_each_side() -> None:
    eye = view(field_of_view=math.radians(40.0))
    for side in (1.0, -1.0):
        for degrees, expected in ((19.9, True), (20.1, False)):
            angle = side * math.radians(degrees)
            x, y = FRONT + 50.0 * math.cos(angle), 50.0 * math.sin(angle)
            assert looks(eye, x, y) is expected


HALF = 0.5 * WIDTH
Points = list[tuple[float, float]]
PLACED: dict[str, tuple[float, dict[str, float], Points, Points]] = {
    "turned to the left": (0.2, mount(0.0, 0.0, 2.0, math.pi / 2.0), [(0.0, 30.0)], [(30.0, 0.0)]),
    "on the roof": (
        TURN, ROOF, [(30.0, 0.0), (-30.0, 0.0), (0.0, 3.0), (0.0, -3.0), (-2.5, 0.0)], []
    ),
    "at the front": (
        TURN, BUMPER,
        [(FRONT + 0.1, 50.0), (FRONT + 0.1, -50.0)], [(FRONT - 0.1, 3.0), (-30.0, 0.0)],
    ),
    "a hand behind the bumper": (
        TURN, mount(FRONT - 0.15, 0.0, 0.5), [(FRONT + 0.1, 20.0)], [(-30.0, 0.0)]
    ),
    "at a corner": (
        TURN, mount(FRONT, HALF, 0.5),
        [(30.0, 0.0), (-30.0, HALF + 0.1), (FRONT + 0.1, -30.0)], [(0.0, -30.0), (-30.0, -5.0)],
    ),
    "behind the windscreen": (
        math.radians(170.0), mount(1.5, 0.0, 1.3), [(50.0, 0.0), (5.0, 10.0)], []
    ),
    "behind the windscreen, all around": (
        TURN, mount(1.5, 0.0, 1.3), [], [(-30.0, 0.0), (1.0, 5.0)]
    ),
    "behind the rear window": (
        1.5, mount(-1.5, 0.0, 1.3, math.pi), [(-30.0, 0.0)], [(30.0, 0.0)]
    ),
    "in a mirror outside of the body": (
        TURN, mount(0.5, HALF + 0.5, 1.0),
        [(-30.0, 2.0), (0.5, 10.0), (30.0, -1.0)], [(0.5, -10.0)],
    ),
}  # fmt: skip
"""Field of view and mount, what is seen from there, and what the body hides."""


def test_sensor_looks_where_the_body_lets_it() -> None:
    for name, (angle, place, seen, hidden) in PLACED.items():
        eye = view(field_of_view=angle, mount=place)
        assert all(looks(eye, *point) for point in seen), name
        assert not any(looks(eye, *point) for point in hidden), name
    assert view(field_of_view=TURN, mount=ROOF).body is None


@given(
    x=st.floats(-2.4, 2.4), y=st.floats(-0.9, 0.9), yaw=st.floats(-3.1, 3.1),
    angle=st.floats(-3.1, 3.1),
)  # fmt: skip
def test_who_is_seen_from_afar_is_seen_from_the_edge_on(
    x: float, y: float, yaw: float, angle: float
) -> None:
    """A ray that has left the body does not come back: hidden is a matter of bearing alone."""
    eye = view(field_of_view=TURN, mount=mount(x, y, 0.5, yaw))
    ways = np.array([8.0, 20.0, 100.0])
    seen = geometry.looks_at(eye, x + ways * math.cos(angle), y + ways * math.sin(angle))
    assert seen.all() or not seen.any()


def test_free_way_ends_at_the_body() -> None:
    eye = view(field_of_view=TURN, mount=mount(0.0, 3.0, 1.0))
    found = geometry.free_way(eye, np.array([0.0, 0.0, 1.0]), np.array([-1.0, 1.0, 0.0]))
    assert found[0] == pytest.approx(3.0 - 0.5 * WIDTH)
    assert found[1:].tolist() == [math.inf, math.inf]


def test_range_is_measured_from_the_mount() -> None:
    eye = view(mount=BUMPER)
    x, y = np.array([FRONT + 50.0, FRONT + 50.1, FRONT]), np.zeros(3)
    assert geometry.distance(eye, x[:2], y[:2]) == pytest.approx([50.0, 50.1])
    for near, far_, seen in ((0.0, 50.0, [True, False]), (50.05, 60.0, [False, True])):
        assert geometry.sees(eye, geometry.Reach(near, far_), x[:2], y[:2]).tolist() == seen
    assert not geometry.sees(eye, geometry.Reach(0.0, 0.0), x[2:], y[2:]).any()


CLEAR = Condition("clear", 0.0, 1e12, "day", 0.9)
CONDITIONS = (
    CLEAR,
    Condition("rain", 7.5 * MM_PER_HOUR, CLEAR_AIR, "day", 0.6),
    Condition("fog", 0.0, 60.0, "day", 0.9),
    Condition("night", 0.0, CLEAR_AIR, "night", 0.9),
)
LOW = {"x": 2.4, "y": 0.0, "z": 0.5}


def sensor(**content: Any) -> Sensor:
    return architecture({"eye": {"rate": 20.0, **content}}).sensors["eye"]


def camera(**changes: Any) -> Sensor:
    own = {"kind": "camera", "mount": ROOF, "field_of_view": 0.8, "range": 100.0}
    return sensor(**(own | changes))


def physical_camera(**changes: Any) -> Sensor:
    own = {"kind": "camera", "fidelity": "physical", "mount": {**ROOF, "z": 1.3}}
    image = {"field_of_view": math.pi / 2.0, "columns": 160, "rows": 60}
    return sensor(**(own | image | changes))


def physical_lidar(**changes: Any) -> Sensor:
    own = {"kind": "lidar", "fidelity": "physical", "mount": LOW, "range": 150.0}
    return sensor(**(own | {"field_of_view": 1.0, "beams": 200} | changes))


def physical_radar() -> Sensor:
    return sensor(kind="radar", fidelity="physical", mount=LOW, field_of_view=0.7, range=200.0)


def far(eye: Sensor, kind: str = "car", condition: Condition = CLEAR) -> float:
    reach = known(geometry.reach_of(eye, target(kind), condition))
    return reach.far


def test_object_camera_reaches_as_its_sensor_model() -> None:
    rain = CONDITIONS[1]
    expected = camera_range(100.0, rain.rain_mps, rain.visibility_m, 1.0)
    assert far(camera(), condition=rain) == expected
    night = CONDITIONS[3]
    expected = camera_range(100.0, 0.0, night.visibility_m, 0.4)
    assert far(camera(night_range=0.4), condition=night) == expected
    # One that keeps nothing at night is blind.
    assert far(camera(night_range=0.0), condition=night) == 0.0


def test_object_lidar_reaches_as_its_sensor_model() -> None:
    eye = sensor(kind="lidar", mount=ROOF, field_of_view=6.0, range=150.0)
    rain = CONDITIONS[1]
    for look in map(target, TARGETS):
        expected = lidar_range(150.0, look.reflectivity, 0.9, rain.rain_mps, rain.visibility_m)
        assert far(eye, look.id, rain) == expected


def test_object_radar_keeps_its_range_in_rain() -> None:
    eye = sensor(kind="radar", mount=LOW, field_of_view=0.7, range=180.0)
    assert [far(eye, condition=item) for item in CONDITIONS] == [180.0] * 4


def test_physical_camera_by_day_reaches_to_its_rows_and_behind_a_cover_nowhere() -> None:
    # A right angle over 160 columns is a focal length of 80 pixels; the car is 1.5 m tall.
    for height in (2, 4):
        eye = physical_camera(min_pixel_height=height)
        assert far(eye) == pytest.approx(80.0 * 1.5 / height)
    assert far(physical_camera(transmission=0.0)) == pytest.approx(0.0, abs=1e-9)


def test_physical_camera_at_night_sees_what_its_own_headlamps_light() -> None:
    sharp = {"columns": 1024, "field_of_view": 0.5}
    night = Condition("night", 0.0, 1e12, "night", 0.9)
    # 5 lx on a pedestrian: see the kernel's test; a little less distance gives the moon's 0.1 lx.
    ahead = far(physical_camera(**sharp), "pedestrian", night)
    assert ahead == pytest.approx(math.sqrt(20_000.0 / 4.9), rel=1e-6)
    aside = physical_camera(**sharp, mount=mount(0.0, 1.0, 1.3, 1.7))
    assert far(aside, "pedestrian", night) == pytest.approx(0.0, abs=1e-6)


def test_physical_radar_follows_the_fourth_root_of_the_cross_section_and_loses_in_rain() -> None:
    eye = physical_radar()
    assert far(eye) == pytest.approx(200.0)
    assert far(eye, "pedestrian") == pytest.approx(200.0 * 10.0 ** (0.25 * -1.8))
    found = far(eye, condition=CONDITIONS[1])
    decibels = 1.1276 * 7.5**0.7073 * 2.0 * found / 1000.0
    # Both ways through the rain, and 40 dB for ten times the distance.
    assert 40.0 * math.log10(200.0 / found) == pytest.approx(decibels, rel=1e-9)


def test_physical_lidar_needs_its_beams_on_the_face() -> None:
    eye = physical_lidar(min_points=4)
    expected = 1.8 / (2.0 * math.tan(0.5 * 4.0 * 1.0 / 200.0))
    assert far(eye) == pytest.approx(expected, abs=0.26)
    assert far(eye) <= expected


def test_physical_lidar_ends_where_the_light_does_or_without_a_return_at_once() -> None:
    assert far(physical_lidar(beams=4096)) == lidar_range(150.0, 0.5, 0.9, 0.0, 1e12)
    assert far(physical_lidar(beams=4096, drop_out=1.0)) == 0.0


def test_level_layer_above_the_car_never_hits_it_but_a_taller_thing() -> None:
    above = physical_lidar(mount={**LOW, "z": 1.6})
    assert geometry.reach_of(above, target("car"), CLEAR) == geometry.Reach(0.0, 0.0)
    assert far(above, "pedestrian") > 20.0


def test_roof_lidar_sees_a_car_from_where_its_lowest_layer_meets_the_roof() -> None:
    eye = physical_lidar(
        mount={**ROOF, "z": 2.0}, layers=64, vertical_field_of_view=0.4, beams=4096
    )
    reach = known(geometry.reach_of(eye, target("car"), CLEAR))
    assert reach.near == pytest.approx(0.5 / math.tan(0.2), abs=0.26)
    assert reach.far > 50.0


def test_ultrasonic_sensor_begins_behind_its_blind_zone() -> None:
    eye = sensor(kind="ultrasonic", mount=LOW, field_of_view=1.0, range=5.0, blind_zone=0.3)
    assert geometry.reach_of(eye, target("car"), CLEAR) == geometry.Reach(0.3, 5.0)


def test_what_does_not_look_around_has_no_reach() -> None:
    for kind in ("localisation", "ground_truth", "gnss", "./own.py:Sonar"):
        assert geometry.reach_of(sensor(kind=kind), target("car"), CLEAR) is None


@pytest.mark.parametrize("make", [camera, physical_camera, physical_lidar])
def test_nothing_reaches_further_in_worse_conditions(make: Any) -> None:
    for kind in TARGETS:
        best = far(make(), kind)
        assert all(far(make(), kind, item) <= best for item in CONDITIONS)


def test_camera_that_looks_down_loses_what_is_far_and_one_that_looks_up_what_is_low() -> None:
    level = physical_camera(min_pixel_height=2)
    for pitch in (0.7, -0.7):
        turned = physical_camera(min_pixel_height=2, mount={**ROOF, "z": 1.3, "pitch": pitch})
        assert far(turned) < 0.1 * far(level)


def low_sun(elevation: float, visibility: float = 1e12) -> Condition:
    return Condition("low_sun", 0.0, visibility, "day", 0.9, elevation)


@pytest.mark.slow
def test_object_camera_reaches_as_its_sensor_model_in_a_low_sun() -> None:
    elevation = math.radians(5.0)
    weather = {"rain": 0.0, "visibility": 300.0, "illuminance": ILLUMINANCE["day"]}
    sun = {"sun_elevation": elevation, "sun_azimuth": 0.0}
    record = parameter_record({"range": 100.0, "night_range": 1.0, **weather, **sun})[0]
    ahead = np.zeros(OUTLINE_WIDTH)
    ahead[DISTANCE] = ahead[DX] = 50.0
    modelled = reach_in_glare(record, 1e9, ahead)
    analysed = far(camera(night_range=1.0), condition=low_sun(elevation, 300.0))
    assert analysed == pytest.approx(modelled, rel=1e-12)
    assert analysed < 0.9 * far(camera(night_range=1.0), condition=low_sun(1.5, 300.0))


def test_contrast_that_a_low_sun_veils_is_missing_in_the_image() -> None:
    elevation, visibility = math.radians(15.0), 200.0
    eye = physical_camera(columns=1024, rows=512, contrast_threshold=0.05, headlamps=0.0)
    contrast = target("car").contrast
    luminance = 0.2 * 2e4 / math.pi
    veiling = 10.0 * 2e4 * math.cos(elevation) / 15.0**2
    light = math.sqrt(1.0 + 120.0 / 2e4)
    left = contrast * luminance / (luminance + veiling) / (0.05 * light)
    assert ILLUMINANCE["day"] == 2e4
    expected = math.log(left) * visibility / 3.912
    assert far(eye, condition=low_sun(elevation, visibility)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("make", [camera, physical_camera])
def test_camera_loses_more_the_nearer_it_looks_to_the_sun(make: Callable[..., Sensor]) -> None:
    def left(yaw: float, elevation: float) -> float:
        eye = make(mount={**ROOF, "z": 1.3, "yaw": yaw}, field_of_view=0.8)
        return far(eye, condition=low_sun(elevation, 200.0))

    lower = [left(0.0, math.radians(angle)) for angle in (40.0, 20.0, 10.0, 5.0, 2.0)]
    assert lower == sorted(lower, reverse=True)
    assert lower[-1] < 0.8 * lower[0]
    aside = [left(yaw, 0.05) for yaw in (0.3, 0.6, 1.0, math.pi)]
    assert aside == sorted(aside)
    # Within the field of view it does not matter where the axis points.
    assert left(0.3, 0.05) == pytest.approx(left(0.0, 0.05), rel=0.05)
    behind = make(mount={**ROOF, "z": 1.3, "yaw": math.pi}, field_of_view=0.8)
    assert left(math.pi, 0.05) == left(-math.pi, 0.05) == far(behind, condition=fog(200.0))


def fog(visibility: float) -> Condition:
    return Condition("fog", 0.0, visibility, "day", 0.9)


def test_low_sun_takes_nothing_from_radar_and_lidar() -> None:
    for kind in ("radar", "lidar"):
        eye = sensor(kind=kind, mount=LOW, field_of_view=0.8, range=100.0)
        assert far(eye, condition=low_sun(0.05)) == far(eye)
