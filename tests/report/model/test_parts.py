"""Parts of a report contradict neither themselves nor what they are read from."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.judge.verdict import Outcome, Verdict
from adeye.report.model.assessment import FaultEvidence, Preventability, SafeStops
from adeye.report.model.concept import OpenPoint, Realisation, SafetyGoal
from adeye.report.model.part import Binding, Label, Margin, Part, RunVerdict
from tests.report.parts import (
    coverage,
    evidence,
    fault_timing,
    group,
    impact,
    line,
    preventability,
    stop,
)


def test_a_field_that_the_source_lacks_is_no_default() -> None:
    judged = RunVerdict(fsr="FSR-01", verdict=Verdict.PASS, margin=None, binding=None, note="x")
    assert RunVerdict.of(judged, note="") == judged.model_copy(update={"note": ""})
    with pytest.raises(AttributeError, match="note"):
        RunVerdict.of(Label(label="FSR-01", value="PASS"), fsr="", verdict=Verdict.PASS,
                      margin=None, binding=None)  # fmt: skip


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_margin_is_finite(value: float) -> None:
    with pytest.raises(ValidationError, match="finite"):
        Margin(value=value, unit="m")


def test_misspelt_field_is_refused() -> None:
    with pytest.raises(ValidationError, match="Extra inputs"):
        Label.model_validate({"label": "a", "value": "b", "vlaue": "c"})


@pytest.mark.parametrize("value", [True, 1.5, "silent", None])
def test_binding_keeps_the_kind_of_its_value(value: object) -> None:
    binding = Binding.model_validate({"predicate": "p", "signal": "s", "value": value})
    again = Binding.model_validate_json(binding.model_dump_json())
    assert again.value == value
    assert type(again.value) is type(value)


def test_parts_compare_by_content() -> None:
    one, other = (RunVerdict(fsr="F", verdict=Verdict.PASS) for _ in range(2))
    assert one == other
    assert one is not other
    assert isinstance(one, Part)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"findings": 1}, "2 runs are avoided by the model only, 1 are findings"),
        ({"compared": 0}, "0 runs are compared, in 1 tallies"),
    ],
)
def test_findings_are_the_runs_that_only_the_model_avoids(
    changes: dict[str, Any], says: str
) -> None:
    told = preventability().model_dump() | changes
    with pytest.raises(ValidationError, match=says):
        Preventability.model_validate(told)


def test_tally_has_every_cell() -> None:
    told = preventability().model_dump()
    told["tallies"][0]["counts"].pop("unknown")
    with pytest.raises(ValidationError, match="does not count every cell"):
        Preventability.model_validate(told)


def test_tally_counts_its_runs() -> None:
    [tally] = preventability().tallies
    assert tally.runs == 6


@pytest.mark.parametrize(("measured", "handled"), [(3, 3), (4, 0)])
def test_what_is_not_measured_never_passes(measured: int, handled: int) -> None:
    with pytest.raises(ValidationError, match="PASS, but"):
        fault_timing(measured=measured, handled=handled)
    fault_timing(measured=measured, handled=handled, verdict=Verdict.NOT_RUN)


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, Verdict.FAIL),
        ({"contact": 0, "moving": 1, "places": stop().places[1:]}, Verdict.INCONCLUSIVE),
        ({"contact": 0, "asked": 3, "places": stop().places[1:]}, Verdict.PASS),
        ({"contact": 0, "asked": 3, "places": stop().places[1:], "unknown": 1},
         Verdict.INCONCLUSIVE),
        ({"contact": 0, "asked": 0, "reached": 0, "places": ()}, Verdict.VACUOUS),
    ],
)  # fmt: skip
def test_stop_is_shown_only_where_all_stand(changes: dict[str, Any], verdict: Verdict) -> None:
    assert stop(**changes).verdict is verdict


@pytest.mark.parametrize("changes", [{"asked": 5}, {"places": ()}])
def test_every_stop_has_an_end_and_a_place(changes: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match=r"do not add up|has a place"):
        stop(**changes)


def test_stops_of_a_campaign_are_those_of_its_rows() -> None:
    with pytest.raises(ValidationError, match="the rows say"):
        SafeStops(runs=9, asked=5, unknown=0, rows=(stop(),))


def test_open_point_has_a_known_kind() -> None:
    with pytest.raises(ValidationError):
        OpenPoint.model_validate({"kind": "surprise", "subject": "FSR-01", "text": "x"})


def test_goal_has_an_asil() -> None:
    with pytest.raises(ValidationError):
        SafetyGoal.model_validate(
            {"id": "SG", "text": "x", "asil": "E", "hazards": [], "safe_state": "y"}
        )


def test_attribute_counts_what_is_feasible_and_what_is_covered() -> None:
    speed, light = coverage().attributes
    assert (speed.covered, speed.feasible) == (1, 2)
    assert (light.covered, light.feasible) == (2, 2)
    assert coverage().missing_pairs == 3


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"not_judged": 2}, "540 test cases, but 539 are told of"),
        ({"covered_pairs": 3}, "2 uncovered pairs are listed of 1"),
        ({"covered_pairs": 5}, "listed of -1"),
        ({"pairs": 2}, "listed of 3"),
    ],
)
def test_coverage_that_does_not_add_up_is_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        coverage(**changes)


def test_what_was_not_counted_need_not_add_up() -> None:
    found = coverage(refusal="too many", counted=0, not_judged=0)
    assert found.refusal == "too many"


def test_uncertainty_that_is_no_number_is_refused() -> None:
    with pytest.raises(ValidationError, match="finite"):
        line(uncertainty=float("nan"))


def test_evidence_that_holds_together_is_taken() -> None:
    found = evidence().takeovers
    assert found is not None
    assert found.runs == evidence().forked


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"measured": 7}, "7 measured"),
        ({"with_fault": 4}, "of 4 runs"),
        ({"forked": 11}, "11 runs are forked"),
        ({"takeovers": None}, "12 runs are forked"),
    ],
)
def test_counts_that_do_not_agree_are_refused(changes: dict[str, object], message: str) -> None:
    content = {**evidence().model_dump(), **changes}
    with pytest.raises(ValidationError, match=message):
        FaultEvidence.model_validate(content)


@pytest.mark.parametrize("changes", [{"activated": 5}, {"detected": 9}])
def test_group_that_counts_otherwise_than_its_classes_is_refused(changes: dict[str, int]) -> None:
    content = {**group().model_dump(), **changes}
    with pytest.raises(ValidationError, match="do not fit"):
        type(group()).model_validate(content)


def test_differences_that_decide_are_counted() -> None:
    assert impact().deciding == 1


@pytest.mark.parametrize("changes", [{"stale": None}, {"not_asked": "the file is gone"}])
def test_stale_evidence_is_told_or_why_not(changes: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match="either stale evidence is told"):
        impact(**changes)
    impact(stale=None, not_asked="the file is gone")


def test_stale_and_counting_evidence_are_all_of_it() -> None:
    stale = impact().stale
    assert stale is not None
    with pytest.raises(ValidationError, match="5 of 10 count, and 4 are stale"):
        impact(stale={**stale.model_dump(), "counts": 5})


def test_only_what_came_about_as_asked_is_realised() -> None:
    outcomes = {Outcome.COMPLETED: 4, Outcome.CHANNEL_ERROR: 1, Outcome.NOT_REALISED: 2}
    item = Realisation(scenario="a", design="", planned=9, executed=7, outcomes=outcomes)
    assert item.realised == 5
