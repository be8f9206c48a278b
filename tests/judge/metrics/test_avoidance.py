"""Times to collision, decelerations and last moments to evade of hand-made runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), found.actor[0]


G = 9.80665


def approach(made: Any) -> Any:
    """The ego, at 20 m/s, nears a standing lead from 44 m to 4 m."""
    return made.object("lead", speed=0.0, s=48.0)


@pytest.mark.parametrize(
    ("column", "expected"),
    [
        ("min_mttc_s", 0.2),
        ("min_ettc_s", 0.2),
        ("max_mdrac_mps2", 100.0),
        ("max_dst_mps2", 50.0),
        ("min_mtc", 4.0 * 2.0 * 0.7 * G / 400.0),
        ("max_btn", 50.0 / 9.0),
        ("max_stn", 2.0 * 2.0 / (0.04 * G)),
        ("min_ttb_s", 0.2 - 20.0 / 18.0),
        ("min_tts_s", 0.2 - (4.0 / G) ** 0.5),
        ("min_ttk_s", -10.0),
        ("min_ttr_s", 0.2 - (4.0 / G) ** 0.5),
    ],
)
def test_approach_is_worst_at_its_end(hand_made: Any, column: str, expected: float) -> None:
    value, status, time, actor = measure(approach(hand_made()), column)
    assert (value, status, actor) == (pytest.approx(expected, rel=1e-9), "value", 0)
    # Too late for the modified rate is it from the second before the collision on.
    assert time == pytest.approx(1.2 if column == "max_mdrac_mps2" else
                                 0.0 if column == "min_ttk_s" else 2.0)  # fmt: skip


COLUMNS = [
    "min_mttc_s", "min_ettc_s", "max_mdrac_mps2", "max_dst_mps2", "min_mtc", "max_btn", "max_stn",
    "min_ttb_s", "min_tts_s", "min_ttk_s", "min_ttr_s", "min_rear_ttc_s",
    "max_follower_deceleration_mps2",
]  # fmt: skip


@pytest.mark.parametrize("column", COLUMNS)
def test_empty_road_is_no_conflict(hand_made: Any, column: str) -> None:
    value, status, _, actor = measure(hand_made(objects=()), column)
    assert (status, actor) == ("no_conflict", -1)
    assert np.isnan(value)


@pytest.mark.parametrize("column", COLUMNS)
def test_one_unknown_speed_makes_the_metric_an_error(hand_made: Any, column: str) -> None:
    made = hand_made()
    made.columns["ego"][0, 10, 3] = np.nan
    assert measure(made, column)[1] == "error"


@pytest.mark.parametrize("column", COLUMNS)
def test_mirrored_road_is_the_same(hand_made: Any, column: str) -> None:
    def made(side: float) -> Any:
        d = 5.25 + side * np.linspace(2.5, 0.5, 21)
        return hand_made().object("lead", s=np.linspace(30.0, 50.0, 21), speed=10.0, d=d)

    left, right = measure(made(1.0), column), measure(made(-1.0), column)
    np.testing.assert_array_equal(left, right)


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


@pytest.mark.slow
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
