"""R8: camera, radar, lidar, ultrasonic sensor, satellite receiver and inertial unit, by their laws.

Each law is asked of a rig that is built from the record of an architecture, as a run's is.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from adeye import signals
from adeye.signals import DETECTION_X, Measurement, SceneContext
from adeye.simulate.sensors.rig import Rig
from adeye.simulate.world.weather import MM_PER_HOUR
from adeye.sweep.case import TestCase
from tests.conftest import MakeProject
from tests.project import CANDIDATE, odd_of, run_cases, use
from tests.simulate.sensors.scenes import CAR, architecture, scene, scene_context
from tests.simulate.world.test_weather import REFLECTIVITIES, TABLE
from tests.stored import known, stored

pytestmark = pytest.mark.requirements

SUITE: dict[str, dict[str, Any]] = stored("six_sensor_types")
"""No localisation and no ground truth: the channel finds its place by receiver and unit."""


@pytest.mark.slow
def test_six_types_run_together_by_name_in_closed_loop(make_project: MakeProject) -> None:
    near = use("cut_in", {"gap": ["20 m"], "relative_speed": ["-20 km/h"]})
    project = make_project(odd_of(near))
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"] = SUITE | {"truth": candidate["sensors"]["truth"]}
        candidate["channels"]["nominal"]["links"] = list(SUITE)
        # The safety channel watches the truth; it does not act.
        candidate["switch"]["policy"] = "stuck"
    plan = project.plan()
    (case,) = plan.cases
    kinds = {sensor.kind for sensor in case.architecture.sensors.values()}
    assert kinds == {"camera", "radar", "lidar", "ultrasonic", "gnss", "imu", "ground_truth"}
    trace = run_cases(plan, [case])
    rows = int(trace.length[0]) - 1
    assert set(trace.layout.sensors) == {*SUITE, "truth"}
    assert trace["sensor_alive"][0, :rows].all()
    names = ("front_camera", "wide_camera", "front_radar", "roof_lidar")
    seeing = [trace.layout.sensors.index(name) for name in names]
    assert trace["detected"][0, :rows, seeing].any(axis=(-1, -2)).all()
    # It knows where it is, sees the cutter, slows down and stays in its lane without touching it.
    nominal = trace.layout.channels.index("nominal")
    status = trace["status"][0, 40:rows, nominal]
    assert set(status.tolist()) == {signals.STATUS_LABELS.index("ok")}
    assert np.isfinite(trace["tracks"][0, :rows, nominal]).any()
    assert (trace["contact"][0, :rows] < 0).all()
    speed = trace["ego"][0, :rows, 3]
    assert speed.min() < speed[0] - 2.0
    assert np.abs(trace["ego_place"][0, :rows, 5]).max() < 0.5


def watch(
    record: dict[str, Any],
    context: SceneContext,
    things: Sequence[Sequence[float]] = (),
    *,
    ticks: int = 1,
) -> list[Measurement]:
    """Let one sensor watch standing objects from a standing ego at the origin."""
    made = SimpleNamespace(architecture=architecture({"tested": record}))
    cases = cast("list[TestCase]", [made] * context.runs)
    rig = Rig(cases, context, Path())
    return [rig.sense(scene(context, things, tick=tick))["tested"].copy() for tick in range(ticks)]


@pytest.mark.parametrize("rain", TABLE)
def test_lidar_has_the_published_range_in_rain(rain: float) -> None:
    look = {"range": "150 m", "field_of_view": "1 deg", "beams": 3, "rate": "20 Hz"}
    record = SUITE["roof_lidar"] | look | {"reference_reflectivity": 0.9}

    def returns(distance: float) -> bool:
        points = watch(record, context, [(distance + 0.1, 0.0)])[0].points
        return bool(known(points)[0, 1, signals.POINT_RANGE] > 0.0)

    for reflectivity, expected in zip(REFLECTIVITIES, TABLE[rain], strict=True):
        context = scene_context([(0.2, 400.0, 3.0)], rain=rain * MM_PER_HOUR)
        context.object_reflectivity[:] = reflectivity
        assert returns(0.99 * expected)
        assert not returns(1.01 * expected)


def test_signal_of_a_radar_falls_with_the_fourth_power_of_the_distance() -> None:
    runs, rate = 4000, 1e-6
    record = SUITE["front_radar"] | {"mount": {}, "clutter": 0, "false_alarm_rate": rate}
    context = scene_context(runs=runs)
    distances = np.array([100.0, 125.0, 150.0, 180.0])
    strengths = []
    for distance in distances:
        found = watch(record, context, [(distance + 0.5 * CAR[0], 0.0)])[0]
        share = (found.source == 0).any(axis=1).mean()
        # Swerling's formula of a fluctuating target, solved for the signal.
        strengths.append(math.log(rate) / math.log(share) - 1.0)
    slope = np.polyfit(np.log10(distances), 10.0 * np.log10(strengths), 1)[0]
    # 40 dB per decade, 12 dB per doubling.
    assert slope == pytest.approx(-40.0, abs=3.0)
    assert strengths[2] == pytest.approx(math.log(rate) / math.log(0.5) - 1.0, rel=0.1)


def test_range_of_a_camera_errs_by_half_a_pixel_on_the_ground() -> None:
    record = SUITE["front_camera"] | {"mount": {"z": "1.3 m"}, "columns": 320, "rows": 120}
    focal = 160.0 / math.tan(math.radians(30.0))
    context = scene_context()
    shares = []
    for distance in np.linspace(10.0, 60.0, 101):
        (found,) = watch(record, context, [(distance + 0.5 * CAR[0], 0.0)])
        error = found.detections[0, 0, DETECTION_X] - 0.5 * CAR[0] - distance
        drop = focal * 1.3 / distance
        shares.append(error / (focal * 1.3 / (drop - 0.5) - distance))
    # Up to the bound and never beyond it, which grows with the distance squared.
    assert 0.8 < max(np.abs(shares)) <= 1.0 + 1e-9


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_ultrasonic_sensor_hears_the_nearest_echo_beyond_its_blind_zone(
    order: tuple[int, ...],
) -> None:
    record = SUITE["left_ultrasonic"] | {"mount": {}, "blind_zone": "0.3 m"}
    # Of posts at 2.5 m, 3.5 m and 4.5 m the nearest, and none that one in the blind zone hides.
    posts = np.array([(2.5, 0.3), (3.5, 0.0), (4.5, -0.2)])[list(order)]
    context = scene_context([(0.02, 0.02, 1.0)] * 3)
    (found,) = watch(record, context, posts.tolist())
    assert np.count_nonzero(found.mask) == 1
    assert found.detections[0, 0, DETECTION_X] == pytest.approx(math.hypot(2.5, 0.3), abs=0.02)
    (found,) = watch(record, context, [(0.2, 0.0), (5.2, 0.0), (-1.0, 0.0)])
    assert not found.mask.any()


@pytest.mark.slow
def test_bias_of_a_receiver_is_correlated_exponentially() -> None:
    runs = 4000
    record = {"kind": "gnss", "rate": "20 Hz", "bias": "2 m", "bias_time": "1.5 s"}
    samples = watch(record, scene_context([], runs=runs), ticks=61)
    bias = np.array([known(sample.values)[:, signals.GNSS_X] for sample in samples])
    assert bias.std(axis=1) == pytest.approx(2.0, rel=4.0 / math.sqrt(2.0 * runs))
    for lag in (1, 10, 30, 60):
        correlation = np.corrcoef(bias[0], bias[lag])[0, 1]
        expected = math.exp(-0.05 * lag / 1.5)
        assert correlation == pytest.approx(expected, abs=4.0 / math.sqrt(runs))


@pytest.mark.slow
def test_heading_by_an_inertial_unit_walks_with_the_root_of_the_time() -> None:
    runs, step = 2000, 0.05
    record = {"kind": "imu", "rate": "20 Hz", "yaw_rate_noise": "0.01 rad/s"}
    samples = watch(record, scene_context([], runs=runs), ticks=401)
    rates = np.array([known(sample.values)[:, signals.IMU_YAW_RATE] for sample in samples[1:]])
    ticks = np.array([50, 100, 200, 400])
    spread = (np.cumsum(rates, axis=0) * step)[ticks - 1].std(axis=1)
    slope = np.polyfit(np.log(ticks * step), np.log(spread), 1)[0]
    assert slope == pytest.approx(0.5, abs=0.05)
    assert spread == pytest.approx(0.01 * step * np.sqrt(ticks), rel=0.07)
