"""What a report says about safe stops: what is not known, or touches something, never passes."""

from adeye.judge.verdict import Verdict
from adeye.kernel.stops import SCALE
from adeye.report.assessment import safe_stops_of
from adeye.report.model.assessment import SafeStops
from tests.figures import figures_of

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
    figures = figures_of(
        [
            {"scenario": "cut_in", "architecture": "a", "fault_entry": fault}
            | dict(zip(NAMES, values, strict=True))
            for values, fault in zip(runs, faults or ["none"] * len(runs), strict=True)
        ]
    )
    return safe_stops_of(figures, lambda ordinal: f"run{ordinal}", lambda run: f"replay {run}")


def test_none_asked_has_no_row() -> None:
    for runs in ((), (QUIET, QUIET)):
        found = told(*runs)
        assert (found.runs, found.asked, found.unknown, found.rows) == (len(runs), 0, 0, ())


def test_stop_that_is_reached_has_times_and_a_place() -> None:
    [row] = told(STANDS, QUIET).rows
    assert (row.runs, row.asked, row.reached, row.contact, row.moving) == (2, 1, 1, 0, 0)
    assert (row.slowest_s, row.from_fault_s, row.deceleration_mps2, row.regret) == (5, 6, 4, 1)
    assert [(item.place, item.runs) for item in row.places] == [(SCALE[4], 1)]
    assert (row.verdict, row.run, row.command) == (Verdict.PASS, "run0", "replay run0")


def test_worst_run_touches_something_before_it_moves_before_it_stands_badly_or_slowly() -> None:
    better = (*STANDS[:2], 3.0, *STANDS[3:])
    for order, worst in (
        ((better, STANDS, MOVES, TOUCHES), "run3"),
        ((better, MOVES, STANDS), "run1"),
        ((better, STANDS), "run1"),
    ):
        [row] = told(*order).rows
        assert row.run == worst
    [row] = told(STANDS, (*STANDS[:3], 9.0, *STANDS[4:])).rows
    assert (row.run, row.slowest_s) == ("run1", 9.0)


def test_contact_fails_and_is_in_the_worst_place_and_so_is_an_unknown_one() -> None:
    [row] = told(STANDS, TOUCHES).rows
    assert (row.verdict, row.contact, row.reached) == (Verdict.FAIL, 1, 1)
    assert [item.place for item in row.places] == ["contact", SCALE[4]]
    # What counts of a run with a contact is the contact.
    assert row.regret == 1
    [row] = told((1.0, NAN, *STANDS[2:])).rows
    assert (row.verdict, row.contact) == (Verdict.FAIL, 1)


def test_what_moves_or_is_not_known_decides_nothing() -> None:
    for other in (MOVES, UNKNOWN):
        found = told(STANDS, other)
        [row] = found.rows
        assert row.verdict is Verdict.INCONCLUSIVE
        assert (row.moving + row.unknown, found.asked + found.unknown) == (1, 2)
    # Alone it has a row and no run.
    [row] = told(UNKNOWN).rows
    assert (row.run, row.command, row.verdict) == (None, "", Verdict.INCONCLUSIVE)


def test_rows_are_worst_first() -> None:
    found = told(STANDS, MOVES, TOUCHES, QUIET, faults=("a", "b", "c", "d"))
    assert [row.fault_entry for row in found.rows] == ["c", "b", "a"]
