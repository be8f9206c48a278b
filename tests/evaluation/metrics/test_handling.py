"""From a fault to the handover and to the safe state, over hand-made runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.evaluation.metrics import METRICS


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    assert found.actor == (-1,)
    return float(found.value[0]), found.status[0], float(found.time[0])


def faulty(made: Any, *, rows: Any = slice(5, None)) -> Any:
    return made.set("fault_active", value=True, rows=rows, at=0)


def stopping(made: Any, row: int) -> Any:
    """The ego stands from a row on."""
    return made.ego(speed=np.where(np.arange(21) < row, 8.0, 0.0))


@pytest.mark.parametrize("column", ["fault_to_safe_state_s", "takeover_time_s"])
def test_without_an_active_fault_nothing_applies(hand_made: Any, column: str) -> None:
    made = stopping(hand_made(), 10).set("authority", 1, rows=slice(8, None))
    assert measure(made, column)[1] == "not_applicable"


@pytest.mark.parametrize("column", ["fault_to_safe_state_s", "takeover_time_s"])
def test_entry_without_faults_does_not_apply(hand_made: Any, column: str) -> None:
    assert measure(hand_made(faults=()), column)[1] == "not_applicable"


def test_safe_state_is_timed_from_the_onset(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 14))
    assert measure(made, "fault_to_safe_state_s") == (
        pytest.approx(0.9),
        "value",
        pytest.approx(1.4),
    )


def test_fault_that_has_passed_still_counts(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 14), rows=slice(5, 7))
    assert measure(made, "fault_to_safe_state_s")[0] == pytest.approx(0.9)


def test_first_of_two_faults_counts(hand_made: Any) -> None:
    made = stopping(hand_made(faults=("a", "b")), 14)
    made.set("fault_active", value=True, rows=slice(9, None), at=0)
    made.set("fault_active", value=True, rows=slice(4, 6), at=1)
    assert measure(made, "fault_to_safe_state_s")[0] == pytest.approx(1.0)


def test_run_that_ends_before_the_safe_state_is_incomplete(hand_made: Any) -> None:
    assert measure(faulty(hand_made()), "fault_to_safe_state_s")[1] == "incomplete"


def test_safe_state_that_is_left_again_does_not_count(hand_made: Any) -> None:
    row = np.arange(21)
    made = faulty(hand_made().ego(speed=np.where((row < 8) | (row == 15), 8.0, 0.0)))
    assert measure(made, "fault_to_safe_state_s")[0] == pytest.approx(1.1)


def test_ego_that_stands_all_the_time_is_safe_at_once(hand_made: Any) -> None:
    made = faulty(hand_made().ego(speed=0.0))
    assert measure(made, "fault_to_safe_state_s") == (0.0, "value", pytest.approx(0.5))


def test_contact_after_the_fault_leaves_it_incomplete(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 8)).touch(12, "lead")
    assert measure(made, "fault_to_safe_state_s")[1] == "incomplete"


def test_unknown_speed_is_an_error(hand_made: Any) -> None:
    made = faulty(stopping(hand_made(), 14))
    made.columns["ego"][0, 2, 3] = np.nan
    assert measure(made, "fault_to_safe_state_s")[1] == "error"


def test_takeover_is_timed_from_the_onset(hand_made: Any) -> None:
    made = faulty(hand_made()).set("authority", 1, rows=slice(8, None))
    assert measure(made, "takeover_time_s") == (pytest.approx(0.3), "value", pytest.approx(0.8))


def test_takeover_in_the_row_of_the_onset_takes_no_time(hand_made: Any) -> None:
    made = faulty(hand_made()).set("authority", 1, rows=slice(5, None))
    assert measure(made, "takeover_time_s")[:2] == (0.0, "value")


def test_takeover_from_the_first_row_is_seen_against_the_default_channel(hand_made: Any) -> None:
    made = faulty(hand_made(), rows=slice(None)).set("authority", 1)
    assert measure(made, "takeover_time_s")[:2] == (0.0, "value")


def test_time_in_which_nobody_acts_belongs_to_the_takeover(hand_made: Any) -> None:
    made = faulty(hand_made()).set("authority", -1, rows=slice(6, 8))
    assert measure(made, "takeover_time_s")[1] == "incomplete"
    made.set("authority", 1, rows=slice(8, None))
    assert measure(made, "takeover_time_s") == (pytest.approx(0.3), "value", pytest.approx(0.8))


def test_default_that_acts_after_the_start_up_has_taken_nothing_over(hand_made: Any) -> None:
    made = faulty(hand_made(), rows=slice(1, None)).set("authority", -1, rows=slice(0, 3))
    assert measure(made, "takeover_time_s")[1] == "incomplete"


def test_handover_before_the_fault_does_not_count(hand_made: Any) -> None:
    made = faulty(hand_made()).set("authority", 1, rows=slice(3, None))
    assert measure(made, "takeover_time_s")[1] == "incomplete"


def test_fault_in_the_last_row_decides_nothing(hand_made: Any) -> None:
    made = faulty(hand_made(), rows=20)
    assert measure(made, "takeover_time_s")[1] == "not_applicable"
