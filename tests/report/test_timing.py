"""What a report says about timing: what was not measured, or not in time, never passes."""

from types import SimpleNamespace
from typing import Any

import pytest

from adeye.judge.timeline import Injection, InjectionClass, Timeline
from adeye.judge.verdict import Verdict
from adeye.report.assessment import timing_of
from adeye.report.model.assessment import Timing
from adeye.store.read.bulk import Figures
from tests.figures import figures_of

FAULT = "silent"


def injection(
    run: str = "r0",
    *,
    detect: float | None = 1.2,
    safe: float | None = 1.5,
    without: float | None = 4.0,
    class_: InjectionClass = "detected_in_time",
    fault_free: float | None = None,
) -> Injection:
    """A fault at 1 s, detected after 0.2 s, handled after 0.5 s; FTTI 3 s."""
    return Injection(
        run=run,
        scenario="cut_in",
        architecture="a",
        fault_entry=FAULT,
        times=Timeline(1.0, 1.0, 1.0, detect_s=detect, safe_s=safe),
        without_mechanism=Timeline(1.0, violation_s=without),
        fault_free_violation_s=fault_free,
        class_=class_,
    )


def figures(runs: int, fault: str = FAULT) -> Figures:
    return figures_of([{"scenario": "cut_in", "architecture": "a", "fault_entry": fault}] * runs)


def concept(*, fdti: float | None = 0.3, frti: float | None = None, ftti: float = 1.0) -> Any:
    return SimpleNamespace(
        safety_goals=(SimpleNamespace(id="SG", ftti=ftti, ftti_rationale="because"),),
        requirements=(SimpleNamespace(id="F", goals=("SG",), fdti=fdti, frti=frti),),
    )


def told(
    *found: Injection, of: Any = None, runs: int | None = None, exercised: bool = True
) -> Timing:
    count = len(found) if runs is None else runs
    pairs = {(item.run, "F") for item in found} if exercised else set()
    commands = ("adeye faults c0de", lambda run: f"adeye replay {run}")
    return timing_of(of or concept(), figures(count), (found, pairs), commands)


def test_handled_within_both_fttis_passes_with_the_shorter_as_margin() -> None:
    [row] = told(injection()).faults
    assert row.verdict is Verdict.PASS
    assert (row.fdti_s, row.frti_s) == pytest.approx((0.2, 0.3))
    assert (row.fhti_s, row.ftti_s, row.margin_s) == pytest.approx((0.5, 3.0, 0.5))
    assert (row.run, row.command) == ("r0", "adeye replay r0")


@pytest.mark.parametrize(
    ("found", "verdict", "note"),
    [
        (injection(detect=None, safe=None, class_="undetected_violation"), Verdict.FAIL,
         "1 violate undetected"),
        (injection(safe=None, class_="detected_late"), Verdict.FAIL,
         "1 detected, not handled in time"),
        (injection(safe=2.0), Verdict.FAIL, "1 handled later than the shortest FTTI"),
        (injection(without=1.9), Verdict.FAIL, "violates sooner than the FTTI assumed"),
        (injection(without=2.0), Verdict.PASS, ""),
        (injection(detect=None, safe=None, class_="masked"), Verdict.INCONCLUSIVE,
         "1 not detected, nothing violated"),
        (injection(detect=None, safe=None, without=None, class_="undetected_no_violation"),
         Verdict.INCONCLUSIVE, "1 not detected, nothing violated"),
        (injection(detect=None, safe=None, without=None, class_="not_activated"),
         Verdict.VACUOUS, "no fault was activated"),
    ],
)  # fmt: skip
def test_verdict_of_a_fault_says_why(found: Injection, verdict: Verdict, note: str) -> None:
    [row] = told(found).faults
    assert (row.verdict, row.note) == (verdict, note)


def test_one_late_run_among_many_decides_and_else_the_least_margin_is_named() -> None:
    late = injection("r1", safe=None, class_="detected_late")
    [row] = told(injection("r0"), late, injection("r2")).faults
    assert (row.verdict, row.run, row.handled, row.measured) == (Verdict.FAIL, "r1", 2, 3)
    [row] = told(injection("r0"), injection("r1", safe=1.7)).faults
    assert row.run == "r1"
    assert row.margin_s == pytest.approx(0.3)


def test_what_is_not_measured_is_said_and_never_passes() -> None:
    for measured in (0, 1):
        result = told(*[injection()][:measured], runs=2)
        [row] = result.faults
        assert (row.verdict, row.measured, row.runs) == (Verdict.NOT_RUN, measured, 2)
        assert row.note.endswith("not measured")
        assert result.command == "adeye faults c0de"


def test_violation_that_needs_no_fault_measures_no_ftti() -> None:
    [row] = told(injection(without=1.5, fault_free=1.5)).faults
    assert (row.ftti_s, row.verdict) == (None, Verdict.PASS)
    assert row.margin_s == pytest.approx(0.5)


def test_runs_without_a_fault_have_no_row() -> None:
    commands = ("", lambda run: run)
    assert timing_of(concept(), figures(3, "none"), ((), ()), commands).faults == ()


def test_budget_is_held_against_the_largest_time() -> None:
    [row] = told(injection("r0"), injection("r1", detect=1.25)).budgets
    assert (row.fsr, row.runs, row.verdict, row.run) == ("F", 2, Verdict.PASS, "r1")
    assert (row.fdti_s, row.margin_s) == pytest.approx((0.25, 0.05))


@pytest.mark.parametrize(
    ("found", "of", "verdict", "note"),
    [
        (injection(detect=1.4), concept(), Verdict.FAIL, "the budget is exceeded"),
        (injection(), concept(frti=0.2), Verdict.FAIL, "the budget is exceeded"),
        (injection(), concept(fdti=None, frti=0.3), Verdict.PASS, ""),
        (injection(safe=None, class_="detected_late"), concept(), Verdict.PASS, ""),
        (injection(safe=None, class_="detected_late"), concept(frti=1.0), Verdict.FAIL,
         "not handled before the run ended"),
        (injection(detect=None, safe=None, class_="undetected_no_violation"), concept(),
         Verdict.FAIL, "not detected before the run ended"),
        (injection(detect=None, safe=None, class_="masked"), concept(), Verdict.INCONCLUSIVE,
         "masked, and not detected"),
        (injection(detect=None, safe=None, class_="not_activated"), concept(), Verdict.VACUOUS,
         "the fault was not activated"),
    ],
)  # fmt: skip
def test_verdict_of_a_budget_says_why(
    found: Injection, of: Any, verdict: Verdict, note: str
) -> None:
    [row] = told(found, of=of).budgets
    assert (row.verdict, row.note) == (verdict, note)


def test_budget_that_no_fault_exercises_is_vacuous_only_if_all_is_measured() -> None:
    [row] = told(injection(), exercised=False).budgets
    assert (row.verdict, row.note, row.scenario) == (Verdict.VACUOUS, "no fault exercised it", "")
    for found in (told(injection(), runs=2, exercised=False), told(runs=2), told()):
        [row] = found.budgets
        assert (row.verdict, row.note) == (Verdict.NOT_RUN, "not measured")


def test_goal_is_held_against_its_largest_budget() -> None:
    for of, verdict, left in (
        (concept(fdti=None), Verdict.NOT_RUN, None),
        (concept(), Verdict.INCONCLUSIVE, 0.7),
        (concept(fdti=None, frti=0.4), Verdict.INCONCLUSIVE, 0.6),
        (concept(frti=0.3), Verdict.PASS, 0.4),
        (concept(frti=0.9), Verdict.FAIL, -0.2),
        (concept(fdti=1.2), Verdict.FAIL, -0.2),
    ):
        [row] = told(injection(), of=of).goals
        assert row.verdict is verdict, of
        assert row.margin_s == (None if left is None else pytest.approx(left)), of
        assert (row.fhti_s is None) == (of.requirements[0].frti is None or row.fdti_s is None)
