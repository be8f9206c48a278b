"""Parameters of the reference drivers: editions, variants, the order of the columns."""

import math
from dataclasses import fields

import pytest

from adeye.kernel.reference_drivers import drivers as columns
from adeye.kernel.reference_drivers.drivers import (
    EDITIONS,
    GROUPS,
    MODELS,
    VARIANTS,
    CarefulDriver,
    CutInRule,
    FuzzyDriver,
    ResponsibleDriver,
    cut_in_threshold,
    named,
    parameters_of,
    vector,
)

CLOSING_KMH = (10, 20, 30, 40, 50, 60)


@pytest.mark.parametrize(
    ("edition", "table"),
    [
        ("r157", (0.581, 0.813, 1.044, 1.276, 1.507, 1.739)),
        ("r157-01", (0.581, 0.813, 1.044, 1.276, 1.507, 1.739)),
        ("eu-2022-1426", (0.48, 0.71, 0.94, 1.18, 1.41, 1.64)),
        ("eu-2022-1426-standing", (0.74, 1.32, 1.90, 2.47, 3.05, 3.63)),
    ],
)
def test_thresholds_of_the_edition(edition: str, table: tuple[float, ...]) -> None:
    rule = parameters_of("reg157", edition)
    ours = [cut_in_threshold(v / 3.6, rule.delay, rule.braking) for v in CLOSING_KMH]
    # The tables are rounded to 0.01 s.
    assert ours == pytest.approx(list(table), abs=0.0101)


@pytest.mark.parametrize(
    ("record", "prefix"),
    [
        (CarefulDriver(), "CC_"),
        (FuzzyDriver(), "FSM_"),
        (ResponsibleDriver(), "RSS_"),
        (CutInRule(), "REG157_"),
    ],
)
def test_fields_are_in_the_order_of_the_columns(record: object, prefix: str) -> None:
    names = {getattr(columns, name): name for name in dir(columns) if name.startswith(prefix)}
    own = [field.name for field in fields(record)][5:]  # type: ignore[arg-type]
    assert [names[5 + k] for k in range(len(own))] == [prefix + name.upper() for name in own]


# How a scene begins and ends is no parameter of a driver.
@pytest.mark.parametrize("name", sorted(set(VARIANTS) - {"jrc-ttc-end", "jrc-first-step"}))
def test_variant_changes_something_and_the_whole_program_holds_it(name: str) -> None:
    changed = [m for m in MODELS if parameters_of(m, variant=(name,)) != parameters_of(m)]
    assert changed
    alone = parameters_of(changed[0], variant=(name,))
    whole = parameters_of(changed[0], variant=(name.partition("-")[0],))
    text = parameters_of(changed[0])
    for field in fields(alone):
        if getattr(alone, field.name) != getattr(text, field.name):
            assert getattr(whole, field.name) == getattr(alone, field.name)


def test_unknown_names_are_refused() -> None:
    for arguments in (("no", "r157"), ("cc", "no"), ("cc", "r157", ("no",))):
        with pytest.raises(KeyError):
            parameters_of(*arguments)


def test_whole_programs_are_all_variants_between_them() -> None:
    assert named(("jrc", "esmini")) == frozenset(VARIANTS)
    assert named(("jrc-guard", "jrc-lead")) == {"jrc-guard", "jrc-lead"}
    assert named(()) == frozenset()
    assert not {*GROUPS} & {*VARIANTS}


def test_esmini_brakes_by_shares_of_9_8() -> None:
    driver = parameters_of("cc", variant=("esmini-gravity",))
    assert isinstance(driver, CarefulDriver)
    assert driver.braking == pytest.approx(0.774 * 9.8, rel=1e-12)
    assert driver.jerk == pytest.approx(0.774 * 9.8 / 0.6, rel=1e-12)
    assert driver.emergency_braking == pytest.approx(0.85 * 9.8, rel=1e-12)
    assert driver.emergency_jerk == pytest.approx(0.85 * 9.8 / 0.6, rel=1e-12)
    text = parameters_of("cc")
    assert isinstance(text, CarefulDriver)
    assert text.braking == 0.774 * 9.81


@pytest.mark.parametrize("edition", EDITIONS)
def test_threshold_and_delay_of_an_edition_are_one_number(edition: str) -> None:
    rule = parameters_of("reg157", edition)
    assert isinstance(rule, CutInRule)
    assert rule.reserve == rule.delay == EDITIONS[edition].delay
    published = parameters_of("reg157", edition, ("esmini-reaction",))
    assert isinstance(published, CutInRule)
    assert (published.reserve, published.delay) == (EDITIONS[edition].delay, 0.0)


def test_edition_changes_the_rule_only() -> None:
    for model in ("cc", "fsm", "rss"):
        assert {parameters_of(model, edition) for edition in EDITIONS} == {parameters_of(model)}


def test_vector_is_filled_with_zeros() -> None:
    row = vector(CutInRule())
    assert row.shape == (columns.PARAMETER_SIZE,)
    assert row[columns.JERK] == math.inf
    assert row[-1] == 0.0


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
