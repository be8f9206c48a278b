"""Physical lidar as a sensor: its range in rain and fog, its samples, its memory."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.simulate.sensors.lidar import LidarSensor, sample_bytes
from adeye.simulate.world.weather import MM_PER_HOUR
from adeye.testing import check_sensor
from tests.simulate.sensors.lidars import DEGREE, WALL, look, parts, returns, sensor, spec
from tests.simulate.sensors.scenes import CAR, architecture, scene, scene_context, sensor_context
from tests.simulate.world.test_weather import REFLECTIVITIES, TABLE

if TYPE_CHECKING:
    from adeye.signals import SceneContext

# --- weather --------------------------------------------------------------------------------------


def farthest(context: SceneContext) -> float:
    """Distance of a wall straight ahead from which on nothing comes back [m]."""
    lidar = sensor(context, field_of_view="1 deg", beams=3, reference_reflectivity=0.9)
    low, high = 1.0, 400.0
    tick = 0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        found = lidar.sense(scene(context, [(middle + 0.1, 0.0)], tick=tick))
        tick += 1
        # The middle beam; those beside it have a longer way.
        low, high = (middle, high) if parts(found)[0][0, 1, 0] > 0.0 else (low, middle)
    return low


@pytest.mark.parametrize("rain", TABLE)
def test_range_in_rain_is_that_of_the_published_table(rain: float) -> None:
    context = scene_context([WALL], rain=rain * MM_PER_HOUR)
    for reflectivity, expected in zip(REFLECTIVITIES, TABLE[rain], strict=True):
        context.object_reflectivity[:] = reflectivity
        assert farthest(context) == pytest.approx(expected, rel=0.01)


def test_fog_of_visibility_of_fifty_metres_leaves_the_range_of_the_closed_form() -> None:
    context = scene_context([WALL], fog_visibility=50.0)
    context.object_reflectivity[:] = 0.9
    z = farthest(context)
    assert z * math.exp(3.912 / 50.0 * z) == pytest.approx(150.0, rel=1e-3)


def test_dark_object_hides_a_bright_one_behind_it_though_it_returns_nothing() -> None:
    context = scene_context([WALL, WALL])
    context.object_reflectivity[:] = (0.01, 0.9)
    shown = scene(context, [(60.0, 0.0), (80.0, 0.0)])
    assert len(returns(look(context, shown))) == 0
    assert len(returns(look(context, scene(context, [(90.0, 0.0), (80.0, 0.0)])), 1)) > 0


# --- samples --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "changes",
    [
        {"range_noise": "0.05 m", "bearing_noise": "0.1 deg", "drop_out": 0.1},
        {
            "layers": 4,
            "vertical_field_of_view": "10 deg",
            "beams": 90,
            "mount": {"z": "1.5 m", "pitch": "2 deg", "yaw": "10 deg"},
        },
    ],
)
def test_lidar_conforms(changes: dict[str, Any]) -> None:
    check_sensor(LidarSensor, spec(**changes))
    check_sensor(LidarSensor, spec(**changes), every=1, latency=0)
    check_sensor(LidarSensor, spec(**changes), every=1, latency=5)


def test_runs_of_a_batch_may_differ_in_every_value() -> None:
    context = scene_context(runs=3)
    shown = scene(context, [(20.0, 3.0)])
    mounts = [{"z": "0.8 m", "yaw": yaw} for yaw in ("0 deg", "20 deg", "0 deg")]
    specs = [spec(mount=mount, range_noise="0.1 m") for mount in mounts]
    both = replace(sensor_context(specs[0], context), specs=specs)
    points, _ = parts(LidarSensor(both).sense(shown))
    for run, mount in enumerate(mounts):
        alone, _ = parts(look(context, shown, mount=mount, range_noise="0.1 m"))
        assert np.array_equal(points[run], alone[run])


def test_sample_that_somebody_holds_is_not_written_to() -> None:
    context = scene_context()
    lidar = sensor(context)
    held, copies = [], []
    for tick in range(6):
        found = lidar.sense(scene(context, [(20.0 + tick, 0.0)], tick=tick))
        held.append(parts(found))
        copies.append((held[-1][0].copy(), held[-1][1].copy()))
    for one, other in zip(held, copies, strict=True):
        assert np.array_equal(one[0], other[0])
        assert np.array_equal(one[1], other[1])


def test_memory_that_nobody_holds_is_used_again_and_leaves_nothing_behind() -> None:
    context = scene_context()
    lidar = sensor(context)
    used = set()
    for tick in range(20):
        # The car goes once around the ego.
        angle = 18.0 * DEGREE * tick
        shown = scene(context, [(20.0 * math.cos(angle), 20.0 * math.sin(angle))], tick=tick)
        found = lidar.sense(shown)
        used.add(parts(found)[0].ctypes.data)
        assert np.array_equal(parts(found)[0], parts(look(context, shown))[0])
    assert len(used) <= 3


def test_memory_of_a_run_is_that_of_its_beams() -> None:
    lidar = {"kind": "lidar", "fidelity": "physical", "mount": {"z": "1 m"}, "rate": "10 Hz"}
    sensors = {
        "lidar": {
            **lidar,
            "field_of_view": "90 deg",
            "range": "80 m",
            "beams": 100,
            "layers": 4,
            "vertical_field_of_view": "8 deg",
        },
        "pose": {"kind": "localisation", "rate": "10 Hz"},
    }
    assert sample_bytes(architecture(sensors)) == 3 * 400 * 5 * 8
    assert sample_bytes(architecture({"pose": sensors["pose"]})) == 0


def test_ended_run_returns_nothing_more() -> None:
    context = scene_context(runs=2)
    lidar = sensor(context)
    for tick in range(4):
        shown = scene(context, [(20.0, 0.0)], tick=tick)
        shown.running[1] = tick < 2
        found = lidar.sense(shown)
        assert len(returns(found, 0, run=0)) > 0
        assert (len(returns(found, run=1)) > 0) is (tick < 2)


def test_object_at_no_place_returns_nothing() -> None:
    context = scene_context([CAR, CAR])
    found = look(context, scene(context, [(np.nan, 0.0), (20.0, 0.0, np.nan)]))
    assert len(returns(found)) == 0
