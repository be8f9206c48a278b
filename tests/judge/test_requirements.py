"""FSRs against a plan: what they measure, bounds, what is refused and where."""

import math
import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.errors import InputError, InputErrors, SourceLocation, SpecError
from adeye.judge.metrics import METRICS
from adeye.judge.requirements import (
    Bound,
    CheckedRequirement,
    JudgedPlan,
    bound_of,
    check_demands,
    check_requirements,
    compile_requirement,
    last_decision,
    measured,
    reads_odd,
    requirement_digest,
)
from adeye.judge.stl.formula import parse_formula
from adeye.spec.concept import Concept, Requirement
from adeye.store.tables import METRIC_IDS
from tests.judge.conftest import fsr
from tests.refusals import refused
from tests.stored import known, stored

TABLES = stored("formulas")


Check = Callable[..., CheckedRequirement]


def concept(*requirements: dict[str, Any]) -> Concept:
    content = stored("made_concept")
    (shared,) = content["requirements"]
    content["requirements"] = [
        {**shared, "id": f"FSR-{number}", **item} for number, item in enumerate(requirements)
    ]
    return Concept.model_validate(content)


@pytest.fixture
def plan(scenario: Any, architecture: Any) -> JudgedPlan:
    """Two scenarios and two architectures, of which one has no safety channel."""
    alone = {"policy": "stuck", "priority": ["nominal"], "default": "nominal"}
    nominal = {"kind": "nominal", "links": ["camera"], "rate": "10 Hz"}
    return JudgedPlan(
        scenarios={"follow": scenario(), "overtake": scenario("lead", "other", tail="2 s")},
        architectures={
            "two_channels": architecture(),
            "one_channel": architecture(channels={"nominal": nominal}, switch=alone),
        },
        gate=("two_channels",),
        step=0.1,
        faults=("camera_out",),
        monitors={"two_channels": ("danger",)},
    )


@pytest.fixture
def check(plan: JudgedPlan) -> Check:
    """Check one FSR, located by its place in the concept."""

    def run(**item: Any) -> CheckedRequirement:
        (found,) = check_requirements(concept(item), plan, locate)
        played = [(*each, way) for each in plan.scenarios.items() for way in (True, False)]
        check_demands(concept(item), plan, played, locate)
        return found

    return run


def locate(loc: tuple[str | int, ...]) -> SourceLocation:
    return SourceLocation("concept.yaml/" + "/".join(map(str, loc)), 1, 1)


def test_formula_is_parsed_and_applies_everywhere(check: Check) -> None:
    checked = check(formula="always(not contact)")
    assert known(checked.formula).names == ("contact",)
    assert checked.bound is None
    assert checked.not_applicable == {}


def test_bound_is_found_in_the_registry(check: Check) -> None:
    checked = check(bound={"metric": "min_ttc_s", "at_least": 1.5})
    assert checked.formula is None
    assert checked.bound == Bound("min_ttc_s", 1.5, is_lower=True)
    assert checked.bound.text == "min_ttc_s >= 1.5 s"
    assert Bound("contact", 0.0, is_lower=False).text == "contact <= 0"


def test_checked_requirement_travels_to_other_processes(check: Check) -> None:
    for checked in (
        check(formula="always(authority.safety implies eventually[0 s, 1 s](standstill))",
              scenarios=["overtake"]),
        check(bound={"metric": "min_ttc_s", "at_least": 1.5}),
    ):  # fmt: skip
        assert pickle.loads(pickle.dumps(checked)) == checked  # noqa: S301 - what we just wrote


def test_digest_covers_what_is_judged_and_nothing_else(check: Check) -> None:
    base = check(bound={"metric": "min_ttc_s", "at_least": 1.5}).digest
    assert check(bound={"metric": "min_ttc_s", "at_least": 1.5}, text="Other.").digest == base
    assert check(bound={"metric": "min_ttc_s", "at_least": 1.6}).digest != base
    assert check(bound={"metric": "min_ttc_s", "at_least": 1.5}, on_contact="fail").digest != base


def test_bound_is_finite() -> None:
    for limit in (math.inf, math.nan):
        requirement = concept({"bound": {"metric": "min_ttc_s", "at_least": 1.0}}).requirements[0]
        broken = requirement.model_copy(
            update={"bound": known(requirement.bound).model_copy(update={"at_least": limit})}
        )
        refused(SpecError, compile_requirement, broken, says="finite")


def test_requirement_without_any_measure_is_refused() -> None:
    requirement = concept({"formula": "always(not contact)"}).requirements[0]
    broken: Requirement = requirement.model_copy(update={"formula": None})
    refused(SpecError, compile_requirement, broken, says="no metric")


def test_signal_that_one_architecture_lacks_is_not_applicable_there(check: Check) -> None:
    checked = check(formula="always(authority.safety implies standstill)")
    assert checked.not_applicable == {"one_channel": "it has no signal authority.safety"}


def test_architecture_in_the_gate_must_have_every_signal(plan: JudgedPlan) -> None:
    strict = JudgedPlan(**{**vars(plan), "gate": ("two_channels", "one_channel")})
    with pytest.raises(SpecError, match="'one_channel' is in the gate, but it has no signal"):
        check_requirements(concept({"formula": "always(not authority.safety)"}), strict)


@pytest.mark.parametrize(
    "name", ["fault.camera_out.active", "monitor.danger.raw", "sensor.camera.detects.lead"]
)
def test_faults_monitors_and_detections_are_known_to_the_plan(check: Check, name: str) -> None:
    assert check(formula=f"always(not {name})").formula is not None


def test_window_beyond_the_tail_names_the_tail_needed(check: Check) -> None:
    for formula, needed in TABLES["window beyond the tail names the tail needed"]:
        says = f"'follow' has a tail of 0.5 s. Give .* tail of {needed}"
        refused(SpecError, check, formula=formula, says=says)
    for formula in TABLES["window within the tail is accepted"]:
        assert check(formula=formula).formula is not None


def test_window_before_the_beginning_of_every_run_is_refused(check: Check) -> None:
    for formula in (
        "always(historically[60 s, 61 s](gap > 1 m) and gap > 0 m)",
        "always(once[60 s, 61 s](gap > 1 m) or gap > 0 m)",
        "always((gap > 1 m) since[60 s, 61 s] (gap > 2 m) or gap > 0 m)",
        "always(once[0 s, 0.4 s](historically[60 s, 61 s](gap > 1 m)) or gap > 0 m)",
    ):
        says = r"asked up to [\d.]+ s of .* before its beginning"
        refused(SpecError, check, formula=formula, says=says)
    for formula in (
        "always(historically[0 s, 61 s](gap > 1 m))",
        "always(once[1.4 s, 61 s](gap > 1 m) or gap > 0 m)",
    ):
        assert check(formula=formula).formula is not None


def test_decision_needs_a_row_after_the_horizon(scenario: Any, plan: JudgedPlan) -> None:
    asked = concept({"formula": "always(not authority.safety)"})
    # It is the tail as a sweep sets it that counts.
    played = [("follow", scenario(tail=tail), True) for tail in ("0.5 s", "0 s")]
    check_demands(asked, plan, played[:1])
    refused(SpecError, check_demands, asked, plan, played[1:], says=r"tail of 0\.1 s")


def test_all_errors_come_together(plan: JudgedPlan) -> None:
    broken = concept({"formula": "always(qqqq)"}, {"bound": {"metric": "no", "at_most": 1.0}})
    caught = refused(InputErrors, check_requirements, broken, plan)
    assert len(caught.errors) == 2


@pytest.mark.parametrize(("formula", "last"), TABLES["last decision that a formula reads"])
def test_last_decision_that_a_formula_reads(formula: str, last: float) -> None:
    assert last_decision(parse_formula(formula).root, 10.0) == last


@pytest.mark.parametrize(
    ("applies", "inside", "outside"),
    [("inside", True, False), ("outside", False, True), ("everywhere", True, True)],
)
def test_evidence_counts_where_the_fsr_applies(
    check: Check, applies: str, *, inside: bool, outside: bool
) -> None:
    checked = check(formula="always(not contact)", applies=applies, scenarios=["follow"])
    assert checked.concerns("follow", is_inside=True) is inside
    assert checked.concerns("follow", is_inside=False) is outside
    assert not checked.concerns("overtake", is_inside=True)


def test_margin_of_a_bound() -> None:
    for bound, value, is_free, margin in (
        (Bound("min_ttc_s", 1.5, is_lower=True), 2.0, False, 0.5),
        (Bound("min_ttc_s", 1.5, is_lower=True), math.nan, True, 10.0),
        (Bound("min_ttc_s", 1.5, is_lower=False), math.nan, True, -10.0),
        (Bound("max_drac_mps2", 3.0, is_lower=False), 4.0, False, -1.0),
        (Bound("max_drac_mps2", 3.0, is_lower=False), math.nan, True, 3.0),
        (Bound("impact_speed_mps", 3.0, is_lower=True), math.nan, True, -3.0),
    ):
        found, _ = bound.margins(np.array([value, 0.0]), np.array([is_free, is_free]))
        assert found[0] == margin, bound


# --- parameters


def test_parameters_stand_in_formula_and_bound(check: Check) -> None:
    tau = {"tau": "1500 ms"}
    formula = check(formula="always(time_gap > tau or contact)", parameters=tau).formula
    assert known(formula).parameters == (("tau", 1.5),)
    bound = known(check(bound={"metric": "min_ttc_s", "at_least": "tau"}, parameters=tau).bound)
    assert (bound.limit, bound.is_lower) == (1.5, True)
    plain = check(bound={"metric": "min_ttc_s", "at_least": "tau"}, parameters={"tau": 2}).bound
    assert known(plain).limit == 2.0


def test_a_parameter_is_part_of_what_is_judged_whatever_its_unit(check: Check) -> None:
    def digest(value: Any) -> str:
        return check(formula="always(time_gap > tau)", parameters={"tau": value}).digest

    assert digest("1.5 s") == digest("1500 ms")
    assert digest("1.5 s") != digest("1.6 s")


def test_what_does_not_fit_is_refused_at_its_place(check: Check) -> None:
    of_plan = TABLES["what does not fit the plan is refused at its place"]
    of_parameters = TABLES["a parameter that does not fit is refused at its place"]
    for item, place, message in of_plan + of_parameters:
        caught = refused(InputError, check, **item, says=message)
        assert f"requirements/0/{place}:1:1" in str(caught)
    for formula in TABLES["what no signal decides is refused at its place"]:
        caught = refused(SpecError, check, formula=formula, says="holds, whatever its signals are")
        assert "depends on them" in caught.remedy
        assert "unusual_formula: true in the FSR" in caught.remedy
    assert check(formula="always(actor.other.gap > 1 m)", scenarios=["overtake"]).formula


def test_part_that_no_row_misses_by_the_ends_of_its_signal_is_refused(check: Check) -> None:
    for part in (
        "ego.lane >= -1",
        "ego.lane <= 2",
        "actor.lead.lane < 2.5",
        "time <= 3.5 s",
        "channel.nominal.age <= 10 s",
        "ttr >= -10 s",
        "gap >= 0 m",
        "ego.lane >= 1 or ego.lane <= 0",
    ):
        refused(SpecError, check, formula=f"always({part})", says="always holds, whatever")
    for part in (
        "ego.lane >= 0",
        "ego.lane <= 1",
        "time < 1.5 s",
        "ttr >= -9 s",
        "rss_margin >= 0 m",
    ):
        assert check(formula=f"always({part})").formula


def test_what_asks_less_than_it_seems_is_refused(check: Check) -> None:
    for part in (
        "not contact",
        "always[0 s, 0 s](not contact)",
        "always[0 s, 0.01 s](gap >= 5 m)",
        "gap >= 5 m until[0 s, 0 s] not contact",
        "rise(gap >= 5 m) or gap >= 10 m",
        "gap >= 5 m or always(not contact)",
        "not (gap < 5 m or eventually(contact))",
        "not rise(eventually[0 s, 1 s](contact))",
        "always(once(gap >= 5 m))",
        "eventually(historically(gap >= 5 m))",
        "always(once[0 s, 100 s](gap >= 5 m))",
        "always(not historically(not gap >= 5 m))",
        "not eventually(not once(gap >= 5 m))",
        "always(always[0 s, 0.5 s](once(gap >= 5 m)))",
        "always(historically(once(gap >= 5 m)))",
        "eventually(historically(gap >= 5 m) or ttr < -9 s)",
        "always(not (once(gap >= 5 m) implies contact))",
        "always[0 s, 2 s](once(gap >= 5 m and not contact))",
        "always(ttr >= -9 s implies once(historically(gap >= 5 m)))",
        "always(gap >= 5 m) or (gap >= 5 m and always(not contact))",
        "not not (gap >= 5 m and always(not contact))",
        "not (gap < 5 m implies eventually(contact))",
        "not (always(not contact) implies gap < 5 m)",
        "always[0 s, 0 s](gap >= 5 m and always[0 s, 2 s](not contact))",
        "eventually[0 s, 0 s](always[0 s, 2 s](not contact) and gap >= 5 m)",
    ):
        for formula in (part, f"always(ttr >= -9 s) and ({part})", f"contact implies ({part})"):
            refused(SpecError, check, formula=formula, says="of the first row alone.*always")
    for part in (
        "ego.speed >= 25 m/s implies always(not contact)",
        "ego.speed >= 25 m/s implies (gap < 50 m implies always(not contact))",
        "not not (ego.speed >= 25 m/s implies always(not contact))",
        "always(rise(gap < 5 m) implies always[0 s, 0 s](not contact))",
        "always(once[0 s, 1 s](gap >= 5 m))",
        "always(once(gap >= 5 m) or gap < 4 m)",
        "always(once(historically(gap >= 5 m)) implies not contact)",
        "always[1 s, 2 s](once(gap >= 5 m))",
        "always(eventually[0 s, 0.5 s](once(gap >= 5 m)))",
        "always(rise(gap < 5 m) implies always[0 s, 0.5 s](once(gap < 4 m)))",
        "eventually(once(gap >= 5 m))",
        "always(gap >= 5 m implies once(gap >= 6 m))",
        "always[0 s, 0 s](eventually[0 s, 1 s](gap >= 5 m))",
    ):
        assert check(formula=part).formula
    weak = "eventually(authority.safety implies ego.speed <= 1 m/s)"
    refused(SpecError, check, formula=weak, says="where its left side does not.*Write and")


def test_run_that_begins_with_a_contact_fails_nothing(check: Check) -> None:
    # It is INVALID.
    for formula in ("not always(contact)", "always(once(not contact))"):
        said = "(always|never) holds, whatever|of the first row alone"
        refused(SpecError, check, formula=formula, says=said)


def test_bands_of_many_signals_together_are_found_to_hold(check: Check) -> None:
    places = "actor.lead.lane == 1 and actor.lead.gap >= 10 m and actor.lead.gap <= 60 m"
    own = "ego.speed >= 80 km/h and ego.speed <= 100 km/h and abs(ego.lane_offset) <= 0.3 m"
    formula = f"always(({places} and {own} and ego.lane == 1) implies sensor.camera.detects.lead)"
    assert check(formula=formula).formula


def test_only_runs_that_an_fsr_is_judged_on_count_as_they_are_executed(plan: JudgedPlan) -> None:
    short = plan.scenarios["follow"]
    long = short.model_copy(update={"horizon": 30.0})
    for item in ({"formula": "always(channel.nominal.age <= 10 s)"}, EXPOSED):
        spoken = concept({"scenarios": ["follow"], **item})
        check_demands(spoken, plan, [("follow", long, True)])
        for played in (
            [("follow", short, True), ("follow", long, False)],
            [("follow", short, True)],
        ):
            with pytest.raises(SpecError, match=r"always holds|cannot fail"):
                check_demands(spoken, plan, played)


EXPOSED = {"bound": {"metric": "tet_s", "at_most": 10.0}}


@pytest.mark.parametrize(
    ("formula", "says"),
    [
        ("always(once(in_odd) or previous(in_odd))", "counts at the first row alone"),
        (
            "always(not contact and (not contact or in_odd))",
            "'in_odd' (formula, character 40) never",
        ),
    ],
)
def test_part_that_counts_for_nothing_beside_others_is_refused(
    check: Check, formula: str, says: str
) -> None:
    refused(SpecError, check, formula=formula, says=says)
    check(formula=formula, unusual_formula=True)


def test_formula_that_no_run_decides_is_accepted_if_it_is_meant(check: Check) -> None:
    formula = "eventually(time >= 1 s)"
    meant = check(formula=formula, unusual_formula=True).requirement
    assert meant.measure == f"{formula} (meant, although no run was found that decides all of it)"
    assert requirement_digest(meant) == requirement_digest(requirement(formula=formula))
    needless = {"formula": "eventually(contact)", "unusual_formula": True}
    caught = refused(SpecError, check, **needless, says="holds on some runs and fails on others")
    assert "requirements/0/unusual_formula" in str(caught)
    with pytest.raises(ValueError, match="there is no formula"):
        fsr(bound={"metric": "min_ttc_s", "at_least": 1.5}, unusual_formula=True)


def test_an_operator_that_looks_back_needs_no_tail(check: Check) -> None:
    checked = check(formula="always(rise(contact) implies once[0 s, 30 s](authority.safety))")
    assert known(checked.formula).reach_s == 0.0


def test_bound_on_the_wrong_side_is_refused_unless_it_is_meant(
    check: Check, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = replace(METRICS["nominal_availability"], column="smoothness", uid="mine:smoothness@1")
    monkeypatch.setitem(METRICS, "smoothness", own)
    for bound, said in TABLES["bound on the wrong side is refused unless it is meant"]:
        caught = refused(SpecError, check, bound=bound, says=said)
        assert "/bound/at_" in known(caught.where).path
        assert "unusual_side: true" in caught.remedy
        meant = check(bound={**bound, "unusual_side": True})
        assert meant.bound is not None
        assert meant.digest == requirement_digest(requirement(bound=bound))


def test_no_metric_takes_a_bound_that_every_run_meets(check: Check) -> None:
    ends_unknown = [name for name in METRIC_IDS if METRICS[name].least is None]
    assert ends_unknown == ["rear_detection_margin_m"]
    for name in METRIC_IDS:
        metric = METRICS[name]
        lasts = 3.5 if metric.settles else 2.0
        most = (metric.most or 0.0) * {"": 1.0, "s": lasts, "row": lasts / 0.1 + 1.0}[
            metric.most_per
        ]
        for side, end in (("at_least", metric.least), ("at_most", metric.most and most)):
            if end is not None:
                refused(SpecError, check, bound={"metric": name, side: end}, says="cannot fail")
        if metric.worse == "higher" and metric.most:
            assert check(bound={"metric": name, "at_most": 0.99 * most}).bound
        assert metric.most or (metric.unit, metric.worse) != ("s", "higher")


def test_parameter_of_a_bound_is_on_its_side_too(check: Check) -> None:
    bound = {"metric": "min_distance_m", "at_most": "most"}
    refused(SpecError, check, bound=bound, parameters={"most": "6 m"}, says="harmless side")


def requirement(**item: Any) -> Requirement:
    return concept(item).requirements[0]


def bounded(metric: str, limit: Any, side: str = "at_most") -> Requirement:
    return fsr(bound={"metric": metric, side: limit})


@pytest.mark.parametrize(
    ("metric", "text", "number"), TABLES["text with a unit is the number in si and the same fsr"]
)
@pytest.mark.parametrize("side", ["at_most", "at_least"])
def test_text_with_a_unit_is_the_number_in_si_and_the_same_fsr(
    metric: str, text: str, number: float, side: str
) -> None:
    written, plain = bounded(metric, text, side), bounded(metric, number, side)
    assert bound_of(written) == bound_of(plain)
    assert bound_of(written).limit == number
    assert requirement_digest(written) == requirement_digest(plain)
    assert written.model_dump_json() == plain.model_dump_json()


@pytest.mark.parametrize(
    ("antecedent", "is_other"),
    [
        ("historically[1 s, 2 s](ego.speed > 1 m/s)", True),
        ("not once[1 s, 2 s](ego.speed > 1 m/s)", True),
        ("eventually[0 s, 0.5 s](historically[1 s, 2 s](ego.speed > 1 m/s))", True),
        ("historically[0 s, 2 s](ego.speed > 1 m/s)", False),
        ("not previous(ego.speed > 1 m/s)", True),
        ("once[1 s, 2 s](ego.speed > 1 m/s)", False),
        ("previous(ego.speed > 1 m/s)", False),
        ("ego.speed > 1 m/s", False),
    ],
)
def test_verdicts_from_when_empty_windows_counted_are_those_of_another_fsr(
    antecedent: str, *, is_other: bool
) -> None:
    outer = measured(requirement(formula=f"always({antecedent} implies not contact)"))
    nested = measured(requirement(formula=f"always(contact or ({antecedent} implies in_odd))"))
    assert ("told" in outer) is ("told" in nested) is is_other
    # What is asked for may be met by nothing as before.
    asked = f"always(ego.speed > 1 m/s implies {antecedent})"
    assert "told" not in measured(requirement(formula=asked))


def test_digest_of_a_plain_number_is_what_it_was() -> None:
    assert requirement_digest(bounded("takeover_time_s", 1.5)) == RECORDED


def test_unit_of_something_else_is_refused() -> None:
    for metric, text, message in TABLES["unit of something else is refused"]:
        made = bounded(metric, text)
        for written in (made, pickle.loads(pickle.dumps(made))):  # noqa: S301 - its own
            refused(SpecError, bound_of, written, says=message)


def test_what_is_no_quantity_is_refused_at_its_place() -> None:
    for text in ("1.5 parsec", "soon", "", "1e999 s", True):
        refused(ValueError, bounded, "takeover_time_s", text, says=r"bound\.at_most")


@pytest.mark.parametrize("unit", ["km/h", "pint"])
def test_metric_that_is_not_in_si_takes_plain_numbers_only(
    unit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(METRICS, "mine", replace(METRICS["impact_speed_mps"], unit=unit))
    assert bound_of(bounded("mine", 30.0)).limit == 30.0
    with pytest.raises(SpecError, match=f"is in {unit}. Write a plain number"):
        bound_of(bounded("mine", "30 km/h"))


def test_margin_is_the_distance_to_the_limit_and_the_cap_without_a_conflict() -> None:
    values, free = np.array([4.0, 7.0, np.nan]), np.array([False, False, True])
    high = bound_of(bounded("min_distance_m", "5 m", "at_least"))
    assert high.margins(values, free)[0].tolist() == [-1.0, 2.0, METRICS["min_distance_m"].cap]
    low = bound_of(bounded("max_drac_mps2", "5 m/s^2"))
    assert low.margins(values, free)[0].tolist() == [1.0, -2.0, 5.0]
    assert low.text == "max_drac_mps2 <= 5 m/s²"


@pytest.mark.parametrize("name", [name for name, metric in METRICS.items() if metric.cap])
@pytest.mark.parametrize("is_lower", [True, False])
def test_a_conflict_beyond_the_cap_is_none(name: str, *, is_lower: bool) -> None:
    cap = known(METRICS[name].cap)
    limit = 0.5 * cap
    values = limit + np.array([np.nan, 1.01 * cap, 1_000.0 * cap, 0.5 * cap, -3.0 * cap])
    free = np.array([True, False, False, False, False])
    margins, is_free = Bound(name, limit, is_lower=is_lower).margins(values, free)
    assert margins[:3].tolist() == [cap if is_lower else -cap] * 3
    assert is_free.tolist() == [True, True, True, False, False]
    assert np.abs(margins[3:]) == pytest.approx([0.5 * cap, 3.0 * cap])


RECORDED = "dcaec671b76fae6c596e759877218dae3156f41416d268336bf79151c017bcdf"


@pytest.mark.parametrize("is_lower", [True, False])
def test_what_lies_on_a_bound_as_a_decimal_has_no_margin(*, is_lower: bool) -> None:
    name = next(name for name, metric in METRICS.items() if metric.cap is None)
    values = np.array([0.1 + 0.2, 6 * 0.05])
    margins, _ = Bound(name, 0.3, is_lower).margins(values, np.zeros(2, np.bool_))
    assert margins.tolist() == [0.0, 0.0]


GAP = {"formula": "always(gap >= 1 m)"}
TTC = {"bound": {"metric": "min_ttc_s", "at_least": 2.0}}


def stated(part: dict[str, Any]) -> Requirement:
    return fsr(**{"scenarios": ["cut_in", "lead_braking"], **part})


def test_spelling_is_no_part_of_it() -> None:
    for before, now in (
        (GAP, {"formula": " always( gap>=100 cm )\n"}),
        (GAP, {"formula": "always(gap >= least)", "parameters": {"least": "1000 mm"}}),
        (GAP, {**GAP, "scenarios": ["lead_braking", "cut_in"]}),
        (GAP, {**GAP, "text": "Other words.", "asil": "D", "mandatory": False}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_least": 2}}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_least": "2000 ms"}}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_least": "t"}, "parameters": {"t": "2 s"}}),
    ):
        assert measured(stated(before)) == measured(stated(now))
        assert requirement_digest(stated(before)) == requirement_digest(stated(now))


def test_everything_else_is() -> None:
    for before, now in (
        (GAP, {"formula": "always(gap > 1 m)"}),
        (GAP, {"formula": "always(gap >= 1.0000000000000002 m)"}),
        (GAP, {**GAP, "scenarios": ["cut_in"]}),
        (GAP, {**GAP, "on_contact": "fail"}),
        (GAP, {**GAP, "applies": "everywhere"}),
        (GAP, {**GAP, "id": "FSR-02"}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_most": 2.0}}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_least": 2.0000000000000004}}),
        (TTC, {"bound": {"metric": "min_thw_s", "at_least": 2.0}}),
    ):
        assert measured(stated(before)) != measured(stated(now))
        assert requirement_digest(stated(before)) != requirement_digest(stated(now))


def test_only_the_signal_reads_the_odd() -> None:
    assert reads_odd(stated({"formula": "always(in_odd)"}))
    named = {"formula": "always(gap >= not_in_odd)", "parameters": {"not_in_odd": "1 m"}}
    assert not reads_odd(stated(named))
    assert not reads_odd(stated(TTC))
