"""Which manoeuvre is in force, tick by tick."""

import numpy as np
import pytest

from adeye.kernel.stops import ANYWHERE, ONLY_REST_AREA, ROADSIDE
from adeye.signals import Floats
from adeye.simulate.channels.safety.supervisor import (
    CONTINUE,
    FORCE_ASKED,
    FORCE_HELD,
    FORCE_LEVEL,
    FORCE_ROW,
    FORCE_WAITED,
    NONE,
    REST_AREA,
    ROADSIDE_PARKING,
    SET_LEAST,
    SET_OF_LEVEL,
    SET_PATIENCE,
    SET_ROW,
    SET_SIGHT,
    STOP,
    ask,
    give_way,
    look_ahead,
    show_manoeuvre,
)

SETTINGS = np.zeros(SET_ROW)
SETTINGS[SET_OF_LEVEL:] = CONTINUE, REST_AREA, ROADSIDE_PARKING, STOP
SETTINGS[SET_PATIENCE] = 1.0
SETTINGS[SET_LEAST], SETTINGS[SET_SIGHT] = 25.0, 1000.0
GOING_ON = False


def state(held: int = NONE, asked: int = NONE, level: int = 0, waited: float = 0.0) -> Floats:
    row = np.zeros(FORCE_ROW)
    row[FORCE_HELD], row[FORCE_ASKED], row[FORCE_LEVEL] = held, asked, level
    row[FORCE_WAITED] = waited
    return row


@pytest.mark.parametrize("level", [0, 1, 2, 3, 4])
def test_level_asks_for_its_manoeuvre(level: int) -> None:
    row = state(level=level)
    ask(row, SETTINGS, GOING_ON, 0.05)
    assert row[FORCE_ASKED] == row[FORCE_HELD] == level


def test_what_has_given_way_stays_so_while_the_level_is_the_same() -> None:
    row = state(STOP, REST_AREA, 2)
    ask(row, SETTINGS, GOING_ON, 0.05)
    assert row[FORCE_HELD] == STOP


def test_lower_level_begins_anew_unless_the_channel_has_taken_over() -> None:
    for stopping, held in ((False, REST_AREA), (True, STOP)):
        row = state(STOP, ROADSIDE_PARKING, 2, 0.5)
        ask(row, SETTINGS, stopping, 0.05)
        assert row[FORCE_HELD] == held
        assert row[FORCE_WAITED] == (0.55 if stopping else 0.0)


@pytest.mark.parametrize(
    ("held", "rest", "parking", "waited", "left"),
    [
        (REST_AREA, True, True, 1.0, REST_AREA),
        (REST_AREA, True, True, 1.01, ROADSIDE_PARKING),
        (REST_AREA, False, True, 0.0, ROADSIDE_PARKING),
        (REST_AREA, False, False, 0.0, STOP),
        (ROADSIDE_PARKING, True, True, 1.0, ROADSIDE_PARKING),
        (ROADSIDE_PARKING, True, True, 1.01, STOP),
        (ROADSIDE_PARKING, True, False, 0.0, STOP),
        (CONTINUE, False, False, 9.0, CONTINUE),
        (STOP, True, True, 9.0, STOP),
    ],
)
def test_what_cannot_be_had_or_not_in_time_gives_way(
    held: int, rest: float, parking: float, waited: float, left: int
) -> None:
    row = state(held, held, held, waited)
    give_way(row, SETTINGS, bool(rest), bool(parking))
    assert row[FORCE_HELD] == left


def test_columns_tell_what_is_asked_for_and_what_is_in_force() -> None:
    shown = np.zeros((3, 2), dtype=np.bool_)
    show_manoeuvre(state(STOP, REST_AREA), shown)
    assert shown.tolist() == [[True, False], [False, False], [False, True]]


@pytest.mark.parametrize(
    ("refuges", "best"),
    [
        ([], ANYWHERE),
        ([(0, 100.0)], ROADSIDE),
        ([(0, 100.0), (1, 500.0)], ONLY_REST_AREA),
        ([(1, 25.0)], ANYWHERE),
        ([(1, 25.1)], ONLY_REST_AREA),
        ([(1, 1000.1), (0, 1000.0)], ROADSIDE),
        ([(1, -50.0)], ANYWHERE),
    ],
)
def test_map_shows_what_is_neither_too_near_nor_out_of_sight(
    refuges: list[tuple[float, float]], best: int
) -> None:
    rows = np.zeros((len(refuges), 5))
    for row, (kind, ahead) in zip(rows, refuges, strict=True):
        row[:2] = kind, 300.0 + ahead
    assert look_ahead(SETTINGS, rows, 300.0) == best
