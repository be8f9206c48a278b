"""Exposure: times and integrals below a time to collision, evasion, RSS, row by row."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics.exposure import exposures, least_stopping_shares
from adeye.judge.metrics.scans import ERROR, NO_CONFLICT, VALUE
from tests.judge.conftest import measure


def approach(made: Any) -> Any:
    """The ego, at 20 m/s, nears a standing lead from 44 m to 4 m: 2.2 s to 0.2 s."""
    return made.object("lead", speed=0.0, s=48.0)


def test_time_exposed_and_integrated(hand_made: Any) -> None:
    made = approach(hand_made())
    assert measure(made, "tet_s") == (pytest.approx(2.1, rel=1e-9), "value", 2.0, 0)
    # 21 rows of 3 s minus 2.2, 2.1, ... 0.2 s, each for 0.1 s.
    assert measure(made, "tit_s2")[0] == pytest.approx(21 * (3.0 - 1.2) * 0.1, rel=1e-9)
    assert measure(made, "tet_share")[0] == pytest.approx(1.0, rel=1e-9)
    assert measure(made, "tit_mean_s")[0] == pytest.approx(1.8, rel=1e-9)


def test_without_exposure_the_sums_are_zero(hand_made: Any) -> None:
    for column in ("tet_s", "tit_s2", "tet_share", "crash_potential", "rss_response_violation_s"):
        value, status, time, actor = measure(hand_made(objects=()), column)
        assert (value, status, actor) == (0.0, "value", -1)
        assert np.isnan(time)


def test_time_is_that_of_the_nearest_in_the_path(hand_made: Any) -> None:
    assert measure(hand_made(), "min_time_gap_s")[:2] == (pytest.approx(2.0), "value")


def test_crash_potential_is_one_where_no_car_brakes_that_hard(hand_made: Any) -> None:
    # 400 / (2 gap) is above 12.68 m/s² for gaps below 15.77 m: rows 15 to 20 of 21; those with
    # gaps of 44 m down to 16 m need at least 4.55 m/s² and count with their probability.
    value = measure(approach(hand_made()), "crash_potential")[0]
    assert 6.0 / 21.0 < value < 12.0 / 21.0


def test_evasion_has_the_time_to_collision_of_its_row(hand_made: Any) -> None:
    made = approach(hand_made())
    assert measure(made, "time_to_accident_s")[1] == "not_applicable"
    made.columns["ego"][0, 5:, 4] = -2.1
    assert measure(made, "time_to_accident_s") == (
        pytest.approx(1.7), "value", pytest.approx(0.5), 0
    )  # fmt: skip
    made.columns["ego"][0, 3, 6] = 0.11
    assert measure(made, "time_to_accident_s")[0] == pytest.approx(1.9)


def test_curve_is_no_evasion(hand_made: Any) -> None:
    made = approach(hand_made())
    made.columns["ego"][0, :, 6] = 0.2
    made.columns["ego_place"][0, :, 3] = 0.01
    assert measure(made, "time_to_accident_s")[1] == "not_applicable"


def test_evasion_without_a_collision_to_come_is_no_conflict(hand_made: Any) -> None:
    made = hand_made().ego(acceleration=-5.0)
    assert measure(made, "time_to_accident_s")[1] == "no_conflict"


def test_stopping_share_is_the_gap_over_the_way_to_standstill(hand_made: Any) -> None:
    assert measure(approach(hand_made()), "min_psd") == (
        pytest.approx(4.0 * 18.0 / 400.0, rel=1e-9), "value", 2.0, 0
    )  # fmt: skip
    assert measure(hand_made(objects=()), "min_psd")[1] == "no_conflict"


def test_rss_ratio_has_the_golden_distance(hand_made: Any) -> None:
    # 40 m at 20 and 20 m/s: 65.78125 m are asked for.
    assert measure(hand_made(), "min_rss_ratio")[:2] == (
        pytest.approx(40.0 / 65.78125, rel=1e-9), "value"
    )  # fmt: skip
    beside = hand_made().object("lead", d=5.25 + 3.5)
    assert measure(beside, "min_rss_ratio")[1] == "no_conflict"


def test_response_of_rss_is_due_after_its_response_time(hand_made: Any) -> None:
    # In violation from row 0 on: due from row 11 (1.1 s) on, ten rows.
    assert measure(hand_made(), "rss_response_violation_s")[0] == pytest.approx(1.0)
    braking = hand_made().ego(acceleration=-4.0)
    assert measure(braking, "rss_response_violation_s")[0] == 0.0


ENDS = np.array([[8.45, 1.40, 4.23, 12.68]])


def sums(ttc: list[float], drac: list[float], margin: list[float]) -> tuple[list[float], int]:
    # The accelerations are a column of a trace, for which the kernel is compiled.
    found, _, codes = exposures(
        np.array([len(ttc)]), 0.5, np.array([ttc]), np.array([drac]), np.array([margin]),
        np.zeros((1, len(ttc), 2))[..., 0], 3.0, ENDS, 1.0, 4.0,
    )  # fmt: skip
    return found[:, 0].tolist(), int(codes[0])


def test_rows_are_summed_up() -> None:
    inf = math.inf
    found, code = sums([inf, 3.0, 2.0], [0.0, 20.0, 8.45], [inf, inf, inf])
    assert code == VALUE
    assert found == pytest.approx([1.0, 0.5, (1.0 + 0.49998496) / 3.0, 0.0], rel=1e-6)


def test_response_is_due_a_response_time_after_the_violation_began() -> None:
    calm = [math.inf] * 6
    found, _ = sums(calm, [0.0] * 6, [-1.0, -1.0, -1.0, -1.0, 1.0, -1.0])
    # From 0 s on in violation, due after 1 s: the row at 1.5 s only.
    assert found[3] == 0.5


@pytest.mark.slow
def test_unknown_is_an_error_and_not_left_out() -> None:
    assert sums([math.nan], [0.0], [math.inf])[1] == ERROR
    assert sums([1.0], [math.nan], [math.inf])[1] == ERROR
    assert sums([1.0], [0.0], [math.nan])[1] == ERROR


@pytest.mark.slow
def test_standing_ego_needs_no_way() -> None:
    _, _, codes = least_stopping_shares(
        np.array([2]), np.array([[5.0, 5.0]]), np.zeros((1, 2)),
        np.full((1, 2), -1, dtype=np.int64), np.array([8.0]),
    )  # fmt: skip
    assert codes.tolist() == [NO_CONFLICT]
