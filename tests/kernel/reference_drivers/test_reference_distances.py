"""Distances of the reference drivers: the regulation's tables, and the duty of the cut-in rule."""

import math

import numpy as np
import pytest

from adeye.kernel.criticality import ramped_stopping_distance, stopping_distance
from adeye.kernel.reference_drivers import parameters as columns
from adeye.kernel.reference_drivers.parameters import MODELS, CarefulDriver, parameters_of, vector
from adeye.kernel.reference_drivers.reactions import (
    following_distance,
    must_be_avoided,
    r157_following_distance,
)


@pytest.mark.parametrize(
    ("speed_kmh", "distance"),
    [(7.2, 2.0), (10, 3.1), (20, 6.7), (30, 10.8), (40, 15.6), (50, 20.8), (60, 26.7), (1, 2.0)],
)
def test_following_distance_of_the_regulation(speed_kmh: float, distance: float) -> None:
    assert r157_following_distance(speed_kmh / 3.6) == pytest.approx(distance, abs=0.051)


@pytest.mark.parametrize("model", MODELS)
def test_faster_ego_follows_further_behind(model: str) -> None:
    row = vector(parameters_of(model))
    distances = [following_distance(MODELS[model], row, float(v)) for v in range(3, 40)]
    assert distances == sorted(distances)
    assert distances[0] > 0.0


def test_careful_driver_follows_at_two_seconds() -> None:
    assert following_distance(columns.CC, vector(CarefulDriver()), 20.0) == 40.0


@pytest.mark.parametrize(
    ("speed_kmh", "rule", "five", "four", "careful", "with_perception"),
    [
        (50, 20.9, 26.2, 38.0, 26.0, 31.6),
        (60, 29.0, 36.1, 51.4, 34.3, 41.0),
        (80, 48.9, 60.5, 84.0, 54.0, 62.9),
        (100, 74.0, 91.0, 124.2, 77.7, 88.8),
        (130, 121.3, 148.5, 199.1, 120.9, 135.4),
    ],
)
def test_stopping_distances(
    speed_kmh: int, rule: float, five: float, four: float, careful: float, with_perception: float
) -> None:
    speed = speed_kmh / 3.6
    # These count the release of the pedal during the delay, too.
    driver = CarefulDriver(coasting=0.4)
    assert stopping_distance(speed, 0.35, 6.0) == pytest.approx(rule, abs=0.06)
    assert stopping_distance(speed, 0.5, 5.0) == pytest.approx(five, abs=0.06)
    assert stopping_distance(speed, 1.0, 4.0) == pytest.approx(four, abs=0.06)
    way = ramped_stopping_distance(
        speed, driver.delay, driver.coasting, driver.jerk, driver.braking
    )
    ramped = [way, way + speed * driver.perception]
    assert ramped == pytest.approx([careful, with_perception], abs=0.06)


def cut_in(gap: float, lateral: float) -> np.ndarray:
    row = np.zeros(columns.SCENE_SIZE)
    row[:5] = (20.0, 10.0, gap, lateral, 3.5)
    row[columns.S_OTHER_WIDTH] = 1.9
    row[columns.S_LANE_WIDTH] = 3.5
    return row


def test_duty_begins_above_the_threshold_at_the_lane_intrusion() -> None:
    # 1.1 m to 0.3 m behind the marking at 1 m/s; threshold 10 / 12 + 0.35 s.
    least = 10.0 * (1.1 + 10.0 / 12.0 + 0.35)
    assert must_be_avoided(cut_in(least + 0.01, 1.0), 0.35, 6.0, 0.3) == 1.0
    assert must_be_avoided(cut_in(least - 0.01, 1.0), 0.35, 6.0, 0.3) == 0.0


def test_movement_seen_too_shortly_is_no_duty() -> None:
    assert must_be_avoided(cut_in(80.0, 1.1 / 0.73), 0.35, 6.0, 0.3) == 1.0
    assert must_be_avoided(cut_in(80.0, 1.1 / 0.71), 0.35, 6.0, 0.3) == 0.0


def test_intrusion_before_the_scene_is_an_unknown_duty() -> None:
    scene = cut_in(80.0, 1.0)
    for offset in (2.39, -2.39):
        scene[columns.S_LATERAL_OFFSET] = offset
        assert math.isnan(must_be_avoided(scene, 0.35, 6.0, 0.3))
    scene[columns.S_LATERAL_OFFSET] = 2.41
    assert not math.isnan(must_be_avoided(scene, 0.35, 6.0, 0.3))


def test_unknown_gap_is_an_unknown_duty() -> None:
    assert math.isnan(must_be_avoided(cut_in(math.nan, 1.0), 0.35, 6.0, 0.3))


@pytest.mark.parametrize("kmh", [10.0, 17.0, 50.0, 130.0])
def test_published_code_follows_where_the_lead_s_braking_has_begun(kmh: float) -> None:
    speed = kmh / 3.6
    text, published = (
        following_distance(columns.RSS, vector(parameters_of("rss", variant=variant)), speed)
        for variant in ((), ("jrc-distance",))
    )
    if speed > 4.5:
        # A lead that does not stop in 0.75 s is further off by the way that it makes in them.
        assert published - text == pytest.approx(0.75 * speed, rel=1e-9)
    slower = max(speed - 4.5, 0.0)
    safe = 0.75 * speed + 3 * 0.75**2 / 2 + (speed + 2.25) ** 2 / 12 - slower**2 / 12
    assert published == pytest.approx(safe + 6 * 0.75**2 / 2, rel=1e-12)


def test_published_code_follows_by_2_seconds_with_the_rule() -> None:
    numbers = vector(parameters_of("reg157", variant=("jrc-distance",)))
    assert following_distance(columns.REG157, numbers, 10.0) == 20.0
