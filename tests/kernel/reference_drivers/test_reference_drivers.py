"""Reference drivers tick by tick: when they begin to brake and how hard, by which columns."""

import math
from dataclasses import fields

import numpy as np
import pytest

from adeye.kernel.reference_drivers import reactions as columns
from adeye.kernel.reference_drivers.drivers import reference_limit, reg157_limit
from adeye.kernel.reference_drivers.reactions import (
    MODELS,
    cut_in_threshold,
    following_distance,
    parameters_of,
    vector,
)
from tests.kernel.reference_drivers.test_reference_reactions import row_of

STEP = 0.01


def view(**seen: float) -> np.ndarray:
    """Return what is seen behind a slower vehicle in the path, with changes."""
    known = {
        "EGO_SPEED": 20.0, "OTHER_SPEED": 10.0, "GAP": 15.0, "LENGTHS": 8.6,
        "LATERAL_GAP": -1.0, "INTRUSION": 1.5, "OVERLAP": 0.5,
    }  # fmt: skip
    return row_of(columns.VIEW_SIZE, known | seen)


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


def test_fuzzy_model_ignores_who_comes_after_it_has_passed() -> None:
    beside = {"LATERAL_GAP": 1.6, "GAP": 10.0}
    # Past in (10 + 8.6) / 10 + 0.1 = 1.96 s.
    slow, fast = (
        limits("fsm", view(LATERAL_SPEED=1.6 / seconds, **beside), 200) for seconds in (1.97, 1.95)
    )
    assert slow == [math.inf] * 200
    assert fast[-1] < 0.0


def test_fuzzy_model_brakes_with_all_it_has_where_it_is_wholly_critical() -> None:
    most = vector(parameters_of("fsm"))[columns.MOST]
    assert limits("fsm", view(OTHER_SPEED=0.0, GAP=1.0), 200)[-1] == pytest.approx(-most)


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


def test_edition_is_braked_in_the_last_tick_above_its_threshold() -> None:
    for edition, threshold in (
        ("r157", THRESHOLD),
        ("eu-2022-1426", THRESHOLD - 0.1),
        ("eu-2022-1426-standing", 10 / 4.8 + 0.16),
    ):
        assert is_answered(10.0 * (threshold + 0.0099), edition=edition), edition
        assert not is_answered(10.0 * (threshold + 0.0101), edition=edition), edition


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
    for braking, speed, gap, limit in (
        (-2.0, 20.0, 40.0, math.inf),
        (-5.0, 20.0, 40.0, 0.0),
        (-4.0, 20.0, 8.0, math.inf),
        (-4.0, 12.0, 14.0, 0.0),
    ):
        seen = wide(OTHER_ACCELERATION=braking, OTHER_SPEED=speed, GAP=gap)
        assert rule_limits([seen]) == [limit], (braking, speed, gap)


# --- Parameters of the reference drivers: editions, variants, the order of the columns ------------

CLOSING_KMH = (10, 20, 30, 40, 50, 60)


TABLE = [0.581, 0.813, 1.044, 1.276, 1.507, 1.739]
THRESHOLDS = {
    "r157": TABLE,
    "r157-01": TABLE,
    "eu-2022-1426": [0.48, 0.71, 0.94, 1.18, 1.41, 1.64],
    "eu-2022-1426-standing": [0.74, 1.32, 1.90, 2.47, 3.05, 3.63],
}


def test_thresholds_of_the_edition() -> None:
    for edition, table in THRESHOLDS.items():
        rule = columns.parameters_of("reg157", edition)
        ours = [cut_in_threshold(v / 3.6, rule.delay, rule.braking) for v in CLOSING_KMH]
        # The tables are rounded to 0.01 s.
        assert ours == pytest.approx(table, abs=0.0101), edition


def test_fields_are_in_the_order_of_the_columns() -> None:
    for record, prefix in (
        (columns.CarefulDriver(), "CC_"),
        (columns.FuzzyDriver(), "FSM_"),
        (columns.ResponsibleDriver(), "RSS_"),
        (columns.CutInRule(), "REG157_"),
    ):
        names = {getattr(columns, name): name for name in dir(columns) if name.startswith(prefix)}
        own = [field.name for field in fields(record)][5:]
        assert [names[5 + k] for k in range(len(own))] == [prefix + name.upper() for name in own]


# How a scene begins and ends is no parameter of a driver.
@pytest.mark.parametrize("name", sorted(set(columns.VARIANTS) - {"jrc-ttc-end", "jrc-first-step"}))
def test_variant_changes_something_and_the_whole_program_holds_it(name: str) -> None:
    changed = [
        m
        for m in columns.MODELS
        if columns.parameters_of(m, variant=(name,)) != columns.parameters_of(m)
    ]
    assert changed
    alone = columns.parameters_of(changed[0], variant=(name,))
    whole = columns.parameters_of(changed[0], variant=(name.partition("-")[0],))
    text = columns.parameters_of(changed[0])
    for field in fields(alone):
        if getattr(alone, field.name) != getattr(text, field.name):
            assert getattr(whole, field.name) == getattr(alone, field.name)


def test_unknown_names_are_refused() -> None:
    for arguments in (("no", "r157"), ("cc", "no"), ("cc", "r157", ("no",))):
        with pytest.raises(KeyError):
            columns.parameters_of(*arguments)


def test_whole_programs_are_all_variants_between_them() -> None:
    assert columns.named(("jrc", "esmini")) == frozenset(columns.VARIANTS)
    assert columns.named(("jrc-guard", "jrc-lead")) == {"jrc-guard", "jrc-lead"}
    assert columns.named(()) == frozenset()
    assert not {*columns.GROUPS} & {*columns.VARIANTS}


def test_esmini_brakes_by_shares_of_9_8() -> None:
    driver = columns.parameters_of("cc", variant=("esmini-gravity",))
    names = ("braking", "jerk", "emergency_braking", "emergency_jerk")
    found = [getattr(driver, name) for name in names]
    expected = [0.774 * 9.8, 0.774 * 9.8 / 0.6, 0.85 * 9.8, 0.85 * 9.8 / 0.6]
    assert found == pytest.approx(expected, rel=1e-12)
    assert columns.parameters_of("cc") == columns.CarefulDriver(braking=0.774 * 9.81)


@pytest.mark.parametrize("edition", columns.EDITIONS)
def test_threshold_and_delay_of_an_edition_are_one_number(edition: str) -> None:
    rule = columns.parameters_of("reg157", edition)
    assert isinstance(rule, columns.CutInRule)
    assert rule.reserve == rule.delay == columns.EDITIONS[edition].delay
    published = columns.parameters_of("reg157", edition, ("esmini-reaction",))
    assert isinstance(published, columns.CutInRule)
    assert (published.reserve, published.delay) == (columns.EDITIONS[edition].delay, 0.0)


def test_edition_changes_the_rule_only() -> None:
    for model in ("cc", "fsm", "rss"):
        assert {columns.parameters_of(model, edition) for edition in columns.EDITIONS} == {
            columns.parameters_of(model)
        }


# --- Columns of the reference drivers: each place is taken once -----------------------------------


@pytest.mark.parametrize(
    ("names", "size"),
    [
        ("EGO_SPEED EGO_ACCELERATION OTHER_SPEED OTHER_ACCELERATION GAP LENGTHS LATERAL_GAP"
         " LATERAL_SPEED CUE INTRUSION OVERLAP", columns.VIEW_SIZE),
        ("PERCEIVED DELAYED DECELERATION REACTING EMERGENCY CAME_FROM_SIDE", columns.STATE_SIZE),
        (" ".join(name for name in dir(columns) if name.startswith("S_")), columns.SCENE_SIZE),
        (" ".join(name for name in dir(columns) if name.startswith("R_")), columns.RESULT_SIZE),
    ],
)  # fmt: skip
def test_places_fill_the_array(names: str, size: int) -> None:
    assert sorted(getattr(columns, name) for name in names.split()) == list(range(size))
