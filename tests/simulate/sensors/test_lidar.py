"""Physical lidar as a sensor: its range in rain and fog, its samples, its memory."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.simulate.sensors.lidar import LidarSensor, sample_bytes
from adeye.simulate.world.weather import MM_PER_HOUR
from adeye.spec.sensors import PhysicalLidar
from tests.simulate.sensors import scenes
from tests.simulate.world.test_weather import REFLECTIVITIES, TABLE

DEGREE = math.pi / 180.0
WALL = (0.2, 400.0, 3.0)


def spec(**changes: Any) -> PhysicalLidar:
    fields = {"field_of_view": "360 deg", "beams": 720, "range": "150 m", "rate": "10 Hz"}
    mount = {"mount": {"z": "0.8 m"}}
    made: PhysicalLidar = scenes.sensor_spec("lidar/physical", **(fields | mount | changes))
    return made


def sensor(context: signals.SceneContext, *, name: str = "front", **changes: Any) -> LidarSensor:
    return LidarSensor(scenes.sensor_context(spec(**changes), context, name=name))


def look(
    context: signals.SceneContext, shown: signals.Scene, **changes: Any
) -> signals.Measurement:
    """Sample one scene with one new lidar."""
    return sensor(context, **changes).sense(shown)


def returns(found: signals.Measurement, thing: int | None = None, run: int = 0) -> signals.Floats:
    """Return the rows of one run that are returns, of one object or of all."""
    points, hits = parts(found)
    there = points[run, :, signals.POINT_RANGE] > 0.0
    if thing is not None:
        there &= hits[run] == thing
    found_there: signals.Floats = points[run, there]
    return found_there


def parts(found: signals.Measurement) -> tuple[signals.Floats, signals.Ints]:
    assert found.points is not None
    assert found.hits is not None
    return found.points, found.hits


# --- weather --------------------------------------------------------------------------------------


def farthest(context: signals.SceneContext) -> float:
    """Distance of a wall straight ahead from which on nothing comes back [m]."""
    lidar = sensor(context, field_of_view="1 deg", beams=3, reference_reflectivity=0.9)
    low, high = 1.0, 400.0
    tick = 0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        found = lidar.sense(scenes.scene(context, [(middle + 0.1, 0.0)], tick=tick))
        tick += 1
        # The middle beam; those beside it have a longer way.
        low, high = (middle, high) if parts(found)[0][0, 1, 0] > 0.0 else (low, middle)
    return low


@pytest.mark.parametrize("rain", TABLE)
def test_range_in_rain_is_that_of_the_published_table(rain: float) -> None:
    context = scenes.scene_context([WALL], rain=rain * MM_PER_HOUR)
    for reflectivity, expected in zip(REFLECTIVITIES, TABLE[rain], strict=True):
        context.object_reflectivity[:] = reflectivity
        assert farthest(context) == pytest.approx(expected, rel=0.01)


def test_fog_of_visibility_of_fifty_metres_leaves_the_range_of_the_closed_form() -> None:
    context = scenes.scene_context([WALL], fog_visibility=50.0)
    context.object_reflectivity[:] = 0.9
    z = farthest(context)
    assert z * math.exp(3.912 / 50.0 * z) == pytest.approx(150.0, rel=1e-3)


def test_dark_object_hides_a_bright_one_behind_it_though_it_returns_nothing() -> None:
    context = scenes.scene_context([WALL, WALL])
    context.object_reflectivity[:] = (0.01, 0.9)
    shown = scenes.scene(context, [(60.0, 0.0), (80.0, 0.0)])
    assert len(returns(look(context, shown))) == 0
    assert len(returns(look(context, scenes.scene(context, [(90.0, 0.0), (80.0, 0.0)])), 1)) > 0


# --- samples --------------------------------------------------------------------------------------


def test_memory_that_nobody_holds_is_used_again_and_leaves_nothing_behind() -> None:
    context = scenes.scene_context()
    lidar = sensor(context)
    used = set()
    for tick in range(20):
        # The car goes once around the ego.
        angle = 18.0 * DEGREE * tick
        shown = scenes.scene(context, [(20.0 * math.cos(angle), 20.0 * math.sin(angle))], tick=tick)
        found = lidar.sense(shown)
        used.add(parts(found)[0].ctypes.data)
        assert np.array_equal(parts(found)[0], parts(look(context, shown))[0])
    assert len(used) <= 3


def test_memory_of_a_run_is_that_of_its_beams() -> None:
    lidar = spec(field_of_view="90 deg", beams=100, layers=4, vertical_field_of_view="8 deg")
    pose = {"kind": "localisation", "rate": "10 Hz"}
    assert sample_bytes(scenes.architecture({"lidar": lidar, "pose": pose})) == 3 * 400 * 5 * 8
    assert sample_bytes(scenes.architecture({"pose": pose})) == 0


# --- geometry -------------------------------------------------------------------------------------


def test_ring_of_beams_on_a_wall_gives_its_distance_over_the_cosine() -> None:
    context = scenes.scene_context([WALL])
    found = returns(look(context, scenes.scene(context, [(20.1, 0.0)])))
    bearings = found[:, signals.POINT_BEARING]
    assert found[:, signals.POINT_RANGE] == pytest.approx(20.0 / np.cos(bearings))
    # As far as a car of the wall's reflectivity is seen, in steps of half a degree.
    reach = 150.0 * math.sqrt(0.5 / 0.9)
    assert len(found) == 2 * math.floor(math.acos(20.0 / reach) / (0.5 * DEGREE) + 0.5)


def test_plate_returns_as_many_beams_as_fit_into_its_angle() -> None:
    for distance, width in itertools.product((10.0, 25.0, 60.0), (1.0, 2.0)):
        context = scenes.scene_context([(0.001, width, 2.0)])
        found = returns(look(context, scenes.scene(context, [(distance, 0.0)])))
        angle = 2.0 * math.atan(0.5 * width / distance)
        assert abs(len(found) - angle / (0.5 * DEGREE)) <= 1.0, (distance, width)


def test_empty_beam_is_a_row_of_zeros_and_has_hit_nothing() -> None:
    context = scenes.scene_context()
    points, hits = parts(look(context, scenes.scene(context, [(20.0, 0.0)])))
    empty = points[0, :, signals.POINT_RANGE] == 0.0
    assert 0 < np.count_nonzero(~empty) < 30
    assert not points[0, empty].any()
    assert (hits[0, empty] == -1).all()
    assert (hits[0, ~empty] == 0).all()


def test_points_are_in_the_vehicle_frame_wherever_the_ego_is() -> None:
    context, turn = scenes.scene_context([scenes.TRUCK]), math.pi / 2.0
    plain = returns(look(context, scenes.scene(context, [(30.0, 4.0, 0.1)])))
    there = scenes.scene(context, [(96.0, 80.0, 0.1 + turn)], ego=(100.0, 50.0, turn, 0.0))
    assert returns(look(context, there)) == pytest.approx(plain)


def test_object_behind_the_seam_of_a_whole_turn_is_hit_from_both_sides() -> None:
    context = scenes.scene_context()
    bearings = returns(look(context, scenes.scene(context, [(-20.0, 0.0)])))[
        :, signals.POINT_BEARING
    ]
    assert (bearings > 0.0).any()
    assert (bearings < 0.0).any()
    assert len(bearings) == len(returns(look(context, scenes.scene(context, [(20.0, 0.0)]))))


# --- occlusion and height -------------------------------------------------------------------------


def test_layer_above_a_low_object_sees_what_is_behind_it() -> None:
    context = scenes.scene_context([(4.0, 2.0, 1.0), (4.0, 6.0, 3.0)])
    shown = scenes.scene(context, [(20.0, 0.0), (40.0, 0.0)])
    for height, things in ((0.9, {0, 1}), (1.1, {1})):
        _, hits = parts(look(context, shown, mount={"z": f"{height} m"}, beams=2000))
        assert {int(thing) for thing in hits[0] if thing >= 0} == things
    low = look(context, shown, mount={"z": "0.9 m"}, beams=2000)
    # The far one is wider, so only its edges are in view.
    assert np.abs(returns(low, 1)[:, signals.POINT_BEARING]).min() > math.atan(1.0 / 18.0) - 0.01


def test_beam_that_points_down_returns_from_the_ground_within_its_range() -> None:
    context = scenes.scene_context()
    shown = scenes.scene(context, [(5.0, 50.0)])
    beams: dict[str, Any] = {"field_of_view": "1 deg", "beams": 3}
    found = look(context, shown, **beams, mount={"z": "1 m", "pitch": "5 deg"})
    points, hits = parts(found)
    assert points[0, 1, signals.POINT_RANGE] == pytest.approx(1.0 / math.sin(5.0 * DEGREE))
    assert points[0, 1, signals.POINT_ELEVATION] == pytest.approx(-5.0 * DEGREE)
    assert (hits == -1).all()
    flat = look(context, shown, **beams, mount={"z": "1 m", "pitch": "0.5 deg"})
    assert len(returns(flat)) == 0


def test_pitch_of_the_mount_loses_a_low_object_far_ahead() -> None:
    context = scenes.scene_context()
    shown = scenes.scene(context, [(40.0, 0.0)])
    assert len(returns(look(context, shown), 0)) > 0
    nose_up = {"z": "0.8 m", "pitch": "-2 deg"}
    assert len(returns(look(context, shown, mount=nose_up), 0)) == 0
    # 2 degrees over 17.75 m are 0.62 m: below its roof.
    assert len(returns(look(context, scenes.scene(context, [(20.0, 0.0)]), mount=nose_up), 0)) > 0


def test_pitched_lidar_finds_the_beams_that_meet_an_object_beside_it() -> None:
    # Pitch turns bearings about the side by degrees: the interval of beams must be wide enough.
    context = scenes.scene_context([(3.0, 3.0, 4.0)])
    for bearing in range(0, 360, 15):
        place = (12.0 * math.cos(bearing * DEGREE), 12.0 * math.sin(bearing * DEGREE))
        mount = {"z": "1 m", "pitch": "25 deg"}
        layers = {"layers": 8, "vertical_field_of_view": "60 deg", "beams": 180}
        found = look(context, scenes.scene(context, [place]), mount=mount, **layers)
        rows = returns(found, 0)
        half = math.atan(1.5 / 12.0)
        off = (
            np.mod(rows[:, signals.POINT_BEARING] - bearing * DEGREE + math.pi, 2.0 * math.pi)
            - math.pi
        )
        assert off.min() < -0.5 * half, bearing
        assert off.max() > 0.5 * half, bearing


# --- noise ----------------------------------------------------------------------------------------


def noisy(rain: float = 0.0, **changes: Any) -> signals.Floats:
    """Return ranges and bearings of the middle of a wall 50 m ahead, off by what they should be."""
    context = scenes.scene_context([WALL], runs=20, rain=rain)
    context.object_reflectivity[:] = 1.0
    fine: dict[str, Any] = {"field_of_view": "20 deg", "beams": 400, "range": "50 km"}
    points, _ = parts(look(context, scenes.scene(context, [(50.1, 0.0)]), **fine, **changes))
    angles = ((np.arange(400) + 0.5) / 400 - 0.5) * 20.0 * DEGREE
    ranges = points[:, :, signals.POINT_RANGE] * np.cos(angles) - 50.0
    return np.stack([ranges, points[:, :, signals.POINT_BEARING] - angles])


def test_noise_in_rain_at_fifty_metres_is_that_of_the_published_table() -> None:
    for rain, sigma in ((0.5, 0.155), (1.5, 0.604), (3.5, 0.941), (7.5, 0.999), (40.0, 1.0)):
        off = noisy(rain=rain * MM_PER_HOUR)[0]
        assert off.std() == pytest.approx(sigma, rel=0.03), rain
        assert abs(off.mean()) < 4.0 * sigma / math.sqrt(off.size), rain


def test_noise_of_range_and_bearing_is_that_of_the_spec() -> None:
    ranges, bearings = noisy(range_noise="0.05 m", bearing_noise="0.1 deg")
    assert ranges.std() == pytest.approx(0.05, rel=0.03)
    assert bearings.std() == pytest.approx(0.1 * DEGREE, rel=0.03)
    assert abs(np.corrcoef(ranges.ravel(), bearings.ravel())[0, 1]) < 4.0 / math.sqrt(ranges.size)
    for array in (ranges, bearings):
        assert abs(np.corrcoef(array[:, :-1].ravel(), array[:, 1:].ravel())[0, 1]) < 0.05
    assert noisy() == pytest.approx(np.zeros((2, 20, 400)), abs=1e-12)
    # Variances of the device and of rain add up.
    both = noisy(rain=1.5 * MM_PER_HOUR, range_noise="0.604 m")[0]
    assert both.std() == pytest.approx(0.604 * math.sqrt(2.0), rel=0.03)


def test_drop_out_loses_its_share_of_returns_and_alters_no_other() -> None:
    whole = noisy(range_noise="0.05 m")[0]
    part = noisy(range_noise="0.05 m", drop_out=0.2)[0]
    lost = part == -50.0
    assert np.count_nonzero(lost) / lost.size == pytest.approx(0.2, abs=0.02)
    assert np.array_equal(whole[~lost], part[~lost])


def test_noise_of_a_beam_is_the_same_whatever_else_is_there() -> None:
    one = scenes.scene_context([WALL])
    two = scenes.scene_context([scenes.CAR, WALL, scenes.TRUCK])
    noise = {"range_noise": "0.1 m", "bearing_noise": "0.1 deg", "drop_out": 0.1}
    alone = returns(look(one, scenes.scene(one, [(30.0, 0.0)]), **noise), 0)
    with_others = returns(
        look(two, scenes.scene(two, [(-20.0, 0.0), (30.0, 0.0), (15.0, 2.0)]), **noise), 1
    )
    bearings = {row[signals.POINT_RANGE] for row in alone}
    assert 50 < len(with_others) < len(alone)
    assert {row[signals.POINT_RANGE] for row in with_others} <= bearings
