"""Cells, conflicts, takeovers in hindsight, and what a gate makes of them."""

from typing import Any

import pytest

from adeye.judge.preventability import (
    CELLS,
    Cell,
    Comparison,
    Takeover,
    TakeoverClass,
    cell_of,
    classify_takeover,
    gate_verdict,
    is_conflict,
    precision_of,
    recall_of,
    tabulate_cells,
)
from adeye.judge.verdict import Verdict

FAIL, PASS, INCONCLUSIVE = Verdict.FAIL, Verdict.PASS, Verdict.INCONCLUSIVE
NEITHER: dict[str, Cell] = {"cc": "neither"}


def test_cells() -> None:
    for ours, theirs, cell in (
        (False, False, "both_avoid"),
        (False, True, "only_ours"),
        (True, False, "only_model"),
        (True, True, "neither"),
        (None, True, "unknown"),
        (True, None, "unknown"),
        (None, None, "unknown"),
    ):
        assert cell_of(ours, theirs) == cell


def test_a_driver_whom_another_one_runs_into_may_have_avoided_what_we_have_not() -> None:
    cells = [cell_of(ours=True, theirs=theirs, is_same=False) for theirs in (True, False)]
    assert cells == ["unknown", "only_model"]


def test_conflicts() -> None:
    for contact, required, expected in (
        (True, None, True),
        (None, None, True),
        (False, None, False),
        (False, 6.0, False),
        (False, 6.1, True),
    ):
        assert is_conflict(contact, required, 6.0) is expected


def test_cells_are_counted_by_scenario_architecture_and_model() -> None:
    def made(architecture: str, cell: Any) -> Comparison:
        return Comparison("r", "s", architecture, "none", "cc", "r157-01", "d", cell, None, None)

    rows = tabulate_cells([made("b", "neither"), made("a", "unknown"), made("b", "neither")])
    assert [(row.architecture, row.counts["neither"]) for row in rows] == [("a", 0), ("b", 2)]
    assert all(tuple(row.counts) == CELLS for row in rows)


def test_gate() -> None:
    failures: Any
    for counts, failures, models, expected in (
        # Set aside, and something passes.
        ({FAIL: 1, PASS: 3}, [NEITHER], ["cc"], (PASS, 1, 0)),
        # Nothing passes but what is set aside.
        ({FAIL: 1}, [NEITHER], ["cc"], (Verdict.VACUOUS, 1, 0)),
        # What else is open stays open.
        ({FAIL: 1, PASS: 3, INCONCLUSIVE: 1}, [NEITHER], ["cc"], (INCONCLUSIVE, 1, 0)),
        # One that the model avoids.
        ({FAIL: 2, PASS: 3}, [NEITHER, {"cc": "only_model"}], ["cc"], (FAIL, 1, 0)),
        # One of another model.
        ({FAIL: 1, PASS: 3}, [{"fsm": "neither"}], ["cc"], (FAIL, 0, 1)),
        # One of two models avoids it.
        ({FAIL: 1, PASS: 3}, [{**NEITHER, "fsm": "only_model"}], ["cc", "fsm"], (FAIL, 0, 0)),
        # Not known.
        ({FAIL: 1, PASS: 3}, [{"cc": "unknown"}], ["cc"], (FAIL, 0, 1)),
        ({FAIL: 1, PASS: 3}, [{"": "unknown"}], ["cc"], (FAIL, 0, 1)),
        # No contact.
        ({FAIL: 1, PASS: 3}, [{}], ["cc"], (FAIL, 0, 0)),
        # Nobody is asked.
        ({FAIL: 1, PASS: 3}, [NEITHER], [], (FAIL, 0, 0)),
        # Not the failures that were counted.
        ({FAIL: 2, PASS: 3}, [NEITHER], ["cc"], (FAIL, 0, 0)),
        ({FAIL: 1, PASS: 3}, [NEITHER, NEITHER], ["cc"], (FAIL, 0, 0)),
    ):
        assert gate_verdict(counts, failures, models) == expected


def test_gate_keeps_the_least_number_of_exercised_runs_and_waivers() -> None:
    counts = {FAIL: 1, PASS: 3, INCONCLUSIVE: 1}
    assert gate_verdict(counts, [NEITHER], ["cc"], is_waived=True)[0] is PASS
    few = gate_verdict({FAIL: 1, PASS: 3}, [NEITHER], ["cc"], min_exercised=4)
    assert few[0] is Verdict.VACUOUS


def test_takeover_is_classified_by_what_happens_without() -> None:
    for takeover, expected in (
        (Takeover(took_over=True, violates=False, fork_violates=True), "needed_and_done"),
        (Takeover(took_over=True, violates=True, fork_violates=True), "late"),
        (Takeover(took_over=True, violates=False, fork_violates=False), "spurious"),
        (Takeover(took_over=True, violates=True, fork_violates=False), "spurious"),
        (Takeover(took_over=False, violates=True, fork_violates=False), "missed"),
        (Takeover(took_over=False, violates=True, fork_violates=True), "missed"),
        (Takeover(took_over=False, violates=True, fork_violates=None), "missed"),
        (Takeover(took_over=False, violates=False, fork_violates=True), "not_needed"),
        (Takeover(took_over=False, violates=False, fork_violates=None), "not_needed"),
    ):
        assert classify_takeover(takeover) == expected


def test_takeover_without_its_fork_has_no_truth() -> None:
    with pytest.raises(ValueError, match="without its fork"):
        classify_takeover(Takeover(took_over=True, violates=False, fork_violates=None))


COUNTS: dict[TakeoverClass, int] = {
    "needed_and_done": 6,
    "late": 1,
    "spurious": 3,
    "missed": 2,
    "not_needed": 9,
}


def test_late_takeover_was_needed_and_yet_not_in_time() -> None:
    assert precision_of(COUNTS) == (7, 10)
    assert recall_of(COUNTS, 2) == (6, 9)


def test_violation_that_no_takeover_would_have_avoided_needed_none() -> None:
    assert recall_of(COUNTS, 0) == (6, 7)


def test_without_takeovers_there_is_no_share() -> None:
    nothing: dict[TakeoverClass, int] = dict.fromkeys(COUNTS, 0)
    assert precision_of(nothing) == recall_of(nothing, 0) == (0, 0)
