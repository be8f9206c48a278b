"""What a random design allows to say, and what nothing allows."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adeye.judge.statistics import mcnemar_p
from adeye.judge.verdict import FAIL, INCONCLUSIVE, PASS, VACUOUS
from adeye.report.comparison.compare import MarginBootstrap, Matched, PointCounts, Units, infer
from adeye.store.read.bulk import Labels
from tests.refusals import refused


def matched(change: list[float]) -> Matched:
    rows = np.arange(len(change))
    done = np.ones(len(change), dtype=np.bool_)
    margins = np.array(change)[:, np.newaxis]
    return Matched("a", "b", rows, rows, done, margins, ("m",), (False,))


def cases(points: list[int], verdict: list[int]) -> Any:
    return SimpleNamespace(
        point=np.array(points),
        verdict=np.array(verdict)[:, np.newaxis],
        scenario=Labels.of(["cut_in"] * len(points)),
        fsrs=("FSR-01",),
    )


def interval(change: list[float], *before: list[float], level: float = 0.95) -> Any:
    """Of the mean change over a random sample, beside what else is compared."""
    compared = cases(list(range(len(change))), [PASS] * len(change))
    pairs = [matched(item) for item in (*before, change)]
    found = MarginBootstrap(compared, pairs, {"cut_in": "random"})
    return found.interval([0], len(before), 0, level)


def test_point_fails_if_any_of_its_runs_does() -> None:
    compared = cases([0, 0, 1, 1, 2, 3], [PASS, FAIL, PASS, VACUOUS, INCONCLUSIVE, PASS])
    pair = Matched(
        "a", "b", np.array([0, 1, 2, 3, 4]), np.array([5, 5, 5, 5, 5]),
        np.ones(5, dtype=np.bool_), np.zeros((5, 1)), ("m",), (False,),
    )  # fmt: skip
    units = Units.of(compared, pair)
    assert units.counts([0], 0) == PointCounts(only_a=1, neither=1, open_held=1)
    assert units.counts([1], 0).units == 0


def test_p_values_are_adjusted_over_all_that_is_tested_together() -> None:
    found = infer(
        [
            PointCounts(only_a=8, only_b=1, neither=11),
            PointCounts(),
            PointCounts(only_b=6, neither=14),
        ],
        0.95,
    )
    assert found[1] is None
    first, third = found[0], found[2]
    assert first is not None
    assert third is not None
    assert (first.p, third.p) == (mcnemar_p(8, 1), mcnemar_p(0, 6))
    assert third.p_adjusted == pytest.approx(2.0 * third.p)
    assert first.p_adjusted == pytest.approx(max(2.0 * third.p, first.p))
    assert first.difference == pytest.approx(-7 / 20)
    assert first.interval.low <= first.difference <= first.interval.high


def test_undecided_points_speak_against_a_difference() -> None:
    for undecided in range(12):
        item = PointCounts(only_b=8, neither=12 - undecided, open_open=undecided)
        assert item.p == mcnemar_p(min(8, undecided), 8) >= mcnemar_p(0, 8)
    assert PointCounts(open_open=5).p == 1.0


def test_point_in_which_one_failed_for_sure_speaks_only_as_it_can() -> None:
    # A failed, and B is open: it may be that only A failed, never that only B did.
    assert PointCounts(only_a=8, neither=9, failed_open=3).p == mcnemar_p(8, 0)
    assert PointCounts(only_a=8, neither=9, held_open=3).p == mcnemar_p(8, 3)
    assert PointCounts(only_b=8, neither=9, open_failed=3).p == mcnemar_p(0, 8)
    assert PointCounts(only_b=8, neither=9, open_held=3).p == mcnemar_p(3, 8)


def test_interval_holds_whatever_the_undecided_points_are() -> None:
    known = {"both": 3, "only_a": 2, "only_b": 6, "neither": 9}
    for what, ends in (
        ("held_open", ("neither", "only_b")),
        ("open_held", ("neither", "only_a")),
        ("open_failed", ("both", "only_b")),
        ("failed_open", ("both", "only_a")),
        ("open_open", ("neither", "both", "only_a", "only_b")),
    ):
        outer = PointCounts(**known, **{what: 4}).range(0.95)
        extremes = [PointCounts(**{**known, end: known[end] + 4}).range(0.95) for end in ends]
        assert outer.low == min(item.low for item in extremes)
        assert outer.high == max(item.high for item in extremes)


def test_grid_has_no_bootstrap() -> None:
    compared = cases(list(range(20)), [PASS] * 20)
    bootstrap = MarginBootstrap(compared, [matched([1.0] * 20)], {"cut_in": "full_factorial"})
    refused(KeyError, bootstrap.interval, [0], 0, 0, 0.95)


def test_fewer_than_ten_points_have_no_interval() -> None:
    assert interval([float(at % 3) for at in range(9)]) is None
    assert interval([float(at % 3) for at in range(10)]) is not None


def test_interval_of_a_shift_holds_the_mean_and_moves_with_it() -> None:
    base = [math.sin(at) for at in range(40)]
    low, high = (interval([value + shift for value in base]) for shift in (0.0, 2.0))
    assert low.low < sum(base) / 40 < low.high
    assert high.low - low.low == pytest.approx(2.0, abs=1e-5)
    assert high.high - low.high == pytest.approx(2.0, abs=1e-5)
    # What is missing is left out of the mean, and no zero.
    found = interval([5.0 if at % 2 else math.nan for at in range(40)])
    assert (found.low, found.high) == (5.0, 5.0)


def test_what_else_is_compared_does_not_move_an_interval() -> None:
    own, other = [math.sin(at) for at in range(30)], [float(at) for at in range(30)]
    assert interval(own, level=0.9) == interval(own, other, level=0.9)
