"""The rules about evidence; that each finds its defect is shown in test_checking.py."""

from collections import Counter
from typing import Any

import pytest

from adeye.store.read.checking import EVIDENCE_RULES, check_campaign, check_plan
from adeye.store.repository import Repository
from adeye.store.rules import CAMPAIGN_RULES, check_view_ddl


def test_plan_rules_ask_no_table_of_results() -> None:
    views = check_view_ddl()
    for rule in (rule for rule in CAMPAIGN_RULES if rule.has_view):
        words = views[rule.view]
        is_about_runs = any(name in words for name in ("tally", " run ", "v_case_counts"))
        assert rule.needs_evidence == is_about_runs, rule.name


def test_campaign_that_was_only_planned_has_not_run(repository: Repository, example: Any) -> None:
    repository.plan_campaign(example.record(), example.cases(8), block_size=3)
    checked = check_campaign(repository.location, rules=EVIDENCE_RULES)
    assert checked is not None
    assert [(item.rule, item.id, item.detail) for item in checked.violations] == [
        ("not_run", scenario, f"2 of 2 test cases of {architecture} have no result")
        for scenario in ("braking", "cut_in")
        for architecture in ("legacy", "new")
    ]


@pytest.mark.slow
def test_another_threshold_makes_evidence_stale_until_it_is_judged(
    repository: Repository, example: Any
) -> None:
    example.campaign(repository, 8)
    example.thresholds["FSR1"] = "another"
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=3)
    checked = check_campaign(repository.location, rules=EVIDENCE_RULES)
    assert checked is not None
    assert {(item.rule, item.id) for item in checked.violations} >= {("stale_evidence", "FSR1")}
    example.work_off(repository, plan.campaign)
    checked = check_campaign(repository.location, rules=EVIDENCE_RULES)
    assert checked is not None
    assert checked.violations == ()


def test_requirement_of_scenarios_that_are_not_planned_has_none(example: Any) -> None:
    changed = example.requirements[0].model_copy(update={"scenarios": ("fog",)})
    example.requirements = (changed, *example.requirements[1:])
    found = check_plan(example.record(), Counter({("new", "cut_in", True): 1}))
    assert {item.id for item in found if item.rule == "fsr_without_scenario"} == {"FSR1", "FSR3"}
