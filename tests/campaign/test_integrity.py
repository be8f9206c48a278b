"""Concept, plan and evidence fit together, and what of the ODD they cover."""

from __future__ import annotations

from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

import pytest

from adeye.campaign.integrity import check_odd, check_stored, executed_coverage, planned_coverage
from adeye.errors import SpecError
from adeye.judge.verdict import Verdict
from adeye.spec.load import shipped
from adeye.store.read.checking import Checked, Violation
from adeye.store.repository import Repository
from adeye.store.rules import RULES
from tests.conftest import MakeProject
from tests.project import CONCEPT, Executed, Project, one_scenario
from tests.stored import known

# --- checking files and what is stored of them: what is found, and where in the files it is


MAY_EXPIRE = date(2027, 12, 31)
"""Until then the assumptions of the shipped concepts are valid."""


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("odd", sorted(shipped("odd").glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_files_break_no_rule(odd: Path, tmp_path: Path) -> None:
    if odd.stem == "million":
        pytest.skip("it has the concept of motorway_chauffeur, and a million test cases")
    found = check_odd(odd, tmp_path / "none.db").findings
    if datetime.now(UTC).date() > MAY_EXPIRE:
        found = tuple(item for item in found if item.rule != "expired_assumption")
    assert found == ()


def find(project: Project, db: Path | None = None) -> tuple[Violation, ...]:
    return check_odd(project.odd, db or project.folder / "none.db").findings


def line_of(project: Project, finding: Violation) -> str:
    assert finding.where is not None
    lines = (project.folder / finding.where.path).read_text("utf-8").splitlines()
    return lines[finding.where.line - 1].strip()


WAIVER = {"requirement": "FSR-01", "reason": "text", "author": "me", "expires": "2001-01-31"}


def edit_capability(content: Any) -> None:
    content["elements"][0]["asil_capability"] = "B"
    content["requirements"] = [
        item for item in content["requirements"] if item["id"] not in {"FSR-07", "FSR-08"}
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("edit", "rule", "line"),
    [
        (lambda it: it["assumptions"][0].update(valid_until="2001-01-31"),
         "expired_assumption", "valid_until: '2001-01-31'"),
        (lambda it: it.update(waivers=[WAIVER]), "expired_waiver", "expires: '2001-01-31'"),
        (edit_capability, "element_capability", "- front_camera"),
        (lambda it: it["requirements"][2].update(fdti="1 s", frti="1 s"),
         "fhti_budget", "fdti: 1 s"),
    ],
    ids=["assumption", "waiver", "capability", "budget"],
)  # fmt: skip
def test_finding_has_its_line(project: Project, edit: Any, rule: str, line: str) -> None:
    with project.edited(CONCEPT) as content:
        edit(content)
    (finding,) = find(project)
    assert (finding.rule, line_of(project, finding)) == (rule, line)


def test_orphan_scenario_is_found_where_the_odd_uses_it(project: Project) -> None:
    with project.edited(CONCEPT) as content:
        for item in content["requirements"]:
            item["scenarios"] = ["cut_in"]
    (finding,) = find(project)
    assert (finding.rule, finding.id) == ("orphan_scenario", "lead_braking")
    assert line_of(project, finding) == "- use: lead_braking"


@pytest.mark.slow
def test_files_are_compared_with_the_newest_evidence(project: Project) -> None:
    plan = project.plan()
    with Repository.open(project.db) as repository:
        planned = repository.plan_campaign(plan.record(), plan.planned())
    checked = check_odd(project.odd, project.db)
    assert checked.rules == RULES
    assert known(checked.campaign).id == planned.campaign
    assert {item.rule for item in checked.findings} == {"not_run"}

    def stale() -> list[Violation]:
        found = [item for item in find(project, project.db) if item.rule == "stale_evidence"]
        return sorted(found, key=lambda item: item.part, reverse=True)

    with project.edited(CONCEPT) as content:
        content["requirements"][0]["text"] = "Another wording of the same."
    assert {item.rule for item in find(project, project.db)} == {"not_run"}
    with project.edited(CONCEPT) as content:
        content["requirements"][1]["bound"]["at_most"] = 5.0
    told = [("fsr", "FSR-02", "judges otherwise than campaign 1")]
    assert [(item.part, item.id, item.detail) for item in stale()] == told
    with project.edited_odd() as odd:
        odd["title"] = "Another title"
    assert [item.part for item in stale()] == ["fsr"]
    with project.edited_odd() as odd:
        odd["scenarios"][1]["sweep"]["parameters"]["deceleration"].append("5 m/s^2")
    first, second = stale()
    assert (first.part, second.part) == ("odd", "fsr")
    assert first.detail == "2 of 30 test cases that it asks for now have no result"
    assert line_of(project, first) == "odd: mini"


@pytest.mark.slow
def test_stored_campaign_is_checked_without_files(project: Project) -> None:
    assert check_stored(project.db) is None
    plan = project.plan()
    with Repository.open(project.db) as repository:
        assert check_stored(project.db) is None
        repository.plan_campaign(plan.record(), plan.planned())
    checked = check_stored(project.db, "1")
    assert isinstance(checked, Checked)
    assert (checked.odd, checked.path, checked.rules) == ("mini", None, RULES)
    assert [rule.name for rule in checked.broken] == ["not_run"]
    assert {item.where for item in checked.findings} == {None}


@pytest.mark.slow
def test_executed_campaign_breaks_no_rule(project: Project) -> None:
    project.run()
    checked = check_odd(project.odd, project.db)
    assert checked.rules == RULES
    assert checked.findings == ()


@pytest.mark.slow
def test_faults_that_change_nothing_are_named(project: Project) -> None:
    weak = {"id": "weak", "target": "channels.nominal", "model": "bias", "onset": {"at": "2 s"}}
    weak |= {"acceleration": "1 m/s^2"}
    with project.edited_odd() as odd:
        odd["faults"] += [weak, {**weak, "id": "unused"}]
        sizes = {"faults.weak.acceleration": ["0 m/s^2", "1 m/s^2"]}
        faults = ["front_camera_out", ["nominal_silent", "weak"]]
        odd["scenarios"] = [{"use": "cut_in", "faults": faults, "sweep": {"parameters": sizes}}]
    idle = [item for item in find(project) if item.rule == "idle_fault"]
    expected = [
        ("weak", "weak changes nothing: bias with acceleration 0 and steering_angle 0"),
        ("unused", "unused is injected in no test case"),
    ]
    assert [(item.id, item.detail) for item in idle] == expected
    assert line_of(project, idle[0]) == "model: bias"
    plan = project.plan()
    assert [f"fault {detail}" for _, detail in expected] == list(plan.notices)[-2:]
    with Repository.open(project.db) as repository:
        repository.plan_campaign(plan.record(), plan.planned())
    stored = known(check_stored(project.db))
    again = [(item.id, item.detail) for item in stored.findings if item.rule == "idle_fault"]
    assert again == expected


@pytest.mark.slow
def test_run_of_faults_and_events_that_never_come_is_not_green(project: Project) -> None:
    far: dict[str, Any] = {"id": "far", "target": "channels.nominal", "model": "silent"}
    far["onset"] = {"when": "cutter.gap >= 900 m"}
    with project.edited("scenarios_db/motorway/cut_in.yaml") as scenario:
        del scenario["storyboard"]["change_speed"]["optional"]
    with project.edited_odd() as odd:
        odd["faults"] = [far]
        odd["scenarios"] = odd["scenarios"][:1]
        odd["scenarios"][0]["faults"] = ["far"]
        odd["architectures"] = odd["architectures"][1:]
    summary = project.run()
    assert int(summary.exit_code) == 3
    assert summary.never_began == ("change_speed of cut_in",)
    rows = project.rows()
    told = {(row["fault_entry"], row["outcome"], row["outcome_detail"]) for row in rows}
    assert told == {
        ("none", "completed", None),
        ("far", "not_realised", "fault far did not act within the horizon"),
    }
    verdicts = {item.fsr: item for item in summary.verdicts}
    assert verdicts["FSR-01"].verdict is Verdict.INVALID
    assert verdicts["FSR-01"].exercised * 2 == verdicts["FSR-01"].runs
    found = {(item.rule, item.id, item.detail) for item in find(project, project.db)}
    assert ("unbegun_event", "cut_in", "change_speed began in no run") in found


def test_event_that_changes_nothing_is_told(make_project: MakeProject) -> None:
    """A run of it is realised, and shows nothing about who cuts in."""
    project = make_project(one_scenario())
    with project.edited("scenarios_db/motorway/cut_in.yaml") as scenario:
        scenario["storyboard"]["cut_in"]["lane_change"] = {"by": "0 m", "lateral_speed": "1 m/s"}
    summary = project.run()
    assert summary.idle_events == ("cut_in of cut_in",)
    found = {(item.rule, item.id, item.detail) for item in find(project, project.db)}
    assert ("idle_event", "cut_in", "cut_in changed nothing in any run") in found
    assert {row["outcome"] for row in project.rows()} == {"completed"}


def test_speed_that_is_kept_while_the_lane_is_changed_is_told(make_project: MakeProject) -> None:
    """Who changes lane moves faster than along the road, and that is another event's doing."""
    project = make_project(one_scenario())
    with project.edited("scenarios_db/motorway/cut_in.yaml") as scenario:
        kept = {"to": "ego_speed + relative_speed", "rate": "1 m/s^2"}
        beside = {"actor": "cutter", "when": scenario["storyboard"]["cut_in"]["when"]}
        scenario["storyboard"]["change_speed"] = {**beside, "optional": True, "speed": kept}
    assert project.run().idle_events == ("change_speed of cut_in",)


# --- coverage of a plan and of its campaign: equal once everything is executed


def test_executed_campaign_covers_what_was_planned(mini: Executed) -> None:
    planned = planned_coverage(mini.project.odd, 2)
    executed = executed_coverage(mini.db, None, 2)
    assert (planned.planned, planned.counted) == (28, 28)
    assert executed.planned == 28
    assert executed.counted == 28 - executed.not_judged
    if not executed.not_judged:
        assert executed.coverage == planned.coverage


def test_what_a_swept_path_takes_from_a_scenario_is_a_gap(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        odd["coverage"] = {"ego_speed": ["60 km/h", "100 km/h", "130 km/h"]}
        # No other scenario has what this one loses.
        odd["scenarios"] = odd["scenarios"][:1]
        odd["scenarios"][0]["sweep"]["parameters"] = {"scenario.ego.speed": ["70 km/h"]}
    project.run()
    for found in (planned_coverage(project.odd, 1), executed_coverage(project.db, None, 1)):
        (speed,) = [i for i in found.coverage.combinations if i.attributes == ("ego_speed",)]
        assert (speed.feasible, speed.covered) == (2, 1)
        assert speed.uncovered == (("100 to 130 km/h",),)


@pytest.mark.slow
def test_declared_bins_change_the_coverage_and_no_test_case(make_project: MakeProject) -> None:
    project = make_project()
    before = [case.digest for case in project.plan().cases]
    with project.edited_odd() as odd:
        odd["coverage"] = {"ego_speed": ["60 km/h", "100 km/h", "130 km/h"]}
    found = planned_coverage(project.odd, 1)
    (speed,) = [i for i in found.coverage.combinations if i.attributes == ("ego_speed",)]
    assert (speed.feasible, speed.covered) == (2, 2)
    assert [case.digest for case in project.plan().cases] == before


def test_odd_without_bins_stores_nothing_about_them(make_project: MakeProject) -> None:
    content = make_project().plan().files.odd.spec.model_dump(mode="json")
    assert "coverage" not in content
    assert "strength" not in content["scenarios"][0]["sweep"]


def test_cases_outside_the_odd_count_nowhere(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        odd["attributes"] = {"dynamic_elements": {"ego_speed": {"max": "90 km/h"}}}
        odd["outside"] = "robustness"
    found = planned_coverage(project.odd, 1)
    assert found.counted + found.outside_odd == found.planned == 28
    # Cut-ins at 120 km/h: two gaps, three fault entries, two architectures.
    assert found.outside_odd == 2 * 3 * 2


def test_bins_beyond_the_odd_are_refused_with_their_line(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        odd["attributes"] = {"dynamic_elements": {"ego_speed": {"max": "130 km/h"}}}
        odd["coverage"] = {"ego_speed": ["140 km/h", "160 km/h"]}
    with pytest.raises(SpecError, match="ego_speed: no bin lies within") as caught:
        planned_coverage(project.odd, 1)
    assert caught.value.where is not None
    assert caught.value.where.path.endswith("tested.yaml")
