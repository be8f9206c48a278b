"""Numeric uncertainty: percentile, pairs, what is counted apart, and when a margin is too small."""

import math

import numpy as np
import pytest

from adeye.judge.uncertainty import (
    LEAST_PAIRS,
    NumericUncertainty,
    Sampled,
    differences,
    is_uncertain,
    judged_digest,
    percentile_95,
    sampled_margin,
    sampled_metric,
    uncertain_detail,
)
from adeye.judge.verdict import Verdict
from adeye.kernel.motion import advance_ego
from tests.refusals import refused


@pytest.mark.parametrize("count", range(1, 120))
def test_percentile_is_the_smallest_that_95_percent_do_not_exceed(count: int) -> None:
    values = np.random.default_rng(count).permutation(np.arange(1.0, count + 1.0)).tolist()
    found = percentile_95(values)
    reached = sum(value <= found for value in values)
    below = sum(value < found for value in values)
    assert 100 * reached >= 95 * count > 100 * below
    assert (found == count) == (count < 20)


def test_percentile_of_nothing_or_of_no_number_is_refused() -> None:
    for values in ([], [1.0, math.nan], [math.inf]):
        refused(ValueError, percentile_95, values, says="no percentile")


def metric_pairs(*pairs: tuple[float | None, float | None]) -> list[tuple[Sampled, Sampled]]:
    return [
        (
            sampled_metric(
                "min_ttc_s", first, "value" if first is not None else "no_conflict", "s"
            ),
            sampled_metric("min_ttc_s", last, "value" if last is not None else "no_conflict", "s"),
        )
        for first, last in pairs
    ]


def test_uncertainty_is_the_largest_difference_of_few_pairs() -> None:
    pairs = metric_pairs(*((1.0, 1.0 + 0.01 * number) for number in range(LEAST_PAIRS)))
    (found,) = differences("metric", "min_ttc_s", pairs)
    assert found.uncertainty == found.largest == pytest.approx(0.09)
    assert (found.pairs, found.sampled, found.differing) == (10, 10, 0)


def test_too_few_pairs_have_no_uncertainty_which_is_not_zero() -> None:
    pairs = metric_pairs(*[(1.0, 1.0)] * (LEAST_PAIRS - 1))
    (found,) = differences("metric", "min_ttc_s", pairs)
    assert (found.p95, found.uncertainty) == (0.0, None)


def test_changed_status_is_counted_apart() -> None:
    pairs = metric_pairs(*[(1.0, 1.5)] * 10, (2.0, None), (None, 2.0), (None, None))
    (found,) = differences("metric", "min_ttc_s", pairs)
    assert (found.sampled, found.pairs, found.differing) == (13, 10, 2)
    assert found.changes == {"no_conflict → value": 1, "value → no_conflict": 1}
    assert found.uncertainty == 0.5


def test_contact_changes_and_has_no_amount() -> None:
    pairs = [
        (
            sampled_metric("contact", first, "value", "1"),
            sampled_metric("contact", last, "value", "1"),
        )
        for first, last in [(0.0, 1.0), (1.0, 1.0), (0.0, 0.0)] * 5
    ]
    (found,) = differences("metric", "contact", pairs)
    assert (found.pairs, found.p95, found.changes) == (0, None, {"no contact → contact": 5})


@pytest.mark.parametrize("value", [math.nan, math.inf, None])
def test_twin_without_a_finite_value_is_never_a_difference_of_zero(value: float | None) -> None:
    broken = Sampled(value, "value" if value is not None else "error", "s")
    (found,) = differences("metric", "x", [(Sampled(1.0, "value", "s"), broken)] * 12)
    assert (found.pairs, found.p95, found.uncertainty) == (0, None, None)


def test_missing_twin_is_counted_and_never_zero() -> None:
    (found,) = differences("metric", "x", [(Sampled(1.0, "value", "s"), None)] * 12)
    assert (found.sampled, found.pairs, found.uncertainty) == (12, 0, None)
    assert found.changes == {"value → missing": 12}


def margin(verdict: Verdict, value: float | None, unit: str = "m", detail: str = "") -> Sampled:
    return sampled_margin(verdict, value, unit, "gap", detail)


def test_margin_of_no_conflict_is_a_cap_and_no_difference() -> None:
    free = margin(Verdict.PASS, 10.0, detail="no conflict")
    pairs = [(free, free), (free, margin(Verdict.PASS, 1.0)), (margin(Verdict.PASS, 2.0),) * 2]
    (found,) = differences("fsr", "FSR-1", pairs)
    assert (found.pairs, found.largest) == (1, 0.0)
    assert found.changes == {"PASS, no conflict → PASS": 1}


def test_verdict_that_turns_is_counted_with_its_difference() -> None:
    pairs = [(margin(Verdict.PASS, 0.1), margin(Verdict.FAIL, -0.1))]
    (found,) = differences("fsr", "FSR-1", pairs)
    assert found.largest == pytest.approx(0.2)
    assert (found.pairs, found.changes) == (1, {"PASS → FAIL": 1})


def test_each_unit_of_a_formula_has_its_own() -> None:
    pairs = [
        *[(margin(Verdict.PASS, 1.0), margin(Verdict.PASS, 1.25))] * 10,
        *[(margin(Verdict.PASS, 1.0, "s"), margin(Verdict.PASS, 3.0, "s"))] * 3,
        (margin(Verdict.PASS, 1.0), margin(Verdict.PASS, 9.0, "s")),
    ]
    metres, seconds = differences("fsr", "FSR-1", pairs)
    assert (metres.unit, metres.uncertainty, metres.sampled) == ("m", 0.25, 11)
    assert metres.changes == {"PASS in m → PASS in s": 1}
    assert (seconds.unit, seconds.p95, seconds.uncertainty) == ("s", 2.0, None)


def test_uncertainty_that_is_no_number_is_refused() -> None:
    for least in (math.nan, math.inf, -1.0):
        refused(ValueError, NumericUncertainty, "a", {"m": least}, says="numeric uncertainty")


def test_only_what_holds_by_less_is_uncertain() -> None:
    margins = np.array([-0.1, 0.0, 0.19, 0.2, 0.21, np.nan])
    is_pass = margins >= 0.0
    is_pass[-1] = True
    found = is_uncertain(is_pass, margins, np.full(6, 0.2))
    assert found.tolist() == [False, True, True, False, False, False]
    assert uncertain_detail(0.2, "m") == "margin below the numeric uncertainty of 0.2 m"


def test_identity_is_that_of_the_fsr_and_the_sample_in_any_order() -> None:
    one = judged_digest("f" * 64, ["a", "b"])
    assert one == judged_digest("f" * 64, ["b", "a"])
    assert (
        len({one, "f" * 64, judged_digest("e" * 64, ["a", "b"]), judged_digest("f" * 64, ["a"])})
        == 4
    )


LAG = 0.2
DECELERATIONS = np.linspace(2.0, 8.0, 12)


def braked(deceleration: float, step: float) -> float:
    """Way in two seconds from 30 m/s under a constant command that the brake follows with a lag."""
    state = np.array([0.0, 0.0, 0.0, 30.0, 0.0, 0.0, 0.0])
    for _ in range(round(2.0 / step)):
        advance_ego(
            state, -deceleration, 0.0, step, 2.9, 1.4, 3.0, 9.0, 0.6, 0.8, LAG, 0.1, 1.0, state
        )
    return float(state[0])


def of_braking(step: float) -> float:
    pairs = [
        (Sampled(braked(value, step), "value", "m"), Sampled(braked(value, step / 2), "value", "m"))
        for value in DECELERATIONS
    ]
    (found,) = differences("metric", "way_m", pairs)
    assert found.uncertainty is not None
    return found.uncertainty


@pytest.mark.parametrize("step", [0.2, 0.1, 0.05])
def test_uncertainty_of_constant_braking_is_what_simpsons_rule_leaves(step: float) -> None:
    # The speed is exact; the error of its integral is h^4/2880 times what its third derivative
    # changes by, here that of an exponential, and half the step leaves a sixteenth of that.
    change = DECELERATIONS.max() / LAG**2 * (1.0 - math.exp(-2.0 / LAG))
    predicted = 15.0 / 16.0 * step**4 / 2880.0 * change
    assert of_braking(step) == pytest.approx(predicted, rel=0.1)


def test_halving_again_leaves_a_sixteenth() -> None:
    assert of_braking(0.1) / of_braking(0.2) == pytest.approx(1.0 / 16.0, rel=0.1)
    assert of_braking(0.05) / of_braking(0.1) == pytest.approx(1.0 / 16.0, rel=0.05)


def test_a_number_beyond_the_cap_is_no_conflict_and_says_nothing_of_the_step() -> None:
    far = [(14_467.2, 14_545.1), (56.0, 55.9), (12.0, None), (None, 14_545.1)]
    near = [(9.0, 9.001)] * LEAST_PAIRS

    def read(value: float | None) -> Sampled:
        status = "value" if value is not None else "no_conflict"
        return sampled_metric("min_ttc_s", value, status, "s", 10.0)

    pairs = [(read(first), read(last)) for first, last in [*near, *far]]
    (found,) = differences("metric", "min_ttc_s", pairs)
    assert (found.pairs, found.sampled, found.differing) == (LEAST_PAIRS, LEAST_PAIRS + 4, 0)
    assert found.uncertainty == pytest.approx(0.001)
