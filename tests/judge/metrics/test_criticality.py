"""Contact, distance, times, decelerations, RSS and last moments to evade, over hand-made runs."""

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import compute_metrics
from tests.judge.conftest import measure


def approach(made: Any) -> Any:
    """The ego, at 20 m/s, nears a standing lead from 44 m to 4 m."""
    return made.object("lead", speed=0.0, s=48.0)


def test_no_contact_is_zero_without_time_and_actor(hand_made: Any) -> None:
    assert measure(hand_made(), "contact") == pytest.approx((0.0, "value", np.nan, -1), nan_ok=True)
    assert measure(hand_made(), "impact_speed_mps")[1] == "no_conflict"


def test_contact_has_time_actor_and_impact_speed(hand_made: Any) -> None:
    made = hand_made(objects=("lead", "other")).touch(7, "other", speed=4.5)
    assert measure(made, "contact") == (1.0, "value", pytest.approx(0.7), 1)
    assert measure(made, "impact_speed_mps") == (4.5, "value", pytest.approx(0.7), 1)
    assert measure(made, "min_distance_m") == (0.0, "value", pytest.approx(0.7), 1)
    assert measure(made, "min_ttc_s") == (0.0, "value", pytest.approx(0.7), 1)


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


def test_gap_at_standstill_needs_an_ego_that_stands_and_somebody_ahead(hand_made: Any) -> None:
    assert measure(hand_made(), "standstill_gap_m")[1] == "not_applicable"
    assert measure(hand_made(objects=()).ego(speed=0.0), "standstill_gap_m")[1] == "no_conflict"


def test_unknown_impact_speed_is_an_error_when_computed_with_the_others(hand_made: Any) -> None:
    made = hand_made().touch(5, "lead", speed=np.nan)
    assert compute_metrics(made.trace())["impact_speed_mps"].status == ("error",)


G = 9.80665


AT_THE_END = {
    "min_mttc_s": 0.2,
    "min_ettc_s": 0.2,
    "max_mdrac_mps2": 100.0,
    "max_dst_mps2": 50.0,
    "min_mtc": 4.0 * 2.0 * 0.7 * G / 400.0,
    "max_btn": 50.0 / 9.0,
    "max_stn": 2.0 * 2.0 / (0.04 * G),
    "min_ttb_s": 0.2 - 20.0 / 18.0,
    "min_tts_s": 0.2 - (4.0 / G) ** 0.5,
    "min_ttk_s": -10.0,
    "min_ttr_s": 0.2 - (4.0 / G) ** 0.5,
}
# Too late for the modified rate is it from the second before the collision on.
EARLIER = {"max_mdrac_mps2": 1.2, "min_ttk_s": 0.0}


def test_last_moments_of_an_approach_are_at_its_end(hand_made: Any) -> None:
    made = approach(hand_made())
    for column, expected in AT_THE_END.items():
        value, status, time, actor = measure(made, column)
        assert (value, status, actor) == (pytest.approx(expected, rel=1e-9), "value", 0), column
        assert time == pytest.approx(EARLIER.get(column, 2.0)), column


def test_mirrored_road_is_the_same(hand_made: Any) -> None:
    def made(side: float) -> Any:
        d = 5.25 + side * np.linspace(2.5, 0.5, 21)
        return hand_made().object("lead", s=np.linspace(30.0, 50.0, 21), speed=10.0, d=d)

    for column in (*AT_THE_END, "min_rear_ttc_s", "max_follower_deceleration_mps2"):
        left, right = measure(made(1.0), column), measure(made(-1.0), column)
        np.testing.assert_array_equal(left, right, err_msg=column)


def test_lost_safety_time_is_undefined_and_no_low_value_hides_it(hand_made: Any) -> None:
    # 20 m/s behind 15 m/s: 1 s of the lead's speed is lost once 15 m are left.
    gap = np.linspace(40.0, 10.0, 21)
    made = hand_made().object("lead", speed=15.0, s=20.0 * np.arange(21) * 0.1 + 4.0 + gap)
    assert measure(made, "max_dst_mps2")[1] == "undefined"
    made.length[:] = 5
    assert measure(made, "max_dst_mps2")[1] == "value"


def test_opening_gap_demands_nothing(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=25.0, s=44.0 + 25.0 * np.arange(21) * 0.1)
    assert measure(made, "max_mdrac_mps2")[:2] == (0.0, "value")
    assert measure(made, "max_stn")[:2] == (0.0, "value")
    assert measure(made, "min_ttb_s")[1] == measure(made, "min_mttc_s")[1] == "no_conflict"


def test_who_comes_in_the_own_lane_cannot_be_braked_for(hand_made: Any) -> None:
    made = hand_made().object(
        "lead", s=200.0 - 20.0 * np.arange(21) * 0.1, speed=20.0, heading=np.pi
    )
    assert measure(made, "min_ttb_s")[:2] == (-10.0, "value")
    assert measure(made, "min_tts_s")[0] == pytest.approx(
        (196.0 - 80.0) / 40.0 - (4.0 / G) ** 0.5, rel=1e-6
    )


def test_follower_is_who_drives_behind_in_the_path(hand_made: Any) -> None:
    time = np.arange(21) * 0.1
    made = hand_made().object("lead", s=-30.0 + 24.0 * time, speed=24.0)
    made.ego(acceleration=-4.0)
    gap = 30.0 - 4.0 - 4.0 * 2.0
    assert measure(made, "min_rear_ttc_s") == (pytest.approx(gap / 4.0, rel=1e-9), "value", 2.0, 0)
    # The ego goes on braking and stands after 50 m, before both are equally fast.
    assert measure(made, "max_follower_deceleration_mps2")[0] == pytest.approx(
        24.0**2 / (2.0 * (gap + 50.0)), rel=1e-9
    )
    beside = made.object("lead", d=8.75)
    assert measure(beside, "min_rear_ttc_s")[1] == "no_conflict"


def test_time_to_collision_converges_with_the_step(hand_made: Any) -> None:
    # The ego brakes: the least time to collision lies between rows. 44 m, 20 m/s, 6 m/s².
    def least(step: float) -> float:
        rows = round(2.4 / step) + 1
        time = np.arange(rows) * step
        made = hand_made(rows=rows, step=step)
        made.object("lead", speed=0.0, s=48.0)
        made.ego(s=20.0 * time - 3.0 * time**2, speed=20.0 - 6.0 * time)
        return float(measure(made, "min_ttc_2d_s")[0])

    fine = np.linspace(0.0, 2.4, 2_400_001)
    exact = float(((44.0 - 20.0 * fine + 3.0 * fine**2) / (20.0 - 6.0 * fine)).min())
    errors = [least(step) - exact for step in (0.4, 0.2, 0.1, 0.05, 0.025)]
    assert all(error >= 0.0 for error in errors)
    # At a smooth least value the error falls with the square of the step.
    assert errors[-1] <= errors[0] / 16.0


def test_earliest_of_equals_and_rows_within_the_run_count(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=15.0)
    assert measure(made, "min_mttc_s")[:3] == (pytest.approx(8.0), "value", 0.0)
    made.object("lead", speed=0.0, s=48.0)
    made.length[:] = 11
    assert measure(made, "min_mttc_s")[:3] == (pytest.approx(1.2), "value", pytest.approx(1.0))


def test_worst_of_several_objects_is_named(hand_made: Any) -> None:
    made = hand_made(objects=("lead", "other"))
    made.object("lead", s=60.0, speed=20.0).object("other", s=90.0, speed=0.0)
    assert measure(made, "min_mttc_s")[3] == 1


def test_contact_from_the_start_leaves_the_manoeuvres_undefined(hand_made: Any) -> None:
    made = hand_made().object("lead", s=3.0, speed=0.0).touch(0, "lead")
    assert measure(made, "min_mttc_s")[:2] == (0.0, "value")
    assert measure(made, "min_ttr_s")[1] == "undefined"


def test_one_unknown_row_makes_an_error_of_all(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=0.0, s=48.0)
    made.columns["object_places"][0, 15, 0, 0] = np.inf
    assert measure(made, "min_ttb_s")[1] == "error"


def test_who_follows(hand_made: Any) -> None:
    for motion, status in (
        ({"s": -30.0, "speed": 24.0}, "value"),
        ({"s": -30.0, "speed": 24.0, "d": 5.25 + 1.99}, "value"),
        ({"s": -30.0, "speed": 24.0, "d": 5.25 - 2.01}, "no_conflict"),
        ({"s": -30.0, "speed": 24.0, "heading": np.pi}, "no_conflict"),
        ({"s": 60.0, "speed": 24.0}, "no_conflict"),
    ):
        made = hand_made().ego(s=0.0)
        made.object("lead", **motion)
        assert measure(made, "min_rear_ttc_s")[1] == status, motion
        assert measure(made, "max_follower_deceleration_mps2")[1] == status, motion


def test_slower_follower_has_nothing_to_fear_and_nothing_to_do(hand_made: Any) -> None:
    made = hand_made().object("lead", s=-30.0, speed=15.0)
    assert measure(made, "min_rear_ttc_s")[1] == "no_conflict"
    assert measure(made, "max_follower_deceleration_mps2")[:2] == (0.0, "value")


def test_gap_behind_on_a_bend_is_that_along_the_lane_of_who_follows(hand_made: Any) -> None:
    made = hand_made().ego(s=0.0, d=8.75).object("lead", s=-30.0, d=8.75, speed=24.0)
    for state, place in (("ego", "ego_place"), ("objects", "object_places")):
        turned = made.columns[place][..., 0] / 60.0
        made.columns[place][..., 2] = made.columns[state][..., 2] = turned
    gap = 30.0 * (60.0 - 8.75) / 60.0 - 4.0
    assert measure(made, "min_rear_ttc_s")[0] == pytest.approx(gap / 4.0)
