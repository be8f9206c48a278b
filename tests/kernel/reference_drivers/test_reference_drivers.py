"""Reference drivers tick by tick: when they begin to brake and how hard."""

import math

import numpy as np
import pytest

from adeye.kernel.reference_drivers import drivers as columns
from adeye.kernel.reference_drivers.drivers import (
    MODELS,
    following_distance,
    parameters_of,
    reference_limit,
    reg157_limit,
    vector,
)

STEP = 0.01


def view(**seen: float) -> np.ndarray:
    """Return what is seen behind a slower vehicle in the path, with changes."""
    row = np.zeros(columns.VIEW_SIZE)
    known = {
        "EGO_SPEED": 20.0, "OTHER_SPEED": 10.0, "GAP": 15.0, "LENGTHS": 8.6,
        "LATERAL_GAP": -1.0, "INTRUSION": 1.5, "OVERLAP": 0.5,
    }  # fmt: skip
    for name, value in (known | seen).items():
        row[getattr(columns, name)] = value
    return row


def limits(model: str, row: np.ndarray, ticks: int, variant: tuple[str, ...] = ()) -> list[float]:
    state = np.zeros(columns.STATE_SIZE)
    parameters = vector(parameters_of(model, variant=variant))
    return [reference_limit(MODELS[model], row, parameters, state, STEP) for _ in range(ticks)]


def first_braking(values: list[float]) -> float:
    return round(next(k for k, value in enumerate(values) if value < -0.01) * STEP, 9)


@pytest.mark.parametrize(
    ("model", "seconds"), [("cc", 0.4 + 0.75), ("fsm", 0.75), ("rss", 0.75), ("reg157", 0.35)]
)
def test_brake_answers_after_perception_and_delay(model: str, seconds: float) -> None:
    assert first_braking(limits(model, view(GAP=5.0), 200)) == pytest.approx(seconds, abs=1e-9)


def test_careful_driver_reaches_its_full_braking_after_0_6_seconds() -> None:
    values = limits("cc", view(), 300)
    assert values[-1] == pytest.approx(-0.774 * 9.81)
    ramp = [value for value in values if -0.774 * 9.81 < value < 0.0]
    assert len(ramp) * STEP == pytest.approx(0.6, abs=0.011)


def test_careful_driver_begins_to_evaluate_outside_the_wandering_zone() -> None:
    beside = {"LATERAL_GAP": 1.0, "LATERAL_SPEED": 1.0, "INTRUSION": -0.2, "OVERLAP": 0.0}
    inside, outside = (limits("cc", view(CUE=cue, **beside), 200) for cue in (0.37, 0.38))
    assert inside == [math.inf] * 200
    assert first_braking(outside) == pytest.approx(1.15)


def test_careful_driver_waits_for_a_critical_ttc_of_a_cut_in() -> None:
    beside = {"LATERAL_GAP": 1.0, "LATERAL_SPEED": 1.0, "CUE": 1.0}
    assert limits("cc", view(GAP=20.1, **beside), 200) == [math.inf] * 200
    assert limits("cc", view(GAP=19.9, **beside), 200)[-1] < -7.0


def test_careful_driver_answers_a_lead_that_brakes_by_5() -> None:
    lead = {"OTHER_SPEED": 20.0, "GAP": 40.0}
    assert limits("cc", view(OTHER_ACCELERATION=-4.9, **lead), 200) == [math.inf] * 200
    assert limits("cc", view(OTHER_ACCELERATION=-5.0, **lead), 200)[-1] < -7.0


@pytest.mark.parametrize("model", ["cc", "reg157"])
def test_rounding_of_the_lead_s_speed_does_not_hide_a_braking_of_5(model: str) -> None:
    lead = {"OTHER_SPEED": 20.0, "GAP": 40.0}
    assert limits(model, view(OTHER_ACCELERATION=-5.0 + 1e-12, **lead), 200)[-1] <= -6.0


@pytest.mark.parametrize("model", MODELS)
def test_driver_at_its_own_distance_asks_for_nothing(model: str) -> None:
    parameters = vector(parameters_of(model))
    for tenths in range(20, 400):
        speed = tenths / 10.8
        gap = following_distance(MODELS[model], parameters, speed)
        row = view(EGO_SPEED=speed, OTHER_SPEED=speed, GAP=gap)
        assert limits(model, row, 1) == [math.inf]


def test_emergency_braking_needs_full_overlap_after_a_cut_in() -> None:
    state = np.zeros(columns.STATE_SIZE)
    parameters = vector(parameters_of("cc"))
    beside = view(LATERAL_GAP=0.1, LATERAL_SPEED=1.0, CUE=0.3)
    reference_limit(columns.CC, beside, parameters, state, STEP)
    half = reference_limit(columns.CC, view(OVERLAP=0.5), parameters, state.copy(), STEP)
    assert half == math.inf
    values = [
        reference_limit(columns.CC, view(OVERLAP=1.0), parameters, state, STEP) for _ in range(61)
    ]
    assert values[0] == pytest.approx(-0.85 * 9.81 / 0.6 * STEP)
    assert values[-1] == pytest.approx(-0.85 * 9.81)


def test_coasting_variant_releases_the_pedal_during_the_delay() -> None:
    assert limits("cc", view(), 60, ("jrc-coasting",))[50] == pytest.approx(-0.4)


def test_fuzzy_model_brakes_by_the_membership() -> None:
    # PFS(60, 25, 20) = 0.4388, CFS = 0.
    assert limits("fsm", view(EGO_SPEED=25.0, OTHER_SPEED=20.0, GAP=60.0), 300)[-1] == (
        pytest.approx(-4.0 * 0.438760, abs=1e-5)
    )


def test_fuzzy_model_ignores_who_comes_after_it_has_passed() -> None:
    beside = {"LATERAL_GAP": 1.6, "GAP": 10.0}
    # Past in (10 + 8.6) / 10 + 0.1 = 1.96 s.
    slow, fast = (
        limits("fsm", view(LATERAL_SPEED=1.6 / seconds, **beside), 200) for seconds in (1.97, 1.95)
    )
    assert slow == [math.inf] * 200
    assert fast[-1] < 0.0


def test_both_distances_must_be_short_for_rss() -> None:
    assert limits("rss", view(LATERAL_GAP=3.0), 200) == [math.inf] * 200
    assert limits("rss", view(GAP=100.0), 200) == [math.inf] * 200
    assert limits("rss", view(), 200)[-1] == pytest.approx(-0.774 * 9.81)


def test_lateral_variant_takes_half_a_metre() -> None:
    row = view(GAP=5.0, LATERAL_GAP=0.45, INTRUSION=0.2)
    assert limits("reg157", row, 50) == [math.inf] * 50
    assert limits("reg157", row, 50, ("jrc-lateral",))[-1] == -6.0


@pytest.mark.parametrize("model", MODELS)
def test_what_is_unknown_asks_for_no_number(model: str) -> None:
    for column in range(columns.VIEW_SIZE):
        row = view()
        row[column] = math.nan
        assert math.isnan(limits(model, row, 1)[0])


@pytest.mark.slow
def test_unknown_model_is_no_number() -> None:
    assert math.isnan(
        reference_limit(9, view(), np.zeros(columns.PARAMETER_SIZE), np.zeros(6), STEP)
    )


# --- The cut-in rule: when it brakes, by the text and by published code ---------------------------

THRESHOLD = 10.0 / 12.0 + 0.35


def wide(**seen: float) -> np.ndarray:
    """Return what is seen 50 m behind a vehicle that is 10 m/s slower, with changes."""
    return view(**{"GAP": 50.0, **seen})


def rule_limits(rows: list[np.ndarray], *variant: str, edition: str = "r157-01") -> list[float]:
    numbers = vector(parameters_of("reg157", edition, variant))
    memory = np.zeros(columns.STATE_SIZE)
    return [reg157_limit(row, numbers, memory, STEP) for row in rows]


def is_answered(gap: float, *variant: str, edition: str = "r157-01") -> bool:
    return rule_limits([wide(GAP=gap)], *variant, edition=edition) != [math.inf]


@pytest.mark.parametrize(
    ("edition", "threshold"),
    [
        ("r157", THRESHOLD),
        ("eu-2022-1426", THRESHOLD - 0.1),
        ("eu-2022-1426-standing", 10 / 4.8 + 0.16),
    ],
)
def test_edition_is_braked_in_the_last_tick_above_its_threshold(
    edition: str, threshold: float
) -> None:
    assert is_answered(10.0 * (threshold + 0.0099), edition=edition)
    assert not is_answered(10.0 * (threshold + 0.0101), edition=edition)


def test_guard_is_a_tenth_of_a_second_above_the_threshold() -> None:
    assert is_answered(10.0 * (THRESHOLD + 0.0999), "jrc-guard")
    assert not is_answered(10.0 * (THRESHOLD + 0.1001), "jrc-guard")


def test_text_brakes_on_and_published_code_releases_above_the_threshold() -> None:
    rows = [wide(GAP=10.0)] * 40 + [wide(GAP=50.0)] * 2
    assert rule_limits(rows)[-3:] == [-6.0] * 3
    assert rule_limits(rows, "jrc-release")[-3:] == [-6.0, math.inf, math.inf]


def test_published_code_of_esmini_has_no_delay_and_the_same_threshold() -> None:
    near = [wide(GAP=10.0)] * 36
    assert rule_limits(near) == [0.0] * 35 + [-6.0]
    assert rule_limits(near, "esmini-reaction") == [-6.0] * 36
    for gap in (10.0 * (THRESHOLD + 0.0099), 10.0 * (THRESHOLD + 0.0101)):
        assert is_answered(gap) == is_answered(gap, "esmini-reaction")


def test_published_code_stops_for_any_lead_that_closes_in_and_for_no_cut_in() -> None:
    assert not is_answered(50.0)
    assert is_answered(50.0, "jrc-lead")
    from_the_side = [wide(LATERAL_GAP=0.6, INTRUSION=0.1), wide()]
    assert rule_limits(from_the_side, "jrc-lead") == [math.inf, math.inf]


def test_lead_that_brakes_on_is_answered_before_its_braking_is_too_hard() -> None:
    lead = {"OTHER_SPEED": 20.0, "GAP": 40.0}
    assert rule_limits([wide(OTHER_ACCELERATION=-2.0, **lead)]) == [math.inf]
    assert rule_limits([wide(OTHER_ACCELERATION=-5.0, **lead)]) == [0.0]
    assert rule_limits([wide(OTHER_ACCELERATION=-4.0, OTHER_SPEED=20.0, GAP=8.0)]) == [math.inf]
    assert rule_limits([wide(OTHER_ACCELERATION=-4.0, OTHER_SPEED=12.0, GAP=14.0)]) == [0.0]
