"""The safety concept in the report: goals, FSRs, elements, decompositions."""

from dataclasses import replace
from datetime import date
from types import SimpleNamespace
from typing import Any

import pytest

from adeye.judge.verdict import Verdict
from adeye.report import concept as argued
from adeye.report import concept as contents
from adeye.report.model.report import Cell
from adeye.spec.concept import Concept, Decomposition, DependentFailure, Requirement, Waiver
from adeye.spec.load import load_odd, shipped
from adeye.store.read.checking import Violation
from adeye.store.rules import RULES
from tests.project import Executed
from tests.stored import known


@pytest.fixture(scope="module")
def content(mini: Executed) -> argued.CampaignContent:
    with mini.opened() as (repository, campaign):
        odd = repository.content("odd", campaign.odd_digest)
    return argued.CampaignContent(campaign, mini.plan.files.concept.spec, odd)


@pytest.fixture
def fsrs(mini: Executed) -> dict[str, Requirement]:
    return {item.id: item for item in mini.plan.files.concept.spec.requirements}


def test_architecture_is_listed_with_what_it_is_made_of(content: argued.CampaignContent) -> None:
    found = {item.id: item for item in argued.architectures_of(content)}
    parts = {name: {p.label: p.value for p in item.parts} for name, item in found.items()}
    assert parts["camera_radar"]["sensor front_radar"] == "radar"
    assert "sensor front_radar" not in parts["legacy_camera"]
    assert parts["legacy_camera"]["channel safety"] == "safety ← truth, channels.nominal, switch"
    assert parts["camera_radar"]["switch"] == "fixed_priority: safety > nominal"
    assert [item.id for item in found.values() if item.is_gate] == ["camera_radar"]
    assert found["camera_radar"].cost == 270


def test_scenario_has_its_exposure_per_hour_or_none(content: argued.CampaignContent) -> None:
    told = {item.id: item.exposure for item in argued.scenarios_of(content)}
    assert told == {"cut_in": "", "lead_braking": ""}
    uses = [dict(use) for use in content.odd["odd"]["scenarios"]]
    uses[0]["exposure"] = 0.6 / 3600.0
    odd = {**content.odd, "odd": {**content.odd["odd"], "scenarios": uses}}
    shown = {item.id: item for item in argued.scenarios_of(replace(content, odd=odd))}
    assert shown["cut_in"].exposure == "0.6 /h"
    assert {tag.label for tag in shown["cut_in"].tags} == {"iso34502", "nhtsa", "r157"}


def test_factors_say_how_the_cases_of_a_scenario_were_counted(
    content: argued.CampaignContent,
) -> None:
    factor = next(item for item in argued.factors_of(content) if item.scenario == "cut_in")
    assert (factor.points, factor.architectures, factor.replicates) == (4, 2, 1)
    assert factor.fault_entries == ("none", "front_camera_out", "nominal_silent")
    assert factor.test_cases == 4 * 3 * 2
    assert {axis.label: axis.value for axis in factor.axes}["gap"] == "30 m, 50 m"
    assert factor.command.startswith("adeye plan ")


def test_fsr_has_the_shortest_interval_of_its_goals_and_all_their_derived_asil(
    content: argued.CampaignContent, fsrs: dict[str, Requirement]
) -> None:
    shown = argued.fsr_of(content, fsrs["FSR-03"])
    assert (shown.ftti_s, shown.fdti_s, shown.frti_s) == (1.0, 0.5, None)
    both = fsrs["FSR-03"].model_copy(update={"goals": ("SG-01", "SG-02", "SG-03")})
    assert argued.fsr_of(content, both).ftti_s == 1.0
    for part, letters in (("hazards", "HE"), ("goals", "SG")):
        derived = {item.id: item.asil for item in argued.concept_of(content, ())[part]}
        assert derived == {f"{letters}-01": "D", f"{letters}-02": "D", f"{letters}-03": "C"}


def test_element_names_the_parts_that_realise_it_even_of_one_name(
    content: argued.CampaignContent,
) -> None:
    def realised(content: argued.CampaignContent) -> dict[str, tuple[str, ...]]:
        return {item.id: item.realised_by for item in argued.concept_of(content, ())["elements"]}

    found = realised(content)
    assert found["front_radar"] == ("camera_radar.front_radar",)
    assert set(found["switch"]) == {"legacy_camera.switch", "camera_radar.switch"}
    candidate = content.odd["architectures"]["camera_radar"]
    sensors = {**candidate["sensors"], "nominal": candidate["sensors"]["front_radar"]}
    twin = {**candidate, "sensors": sensors}
    odd = {**content.odd, "architectures": {"camera_radar": twin}}
    found = realised(replace(content, odd=odd))
    assert "camera_radar.nominal" in found["front_radar"]
    assert found["nominal_channel"] == ("camera_radar.nominal",)


def test_assumption_expires_the_day_after(
    content: argued.CampaignContent, monkeypatch: pytest.MonkeyPatch
) -> None:
    for day, expired in ((date(2027, 12, 31), False), (date(2028, 1, 1), True)):
        monkeypatch.setattr(contents, "today", lambda day=day: day)
        found = {item.is_expired for item in argued.concept_of(content, ())["assumptions"]}
        assert found == {expired}


def test_waiver_counts_the_runs_without_evidence_and_never_failures(
    content: argued.CampaignContent, monkeypatch: pytest.MonkeyPatch
) -> None:
    waiver = Waiver(requirement="FSR-03", reason="known", author="me", expires=date(2030, 6, 1))
    concept = content.concept.model_copy(update={"waivers": (waiver,)})
    counts = {Verdict.PASS: 5, Verdict.VACUOUS: 4, Verdict.FAIL: 3, Verdict.INCONCLUSIVE: 2}
    place = {"fsr": "FSR-03", "architecture": "camera_radar", "command": "adeye query"}
    sums = {"counts": counts, "exercised": 8, "runs": 14, "verdict": Verdict.FAIL}
    whole = Cell.model_validate({**place, **sums})
    part = whole.model_copy(update={"scenario": "cut_in"})
    for day, expired in ((date(2030, 6, 1), False), (date(2030, 6, 2), True)):
        monkeypatch.setattr(contents, "today", lambda day=day: day)
        (found,) = argued.concept_of(replace(content, concept=concept), [whole, part])["waivers"]
        assert (found.fsr, found.runs, found.is_expired) == ("FSR-03", 2, expired)


def test_measure_is_written_as_formula_or_bound(fsrs: dict[str, Requirement]) -> None:
    assert fsrs["FSR-01"].measure == "always(not contact)"
    second = fsrs["FSR-02"]
    assert second.measure == "max_required_deceleration_mps2 <= 6.0"
    least = known(second.bound).model_copy(update={"at_least": 0.0, "at_most": None})
    lower = second.model_copy(update={"bound": least})
    assert lower.measure == "max_required_deceleration_mps2 >= 0.0"


def test_suites_are_analysed_in_the_conditions_of_the_odd_and_with_its_resources(
    content: argued.CampaignContent,
) -> None:
    found = {suite.architecture: suite for suite in argued.suites_of(content)}
    assert set(found) == set(content.odd["architectures"])
    for suite in found.values():
        assert "power_a" in {item.what for item in suite.removals if item.kind == "resource"}
    limits = {
        "environment": {"rain": {"max": 7.5e-3 / 3600.0}, "illumination": ["day"]},
        "dynamic_elements": {"ego_speed": {"max": 36.0}},
    }
    odd = {**content.odd, "odd": {**content.odd["odd"], "attributes": limits}}
    wet = next(iter(argued.suites_of(replace(content, odd=odd))))
    assert [condition.id for condition in wet.conditions] == ["best", "rain"]
    assert wet.odd_speed_mps == 36.0


def test_what_channels_share_is_that_of_the_stored_files(content: argued.CampaignContent) -> None:
    found = {item.architecture: item for item in argued.dependencies_of(content)}
    assert set(found) == set(content.odd["architectures"])
    (pair,) = found["camera_radar"].pairs
    assert (pair.first, pair.second) == ("safety", "nominal")
    assert [item.what for item in pair.shared if item.kind == "influence"] == [
        "nominal → safety",
        "switch → safety",
    ]


def test_bounds_of_the_odd_are_written_in_their_units() -> None:
    odd = {
        "odd": {
            "attributes": {
                "scenery": {"road_type": ["motorway"], "lanes": {"min": 2, "max": 4}},
                "environment": {"rain": {"max": 7.5 / 3.6e6}, "fog": {"min_visibility": 80.0}},
                "dynamic_elements": {"ego_speed": {"max": 130.0 / 3.6}, "actors": []},
            }
        }
    }
    found = {item.label: item.value for item in argued.attributes_of(SimpleNamespace(odd=odd))}  # type: ignore[arg-type]
    assert found == {
        "road type": "motorway",
        "lanes": "at least 2, at most 4",
        "rain": "at most 7.5 mm/h",
        "fog": "at least 80 m",
        "ego speed": "at most 130 km/h",
    }


@pytest.fixture(scope="module")
def concept() -> Concept:
    """The shipped concept with a record and a decomposition put beside it."""
    found = load_odd(shipped("odd") / "motorway_chauffeur.yaml").concept.spec
    first, second, third, *others = found.requirements
    parts = [item.model_copy(update={"asil": "B(D)"}) for item in (second, third)]
    about = {"id": "DFA-1", "covers": ("power_a",), "argument": "buffered", "owner": "me"}
    record = DependentFailure.model_validate({**about, "valid_until": date(2026, 1, 31)})
    step = Decomposition(
        requirement=first.id, into=(second.id, third.id), independence="two", dfa=("DFA-1",)
    )
    return found.model_copy(
        update={
            "requirements": (first, *parts, *others),
            "decompositions": (step,),
            "dependent_failures": (record,),
        }
    )


def said(concept: Concept, part: str) -> Any:
    odd: Any = {"architectures": {}}
    campaign: Any = None
    return argued.concept_of(argued.CampaignContent(campaign, concept, odd), ())[part]


def test_decomposition_says_its_scheme(concept: Concept) -> None:
    (item,) = said(concept, "decompositions")
    assert item.scheme.count("B(D)") == 2
    assert (item.fsr, item.into, item.dfa) == ("FSR-01", ("FSR-02", "FSR-03"), ("DFA-1",))


def test_record_expires_after_its_last_day(
    concept: Concept, monkeypatch: pytest.MonkeyPatch
) -> None:
    for day, expired in ((date(2026, 1, 31), False), (date(2026, 2, 1), True)):
        monkeypatch.setattr(contents, "today", lambda day=day: day)
        (item,) = said(concept, "dependent_failures")
        assert item.is_expired is expired


def test_finding_says_its_rule_and_the_remedy() -> None:
    (item,) = argued.findings_of([Violation(RULES[0].name, "fsr", "FSR-1", "is wrong")])
    assert (item.text, item.remedy, item.id) == (RULES[0].text, RULES[0].remedy, "FSR-1")
