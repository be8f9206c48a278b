"""What the reference drivers share: sides, delays, ramps, and published code behind a lead."""

import math

import numpy as np
import pytest

from adeye.kernel.reference_drivers import parameters as columns
from adeye.kernel.reference_drivers.parameters import (
    CarefulDriver,
    CutInRule,
    parameters_of,
    vector,
)
from adeye.kernel.reference_drivers.reactions import (
    is_ahead,
    is_lead_at_once,
    is_unknown,
    note_side,
    react,
    respond,
)

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
