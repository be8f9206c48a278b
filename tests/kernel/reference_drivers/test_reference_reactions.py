"""What the reference drivers share: sides, delays, ramps, and published code behind a lead."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.kernel.reference_drivers import drivers as columns
from adeye.kernel.reference_drivers.drivers import (
    MODELS,
    CarefulDriver,
    CutInRule,
    critical_fuzzy_safety,
    following_distance,
    is_ahead,
    is_lead_at_once,
    is_unknown,
    must_be_avoided,
    note_side,
    parameters_of,
    proactive_fuzzy_safety,
    r157_following_distance,
    react,
    respond,
    vector,
)
from tests.second.following import ramped_stopping

STEP = 0.1


def view(**seen: float) -> np.ndarray:
    """Return what is seen of a lead that is as fast, with changes."""
    row = np.zeros(columns.VIEW_SIZE)
    known = {"EGO_SPEED": 20.0, "OTHER_SPEED": 20.0, "GAP": 30.0, "LENGTHS": 8.6, "LATERAL_GAP": -1}
    for name, value in (known | seen).items():
        row[getattr(columns, name)] = value
    return row


def state(**known: float) -> np.ndarray:
    row = np.zeros(columns.STATE_SIZE)
    for name, value in known.items():
        row[getattr(columns, name)] = value
    return row


CAREFUL = vector(CarefulDriver())


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_one_number_that_is_none_makes_all_unknown(value: float) -> None:
    assert not is_unknown(view())
    for column in range(columns.VIEW_SIZE):
        row = view()
        row[column] = value
        with np.errstate(invalid="ignore"):
            assert is_unknown(row)


def test_other_beside_is_ahead_by_a_variant_until_the_centres_are_level() -> None:
    beside = vector(parameters_of("cc", variant=("jrc-beside",)))
    found = [
        (is_ahead(view(GAP=gap), CAREFUL), is_ahead(view(GAP=gap), beside))
        for gap in (0.0, -0.01, -4.29, -4.31)
    ]
    assert found == [(True, True), (False, True), (False, True), (False, False)]


def test_who_comes_from_the_side_is_a_lead_once_the_gap_does_not_close() -> None:
    memory = state()
    told = []
    for seen in (
        {"LATERAL_GAP": 1.0, "OTHER_SPEED": 10.0},
        {"OTHER_SPEED": 10.0},
        {"OTHER_SPEED": 20.0},
        {"OTHER_SPEED": 10.0},
    ):
        note_side(view(**seen), memory)
        told.append(memory[columns.CAME_FROM_SIDE])
    assert told == [1.0, 1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("seen", "known", "answered"),
    [
        ({}, {}, False),
        ({"OTHER_SPEED": 19.9}, {}, True),
        ({"OTHER_ACCELERATION": -0.1}, {}, True),
        ({"OTHER_SPEED": 20.0 - 1e-12}, {}, False),
        ({"OTHER_SPEED": 25.0}, {"REACTING": 1.0}, True),
        ({"OTHER_SPEED": 10.0, "LATERAL_GAP": 0.1}, {}, False),
        ({"OTHER_SPEED": 10.0}, {"CAME_FROM_SIDE": 1.0}, False),
        ({"OTHER_SPEED": 10.0, "GAP": -1.0}, {"REACTING": 1.0}, False),
    ],
)
def test_published_code_answers_a_lead_that_brakes_or_closes_in_to_the_end(
    seen: dict[str, float], known: dict[str, float], *, answered: bool
) -> None:
    assert bool(is_lead_at_once(view(**seen), CAREFUL, state(**known))) is answered


def test_delay_lasts_whole_steps_and_is_over_once() -> None:
    memory = state()
    values = [respond(vector(CutInRule()), memory, 6.0, STEP) for _ in range(6)]
    assert values == [0.0, 0.0, 0.0, 0.0, -6.0, -6.0]


def test_ramp_grows_by_the_jerk_up_to_the_most() -> None:
    memory = state(DELAYED=1.0)
    values = [respond(CAREFUL, memory, 3.0, STEP) for _ in range(4)]
    assert values == pytest.approx([-1.265, -2.53, -3.0, -3.0])


def test_who_is_in_no_danger_asks_for_nothing_and_remembers_its_ramp() -> None:
    memory = state(DELAYED=1.0)
    react(CAREFUL, memory, True, 8.0, STEP)  # noqa: FBT003 - compiled
    calm = react(CAREFUL, memory, False, 8.0, STEP)  # noqa: FBT003 - compiled
    assert calm == math.inf
    assert memory[columns.REACTING] == 0.0
    assert react(CAREFUL, memory, True, 8.0, STEP) == pytest.approx(-2.53)  # noqa: FBT003 - compiled


# --- Fuzzy safety metrics: golden values of the regulation's numbers and laws ---------------------

SPEED = st.floats(0.0, 60.0)
GAP = st.floats(0.0, 300.0)


def pfs(gap: float, rear: float, front: float) -> float:
    return proactive_fuzzy_safety(gap, rear, front, 0.75, 4.0, 6.0, 7.0, 2.0)


def cfs(gap: float, rear: float, front: float, acceleration: float, *, raw: bool = False) -> float:
    return critical_fuzzy_safety(gap, rear, front, acceleration, 0.75, 4.0, 6.0, raw)


def test_golden_values() -> None:
    assert pfs(60.0, 25.0, 20.0) == pytest.approx(0.4388, abs=5e-5)
    assert pfs(20.0, 25.0, 20.0) == 1.0
    assert cfs(6.0, 25.0, 20.0, 0.0) == pytest.approx(0.84, rel=1e-9)
    assert cfs(8.0, 25.0, 20.0, 0.0) == 0.0


@given(GAP, SPEED, SPEED, st.floats(-10.0, 3.0))
def test_both_are_between_0_and_1(gap: float, rear: float, front: float, a: float) -> None:
    assert 0.0 <= pfs(gap, rear, front) <= 1.0
    assert 0.0 <= cfs(gap, rear, front, a) <= 1.0


@given(GAP, st.floats(0.0, 50.0), SPEED, SPEED, st.floats(-10.0, 3.0))
def test_more_gap_is_never_less_safe(
    gap: float, more: float, rear: float, front: float, a: float
) -> None:
    assert pfs(gap + more, rear, front) <= pfs(gap, rear, front)
    assert cfs(gap + more, rear, front, a) <= cfs(gap, rear, front, a)


@given(GAP, SPEED, SPEED)
def test_faster_rear_vehicle_is_never_safer(gap: float, rear: float, front: float) -> None:
    assert pfs(gap, rear + 1.0, front) >= pfs(gap, rear, front)
    assert cfs(gap, rear + 1.0, front, 0.0) >= cfs(gap, rear, front, 0.0) - 1e-12


def test_opening_gap_is_not_critical() -> None:
    assert cfs(0.1, 20.0, 20.0, 0.0) == 0.0


def test_raw_acceleration_shortens_the_distance_of_a_hard_braking_ego() -> None:
    # Slow enough after the delay: 3^2 / (2 4) = 1.125 m by the text, 3^2 / (2 8) by the code.
    assert cfs(1.0, 10.0, 7.0, -8.0) == 1.0
    assert cfs(1.0, 10.0, 7.0, -8.0, raw=True) == 0.0


def test_unknown_is_no_number() -> None:
    assert math.isnan(pfs(math.nan, 1.0, 1.0))
    assert math.isnan(cfs(1.0, 1.0, math.nan, 0.0))


# --- Distances of the reference drivers: the regulation's tables, and the duty of the cut-in rule -


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


def test_stopping_distances_of_the_careful_driver() -> None:
    # These count the release of the pedal during the delay, too.
    driver = CarefulDriver(coasting=0.4)
    for kmh, careful, with_perception in (
        (50, 26.0, 31.6),
        (60, 34.3, 41.0),
        (80, 54.0, 62.9),
        (100, 77.7, 88.8),
        (130, 120.9, 135.4),
    ):
        speed = kmh / 3.6
        way = ramped_stopping(speed, driver.delay, driver.coasting, driver.jerk, driver.braking)
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
