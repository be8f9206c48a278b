"""Parts of a report contradict neither themselves nor what they are read from."""

import math
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.judge.verdict import Outcome, Verdict
from adeye.report.model.assessment import SafeStops
from adeye.report.model.concept import Realisation
from adeye.report.model.evidence import StepLine
from adeye.report.model.part import Binding, Label, Margin, Part, RunVerdict
from adeye.report.model.report import Report
from tests.report import parts
from tests.stored import known


def test_a_field_that_the_source_lacks_is_no_default() -> None:
    judged = RunVerdict(fsr="FSR-01", verdict=Verdict.PASS, margin=None, binding=None, note="x")
    assert RunVerdict.of(judged, note="") == judged.model_copy(update={"note": ""})
    with pytest.raises(AttributeError, match="note"):
        RunVerdict.of(Label(label="FSR-01", value="PASS"), fsr="", verdict=Verdict.PASS,
                      margin=None, binding=None)  # fmt: skip


def test_no_part_takes_what_is_not_finite_misspelt_or_changed() -> None:
    for value in (math.nan, math.inf, -math.inf):
        with pytest.raises(ValidationError, match="finite"):
            Margin(value=value, unit="m")
    with pytest.raises(ValidationError, match="Extra inputs"):
        Label.model_validate({"label": "a", "value": "b", "vlaue": "c"})
    with pytest.raises(ValidationError, match="frozen"):
        Label(label="a", value="b").value = "c"  # type: ignore[misc]
    for kind in (Report, StepLine):
        assert issubclass(kind, Part)


def test_binding_keeps_the_kind_of_its_value() -> None:
    for value in (True, 1.5, "silent", None):
        binding = Binding.model_validate({"predicate": "p", "signal": "s", "value": value})
        again = Binding.model_validate_json(binding.model_dump_json())
        assert again.value == value
        assert type(again.value) is type(value)


def refused(part: Part, changes: dict[str, Any], says: str) -> None:
    """A part does not take other content, and says why."""
    with pytest.raises(ValidationError, match=says):
        type(part).model_validate({**part.model_dump(), **changes})


def test_counts_that_contradict_each_other_are_refused() -> None:
    told = parts.preventability()
    [tally] = told.tallies
    assert tally.runs == 6
    refused(told, {"findings": 1}, "2 runs are avoided by the model only, 1 are findings")
    refused(told, {"compared": 0}, "0 runs are compared, in 1 tallies")
    counts = {name: count for name, count in tally.counts.items() if name != "unknown"}
    lacking = {**tally.model_dump(), "counts": counts}
    refused(told, {"tallies": [lacking]}, "does not count every cell")
    refused(parts.evidence(), {"measured": 7}, "7 measured")
    refused(parts.evidence(), {"with_fault": 4}, "of 4 runs")
    refused(parts.evidence(), {"forked": 11}, "11 runs are forked")
    refused(parts.evidence(), {"takeovers": None}, "12 runs are forked")
    refused(parts.group(), {"activated": 5}, "do not fit")
    refused(parts.group(), {"detected": 9}, "do not fit")
    refused(parts.coverage(), {"not_judged": 2}, "540 test cases, but 539 are told of")
    refused(parts.coverage(), {"covered_pairs": 3}, "2 uncovered pairs are listed of 1")
    refused(parts.coverage(), {"covered_pairs": 5}, "listed of -1")
    refused(parts.coverage(), {"pairs": 2}, "listed of 3")
    refused(parts.stop(), {"asked": 5}, "do not add up|has a place")
    refused(parts.stop(), {"places": ()}, "do not add up|has a place")
    refused(known(parts.impact().stale), {"counts": 5}, "5 of 10 count, and 4 are stale")
    with pytest.raises(ValidationError, match="the rows say"):
        SafeStops(runs=9, asked=5, unknown=0, rows=(parts.stop(),))


def test_what_is_not_measured_never_passes() -> None:
    for measured, handled in ((3, 3), (4, 0)):
        with pytest.raises(ValidationError, match="PASS, but"):
            parts.fault_timing(measured=measured, handled=handled)
        parts.fault_timing(measured=measured, handled=handled, verdict=Verdict.NOT_RUN)


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, Verdict.FAIL),
        ({"contact": 0, "moving": 1, "places": parts.stop().places[1:]}, Verdict.INCONCLUSIVE),
        ({"contact": 0, "asked": 3, "places": parts.stop().places[1:]}, Verdict.PASS),
        ({"contact": 0, "asked": 3, "places": parts.stop().places[1:], "unknown": 1},
         Verdict.INCONCLUSIVE),
        ({"contact": 0, "asked": 0, "reached": 0, "places": ()}, Verdict.VACUOUS),
    ],
)  # fmt: skip
def test_stop_is_shown_only_where_all_stand(changes: dict[str, Any], verdict: Verdict) -> None:
    assert parts.stop(**changes).verdict is verdict


def test_attribute_counts_what_is_feasible_and_what_is_covered() -> None:
    speed, light = parts.coverage().attributes
    assert (speed.covered, speed.feasible) == (1, 2)
    assert (light.covered, light.feasible) == (2, 2)


def test_what_was_not_counted_need_not_add_up() -> None:
    found = parts.coverage(refusal="too many", counted=0, not_judged=0)
    assert found.refusal == "too many"


def test_evidence_that_holds_together_is_taken() -> None:
    found = known(parts.evidence().takeovers)
    assert found.runs == parts.evidence().forked


def test_stale_evidence_is_told_or_why_not() -> None:
    for changes in ({"stale": None}, {"not_asked": "the file is gone"}):
        with pytest.raises(ValidationError, match="either stale evidence is told"):
            parts.impact(**changes)
    parts.impact(stale=None, not_asked="the file is gone")
    assert parts.impact().deciding == 1


def test_only_what_came_about_as_asked_is_realised() -> None:
    outcomes = {Outcome.COMPLETED: 4, Outcome.CHANNEL_ERROR: 1, Outcome.NOT_REALISED: 2}
    item = Realisation(scenario="a", design="", planned=9, executed=7, outcomes=outcomes)
    assert item.realised == 5
