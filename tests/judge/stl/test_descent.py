"""The binding predicate: hand-made scenes, and the law that its difference is the robustness."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adeye.judge.stl.series import SampleStatus, Series
from tests.judge.stl.batch import Bound, binding, judge, numbers, standing, truths, words


def bind(text: str, signals: dict[str, Series], **options: Any) -> Bound:
    return binding(judge(text, signals, step_s=0.5, **options))


def test_the_smallest_gap_binds_with_its_row_time_and_actor() -> None:
    actor = np.array([[4, 4, 7, 4]])
    gap = numbers([9.0, 5.0, 3.0, 6.0], unit="m", scale=10.0, actor=actor)
    found = bind(
        "always (contact == false and gap > 2 m)", {"gap": gap, "contact": truths([0] * 4)}
    )
    assert found == Bound(
        text="gap > 2 m",
        signal="gap",
        row=2,
        obligation=2,
        actor=7,
        value=3.0,
        threshold=2.0,
        difference=1.0,
        unit="m",
        status="value",
    )


def test_a_violation_binds_at_its_worst_row() -> None:
    found = bind("always gap > 2 m", {"gap": numbers([9.0, 1.0, -1.0, 1.0], unit="m")})
    assert (found.row, found.value, found.difference) == (2, -1.0, -3.0)


def test_a_late_detection_binds_to_the_obligation_that_the_fault_began() -> None:
    signals = {"fault": truths([0, 1, 1, 1, 1, 1]), "detected": truths([0, 0, 0, 0, 1, 1])}
    text = "always (rise(fault) implies eventually[0 s, 1 s] detected)"
    found = bind(text, signals, horizon=[3])
    assert (found.text, found.obligation) == ("detected", 1)
    assert (found.value, found.threshold, found.difference) == ("false", "true", None)


def test_an_enumeration_binds_with_its_words() -> None:
    status = words([0, 0, 1], "ok", "silent")
    found = bind("always status != silent", {"status": status})
    assert (found.row, found.value, found.threshold) == (2, "silent", "silent")
    assert found.difference is None
    twin = {"a.status": status, "b.status": status}
    assert bind("always a.status == b.status", twin).threshold == "ok"


def test_an_open_obligation_binds_beyond_the_trace() -> None:
    signals = {"fault": truths([0, 0, 1, 1]), "detected": truths([0, 0, 0, 0])}
    text = "always (rise(fault) implies eventually[0 s, 2 s] detected)"
    found = bind(text, signals, complete=False)
    assert found.status == "beyond_trace"
    assert found.text == "detected"
    assert (found.row, found.obligation) == (None, 2)


def test_an_endless_obligation_inside_another_binds_beyond_the_trace() -> None:
    signals = {"fault": truths([0, 1, 1]), "safe_state": truths([0, 0, 0])}
    found = bind("always (fault implies eventually safe_state)", signals)
    assert (found.status, found.text, found.obligation) == (
        "beyond_trace",
        "safe_state",
        1,
    )


def test_a_truth_value_that_does_not_apply_binds_without_value() -> None:
    status = np.array([[SampleStatus.NOT_APPLICABLE]], dtype=np.int8)
    found = bind("always detected", {"detected": truths([0], status=status)})
    assert (found.status, found.value, found.unit) == ("not_applicable", None, "1")


def test_until_that_holds_binds_at_its_earliest_witness() -> None:
    signals = {"slow": truths([1, 1, 1, 1]), "stopped": truths([0, 0, 1, 1])}
    found = bind("slow until[0 s, 1.5 s] stopped", signals)
    assert (found.row, found.value) == (0, "true")


def test_a_cut_always_binds_to_the_obligation_that_never_began() -> None:
    found = bind(
        "always gap > 2 m", {"gap": numbers([9.0] * 4, unit="m")}, horizon=[9], complete=False
    )
    assert (found.status, found.obligation) == ("beyond_trace", 4)


def test_no_conflict_binds_with_the_cap() -> None:
    ttc = numbers([math.inf, math.inf], unit="s", cap=10.0)
    found = bind("always ttc >= 2 s", {"ttc": ttc})
    assert (found.status, found.value, found.threshold) == ("no_conflict", None, 2.0)
    assert (found.difference, found.unit) == (10.0, "s")


def test_a_sample_that_does_not_apply_binds_without_numbers() -> None:
    status = np.array([[0, SampleStatus.NOT_APPLICABLE]], dtype=np.int8)
    gap = numbers([5.0, 0.0], unit="m", status=status)
    found = bind("always gap > 2 m", {"gap": gap})
    assert (found.status, found.row, found.value) == ("not_applicable", 1, None)
    either = {"gap": gap, "contact": truths([0, 0])}
    assert bind("always (contact or gap > 2 m)", either).signal == "gap"


@pytest.mark.parametrize("beyond", [12.5, 14_467.0, math.inf])
@pytest.mark.parametrize("text", ["always ttc >= 2 s", "always not ttc < 2 s", "always ttc < 2 s"])
def test_a_conflict_beyond_the_cap_is_none(text: str, beyond: float) -> None:
    found = bind(text, {"ttc": numbers([beyond, math.inf], unit="s", cap=10.0)})
    assert found.difference == (-10.0 if text.endswith("always ttc < 2 s") else 10.0)
    assert (found.status, found.row) == ("no_conflict", 0)


def test_under_a_negation_the_difference_still_speaks_for_the_formula() -> None:
    signals = {"gap": numbers([9.0, 3.0], unit="m"), "speed": numbers([1.0, 1.0], unit="m/s")}
    assert bind("always not gap < 2 m", signals).difference == 1.0
    idle = bind("always (speed > 5 m/s implies gap > 20 m)", signals)
    assert (idle.text, idle.difference) == ("speed > 5 m/s", 4.0)


def test_a_threshold_on_the_left_is_still_the_threshold() -> None:
    found = bind("always 2 m < gap", {"gap": numbers([3.0], unit="m")})
    assert (found.value, found.threshold, found.difference) == (3.0, 2.0, 1.0)


def test_two_signals_bind_with_both_sides() -> None:
    signals = {"gap": numbers([30.0], unit="m"), "speed": numbers([10.0], unit="m/s")}
    found = bind("always gap > speed * 2 s", signals)
    assert (found.value, found.threshold, found.unit) == (30.0, 20.0, "m")
    assert bind("always gap - speed * 2 s > 0", signals).unit == "m"
    assert bind("always speed * 2 s > 0 m", signals).unit == "SI"


def test_what_is_equal_or_not_has_no_distance() -> None:
    lane = {"lane": numbers([1.0, 3.0])}
    for text in ("always lane != 7", "always lane == 1", "eventually (lane == 3 or lane == 5)"):
        assert bind(text, lane).difference is None


def test_a_tie_at_zero_goes_to_the_predicate_that_is_violated() -> None:
    signals = {"a": numbers([0.0], unit="m"), "b": numbers([0.0], unit="m")}
    assert bind("always (a >= 0 and b > 0)", signals).signal == "b"


def test_an_edge_at_row_0_measures_nothing() -> None:
    found = bind("rise(contact)", {"contact": truths([1, 1])})
    assert (found.text, found.row, found.value) == ("rise(contact)", 0, None)


def test_until_binds_to_what_broke_or_to_what_never_came() -> None:
    text = "slow until[0 s, 1 s] stopped"
    broke = {"slow": truths([1, 0, 1, 1]), "stopped": truths([0, 0, 1, 0])}
    assert (bind(text, broke).text, bind(text, broke).row) == ("slow", 1)
    never = {"slow": truths([1, 1, 1, 1]), "stopped": truths([0, 0, 0, 1])}
    assert bind(text, never).text == "stopped"
    open_end = bind("slow until stopped", never, length=[3], horizon=[3], complete=False)
    assert open_end.status == "beyond_trace"


def test_a_run_in_error_has_no_binding() -> None:
    result = judge("always gap > 2 m", {"gap": numbers([math.nan], unit="m")})
    assert result.error[0]
    assert (result.row[0], result.actor[0]) == (-1, -1)
    assert np.isnan([result.value[0], result.threshold[0], result.difference[0]]).all()


ATOMS = ("a > 0.2", "b < 0.1", "not a - b >= 0.3", "abs(b) <= 0.5")
SHAPES = (
    "always ({0} and {1})",
    "always ({0} or eventually[0 s, 2 s] ({1}))",
    "eventually always[0.5 s, 1.5 s] ({0} or {1})",
    "always (({0}) until[0.5 s, 2 s] ({1}))",
    "({0}) until ({1})",
    "always[0.5 s, 3 s] (rise({0}) or fall({1}) or not ({0} and {1}))",
    "(eventually {0}) and not (always ({1}))",
)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_difference_of_the_binding_predicate_is_the_robustness(shape: str) -> None:
    """With a scale of 1 both are the same number, whatever stands between them."""
    bits = np.random.default_rng(3)
    for first, second in itertools.product(ATOMS, ATOMS):
        signals = {name: numbers(bits.normal(size=(3, 16))) for name in ("a", "b")}
        result = judge(shape.format(first, second), signals, step_s=0.5, horizon=[9] * 3)
        for b in range(3):
            found = binding(result, b)
            expected = (
                result.robustness_high[b] if result.verdict[b] < 0 else result.robustness_low[b]
            )
            assert found.difference == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_binding_lies_beyond_the_trace_exactly_where_the_verdict_is_open(shape: str) -> None:
    bits = np.random.default_rng(4)
    seen = set()
    for length, atoms in itertools.product(range(1, 12), itertools.product(ATOMS, ATOMS)):
        signals = {name: numbers(bits.normal(size=(3, 12))) for name in ("a", "b")}
        result = judge(
            shape.format(*atoms),
            signals,
            step_s=0.5,
            length=[length] * 3,
            horizon=[11] * 3,
            complete=False,
        )
        for b in range(3):
            found = binding(result, b)
            is_open = standing(result, b) == "undecided"
            assert (found.status == "beyond_trace") == is_open
            seen.add(is_open)
    assert seen == {True, False}
