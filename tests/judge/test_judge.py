"""Verdicts of FSRs on hand-made runs: every way not to be a PASS."""

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from adeye.judge import evaluate
from adeye.judge import verdict as codes
from adeye.judge.evaluate import Evaluation
from adeye.judge.metrics import METRICS
from adeye.judge.requirements import compile_requirement
from adeye.judge.stl.series import SampleStatus
from adeye.judge.trace_signals import TraceSignals, trace_dictionary
from adeye.judge.uncertainty import NumericUncertainty
from adeye.judge.verdict import VERDICTS, Judgement, Verdict
from adeye.signals import SILENT
from adeye.spec.concept import Requirement
from adeye.spec.odd import Attributes
from tests.judge.conftest import fsr, judge
from tests.stored import known

PASS, FAIL, INCONCLUSIVE, VACUOUS, INVALID, ERROR, _ = Verdict
TAKEOVER = (
    "always(channel.nominal.status == silent implies eventually[0 s, 0.3 s](authority.safety))"
)
CLOSE = {"metric": "min_distance_m", "at_least": 10.0}


def evaluated(made: Any, *requirements: Requirement, **options: Any) -> Evaluation:
    inside = options.pop("inside", np.ones(made.runs, dtype=bool))
    compiled = [compile_requirement(item) for item in requirements]
    return judge(made.trace(), compiled, inside, **options)


def judged(made: Any, item: Requirement, **options: Any) -> Any:
    (found,) = evaluated(made, item, **options).judgements[0]
    return found


# --- formulas


def test_kept_formula_passes_with_its_margin_and_binding_predicate(hand_made: Any) -> None:
    made = hand_made().object("lead", s=20.0 * np.arange(21) * 0.1 + 44.0 - np.arange(21))
    found = judged(made, fsr(formula="always(gap >= 10 m)"))
    assert (found.verdict, found.is_exercised) == (PASS, True)
    # The obligations end with the horizon at row 15.
    assert found.margin == pytest.approx(15.0)
    assert found.robustness_low == found.robustness_high == pytest.approx(1.5)
    assert (found.unit, found.signal, found.predicate) == ("m", "gap", "gap >= 10 m")
    assert (found.time_s, found.actor) == (pytest.approx(1.5), "lead")
    assert (found.value, found.threshold, found.detail) == (pytest.approx(25.0), 10.0, None)


def test_broken_formula_fails_with_a_negative_margin(hand_made: Any) -> None:
    found = judged(hand_made(), fsr(formula="always(time_gap >= 2.5 s)"))
    assert (found.verdict, found.margin) == (FAIL, pytest.approx(-0.5))
    assert found.robustness_high is not None
    assert found.robustness_high < 0.0


def test_truth_values_and_labels_are_reported_in_words(hand_made: Any) -> None:
    found = judged(hand_made().touch(6, "lead"), fsr(formula="always(not contact)"))
    assert (found.verdict, found.detail) == (FAIL, "contact is true")
    assert (found.value, found.threshold, found.margin) == (1.0, 1.0, None)
    assert (found.actor, found.time_s) == ("lead", pytest.approx(0.6))
    found = judged(hand_made(), fsr(formula="always(switch.reason == request)"))
    assert (found.verdict, found.value) == (FAIL, None)
    assert found.detail == "switch.reason is default"


def test_no_conflict_passes_with_the_cap_as_margin(hand_made: Any) -> None:
    ttc = {"metric": "min_ttc_s", "at_least": 1.5}
    for item in (fsr(formula="always(ttc >= 1.5 s)"), fsr(bound=ttc)):
        found = judged(hand_made(), item)
        assert (found.verdict, found.margin, found.value) == (PASS, 10.0, None)
        assert (found.detail, found.actor, found.is_exercised) == ("no conflict", None, True)
    # Under an upper bound it is no demand.
    found = judged(hand_made(), fsr(bound={"metric": "max_drac_mps2", "at_most": 3.0}))
    assert (found.verdict, found.margin) == (PASS, 3.0)
    # Where there is nothing at all, nothing is tested.
    exposed = {"metric": "tet_s", "at_most": 1.0}
    for bound in (ttc, exposed):
        found = judged(hand_made(objects=()), fsr(bound=bound))
        assert (found.verdict, found.is_exercised, found.margin) == (VACUOUS, False, None)


def test_formula_that_only_objects_decide_asks_nothing_where_there_is_none(hand_made: Any) -> None:
    alone = hand_made(objects=())
    for formula in (
        "always(ttc >= 1 s)",
        "always(not contact and rss_margin > 0 m)",
        "always(any_actor.distance >= 1 m and drac <= 3 m/s^2 and not rss_violation)",
        "always(ego.speed >= 5 m/s implies time_gap >= 1 s)",
        "always(ego.speed >= 5 m/s implies eventually[0 s, 0.2 s](not contact))",
        "always(ego.speed <= 0.5 * gap / 1 s)",
        "eventually(standstill or max(ttc, mttc) > 5 s)",
        # No run of the scenario is as long as that.
        "always(ttc >= 1 s and time <= 100 s)",
        "always(ttc >= 1 s and (time <= 100 s or ego.speed <= 1 m/s))",
    ):
        found = judged(alone, fsr(formula=formula))
        assert (found.verdict, found.is_exercised, found.margin) == (VACUOUS, False, None), formula
        assert found.detail == "there is no object"
    for formula, verdict in (
        ("always(ttc >= 1 s and ego.speed <= 30 m/s)", PASS),
        ("always(ttc >= 1 s and time <= 1 s)", FAIL),
        ("always(min(ttc, 1 s) * 40 m/s^2 >= ego.speed)", PASS),
        ("always(ego.acceleration <= 3 m/s^2 or contact)", PASS),
        ("always(ego.speed <= 10 m/s or contact)", FAIL),
        ("eventually(ttc < 5 s)", FAIL),
    ):
        found = judged(alone, fsr(formula=formula))
        assert (found.verdict, found.is_exercised) == (verdict, True), formula
    assert judged(hand_made(), fsr(formula="always(ttc >= 1 s)")).is_exercised


def test_formula_that_only_a_fault_decides_asks_nothing_where_it_is_not_injected(
    hand_made: Any,
) -> None:
    made = hand_made(faults=("late",)).set("fault_active", 1, rows=slice(3, 5), at=0)
    for formula, verdict, detail in (
        ("always(not fault.never.active)", VACUOUS, "fault never is not injected"),
        ("always(ego.speed <= 1 m/s or not fault.never.active)", VACUOUS, "fault never is not"),
        ("always(ego.speed <= 40 m/s and not fault.never.active)", PASS, ""),
        ("always(fault.never.active or not fault.late.active)", FAIL, ""),
        ("always(ego.speed <= 40 m/s or not (fault.never.active or fault.late.active))", PASS, ""),
        ("always(not faulted or ego.speed <= 40 m/s)", PASS, ""),
    ):
        found = judged(made, fsr(formula=formula), faults=["late", "never"])
        assert (found.verdict, found.is_exercised) == (verdict, verdict is not VACUOUS), formula
        assert (found.detail or "").startswith(detail), formula
    found = judged(hand_made(faults=()), fsr(formula="always(not faulted)"), faults=["late"])
    assert (found.verdict, found.detail) == (VACUOUS, "no fault is injected")


def test_monitor_of_objects_tests_nothing_where_there_is_none(hand_made: Any) -> None:
    def verdict(name: str, **of: Any) -> Any:
        trace = hand_made(**of).trace()
        trace = replace(trace, layout=replace(trace.layout, monitors=(name,)))
        item = compile_requirement(fsr(formula=f"always(not monitor.{name}.confirmed)"))
        return judge(trace, [item], np.array([True])).judgements[0][0].verdict

    assert verdict("object_danger", objects=()) is VACUOUS
    assert verdict("object_danger") is verdict("lane_departure", objects=()) is PASS


def test_signal_of_objects_is_as_declared_where_there_is_none(hand_made: Any) -> None:
    signals = TraceSignals(hand_made(objects=()).trace(), np.array([True]))
    for name, declared in signals.dictionary.items():
        if declared.of_objects:
            series = signals.series(name)
            values = np.where(series.status == SampleStatus.NO_CONFLICT, np.inf, series.values)
            assert set(values[:, :-1].ravel()) == {0.0 if declared.cap is None else np.inf}, name
    others = trace_dictionary(hand_made().trace().layout)
    new = {name for name in others if name not in signals.dictionary}
    assert new
    assert all(others[name].of_objects for name in new)


def test_formula_is_vacuous_open_or_broken_by_what_a_run_shows(hand_made: Any) -> None:
    def failing(takeover: int) -> Any:
        made = hand_made().set("status", SILENT, rows=slice(5, None), at=0)
        return made.set("authority", 1, rows=slice(takeover, None))

    late = hand_made(tail_rows=2).set("monitors", value=True, rows=slice(17, None))
    obligation = "always(monitor.danger.raw implies eventually[0 s, 0.5 s](standstill))"
    silent = hand_made().set("status", SILENT, rows=4, at=0)
    command = "always(channel.nominal.acceleration <= 1 m/s^2)"
    for made, formula, verdict, said in (
        (hand_made(), TAKEOVER, VACUOUS, "the precondition never held"),
        (failing(8), TAKEOVER, PASS, ""),
        (failing(9), TAKEOVER, FAIL, ""),
        (late, obligation, INCONCLUSIVE, "an obligation is open where the trace ends"),
        (silent, command, INCONCLUSIVE, "does not apply"),
    ):
        found = judged(made, fsr(formula=formula))
        assert (found.verdict, found.is_exercised) == (verdict, verdict is not VACUOUS)
        assert said in str(found.detail)


def test_past_before_the_first_row_tests_nothing(hand_made: Any) -> None:
    for formula in (
        "always(historically[60 s, 61 s] contact)",
        "always(rise(authority.safety) implies historically[60 s, 61 s] contact)",
        "always(not once[60 s, 61 s] (not contact))",
    ):
        made = hand_made().set("authority", 1, rows=slice(5, None))
        found = judged(made, fsr(formula=formula))
        assert (found.verdict, found.is_exercised) == (VACUOUS, False), formula
        assert found.detail == "nothing lies that far back", formula
        near = judged(made, fsr(formula="always(historically[0.2 s, 0.3 s] not contact)"))
        assert (near.verdict, near.is_exercised) == (PASS, True), formula


@pytest.mark.parametrize("formula", ["always(ego.speed <= 30 m/s)", "always(gap > 1 m)"])
def test_nan_is_an_error_even_if_everything_else_is_safe(hand_made: Any, formula: str) -> None:
    made = hand_made(runs=2)
    made.columns["ego"][0, 7, 3] = np.nan
    first, second = evaluated(made, fsr(formula=formula)).judgements
    assert (first[0].verdict, first[0].robustness_low, first[0].margin) == (ERROR, None, None)
    assert not first[0].is_exercised
    assert second[0].verdict is PASS


# --- contact


def test_contact_opens_what_was_to_come_and_changes_nothing_that_was_decided(
    hand_made: Any,
) -> None:
    slow = fsr(formula="always(ego.speed <= 30 m/s)")
    strict = fsr(formula="always(ego.speed <= 30 m/s)", on_contact="fail")
    for why, item, verdict, said in (
        ("still to come", slow, INCONCLUSIVE, "ended by contact"),
        ("fails if the FSR says so", strict, FAIL, "ended by contact"),
        ("broken before", fsr(formula="always(ego.speed <= 10 m/s)"), FAIL, "None"),
        ("satisfied before", fsr(formula="eventually(ego.speed > 10 m/s)"), PASS, "None"),
        ("a precondition that it forestalled", fsr(formula=TAKEOVER), INCONCLUSIVE, "ended"),
    ):
        found = judged(hand_made().touch(6, "lead"), item)
        assert found.verdict is verdict, why
        assert str(found.detail).startswith(said), why
    found = judged(hand_made().touch(18, "lead"), fsr(formula="always(not contact)"))
    assert (found.verdict, found.time_s) == (FAIL, pytest.approx(1.8))


def test_run_that_is_none_is_invalid_whatever_it_shows(hand_made: Any) -> None:
    other = hand_made().set("foreign_contact", value=True, rows=slice(4, None)).touch(9, "lead")
    for made, said in (
        (hand_made().touch(0, "lead"), "from the start"),
        (hand_made(events=("cut_in",)), "cut_in"),
        (other, "other traffic"),
    ):
        for item in (fsr(bound=CLOSE), fsr(formula="always(not contact)", on_contact="fail")):
            found = judged(made, item)
            assert (found.verdict, found.is_exercised) == (INVALID, False)
            assert said in str(found.detail)


# --- bounds


def test_bound_on_a_value(hand_made: Any) -> None:
    for bound, verdict, margin in (
        ({"metric": "min_distance_m", "at_least": 30.0}, PASS, 10.0),
        ({"metric": "min_distance_m", "at_least": 40.5}, FAIL, -0.5),
        ({"metric": "max_lane_offset_m", "at_most": 0.4}, PASS, 0.4),
        ({"metric": "max_lane_offset_m", "at_most": 0}, PASS, 0.0),
        ({"metric": "contact", "at_most": 0}, PASS, 0.0),
    ):
        found = judged(hand_made(), fsr(bound=bound))
        assert (found.verdict, found.is_exercised) == (verdict, True), bound
        assert found.margin == pytest.approx(margin), bound
        metric = METRICS[str(bound["metric"])]
        assert found.robustness_low == found.robustness_high == pytest.approx(margin / metric.scale)
        assert (found.signal, found.unit) == (metric.column, metric.unit), bound


def test_bound_names_time_actor_value_and_threshold(hand_made: Any) -> None:
    found = judged(hand_made(), fsr(bound=CLOSE))
    assert (found.time_s, found.actor) == (0.0, "lead")
    assert (found.value, found.threshold) == (pytest.approx(40.0), 10.0)
    assert found.predicate == "min_distance_m >= 10 m"


@pytest.mark.parametrize(
    "item",
    [{"bound": {"metric": "min_ttc_s", "at_least": 1.5}}, {"formula": "always(ttc >= 1.5 s)"}],
)
def test_a_conflict_beyond_the_cap_is_judged_as_none(hand_made: Any, item: dict[str, Any]) -> None:
    free = judged(hand_made(), fsr(**item))
    # Three millimetres a second slower, 40 m ahead: more than three hours.
    slow = hand_made().object("lead", speed=19.997)
    far = judged(slow, fsr(**item))
    assert far.value == pytest.approx(40.0 / 0.003, rel=1e-3)
    assert (far.verdict, far.margin, far.detail) == (PASS, 10.0, "no conflict")
    assert far.robustness_low == free.robustness_low == 10.0


def test_metric_without_a_value_is_vacuous_or_open(hand_made: Any) -> None:
    takeover = fsr(bound={"metric": "takeover_time_s", "at_most": 0.5})
    found = judged(hand_made(), takeover)
    assert (found.verdict, found.is_exercised, found.robustness_low) == (VACUOUS, False, None)
    assert judged(hand_made().touch(6, "lead"), takeover).verdict is INCONCLUSIVE
    made = hand_made().set("fault_active", value=True, rows=slice(5, None), at=0)
    found = judged(made, takeover)
    assert (found.verdict, found.is_exercised) == (INCONCLUSIVE, True)
    assert found.detail == "the run ended before the metric was complete"
    assert (found.robustness_low, found.robustness_high) == (-math.inf, math.inf)
    jerk = fsr(bound={"metric": "max_jerk_mps3", "at_most": 5.0})
    assert judged(hand_made(rows=1, tail_rows=0), jerk).verdict is INCONCLUSIVE


def test_bound_on_what_may_still_get_worse_fails_or_is_open(hand_made: Any) -> None:
    # A wall that matters for 1.8 s and is never detected: nobody knows what would have come then.
    made = hand_made(objects=("wall",), rows=41, tail_rows=0).object("wall", s=100.0, speed=0.0)
    for limit, verdict, low, detail in (
        (1.7, FAIL, pytest.approx(-0.1), None),
        (1.9, INCONCLUSIVE, -math.inf, "the run ended before the metric was complete"),
    ):
        found = judged(made, fsr(bound={"metric": "detection_latency_s", "at_most": limit}))
        assert (found.verdict, found.robustness_low, found.detail) == (verdict, low, detail)
        numbers = (found.value, found.margin, found.robustness_high)
        assert numbers == pytest.approx((1.8, limit - 1.8, limit - 1.8))
    # That it is late is no success, however late it is.
    late = {"metric": "detection_latency_s", "at_least": 1.0, "unusual_side": True}
    found = judged(made, fsr(bound=late))
    assert (found.verdict, found.margin, found.value) == (INCONCLUSIVE, None, None)


def test_metric_in_error_is_an_error(hand_made: Any) -> None:
    made = hand_made()
    made.columns["objects"][0, 9, 0, 3] = np.nan
    found = judged(made, fsr(bound=CLOSE))
    assert (found.verdict, found.margin, found.robustness_low) == (ERROR, None, None)
    assert found.detail == "the metric has no finite value that it may have"


def test_bound_that_holds_up_to_a_contact_is_open(hand_made: Any) -> None:
    item = fsr(bound={"metric": "max_lane_offset_m", "at_most": 0.4})
    found = judged(hand_made().touch(6, "lead"), item)
    assert (found.verdict, found.margin) == (INCONCLUSIVE, pytest.approx(0.4))
    assert found.robustness_low == -math.inf
    assert str(found.detail).startswith("ended by contact")
    strict = fsr(bound={"metric": "max_lane_offset_m", "at_most": 0.4}, on_contact="fail")
    assert judged(hand_made().touch(6, "lead"), strict).verdict is FAIL


def test_bound_that_a_contact_breaks_fails(hand_made: Any) -> None:
    found = judged(hand_made().touch(6, "lead"), fsr(bound=CLOSE))
    assert (found.verdict, found.margin) == (FAIL, -10.0)


def test_settled_metric_is_not_opened_by_a_contact(hand_made: Any) -> None:
    made = hand_made().set("fault_active", value=True, rows=slice(2, None), at=0)
    made.set("authority", 1, rows=slice(4, None)).touch(9, "lead")
    found = judged(made, fsr(bound={"metric": "takeover_time_s", "at_most": 0.5}))
    assert (found.verdict, found.margin) == (PASS, pytest.approx(0.3))


# --- uncertainty, scope, applicability


@pytest.mark.parametrize(
    ("uncertainty", "verdict"), [(0.0, PASS), (0.5, PASS), (0.51, INCONCLUSIVE)]
)
@pytest.mark.parametrize("bound", [False, True])
def test_margin_below_the_numeric_uncertainty_is_inconclusive(
    hand_made: Any, uncertainty: float, verdict: Verdict, *, bound: bool
) -> None:
    item = (
        fsr(bound={"metric": "min_distance_m", "at_least": 39.5})
        if bound
        else fsr(formula="always(distance >= 39.5 m)")
    )
    made = hand_made().ego(s=0.0).object("lead", s=44.0)
    least = NumericUncertainty("a" * 64, {"m": uncertainty})
    assert judged(made, item, uncertainty={"FSR-01": least}).verdict is verdict


def test_uncertainty_does_not_soften_a_failure(hand_made: Any) -> None:
    item = fsr(formula="always(distance >= 40.1 m)")
    least = NumericUncertainty("a" * 64, {"m": 5.0})
    assert judged(hand_made(), item, uncertainty={"FSR-01": least}).verdict is FAIL


def test_fsr_is_not_judged_in_other_scenarios(hand_made: Any) -> None:
    there = fsr(id="A", formula="always(not contact)", scenarios=["follow"])
    elsewhere = fsr(id="B", formula="always(not contact)", scenarios=["overtake"])
    (found,) = evaluated(hand_made(), there, elsewhere).judgements
    assert [item.fsr_id for item in found] == ["A"]


def test_run_outside_the_odd_is_evidence_only_where_asked(hand_made: Any) -> None:
    items = [
        fsr(id=applies, formula="always(not contact)", applies=applies)
        for applies in ("inside", "outside", "everywhere")
    ]
    is_inside = np.array([True, False])
    inside, outside = evaluated(hand_made(runs=2), *items, inside=is_inside).judgements
    assert [item.fsr_id for item in inside] == ["inside", "everywhere"]
    assert [item.fsr_id for item in outside] == ["outside", "everywhere"]


def test_leaving_the_odd_during_a_run_can_be_named(hand_made: Any) -> None:
    attributes = Attributes.model_validate({"dynamic_elements": {"ego_speed": {"max": "15 m/s"}}})
    item = fsr(formula="always(in_odd)")
    assert judged(hand_made(), item).verdict is PASS
    assert judged(hand_made(), item, attributes=attributes).verdict is FAIL


def test_signal_that_the_runs_lack_is_listed_and_not_judged(hand_made: Any) -> None:
    found = evaluated(
        hand_made(),
        fsr(id="A", formula="always(not authority.third)"),
        fsr(id="B", formula="always(not contact)"),
    )
    assert found.not_applicable == {"A": "the runs have no signal authority.third"}
    assert [item.fsr_id for item in found.judgements[0]] == ["B"]


def test_fault_of_another_entry_leaves_the_fsr_unexercised(hand_made: Any) -> None:
    item = fsr(formula="always(fault.brake_loss.active implies standstill)")
    found = judged(hand_made(faults=()), item, faults=["brake_loss"])
    assert found.verdict is VACUOUS


def test_evaluation_holds_metrics_and_outcomes_of_every_run(hand_made: Any) -> None:
    found = evaluated(hand_made(runs=2).touch(6, "lead", run=1), fsr(bound=CLOSE))
    assert set(found.metrics) == set(METRICS)
    assert [item.end_reason for item in found.outcomes] == ["horizon", "contact"]
    assert found.judgements[0][0].fsr_digest == compile_requirement(fsr(bound=CLOSE)).digest


def test_plug_in_metric_without_a_finite_margin_is_an_error(
    hand_made: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "adeye.judge.requirements.Bound.margins",
        lambda _, values, free: (np.nan * values, free),
    )
    assert judged(hand_made(), fsr(bound=CLOSE)).verdict is ERROR


def test_run_is_judged_alone_as_in_a_batch(hand_made: Any) -> None:
    made = hand_made(runs=3).object("lead", run=1, speed=3.0).touch(7, "lead", run=2)
    items = [compile_requirement(fsr(formula=TAKEOVER)), compile_requirement(fsr(bound=CLOSE))]
    together = judge(made.trace(), items, np.ones(3, dtype=bool)).judgements
    for run in range(3):
        alone = judge(made.trace().select([run]), items, np.ones(1, dtype=bool))
        assert alone.judgements[0] == together[run]


def test_parts_that_are_measured_together_do_not_show(
    hand_made: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = hand_made(runs=5).object("lead", run=3, speed=3.0).touch(7, "lead", run=2)
    made.columns["ego"][4, 9, 3] = np.nan
    items = [compile_requirement(fsr(formula=TAKEOVER)), compile_requirement(fsr(bound=CLOSE))]
    whole = judge(made.trace(), items, np.ones(5, dtype=bool))
    monkeypatch.setattr("adeye.judge.evaluate.PART_RUNS", 2)
    parts = judge(made.trace(), items, np.ones(5, dtype=bool))
    assert parts.judgements == whole.judgements
    assert parts.outcomes == whole.outcomes
    for name, column in whole.metrics.items():
        assert np.array_equal(parts.metrics[name].value, column.value, equal_nan=True)
        assert parts.metrics[name].status == column.status
        assert tuple(parts.metrics[name].actor) == tuple(column.actor)


# --- runs whose planned fault never acted


def test_run_that_its_fault_never_met_passes_nothing_and_fails_what_it_fails(
    hand_made: Any,
) -> None:
    made = hand_made(faults=("late",))
    fine = fsr(id="FSR-01", formula="always(not contact)")
    vacuous = fsr(id="FSR-02", formula=TAKEOVER)
    broken = fsr(id="FSR-03", formula="always(time_gap >= 2.5 s)")
    far, near = fsr(id="FSR-04", bound=CLOSE), fsr(id="FSR-05", bound={**CLOSE, "at_least": 90.0})
    found = evaluated(made, fine, vacuous, broken, far, near).judgements[0]
    assert [item.verdict for item in found] == [INVALID, INVALID, FAIL, INVALID, FAIL]
    assert [item.is_exercised for item in found] == [False, False, True, False, True]
    assert found[0].detail == "not tested: fault late did not act within the horizon"
    assert found[2].margin == pytest.approx(-0.5)


def test_contact_before_the_fault_fails_and_leaves_the_rest_untested(hand_made: Any) -> None:
    made = hand_made(faults=("late",)).touch(6, "lead")
    contact = fsr(id="FSR-01", formula="always(not contact)")
    lane = fsr(id="FSR-02", formula="always(abs(ego.lane_offset) <= 0.5 m)")
    found = evaluated(made, contact, lane).judgements[0]
    assert [item.verdict for item in found] == [FAIL, INVALID]


def test_both_faults_of_an_entry_must_act(hand_made: Any) -> None:
    made = hand_made(faults=("early", "late")).set("fault_active", 1, rows=slice(3, 5), at=0)
    found = judged(made, fsr(formula="always(not contact)"))
    assert found.verdict is INVALID
    assert found.detail == "not tested: fault late did not act within the horizon"


# --- Verdicts as columns: the record of one run is what its row says ------------------------------

NAN = math.nan


@pytest.fixture
def columns() -> evaluate.JudgementColumns:
    return evaluate.JudgementColumns(
        fsr_id="FSR-01",
        fsr_digest="d" * 64,
        runs=np.array([2, 5]),
        verdict=np.array([codes.PASS, codes.ERROR]),
        exercised=np.array([True, False]),
        numbers=np.array([[0.5, math.inf, 5.0, 1.25, 7.0, 2.0], [NAN] * 6]),
        actor=np.array([1, -1]),
        binding=np.array([0, 1]),
        bindings=(("m", "gap", "gap > 2 m"), (None, None, None)),
        detail=np.array([1, 0]),
        details=("a signal has a sample that is not a finite number", None),
        objects=("lead", "cutter"),
    )


def test_every_verdict_has_its_code() -> None:
    meant = {
        codes.PASS: Verdict.PASS,
        codes.FAIL: Verdict.FAIL,
        codes.INCONCLUSIVE: Verdict.INCONCLUSIVE,
        codes.VACUOUS: Verdict.VACUOUS,
        codes.INVALID: Verdict.INVALID,
        codes.ERROR: Verdict.ERROR,
    }
    assert {code: VERDICTS[code] for code in meant} == meant
    assert set(VERDICTS) == set(Verdict) - {Verdict.NOT_RUN}


def test_record_of_a_run_is_its_row(columns: evaluate.JudgementColumns) -> None:
    assert columns.of_run(2) == Judgement(
        fsr_id="FSR-01",
        fsr_digest="d" * 64,
        verdict=Verdict.PASS,
        is_exercised=True,
        robustness_low=0.5,
        robustness_high=math.inf,
        margin=5.0,
        unit="m",
        signal="gap",
        predicate="gap > 2 m",
        time_s=1.25,
        actor="cutter",
        value=7.0,
        threshold=2.0,
    )


def test_what_is_not_there_is_none(columns: evaluate.JudgementColumns) -> None:
    found = known(columns.of_run(5))
    given = {"fsr_id", "fsr_digest", "verdict", "is_exercised", "detail"}
    assert found.verdict is Verdict.ERROR
    assert found.detail == "a signal has a sample that is not a finite number"
    for item in fields(Judgement):
        assert item.name in given or getattr(found, item.name) is None


@pytest.mark.parametrize("run", [0, 3, 6])
def test_run_that_the_fsr_does_not_concern_has_no_record(
    columns: evaluate.JudgementColumns, run: int
) -> None:
    assert columns.of_run(run) is None
