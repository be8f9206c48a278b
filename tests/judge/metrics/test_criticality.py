"""Contact, distance, times, decelerations and RSS over hand-made runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS, compute_metrics


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), found.actor[0]


def approach(made: Any) -> Any:
    """The ego, at 20 m/s, nears a standing lead from 44 m to 4 m."""
    return made.object("lead", speed=0.0, s=48.0)


def test_no_contact_is_zero_without_time_and_actor(hand_made: Any) -> None:
    assert measure(hand_made(), "contact") == pytest.approx((0.0, "value", np.nan, -1), nan_ok=True)


def test_contact_has_time_actor_and_impact_speed(hand_made: Any) -> None:
    made = hand_made(objects=("lead", "other")).touch(7, "other", speed=4.5)
    assert measure(made, "contact") == (1.0, "value", pytest.approx(0.7), 1)
    assert measure(made, "impact_speed_mps") == (4.5, "value", pytest.approx(0.7), 1)
    assert measure(made, "min_distance_m") == (0.0, "value", pytest.approx(0.7), 1)
    assert measure(made, "min_ttc_s") == (0.0, "value", pytest.approx(0.7), 1)


def test_without_contact_there_is_no_impact(hand_made: Any) -> None:
    assert measure(hand_made(), "impact_speed_mps")[1] == "no_conflict"


def test_worst_case_is_the_earliest_of_equals(hand_made: Any) -> None:
    assert measure(hand_made(), "min_time_headway_s") == (pytest.approx(2.2), "value", 0.0, 0)


def test_approach_is_worst_at_its_end(hand_made: Any) -> None:
    made = approach(hand_made())
    assert measure(made, "min_distance_m") == (pytest.approx(4.0), "value", 2.0, 0)
    assert measure(made, "min_ttc_s") == (pytest.approx(0.2), "value", 2.0, 0)
    assert measure(made, "max_drac_mps2") == (pytest.approx(50.0), "value", 2.0, 0)
    assert measure(made, "max_required_deceleration_mps2")[0] == pytest.approx(50.0)


def test_rows_beyond_the_run_do_not_count(hand_made: Any) -> None:
    made = approach(hand_made())
    made.length[:] = 11
    assert measure(made, "min_distance_m") == (pytest.approx(24.0), "value", 1.0, 0)


@pytest.mark.parametrize(
    "column", ["min_distance_m", "min_ttc_s", "min_time_headway_s", "max_drac_mps2"]
)
def test_empty_road_is_no_conflict(hand_made: Any, column: str) -> None:
    value, status, time, actor = measure(hand_made(objects=()), column)
    assert (status, actor) == ("no_conflict", -1)
    assert np.isnan([value, time]).all()


def test_decelerations_stop_before_the_contact(hand_made: Any) -> None:
    made = approach(hand_made()).object("lead", s=43.0).touch(20, "lead")
    # The closed form is 200 m/s² at that row; a demand is limited to what can mean anything.
    assert measure(made, "max_drac_mps2") == (pytest.approx(100.0), "value", pytest.approx(1.9), 0)


def test_contact_from_the_start_leaves_the_deceleration_undefined(hand_made: Any) -> None:
    made = hand_made().object("lead", s=3.0, speed=0.0).touch(0, "lead")
    assert measure(made, "max_required_deceleration_mps2")[1] == "undefined"


def test_each_row_with_an_rss_violation_counts_one_step(hand_made: Any) -> None:
    gap = np.full(21, 80.0)
    gap[4:9] = [60.0, 50.0, 40.0, 50.0, 60.0]
    made = hand_made().object("lead", s=20.0 * np.arange(21) * 0.1 + 4.0 + gap)
    assert measure(made, "rss_violation_s") == (
        pytest.approx(0.5), "value", pytest.approx(0.6), 0
    )  # fmt: skip


def test_without_rss_violation_the_time_is_zero(hand_made: Any) -> None:
    value, status, time, actor = measure(hand_made(objects=()), "rss_violation_s")
    assert (value, status, actor) == (0.0, "value", -1)
    assert np.isnan(time)


def test_gap_at_standstill_is_measured_while_the_ego_stands(hand_made: Any) -> None:
    speed = np.where(np.arange(21) < 12, 5.0, 0.0)
    made = hand_made().ego(s=0.0, speed=speed).object("lead", s=np.linspace(30.0, 10.0, 21))
    assert measure(made, "standstill_gap_m") == (pytest.approx(6.0), "value", 2.0, 0)


def test_ego_that_never_stands_has_no_gap_at_standstill(hand_made: Any) -> None:
    assert measure(hand_made(), "standstill_gap_m")[1] == "not_applicable"


def test_standstill_with_nothing_ahead_is_no_conflict(hand_made: Any) -> None:
    made = hand_made(objects=()).ego(speed=0.0)
    assert measure(made, "standstill_gap_m")[1] == "no_conflict"


@pytest.mark.parametrize(
    "column",
    [
        "min_distance_m",
        "min_ttc_s",
        "min_time_headway_s",
        "max_drac_mps2",
        "max_required_deceleration_mps2",
        "rss_violation_s",
        "standstill_gap_m",
    ],
)
def test_one_unknown_speed_makes_the_metric_an_error(hand_made: Any, column: str) -> None:
    made = hand_made()
    made.columns["ego"][0, 10, 3] = np.nan
    value, status, _, _ = measure(made, column)
    assert status == "error"
    assert not np.isfinite(value)


def test_unknown_impact_speed_is_an_error_when_computed_with_the_others(hand_made: Any) -> None:
    made = hand_made().touch(5, "lead", speed=np.nan)
    assert compute_metrics(made.trace())["impact_speed_mps"].status == ("error",)
