"""The binding predicate: hand-made scenes, and the law that its margin is the robustness."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adeye.evaluation.stl.binding import BindingPredicate
from adeye.evaluation.stl.formula import parse_formula
from adeye.evaluation.stl.robustness import StlResult, evaluate
from adeye.evaluation.stl.series import SampleStatus, Series
from adeye.evaluation.verdict import Verdict


class Signals(dict[str, Series]):
    """Series by name."""

    def series(self, name: str) -> Series:
        return self[name]


def judge(
    text: str,
    signals: dict[str, Series],
    *,
    length: int | None = None,
    horizon: int | None = None,
    complete: bool = True,
) -> StlResult:
    runs, rows = next(iter(signals.values())).values.shape
    known = rows if length is None else length
    return evaluate(
        parse_formula(text),
        Signals(signals),
        step_s=0.5,
        length=np.full(runs, known),
        horizon=np.full(runs, known - 1 if horizon is None else horizon),
        complete=np.full(runs, complete),
    )


def bind(text: str, signals: dict[str, Series], **options: Any) -> BindingPredicate:
    binding = judge(text, signals, **options).binding(0)
    assert binding is not None
    return binding


def number(values: list[float], unit: str = "m", **options: Any) -> Series:
    return Series(np.array([values]), options.pop("scale", 1.0), unit, "number", **options)


def truth(values: list[int], **options: Any) -> Series:
    return Series(np.array([values]), 1.0, "1", "boolean", **options)


def test_the_smallest_gap_binds_with_its_row_time_and_actor() -> None:
    actor = np.array([[4, 4, 7, 4]])
    gap = number([9.0, 5.0, 3.0, 6.0], scale=10.0, actor=actor)
    binding = bind(
        "always (contact == false and gap > 2 m)", {"gap": gap, "contact": truth([0] * 4)}
    )
    assert binding == BindingPredicate(
        text="gap > 2 m",
        signal="gap",
        row=2,
        time_s=1.0,
        obligation_row=2,
        obligation_time_s=1.0,
        actor=7,
        value=3.0,
        threshold=2.0,
        difference=1.0,
        unit="m",
        status="value",
    )


def test_a_violation_binds_at_its_worst_row() -> None:
    binding = bind("always gap > 2 m", {"gap": number([9.0, 1.0, -1.0, 1.0])})
    assert (binding.row, binding.value, binding.difference) == (2, -1.0, -3.0)


def test_a_late_detection_binds_to_the_obligation_that_the_fault_began() -> None:
    signals = {"fault": truth([0, 1, 1, 1, 1, 1]), "detected": truth([0, 0, 0, 0, 1, 1])}
    text = "always (rise(fault) implies eventually[0 s, 1 s] detected)"
    binding = bind(text, signals, horizon=3)
    assert (binding.text, binding.obligation_row, binding.obligation_time_s) == ("detected", 1, 0.5)
    assert (binding.value, binding.threshold, binding.difference) == (False, True, None)


def test_an_enumeration_binds_with_its_words() -> None:
    status = Series(np.array([[0, 0, 1]]), 1.0, "1", "enumeration", ("ok", "silent"))
    binding = bind("always status != silent", {"status": status})
    assert (binding.row, binding.value, binding.threshold) == (2, "silent", "silent")
    assert binding.difference is None
    twin = {"a.status": status, "b.status": status}
    assert bind("always a.status == b.status", twin).threshold == "ok"


def test_an_open_obligation_binds_beyond_the_trace() -> None:
    signals = {"fault": truth([0, 0, 1, 1]), "detected": truth([0, 0, 0, 0])}
    text = "always (rise(fault) implies eventually[0 s, 2 s] detected)"
    binding = bind(text, signals, complete=False)
    assert binding.status == "beyond_trace"
    assert binding.text == "detected"
    assert (binding.row, binding.time_s, binding.obligation_row) == (None, None, 2)


def test_an_endless_obligation_inside_another_binds_beyond_the_trace() -> None:
    signals = {"fault": truth([0, 1, 1]), "safe_state": truth([0, 0, 0])}
    binding = bind("always (fault implies eventually safe_state)", signals)
    assert (binding.status, binding.text, binding.obligation_row) == (
        "beyond_trace",
        "safe_state",
        1,
    )


def test_a_truth_value_that_does_not_apply_binds_without_value() -> None:
    status = np.array([[SampleStatus.NOT_APPLICABLE]], dtype=np.int8)
    binding = bind("always detected", {"detected": truth([0], status=status)})
    assert (binding.status, binding.value, binding.unit) == ("not_applicable", None, "1")


def test_until_that_holds_binds_at_its_earliest_witness() -> None:
    signals = {"slow": truth([1, 1, 1, 1]), "stopped": truth([0, 0, 1, 1])}
    binding = bind("slow until[0 s, 1.5 s] stopped", signals)
    assert (binding.row, binding.value) == (0, True)


def test_a_cut_always_binds_to_the_obligation_that_never_began() -> None:
    binding = bind("always gap > 2 m", {"gap": number([9.0] * 4)}, horizon=9, complete=False)
    assert (binding.status, binding.obligation_row) == ("beyond_trace", 4)


def test_no_conflict_binds_with_the_cap() -> None:
    ttc = number([math.inf, math.inf], "s", cap=10.0)
    binding = bind("always ttc >= 2 s", {"ttc": ttc})
    assert (binding.status, binding.value, binding.threshold) == ("no_conflict", None, 2.0)
    assert (binding.difference, binding.unit) == (10.0, "s")


def test_a_sample_that_does_not_apply_binds_without_numbers() -> None:
    status = np.array([[0, SampleStatus.NOT_APPLICABLE]], dtype=np.int8)
    gap = number([5.0, 0.0], status=status)
    binding = bind("always gap > 2 m", {"gap": gap})
    assert (binding.status, binding.row, binding.value) == ("not_applicable", 1, None)
    either = {"gap": gap, "contact": truth([0, 0])}
    assert bind("always (contact or gap > 2 m)", either).signal == "gap"


def test_a_capped_margin_shows_the_whole_difference() -> None:
    ttc = number([50.0, 60.0], "s", cap=10.0)
    result = judge("always ttc >= 2 s", {"ttc": ttc})
    assert result.robustness_low[0] == 10.0
    binding = result.binding(0)
    assert binding is not None
    assert binding.difference == 48.0


def test_under_a_negation_the_difference_still_speaks_for_the_formula() -> None:
    signals = {"gap": number([9.0, 3.0]), "speed": number([1.0, 1.0], "m/s")}
    assert bind("always not gap < 2 m", signals).difference == 1.0
    idle = bind("always (speed > 5 m/s implies gap > 20 m)", signals)
    assert (idle.text, idle.difference) == ("speed > 5 m/s", 4.0)


def test_a_threshold_on_the_left_is_still_the_threshold() -> None:
    binding = bind("always 2 m < gap", {"gap": number([3.0])})
    assert (binding.value, binding.threshold, binding.difference) == (3.0, 2.0, 1.0)


def test_two_signals_bind_with_both_sides() -> None:
    signals = {"gap": number([30.0]), "speed": number([10.0], "m/s")}
    binding = bind("always gap > speed * 2 s", signals)
    assert (binding.value, binding.threshold, binding.unit) == (30.0, 20.0, "m")
    assert bind("always gap - speed * 2 s > 0", signals).unit == "m"
    assert bind("always speed * 2 s > 0 m", signals).unit == "SI"


def test_a_tie_at_zero_goes_to_the_predicate_that_is_violated() -> None:
    signals = {"a": number([0.0]), "b": number([0.0])}
    assert bind("always (a >= 0 and b > 0)", signals).signal == "b"


def test_an_edge_at_row_0_measures_nothing() -> None:
    binding = bind("rise(contact)", {"contact": truth([1, 1])})
    assert (binding.text, binding.row, binding.value) == ("rise(contact)", 0, None)


def test_until_binds_to_what_broke_or_to_what_never_came() -> None:
    text = "slow until[0 s, 1 s] stopped"
    broke = {"slow": truth([1, 0, 1, 1]), "stopped": truth([0, 0, 1, 0])}
    assert (bind(text, broke).text, bind(text, broke).row) == ("slow", 1)
    never = {"slow": truth([1, 1, 1, 1]), "stopped": truth([0, 0, 0, 1])}
    assert bind(text, never).text == "stopped"
    open_end = bind("slow until stopped", never, length=3, horizon=3, complete=False)
    assert open_end.status == "beyond_trace"


def test_a_run_in_error_has_no_binding() -> None:
    assert judge("always gap > 2 m", {"gap": number([math.nan])}).binding(0) is None


ATOMS = ("a > 0.2", "b < 0.1", "not a - b >= 0.3", "abs(b) <= 0.5")
SHAPES = (
    "always ({0} and {1})",
    "always ({0} implies eventually[0 s, 2 s] ({1}))",
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
        signals = {
            name: Series(bits.normal(size=(3, 16)), 1.0, "1", "number") for name in ("a", "b")
        }
        result = judge(shape.format(first, second), signals, horizon=9)
        for b in range(3):
            binding = result.binding(b)
            assert binding is not None
            expected = (
                result.robustness_high[b] if result.verdict[b] < 0 else result.robustness_low[b]
            )
            assert binding.difference == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_binding_lies_beyond_the_trace_exactly_where_the_verdict_is_open(shape: str) -> None:
    bits = np.random.default_rng(4)
    seen = set()
    for length, atoms in itertools.product(range(1, 12), itertools.product(ATOMS, ATOMS)):
        signals = {
            name: Series(bits.normal(size=(3, 12)), 1.0, "1", "number") for name in ("a", "b")
        }
        result = judge(shape.format(*atoms), signals, length=length, horizon=11, complete=False)
        for b in range(3):
            binding = result.binding(b)
            assert binding is not None
            is_open = result.verdict_of(b) is Verdict.INCONCLUSIVE
            assert (binding.status == "beyond_trace") == is_open
            seen.add(is_open)
    assert seen == {True, False}
