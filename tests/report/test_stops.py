"""What a report says about safe stops: what is not known, or touches something, never passes."""

from typing import Any

import numpy as np
import pytest

from adeye.judge.verdict import Verdict
from adeye.kernel.stops import SCALE
from adeye.report.assessment import safe_stops_of
from adeye.report.model.assessment import SafeStops
from adeye.store.read.bulk import Figures, Labels

NAN = float("nan")
NAMES = (
    "takeovers",
    "contact",
    "stop_rating",
    "emergency_operation_time_s",
    "fault_to_safe_state_s",
    "max_deceleration_mps2",
    "stop_regret",
)
STANDS = (1.0, 0.0, 4.0, 5.0, 6.0, 4.0, 1.0)
MOVES = (1.0, 0.0, NAN, NAN, NAN, 2.0, NAN)
TOUCHES = (1.0, 1.0, 8.0, NAN, NAN, 9.0, 3.0)
QUIET = (0.0, 0.0, NAN, NAN, NAN, 3.0, NAN)
UNKNOWN = (NAN, 0.0, NAN, NAN, NAN, 3.0, NAN)


def told(*runs: tuple[float, ...], faults: tuple[str, ...] = ()) -> SafeStops:
    count = len(runs)
    values: Any = np.array(runs, dtype=np.float64).reshape(count, len(NAMES))
    figures = Figures(
        ordinal=np.arange(count),
        scenario=Labels.of(["cut_in"] * count),
        architecture=Labels.of(["a"] * count),
        fault_entry=Labels.of(faults or ["none"] * count),
        replicate=np.zeros(count, dtype=np.int64),
        outcome=Labels.of(["completed"] * count),
        points={},
        metrics=dict(zip(NAMES, values.T, strict=True)),
        duration_s=np.ones(count),
        machine_dependent=np.zeros(count, dtype=np.bool_),
    )
    return safe_stops_of(figures, lambda ordinal: f"run{ordinal}", lambda run: f"replay {run}")


@pytest.mark.parametrize("runs", [(), (QUIET, QUIET)])
def test_none_asked_has_no_row(runs: tuple[tuple[float, ...], ...]) -> None:
    found = told(*runs)
    assert (found.runs, found.asked, found.unknown, found.rows) == (len(runs), 0, 0, ())


def test_stop_that_is_reached_has_times_and_a_place() -> None:
    [row] = told(STANDS, QUIET).rows
    assert (row.runs, row.asked, row.reached, row.contact, row.moving) == (2, 1, 1, 0, 0)
    assert (row.slowest_s, row.from_fault_s, row.deceleration_mps2, row.regret) == (5, 6, 4, 1)
    assert [(item.place, item.runs) for item in row.places] == [(SCALE[4], 1)]
    assert (row.verdict, row.run, row.command) == (Verdict.PASS, "run0", "replay run0")


def test_worst_run_touches_something_before_it_moves_before_it_stands_badly() -> None:
    better = (*STANDS[:2], 3.0, *STANDS[3:])
    for order, worst in (
        ((better, STANDS, MOVES, TOUCHES), "run3"),
        ((better, MOVES, STANDS), "run1"),
        ((better, STANDS), "run1"),
    ):
        [row] = told(*order).rows
        assert row.run == worst


def test_slower_of_two_equal_places_is_worse() -> None:
    slow = (*STANDS[:3], 9.0, *STANDS[4:])
    [row] = told(STANDS, slow).rows
    assert (row.run, row.slowest_s) == ("run1", 9.0)


def test_contact_fails_and_is_in_the_worst_place() -> None:
    [row] = told(STANDS, TOUCHES).rows
    assert (row.verdict, row.contact, row.reached) == (Verdict.FAIL, 1, 1)
    assert [item.place for item in row.places] == ["contact", SCALE[4]]
    # What counts of a run with a contact is the contact.
    assert row.regret == 1


def test_unknown_contact_is_a_contact() -> None:
    [row] = told((1.0, NAN, *STANDS[2:])).rows
    assert (row.verdict, row.contact) == (Verdict.FAIL, 1)


@pytest.mark.parametrize("other", [MOVES, UNKNOWN])
def test_what_moves_or_is_not_known_decides_nothing(other: tuple[float, ...]) -> None:
    found = told(STANDS, other)
    [row] = found.rows
    assert row.verdict is Verdict.INCONCLUSIVE
    assert (row.moving + row.unknown, found.asked + found.unknown) == (1, 2)


def test_unknown_alone_has_a_row_and_no_run() -> None:
    [row] = told(UNKNOWN).rows
    assert (row.run, row.command, row.verdict) == (None, "", Verdict.INCONCLUSIVE)


def test_rows_are_worst_first() -> None:
    found = told(STANDS, MOVES, TOUCHES, QUIET, faults=("a", "b", "c", "d"))
    assert [row.fault_entry for row in found.rows] == ["c", "b", "a"]
