"""What the reference drivers share: reactions and distances, and the scenes that they drive."""

import math
import os
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.kernel.reference_drivers import reactions as reactions
from adeye.kernel.reference_drivers.reactions import (
    MODELS,
    CarefulDriver,
    CutInRule,
    parameters_of,
    vector,
)
from tests.driven_scenes import driven, scenes_of
from tests.second.following import ramped_stopping

STEP = 0.1


def row_of(size: int, known: dict[str, float]) -> np.ndarray:
    row = np.zeros(size)
    for name, value in known.items():
        row[getattr(reactions, name)] = value
    return row


def view(**seen: float) -> np.ndarray:
    """Return what is seen of a lead that is as fast, with changes."""
    known = {"EGO_SPEED": 20.0, "OTHER_SPEED": 20.0, "GAP": 30.0, "LENGTHS": 8.6, "LATERAL_GAP": -1}
    return row_of(reactions.VIEW_SIZE, known | seen)


def state(**known: float) -> np.ndarray:
    return row_of(reactions.STATE_SIZE, known)


CAREFUL = vector(CarefulDriver())


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_one_number_that_is_none_makes_all_unknown(value: float) -> None:
    assert not reactions.is_unknown(view())
    for column in range(reactions.VIEW_SIZE):
        row = view()
        row[column] = value
        with np.errstate(invalid="ignore"):
            assert reactions.is_unknown(row)


def test_other_beside_is_ahead_by_a_variant_until_the_centres_are_level() -> None:
    beside = vector(parameters_of("cc", variant=("jrc-beside",)))
    found = [
        (reactions.is_ahead(view(GAP=gap), CAREFUL), reactions.is_ahead(view(GAP=gap), beside))
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
        reactions.note_side(view(**seen), memory)
        told.append(memory[reactions.CAME_FROM_SIDE])
    assert told == [1.0, 1.0, 0.0, 0.0]


LEADS: list[tuple[dict[str, float], dict[str, float], bool]] = [
    ({}, {}, False),
    ({"OTHER_SPEED": 19.9}, {}, True),
    ({"OTHER_ACCELERATION": -0.1}, {}, True),
    ({"OTHER_SPEED": 20.0 - 1e-12}, {}, False),
    ({"OTHER_SPEED": 25.0}, {"REACTING": 1.0}, True),
    ({"OTHER_SPEED": 10.0, "LATERAL_GAP": 0.1}, {}, False),
    ({"OTHER_SPEED": 10.0}, {"CAME_FROM_SIDE": 1.0}, False),
    ({"OTHER_SPEED": 10.0, "GAP": -1.0}, {"REACTING": 1.0}, False),
]


def test_published_code_answers_a_lead_that_brakes_or_closes_in_to_the_end() -> None:
    for seen, known, answered in LEADS:
        found = reactions.is_lead_at_once(view(**seen), CAREFUL, state(**known))
        assert bool(found) is answered, (seen, known)


def test_delay_lasts_whole_steps_and_is_over_once() -> None:
    memory = state()
    values = [reactions.respond(vector(CutInRule()), memory, 6.0, STEP) for _ in range(6)]
    assert values == [0.0, 0.0, 0.0, 0.0, -6.0, -6.0]


def test_ramp_grows_by_the_jerk_up_to_the_most() -> None:
    memory = state(DELAYED=1.0)
    values = [reactions.respond(CAREFUL, memory, 3.0, STEP) for _ in range(4)]
    assert values == pytest.approx([-1.265, -2.53, -3.0, -3.0])


def test_who_is_in_no_danger_asks_for_nothing_and_remembers_its_ramp() -> None:
    memory = state(DELAYED=1.0)
    reactions.react(CAREFUL, memory, True, 8.0, STEP)  # noqa: FBT003 - compiled
    calm = reactions.react(CAREFUL, memory, False, 8.0, STEP)  # noqa: FBT003 - compiled
    assert calm == math.inf
    assert memory[reactions.REACTING] == 0.0
    assert reactions.react(CAREFUL, memory, True, 8.0, STEP) == pytest.approx(-2.53)  # noqa: FBT003 - compiled


# --- Fuzzy safety metrics: golden values of the regulation's numbers and laws ---------------------

SPEED = st.floats(0.0, 60.0)
GAP = st.floats(0.0, 300.0)


def pfs(gap: float, rear: float, front: float) -> float:
    found: float = reactions.proactive_fuzzy_safety(gap, rear, front, 0.75, 4.0, 6.0, 7.0, 2.0)
    return found


def cfs(gap: float, rear: float, front: float, acceleration: float, *, raw: bool = False) -> float:
    found: float = reactions.critical_fuzzy_safety(
        gap, rear, front, acceleration, 0.75, 4.0, 6.0, raw
    )
    return found


def test_golden_values() -> None:
    assert pfs(60.0, 25.0, 20.0) == pytest.approx(0.4388, abs=5e-5)
    assert pfs(20.0, 25.0, 20.0) == 1.0
    assert cfs(6.0, 25.0, 20.0, 0.0) == pytest.approx(0.84, rel=1e-9)
    assert cfs(8.0, 25.0, 20.0, 0.0) == 0.0
    # What the rear vehicle does until it reacts: 23.5 and 26.5 m/s after 0.75 s.
    assert cfs(4.5, 25.0, 20.0, -2.0) == pytest.approx(3.0 / 7.0, rel=1e-9)
    assert cfs(8.5, 25.0, 20.0, 2.0) == pytest.approx(105.0 / 169.0, rel=1e-9)


@given(GAP, SPEED, SPEED, st.floats(-10.0, 3.0))
def test_both_are_between_0_and_1(gap: float, rear: float, front: float, a: float) -> None:
    assert 0.0 <= pfs(gap, rear, front) <= 1.0
    assert 0.0 <= cfs(gap, rear, front, a) <= 1.0


@given(GAP, st.floats(0.0, 50.0), SPEED, SPEED, st.floats(-10.0, 3.0))
def test_more_gap_is_as_safe(gap: float, more: float, rear: float, front: float, a: float) -> None:
    assert pfs(gap + more, rear, front) <= pfs(gap, rear, front)
    assert cfs(gap + more, rear, front, a) <= cfs(gap, rear, front, a)


@given(GAP, SPEED, SPEED)
def test_faster_rear_vehicle_is_never_safer(gap: float, rear: float, front: float) -> None:
    assert pfs(gap, rear + 1.0, front) >= pfs(gap, rear, front)
    assert cfs(gap, rear + 1.0, front, 0.0) >= cfs(gap, rear, front, 0.0) - 1e-12


# --- Distances of the reference drivers: the regulation's tables, and the duty of the cut-in rule -


@pytest.mark.parametrize(
    ("speed_kmh", "distance"),
    [(7.2, 2.0), (10, 3.1), (20, 6.7), (30, 10.8), (40, 15.6), (50, 20.8), (60, 26.7), (1, 2.0)],
)
def test_following_distance_of_the_regulation(speed_kmh: float, distance: float) -> None:
    assert reactions.r157_following_distance(speed_kmh / 3.6) == pytest.approx(distance, abs=0.051)


@pytest.mark.parametrize("model", MODELS)
def test_faster_ego_follows_further_behind(model: str) -> None:
    row = vector(parameters_of(model))
    distances = [reactions.following_distance(MODELS[model], row, float(v)) for v in range(3, 40)]
    assert distances == sorted(distances)
    assert distances[0] > 0.0


def test_careful_driver_follows_at_two_seconds() -> None:
    assert reactions.following_distance(reactions.CC, vector(CarefulDriver()), 20.0) == 40.0


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
    row = np.zeros(reactions.SCENE_SIZE)
    row[:5] = (20.0, 10.0, gap, lateral, 3.5)
    row[reactions.S_OTHER_WIDTH] = 1.9
    row[reactions.S_LANE_WIDTH] = 3.5
    return row


def test_duty_begins_above_the_threshold_at_the_lane_intrusion() -> None:
    # 1.1 m to 0.3 m behind the marking at 1 m/s; threshold 10 / 12 + 0.35 s.
    least = 10.0 * (1.1 + 10.0 / 12.0 + 0.35)
    assert reactions.must_be_avoided(cut_in(least + 0.01, 1.0), 0.35, 6.0, 0.3) == 1.0
    assert reactions.must_be_avoided(cut_in(least - 0.01, 1.0), 0.35, 6.0, 0.3) == 0.0


def test_movement_seen_too_shortly_is_no_duty() -> None:
    assert reactions.must_be_avoided(cut_in(80.0, 1.1 / 0.73), 0.35, 6.0, 0.3) == 1.0
    assert reactions.must_be_avoided(cut_in(80.0, 1.1 / 0.71), 0.35, 6.0, 0.3) == 0.0


def test_intrusion_before_the_scene_is_an_unknown_duty() -> None:
    scene = cut_in(80.0, 1.0)
    for offset in (2.39, -2.39):
        scene[reactions.S_LATERAL_OFFSET] = offset
        assert math.isnan(reactions.must_be_avoided(scene, 0.35, 6.0, 0.3))
    scene[reactions.S_LATERAL_OFFSET] = 2.41
    assert not math.isnan(reactions.must_be_avoided(scene, 0.35, 6.0, 0.3))


def test_unknown_gap_is_an_unknown_duty() -> None:
    assert math.isnan(reactions.must_be_avoided(cut_in(math.nan, 1.0), 0.35, 6.0, 0.3))


@pytest.mark.parametrize("kmh", [10.0, 17.0, 50.0, 130.0])
def test_published_code_follows_where_the_lead_s_braking_has_begun(kmh: float) -> None:
    speed = kmh / 3.6
    text, published = (
        reactions.following_distance(
            reactions.RSS, vector(parameters_of("rss", variant=variant)), speed
        )
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
    assert reactions.following_distance(reactions.REG157, numbers, 10.0) == 20.0


# --- Scenes of the reference drivers: convergence, symmetries, scenes with an answer --------------

KMH = 1.0 / 3.6

compiled_only = pytest.mark.skipif(
    bool(os.environ.get("NUMBA_DISABLE_JIT")), reason="a grid of scenes takes minutes interpreted"
)

FEW = 2 if os.environ.get("NUMBA_DISABLE_JIT") else 3
"""Values of each axis, where scenes are compared with themselves."""


def grid(speeds: int, shares: int, gaps: int, laterals: int) -> list[tuple[float, ...]]:
    """Return a grid of 10 to 130 km/h, gaps of 1 to 120 m, sideways 0.2 to 3 m/s."""
    axes = product(
        np.linspace(10.0, 130.0, speeds) * KMH,
        np.linspace(0.0613, 0.9371, shares),
        np.linspace(1.0137, 119.771, gaps),
        np.linspace(0.2, 3.0, laterals),
    )
    return [(float(v), float(v * s), float(g), float(w)) for v, s, g, w in axes]


@pytest.mark.slow
@compiled_only
@pytest.mark.parametrize("model", MODELS)
def test_impact_speed_converges_with_the_step(model: str) -> None:
    scenes = scenes_of(grid(5, 4, 8, 8))
    fine = driven(scenes, model, step=0.001)
    braked = (fine[:, reactions.R_CONTACT] == 1.0) & (fine[:, reactions.R_BRAKING_TIME] > 0.0)
    worst = []
    for step in (0.08, 0.04, 0.02, 0.01):
        coarse = driven(scenes, model, step=step)
        both = braked & (coarse[:, reactions.R_CONTACT] == 1.0)
        assert both.sum() >= 3
        # Touching slowly, a small way is a large speed; the energy of the impact is smooth.
        column = reactions.R_IMPACT_SPEED
        error = np.abs(coarse[both, column] ** 2 - fine[both, column] ** 2)
        worst.append(float(error.mean()))
    assert worst[-1] < 0.5 * worst[0]


@pytest.mark.slow
@compiled_only
@pytest.mark.parametrize("model", MODELS)
def test_both_integrators_meet_for_small_steps(model: str) -> None:
    scenes = scenes_of(grid(4, 3, 6, 6))
    exact, euler = (
        driven(scenes, model, step=0.002, integrator=integrator)[:, reactions.R_CONTACT]
        for integrator in (reactions.EXACT, reactions.SEMI_IMPLICIT)
    )
    known = ~(np.isnan(exact) | np.isnan(euler))
    assert np.mean(exact[known] != euler[known]) <= 0.01
    assert known.mean() > 0.85


@pytest.mark.parametrize("model", MODELS)
def test_order_of_scenes_changes_no_bit(model: str) -> None:
    scenes = scenes_of(grid(FEW, FEW, FEW, FEW))
    there, back = driven(scenes, model), driven(scenes[::-1].copy(), model)[::-1]
    assert there.tobytes() == np.ascontiguousarray(back).tobytes()


@pytest.mark.parametrize("model", MODELS)
def test_mirrored_cut_in_is_the_same(model: str) -> None:
    scenes = scenes_of(grid(FEW, FEW, FEW, FEW))
    mirrored = scenes.copy()
    mirrored[:, reactions.S_LATERAL_OFFSET] *= -1.0
    assert driven(scenes, model).tobytes() == driven(mirrored, model).tobytes()


@pytest.mark.parametrize("model", MODELS)
def test_vehicle_that_stays_in_its_lane_is_passed(model: str) -> None:
    result = driven(scenes_of([(30.0, 10.0, 50.0, 0.0)]), model)[0]
    assert result[reactions.R_CONTACT] == 0.0
    assert result[reactions.R_MIN_GAP] == math.inf
    assert math.isnan(result[reactions.R_IMPACT_SPEED])


@pytest.mark.parametrize("model", MODELS)
def test_cut_in_right_before_a_much_faster_ego_cannot_be_mastered(model: str) -> None:
    result = driven(scenes_of([(36.0, 10.0, 12.0, 3.0)]), model)[0]
    assert result[reactions.R_CONTACT] == 1.0
    assert 15.0 < result[reactions.R_IMPACT_SPEED] <= 26.0
    assert result[reactions.R_MIN_GAP] == 0.0


def test_rule_avoids_what_it_must_avoid_and_nothing_just_below() -> None:
    least = 10.0 * (1.1 + 10.0 / 12.0 + 0.35)
    avoided, touched = driven(
        scenes_of([(20.0, 10.0, least + 0.15, 1.0), (20.0, 10.0, least - 0.15, 1.0)]),
        "reg157",
        step=0.001,
    )
    assert avoided[reactions.R_CONTACT] == 0.0
    assert avoided[reactions.R_MIN_GAP] < 0.2
    assert touched[reactions.R_CONTACT] == 1.0


def test_published_end_hides_a_contact_of_the_careful_driver() -> None:
    # At overlap the TTC is 2.4 s; 20 m/s faster, braking at 2 s comes too late.
    scenes = scenes_of([(30.0, 10.0, 80.0, 1.0)])
    whole, ended = (driven(scenes, "cc", ttc_end=end)[0] for end in (math.inf, 2.0))
    assert whole[reactions.R_CONTACT] == 1.0
    assert whole[reactions.R_IMPACT_SPEED] == pytest.approx(9.5, abs=0.2)
    assert ended[reactions.R_CONTACT] == 0.0
    assert math.isnan(ended[reactions.R_BRAKING_TIME])


def scene_of_a_lead(speed: float, gap: float, braking: float, jerk: float = math.inf) -> Any:
    scenes = scenes_of([(speed, speed, gap, 0.0)])
    scenes[:, reactions.S_BRAKING] = braking
    scenes[:, reactions.S_BRAKING_JERK] = jerk
    return scenes


@pytest.mark.parametrize("model", MODELS)
def test_lead_that_brakes_to_standstill_is_not_touched_from_the_own_distance(model: str) -> None:
    for braking in (1.0, 3.0, 4.9, 5.0, 7.0, 7.5):
        # The rule brakes by 6 m/s² only.
        if model != "reg157" or braking <= 6.0:
            scenes = scene_of_a_lead(15.0, math.nan, braking)
            result = driven(scenes, model, kind=reactions.BRAKING_LEAD)[0]
            assert result[reactions.R_CONTACT] == 0.0, braking


@pytest.mark.parametrize("model", MODELS)
def test_lead_that_brakes_right_ahead_is_touched(model: str) -> None:
    scenes = scene_of_a_lead(30.0, 5.0, 9.0, 12.0)
    assert driven(scenes, model, kind=reactions.BRAKING_LEAD)[0, reactions.R_CONTACT] == 1.0


def scene_of_a_cut_out(speed: float, front: float, lateral: float) -> Any:
    scenes = scenes_of([(speed, speed, math.nan, lateral)])
    scenes[:, reactions.S_FRONT_GAP] = front
    return scenes


@pytest.mark.parametrize("model", MODELS)
def test_standing_vehicle_far_behind_a_cut_out_is_not_touched(model: str) -> None:
    scenes = scene_of_a_cut_out(15.0, 60.0, 1.5)
    result = driven(scenes, model, kind=reactions.CUT_OUT)[0]
    assert result[reactions.R_CONTACT] == 0.0
    assert 0.0 < result[reactions.R_MIN_GAP] < 100.0


@pytest.mark.parametrize("model", ["fsm", "rss", "reg157"])
def test_standing_vehicle_right_behind_a_late_cut_out_is_touched(model: str) -> None:
    # The lead leaves so late that it hits the standing one, and the ego follows too near.
    scenes = scene_of_a_cut_out(36.0, 5.0, 0.5)
    scenes[:, reactions.S_GAP] = 10.0
    assert driven(scenes, model, kind=reactions.CUT_OUT)[0, reactions.R_CONTACT] == 1.0


def test_variant_without_evaluation_answers_a_cut_out_by_0_4_seconds_earlier() -> None:
    scenes = scene_of_a_cut_out(25.0, 40.0, 1.5)
    text, published = (
        driven(scenes, "cc", kind=reactions.CUT_OUT, variant=variant)[0, reactions.R_BRAKING_TIME]
        for variant in ((), ("jrc-perception",))
    )
    # Shown at 0.375 m / 1.5 m/s = 0.25 s, or in the tick after it, and 0.75 s of delay.
    assert published == pytest.approx(1.0, abs=0.011)
    assert text - published == pytest.approx(0.4, abs=0.011)


@pytest.mark.parametrize("model", MODELS)
def test_vehicle_that_leaves_can_be_touched_when_it_has_shown_the_other(model: str) -> None:
    # Shown after 0.75 s; the gap to the slower one that leaves is closed before a brake answers,
    # and it is out of the path after 3.8 s.
    scenes = scene_of_a_cut_out(30.0, 200.0, 0.5)
    scenes[:, reactions.S_OTHER_SPEED] = 10.0
    scenes[:, reactions.S_GAP] = 17.0
    result = driven(scenes, model, kind=reactions.CUT_OUT)[0]
    assert result[reactions.R_CONTACT] == 1.0
    assert 10.0 < result[reactions.R_IMPACT_SPEED] <= 20.0
    assert result[reactions.R_MIN_GAP] == 0.0
