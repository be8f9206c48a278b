"""Physical radar on hand-made scenes, by many samples, and in the closed loop."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    DETECTION_WIDTH,
    EGO_SPEED,
    EGO_X,
    EGO_YAW_RATE,
    Floats,
    Measurement,
    Scene,
    SceneContext,
)
from adeye.simulate import engine
from adeye.simulate.sensors.radar import RadarSensor, decibels
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.simulate.world.objects import CROSS_SECTION
from adeye.simulate.world.weather import MM_PER_HOUR
from adeye.spec.architecture import Architecture
from adeye.spec.sensors import PhysicalRadar, Radar
from adeye.trace import Trace
from tests.motorway import ARCHITECTURE, make_case, make_scenario
from tests.simulate.sensors.scenes import CAR, TRUCK, scene, scene_context, seen, sensor_context

RUNS = 4000
QUIET = {"clutter": 0.0, "false_alarm_rate": 1e-9}
"""Without anything that is not there: less than one false alarm in a thousand samples."""
PERSON = (0.5, 0.5, 1.8)


def spec(**changes: Any) -> PhysicalRadar:
    fields: dict[str, Any] = {
        "kind": "radar",
        "fidelity": "physical",
        "mount": {"x": "0 m"},
        "field_of_view": "60 deg",
        "range": "150 m",
        "rate": "20 Hz",
    }
    return PhysicalRadar.model_validate({**fields, **QUIET, **changes})


def look(context: SceneContext, shown: Scene, **changes: Any) -> Measurement:
    """Sample one scene with one new sensor."""
    return RadarSensor(sensor_context(spec(**changes), context)).sense(shown)


def rear_at(distance: float, y: float = 0.0, speed: float = 0.0) -> tuple[float, ...]:
    """State of a car ahead whose rear is at a distance."""
    return (distance + 0.5 * CAR[0], y, 0.0, speed)


def detected(distance: float, kind: str = "car", size: Any = CAR, **changes: Any) -> float:
    """Share of many runs in which an object straight ahead is detected."""
    weather = {name: changes.pop(name) for name in ("rain",) if name in changes}
    context = scene_context([size], runs=RUNS, kinds=[kind], **weather)
    at = (distance + 0.5 * size[0], 0.0)
    found = look(context, scene(context, [at]), **changes)
    return float((found.source == 0).any(axis=1).mean())


def assert_share(share: float, expected: float) -> None:
    """Within four standard deviations of the binomial distribution."""
    assert share == pytest.approx(expected, abs=4.0 * math.sqrt(expected * (1 - expected) / RUNS))


# --- what is detected -----------------------------------------------------------------------------


def test_car_is_detected_half_of_the_time_at_the_range() -> None:
    assert_share(detected(150.0), 0.5)


@pytest.mark.parametrize("distance", [90.0, 120.0, 180.0, 220.0])
def test_detection_follows_the_formula_of_swerling_and_the_fourth_power(distance: float) -> None:
    rate = 1e-6
    half = math.log(rate) / math.log(0.5) - 1.0
    signal = half * (150.0 / distance) ** 4
    share = detected(distance, false_alarm_rate=rate)
    assert_share(share, rate ** (1.0 / (1.0 + signal)))


@pytest.mark.parametrize(
    ("kind", "size"), [("pedestrian", PERSON), ("truck", TRUCK), ("motorcycle", (2.2, 0.8, 1.5))]
)
def test_range_goes_with_the_fourth_root_of_the_cross_section(kind: str, size: Any) -> None:
    ratio = decibels(CROSS_SECTION[kind][0]) / 10.0
    assert_share(detected(150.0 * ratio**0.25, kind, size), 0.5)


def test_edge_of_the_field_of_view_costs_range_by_the_edge_loss() -> None:
    context = scene_context([(0.1, 0.1, 1.5)], runs=RUNS)
    bearing = math.radians(29.99)
    distance = 150.0 * 10.0 ** (-2.0 * 3.0 / 40.0)
    # A post that turns an end to the sensor.
    away = distance + 0.05
    at = (away * math.cos(bearing), away * math.sin(bearing), bearing)
    found = look(context, scene(context, [at]), edge_loss=3.0)
    assert_share(float((found.source == 0).any(axis=1).mean()), 0.5)


def test_nothing_is_seen_outside_of_the_field_of_view() -> None:
    context = scene_context([CAR], runs=8)
    for degrees, is_seen in ((28.0, True), (32.0, False), (180.0, False), (-28.0, True)):
        bearing = math.radians(degrees)
        at = (30.0 * math.cos(bearing), 30.0 * math.sin(bearing), bearing)
        found = look(context, scene(context, [at]))
        assert (found.source == 0).any(axis=1).all() == is_seen, degrees


def test_more_rain_means_fewer_detections() -> None:
    shares = [
        detected(120.0, rain=rate * MM_PER_HOUR, elevation_beam="10 deg")
        for rate in (0.0, 5.0, 20.0, 60.0)
    ]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] - shares[-1] > 0.3


@pytest.mark.slow
def test_both_fidelities_lose_a_car_at_ranges_that_agree_within_two_percent() -> None:
    fields = {"mount": {}, "field_of_view": "60 deg", "range": "150 m", "rate": "20 Hz"}
    exact = Radar.model_validate({"kind": "radar", **fields})
    context = scene_context([CAR])

    def is_seen(distance: float) -> bool:
        shown = scene(context, [rear_at(distance)])
        return bool(seen(RangingSensor(sensor_context(exact, context)).sense(shown)))

    grid = np.arange(140.0, 160.0, 0.5)
    box = max(distance for distance in grid if is_seen(distance))
    echo = max(distance for distance in grid[::2] if detected(distance) >= 0.5)
    assert echo == pytest.approx(box, rel=0.02)


def test_object_that_is_no_number_is_not_detected() -> None:
    context = scene_context([CAR, CAR])
    found = look(context, scene(context, [(math.nan, 0.0), rear_at(40.0, 5.0)]))
    assert 0 not in seen(found)


def test_ended_run_detects_nothing() -> None:
    context = scene_context(runs=2)
    shown = scene(context, [rear_at(30.0)])
    shown.running[1] = False
    found = look(context, shown, clutter=5.0)
    assert found.mask.any(axis=1).tolist() == [True, False]
    assert not found.detections[1].any()


# --- where, and how fast --------------------------------------------------------------------------

FINE: dict[str, Any] = {
    "range_resolution": "1 mm",
    "bearing_resolution": "0.0001 deg",
    "range_rate_resolution": "0.001 m/s",
    "false_alarm_rate": 1e-12,
}
"""Cells so small that errors do not matter."""


def only(found: Measurement) -> Floats:
    """The one detection of the first run."""
    assert found.mask[0].sum() == 1
    row: Floats = found.detections[0, 0]
    return row


def test_lead_is_a_point_at_its_rear_of_unknown_size_and_class() -> None:
    context = scene_context()
    row = only(look(context, scene(context, [rear_at(40.0, 1.0)]), **FINE))
    assert row[:2] == pytest.approx([40.0, 1.0], abs=0.01)
    assert row[DETECTION_HAS_RANGE_RATE] == 1.0
    assert (row[DETECTION_LENGTH], row[DETECTION_WIDTH], row[DETECTION_CLASS]) == (0.0, 0.0, -1.0)


def test_crossing_car_is_a_point_at_the_middle_of_its_side() -> None:
    context = scene_context()
    row = only(look(context, scene(context, [(40.0, 0.0, math.pi / 2.0, 10.0)]), **FINE))
    assert row[:2] == pytest.approx([40.0 - 0.5 * CAR[1], 0.0], abs=0.01)


def test_truck_beside_the_path_stays_beside_it_as_the_ego_comes_near() -> None:
    context = scene_context([TRUCK], kinds=["truck"])
    for distance in (80.0, 40.0, 20.0, 10.0):
        row = only(look(context, scene(context, [(distance + 5.0, 3.5)]), **FINE))
        assert 3.0 < row[1] <= 3.5, distance


@pytest.mark.parametrize(
    ("target", "ego_speed", "rate"),
    [
        (rear_at(50.0, speed=20.0), 30.0, -10.0),
        ((50.0, 0.0, math.pi, 25.0), 30.0, -55.0),
        ((50.0, 0.0, math.pi / 2.0, 15.0), 0.0, 0.0),
        (rear_at(50.0), 0.0, 0.0),
    ],
    ids=["lead", "oncoming", "crossing", "standing"],
)
def test_range_rate_is_the_radial_speed(
    target: tuple[float, ...], ego_speed: float, rate: float
) -> None:
    context = scene_context()
    shown = scene(context, [target], ego=(0.0, 0.0, 0.0, ego_speed))
    assert only(look(context, shown, **FINE))[DETECTION_RANGE_RATE] == pytest.approx(rate, abs=0.01)


def test_range_rate_of_what_stands_aside_is_the_ego_speed_along_the_line_of_sight() -> None:
    context = scene_context([(0.1, 0.1, 1.0)])
    shown = scene(context, [(30.0, 10.0)], ego=(0.0, 0.0, 0.0, 20.0))
    row = only(look(context, shown, **FINE, field_of_view="90 deg"))
    expected = -20.0 * 30.0 / math.hypot(30.0, 10.0)
    assert row[DETECTION_RANGE_RATE] == pytest.approx(expected, abs=0.02)


def test_sensor_at_the_bumper_moves_sideways_as_the_ego_turns() -> None:
    context = scene_context([(0.1, 0.1, 1.0)])
    shown = scene(context, [(23.0, 20.0)])
    shown.ego[:, EGO_YAW_RATE] = 0.5
    row = only(look(context, shown, **FINE, mount={"x": "3 m"}, field_of_view="120 deg"))
    # 1.5 m/s to the left, seen at 45 degrees.
    assert row[DETECTION_RANGE_RATE] == pytest.approx(-1.5 * math.sqrt(0.5), abs=0.01)


def test_oncoming_car_beyond_the_span_seems_to_drive_away() -> None:
    context = scene_context()
    shown = scene(context, [(60.0, 0.0, math.pi, 40.0)], ego=(0.0, 0.0, 0.0, 30.0))
    row = only(look(context, shown, **FINE, max_range_rate="50 m/s"))
    assert row[DETECTION_RANGE_RATE] == pytest.approx(30.0, abs=0.01)


@pytest.mark.parametrize("degrees", [20.0, -20.0])
def test_yaw_shifts_what_is_in_view_and_leaves_the_place(degrees: float) -> None:
    context = scene_context([(0.1, 0.1, 1.0)])
    bearing = math.radians(degrees)
    at = (30.0 * math.cos(bearing), 30.0 * math.sin(bearing))
    narrow: dict[str, Any] = {**FINE, "field_of_view": "10 deg"}
    turned = look(context, scene(context, [at]), **narrow, mount={"yaw": f"{degrees} deg"})
    assert only(turned)[:2] == pytest.approx(at, abs=0.06)
    assert not look(context, scene(context, [at]), **narrow).mask.any()


def test_errors_shrink_with_the_signal_down_to_a_floor() -> None:
    context = scene_context([(0.001, 0.001, 1.0)], runs=RUNS)
    spreads = []
    for distance in (10.0, 110.0):
        found = look(context, scene(context, [(distance, 0.0)]), range_resolution="2 m")
        there = found.source[:, 0] == 0
        spreads.append(found.detections[there, 0, 0].std())
    assert spreads[0] == pytest.approx(0.05 * 2.0, rel=0.06)
    assert 1.3 * spreads[0] < spreads[1] < 2.0 / math.sqrt(2.0 * math.log(1e9))


# --- cells ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("other", "ego_speed", "detections"),
    [
        ((60.3, 0.0, 0.0, 0.0), 0.0, 1),
        ((61.0, 0.0, 0.0, 0.0), 0.0, 2),
        ((60.0, 1.0, 0.0, 0.0), 0.0, 1),
        ((60.0, 2.5, 0.0, 0.0), 0.0, 2),
        ((60.3, 0.0, 0.0, 1.0), 0.0, 2),
    ],
    ids=["one cell", "ranges", "bearings in one", "bearings", "rates"],
)
def test_posts_in_one_cell_are_one_detection(
    other: tuple[float, ...], ego_speed: float, detections: int
) -> None:
    # Posts too thin to hide each other.
    context = scene_context([(1e-3, 1e-4, 1.0), (1e-3, 1e-3, 1.0)], runs=64)
    shown = scene(context, [(60.0, 0.0, 0.0, 0.0), other], ego=(0.0, 0.0, 0.0, ego_speed))
    found = look(context, shown, range="1000 m", false_alarm_rate=1e-12)
    assert found.mask.sum() == pytest.approx(64 * detections, abs=2 * detections)


def test_person_beside_a_parked_truck_is_not_seen_on_its_own_until_he_moves() -> None:
    context = scene_context([TRUCK, PERSON], kinds=["truck", "pedestrian"], runs=64)
    truck = (45.0, 0.0, 0.0, 0.0)
    coarse = {"bearing_resolution": "4 deg", "range_resolution": "1 m"}
    shares = []
    for speed in (0.0, 1.5):
        shown = scene(context, [truck, (40.3, 1.8, math.pi, speed)])
        shares.append((look(context, shown, **coarse).source == 1).any(axis=1).mean())
    assert shares[0] == 0.0
    assert shares[1] > 0.7


# --- occlusion ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("y", "share"), [(0.0, 0.0), (2.05, 0.5), (6.0, 1.0)], ids=["hidden", "half", "free"]
)
def test_power_goes_with_the_visible_share(y: float, share: float) -> None:
    # A thin wall from -1 to 1 at 50 m throws a shadow from -2 to 2 at 100 m, where the rear of the
    # car is 1.8 m wide.
    context = scene_context([(0.01, 2.0, 2.0), CAR], runs=RUNS, kinds=["barrier", "car"])
    y = y if share != 0.5 else 2.0
    shown = scene(context, [(50.0, 0.0), rear_at(100.0, y)])
    found = look(context, shown, edge_loss=0.0, false_alarm_rate=1e-6)
    detections = float((found.source == 1).any(axis=1).mean())
    half = math.log(1e-6) / math.log(0.5) - 1.0
    signal = share * half * 1.5**4
    expected = 1e-6 ** (1.0 / (1.0 + signal)) if share > 0.0 else 0.0
    # The far edges of the car are seen a little past its rear.
    assert detections == pytest.approx(expected, abs=0.03)


# --- what is not there ----------------------------------------------------------------------------


def ghosts(ticks: int = 50, runs: int = 200, **changes: Any) -> tuple[Any, SceneContext]:
    """Detections of many samples of an empty world by an ego that drives 20 m/s."""
    context = scene_context([CAR], runs=runs)
    sensor = RadarSensor(sensor_context(spec(**changes), context))
    behind = [(-100.0, 0.0)]
    ego = (0.0, 0.0, 0.0, 20.0)
    rows = []
    for tick in range(ticks):
        found = sensor.sense(scene(context, behind, ego=ego, tick=tick))
        assert (found.source == -1).all()
        rows.append((found.mask.copy(), found.detections.copy()))
    return rows, context


@pytest.mark.parametrize(
    ("changes", "mean"),
    [
        ({"false_alarm_rate": 1e-6, "clutter": 0.0}, 1e-6 * 300.0 * 800.0),
        ({"false_alarm_rate": 1e-5, "clutter": 0.0}, 1e-5 * 300.0 * 800.0),
        ({"false_alarm_rate": 1e-12, "clutter": 1.5}, 1.5),
        ({"false_alarm_rate": 1e-6, "clutter": 1.0}, 1.24),
    ],
)
def test_number_of_ghosts_is_that_of_the_record(changes: dict[str, Any], mean: float) -> None:
    rows, _ = ghosts(**changes)
    counts = np.array([mask.sum(axis=1) for mask, _ in rows]).ravel()
    error = math.sqrt(mean / counts.size)
    assert counts.mean() == pytest.approx(mean, abs=4.0 * error)
    assert counts.var() == pytest.approx(mean, rel=0.1)


def ghost_rows(**changes: Any) -> Floats:
    rows, _ = ghosts(**changes)
    listed: Floats = np.concatenate([detections[mask] for mask, detections in rows])
    return listed


def test_clutter_stands_still_and_lies_all_over_the_area_in_view() -> None:
    rows = ghost_rows(clutter=2.0, false_alarm_rate=1e-12)
    distance = np.hypot(rows[:, 0], rows[:, 1])
    bearing = np.arctan2(rows[:, 1], rows[:, 0])
    assert distance.max() <= 150.0
    assert abs(bearing).max() <= math.radians(30.0)
    # Half of the area is nearer than range / sqrt(2).
    assert (distance < 150.0 / math.sqrt(2.0)).mean() == pytest.approx(0.5, abs=0.02)
    assert rows[:, DETECTION_RANGE_RATE] == pytest.approx(-20.0 * np.cos(bearing), abs=0.2)


def test_false_alarms_have_any_range_and_any_rate() -> None:
    rows = ghost_rows(clutter=0.0, false_alarm_rate=1e-5)
    distance = np.hypot(rows[:, 0], rows[:, 1])
    assert (distance < 75.0).mean() == pytest.approx(0.5, abs=0.02)
    assert rows[:, DETECTION_RANGE_RATE].mean() == pytest.approx(0.0, abs=1.5)
    assert rows[:, DETECTION_RANGE_RATE].std() == pytest.approx(80.0 / math.sqrt(3.0), rel=0.03)


def test_another_object_leaves_ghosts_and_other_detections_as_they_were() -> None:
    noisy: dict[str, Any] = {"clutter": 3.0, "false_alarm_rate": 1e-6}
    one = scene_context([CAR], runs=32)
    two = scene_context([CAR, CAR], runs=32)
    alone = look(one, scene(one, [rear_at(60.0)]), **noisy)
    more = look(two, scene(two, [rear_at(60.0), (-80.0, 0.0)]), **noisy)
    for run in range(32):
        np.testing.assert_array_equal(
            alone.detections[run][alone.mask[run]], more.detections[run][more.mask[run]]
        )


def test_runs_with_unlike_clutter_share_a_batch_and_change_nothing_for_each_other() -> None:
    context = scene_context([CAR], runs=2)
    shown = scene(context, [rear_at(60.0)])
    specs = [spec(clutter=0.5), spec(clutter=20.0)]
    both = RadarSensor(replace(sensor_context(specs[0], context), specs=specs)).sense(shown)
    alone = look(context, shown, clutter=0.5)
    count = int(alone.mask[0].sum())
    assert both.mask[0].sum() == count
    np.testing.assert_array_equal(both.detections[0, :count], alone.detections[0, :count])


# --- in the closed loop ---------------------------------------------------------------------------

LEAD = {"kind": "car", "start": {"lane": 1, "s": "260 m", "speed": "25 m/s"}}


FRONT = {
    "kind": "radar",
    "fidelity": "physical",
    "mount": {"x": "2.3 m"},
    "field_of_view": "40 deg",
    "range": "160 m",
    "rate": "20 Hz",
}


def drive(
    front: dict[str, Any], actors: dict[str, Any], runs: int, parameters: Any = None
) -> Trace:
    """Drive for half a minute on one sensor that sees."""
    channel = {"kind": "nominal", "links": ["front", "pose"], "parameters": parameters or {}}
    architecture = Architecture.model_validate(
        {
            **ARCHITECTURE,
            "sensors": {"front": front, "pose": {"kind": "localisation", "rate": "20 Hz"}},
            "channels": {"nominal": channel},
        }
    )
    scenario = make_scenario(actors=actors, horizon="28 s")
    return engine.run(
        [replace(make_case(scenario, seed=seed), architecture=architecture) for seed in range(runs)]
    )


def hardest(trace: Trace) -> Floats:
    """Least acceleration that each run asks for (B,)."""
    least: Floats = trace.columns["acceleration"][:, :, 0].min(axis=1)
    return least


def test_nominal_channel_follows_a_lead_on_one_radar_as_on_the_truth() -> None:
    trace = drive(FRONT, {"lead": LEAD}, 8)
    truth = drive({"kind": "ground_truth", "rate": "20 Hz"}, {"lead": LEAD}, 1)
    assert (trace.columns["contact"] < 0).all()
    end, exact = trace.columns["ego"][:, -1], truth.columns["ego"][0, -1]
    assert end[:, EGO_SPEED] == pytest.approx(exact[EGO_SPEED], abs=0.2)
    assert end[:, EGO_X] == pytest.approx(exact[EGO_X], abs=2.0)
    assert hardest(trace).min() > hardest(truth)[0] - 1.0


def test_ghosts_at_the_default_rate_brake_nobody_in_half_an_hour() -> None:
    assert hardest(drive(FRONT, {}, 60)).min() > -0.5


@pytest.mark.slow
def test_m_of_n_takes_most_of_the_phantom_braking_out_of_heavy_clutter() -> None:
    heavy = {**FRONT, "clutter": 2.0}
    braked = [
        int((hardest(drive(heavy, {}, 60, {"confirm_window": window})) < -3.0).sum())
        for window in (0, 4)
    ]
    assert braked[1] < 0.5 * braked[0]
